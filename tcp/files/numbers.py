"""Columns of decimal numbers, exactly and fast: digits to integers, no floats, no Decimals."""

from __future__ import annotations

import re
from decimal import Context

import numpy as np

from tcp.errors import InputError
from tcp.words import shown
from tcp.workpiece import MAX_DIGITS, MAX_STEPS, Ints, exact_decimal

_PLAIN = re.compile(r"[+-]?(?:[0-9]{1,15}(?:\.[0-9]{0,15})?|\.[0-9]{1,15})")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,9})?")

MAX_PLACES = 15
"""Most decimal places of a coordinate: a femtometre is no workpiece's grid."""


class Decimals:
    """A column of decimal numbers, kept as integers with their number of decimal places.

    Parameters
    ----------
    decimal_comma : bool
        Whether ``12,5`` may be written for 12.5.
    """

    def __init__(self, decimal_comma: bool = False):
        self._comma = decimal_comma
        self._digits: list[int] = []
        self._places: list[int] = []

    def add(self, text: str) -> None:
        """Append the number that ``text`` is.

        Raises
        ------
        InputError
            If it is none; the sentence names the text but no place.
        """
        dotted = text.replace(",", ".") if self._comma and "." not in text else text
        if _PLAIN.fullmatch(dotted):
            whole, _, fraction = dotted.partition(".")
            self._digits.append(int(whole + fraction))
            self._places.append(len(fraction))
        else:
            self._add_unusual(dotted, text)

    def _add_unusual(self, text: str, printed: str) -> None:
        """Exponents, more digits than usual, and all that is not a number."""
        if not text:
            raise InputError("an empty cell where a number belongs")
        if not _NUMBER.fullmatch(text):
            finite = text.lower().lstrip("+-") not in ("nan", "inf", "infinity")
            kind = "is not a number" if finite else "is not a finite number"
            raise InputError(f"{shown(printed)} {kind}; expected a coordinate such as 12.5")
        try:
            value = exact_decimal(text)
        except InputError:
            message = f"{shown(printed)} is beyond any workpiece; expected mm or inch"
            raise InputError(message) from None
        value = value.normalize(Context(prec=2 * MAX_DIGITS))
        sign, digits, exponent = value.as_tuple()
        assert isinstance(exponent, int)
        number = int("".join(map(str, digits))) * (-1 if sign else 1)
        self._digits.append(number * 10 ** max(exponent, 0))
        self._places.append(max(-exponent, 0))

    def __len__(self) -> int:
        return len(self._digits)


class TooFine(Exception):
    """Row ``row`` of a column does not fit the grid that all rows together need."""

    def __init__(self, row: int, places: int):
        super().__init__(
            f"with {places} decimal places this coordinate needs more than 2^52 steps; "
            "round the coordinates or check the units"
        )
        self.row, self.places = row, places


def common_steps(*columns: Decimals) -> tuple[list[Ints], int]:
    """Columns of one length as whole steps of ``10^-places``, the coarsest grid for all.

    Returns
    -------
    (list of int64 arrays, int)
        Steps for each column, and the places.

    Raises
    ------
    TooFine
        If a number needs more than 2^52 steps of that grid.
    """
    numbers = [number for column in columns for number in column._digits]
    places = np.array([p for column in columns for p in column._places], dtype=np.int64)
    most, n = int(places.max()), len(columns[0])
    if max(map(abs, numbers)) >= 2**62:
        raise TooFine(max(range(len(numbers)), key=lambda i: abs(numbers[i])) % n, most)
    digits = np.array(numbers, dtype=np.int64)
    while (idle := (places > 0) & (digits % 10 == 0)).any():  # 12.50 needs one place, not two
        digits[idle] //= 10
        places[idle] -= 1
    most = int(places.max())
    if most > MAX_PLACES:
        raise TooFine(int(places.argmax()) % n, most)
    factor = 10 ** (most - places)
    beyond = np.abs(digits) > MAX_STEPS // factor
    if beyond.any():
        raise TooFine(int(beyond.argmax()) % n, most)
    return np.split(digits * factor, len(columns)), most
