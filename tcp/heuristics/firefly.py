"""The firefly algorithm of Lit et al. for drill paths.

Source: A. Lit, A. F. Zainal Abidin, M. Z. Iqbal Zakaria, K. S. Lim, M. N. Ayob,
F. Yakop, "Applying firefly algorithm in finding optimized path in PCB holes
drilling process".  Line numbers below are those of its Algorithm 1, equations
its (4)-(8).

An agent is a vector of hole numbers, s_m[d] the hole drilled at place d
(equation 4).  After a move the smallest value becomes hole 1, the next hole 2,
... (the rank correction), and the corrected vector is the agent's position.

**As printed the algorithm stands still.**  Positions are whole hole numbers, so
two places differ by at least 1, and noise of width 1 (alpha = 1, e_m uniform on
[0, 1] or [-1/2, 1/2]) never swaps two ranks, while exp(-gamma r) leaves an
attraction of a few parts in 10^9 at the distances of random agents (r is about
21 for 14 holes).  So the printed figures were made by something else.

Readings chosen:

* What equation (7) leaves open is taken from the program of the algorithm's
  author, X.-S. Yang (fa_ndim in "Nature-Inspired Metaheuristic Algorithms", 2nd
  ed., 2010; the paper adapts "the original Firefly Algorithm proposed by the
  original author"): e_m is uniform over the range of a variable, here n - 1
  hole numbers wide (``width``); alpha shrinks by one factor an iteration, over
  all t iterations by 10^-4 / 0.9 (``cooling``); attractiveness falls with the
  distance from beta_0 not to 0 but to 0.2 (``beta_min``).  With these the
  paper's average fitness comes out.  ``beta_min=0, cooling=1, width=1`` with
  ``toward=False`` is the paper as printed.
* Equation (7) prints ``beta_0 exp(-gamma r) (s_m - s_u)``, which flees from the
  brighter agent; the text and Algorithm 1 say "move agent m towards u", so the
  difference is ``s_u - s_m``.  ``toward=False`` takes the equation as printed.
* The exponent is ``gamma r`` as printed (Yang's is gamma r^2).
* A move is kept whether or not it is better, as in Algorithm 1; only the best
  solution found so far is remembered.
"""

from __future__ import annotations

import math

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

FEW = 300
"""Holes up to which an insertion sort orders an agent's values fastest."""


def run(
    instance: Instance,
    *,
    rng: Generator,
    clock: Clock,
    report: Report,
    agents: int = 50,
    iterations: int = 10_000,
    beta0: float = 1.0,
    alpha: float = 1.0,
    gamma: float = 1.0,
    beta_min: float = 0.2,
    width: float | None = None,
    cooling: float = 1e-4 / 0.9,
    toward: bool = True,
) -> Outcome:
    """Search with the firefly algorithm.

    Parameters
    ----------
    instance, rng, clock, report
        As in every solver.
    agents : int
        q, >= 2.
    iterations : int
        t, >= 0.
    beta0, alpha, gamma : float
        Attractiveness at distance 0, randomization and absorption, >= 0.
    beta_min : float
        What attractiveness falls to with the distance, in [0, beta0].
    width : float, optional
        Width of the uniform distribution of e_m around 0, >= 0; n - 1.
    cooling : float
        What is left of alpha after all iterations, in (0, 1]; 1 keeps it constant.
    toward : bool
        Towards the brighter agent, or the sign that equation (7) prints.

    Returns
    -------
    Outcome
        The best route; ``details`` has the iterations made and the moves evaluated.

    Raises
    ------
    UsageError
        For a parameter out of range.
    """
    if agents < 2 or iterations < 0 or min(beta0, alpha, gamma, width or 0) < 0:
        raise UsageError("firefly needs agents >= 2 and no negative parameter")
    if not 0 <= beta_min <= beta0 or not 0 < cooling <= 1:
        raise UsageError("firefly needs beta_min in [0, beta0] and cooling in (0, 1]")
    problem = orders(instance)
    m = len(problem)
    if m <= TRIVIAL:
        return enumerate_all(instance, problem)
    swarm = np.empty((agents, m), dtype=np.int64)
    for agent in swarm:
        agent[:] = rng.permutation(m)
    costs = np.array([length(s, problem.legs) for s in swarm])
    record, cost = swarm[costs.argmin()].copy(), np.array([costs.min()])
    searched = np.array([agents])
    sign = 1.0 if toward else -1.0
    noise = np.array([alpha * (m - 1 if width is None else width)])
    fall = cooling ** (1 / max(iterations, 1))

    def advance(steps: int) -> tuple[int, int]:
        made = _iterations(
            rng, problem.legs, swarm, costs, record, cost, searched,
            sign * beta0, sign * beta_min, gamma, noise, fall, steps,
        )  # fmt: skip
        return made, int(cost[0])

    stopped, done = search(instance, problem, iterations, clock, report, int(cost[0]), advance)
    return answer(
        problem, record, int(cost[0]), stopped, iterations=done, evaluations=int(searched[0])
    )


@kernel
def _iterations(
    rng: Generator,
    legs: Ints,
    swarm: Ints,
    costs: Ints,
    record: Ints,
    cost: Ints,
    searched: Ints,
    beta0: float,
    beta_min: float,
    gamma: float,
    noise: Floats,
    fall: float,
    steps: int,
) -> int:
    """Lines 05-15 of Algorithm 1, up to ``steps`` times."""
    agents, m = swarm.shape
    value = np.zeros(m)
    place = np.zeros(m, dtype=np.int64)
    sequence = np.zeros(m, dtype=np.int64)
    for step in range(1, steps + 1):
        before = cost[0]
        noise[0] *= fall
        for a in range(agents):
            for hole in range(m):
                place[swarm[a, hole]] = hole
            for u in range(agents):
                if costs[a] > costs[u]:  # I_m < I_u, with equation (6)
                    _move(rng, swarm[a], swarm[u], beta0, beta_min, gamma, noise[0], value)
                    _correct(swarm[a], value, place, sequence)
                    costs[a] = length(swarm[a], legs)
                    searched[0] += 1
                    if costs[a] < cost[0]:
                        cost[0] = costs[a]
                        for d in range(m):
                            record[d] = swarm[a, d]
        if cost[0] < before:
            return step
    return steps


@lean
def _move(
    rng: Generator, one: Ints, other: Ints, beta0: float, beta_min: float, gamma: float,
    noise: float, value: Floats,
) -> None:  # fmt: skip
    """Equations (7) and (8): where agent ``one`` comes to stand, before the correction."""
    m = len(one)
    square = 0
    for d in range(m):
        square += (one[d] - other[d]) * (one[d] - other[d])
    pull = beta_min + (beta0 - beta_min) * math.exp(-gamma * math.sqrt(square))
    for d in range(m):
        value[d] = one[d] + pull * (other[d] - one[d]) + noise * (rng.random() - 0.5)


@kernel
def _correct(agent: Ints, value: Floats, place: Ints, sequence: Ints) -> None:
    """Line 10: values become hole numbers by rank; ``place`` is the agent's inverse."""
    m = len(agent)
    if m > FEW:
        order = np.argsort(value[place], kind="mergesort")
        for rank in range(m):
            sequence[rank] = place[order[rank]]
    else:
        for rank in range(m):  # as stable, and faster: insertion sort
            d = place[rank]
            at = rank
            while at > 0 and value[sequence[at - 1]] > value[d]:
                sequence[at] = sequence[at - 1]
                at -= 1
            sequence[at] = d
    for rank in range(m):
        place[rank] = sequence[rank]
        agent[sequence[rank]] = rank
