"""The combinatorial cuckoo search of Lim, Kanagaraj and Ponnambalam.

Source: W. C. E. Lim, G. Kanagaraj, S. G. Ponnambalam, "PCB drill path
optimization by combinatorial cuckoo search algorithm", The Scientific World
Journal 2014, 264518.  Equation and pseudocode numbers below are the paper's.

The fitness of Pseudocode 3 closes the decoded sequence to a tour and subtracts
its longest leg; the route starts behind that leg.  **Its minimum is the
optimum of the open path.**  Take any tour T: T less its longest leg is a route,
so the fitness is never below the shortest route P*.  Close P* by its missing
leg e to the tour P* + e, whose longest leg is at least e: its fitness is at most
P* + e - e = P*.  Both together: the minima are equal (a test compares them
exhaustively).  The search is another, though: all n rotations of a tour have
one fitness, the best of their n open ones, so the landscape has (n-1)!/2
classes instead of n!/2 and n times as many sequences decode to an optimum.
``fitness="open"`` offers the plain open path for comparison.

Readings chosen, because the paper is silent:

* Mantegna's beta is 1.5 (the value of Yang and Deb, whose step it adopts).
* "Limit to (-1, 1) by taking only the sign and the decimal part" is said of the
  initial numbers; it is applied to every new egg, for encoded solutions "are
  represented as a vector of numbers in the range of (-1, 1)".
* The paper calls its boards 10, 15 and 50 holes, the home position counted in; p_a
  and alpha_c take n as the holes that can change places: 9, 14 and 49 there, and fewer
  where an end is fixed.
* Equation (16): two different random nests, as they were when the phase began.
* Where the ends of the route are given there is no leg to choose for the cut:
  the fitness is the route's cost, whatever ``fitness`` says.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from tcp.errors import UsageError
from tcp.heuristics.orders import (
    TRIVIAL,
    Orders,
    answer,
    below,
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
    np: int = 50,
    generations: int = 10_000,
    pa: float | None = None,
    alpha_c: float | None = None,
    alpha_h: float = 1.0,
    beta: float = 1.5,
    fitness: str = "cut",
) -> Outcome:
    """Search with the combinatorial cuckoo search.

    Parameters
    ----------
    instance, rng, clock, report
        As in every solver.
    np : int
        Population of nests, >= 3 (the paper: 50 for WP1 and WP2, 100 for WP3).
    generations : int
        MaxGeneration, >= 0 (the paper: 10,000; 20,000 for WP3).
    pa : float, optional
        Fraction of an egg that host birds change, in [0, 1]; 2 / (n - 2).
    alpha_c, alpha_h : float, optional
        Step sizes of the cuckoo and of the hosts, >= 0; 3 / n, and 1.
    beta : float
        Exponent of the Lévy distribution, in [0.3, 1.99].
    fitness : {"cut", "open"}
        Pseudocode 3, or the open path as it stands.

    Returns
    -------
    Outcome
        The best route; ``details`` has the generations made and the solutions searched.

    Raises
    ------
    UsageError
        For a parameter out of range.
    """
    problem = orders(instance)
    m = len(problem)
    if m <= TRIVIAL:
        return enumerate_all(instance, problem)
    pa = 2 / (m - 2) if pa is None else pa
    alpha_c = 3 / m if alpha_c is None else alpha_c
    _check(np, generations, pa, alpha_c, alpha_h, beta, fitness)
    cut = fitness == "cut" and problem.open
    nests = _nests(rng, problem, np, cut)
    sigma = mantegna_sigma(beta)

    _, sequences, _, _, costs = nests

    def advance(steps: int) -> tuple[int, int]:
        made = _generations(
            rng, problem.legs, *nests, pa, alpha_c, alpha_h, beta, sigma, cut, steps
        )
        return made, int(costs.min())

    best = int(costs.min())
    stopped, done = search(instance, problem, generations, clock, report, best, advance)
    nest = int(costs.argmin())
    order = _behind_longest(sequences[nest], problem.legs) if cut else sequences[nest]
    return answer(
        problem,
        order,
        int(costs[nest]),
        stopped,
        iterations=done,
        evaluations=np * (2 * done + 1),
    )


def mantegna_sigma(beta: float) -> float:
    """Equation (12): the standard deviation of u in Mantegna's algorithm."""
    above = math.gamma(1 + beta) * math.sin(math.pi * beta / 2)
    below = math.gamma((1 + beta) / 2) * beta * 2 ** ((beta - 1) / 2)
    return (above / below) ** (1 / beta)


def _check(
    np: int, generations: int, pa: float, alpha_c: float, alpha_h: float, beta: float, fitness: str
) -> None:
    if np < 3 or generations < 0:
        raise UsageError("cuckoo needs np >= 3 and generations >= 0")
    if not 0 <= pa <= 1 or alpha_c < 0 or alpha_h < 0 or not 0.3 <= beta <= 1.99:
        raise UsageError("cuckoo needs pa in [0, 1], step sizes >= 0 and beta in [0.3, 1.99]")
    if fitness not in ("cut", "open"):
        raise UsageError(f"cuckoo knows the fitnesses cut and open, not {fitness!r}")


