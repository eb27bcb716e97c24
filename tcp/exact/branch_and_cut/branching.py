"""Where to branch: strong branching on edges and on sets, with pseudo-costs.

A candidate is a pair with fractional x (children x = 0 and x = 1) or a set S
with x(delta(S)) well between 2 and 4 (children x(delta(S)) = 2 and >= 4; a
tour's value is even).  Each child's LP runs for a few dual simplex iterations;
the product of both gains decides (Applegate et al. 2006, ch. 14).  Where no
candidate gains, clusters of close nodes are tried as sets.
"""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from tcp.exact.branch_and_cut.clusters import clusters
from tcp.exact.branch_and_cut.cuts import Cut, Family, boundary, smaller_side
from tcp.exact.branch_and_cut.probe import Probe, Try
from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.branch_and_cut.relaxation import Relaxation
from tcp.exact.branch_and_cut.support import Support
from tcp.exact.branch_and_cut.teeth import by_position, light_intervals
from tcp.travel import Ints

EDGES = 12
"""Edges probed at a node."""

SETS = 14
"""Sets probed at a node."""

CLUSTERS, POOR = 12, 1e-4
"""Clusters probed where the best of all that scores less: its children gain next to nothing."""

GLANCE, LOOK = 15, 60
"""Dual simplex iterations of a first try, and of a second one."""

FINAL = 8
"""Candidates, the best by the first try, that are tried again."""

OFF = 0.5
"""Sets with x(delta(S)) further from 3 are no candidates."""


@dataclass(frozen=True)
class Decision:
    """A branch: on a pair (``key``) or on a set (``cut``); ``gains`` of its two children."""

    key: int
    cut: Cut | None
    gains: tuple[float, float]


