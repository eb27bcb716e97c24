"""The loop at one node of the tree: solve, separate, price, until nothing helps.

Pricing lowers the objective and cuts raise it, so progress is what cuts gain:
what pricing takes away is taken from the history as well.  A node is left only
when its exact bound closes it, or when all pairs have been priced and cutting
has stalled on a connected support graph.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from tcp.exact.branch_and_cut.combs import MOST, comb_cuts
from tcp.exact.branch_and_cut.cuts import Cut, Family
from tcp.exact.branch_and_cut.guide import joined
from tcp.exact.branch_and_cut.handles import fractional_handles
from tcp.exact.branch_and_cut.inward import Mean
from tcp.exact.branch_and_cut.keyholes import Keyholes, Step
from tcp.exact.branch_and_cut.pool import Pool, violation
from tcp.exact.branch_and_cut.pricing import Prices
from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.branch_and_cut.proof import (
    ADMITTED,
    Alive,
    Duals,
    Fixings,
    Verdict,
    ceiling,
    verdict,
)
from tcp.exact.branch_and_cut.refine import refined
from tcp.exact.branch_and_cut.relaxation import Answer, Relaxation, SetBranch
from tcp.exact.branch_and_cut.subtours import component_cuts, interval_cuts, minimum_cuts
from tcp.exact.branch_and_cut.support import Support
from tcp.fleet import threads
from tcp.stop import Clock
from tcp.travel import Ints

WINDOW = 8
"""Rounds over which progress is measured."""

TAIL, LONG_TAIL = 0.02, 0.002
"""Cutting stalls when a window of rounds closes less than this part of the gap.

