"""Repair a sequence that is no route: every smallest repair, and the cheapest of all.

*Smallest repairs* change as few entries as possible: of each hole drilled more
than once one entry stays; every other surplus or unknown entry is replaced by a
missing hole; what is left over is deleted or inserted.

*The cheapest repair* keeps the order of the entries that stay, chooses which of
each hole's entries that is, and puts the missing holes wherever they cost
least.  It is exact: see :mod:`tcp.validate.reorder`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from tcp.files.order import Order, order_of
from tcp.instance import Instance
from tcp.validate.known import Known
from tcp.validate.reorder import cheapest, too_hard
from tcp.validate.route import faults
from tcp.validate.sequence import Count, count, walk

Ints = NDArray[np.int64]

LISTED = 1000
"""So many smallest repairs are listed (fewer for very long sequences)."""

COUNTED, MOST = 50, 10**18
"""With more changes than the first, or so many ways, the number of ways is given as the second."""

_WORK = 20_000_000


@dataclass(frozen=True)
class Repair:
    """One repaired route.

    Parameters
    ----------
    route : tuple of int
        Holes in drilling order, by position in the workpiece.
    cost : int
        Its cost in quanta.
    edits : tuple of str
        What was changed, in words.
    """

    route: tuple[int, ...]
    cost: int
    edits: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Repairs:
    """All that is known about repairing a sequence.

    Parameters
    ----------
    instance : Instance
        The problem.
    changes : int
        Entries that every smallest repair replaces, deletes or inserts.
    total : int
        Number of ways to do that; :data:`MOST` stands for that many or more.
    smallest : tuple of Repair
        Those that satisfy the ends and rules, cheapest first; of the first
        :data:`LISTED` ways where there are more.
    best : Repair or None
        The cheapest route that keeps the rest of the order, proven by dynamic
        programming; None if there is none or it was not computed.
    refusal : str or None
        Why ``best`` was not computed.
    known : Known or None
        The certified bound it can be compared with.
    """

    instance: Instance
    changes: int
    total: int
    smallest: tuple[Repair, ...]
    best: Repair | None
    refusal: str | None
    known: Known | None = None

    @property
    def complete(self) -> bool:
        """Whether every smallest repair was looked at."""
        return self.total <= _limit(len(self.instance))

    def time(self, repair: Repair) -> Fraction:
        """Travel time of a repair."""
        return repair.cost * self.instance.quantum

    def above(self, repair: Repair) -> float | None:
        """Per cent above the certified lower bound."""
        if self.known is None or not self.known.lower:
            return None
        return 100 * (repair.cost - self.known.lower) / self.known.lower


def repair(
    instance: Instance,
    route: str | Iterable[str | int] | Ints | Order,
    *,
    known: Known | None = None,
    numbering: str = "ids",
) -> Repairs:
    """Repair a sequence of holes.

    Parameters
    ----------
    instance : Instance
        Workpiece, travel model, ends and rules.
    route : str, iterable of labels, int64 array, or Order
        The sequence, as for :func:`tcp.validate.validate`.
    known : Known, optional
        What is certified about the instance.
    numbering : str
        ``ids``, ``0`` or ``1``.

    Returns
    -------
    Repairs
        All smallest repairs and the cheapest route that keeps the rest of the order.

    Raises
    ------
    InputError
        If the sequence cannot be read at all.
    """
    order = order_of(route, instance.workpiece, numbering)
    seen = count(order, len(instance))
    slots = _Slots.of(order, seen)
    listed = itertools.islice(slots.repairs(), _limit(len(order)))
    names = _Names(instance, order)
    smallest = [
        Repair(way, walk(instance, np.array(way)), names.edits(edits))
        for way, edits in listed
        if not faults(instance, way)
    ]
    refusal = too_hard(instance, order, seen)
    best = None
    if refusal is None:
        found = cheapest(instance, order, seen)
        if found is not None:
            assert not faults(instance, found)
            best = Repair(found, walk(instance, np.array(found)), _moves(instance, order, found))
    smallest.sort(key=lambda r: (r.cost, r.route))
    return Repairs(instance, slots.changes, slots.total, tuple(smallest), best, refusal, known)


def _limit(entries: int) -> int:
    return max(2, min(LISTED, _WORK // max(entries, 1)))


@dataclass(frozen=True)
class _Slots:
    """Which entries can go, and which holes have to come."""

    entries: list[int]
    groups: tuple[tuple[int, ...], ...]
    unknown: tuple[int, ...]
    missing: tuple[int, ...]

    @classmethod
    def of(cls, order: Order, seen: Count) -> _Slots:
        at = np.flatnonzero(np.isin(order.entries, seen.duplicates))
        places: dict[int, list[int]] = {}
        for k in at.tolist():
            places.setdefault(int(order.entries[k]), []).append(k)
        return cls(
            order.entries.tolist(),
            tuple(tuple(p) for p in places.values()),
            tuple(np.flatnonzero(order.entries < 0).tolist()),
            tuple(seen.missing.tolist()),
        )

    @property
    def surplus(self) -> int:
        return len(self.unknown) + sum(len(g) - 1 for g in self.groups)

    @property
    def changes(self) -> int:
        return max(self.surplus, len(self.missing))

    @property
    def total(self) -> int:
        """Number of smallest repairs, up to :data:`MOST`."""
        s, m = self.surplus, len(self.missing)
        if self.changes > COUNTED or len(self.groups) > COUNTED:
            return MOST
        ways = math.prod(len(g) for g in self.groups)
        if s >= m:
            return min(ways * math.perm(s, m), MOST)
        kept = len(self.entries)
        gaps = math.prod(range(kept + 1, kept + 1 + m - s))
        return min(ways * math.perm(m, s) * gaps, MOST)

    def repairs(self) -> Iterator[tuple[tuple[int, ...], list[tuple[str, int, int]]]]:
        """Every smallest repair with its edits (kind, place from 0, hole); none of very many."""
        if self.changes > COUNTED:
            return
        for stay in itertools.product(*self.groups):
            free = [*self.unknown, *(k for g in self.groups for k in g if k not in stay)]
            free.sort()
            fill = min(len(free), len(self.missing))
            if len(free) > len(self.missing):
                for slots in itertools.permutations(free, fill):
                    yield self._edit(dict(zip(slots, self.missing, strict=True)), free, ())
            else:
                for holes in itertools.permutations(self.missing, fill):
                    rest = [h for h in self.missing if h not in holes]
                    yield from self._inserted(dict(zip(free, holes, strict=True)), free, rest)

    def _inserted(
        self, fills: dict[int, int], free: list[int], rest: list[int]
    ) -> Iterator[tuple[tuple[int, ...], list[tuple[str, int, int]]]]:
        base, edits = self._edit(fills, free, ())

        gaps = (range(len(base) + 1 + k) for k in range(len(rest)))
        for places in itertools.product(*gaps):
            route = list(base)
            for place, hole in zip(places, rest, strict=True):
                route.insert(place, hole)
            at = {hole: k for k, hole in enumerate(route)}
            yield tuple(route), edits + [("insert", at[h], h) for h in rest]

    def _edit(
        self, fills: dict[int, int], free: list[int], _: tuple[()]
    ) -> tuple[tuple[int, ...], list[tuple[str, int, int]]]:
        gone = {k for k in free if k not in fills}
        route = tuple(fills.get(k, h) for k, h in enumerate(self.entries) if k not in gone)
        edits = [("replace", k, fills[k]) for k in sorted(fills)]
        return route, edits + [("delete", k, -1) for k in sorted(gone)]


@dataclass(frozen=True)
class _Names:
    """Says what an edit does, with hole ids and places from 1."""

    instance: Instance
    order: Order

    def entry(self, place: int) -> str:
        value = int(self.order.entries[place])
        return self.instance.workpiece.ids[value] if value >= 0 else self.order.unknown[-1 - value]

    def edits(self, edits: list[tuple[str, int, int]]) -> tuple[str, ...]:
        """Sentences such as ``place 1: 2 becomes 42``."""
        ids, words = self.instance.workpiece.ids, []
        for kind, place, hole in edits:
            if kind == "replace":
                words.append(f"place {place + 1}: {self.entry(place)} becomes {ids[hole]}")
            elif kind == "delete":
                words.append(f"place {place + 1}: {self.entry(place)} is deleted")
            else:
                words.append(f"{ids[hole]} is inserted as place {place + 1}")
        return tuple(words)


def _moves(instance: Instance, order: Order, route: tuple[int, ...]) -> tuple[str, ...]:
    """What the cheapest repair did: entries left out, holes put in."""
    ids = instance.workpiece.ids
    stays: dict[int, int] = {}
    place = 0
    entries = order.entries.tolist()
    for hole in route:
        try:
            place = entries.index(hole, place) + 1
        except ValueError:
            continue
        stays[place - 1] = hole
    names = _Names(instance, order)
    words = [
        f"place {k + 1}: {names.entry(k)} is left out"
        for k in range(len(entries))
        if k not in stays
    ]
    put = set(route) - set(stays.values())
    before = dict(zip(route[1:], route, strict=False))
    for hole in [h for h in route if h in put]:
        where = f"after {ids[before[hole]]}" if hole in before else "first"
        words.append(f"{ids[hole]} is drilled {where}")
    return tuple(words)