@dataclass
class Brancher:
    """Chooses decisions; remembers what branching on a pair gained before."""

    lp: Relaxation
    threads: Executor
    gains: dict[int, tuple[float, float, int]] = field(default_factory=dict)

    @cached_property
    def clusters(self) -> Family:
        """What is tried where nothing else gains."""
        return Family.of(clusters(self.lp.problem))

    def choose(self, support: Support, tour: Ints, cutoff: float) -> Decision | None:
        """The best decision at the current LP solution; None if there is no candidate."""
        cap = max(cutoff - self.lp.objective, 1e-9)
        best = self._best(self._pairs(support), self._sets(support, tour), cap)
        if best is None or _product(best.gains, cap) < POOR:
            other = self._best(
                [], _undecided(self.lp.problem, support, self.clusters, CLUSTERS), cap
            )
            known = [decision for decision in (best, other) if decision is not None]
            best = max(known, key=lambda d: _product(d.gains, cap), default=None)
        return best

    def _best(self, pairs: list[int], sets: list[Cut], cap: float) -> Decision | None:
        """The best decision among some pairs and sets; None if there are none."""
        if not (pairs or sets):
            return None
        self.lp.add_cuts(sets)
        places = [*self.lp.columns_of(np.array(pairs, np.int64)).tolist()]
        tries = [*(Try(k, False) for k in places), *(Try(self.lp.row_of(c), True) for c in sets)]
        probes = [self.lp.probe(), self.lp.probe(twin=True)]
        first = self._gains(probes, tries, GLANCE)
        order = sorted(range(len(tries)), key=lambda k: (-_product(first[k], cap), k))[:FINAL]
        second = self._gains(probes, [tries[k] for k in order], LOOK)
        self.lp.iterations += sum(probe.iterations for probe in probes)
        best: Decision | None = None
        for k, gains in zip(order, second, strict=True):
            if k < len(pairs):
                self._learn(pairs[k], gains)
            if best is None or _product(gains, cap) > _product(best.gains, cap):
                cut = None if k < len(pairs) else sets[k - len(pairs)]
                best = Decision(pairs[k] if cut is None else -1, cut, gains)
        return best

    def _gains(
        self, probes: list[Probe], tries: list[Try], iterations: int
    ) -> list[tuple[float, float]]:
        """What each of the tries gains below and above; every other one in the second solver."""
        shares = [tries[side::2] for side in range(2)]
        both = list(self.threads.map(Probe.gains, probes, shares, [iterations] * 2))
        return [both[k % 2][k // 2] for k in range(len(tries))]

    # -- candidates ----------------------------------------------------------

    def _pairs(self, support: Support) -> list[int]:
        """Fractional pairs: the best by pseudo-cost, then the costliest with x near 1/2."""
        keys = self.lp.problem.keys(support.i, support.j)
        cost = self.lp.problem.costs(support.i, support.j)
        off = np.minimum(support.x, 1.0 - support.x)
        known = np.array(
            [self._estimate(k, x) for k, x in zip(keys.tolist(), support.x.tolist(), strict=True)]
        )
        middle = np.nonzero(off >= max(0.6 * off.max(), 1e-5))[0]
        fresh = middle[np.argsort(-cost[middle] * off[middle], kind="stable")]
        tried = np.nonzero((known > 0) & (off > 1e-5))[0]
        tried = tried[np.argsort(-known[tried], kind="stable")]
        chosen = [*tried[: EDGES // 2], *fresh]
        return list(dict.fromkeys(keys[chosen].tolist()))[:EDGES]

    def _estimate(self, key: int, x: float) -> float:
        if key not in self.gains:
            return 0.0
        down, up, count = self.gains[key]
        return (down / count * x) * (up / count * (1.0 - x))

    def _learn(self, key: int, gains: tuple[float, float]) -> None:
        if not np.isfinite(gains).all():
            return
        down, up, count = self.gains.get(key, (0.0, 0.0, 0))
        self.gains[key] = (down + gains[0], up + gains[1], count + 1)

    def _sets(self, support: Support, tour: Ints) -> list[Cut]:
        """Different sets of combs and intervals, undecided ones."""
        combs = [cut for cut in self.lp.cuts if len(cut.ends) > 1]
        first, last, weight = light_intervals(by_position(support, tour), light=3.5)
        near = np.nonzero(np.abs(weight) < OFF)[0]
        family = Family.of(combs).followed_by(_intervals(tour, first[near], last[near]))
        return _undecided(self.lp.problem, support, family, SETS)


def _intervals(tour: Ints, first: Ints, last: Ints) -> Family:
    """Stretches of a tour, as cuts of one set each: thousands, few of which are ever built."""
    length, count = last - first + 1, len(first)
    ptr = np.concatenate(([0], np.cumsum(length)))
    place = np.arange(ptr[-1]) + np.repeat(first - ptr[:-1], length)
    ones = np.ones(count, np.int64)
    return Family(np.arange(count), ptr, tour[place].astype(np.int32), ones, count)


def _undecided(problem: Problem, support: Support, family: Family, most: int) -> list[Cut]:
    """Different sets of some cuts: x(delta(S)) near 3 and a costly boundary."""
    cost = problem.costs(support.i, support.j)
    flow, price = (
        boundary(family.ptr, family.nodes, support.ptr, support.other, w, support.size)
        for w in (support.weight, (support.x * cost)[support.edge])
    )
    off = np.abs(flow - 3.0)
    chosen: list[Ints] = []
    for s in np.argsort(-price * (1.0 - off), kind="stable"):
        if len(chosen) == most:
            break
        nodes = family.nodes[family.ptr[s] : family.ptr[s + 1]]
        part = smaller_side(nodes, support.size)
        if off[s] < OFF and not any(_alike(part, other) for other in chosen):
            chosen.append(part)
    return [Cut.of([part]) for part in chosen]


def _product(gains: tuple[float, float], cap: float) -> float:
    """Score of a decision: gains beyond the cutoff count no more than reaching it."""
    low, high = (min(max(g, 0.0), 1.2 * cap) / cap for g in gains)
    return max(low, 1e-6) * max(high, 1e-6)


def _alike(one: Ints, other: Ints) -> bool:
    """Whether two sets share most of their nodes."""
    common = len(np.intersect1d(one, other, assume_unique=True))
    return 4 * common > 3 * max(len(one), len(other))
