"""Runs of plain hits, nearly all of a file, read with arrays instead of strings.

A run is lines of ``X#``, ``Y#`` or ``X#Y#`` and nothing else but blanks behind
numbers.  Whatever is unusual about its numbers is left to the line by line
reader, which knows how to say what is wrong and where.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcp.files.excellon.document import Ints
from tcp.files.excellon.numbers import PLACES, Digits, Zeros

LONGEST = 17
"""Most characters of a number here, sign and point included."""

Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Numbers:
    """Numbers as written: digits as an integer, and how many of them stand where.

    Parameters
    ----------
    digits : int64 array
        All digits as one integer, without sign and point.
    count, decimals : int64 arrays
        Digits in all, and behind the point.
    pointed, negative, plus : bool arrays
        Whether a number has a point, a minus, a plus.
    """

    digits: Ints
    count: Ints
    decimals: Ints
    pointed: Bools
    negative: Bools
    plus: Bools

    def values(self, digits: Digits, zeros: Zeros | None) -> Ints | None:
        """Values in units of ``10**-PLACES``; None where one has no value or too many digits."""
        bare = ~self.pointed
        missing = np.where(bare, digits.width - self.count, 0)
        signs = self.negative | self.plus
        if (missing < 0).any() or (zeros is None and (missing > 0).any()):
            return None
        if (
            self.pointed & ((self.decimals > PLACES) | (self.count - self.decimals + signs > 8))
        ).any():
            return None
        behind = np.where(bare, digits.decimals, self.decimals)
        shift = PLACES - behind + (missing if zeros is Zeros.LZ else 0)
        values: Ints = np.where(self.negative, -1, 1) * self.digits * np.power(10, shift)
        return values


@dataclass(frozen=True, eq=False)
class Run:
    """The words of a run: numbers, their lines (from 0), and which of them are X."""

    lines: int
    numbers: Numbers
    line: Ints
    is_x: Bools


def read_run(run: bytes) -> Run | None:
    """Cut a run into numbers; None if one of them is too long to be read here."""
    text = np.frombuffer(run, dtype=np.uint8)
    letter = (text == ord("X")) | (text == ord("Y"))
    newline = text == 10
    breaks = np.flatnonzero(letter | newline | (text == 13) | (text == 32))
    at = np.flatnonzero(letter[breaks])
    start, stop = breaks[at] + 1, breaks[at + 1]
    if int((stop - start).max()) > LONGEST:
        return None
    line = (np.cumsum(newline) - newline)[start - 1]
    return Run(int(newline.sum()), _numbers(text, start, stop), line, text[start - 1] == ord("X"))


def _numbers(text: NDArray[np.uint8], start: Ints, stop: Ints) -> Numbers:
    first = text[start]
    negative, plus = first == ord("-"), first == ord("+")
    digits, count, decimals = (np.zeros(len(start), dtype=np.int64) for _ in range(3))
    pointed = np.zeros(len(start), dtype=np.bool_)
    at = start + (negative | plus)
    while (inside := at < stop).any():
        here = text[np.minimum(at, len(text) - 1)]
        point = inside & (here == ord("."))
        digit = inside & ~point
        digits[digit] = digits[digit] * 10 + (here[digit] - ord("0"))
        count += digit
        decimals += digit & pointed
        pointed |= point
        at = at + 1
    return Numbers(digits, count, decimals, pointed, negative, plus)
