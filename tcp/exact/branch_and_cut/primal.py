"""Routes: a start, and repairs of LP solutions."""

from __future__ import annotations

import numpy as np

from tcp.exact.branch_and_cut.cutting import Incumbent
from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.branch_and_cut.support import Support
from tcp.heuristics.start import start_tour
from tcp.stop import Clock
from tcp.travel import Ints


def start(problem: Problem, rng: np.random.Generator, clock: Clock) -> Ints | None:
    """A good tour to begin with, or None if none respects the rules."""
    tour = start_tour(problem.form)
    return None if tour is None else np.array(tour, np.int64)


def repair(problem: Problem, incumbent: Incumbent, support: Support) -> None:
    """Turn an LP solution into a tour, and offer it."""
