"""Coordinates of a drill file: digits whose decimal point is often left out.

``X0388550`` means nothing by itself.  A number format (2:4, say: two digits
before the point and four behind) and the rule which zeros are *kept* (LZ:
leading, so trailing ones may be missing; TZ: the reverse) give it a value.
Numbers of full width need no such rule, numbers with a point need neither.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction

from tcp.errors import UsageError
from tcp.words import shown

PLACES = 9
"""Decimals of the integers that coordinates are read into."""

_POWERS: tuple[int, ...] = tuple(10**k for k in range(2 * PLACES))


class Units(StrEnum):
    """Units of length."""

    MM = "mm"
    INCH = "inch"

    @property
    def in_mm(self) -> Fraction:
        """Millimetres to the unit."""
        return Fraction(1) if self is Units.MM else Fraction(254, 10)


class Zeros(StrEnum):
    """Which zeros are kept: LZ the leading, TZ the trailing ones."""

    LZ = "lz"
    TZ = "tz"


@dataclass(frozen=True)
class Digits:
    """A number format: digits before and behind the point that is left out."""

    whole: int
    decimals: int

    def __post_init__(self) -> None:
        if not (0 <= self.whole <= 6 and 0 <= self.decimals <= PLACES and self.width > 0):
            raise UsageError(f"{self} is no number format; expected something like 2:4 or 3:3")

    def __str__(self) -> str:
        return f"{self.whole}:{self.decimals}"

    @property
    def width(self) -> int:
        """Digits of a number of full width."""
        return self.whole + self.decimals


def parse_digits(text: str) -> Digits:
    """A format from ``2:4`` or ``2.4``.

    Raises
    ------
    UsageError
        If the text is none.
    """
    found = re.fullmatch(r"(\d{1,2})[:.](\d{1,2})", text, re.ASCII)
    if found is None:
        raise UsageError(f"{shown(text)} is no number format; expected something like 2:4 or 3:3")
    return Digits(int(found[1]), int(found[2]))


def pointed(text: bytes) -> tuple[int, int]:
    """Value of a number with a point, in units of ``10**-PLACES``, and its decimals.

    Raises
    ------
    ValueError
        For more decimals or a larger value than a coordinate has.
    """
    head, _, tail = text.partition(b".")
    if len(tail) > PLACES or len(head) > 8:
        raise ValueError
    negative = head[:1] == b"-"
    value = (
        int(head.lstrip(b"+-") or b"0") * _POWERS[PLACES]
        + int(tail or b"0") * _POWERS[PLACES - len(tail)]
    )
    return (-value if negative else value), len(tail)


def unpointed(text: bytes, digits: Digits, zeros: Zeros | None) -> int | None:
    """Value of a number without a point in units of ``10**-PLACES``.

    None where the number is short and nobody says which zeros are missing.

    Raises
    ------
    ValueError
        If the number has more digits than the format.
    """
    bare = text.lstrip(b"+-")
    missing = digits.width - len(bare)
    if missing < 0:
        raise ValueError
    if missing and zeros is None:
        return None
    value = int(text) * _POWERS[PLACES - digits.decimals]
    return value * _POWERS[missing] if missing and zeros is Zeros.LZ else value


@dataclass(frozen=True)
class Style:
    """How a file writes its numbers, for those that have to be written anew.

    Parameters
    ----------
    places : int
        Decimals of the file's own integer units.
    digits : Digits or None
        The format of numbers without a point; None: all carry one.
    zeros : Zeros or None
        Which zeros the file keeps; None: numbers have full width.
    plus : bool
        Whether positive numbers carry a sign.
    """

    places: int
    digits: Digits | None
    zeros: Zeros | None
    plus: bool = False

    def write(self, value: int) -> bytes:
        """Text of a value in the file's own integer units."""
        sign = b"-" if value < 0 else b"+" if self.plus else b""
        digits = self.digits
        if digits is not None and value % 10 ** (self.places - digits.decimals) == 0:
            bare = b"%0*d" % (digits.width, abs(value) // 10 ** (self.places - digits.decimals))
            if len(bare) == digits.width:
                return sign + self._shorten(bare)
        bare = b"%0*d" % (self.places + 1, abs(value))
        cut = len(bare) - self.places
        return sign + bare[:cut] + b"." + (bare[cut:].rstrip(b"0") or bare[cut : cut + 1])

    def _shorten(self, bare: bytes) -> bytes:
        if self.zeros is Zeros.LZ:
            return bare.rstrip(b"0") or b"0"
        if self.zeros is Zeros.TZ:
            return bare.lstrip(b"0") or b"0"
        return bare


def tool_number(text: str) -> int | None:
    """The tool that a user names, as ``3`` or ``T3``; None if it is no tool."""
    found = re.fullmatch(r"T?(\d{1,9})", text.strip().upper(), re.ASCII)
    return None if found is None else int(found[1])
