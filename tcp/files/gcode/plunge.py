"""Holes that a program spells out: a rapid to a place, a plunge, and the way back up."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal

from tcp.files.excellon.program import Place


@dataclass(frozen=True)
class Hover:
    """Where a rapid has led: its line, the place, the height if known, and whether Z moved too."""

    line: int
    place: Place
    level: Decimal | None
    slanted: bool


def retracted(
    start: Decimal | None, heights: list[Decimal], levels: set[Decimal | None], strict: bool
) -> int | None:
    """Which of a plunge's moves brings the tool back up; None if none does.

    Parameters
    ----------
    start : Decimal or None
        The height at which the cut begins, where it is known.
    heights : list of Decimal
        Where each move leads to.
    levels : set
        Heights at which the tool was before the cut: it is up where it reaches one.
    strict : bool
        Whether nothing else will do; otherwise its last height will, if no other is as high.
    """
    deep, before = -1, start
    for i, height in enumerate(heights):
        if before is None or height < before:
            deep = i
        before = height
    back = [i for i in range(deep + 1, len(heights)) if heights[i] in levels]
    if back:
        return back[0]
    last = len(heights) - 1
    return last if not strict and 0 <= deep < last and heights[-1] > max(heights[:-1]) else None
