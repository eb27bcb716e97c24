"""A stretch of free order as an instance, and an instance's route as a new order.

A hole is one node.  A slot, a routed path, a hole with repeats and a
step-and-repeat block are two nodes that must follow each other
(``Rules.together``): the solver may enter at either end, and
:mod:`tcp.boards.directed` turns those round that may be entered at their
first end only.  Units that stay where they are before and after the
stretch, under the same tool, become its fixed ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcp.files.excellon import Mark, Program
from tcp.files.excellon.document import Ints
from tcp.files.excellon.program import Place
from tcp.files.excellon.rewrite import Order
from tcp.instance import Ends, Instance, Rules
from tcp.travel import Travel
from tcp.workpiece import Workpiece


@dataclass(frozen=True, eq=False)
class Stretch:
    """Units ``first .. last - 1`` whose order is free.

    Parameters
    ----------
    program : Program
        The file.
    first, last : int
        The units.
    before, after : (x, y) or None
        Where the machine comes from and goes to under the same tool, in the
        file's integers; None where the stretch begins or ends the tool's path.
    chained : bool
        Whether that place is itself the end of another re-ordered stretch, so
        that a bound holds for this stretch alone and not for the file.
    """

    program: Program
    first: int
    last: int
    before: Place | None = None
    after: Place | None = None
    chained: bool = False

    def __len__(self) -> int:
        return self.last - self.first

    def nodes(self) -> tuple[Ints, Ints, Ints, tuple[tuple[int, int], ...]]:
        """Coordinates and unit of every node, and the pairs that belong together."""
        rows, part = self.program.rows, slice(self.first, self.last)
        two = (rows.x1[part] != rows.x2[part]) | (rows.y1[part] != rows.y2[part])
        count = np.where(two, 2, 1)
        begin = np.concatenate(([0], np.cumsum(count)))
        unit = np.repeat(np.arange(self.first, self.last), count)
        x, y = rows.x1[unit].copy(), rows.y1[unit].copy()
        second = begin[1:][two] - 1
        x[second], y[second] = rows.x2[part][two], rows.y2[part][two]
        pairs = tuple((int(b) - 1, int(b)) for b in second)
        return x, y, unit, pairs

    def directed(self) -> NDArray[np.bool_]:
        """Units that can be entered at their first end only."""
        rows, part = self.program.rows, slice(self.first, self.last)
        two = (rows.x1[part] != rows.x2[part]) | (rows.y1[part] != rows.y2[part])
        one_way: NDArray[np.bool_] = two & ((rows.mark[part] & Mark.FREE) == 0)
        return one_way

    def instance(self, travel: Travel) -> Instance:
        """The stretch as a problem: an open path over its nodes."""
        x, y, _, pairs = self.nodes()
        rows, start, end = self.program.rows, None, None
        if self.before is not None:
            start = len(x)
            x, y = np.append(x, self.before[0]), np.append(y, self.before[1])
        if self.after is not None:
            end = len(x)
            x, y = np.append(x, self.after[0]), np.append(y, self.after[1])
        tool = int(rows.tool[self.first])
        name = f"{self.program.path.stem}-T{tool}"
        piece = Workpiece(name, tuple(str(i + 1) for i in range(len(x))), x, y, self.program.step)
        return Instance(piece, travel, Ends(start, end), Rules(together=pairs))

    def order(self, route: tuple[int, ...]) -> Order:
        """The new order that a route of :meth:`instance` stands for."""
        unit, nodes = self.nodes()[2], np.array(route, dtype=np.int64)
        nodes = nodes[nodes < len(unit)]
        rows = unit[nodes]
        begins = np.append(True, rows[1:] != rows[:-1])
        nodes, rows = nodes[begins], rows[begins]
        return Order(rows, (nodes > 0) & (unit[nodes - 1] == rows))

    def route(self, order: Order) -> tuple[int, ...]:
        """The route of :meth:`instance` that an order stands for."""
        unit = self.nodes()[2]
        first = np.searchsorted(unit, order.rows)
        last = np.searchsorted(unit, order.rows, side="right") - 1
        pairs = np.stack([first, last], axis=1)
        pairs[order.reverse] = pairs[order.reverse, ::-1]
        whole = np.stack([np.full(len(first), True), first != last], axis=1)
        nodes: list[int] = pairs[whole].tolist()
        before = [] if self.before is None else [len(unit)]
        after = [] if self.after is None else [len(unit) + len(before)]
        return (*before, *nodes, *after)

    def as_is(self) -> Order:
        """The file's own order."""
        return Order.as_is(self.first, self.last)

    def backwards(self, order: Order) -> Order:
        """The same path from its other end; not for stretches with directed units."""
        rows = order.rows[::-1]
        free = (self.program.rows.mark[rows] & Mark.FREE) != 0
        return Order(rows, free & ~order.reverse[::-1])

    def end(self, order: Order) -> Place:
        """Where an order ends."""
        rows, row = self.program.rows, int(order.rows[-1])
        x, y = (rows.x1, rows.y1) if order.reverse[-1] else (rows.x2, rows.y2)
        return int(x[row]), int(y[row])


def free_runs(program: Program, locked: frozenset[int], first: int) -> list[tuple[int, int]]:
    """Row ranges that may be re-ordered.

    Parameters
    ----------
    program : Program
        The file.
    locked : frozenset of int
        Positions of the selections that stay as they are.
    first : int
        The first so many units stay where they are.
    """
    found = []
    for a, b in program.stretches():
        begin = max(a, first)
        if begin >= b or program.selection_of(a) in locked:
            continue
        marks = program.rows.mark[begin:b]
        if not marks[0] & Mark.FIXED and (b - begin > 1 or marks[0] & Mark.FREE):
            found.append((begin, b))
    return found


def anchored(
    program: Program, run: tuple[int, int], runs: list[tuple[int, int]], ends: dict[int, Place]
) -> Stretch:
    """The stretch of a run, tied to what stands next to it under the same tool.

    ``ends`` maps the last row of each run before this one to the place where
    its new order ends.  A run that follows is taken to begin where it does now.
    """
    rows, (a, b) = program.rows, run
    before = after = None
    if a and _same_path(program, a - 1, a):
        before = ends.get(a - 1, (int(rows.x2[a - 1]), int(rows.y2[a - 1])))
    movable = b in {begin for begin, _ in runs}
    if b < len(rows) and _same_path(program, b - 1, b):
        after = int(rows.x1[b]), int(rows.y1[b])
    chained = (a - 1) in ends and before is not None
    chained = chained or (movable and _same_path(program, b - 1, b))
    return Stretch(program, a, b, before, after, chained)


def _same_path(program: Program, row: int, other: int) -> bool:
    """Whether two neighbouring units belong to one tool selection and one pattern."""
    if program.selection_of(row) != program.selection_of(other):
        return False
    return all((p.first <= row < p.last) == (p.first <= other < p.last) for p in program.patterns)
