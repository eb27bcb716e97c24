"""Nothing lost: is what was written the same work as what was read?

Both files are reduced to what the machine does, in the file's own integer
units and without any order: every hole, slot and path with its tool, kind and
ends, repeats and copies expanded.  Around the units every byte has to stand
where it stood.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from tcp.errors import TcpError
from tcp.files.excellon.blocks import folded
from tcp.files.excellon.document import Ints, ending
from tcp.files.excellon.numbers import PLACES
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
    missing, extra = _difference(work(before), work(after))
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
    pieces = [_rows(program, 0, len(program.rows))]
    for pattern in program.patterns:
        block = _rows(program, pattern.first, pattern.last)
        pieces += [_copied(block, copy) for copy in pattern.copies]
    table = np.concatenate(pieces)
    scale = 10**PLACES * program.step / program.units.in_mm
    table[:, 2:6] *= int(scale)
    swap = (table[:, 2] > table[:, 4]) | (
        (table[:, 2] == table[:, 4]) & (table[:, 3] > table[:, 5])
    )
    swap &= table[:, 6] == 1
    table[swap, 2:6] = table[swap][:, [4, 5, 2, 3]]
    table = table[:, :6]
    return table[np.lexsort(table.T[::-1])]


def _rows(program: Program, first: int, last: int) -> Ints:
    rows = program.rows
    part = slice(first, last)
    hit = rows.kind[part] == Kind.HIT
    free = ((rows.mark[part] & Mark.FREE) != 0) & ~hit
    x2, y2 = (
        np.where(hit, rows.x1[part], rows.x2[part]),
        np.where(hit, rows.y1[part], rows.y2[part]),
    )
    columns = (rows.tool[part], rows.kind[part], rows.x1[part], rows.y1[part], x2, y2, free)
    table = np.stack([c.astype(np.int64) for c in columns], axis=1)
    more = [
        (int(rows.tool[row]), int(Kind.HIT), x, y, x, y, 0)
        for row, repeats in program.repeats.items()
        if first <= row < last
        for x, y in list(repeated(int(rows.x1[row]), int(rows.y1[row]), repeats))[1:]
    ]
    return np.concatenate([table, np.array(more, dtype=np.int64).reshape(-1, 7)])


def _copied(block: Ints, copy: Copy) -> Ints:
    block = block.copy()
    block[:, 2], block[:, 3] = copy.place(block[:, 2].copy(), block[:, 3].copy())
    block[:, 4], block[:, 5] = copy.place(block[:, 4].copy(), block[:, 5].copy())
    return block


def _difference(a: Ints, b: Ints) -> tuple[list[str], list[str]]:
    """What is in one table only, in words."""
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
    rows, found = program.rows, Counter[tuple[int, tuple[Motion, ...]]]()
    for row, moves in program.routes.items():
        bare = tuple(Motion(m.code, m.x, m.y, m.arc) for m in moves)
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
    return a == b and _endings(before) == _endings(after)


def _insides(program: Program) -> Counter[tuple[bytes, ...]]:
    """The text between the units of each movable block, from its M25 to its M08."""
    rows, starts, data = program.rows, program.document.starts, program.document.data
    found = Counter[tuple[bytes, ...]]()
    for block in program.patterns:
        if block.movable:
            part = slice(block.first, block.last)
            begin = [starts[block.lines[0]], *starts[rows.last[part]]]
            stop = [*starts[rows.first[part]], starts[block.lines[1] + 1]]
            found[tuple(data[i:j] for i, j in zip(begin, stop, strict=True) if i < j)] += 1
    return found


def _around(program: Program) -> list[bytes]:
    """The text between units, in order."""
    first, last = program.rows.first, program.rows.last
    starts = program.document.starts
    begin = np.concatenate(([0], starts[last]))
    stop = np.concatenate((starts[first], [starts[-1]]))
    data = program.document.data
    return [data[i:j] for i, j in zip(begin.tolist(), stop.tolist(), strict=True) if i < j]


def _endings(program: Program) -> Counter[bytes]:
    """Line endings of the units' last lines."""
    data, starts = program.document.data, program.document.starts
    return Counter(ending(data[max(s - 2, 0) : s]) for s in starts[program.rows.last].tolist())
