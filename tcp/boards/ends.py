"""Paths through one tool's units for other ends than those of the shortest path.

Where the next tool begins may matter more than a path's own length.  A small
tool has a shortest path between every two ends, all from one dynamic
programme; the path of a larger one is solved again between the places that its
neighbours leave and enter, or at least turned round at both ends.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tcp.boards.chain import FAR, Candidate, linker
from tcp.boards.steady import solve_by_place
from tcp.boards.stretch import Stretch
from tcp.files.excellon.document import Ints
from tcp.files.excellon.program import Place
from tcp.files.excellon.rewrite import Order
from tcp.solve import refuses
from tcp.stop import Stop
from tcp.travel import CostRule, Travel

TABLE = 2**22
"""Most numbers in the table of shortest paths between every two ends: 14 holes, or 12 slots."""

TABLES = 2**28
"""Most bytes that the tables of a board's tools keep; further tools count as large ones."""

PROVER = "branch-and-cut"


@dataclass(frozen=True, eq=False)
class Units:
    """A stretch of units without neighbours under the same tool, and what its paths cost.

    Parameters
    ----------
    stretch : Stretch
        The units.
    rule : CostRule
        Costs of moves.
    inside : int
        What the units take themselves, whatever their order.
    """

    stretch: Stretch
    rule: CostRule
    inside: int

    @classmethod
    def of(cls, stretch: Stretch, rule: CostRule, cost: int) -> Units:
        """The units of a stretch that takes ``cost`` in the file's own order."""
        bare = cls(stretch, rule, 0)
        return replace(bare, inside=cost - bare.cost(stretch.as_is()))

    def doors(self, order: Order) -> tuple[Ints, Ints]:
        """Where each unit of an order is entered and left, as rows."""
        rows, turned = self.stretch.program.rows, order.reverse[:, None]
        one = np.stack([rows.x1[order.rows], rows.y1[order.rows]], axis=1).astype(np.int64)
        two = np.stack([rows.x2[order.rows], rows.y2[order.rows]], axis=1).astype(np.int64)
        return np.where(turned, two, one), np.where(turned, one, two)

    def cost(self, order: Order) -> int:
        """What an order takes."""
        entry, leave = self.doors(order)
        gaps = entry[1:] - leave[:-1]
        return self.inside + int(self.rule.costs(gaps[:, 0], gaps[:, 1]).sum())

    def candidate(self, order: Order) -> Candidate:
        """An order as a candidate for the chain."""
        entry, leave = self.doors(order)
        orders = {self.stretch.first: order}
        return Candidate(self.cost(order), place(entry[0]), place(leave[-1]), orders.copy)

    def both_ways(self, order: Order) -> list[Candidate]:
        """An order, and where units may be reversed the same path backwards."""
        if self.stretch.directed().any():
            return [self.candidate(order)]
        return [self.candidate(order), self.candidate(self.stretch.backwards(order))]


def place(row: Ints) -> Place:
    """A row of coordinates as a place."""
    return int(row[0]), int(row[1])


def states_of(stretch: Stretch) -> Order:
    """Every unit as it is, then those that may be worked from their other end as well."""
    rows, part = stretch.program.rows, slice(stretch.first, stretch.last)
    two = (rows.x1[part] != rows.x2[part]) | (rows.y1[part] != rows.y2[part])
    free = np.flatnonzero(two & ~stretch.directed())
    count = len(stretch)
    states = np.concatenate([np.arange(count), free])
    return Order(states + stretch.first, np.arange(len(states)) >= count)


def table(stretch: Stretch) -> int:
    """How many numbers the table of :func:`all_ends` has."""
    return len(states_of(stretch)) ** 2 << len(stretch)


def few(stretch: Stretch) -> bool:
    """Whether the table of :func:`all_ends` is small enough."""
    return len(stretch) <= 20 and table(stretch) <= TABLE


