"""Units that can be entered at one end only: a bent routed path, a step-and-repeat block.

The solvers know pairs of nodes that belong together and may come either way
round.  A route of theirs that takes some units the wrong way is made legal
here: each of those units is put where it costs least the right way round, and
then every directed unit is moved as long as that helps.  The solvers' lower
bound holds for the legal orders as well, which are some of theirs.  Stretches
of few units are solved exactly, by a dynamic programme over their subsets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcp.boards.stretch import Stretch
from tcp.files.excellon.document import Ints
from tcp.files.excellon.rewrite import Order, Turn
from tcp.instance import Instance

FEW = 10
"""Most units of a stretch that is solved exactly."""

ROUNDS = 20
"""Most times that all directed units are tried at other places."""


def legal(stretch: Stretch, instance: Instance, order: Order) -> Order:
    """The order, or one close to it, with every directed unit worked from its first end.

    Parameters
    ----------
    stretch : Stretch
        The units.
    instance : Instance
        The stretch as a problem.
    order : Order
        A new order; directed units may be reversed in it.
    """
    directed = stretch.directed()
    if not (order.reverse & directed[order.rows - stretch.first]).any():
        return order
    turns, path = list(order), _Path(stretch, instance)
    one_way = {turn.row for turn in turns if directed[turn.row - stretch.first]}
    ways = [turns]
    if stretch.before is None and stretch.after is None:
        ways.append([Turn(t.row, not t.reverse) for t in reversed(turns)])
    found = [_settled(path, way, one_way) for way in ways]
    best: list[Turn] = min(found, key=path.cost)
    return Order.of(best)


def shortest(stretch: Stretch, instance: Instance) -> Order:
    """The shortest legal order of at most :data:`FEW` units."""
    assert len(stretch) <= FEW
    path, directed = _Path(stretch, instance), stretch.directed()
    ways = [
        Turn(row, reverse)
        for row in range(stretch.first, stretch.last)
        for reverse in ((False,) if directed[row - stretch.first] else (False, True))
    ]
    bits = [1 << (way.row - stretch.first) for way in ways]
    enter, links, leave = (costs.tolist() for costs in path.table(ways))
    best = {(bit, k): (enter[k], -1) for k, bit in enumerate(bits)}
    for used in range(1, 1 << len(stretch)):
        for k in (k for k, bit in enumerate(bits) if (used, k) in best):
            cost = best[used, k][0]
            for j, bit in enumerate(bits):
                total = cost + links[k][j]
                if not used & bit and total < best.get((used | bit, j), (total + 1, 0))[0]:
                    best[used | bit, j] = (total, k)
    used = (1 << len(stretch)) - 1
    k = min(
        (k for k in range(len(ways)) if (used, k) in best),
        key=lambda k: best[used, k][0] + leave[k],
    )
    order = []
    while k >= 0:
        order.append(ways[k])
        used, k = used & ~bits[k], best[used, k][1]
    return Order.of(order[::-1])


def _settled(path: _Path, turns: list[Turn], one_way: set[int]) -> list[Turn]:
    """The wrong ones put right, then every directed unit where it costs least."""
    wrong = [t.row for t in turns if t.reverse and t.row in one_way]
    order = [t for t in turns if t.row not in wrong]
    for row in wrong:
        order.insert(path.cheapest(order, Turn(row)), Turn(row))
    cost = path.cost(order)
    for _ in range(ROUNDS):
        for row in sorted(one_way):
            order = [t for t in order if t.row != row]
            order.insert(path.cheapest(order, Turn(row)), Turn(row))
        before, cost = cost, path.cost(order)
        if cost >= before:
            break
    return order


@dataclass(frozen=True)
class _Path:
    """Costs of orders of a stretch's units, between its fixed ends."""

    stretch: Stretch
    instance: Instance

    def cheapest(self, order: list[Turn], unit: Turn) -> int:
        """The position at which a unit makes an order longer by least."""
        entry, leave = self._ends([unit])
        entries, leaves = self._ends(order)
        start, end = self._fixed()
        from_, to = np.concatenate((start, leaves)), np.concatenate((entries, end))
        into = self._costs(from_, np.repeat(entry, len(from_)))
        out = self._costs(np.repeat(leave, len(to)), to)
        return int(np.argmin(into + out - self._costs(from_, to)))

    def cost(self, order: list[Turn]) -> int:
        """Cost of an order."""
        return self.instance.cost(self.stretch.route(Order.of(order)))

    def table(self, ways: list[Turn]) -> tuple[Ints, Ints, Ints]:
        """Costs from the start into each way, from each way to the next, from each to the end."""
        entries, leaves = self._ends(ways)
        start, end = (np.repeat(node, len(ways)) for node in self._fixed())
        links = self._costs(np.repeat(leaves, len(ways)), np.tile(entries, len(ways)))
        square = links.reshape(len(ways), len(ways))
        return self._costs(start, entries), square, self._costs(leaves, end)

    def _fixed(self) -> tuple[Ints, Ints]:
        """The nodes before and behind the stretch; -1 where it begins or ends anywhere."""
        nodes, free = len(self.stretch.nodes()[2]), np.array([-1])
        before = free if self.stretch.before is None else np.array([nodes])
        behind = nodes + (self.stretch.before is not None)
        return before, free if self.stretch.after is None else np.array([behind])

    def _ends(self, order: Sequence[Turn]) -> tuple[Ints, Ints]:
        """The nodes at which units are entered and left."""
        unit = self.stretch.nodes()[2]
        rows = np.array([t.row for t in order], dtype=np.int64)
        turned = np.array([t.reverse for t in order], dtype=np.bool_)
        first = np.searchsorted(unit, rows)
        last = np.searchsorted(unit, rows, side="right") - 1
        return np.where(turned, last, first), np.where(turned, first, last)

    def _costs(self, p: Ints, q: Ints) -> Ints:
        """Costs of moves between nodes; nothing where one of them is -1."""
        costs = self.instance.form.costs(np.maximum(p, 0), np.maximum(q, 0))
        open_end: NDArray[np.bool_] = (p < 0) | (q < 0)
        return np.where(open_end, 0, costs)
