"""Nothing lost: is what was written the same work as what was read?

Both files are reduced to what the machine does, in the file's own integer
units and without any order: every hole, slot and path with its tool, kind and
ends, repeats and copies expanded.  Around the units every byte has to stand
where it stood.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from tcp.errors import TcpError
from tcp.files.excellon.blocks import folded
from tcp.files.excellon.document import Ints
from tcp.files.excellon.program import Copy, Kind, Mark, Motion, Program, repeated


class LostError(TcpError):
    """A re-ordered file does other work than the original: a bug in ``tcp``, never shipped."""


def compare(before: Program, after: Program, *, text: str = "same") -> None:
    """Raise unless two programs do the same work.

    Parameters
    ----------
    before, after : Program
        The original, and the re-read result.
    text : {"same", "moved", "free"}
        What must hold for the lines that are no units: the same bytes in the
        same order, the same lines in any order (sections moved), or nothing
        (repeats expanded, selections merged).

    Raises
    ------
    LostError
        Naming the first difference.
    """
    if before.units is not after.units or _tools(before) != _tools(after):
        raise LostError(f"{before.path}: the tool table changed while writing")
    missing, extra = _difference(before, after)
    if missing or extra:
        what = f"lost {missing[0]}" if missing else f"gained {extra[0]}"
        raise LostError(
            f"{before.path}: re-ordering {what} ({len(missing)} lost, {len(extra)} gained)"
        )
    if paths(before) != paths(after):
        raise LostError(f"{before.path}: re-ordering changed a routed path")
    if not _same_text(before, after, text):
        raise LostError(f"{before.path}: writing changed text outside the drill hits")


def _tools(program: Program) -> dict[int, object]:
    return {t.number: (t.diameter, t.plated) for t in program.tools.values() if t.line}


def work(program: Program) -> Ints:
    """Rows (tool, kind, x, y, x, y) of all that is worked, sorted; ends in canonical order.

    Coordinates are in units of ``10**-PLACES``, so files of different
    resolution compare.
    """
    table = np.stack([c.astype(np.int64) for c in _table(program)], axis=1)
    table[:, 2:] *= program.finer
    return table[np.lexsort(table.T[::-1])]


def _same_work(before: Program, after: Program) -> bool:
    """Whether two files of one resolution do the same; without building the sorted tables.

    Holes, nearly all of a file, are compared as single integers.
    """
    tables = _table(before), _table(after)
    hits = [table[1] == Kind.HIT for table in tables]
    keys = _keys(
        [[table[i][hit] for i in (0, 2, 3)] for table, hit in zip(tables, hits, strict=True)]
    )
    if keys is None or before.step != after.step or not np.array_equal(keys[0], keys[1]):
        return False
    rest = [np.stack([c[~hit] for c in t]) for t, hit in zip(tables, hits, strict=True)]
    a, b = (r[:, np.lexsort(r[::-1])] for r in rest)
    return np.array_equal(a, b)


def _keys(points: list[list[Any]]) -> list[Ints] | None:
    """Points (tool, x, y) of each table as sorted integers; None where 62 bits are too few."""
    keys, room = [np.zeros(len(columns[0]), dtype=np.int64) for columns in points], 1
    for columns in zip(*points, strict=True):
        full = [c for c in columns if len(c)]
        low = min((int(c.min()) for c in full), default=0)
        span = max((int(c.max()) for c in full), default=0) - low + 1
        room *= span
        if room >= 2**62:
            return None
        for key, column in zip(keys, columns, strict=True):
            key *= span
            key += column - low
    for key in keys:
        key.sort()
    return keys


def _table(program: Program) -> list[Any]:
    """Columns tool, kind, x, y, x, y of all that is worked, repeats and copies expanded."""
    pieces = [*_rows(program, 0, len(program.rows))]
    for pattern in program.patterns:
        for copy in pattern.copies:
            pieces += [_copied(p, copy) for p in _rows(program, pattern.first, pattern.last)]
    if len(pieces) == 1:
        return pieces[0][:6]
    return [np.concatenate(columns) for columns in zip(*pieces, strict=True)][:6]


def _rows(program: Program, first: int, last: int) -> Iterator[list[Any]]:
    """The columns of some units, and of the further hits of their repeats; ends in one order."""
    rows, part = program.rows, slice(first, last)
    tool, kind, mark = rows.tool[part], rows.kind[part], rows.mark[part]
    if rows.x1 is rows.x2:
        x, y = rows.x1[part], rows.y1[part]
        yield [tool, kind, x, y, x, y, mark]
    else:
        x1, y1, x2, y2 = (c[part].copy() for c in (rows.x1, rows.y1, rows.x2, rows.y2))
        hit = kind == Kind.HIT
        x2[hit], y2[hit] = x1[hit], y1[hit]
        yield [tool, kind, *_in_order(x1, y1, x2, y2, mark), mark]
    more = [
        (int(rows.tool[row]), int(Kind.HIT), x, y, x, y, 0)
        for row, repeats in program.repeats.items()
        if first <= row < last
        for x, y in list(repeated(int(rows.x1[row]), int(rows.y1[row]), repeats))[1:]
    ]
    if more:
        yield [*np.array(more, dtype=np.int64).T]


def _copied(piece: list[Any], copy: Copy) -> list[Any]:
    """The columns of a copy."""
    tool, kind, x1, y1, x2, y2, mark = piece
    return [tool, kind, *_in_order(*copy.place(x1, y1), *copy.place(x2, y2), mark), mark]


def _in_order(x1: Ints, y1: Ints, x2: Ints, y2: Ints, mark: Any) -> list[Any]:
    """Ends of units, the lower one first where a unit may be worked from either."""
    swap = ((mark & Mark.FREE) != 0) & ((x1 > x2) | ((x1 == x2) & (y1 > y2)))
    return [np.where(swap, *pair) for pair in ((x2, x1), (y2, y1), (x1, x2), (y1, y2))]


def _difference(before: Program, after: Program) -> tuple[list[str], list[str]]:
    """What is done in one file only, in words."""
    if _same_work(before, after):
        return [], []
    a, b = work(before), work(after)
    if a.shape == b.shape and np.array_equal(a, b):
        return [], []
    left = Counter(map(tuple, a.tolist()))
    right = Counter(map(tuple, b.tolist()))
    named = [
        [f"{Kind(r[1]).name.lower()} of T{r[0]} at {r[2:]}" for r in (p - q).elements()]
        for p, q in ((left, right), (right, left))
    ]
    return named[0], named[1]


def paths(program: Program) -> Counter[tuple[int, tuple[Motion, ...]]]:
    """Routed paths and canned cycles by tool, each as its moves; straight ones by their ends."""
    rows, found, finer = program.rows, Counter[tuple[int, tuple[Motion, ...]]](), program.finer
    for row, moves in program.routes.items():
        bare = tuple(
            Motion(m.code, m.x * finer, m.y * finer, tuple((k, v * finer) for k, v in m.arc))
            for m in moves
        )
        if not rows.mark[row] & Mark.FREE:
            found[int(rows.tool[row]), bare] += 1
    return found


def _same_text(before: Program, after: Program, text: str) -> bool:
    if text == "free":
        return True
    if text == "moved":
        lines = [Counter(b"".join(_around(p)).splitlines()) for p in (before, after)]
        return lines[0] == lines[1]
    if _insides(before) != _insides(after):
        return False
    before, after = folded(before), folded(after)
    a, b = list(_around(before)), list(_around(after))
    return a == b and np.array_equal(_endings(before), _endings(after))


def _insides(program: Program) -> Counter[tuple[bytes, ...]]:
    """The text between the units of each movable block, from its M25 to its M08.

    The last line's ending belongs to the place where the block stands.
    """
    rows, starts, data = program.rows, program.document.starts, program.document.data
    found = Counter[tuple[bytes, ...]]()
    for block in program.patterns:
        if block.movable:
            part = slice(block.first, block.last)
            begin = [starts[block.lines[0]], *starts[rows.last[part]]]
            stop = [*starts[rows.first[part]], starts[block.lines[1] + 1]]
            pieces = [data[i:j] for i, j in zip(begin, stop, strict=True) if i < j]
            found[(*pieces[:-1], pieces[-1].rstrip(b"\r\n"))] += 1
    return found


def _around(program: Program) -> list[bytes]:
    """The text between units, in order."""
    first, last = program.rows.first, program.rows.last
    starts, data = program.document.starts, program.document.data
    begin = np.concatenate(([0], starts[last]))
    stop = np.concatenate((starts[first], starts[-1:]))
    gaps = np.flatnonzero(begin < stop)
    return [data[i:j] for i, j in zip(begin[gaps].tolist(), stop[gaps].tolist(), strict=True)]


def _endings(program: Program) -> Ints:
    """How many units end in which way."""
    return np.bincount(program.document.endings(program.rows.last), minlength=14)
