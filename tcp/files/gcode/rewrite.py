"""Writes a drilling program with its holes in another order: X and Y change places, nothing else.

Every line stays where it is with its number, comment, cycle, depth and feed.
Holes may change places only where all of that is the same for both, so it is
enough to give each line the place of another hole.  Where a later line leans
on a coordinate that used to stand before it, that coordinate is spelled out;
lines of G91 get the step from the place before.
"""

from __future__ import annotations

import re
from collections import Counter

from tcp.files.excellon.guard import LostError
from tcp.files.excellon.program import Kind, Place, Program
from tcp.files.excellon.rewrite import Orders
from tcp.files.gcode.program import GProgram, named

_AXIS = rb"[+-]?(?:\d+\.?\d*|\.\d+)"
_SPLIT = re.compile(rb"(\([^()]*\)|;[^\r\n]*)")
_PLACE = re.compile(rb"([XxYy])[ \t]*(" + _AXIS + rb")")
_ORIGIN: Place = (0, 0)
_FLAT = re.compile(rb"[ \t]*[XxYy][ \t]*" + _AXIS)


def reorder(program: Program, orders: Orders) -> bytes:
    """The program with some stretches in another order; see :func:`excellon.rewrite.reorder`."""
    assert isinstance(program, GProgram)
    document, rows = program.document, program.rows
    target = {
        int(rows.first[slot]): program.moves[int(rows.first[turn.row])]
        for a, order in orders.items()
        for slot, turn in enumerate(order, start=a)
    }
    out: list[bytes] = []
    old = new = _ORIGIN
    for number in range(len(document)):
        line, move = document.line(number), program.moves.get(number)
        if move is not None:
            wanted = target.get(program.approaches.get(number, number), move)
            if move.incremental:
                line = _stepped(line, (old, move.place), (new, wanted.place))
            elif wanted.names != move.names or (old != new and not _complete(line)):
                line = _placed(line, *wanted.names)
            old, new = move.place, wanted.place
        out.append(line)
    return b"".join(out)


def _stepped(line: bytes, before: tuple[Place, Place], after: tuple[Place, Place]) -> bytes:
    """A line of G91 with the step that it takes now, if that is another one."""
    steps = [(q[0] - p[0], q[1] - p[1]) for p, q in (before, after)]
    if steps[0] == steps[1]:
        return line
    words = [m[2] for part in _SPLIT.split(line)[::2] for m in _PLACE.finditer(part)]
    x, y = map(named, steps[1])
    if all(b"." not in word for word in words):  # some controls read 8 and 8. differently
        x, y = x.removesuffix(b"."), y.removesuffix(b".")
    return _placed(line, x, y)


def _complete(line: bytes) -> bool:
    """Whether a line names both axes."""
    found = {m[1].upper() for part in _SPLIT.split(line)[::2] for m in _PLACE.finditer(part)}
    return found == {b"X", b"Y"}


def _placed(line: bytes, x: bytes, y: bytes) -> bytes:
    """A line that leads to another place; comments are left alone."""
    parts = _SPLIT.split(line)
    done = False
    for i in range(0, len(parts), 2):
        found = list(_PLACE.finditer(parts[i]))
        if not found:
            continue
        lower = found[0][1].islower()
        gap = b" " if b" " in parts[i].strip() else b""
        place = (b"x%s%sy%s" if lower else b"X%s%sY%s") % (x, gap, y)
        if done:
            parts[i] = _FLAT.sub(b"", parts[i])
            continue
        at = found[0].start()
        parts[i] = parts[i][:at] + place + _FLAT.sub(b"", parts[i][at:])
        done = True
    return b"".join(parts)


def compare(before: Program, after: Program, *, text: str = "same") -> None:
    """Raise unless two programs drill the same holes and differ in X and Y words alone.

    Raises
    ------
    LostError
        Naming the first difference.
    """
    assert isinstance(before, GProgram) and isinstance(after, GProgram)
    if before.units is not after.units:
        raise LostError(f"{before.path}: the units changed while writing")
    left, right = _holes(before), _holes(after)
    if left != right:
        lost, more = left - right, right - left
        first = next(iter(lost.elements()), None) or next(iter(more.elements()))
        raise LostError(
            f"{before.path}: re-ordering changed the hole of T{first[0]} at {first[1:3]} "
            f"({lost.total()} lost, {more.total()} gained)"
        )
    astray = _astray(before, after)
    if astray is not None:
        raise LostError(f"{before.path}: re-ordering led the rapid of line {astray + 1} astray")
    if text == "same" and _skeleton(before) != _skeleton(after):
        raise LostError(f"{before.path}: writing changed something else than X and Y")


def _holes(program: GProgram) -> Counter[tuple[int, int, int, str]]:
    rows, finer = program.rows, program.finer
    return Counter(
        (tool, x * finer, y * finer, key)
        for tool, x, y, key, kind in zip(
            rows.tool.tolist(),
            rows.x1.tolist(),
            rows.y1.tolist(),
            program.keys,
            rows.kind.tolist(),
            strict=True,
        )
        if kind != Kind.PASS
    )


def _astray(before: GProgram, after: GProgram) -> int | None:
    """A line whose rapid led to a hole and no more does, or led to nowhere and now elsewhere.

    A rapid to nowhere that stays may come to stand before a hole at its place.
    """
    rows = before.rows
    for line in rows.first[rows.kind == Kind.PASS].tolist():
        if after.moves[line].place != before.moves[line].place:
            return int(line)
    return min(before.approaches.keys() - after.approaches.keys(), default=None)


def _skeleton(program: GProgram) -> list[bytes]:
    """The lines without their X and Y words."""
    return [
        b"".join(
            part if i % 2 else _FLAT.sub(b"", part) for i, part in enumerate(_SPLIT.split(line))
        )
        for line in program.document.lines()
    ]
