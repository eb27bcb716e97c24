"""The way a drill file makes the machine go: every position in order, and what it costs.

Moves along slots and routed paths count as straight moves, arcs as their
chords: they are the same before and after.  Repeats and copied patterns are
followed hole by hole.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from tcp.errors import UsageError
from tcp.files.excellon import Program
from tcp.files.excellon.blocks import places
from tcp.files.excellon.document import Ints
from tcp.travel import CostRule, Travel

Point = tuple[Fraction, Fraction]


@dataclass(frozen=True, eq=False)
class Trail:
    """Positions in order.

    Parameters
    ----------
    x, y : int64 arrays
        In the file's own integer units.
    part : int64 array
        The tool selection that each position belongs to.
    row : int64 array
        The unit that each position belongs to.
    """

    x: Ints
    y: Ints
    part: Ints
    row: Ints

    def costs(self, rule: CostRule) -> Ints:
        """Cost of the move into each position but the first."""
        return rule.costs(np.diff(self.x), np.diff(self.y))

    def spans(self) -> list[tuple[int, int, int]]:
        """Selections in the order they are worked, each with its first and last position.

        A selection has several spans where a block in which tools change is repeated.
        No order that is allowed changes which places a span has.
        """
        edges = np.flatnonzero(np.diff(self.part)) + 1
        firsts = [0, *edges.tolist()]
        lasts = [*(edges - 1).tolist(), len(self.part) - 1]
        return [(int(self.part[a]), a, b) for a, b in zip(firsts, lasts, strict=True)]


def follow(program: Program) -> Trail:
    """The trail of a program."""
    pieces: list[tuple[Ints, Ints, Ints]] = []
    at = 0
    for pattern in program.patterns:
        pieces.append(places(program, at, pattern.first))
        block = places(program, pattern.first, pattern.last)
        pieces.append(block)
        for copy in pattern.copies:
            x, y = copy.place(block[0], block[1])
            pieces.append((x, y, block[2]))
        at = pattern.last
    pieces.append(places(program, at, len(program.rows)))
    pieces = [piece for piece in pieces if len(piece[0])]
    x, y, row = pieces[0] if len(pieces) == 1 else map(np.concatenate, zip(*pieces, strict=True))
    firsts = np.array([s.first for s in program.selections], dtype=np.int64)
    part = np.searchsorted(firsts, row, side="right") - 1
    return Trail(x, y, part, row)


def rule_for(program: Program, travel: Travel, points: tuple[Point | None, ...] = ()) -> CostRule:
    """The cost rule of a board: exact integers in one quantum for all its tools.

    Raises
    ------
    UsageError
        If the costs do not fit, or a start or park position is off the file's grid.
    """
    trail = follow(program)
    x, y = [trail.x], [trail.y]
    for point in points:
        if point is not None:
            px, py = on_grid(program, point)
            x.append(np.array([px]))
            y.append(np.array([py]))
    reach = tuple(int(np.concatenate(v).max() - np.concatenate(v).min()) for v in (x, y))
    return travel.rule(program.step, (reach[0], reach[1]), len(trail.x) + 2)


def on_grid(program: Program, point: Point) -> tuple[int, int]:
    """A position in mm as the file's integers, rounded to the nearest."""
    x, y = (round(v / program.step) for v in point)
    if max(abs(x), abs(y)) > 2**52:
        raise UsageError("a start, home or park position lies too far away")
    return x, y


@dataclass(frozen=True)
class Costs:
    """Travel of a board in quanta.

    Parameters
    ----------
    parts : tuple of int
        Travel inside each tool selection.
    links : int
        Travel from one selection to the next, from the start and to the park position.
    """

    parts: tuple[int, ...]
    links: int

    @property
    def total(self) -> int:
        """All of it."""
        return sum(self.parts) + self.links


def measure(
    program: Program, rule: CostRule, start: Point | None = None, park: Point | None = None
) -> Costs:
    """Travel of a program as it stands."""
    trail = follow(program)
    moves = trail.costs(rule)
    inside: NDArray[np.bool_] = trail.part[1:] == trail.part[:-1]
    parts = np.zeros(len(program.selections), dtype=np.int64)
    np.add.at(parts, trail.part[1:][inside], moves[inside])
    links = int(moves[~inside].sum())
    for point, at in ((start, 0), (park, -1)):
        if point is not None:
            px, py = on_grid(program, point)
            away = np.array([trail.x[at] - px]), np.array([trail.y[at] - py])
            links += int(rule.costs(*away)[0])
    return Costs(tuple(parts.tolist()), links)