The tail is long where no other cuts are left to be sought, and a branch closes next to nothing.
"""

PRICE_EVERY = 30
"""Rounds after which all pairs are priced even if cutting still helps: bounds on the way."""

VIOLATED = 0.02
"""Least violation of a comb found at another point."""

KNOWN = 0.3
"""Handles of combs in the LP with less slack than this are tried again."""

FEW_COMBS = 10
"""With fewer combs, teeth are sought along the LP solution as well."""

HAIR = 1e-7
"""Part of the cost within which the LP's value and the incumbent's count as equal."""

TIGHT = 1e-5
"""Cuts in the LP with less slack than this are tight."""

POOLED_A_ROUND = 250
"""Most cuts that come back from the pool at once."""


@dataclass
class Incumbent:
    """The best tour known, and who wants to hear of better ones."""

    problem: Problem
    tour: Ints
    cost: int | None = None
    heard: Callable[[], None] = lambda: None

    def offer(self, tour: Ints) -> bool:
        """Take a tour if it respects the rules and is better."""
        following = np.roll(tour, -1)
        keys = self.problem.keys(tour, following)
        if np.isin(keys, self.problem.forbidden).any():
            return False
        if not np.isin(self.problem.forced, keys).all():
            return False
        cost = int(self.problem.costs(tour, following).sum())
        if self.cost is not None and cost >= self.cost:
            return False
        self.tour, self.cost = tour.copy(), cost
        self.heard()
        return True


@dataclass
class NodeResult:
    """What a node of the tree came to.

    ``closed``: its duals prove that no better tour is below.  ``infeasible``:
    they prove that no tour is below at all.  Otherwise the node is to be
    branched (or time ran out) and ``duals`` prove ``bound``.  ``stuck``: the
    LP's floats are too coarse for a proof here, which ends the search.
    """

    duals: Duals | None
    bound: int | None
    closed: bool = False
    infeasible: bool = False
    stopped: bool = False
    stuck: bool = False


@dataclass
class Gains:
    """What cuts have gained at a node: the objective round by round, pricing left out."""

    values: list[float] = field(default_factory=list)
    priced: bool = False

    def note(self, value: float) -> None:
        """The objective of a connected solution, after cutting or after pricing."""
        if self.priced and self.values:
            lost = self.values[-1] - value
            self.values = [v - lost for v in self.values[-1 - WINDOW :]]
        else:
            self.values.append(value)
        self.priced = False

    @property
    def gained(self) -> float | None:
        """The gain of the last window of rounds; None before there are as many."""
        if len(self.values) <= WINDOW:
            return None
        return self.values[-1] - self.values[-1 - WINDOW]

    def clear(self) -> None:
        """Measure afresh."""
        self.values = []


@dataclass
class Cutter:
    """Everything that cutting at a node needs; lives as long as the search."""

    problem: Problem
    lp: Relaxation
    incumbent: Incumbent
    clock: Clock
    pool: Pool = field(default_factory=Pool)
    alive: Alive = field(default_factory=Alive.everything)
    listen: Callable[[int, Duals], None] = lambda bound, duals: None
    improve: Callable[[Support], None] = lambda support: None
    seek: Callable[[], None] = lambda: None
    polish: Callable[[], None] = lambda: None
    threads: Executor = field(default_factory=lambda: ThreadPoolExecutor(threads(2)))
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))
    rounds: int = 0

    def __post_init__(self) -> None:
        self.deep = 0
        self.tail = TAIL
        self.mean: Mean | None = None
        self.keyholes = Keyholes(self._out_of_time, self.threads, self.rng)

    # -- the loop ----------------------------------------------------------

    def process(
        self,
        fixings: Fixings,
        branches: Sequence[SetBranch],
        keyholes: Sequence[Step] = (),
        patient: bool = False,
    ) -> NodeResult:
        """Cut and price until the node closes or nothing helps; the LP is already entered.

        Local cuts are sought only in the given steps: they are dear, and those of the root
        serve below it as well.  Who is ``patient`` ends with a long tail.
        """
        self.deep = 0
        self.tail = LONG_TAIL if patient else TAIL
        self.mean = None if self.rounds else Mean()  # below the root it gains nothing
        best: tuple[float, Duals | None, int | None] = (-np.inf, None, None)
        progress = Gains()
        unpriced = 0
        while True:
            answer = self.lp.solve(self.clock.remaining)
            self.rounds += 1
            if answer is Answer.INFEASIBLE:
                result = self._infeasible(fixings)
                if result is not None:
                    return result
                progress.clear()
                continue
            stop = answer is not Answer.OPTIMAL or self._out_of_time()
            support = self._support() if answer is Answer.OPTIMAL else None
            pending = False
            if support is not None and not stop and not self._reached():
                unpriced += 1
                pending = unpriced == PRICE_EVERY or self._separate(support, progress, keyholes)
                if pending and unpriced < PRICE_EVERY:
                    continue
                self._offer_integral(support)
            lost = answer is Answer.LOST
            if not self.lp.solved:
                return NodeResult(None, None, stopped=True, stuck=lost)
            unpriced = 0
            duals = self.lp.duals()
            found = verdict(self.problem, duals, fixings, self.alive)
            value = found.scaled / duals.scale
            if value > best[0]:
                bound = ceiling(found.scaled, duals.scale, self.problem.granularity)
                best = (value, duals, bound)
                self.listen(bound, duals)
            if self._closes(best[2]):
                return NodeResult(best[1], best[2], closed=True)
            if stop:
                return NodeResult(best[1], best[2], stopped=True, stuck=lost)
            if self._admit(found):
                progress.priced = True
            elif not pending:
                return self._refined(fixings, NodeResult(best[1], best[2]))

    def _out_of_time(self) -> bool:
        return self.clock.reason() is not None

    def _support(self) -> Support:
        return Support.of(self.problem.size, self.lp.i, self.lp.j, self.lp.x)

    def _closes(self, bound: int | None) -> bool:
        cost = self.incumbent.cost
        return cost is not None and bound is not None and bound >= cost

    def _reached(self) -> bool:
        """Whether the LP's value, were it exact, would close the node."""
        cost = self.incumbent.cost
        if cost is None:
            return False
        return self.lp.objective > cost - self.problem.granularity * (1.0 - 1e-3)

    def _refined(self, fixings: Fixings, result: NodeResult) -> NodeResult:
        """Try finer duals where the LP's value would close the node and its floats do not."""
        cost = self.incumbent.cost
        if cost is None or self.lp.objective < cost - self.problem.granularity - HAIR * cost:
            return result
        duals = refined(self.lp, self.lp.duals())
        found = verdict(self.problem, duals, fixings, self.alive)
        bound = ceiling(found.scaled, duals.scale, self.problem.granularity)
        if result.bound is not None and bound <= result.bound:
            return result
        return NodeResult(duals, bound, closed=self._closes(bound))

    def _infeasible(self, fixings: Fixings) -> NodeResult | None:
        """Prove the node empty, or price in pairs that make its LP feasible (then None)."""
        duals = self.lp.ray()
        found = verdict(self.problem, duals, fixings, self.alive)
        if found.scaled > 0:
            return NodeResult(duals, None, closed=True, infeasible=True)
        if not self._admit(found):
            return NodeResult(None, None, stopped=True, stuck=True)
        return None

    def _admit(self, found: Verdict) -> bool:
        """Enter the pairs of negative reduced cost; False if there are none worth it."""
        keys = self.problem.keys(found.i, found.j)
        fresh = self.lp.columns_of(keys) < 0
        keys = keys[fresh][:ADMITTED]
        if not len(keys):
            return False
        self.lp.add_pairs(keys)
        return True

    # -- separation ----------------------------------------------------------

    def _separate(self, support: Support, progress: Gains, keyholes: Sequence[Step]) -> bool:
        """Add cuts; False if there are none, or if they have stopped to help.

        Combs cut off a point inward of the LP solution, then the solution itself.  Once
        that has stalled as well, local cuts are sought: in one step, and in one more each
        time that it stalls again.
        """
        apart = component_cuts(support)
        if apart:
            self.pool.add(apart)
            return self._enter(apart)
        progress.note(self.lp.objective)
        if self._stalled(progress, last=self.deep >= len(keyholes)):
            if self.mean is not None:
                self.mean = None
            elif self.deep >= len(keyholes):
                return False
            else:
                self.deep += 1
            progress.clear()
        if self._price_neighbours():
            progress.priced = True
            return True
        cuts = self.pool.violated(support, 0.05, POOLED_A_ROUND)
        subtours = interval_cuts(support, self.incumbent.tour)
        if len(subtours) < 10:
            subtours += minimum_cuts(support)
        cuts += subtours
        if len(subtours) < 10:
            combs = self._inward_combs(support)
            if len(combs) < FEW_COMBS:
                combs += self._combs(support)
            cuts += combs
            if keyholes and not cuts:
                self.deep = max(self.deep, 1)
            if self.deep:
                cuts += self._local(support, keyholes)
        self.improve(support)
        return self._enter(cuts)

    def _enter(self, cuts: Sequence[Cut]) -> bool:
        self.pool.add(self.lp.age())
        return self.lp.add_cuts(cuts) > 0

    def _inward_combs(self, support: Support) -> list[Cut]:
        """Combs that cut off a point inward of the LP solution and the solution itself."""
        if self.mean is None:
            return []
        point = self.mean.inward(self.problem, self.lp.keys, self.lp.x)
        combs = [] if point is None else self._combs(point)
        rhs = np.array([cut.rhs for cut in combs], np.int64)
        missing = violation(Family.of(combs), rhs, support)
        return [cut for cut, by in zip(combs, missing.tolist(), strict=True) if by > VIOLATED]

    def _combs(self, support: Support) -> list[Cut]:
        fresh = fractional_handles(support)
        tight = (self.lp.cuts[k] for k in np.nonzero(self.lp.slack < KNOWN)[0].tolist())
        known = (cut.handle.astype(np.int64) for cut in tight if cut.comb)
        handles = list({nodes.tobytes(): nodes for nodes in (*fresh, *known)}.values())
        found = comb_cuts(support, self.incumbent.tour, handles, self.threads)
        if len(found) < FEW_COMBS:
            other = joined(support, self.incumbent.tour)
            found += comb_cuts(support, other, handles, self.threads)
        return [cut for _, cut in found[:MOST]]

    def _local(self, support: Support, keyholes: Sequence[Step]) -> list[Cut]:
        tight = [self.lp.cuts[k] for k in np.nonzero(self.lp.slack < TIGHT)[0].tolist()]
        return self.keyholes.cuts(support, tight, keyholes, self.deep)

    def _stalled(self, progress: Gains, last: bool) -> bool:
        gained, cost, value = progress.gained, self.incumbent.cost, self.lp.objective
        gap = max(cost - value, 0.0) if cost is not None else abs(value) * 0.01
        return gained is not None and gained < (self.tail if last else TAIL) * gap

    def _price_neighbours(self) -> bool:
        """Enter candidate pairs of negative reduced cost, while there are no eliminations."""
        if self.alive.keys is not None:
            keys, i, j, cost = self.alive.keys, self.alive.i, self.alive.j, self.alive.cost
        else:
            keys = self.problem.neighbours
            i, j = self.problem.pairs(keys)
            cost = self.problem.costs(i, j)
        missing = np.nonzero(self.lp.columns_of(keys) < 0)[0]
        prices: Prices = self.lp.duals().prices(self.problem)
        rc = prices.of(i[missing], j[missing], cost[missing])
        order = np.argsort(rc, kind="stable")
        order = order[rc[order] < -prices.scale * self.lp.unit * 1e-6][:ADMITTED]
        if not len(order):
            return False
        self.lp.add_pairs(keys[missing[order]])
        return True

    def _offer_integral(self, support: Support) -> None:
        """If the LP solution is a tour, offer it; whole numbers may be several cycles as well."""
        if len(support.x) == self.problem.size and (support.x > 1.0 - 1e-6).all():
            tour = tour_of(support)
            if tour is not None:
                self.incumbent.offer(tour)


def tour_of(support: Support) -> Ints | None:
    """The cyclic order of a support graph of degree 2; None if it is more than one cycle."""
    tour = np.empty(support.size, np.int64)
    before, at = -1, 0
    for k in range(support.size):
        if k and at == 0:
            return None
        tour[k] = at
        first, second = support.other[support.ptr[at] : support.ptr[at + 1]]
        before, at = at, int(second if first == before else first)
    return tour
