"""Particle swarm baselines, *as cited*: basic PSO and PSO with global convergence (GCPSO).

The seed papers quote figures of these algorithms without defining them:
cuckoo Tables 5 and 6 cite G.-Y. Zhu, W.-B. Zhang, "Drilling path optimization by
the particle swarm optimization algorithm with global convergence characteristics",
Int. J. Production Research 46(8), 2008; firefly Tables II and III cite Zhu 2006
and A. Adam et al., "A particle swarm optimization approach to robotic drill
route optimization", AMS 2010.  What is printed: 100 (Adam: 50) particles,
10,000 (5,000) iterations, inertia weights 0.0, 0.5, 1.0 (0.9 falling to 0.4),
Adam's c_1 = c_2 = 1.42, taken for both, r_1, r_2 random in [0, 1].  The rest is the
textbook:

    v = w v + c_1 r_1 (p_i - x) + c_2 r_2 (p_g - x),    x = x + v

Readings chosen: a position is a vector of keys, sorted in ascending order to
the sequence of holes; keys start in [0, n) and a velocity is held in [-n/2, n/2]
(with w = 1 it would grow without end); r_1, r_2 are drawn for every component.
``variant="gc"``: a particle whose sequence is the swarm's best has nothing left
to learn from and is thrown to a new random place, which is what makes the
search converge globally with probability 1 (the stochastic PSO that the title
of Zhu and Zhang points to).
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


def run(
    instance: Instance,
    *,
    rng: Generator,
    clock: Clock,
    report: Report,
    np: int = 100,
    iterations: int = 10_000,
    w: float = 1.0,
    w_end: float | None = None,
    c1: float = 1.42,
    c2: float = 1.42,
    variant: str = "basic",
) -> Outcome:
    """Search with a particle swarm.

    Parameters
    ----------
    instance, rng, clock, report
        As in every solver.
    np : int
        Particles, >= 2.
    iterations : int
        Iterations, >= 0.
    w, w_end : float, optional
        Inertia weight at the beginning and, falling linearly, at the end; >= 0.
    c1, c2 : float
        Cognitive and social component, >= 0.
    variant : {"basic", "gc"}
        Basic PSO, or with global convergence.

    Returns
    -------
    Outcome
        The best route; ``details`` has the iterations made and the routes evaluated.

    Raises
    ------
    UsageError
        For a parameter out of range.
    """
    if np < 2 or iterations < 0 or min(w, w if w_end is None else w_end, c1, c2) < 0:
        raise UsageError("pso needs np >= 2 and no negative parameter")
    if variant not in ("basic", "gc"):
        raise UsageError(f"pso knows the variants basic and gc, not {variant!r}")
    problem = orders(instance)
    m = len(problem)
    if m <= TRIVIAL:
        return enumerate_all(instance, problem)
    swarm = _swarm(rng, np, problem.legs)
    sequences, costs, leader = swarm[3:6]
    fall = 0.0 if w_end is None else (w_end - w) / max(iterations, 1)

    def advance(steps: int) -> tuple[int, int]:
        made = _iterations(rng, problem.legs, *swarm, w, fall, c1, c2, variant == "gc", steps)
        return made, int(costs[leader[0]])

    best = int(costs[leader[0]])
    stopped, done = search(instance, problem, iterations, clock, report, best, advance)
    return answer(
        problem,
        sequences[leader[0]],
        int(costs[leader[0]]),
        stopped,
        iterations=done,
        evaluations=int(swarm[-1][0]),
    )


Swarm = tuple[Floats, Floats, Floats, Ints, Ints, Ints, Ints, Ints]


def _swarm(rng: Generator, size: int, legs: Ints) -> Swarm:
    """Positions, velocities, own bests, their sequences and costs, leader, time, evaluations."""
    m = len(legs) - 1
    x = rng.random((size, m)) * m
    v = np.zeros((size, m))
    sequences = x.argsort(axis=1, kind="stable")
    costs = np.array([length(s, legs) for s in sequences])
    leader, time, searched = np.array([costs.argmin()]), np.zeros(1, np.int64), np.array([size])
    return x, v, x.copy(), sequences, costs, leader, time, searched


@kernel
def _iterations(
    rng: Generator,
    legs: Ints,
    x: Floats,
    v: Floats,
    own: Floats,
    sequences: Ints,
    costs: Ints,
    leader: Ints,
    time: Ints,
    searched: Ints,
    w: float,
    fall: float,
    c1: float,
    c2: float,
    gc: bool,
    steps: int,
) -> int:
    """Up to ``steps`` iterations of the swarm; the leader's own best is the swarm's."""
    size, m = x.shape
    sequence = np.arange(m)
    for step in range(1, steps + 1):
        before = costs[leader[0]]
        inertia = w + fall * time[0]
        time[0] += 1
        searched[0] += size
        for i in range(size):
            g = leader[0]
            for k in range(m):
                pull = c1 * rng.random() * (own[i, k] - x[i, k])
                pull += c2 * rng.random() * (own[g, k] - x[i, k])
                v[i, k] = min(max(inertia * v[i, k] + pull, -m / 2), m / 2)
                x[i, k] += v[i, k]
            _decode(x[i], sequence)
            cost = length(sequence, legs)
            thrown = gc and i != g and cost == costs[g] and _same(sequence, sequences[g])
            if thrown:
                for k in range(m):
                    x[i, k] = rng.random() * m
                    v[i, k] = 0.0
                searched[0] += 1
                _decode(x[i], sequence)
                cost = length(sequence, legs)
            if thrown or cost < costs[i]:
                costs[i] = cost
                for k in range(m):
                    own[i, k] = x[i, k]
                    sequences[i, k] = sequence[k]
                if cost < costs[g]:
                    leader[0] = i
        if costs[leader[0]] < before:
            return step
    return steps


@lean
def _decode(keys: Floats, sequence: Ints) -> None:
    """Holes in ascending order of their keys, from whatever order ``sequence`` is in."""
    for k in range(1, len(keys)):
        hole = sequence[k]
        at = k
        while at > 0 and keys[sequence[at - 1]] > keys[hole]:
            sequence[at] = sequence[at - 1]
            at -= 1
        sequence[at] = hole


@lean
def _same(one: Ints, two: Ints) -> bool:
    for k in range(len(one)):  # noqa: SIM110 (numba compiles no generator expression)
        if one[k] != two[k]:
            return False
    return True
