"""The cheapest route that keeps the order of a broken sequence: a dynamic programme.

Entries are taken in their order.  An entry of a hole that stands there once
stays; of a hole with several entries one stays; an unknown entry goes.  Missing
holes may be drilled anywhere.  With ``d`` holes drilled more than once and
``m`` missing ones (together ``k``), a state after some entries is

* which of the ``k`` holes have been drilled (a set of bits), and
* which hole the tool is at: one of the ``k``, or the last single entry,

so ``2^k (k + 1)`` states, each with the least cost to get there.  The table is
exact by Bellman's principle; costs are integers.  Walking back through the
tables gives the route.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcp.files.order import Order
from tcp.instance import Instance
from tcp.validate.sequence import Count

Ints = NDArray[np.int64]

MAX_HOLES = 14
"""Most holes drilled more than once or never that the programme takes."""

MAX_ENTRIES = 100_000
"""Longest sequence that the programme takes."""

MAX_STATES = 40_000_000
"""Entries times states: eight bytes each."""

_INF = np.int64(2**61)


def too_hard(instance: Instance, order: Order, seen: Count) -> str | None:
    """Why the programme cannot take a sequence; None if it can."""
    k = len(seen.missing) + len(seen.duplicates)
    if instance.rules.together:
        return "holes that must follow each other are not supported"
    if instance.rules.sequential:
        return "rules about successive moves are not supported"
    if k > MAX_HOLES:
        return f"{k} holes are drilled more than once or never; at most {MAX_HOLES} are supported"
    if len(order) > MAX_ENTRIES:
        return f"the sequence has {len(order)} entries; at most {MAX_ENTRIES} are supported"
    if (len(order) + 2) << k > MAX_STATES // (k + 1):
        return f"{len(order)} entries with {k} wrong holes need more than {MAX_STATES} states"
    return None


def cheapest(instance: Instance, order: Order, seen: Count) -> tuple[int, ...] | None:
    """The cheapest route that keeps the rest of the order; None if no such route exists."""
    missing = seen.missing.tolist()
    entries = order.entries[order.entries >= 0]
    firsts = _firsts(instance, entries.tolist(), missing, seen.duplicates.tolist())
    special = np.array([*missing, *seen.duplicates.tolist()], dtype=np.int64)
    answers = []
    for first in firsts:
        found = _Programme(instance, entries, special, len(missing), first).run()
        if found is not None:
            answers.append(found)
    return min(answers)[1] if answers else None


def _firsts(
    instance: Instance, entries: list[int], missing: list[int], twice: list[int]
) -> list[int | None]:
    """Holes a closed tour can be written to begin with; None for an open route."""
    if not instance.ends.closed:
        return [None]
    if instance.ends.start is not None:
        return [instance.ends.start]
    firsts: list[int | None] = []
    for hole in entries:
        firsts.append(hole)
        if hole not in twice:
            break
    return list(dict.fromkeys([*firsts, *missing]))


@dataclass(frozen=True, eq=False)
class _Programme:
    """The sequence, its ``k`` special holes, and the cost of moves between them.

    The first ``missing`` special holes are the missing ones.  A table has a row
    for each set of special holes drilled and a column for each place: the
    special holes, then the last single entry.
    """

    instance: Instance
    entries: Ints
    special: Ints
    missing: int
    first: int | None

    @cached_property
    def which(self) -> Ints:
        """For each entry its special hole, or -1 for a single entry."""
        found = np.full(len(self.instance), -1, dtype=np.int64)
        found[self.special] = np.arange(len(self.special))
        return found[self.entries]

    @cached_property
    def single(self) -> Ints:
        """For each number of entries taken, the index of the last single one, or -1."""
        marks = np.where(self.which < 0, np.arange(len(self.entries)), -1)
        return np.concatenate([[-1], np.maximum.accumulate(marks)]) if len(marks) else marks - 1

    @cached_property
    def to_special(self) -> Ints:
        """Costs from each entry (and in a last row from nothing) to each special hole."""
        k, n = len(self.special), len(self.entries)
        costs = np.full((n + 1, k), _INF, dtype=np.int64)
        for b, hole in enumerate(self.special.tolist()):
            costs[:-1, b] = self.costs(self.entries, np.full(n, hole))
        return costs

    @cached_property
    def between(self) -> Ints:
        """Costs from each special hole to each."""
        k = len(self.special)
        i, j = np.repeat(self.special, k), np.tile(self.special, k)
        return self.costs(i, j).reshape(k, k)

    @cached_property
    def along(self) -> Ints:
        """Costs from the last single entry before each entry to that entry."""
        before = self.single[:-1] if len(self.entries) else self.single
        costs = self.costs(self.entries[before], self.entries)
        return np.where(before < 0, _INF, costs)

    @cached_property
    def levels(self) -> list[Ints]:
        """Sets of special holes, by how many missing holes are in them."""
        sets = np.arange(1 << len(self.special))
        number = sum(((sets >> b) & 1 for b in range(self.missing)), np.zeros_like(sets))
        return [np.flatnonzero(number == level) for level in range(self.missing)]

    def costs(self, i: Ints, j: Ints) -> Ints:
        """Costs of moves; infinite where forbidden."""
        values = self.instance.form.costs(i, j)
        forbidden = self.instance.form.forbidden
        if not forbidden:
            return values
        size = self.instance.form.size
        banned = np.array([a * size + b for a, b in forbidden], dtype=np.int64)
        return np.where(np.isin(np.minimum(i, j) * size + np.maximum(i, j), banned), _INF, values)

    def begin(self, hole: int) -> int:
        """Cost of beginning the route at a hole."""
        ends, form = self.instance.ends, self.instance.form
        if self.first is not None:
            return 0 if hole == self.first else int(_INF)
        if ends.start is not None and hole != ends.start:
            return int(_INF)
        return form.cost(form.home, hole) if ends.outward else 0

    def end(self, holes: Ints) -> Ints:
        """Costs of ending the route at each of ``holes``."""
        ends, form = self.instance.ends, self.instance.form
        costs = np.zeros(len(holes), dtype=np.int64)
        if self.first is not None:
            costs = self.costs(holes, np.full(len(holes), self.first))
        if ends.back:
            costs = form.costs(holes, np.full(len(holes), form.home))
        return costs if ends.end is None else np.where(holes == ends.end, costs, _INF)

    def run(self) -> tuple[int, tuple[int, ...]] | None:
        """Least cost and its route."""
        k = len(self.special)
        table = np.full((1 << k, k + 1), _INF, dtype=np.int64)
        for b in range(self.missing):
            table[1 << b, b] = self.begin(int(self.special[b]))
        tables = [self.insert(table, 0)]
        for taken in range(1, len(self.entries) + 1):
            tables.append(self.insert(self.take(tables[-1], taken), taken))
        goal = tables[-1][-1] + self.end(self.holes(len(self.entries)))
        place = int(goal.argmin())
        if goal[place] >= _INF:
            return None
        return int(goal[place]), self.back(tables, place)

    def holes(self, taken: int) -> Ints:
        """The holes that the columns stand for after ``taken`` entries."""
        last = self.single[taken] if len(self.entries) else -1
        return np.append(self.special, self.entries[last] if last >= 0 else 0)

    def arrivals(self, table: Ints, taken: int) -> Ints:
        """Costs, set by set and place by place, of moving on to entry ``taken - 1``."""
        moves: Ints = np.append(self.to_special[taken - 1], self.along[taken - 1])
        return table + moves

    def take(self, table: Ints, taken: int) -> Ints:
        """Take one entry: stay on it, or pass it by if its hole stands elsewhere too."""
        hole, b = int(self.entries[taken - 1]), int(self.which[taken - 1])
        reached = np.minimum(self.arrivals(table, taken).min(axis=1), _INF)
        if b < 0:
            new = np.full_like(table, _INF)
            new[:, -1] = reached
            if self.single[taken - 1] < 0:
                new[0, -1] = min(int(new[0, -1]), self.begin(hole))
            return new
        new, sets = table.copy(), np.arange(len(table))
        free = sets[(sets >> b) & 1 == 0]
        new[free | 1 << b, b] = np.minimum(new[free | 1 << b, b], reached[free])
        if self.single[taken - 1] < 0:
            new[1 << b, b] = min(int(new[1 << b, b]), self.begin(hole))
        return new

    def inserting(self, b: int, taken: int) -> Ints:
        """Costs of moving from each place to special hole ``b`` after ``taken`` entries."""
        last = self.single[taken] if len(self.entries) else -1
        return np.append(self.between[:, b], self.to_special[last, b])

    def insert(self, table: Ints, taken: int) -> Ints:
        """Drill any missing holes now: relax all sets in growing number of missing holes."""
        moves = [self.inserting(b, taken) for b in range(self.missing)]
        for sets in self.levels:
            for b, costs in enumerate(moves):
                free = sets[(sets >> b) & 1 == 0]
                reached = np.minimum((table[free] + costs).min(axis=1), _INF)
                table[free | 1 << b, b] = np.minimum(table[free | 1 << b, b], reached)
        return table

    def back(self, tables: list[Ints], place: int) -> tuple[int, ...]:
        """Walk back from the goal through the tables."""
        taken, drilled = len(tables) - 1, len(tables[0]) - 1
        route: list[int] = []
        while True:
            hole = int(self.holes(taken)[place])
            source = self.source(tables, taken, drilled, place)
            if source is None:
                assert int(tables[taken][drilled, place]) == self.begin(hole)
                return (hole, *reversed(route))
            moved_on = place == len(self.special) and self.which[taken - 1] < 0
            if moved_on or source[1:] != (drilled, place):
                route.append(hole)
            taken, drilled, place = source

    def source(
        self, tables: list[Ints], taken: int, drilled: int, place: int
    ) -> tuple[int, int, int] | None:
        """The state (entries taken, set, place) a state came from; None at the beginning."""
        value = int(tables[taken][drilled, place])
        passing = taken > 0 and self.which[taken - 1] >= 0
        if passing and int(tables[taken - 1][drilled, place]) == value:
            return taken - 1, drilled, place
        if place < self.missing:
            row = tables[taken][drilled & ~(1 << place)]
            totals, origin = row + self.inserting(place, taken), taken
        elif taken > 0:
            row = tables[taken - 1][drilled & ~(1 << place if place < len(self.special) else 0)]
            totals, origin = self.arrivals(row, taken), taken - 1
        else:
            return None
        match = np.flatnonzero((totals == value) & (row < _INF))
        if not len(match):
            return None
        rest = drilled & ~(1 << place) if place < len(self.special) else drilled
        return origin, rest, int(match[0])
