"""The Held-Karp bound: 1-tree ascent for open paths and closed tours of any size.

A 1-tree is a spanning tree of all nodes but one, plus two edges of that *special* node.  Every
tour is one, so under node potentials p the lightest 1-tree bounds every tour from below:

    scale * cost(tour) >= sum 2 p_i + min over 1-trees of sum (scale * c_ij - p_i - p_j)

(M. Held and R. M. Karp, "The traveling-salesman problem and minimum spanning trees: part II",
Mathematical Programming 1 (1971)).  For an open path the virtual node is the special one: the
ends of the path then cost what their potentials say, and nothing is ever cut out of a tour.

The ascent (:mod:`tcp.bounds.ascent`) looks at trees of candidate pairs only: O(n k) memory.
Those trees prove nothing.  The bound that is returned comes from exact trees over all pairs
(:mod:`tcp.bounds.spanning`) in integers, whose new pairs join the candidates.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tcp.bounds.ascent import Ascent, lightest_tree
from tcp.bounds.candidates import near_pairs
from tcp.bounds.spanning import HUGE, Cells, boruvka, cells, prim
from tcp.instance import Instance
from tcp.kernels import pack
from tcp.result import Progress, Report, silent
from tcp.stop import Clock, Stop, compiling_is_free
from tcp.travel import Ints

PRECISION = 2**10
"""Potentials are multiples of 1/1024 quantum, where 62 bits allow."""

ROUNDS = 4
"""Exact trees in an ascent; each one shows the ascent the pairs it lacked.

