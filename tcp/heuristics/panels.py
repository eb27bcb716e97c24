"""Panels: one board repeated k x m by constant steps along the axes, found exactly.

Copies whose extents do not overlap along x are contiguous once the holes are
sorted by x, and each is the one before it moved by the same step.  So for
every divisor k of the number of holes there is one candidate step, verified
hole by hole in integers; then the same along y within one column of copies.
O(n log n), and O(n) for each divisor that survives a first look.

Only translations count: a board that is turned or mirrored within its panel,
a panel that lacks a hole somewhere, and copies that reach into each other are
not recognised.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcp.travel import Ints

LEAST = 30
"""Fewest holes of a board: below, linking the copies is as hard as the whole."""


@dataclass(frozen=True, eq=False)
class Panel:
    """Copies of one board.

    Parameters
    ----------
    holes : int array of shape (columns, rows, b)
        Hole number ``b`` of the copy in every column and row: equal places on
        the board have equal numbers.
    step : (int, int)
        From one column to the next, and from one row to the next, in steps of
        the coordinates; 0 where there is only one.
    """

    holes: Ints
    step: tuple[int, int]

    @property
    def copies(self) -> int:
        """Number of copies."""
        return self.holes.shape[0] * self.holes.shape[1]

    def describe(self) -> str:
        """In words: how many boards of how many holes."""
        columns, rows, holes = self.holes.shape
        return f"{columns} x {rows} boards of {holes} holes"


def find_panel(x: Ints, y: Ints, least: int = LEAST) -> Panel | None:
    """The panel that holes form, with the smallest board of at least ``least`` holes.

    Parameters
    ----------
    x, y : int arrays of shape (n,)
        Coordinates of the holes; several holes may lie in one place.
    least : int
        Fewest holes of a board, >= 1.

    Returns
    -------
    Panel or None
        None where the holes are not two or more copies of a board.
    """
    if x.size < 2 * least:
        return None
    columns, across = _copies(x, y, np.arange(x.size), least)
    rows, up = _copies(y, x, columns[0], least)
    if len(columns) * len(rows) == 1:
        return None
    if len(columns) == 1:
        return Panel(rows[None, :, :], (0, up))
    return Panel(_grid(columns, rows), (across, up))


def _copies(along: Ints, other: Ints, holes: Ints, least: int) -> tuple[Ints, int]:
    """The most copies along one axis: hole numbers, one row a copy, and the step between them."""
    order = holes[np.lexsort((other[holes], along[holes]))]
    p, q = along[order], other[order]
    for size in _divisors(order.size):
        if size < least or size == order.size:
            continue
        step = int(p[size] - p[0])
        firsts = p[::size]
        apart = p[size - 1] < firsts[1] and (np.diff(firsts) == step).all()
        if not apart:
            continue
        moved = (p.reshape(-1, size) - firsts[:, None] == p[:size] - p[0]).all()
        if moved and (q.reshape(-1, size) == q[:size]).all():
            return order.reshape(-1, size), step
    return order[None, :], 0


def _grid(columns: Ints, rows: Ints) -> Ints:
    """Hole numbers by column, row and place: each column in the order of the first one's rows."""
    first = columns[0]
    place = np.empty(int(first.max()) + 1, np.int64)
    place[first] = np.arange(first.size)  # a hole of the first column -> its number in a column
    return columns[:, place[rows]]


def _divisors(n: int) -> list[int]:
    """All divisors, ascending."""
    small = [d for d in range(1, int(n**0.5) + 1) if n % d == 0]
    return sorted({*small, *(n // d for d in small)})
