"""Writes a drill file again with its units in another order, and touches nothing else.

The output is a *plan* of the original text: stretches of lines copied as they
are, and units put into the places of other units.  A unit's text is copied
too; only where it leans on what used to stand before it (an omitted
coordinate, an incremental step) or is worked from its other end are its
coordinates written anew, in the file's own number format.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tcp.files.excellon.document import Ints, ending
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


@dataclass(frozen=True, eq=False)
class Order:
    """Units in a new order.

    Parameters
    ----------
    rows : int64 array of shape (n,)
        The units.
    reverse : bool array of shape (n,)
        Those that are worked from their other end.
    """

    rows: Ints
    reverse: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Turn]:
        return map(Turn, self.rows.tolist(), self.reverse.tolist())

    @classmethod
    def of(cls, turns: Iterable[Turn]) -> Order:
        """From single turns."""
        turns = list(turns)
        rows = np.array([t.row for t in turns], dtype=np.int64)
        return cls(rows, np.array([t.reverse for t in turns], dtype=np.bool_))

    @classmethod
    def as_is(cls, first: int, last: int) -> Order:
        """Units ``first .. last - 1`` as the file has them."""
        return cls(np.arange(first, last), np.zeros(last - first, dtype=np.bool_))

    def same(self, other: Order) -> bool:
        """Whether two orders are one."""
        return np.array_equal(self.rows, other.rows) and np.array_equal(self.reverse, other.reverse)

    def slice(self, first: int, last: int) -> Order:
        """A piece of it."""
        return Order(self.rows[first:last], self.reverse[first:last])


Orders = Mapping[int, Order]
"""New order of stretches, by their first row; stretches left out keep theirs."""


@dataclass(frozen=True)
class Text:
    """Plan item: lines ``first .. last - 1`` as they are."""

    first: int
    last: int


@dataclass(frozen=True, eq=False)
class Put:
    """Plan item: units, in the places of the units ``slot``, ``slot + 1``, ..., which touch."""

    order: Order
    slot: int


Plan = Iterator[Text | Put]

CHUNK = 65_536
"""Units that are written at once."""


def reorder(program: Program, orders: Orders) -> bytes:
    """The file with some stretches in another order.

    Parameters
    ----------
    program : Program
        The file.
    orders : mapping of int to Order
        For stretches by their first row: each row of the stretch once.
    """
    return Writer(program).write(plan(program, orders, 0, len(program.document)))


def plan(program: Program, orders: Orders, first: int, last: int) -> Plan:
    """Plan of the lines ``first .. last - 1`` with stretches re-ordered."""
    rows, at = program.rows, first
    for a, b in program.stretches():
        if not first <= rows.first[a] < last:
            continue
        order = orders.get(a)
        order = Order.as_is(a, b) if order is None else order
        gaps = np.flatnonzero(rows.first[a + 1 : b] > rows.last[a : b - 1]) + a + 1
        for slot, end in pairwise([a, *gaps.tolist(), b]):
            if rows.first[slot] > at:
                yield Text(at, int(rows.first[slot]))
            for begin in range(slot, end, CHUNK):
                yield Put(order.slice(begin - a, min(begin + CHUNK, end) - a), begin)
            at = int(rows.last[end - 1])
    if at < last:
        yield Text(at, last)


class Writer:
    """Carries out a plan, keeping track of where the machine is."""

    def __init__(self, program: Program):
        self.program, self.rows = program, program.rows
        self.starts = program.document.starts
        self.at: Place | None = None  # None: unknown, so what comes next must name both axes
        self.slot = -1

    def write(self, plan: Plan) -> bytes:
        """The bytes of a plan."""
        out = []
        for item in plan:
            if isinstance(item, Text):
                out.append(self.program.document.text(item.first, item.last))
            else:
                out.append(self._put(item))
        return b"".join(out)

    def _put(self, put: Put) -> bytes:
        """Units in the places of others: copied all at once where none has to be rewritten."""
        rows, n = put.order.rows, len(put.order)
        slots = np.arange(put.slot, put.slot + n)
        self._come_to(put.slot)
        kept = np.array_equal(rows, slots) and not put.order.reverse.any()
        self.slot = put.slot + n - 1
        if kept and self._before(put.slot) == self.at:
            self.at = self._end(Turn(put.slot + n - 1))
            return self.program.document.text(self.rows.first[put.slot], self.rows.last[slots[-1]])
        if self._copied(put.order, slots):
            begin, stop = self.starts[self.rows.first[rows]], self.starts[self.rows.last[rows]]
            self.at = self._end(Turn(int(rows[-1])))
            data = self.program.document.data
            return b"".join([data[i:j] for i, j in zip(begin.tolist(), stop.tolist(), strict=True)])
        out = []
        for turn, slot in zip(put.order, slots.tolist(), strict=True):
            out.append(self._fit(self.unit(turn), slot))
            self.at = self._end(turn)
        return b"".join(out)

    def _copied(self, order: Order, slots: Ints) -> bool:
        """Whether units can be copied: coordinates complete, line endings those of the places."""
        complete = (self.rows.mark[order.rows] & Mark.COMPLETE) != 0
        if order.reverse.any() or not complete.all():
            return False
        endings = self.program.document.endings
        return bool((endings(self.rows.last[order.rows]) == endings(self.rows.last[slots])).all())

    def _fit(self, text: bytes, slot: int) -> bytes:
        """A unit's text with the line ending of the place where it goes."""
        stop = int(self.starts[self.rows.last[slot]])
        wanted = ending(self.program.document.data[max(stop - 2, 0) : stop])
        return text[: len(text) - len(ending(text[-2:]))] + wanted

    def _first(self, row: int) -> Place:
        return int(self.rows.x1[row]), int(self.rows.y1[row])

    def _last(self, row: int) -> Place:
        return int(self.rows.x2[row]), int(self.rows.y2[row])

    def _end(self, turn: Turn) -> Place | None:
        """Where a unit leaves the machine; nobody knows behind a block or a canned cycle."""
        if self.rows.kind[turn.row] in (Kind.BLOCK, Kind.CANNED):
            return None
        return self._first(turn.row) if turn.reverse else self._last(turn.row)

    def _before(self, row: int) -> Place | None:
        """Where the machine is in the original when it comes to a unit."""
        if row in self.program.jumps or not row:
            return self.program.jumps.get(row)
        return self._end(Turn(row - 1))

    def _come_to(self, slot: int) -> None:
        """The text before a place may move the machine, whatever unit stood before that text."""
        if slot == self.slot + 1 and slot in self.program.jumps:
            self.at = self.program.jumps[slot]

    def unit(self, turn: Turn) -> bytes:
        """Text of a unit, rewritten only where it must be."""
        row, first = turn.row, int(self.rows.first[turn.row])
        text = self.program.document.text(first, self.rows.last[row])
        if turn.reverse:
            return self._reversed(row)
        kept = self.at is not None and self._before(row) == self.at
        if self.rows.mark[row] & Mark.COMPLETE or kept:
            return text
        line = self.program.routes[row][0].line if row in self.program.routes else first
        begin, stop = (int(self.starts[at] - self.starts[first]) for at in (line, line + 1))
        return text[:begin] + self._placed(text[begin:stop], row, self._first(row)) + text[stop:]

    def _placed(self, line: bytes, row: int, place: Place) -> bytes:
        """A line with its first coordinates written anew."""
        x, y = place
        if self.rows.mark[row] & Mark.INCREMENTAL:
            assert self.at is not None, "a step from nowhere, which the reader refuses"
            px, py = self.at
            x, y = x - px, y - py
        return AXES.sub(self._text(x, y), line, count=1)

    def _text(self, x: int, y: int) -> bytes:
        style = self.program.style
        return b"X" + style.write(x) + b"Y" + style.write(y)

    def _reversed(self, row: int) -> bytes:
        document, first, kind = (
            self.program.document,
            int(self.rows.first[row]),
            self.rows.kind[row],
        )
        lines = [document.line(i) for i in range(first, int(self.rows.last[row]))]
        begin, end = self._text(*self._first(row)), self._text(*self._last(row))
        if kind == Kind.HIT:
            lines[0] = self._placed(lines[0], row, self._last(row))
            places = [r.line - first for r in self.program.repeats.get(row, ())]
            turned = [_backwards(lines[at]) for at in places]
            for at, line in zip(places, reversed(turned), strict=True):
                lines[at] = line[: len(line) - len(ending(line))] + ending(lines[at])
            return b"".join(lines)
        if kind == Kind.SLOT:
            cut = lines[0].index(b"G")
            head = AXES.sub(end, lines[0][:cut], count=1)
            return head + AXES.sub(begin, lines[0][cut:], count=1)
        start, stop = (m.line - first for m in self.program.routes[row])
        lines[start] = AXES.sub(end, lines[start], count=1)
        lines[stop] = AXES.sub(begin, lines[stop], count=1)
        return b"".join(lines)


def _backwards(line: bytes) -> bytes:
    """A line of repeats with its step the other way; its comment stays."""
    words, semicolon, comment = line.partition(b";")
    return _SIGNED.sub(_negated, words) + semicolon + comment


def _negated(found: re.Match[bytes]) -> bytes:
    sign = {b"": b"-", b"+": b"-", b"-": b""}[found[2]]
    return found[1] + sign