More of them cost more than they show: 8 gain 4e-7 of the bound of 20,000 random holes.
"""


@dataclass(frozen=True, eq=False)
class Bound:
    """A lower bound on every route, and what proves it.

    Parameters
    ----------
    value : int
        No route costs less, in quanta; a multiple of the instance's granularity.
    exact : int
        ``scale`` times the bound before rounding.
    scale : int
        Weight of the costs.
    potentials : int64 array of shape (form.size,)
        One per node.
    tree : int64 array of shape (m, 2)
        The exact tree on all nodes but ``special``.
    special : int
        The node outside the tree; its two lightest edges complete it.
    iterations : int
        Trees looked at.
    """

    value: int
    exact: int
    scale: int
    potentials: Ints
    tree: Ints
    special: int
    iterations: int


def one_tree_bound(
    instance: Instance,
    *,
    iterations: int | None = None,
    width: int = 8,
    clock: Clock | None = None,
    report: Report = silent,
) -> Bound:
    """Held-Karp lower bound of an instance.

    Parameters
    ----------
    instance : Instance
        The problem; any number of holes.
    iterations : int, optional
        Trees in the ascent, >= 1; by default 2,000 for small workpieces, 200 for the largest.
    width : int
        Candidate pairs per node, 2 to 50.
    clock : Clock, optional
        Ends the ascent early; the bound is valid all the same.  It stands still while numba
        compiles.
    report : callable
        Receives the exact bounds as they come.

    Returns
    -------
    Bound
        The best exact bound found.
    """
    clock = clock or Clock(Stop())
    if instance.form.size <= 3:
        return _only_tour(instance)
    with compiling_is_free(clock):
        return _ascend(_Ground.of(instance, width), iterations, width, clock, report)


def _ascend(
    ground: _Ground, iterations: int | None, width: int, clock: Clock, report: Report
) -> Bound:
    """The ascent, in rounds that each end in an exact bound."""
    total = iterations or int(np.clip(200_000_000 // (ground.n * width), 200, 2_000))
    best = ground.exact(np.zeros(ground.n), 0)  # no potentials: at least 0
    ascent = _Climb(ground, ground.place[best.tree], total)
    for turn in range(1, ROUNDS + 1):
        while ascent.steps < total * turn // ROUNDS and clock.reason() is None:
            ascent.step()
        found = ground.exact(ascent.best, ascent.steps)
        best = found if found.exact > best.exact else replace(best, iterations=ascent.steps)
        report(Progress(clock.elapsed, None, best.value, ascent.steps, "bound"))
        if clock.reason() is not None:
            break
        ascent.learn(ground.place[found.tree])
    return best


def _only_tour(instance: Instance) -> Bound:
    """Up to three nodes have one tour; potentials that make all its edges weigh nothing."""
    form = instance.form
    cost, p = form.tour_cost(np.arange(form.size)), np.zeros(form.size, dtype=np.int64)
    scale = 2 if form.size == 3 else 1
    if form.size == 2:
        p[0] = form.cost(0, 1)
    if form.size == 3:
        a, b, c = form.cost(0, 1), form.cost(1, 2), form.cost(0, 2)
        p[:] = a + c - b, a + b - c, b + c - a
    return Bound(cost, scale * cost, scale, p, np.empty((0, 2), dtype=np.int64), 0, 0)


@dataclass(frozen=True, eq=False)
class _Ground:
    """An instance around its special node; ``nodes`` are the others, which the trees span.

    Pairs, potentials and weights of this class and the ascent are by place in ``nodes``.
    """

    instance: Instance
    special: int
    nodes: Ints
    place: Ints
    scale: int
    to_special: Ints
    needs: tuple[int, ...]
    near: Ints
    forced: Ints
    bans: Ints
    space: Cells | None

    @classmethod
    def of(cls, instance: Instance, width: int) -> _Ground:
        """Take the virtual node out, else home, else the first hole."""
        form = instance.form
        special = max(form.virtual, form.home, 0)
        nodes = np.delete(np.arange(form.size), special)
        place = np.full(form.size, -1)
        place[nodes] = np.arange(nodes.size)
        inner = [(place[i], place[j]) for i, j in form.forced if special not in (i, j)]
        bans = [(place[i], place[j]) for i, j in form.forbidden if special not in (i, j)]
        scale = _scale(instance)
        return cls(
            instance=instance,
            special=special,
            nodes=nodes,
            place=place,
            scale=scale,
            to_special=scale * form.costs(nodes, np.full_like(nodes, special)),
            needs=tuple(int(place[i + j - special]) for i, j in form.forced if special in (i, j)),
            near=near_pairs(form, nodes, width),
            forced=np.array(inner, dtype=np.int64).reshape(-1, 2),
            bans=np.array(sorted(i * nodes.size + j for i, j in bans), dtype=np.int64),
            space=None if form.matrix is not None else cells(form.x[nodes], form.y[nodes]),
        )

    @property
    def n(self) -> int:
        """Number of nodes in the trees."""
        return int(self.nodes.size)

    def costs(self, pairs: Ints) -> Ints:
        """Scaled costs of pairs."""
        i, j = self.nodes[pairs[:, 0]], self.nodes[pairs[:, 1]]
        return self.scale * self.instance.form.costs(i, j)

    def partners(self, weights: Any) -> Ints:
        """Where the special node's two edges go: as it needs, else to the lightest."""
        few = np.argpartition(weights, 3)[:4] if self.n > 4 else np.arange(self.n)
        light = [int(k) for k in few[np.argsort(weights[few], kind="stable")]]
        needed = list(dict.fromkeys(self.needs))
        return np.array([*needed, *(k for k in light if k not in needed)][:2], dtype=np.int64)

    def exact(self, potentials: Any, steps: int) -> Bound:
        """The bound that some potentials give, over all pairs and in integers."""
        value = np.rint(potentials).astype(np.int64)
        tree = self.spanning(value)
        weights = self.costs(tree) - value[tree[:, 0]] - value[tree[:, 1]]
        around = self.to_special - value
        exact = sum((2 * value).tolist()) + sum(weights.tolist())
        exact += sum(around[self.partners(around)].tolist())
        full = np.zeros(self.instance.form.size, dtype=np.int64)
        full[self.nodes] = value
        g = self.instance.granularity
        least = -(-exact // (self.scale * g)) * g
        return Bound(least, exact, self.scale, full, self.nodes[tree], self.special, steps)

    def spanning(self, value: Ints) -> Ints:
        """Pairs of a lightest tree over all nodes, exactly."""
        tree = self._spanning(value, self.bans)
        if len(tree) == self.n - 1:
            return tree
        return self._spanning(value, self.bans[:0])  # bans that disconnect: a bound without them

    def _spanning(self, value: Ints, bans: Ints) -> Ints:
        form = self.instance.form
        if self.space is not None:
            x, y = form.x[self.nodes], form.y[self.nodes]
            return boruvka(pack(form.rule), self.scale, x, y, value, self.forced, bans, *self.space)
        assert form.matrix is not None
        weights = self.scale * form.matrix[np.ix_(self.nodes, self.nodes)]
        weights -= value[:, None] + value[None, :]
        i, j = np.divmod(bans, self.n)
        weights[i, j] = weights[j, i] = HUGE
        tree = prim(weights, self.forced)
        return tree[weights[tree[:, 0], tree[:, 1]] < HUGE]


class _Climb:
    """An ascent over the candidate pairs; potentials in floats, scaled like the costs."""

    def __init__(self, ground: _Ground, tree: Ints, total: int):
        self.ground, self.best = ground, np.zeros(ground.n)
        self.ascent = Ascent(ground.n, float(ground.costs(tree).mean()), total)
        self.ends = np.vstack([ground.forced, ground.near])
        self.learn(tree)

    @property
    def steps(self) -> int:
        """Trees looked at."""
        return self.ascent.steps

    def learn(self, tree: Ints) -> None:
        """Take an exact tree's pairs as candidates, and judge potentials afresh."""
        n, forced, bans = self.ground.n, self.ground.forced, self.ground.bans
        pairs = np.sort(np.vstack([self.ends[len(forced) :], tree]), axis=1)
        keys = np.unique(pairs[:, 0] * n + pairs[:, 1])
        pairs = np.column_stack(np.divmod(keys[~np.isin(keys, bans)], n))
        self.ends = np.vstack([forced, pairs])
        self.costs = self.ground.costs(self.ends)
        self.best_value = -np.inf

    def step(self) -> None:
        """One tree, one move."""
        ground, now = self.ground, self.ascent.now
        weights = self.ascent.weights(self.ends, self.costs)
        forced = len(ground.forced)
        chosen, degree = lightest_tree(ground.n, self.ends, weights, forced)
        around = ground.to_special - now
        two = ground.partners(around)
        degree[two] += 1
        value = float(2 * now.sum() + weights[chosen].sum() + around[two].sum())
        if value > self.best_value:
            self.best_value, self.best = value, now
        self.ascent.move(degree)


def _scale(instance: Instance) -> int:
    """The precision, or less where weights of that precision would leave 62 bits."""
    form = instance.form
    if form.matrix is not None:
        peak = int(form.matrix.max())
    else:
        reach = (np.array([int(v.max() - v.min())], dtype=np.int64) for v in (form.x, form.y))
        peak = int(form.rule.costs(*reach)[0])
    scale = PRECISION
    while scale > 1 and scale * (peak + 1) * 64 >= HUGE:
        scale //= 2
    return scale
