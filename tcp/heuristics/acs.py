"""Ant colony system, *as cited*.

Cuckoo Table 6 quotes M. S. Saealal et al., "An ant colony system for routing in
PCB holes drilling process", IJIMIP 3, 2012, with 25 ants and no definition; the
algorithm and its constants are those of M. Dorigo, L. M. Gambardella, "Ant
colony system: a cooperative learning approach to the traveling salesman
problem", IEEE Trans. Evolutionary Computation 1(1), 1997 (which the BMGA paper
cites): beta = 2, q0 = 0.9, alpha = rho = 0.1, tau0 = 1 / (n L_nn).

Reading chosen: the open path is a tour through a depot; with free ends its legs
cost nothing, so they differ by pheromone alone and count as visibility 1.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from tcp.errors import UsageError
from tcp.heuristics.orders import (
    TRIVIAL,
    answer,
    enumerate_all,
    length,
    orders,
    refusal,
    search,
)
from tcp.instance import Instance
from tcp.jit import kernel, lean
from tcp.result import Outcome, Report
from tcp.stop import Clock
from tcp.travel import Ints

__all__ = ["refusal", "run"]

Floats = NDArray[np.float64]

ANTS = 10_000
"""Most ants: the clock is looked at when all of them have their routes."""


def run(
    instance: Instance,
    *,
    rng: Generator,
    clock: Clock,
    report: Report,
    np: int = 25,
    iterations: int = 10_000,
    beta: float = 2.0,
    q0: float = 0.9,
    rho: float = 0.1,
) -> Outcome:
    """Search with the ant colony system.

    Parameters
    ----------
    instance, rng, clock, report
        As in every solver.
    np : int
        Ants, 1 to :data:`ANTS`.
    iterations : int
        Iterations, >= 0.
    beta : float
        Weight of visibility against pheromone, >= 0.
    q0 : float
        Share of greedy choices, in [0, 1].
    rho : float
        Evaporation, local and global, in (0, 1).

    Returns
    -------
    Outcome
        The best route; ``details`` has the iterations made and the routes evaluated.

    Raises
    ------
    UsageError
        For a parameter out of range.
    """
    if not 1 <= np <= ANTS or iterations < 0 or beta < 0 or not 0 <= q0 <= 1 or not 0 < rho < 1:
        raise UsageError(
            f"acs needs np from 1 to {ANTS}, beta >= 0, q0 in [0, 1] and rho in (0, 1)"
        )
    problem = orders(instance)
    m = len(problem)
    if m <= TRIVIAL:
        return enumerate_all(instance, problem)
    best, cost, tau, visible, tau0 = _start(problem.legs, beta)

    def advance(steps: int) -> tuple[int, int]:
        made = _iterations(rng, problem.legs, tau, visible, tau0, best, cost, np, q0, rho, steps)
        return made, int(cost[0])

    stopped, done = search(instance, problem, iterations, clock, report, int(cost[0]), advance)
    return answer(problem, best, int(cost[0]), stopped, iterations=done, evaluations=np * done + 1)


def _start(legs: Ints, beta: float) -> tuple[Ints, Ints, Floats, Floats, float]:
    """The nearest-neighbour route and its cost, pheromone, visibility^beta, and tau0."""
    m = len(legs) - 1
    best = np.zeros(m, dtype=np.int64)
    left = np.ones(m, dtype=bool)
    here = m
    for k in range(m):
        here = int(np.where(left, legs[here, :m], np.iinfo(np.int64).max).argmin())
        best[k], left[here] = here, False
    cost = length(best, legs)
    tau0 = 1.0 / ((m + 1) * max(cost, 1))
    with np.errstate(over="ignore"):  # a beta so large that only the nearest is visible
        visible = 1.0 / np.maximum(legs, 1).astype(np.float64) ** beta
    for line in (visible[m], visible[:, m]):
        if line.min() == line.max():
            line[:] = 1.0
    return best, np.array([cost]), np.full(legs.shape, tau0), visible, tau0


@kernel
def _iterations(
    rng: Generator,
    legs: Ints,
    tau: Floats,
    visible: Floats,
    tau0: float,
    best: Ints,
    cost: Ints,
    ants: int,
    q0: float,
    rho: float,
    steps: int,
) -> int:
    """Up to ``steps`` times: every ant builds a route, then the best so far lays pheromone."""
    m = len(best)
    route = np.zeros(m, dtype=np.int64)
    left = np.zeros(m, dtype=np.int64)
    for step in range(1, steps + 1):
        before = cost[0]
        for _ in range(ants):
            here = m
            for k in range(m):
                left[k] = k
            for k in range(m):
                chosen = _choose(rng, tau[here], visible[here], left, m - k, q0)
                hole = left[chosen]
                left[chosen] = left[m - k - 1]
                _lay(tau, here, hole, rho, tau0)
                route[k] = hole
                here = hole
            _lay(tau, here, m, rho, tau0)
            new = length(route, legs)
            if new < cost[0]:
                cost[0] = new
                for k in range(m):
                    best[k] = route[k]
        strength = 1.0 / max(cost[0], 1)
        here = m
        for k in range(m):
            _lay(tau, here, best[k], rho, strength)
            here = best[k]
        _lay(tau, here, m, rho, strength)
        if cost[0] < before:
            return step
    return steps


@lean
def _choose(rng: Generator, tau: Floats, visible: Floats, left: Ints, count: int, q0: float) -> int:
    """Place in ``left`` of the next hole: greedy with probability q0, else in proportion."""
    total = 0.0
    best = 0
    high = -1.0
    for k in range(count):
        value = tau[left[k]] * visible[left[k]]
        total += value
        if value > high:
            high = value
            best = k
    if rng.random() < q0:
        return best
    at = rng.random() * total
    for k in range(count):
        at -= tau[left[k]] * visible[left[k]]
        if at < 0.0:
            return k
    return best


@lean
def _lay(tau: Floats, p: int, q: int, rho: float, strength: float) -> None:
    """Pheromone on a leg; both ways, except that the depot's two sides are different legs."""
    tau[p, q] += rho * (strength - tau[p, q])
    m = len(tau) - 1
    if p != m and q != m:
        tau[q, p] = tau[p, q]