def _nests(rng: Generator, problem: Orders, size: int, cut: bool) -> tuple[np.ndarray, ...]:
    """Section 3.3.3: eggs (keys by hole), their sequences, sorted keys, ranks and fitness."""
    keys = rng.standard_normal((size, len(problem)))
    keys = np.fmod(keys, 1.0)
    sequences = keys.argsort(axis=1, kind="stable")
    ordered = np.take_along_axis(keys, sequences, axis=1)
    ranks = sequences.argsort(axis=1)
    costs = np.array([_fitness(s, problem.legs, cut) for s in sequences])
    return keys, sequences, ordered, ranks, costs


def _behind_longest(sequence: Ints, legs: Ints) -> Ints:
    """The route of Pseudocode 3: the tour from behind its (first) longest leg."""
    closed = legs[sequence, np.roll(sequence, -1)]
    return np.roll(sequence, -1 - int(closed.argmax()))


@lean
def _fitness(sequence: Ints, legs: Ints, cut: bool) -> int:
    """Pseudocode 3, or the open path's cost."""
    if not cut:
        return length(sequence, legs)
    m = len(sequence)
    longest = legs[sequence[m - 1], sequence[0]]
    total = longest
    for k in range(m - 1):
        leg = legs[sequence[k], sequence[k + 1]]
        total += leg
        longest = max(longest, leg)
    return total - longest


@lean
def _levy(rng: Generator, beta: float, sigma: float) -> float:
    """Equations (11) and (12): Mantegna's u / |v|^(1/beta)."""
    u = sigma * rng.standard_normal()
    v = abs(rng.standard_normal())
    return u / v ** (1.0 / beta)


@lean
def _limit(value: float) -> float:
    """The sign and the decimal part: back into (-1, 1)."""
    return value if -1.0 < value < 1.0 else np.fmod(value, 1.0)


@lean
def _lay(
    egg: Floats,
    nest: int,
    keys: Floats,
    sequences: Ints,
    ordered: Floats,
    ranks: Ints,
    costs: Ints,
    sequence: Ints,
    legs: Ints,
    cut: bool,
) -> None:
    """Decode a new egg; it replaces the nest's if its fitness is better (Pseudocode 2)."""
    m = len(egg)
    for k in range(m):  # the old sequence is almost sorted: insert the few that moved
        hole = sequences[nest, k]
        value = egg[hole]
        at = k
        while at > 0 and egg[sequence[at - 1]] > value:
            sequence[at] = sequence[at - 1]
            at -= 1
        sequence[at] = hole
    cost = _fitness(sequence, legs, cut)
    if cost >= costs[nest]:
        return
    costs[nest] = cost
    for k in range(m):
        hole = sequence[k]
        keys[nest, k] = egg[k]
        sequences[nest, k] = hole
        ordered[nest, k] = egg[hole]
        ranks[nest, hole] = k


@kernel
def _generations(
    rng: Generator,
    legs: Ints,
    keys: Floats,
    sequences: Ints,
    ordered: Floats,
    ranks: Ints,
    costs: Ints,
    pa: float,
    alpha_c: float,
    alpha_h: float,
    beta: float,
    sigma: float,
    cut: bool,
    steps: int,
) -> int:
    """Pseudocode 2, up to ``steps`` times round its loop.

    Pseudocode 4 (Lamarckian property): an egg that follows the values of nest i
    without altering its own tour has the value ``ordered[i, rank of the hole]``.
    """
    nests, m = keys.shape
    egg = np.zeros(m)
    sequence = np.zeros(m, dtype=np.int64)
    before = costs.min()
    for step in range(1, steps + 1):
        best = ranks[np.argmin(costs)].copy()
        for i in range(nests):  # the best cuckoo lays in all nests: equations (9)-(13)
            for k in range(m):
                egg[k] = keys[i, k]
                difference = ordered[i, best[k]] - egg[k]
                if difference != 0.0:
                    egg[k] = _limit(egg[k] + alpha_c * difference * _levy(rng, beta, sigma))
            _lay(egg, i, keys, sequences, ordered, ranks, costs, sequence, legs, cut)
        hosts = ranks.copy()
        for i in range(nests):  # host birds lay eggs: equations (14)-(16)
            p = below(rng, nests)
            q = below(rng, nests - 1)
            q = q + 1 if q >= p else q
            for k in range(m):
                egg[k] = keys[i, k]
                if rng.random() < pa:
                    difference = ordered[i, hosts[p, k]] - ordered[i, hosts[q, k]]
                    egg[k] = _limit(egg[k] + alpha_h * difference * _levy(rng, beta, sigma))
            _lay(egg, i, keys, sequences, ordered, ranks, costs, sequence, legs, cut)
        if costs.min() < before:
            return step
    return steps
