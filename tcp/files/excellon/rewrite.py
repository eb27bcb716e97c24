"""Writes a drill file again with its units in another order, and touches nothing else.

The output is a *plan* of the original text: stretches of lines copied as they
are, and units put into the places of other units.  A unit's text is copied
too; only where it leans on what used to stand before it (an omitted
coordinate, an incremental step) or is worked from its other end are its
coordinates written anew, in the file's own number format.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tcp.files.excellon.document import ending
from tcp.files.excellon.program import Kind, Mark, Place, Program
from tcp.files.excellon.state import NUMBER

AXES = re.compile(
    rb"X[ \t]*" + NUMBER + rb"(?:[ \t]*Y[ \t]*" + NUMBER + rb")?"
    rb"|Y[ \t]*" + NUMBER + rb"(?:[ \t]*X[ \t]*" + NUMBER + rb")?"
)
_SIGNED = re.compile(rb"([XY][ \t]*)([+-]?)(?=[\d.])")


@dataclass(frozen=True)
class Turn:
    """One unit at its new place; ``reverse`` works it from its other end."""

    row: int
    reverse: bool = False


Orders = Mapping[int, Sequence[Turn]]
"""New order of stretches, by their first row; stretches left out keep theirs."""


@dataclass(frozen=True)
class Text:
    """Plan item: lines ``first .. last - 1`` as they are."""

    first: int
    last: int


@dataclass(frozen=True)
class Put:
    """Plan item: a unit, in the place of the unit ``slot``."""

    turn: Turn
    slot: int


Plan = Iterator[Text | Put]


def reorder(program: Program, orders: Orders) -> bytes:
    """The file with some stretches in another order.

    Parameters
    ----------
    program : Program
        The file.
    orders : mapping of int to sequence of Turn
        For stretches by their first row: each row of the stretch once.
    """
    return Writer(program).write(plan(program, orders, 0, len(program.document)))


def plan(program: Program, orders: Orders, first: int, last: int) -> Plan:
    """Plan of the lines ``first .. last - 1`` with stretches re-ordered."""
    rows, at = program.rows, first
    for a, b in program.stretches():
        if not first <= rows.first[a] < last:
            continue
        turns = orders.get(a, [Turn(row) for row in range(a, b)])
        for slot, turn in zip(range(a, b), turns, strict=True):
            if rows.first[slot] > at:
                yield Text(at, int(rows.first[slot]))
            yield Put(turn, slot)
            at = int(rows.last[slot])
    if at < last:
        yield Text(at, last)


class Writer:
    """Carries out a plan, keeping track of where the machine is."""

    def __init__(self, program: Program):
        self.program = program
        rows = program.rows
        self.first, self.last = rows.first.tolist(), rows.last.tolist()
        self.mark, self.kind = rows.mark.tolist(), rows.kind.tolist()
        self.x1, self.y1 = rows.x1.tolist(), rows.y1.tolist()
        self.x2, self.y2 = rows.x2.tolist(), rows.y2.tolist()
        self.starts = program.document.starts.tolist()
        self.at: Place | None = None
        self.lost = {p.last - 1 for p in program.patterns}
        self.lost |= set(np.flatnonzero(rows.kind == Kind.BLOCK).tolist())

    def write(self, plan: Plan) -> bytes:
        """The bytes of a plan."""
        out = []
        for item in plan:
            if isinstance(item, Text):
                out.append(self.program.document.text(item.first, item.last))
            else:
                out.append(self._fit(self.unit(item.turn), item.slot))
                self.at = self._end(item.turn)
        return b"".join(out)

    def _fit(self, text: bytes, slot: int) -> bytes:
        """A unit's text with the line ending of the place where it goes."""
        stop = self.starts[self.last[slot]]
        wanted = ending(self.program.document.data[max(stop - 2, 0) : stop])
        return text[: len(text) - len(ending(text[-2:]))] + wanted

    def _end(self, turn: Turn) -> Place | None:
        """Where a unit leaves the machine; nobody knows behind a block's last copy."""
        row = turn.row
        if self.kind[row] == Kind.BLOCK:
            return None
        return (self.x1[row], self.y1[row]) if turn.reverse else (self.x2[row], self.y2[row])

    def _before(self, row: int) -> Place | None:
        """Where the machine is in the original when it comes to a unit."""
        return (self.x2[row - 1], self.y2[row - 1]) if row and row - 1 not in self.lost else None

    def unit(self, turn: Turn) -> bytes:
        """Text of a unit, rewritten only where it must be."""
        row, mark = turn.row, self.mark[turn.row]
        data = self.program.document.data
        text = data[self.starts[self.first[row]] : self.starts[self.last[row]]]
        if turn.reverse:
            return self._reversed(row)
        if mark & Mark.COMPLETE or self._before(row) == self.at:
            return text
        line = self.program.routes[row][0].line if row in self.program.routes else self.first[row]
        begin, stop = (self.starts[at] - self.starts[self.first[row]] for at in (line, line + 1))
        placed = self._placed(text[begin:stop], self.x1[row], self.y1[row], mark)
        return text[:begin] + placed + text[stop:]

    def _placed(self, line: bytes, x: int, y: int, mark: int) -> bytes:
        """A line with its first coordinates written anew."""
        if mark & Mark.INCREMENTAL:
            px, py = self.at or (0, 0)
            x, y = x - px, y - py
        return AXES.sub(self._text(x, y), line, count=1)

    def _text(self, x: int, y: int) -> bytes:
        style = self.program.style
        return b"X" + style.write(x) + b"Y" + style.write(y)

    def _reversed(self, row: int) -> bytes:
        document, kind, mark = self.program.document, self.kind[row], self.mark[row]
        lines = [document.line(i) for i in range(self.first[row], self.last[row])]
        if kind == Kind.HIT:
            lines[0] = self._placed(lines[0], self.x2[row], self.y2[row], mark)
            places = [r.line - self.first[row] for r in self.program.repeats.get(row, ())]
            turned = [_SIGNED.sub(_negated, lines[at]) for at in places]
            for at, line in zip(places, reversed(turned), strict=True):
                lines[at] = line[: len(line) - len(ending(line))] + ending(lines[at])
            return b"".join(lines)
        if kind == Kind.SLOT:
            cut = lines[0].index(b"G")
            head = AXES.sub(self._text(self.x2[row], self.y2[row]), lines[0][:cut], count=1)
            tail = AXES.sub(self._text(self.x1[row], self.y1[row]), lines[0][cut:], count=1)
            return head + tail
        start, end = (m.line - self.first[row] for m in self.program.routes[row])
        lines[start] = AXES.sub(self._text(self.x2[row], self.y2[row]), lines[start], count=1)
        lines[end] = AXES.sub(self._text(self.x1[row], self.y1[row]), lines[end], count=1)
        return b"".join(lines)


def _negated(found: re.Match[bytes]) -> bytes:
    sign = {b"": b"-", b"+": b"-", b"-": b""}[found[2]]
    return found[1] + sign
