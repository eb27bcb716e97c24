"""Routes: a start from the local search, and repairs of LP solutions by the same search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcp.errors import InfeasibleError
from tcp.exact.branch_and_cut.cutting import Incumbent
from tcp.exact.branch_and_cut.guide import joined
from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.branch_and_cut.support import Support
from tcp.heuristics.local_search import improve
from tcp.heuristics.start import start_tour
from tcp.stop import Clock
from tcp.travel import Ints

START_KICKS = 40
"""Kicks per node of the start."""

MOST_START_KICKS = 300_000
"""Most kicks of the start, however large the instance."""

REPAIR_KICKS = 0.1
"""Kicks per node after a repair."""

LIGHT = 60
"""Up to so many nodes an uncompiled start serves: the search that compiles takes longer to load."""


LIGHT_STARTS = 1
"""Tours that such a start improves: so small an LP soon finds better ones itself."""


def start(
    problem: Problem, rng: np.random.Generator, clock: Clock, tour: list[int] | None
) -> Ints | None:
    """A good tour to begin with, never worse than ``tour``; None if the rules allow none."""
    if problem.size <= LIGHT:
        light = start_tour(problem.form, LIGHT_STARTS)
        known = [t for t in (tour, light) if t is not None]
        if known:
            return np.array(min(known, key=problem.form.tour_cost), np.int64)
    kicks = 0 if tour is not None else min(START_KICKS * problem.size, MOST_START_KICKS)
    try:
        found = improve(problem.form, tour, rng=rng, clock=clock, kicks=kicks)
    except InfeasibleError:
        return None
    return np.array(found, np.int64)


@dataclass
class Repair:
    """Turns LP solutions into tours now and then.

    The heaviest edges are joined to paths, the paths are strung along the
    incumbent's order, and the local search mends the rest.  It runs only when
    the LP's value has moved since the last time, and on ever rarer occasions.
    """

    problem: Problem
    incumbent: Incumbent
    rng: np.random.Generator
    clock: Clock
    every: int = 10
    calls: int = 0

    def __call__(self, support: Support) -> None:
        """Offer the tour made from a support graph to the incumbent."""
        self.calls += 1
        if self.calls % self.every or self.problem.size <= LIGHT:
            return
        self.every = self.every * 3 // 2
        self.calls = 0
        tour = joined(support, self.incumbent.tour)
        kicks = int(REPAIR_KICKS * self.problem.size)
        found = improve(
            self.problem.form, tour.tolist(), rng=self.rng, clock=self.clock, kicks=kicks
        )
        self.incumbent.offer(np.array(found, np.int64))