def all_ends(units: Units) -> list[Candidate]:
    """A shortest path between every two ends of a few units, see :func:`few`.

    Held and Karp's dynamic programme (see :mod:`tcp.exact.held_karp`) from all
    starts at once: ``best[S, a, b]`` is the cheapest way from ``a`` through all
    units of S to ``b``, where a state is a unit and the way round it is worked;
    ``came[S, a, b]`` is the state before ``b`` on it, which is all that is kept.
    """
    states = states_of(units.stretch)
    count, first = len(units.stretch), units.stretch.first
    unit = states.rows - first
    entry, leave = units.doors(states)
    moves = linker(units.rule)(leave, entry)
    best = np.full((1 << count, len(unit), len(unit)), FAR, dtype=np.int64)
    each = np.arange(len(unit))
    best[1 << unit, each, each] = 0
    came = np.zeros(best.shape, dtype=np.uint8)
    ways = [np.flatnonzero(unit == u) for u in range(count)]
    for done in range(1, (1 << count) - 1):
        onward = best[done][:, :, None] + moves
        last = onward.argmin(axis=1)
        further = np.take_along_axis(onward, last[:, None, :], axis=1)[:, 0]
        for u in range(count):
            if not done >> u & 1:
                best[done | 1 << u][:, ways[u]] = further[:, ways[u]]
                came[done | 1 << u][:, ways[u]] = last[:, ways[u]]

    def path(a: int, b: int) -> dict[int, Order]:
        done, found = (1 << count) - 1, [b]
        while done != 1 << unit[a]:
            before = int(came[done, a, found[-1]])
            done ^= 1 << int(unit[found[-1]])
            found.append(before)
        turns = found[::-1]
        return {first: Order(states.rows[turns], states.reverse[turns])}

    least = best[-1]
    found = [
        Candidate(
            units.inside + int(least[a, b]),
            place(entry[a]),
            place(leave[b]),
            partial(path, a, b),
        )
        for a, b in zip(*(side.tolist() for side in np.nonzero(least < FAR)), strict=True)
    ]
    return sorted(found, key=lambda way: (way.entry, way.exit))  # ties know no file order


def turned(units: Units, order: Order, before: Place | None, after: Place | None) -> Order:
    """The order with its beginning, or its end, reversed as long as that shortens the way.

    ``before`` and ``after`` are the places that the machine comes from and goes to.
    """
    stretch = units.stretch
    while True:
        gain, count = _reversal(units, order, before)
        if gain > 0:
            order = _reversed(stretch, order, count)
            continue
        back = stretch.backwards(order)
        gain, count = _reversal(units, back, after)
        if gain <= 0:
            return order
        order = stretch.backwards(_reversed(stretch, back, count))


def _reversal(units: Units, order: Order, before: Place | None) -> tuple[int, int]:
    """What is gained most by reversing a beginning of an order, and how many units it has."""
    if before is None or len(order) < 2:
        return 0, 0
    entry, leave = units.doors(order)
    come = np.array([before], dtype=np.int64)

    def way(p: Ints, q: Ints) -> Ints:
        return units.rule.costs(p[:, 0] - q[:, 0], p[:, 1] - q[:, 1])

    old = way(come, entry[:1]) + way(leave[:-1], entry[1:])
    gains = old - way(come, leave[:-1]) - way(entry[:1], entry[1:])
    return int(gains.max()), int(gains.argmax()) + 1


def _reversed(stretch: Stretch, order: Order, count: int) -> Order:
    """The order with its first ``count`` units backwards."""
    head = stretch.backwards(Order(order.rows[:count], order.reverse[:count]))
    return joined(head, Order(order.rows[count:], order.reverse[count:]))


def joined(one: Order, other: Order) -> Order:
    """One order after the other."""
    return Order(
        np.concatenate([one.rows, other.rows]), np.concatenate([one.reverse, other.reverse])
    )


def tied(
    units: Units,
    order: Order,
    before: Place | None,
    after: Place | None,
    travel: Travel,
    seconds: float,
    seed: int,
) -> Order:
    """The shortest way from ``before`` through all units to ``after`` that the time suffices for.

    It starts from ``order`` and is never longer.
    """
    stretch = replace(units.stretch, before=before, after=after)
    instance, known = stretch.instance(travel), stretch.route(order)
    if refuses(PROVER, instance) is not None:
        return order
    found = solve_by_place(instance, PROVER, stop=Stop(seconds), seed=seed, start_route=known)
    if found.route is None or found.cost is None or found.cost >= instance.cost(known):
        return order
    return stretch.order(found.route)
