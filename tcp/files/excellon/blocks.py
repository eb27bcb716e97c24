"""Step-and-repeat blocks as units: a view of a program in which each movable block is one row.

Inside a block the order of units is a matter of its own (:class:`Pattern`);
seen from outside it is one piece of text, from M25 to M08, that begins at its
first hole and ends at the last hole of its last copy.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tcp.files.excellon.document import Ints
from tcp.files.excellon.program import (
    Columns,
    Kind,
    Mark,
    Motion,
    Pattern,
    Program,
    repeated,
)


def folded(program: Program) -> Program:
    """The program with each movable block as one unit; itself if it has none.

    A block's row has kind ``BLOCK``, the block's first and last place as its
    ends, all places in between as its ``routes`` entry, and the number of its
    holes in ``weights``.
    """
    blocks = [p for p in program.patterns if p.movable]
    if not blocks:
        return program
    rows = program.rows
    keep = np.ones(len(rows), dtype=np.bool_)
    for block in blocks:
        keep[block.first + 1 : block.last] = False
    place = np.cumsum(keep) - 1
    at = [int(place[b.first]) for b in blocks]
    routes = {int(place[row]): moves for row, moves in program.routes.items()}
    routes |= {row: _motions(program, b) for row, b in zip(at, blocks, strict=True)}
    times = program.times()
    behind = {b.last for b in blocks}  # the block itself, as a unit, leaves its place open
    inside = {row for b in blocks for row in range(b.first, b.last)}
    return replace(
        program,
        rows=_columns(program, keep, at, blocks, routes),
        repeats={int(place[r]): v for r, v in program.repeats.items() if r not in inside},
        routes=routes,
        jumps={
            int(place[row]): here
            for row, here in program.jumps.items()
            if keep[row] and not (here is None and row in behind)
        },
        patterns=tuple(
            replace(p, first=int(place[p.first]), last=int(place[p.last - 1]) + 1)
            for p in program.patterns
            if not p.movable
        ),
        selections=tuple(
            replace(s, first=int(place[s.first]) if s.first < len(place) else int(keep.sum()))
            for s in program.selections
        ),
        weights={
            row: int(times[b.first : b.last].sum()) for row, b in zip(at, blocks, strict=True)
        },
    )


def _columns(
    program: Program,
    keep: np.ndarray[tuple[int], np.dtype[np.bool_]],
    at: list[int],
    blocks: list[Pattern],
    routes: dict[int, tuple[Motion, ...]],
) -> Columns:
    """The rows that are kept, those of the blocks rewritten."""
    rows = program.rows
    names = ("kind", "tool", "x1", "y1", "x2", "y2", "first", "last", "mark")
    table = {name: getattr(rows, name)[keep].copy() for name in names}
    edge = np.diff(rows.stretch[keep]) != 0
    for row, block in zip(at, blocks, strict=True):
        ends = routes[row][0], routes[row][-1]
        table["kind"][row] = Kind.BLOCK
        table["x1"][row], table["y1"][row] = ends[0].x, ends[0].y
        table["x2"][row], table["y2"][row] = ends[1].x, ends[1].y
        table["first"][row], table["last"][row] = block.lines[0], block.lines[1] + 1
        table["mark"][row] = int(rows.mark[block.first]) & int(Mark.COMPLETE)
        if block.joins[0]:
            edge[row - 1] = False
        if block.joins[1]:
            edge[row] = False
    stretch = np.zeros(len(edge) + 1, dtype=np.int32)
    np.cumsum(edge, out=stretch[1:])
    return Columns(**table, stretch=stretch)


def _motions(program: Program, block: Pattern) -> tuple[Motion, ...]:
    """Every place of a block in the order it is drilled; the first on its own line."""
    x, y, _ = places(program, block.first, block.last)
    copies = [(x, y), *(copy.place(x, y) for copy in block.copies)]
    line = int(program.rows.first[block.first])
    return tuple(
        Motion(0, px, py, line=line)
        for xs, ys in copies
        for px, py in zip(xs.tolist(), ys.tolist(), strict=True)
    )


def places(program: Program, first: int, last: int) -> tuple[Ints, Ints, Ints]:
    """Where units lead the machine, in order: x, y and the unit.

    One place for a hole, both ends for a slot, all for a path, a block and a
    hole with repeats; copies of patterns are not followed.
    """
    rows = program.rows
    if last == first:
        none = np.zeros(0, dtype=np.int64)
        return none, none, none
    two = rows.kind[first:last] == Kind.SLOT
    long = {
        row: [(m.x, m.y) for m in moves]
        for row, moves in program.routes.items()
        if first <= row < last and rows.kind[row] in (Kind.ROUTE, Kind.BLOCK)
    }
    for row, repeats in program.repeats.items():
        if first <= row < last:
            long[row] = list(repeated(int(rows.x1[row]), int(rows.y1[row]), repeats))
    if not long and not two.any():
        return rows.x1[first:last], rows.y1[first:last], np.arange(first, last)
    count = np.where(two, 2, 1)
    for row, found in long.items():
        count[row - first] = len(found)
    begin = np.concatenate(([0], np.cumsum(count)))
    x, y = np.empty(begin[-1], dtype=np.int64), np.empty(begin[-1], dtype=np.int64)
    x[begin[:-1]], y[begin[:-1]] = rows.x1[first:last], rows.y1[first:last]
    ends = begin[1:][two] - 1
    x[ends], y[ends] = rows.x2[first:last][two], rows.y2[first:last][two]
    for row, found in long.items():
        at = begin[row - first]
        x[at : at + len(found)] = [p[0] for p in found]
        y[at : at + len(found)] = [p[1] for p in found]
    return x, y, np.repeat(np.arange(first, last), count)
