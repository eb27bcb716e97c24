"""A number as somebody printed it: its value, and how many digits back it up.

``235.2`` says less than ``235.20``: the first agrees with 235.25, the second
does not.  Nothing here is a binary float.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal
from enum import StrEnum
from fractions import Fraction

from tcp.errors import InputError

MAX_LENGTH = 100
MAX_EXPONENT = 1000

_PLAIN = r"[+-]?(?:\d{1,3}(?:[, ]\d{3})+|\d+)(?:\.\d+)?|[+-]?\.\d+"
_NUMBER = re.compile(rf"({_PLAIN})(?:\s*[eE]\s*([+-]?)\s*(\d{{1,6}}))?\s*(%?)", re.ASCII)


class Agreement(StrEnum):
    """How an exact value relates to a printed one."""

    EXACT = "exact"
    ROUNDED = "rounded"
    CUT = "cut off"
    DIFFERENT = "different"

    @property
    def holds(self) -> bool:
        """Whether the printed number stands for the exact value."""
        return self is not Agreement.DIFFERENT


@dataclass(frozen=True)
class Printed:
    """A printed number.

    Parameters
    ----------
    text : str
        As printed.
    value : Fraction
        What the text says, exactly; a percentage is divided by 100.
    unit : Fraction
        Worth of one unit of the last printed digit, > 0.
    percent : bool
        Whether the text carries a percent sign.
    """

    text: str
    value: Fraction
    unit: Fraction
    percent: bool = False

    def __str__(self) -> str:
        return self.text

    def agreement(self, exact: Fraction, slack: Fraction = Fraction(0)) -> Agreement:
        """Whether ``exact``, known to within ``slack``, can be printed like this.

        Rounding is half up; a number that only cutting off (or rounding half
        to even) explains is :attr:`Agreement.CUT`.
        """
        off = exact - self.value
        if not off:
            return Agreement.EXACT
        if -self.unit / 2 - slack <= off < self.unit / 2 + slack:
            return Agreement.ROUNDED
        outwards = off if self.value >= 0 else -off
        if 0 < outwards < self.unit + slack:
            return Agreement.CUT
        return Agreement.DIFFERENT


def parse_printed(text: str | int | Decimal) -> Printed:
    """Read a printed number: ``1,750.381``, ``10 000``, ``4.96E-1%``, ``6.0828e62``.

    Raises
    ------
    InputError
        For NaN, infinities, words, and magnitudes beyond all measure.
    """
    if isinstance(text, (bool, float)):
        raise InputError(f"{text!r} is not a printed number; write its digits as text")
    shown = str(text).strip()
    if len(shown) > MAX_LENGTH:
        raise InputError(f"a number of {len(shown)} characters; at most {MAX_LENGTH} are read")
    match = _NUMBER.fullmatch(shown.replace("_", ""))
    if match is None:
        raise InputError(f"{shown!r} is not a finite number; expected digits such as 1460.216")
    plain, sign, power, percent = match.groups()
    exponent = int(power or 0) * (-1 if sign == "-" else 1)
    if abs(exponent) > MAX_EXPONENT:
        raise InputError(f"{shown!r} is beyond all measure; exponents reach {MAX_EXPONENT}")
    digits = plain.replace(",", "").replace(" ", "")
    decimals = len(digits.partition(".")[2])
    scale = Fraction(10) ** exponent / (100 if percent else 1)
    return Printed(shown, Fraction(digits) * scale, scale / 10**decimals, bool(percent))
