"""HTGA: the hybrid Taguchi genetic algorithm of Al-Janan and Liu.

Source: D. H. Al-Janan, T.-K. Liu, "Path optimization of CNC PCB drilling using
hybrid Taguchi genetic algorithm", Kybernetes 45(1), 2016.  Symbols are the
paper's: NP population, NO = 0.8 NP offspring selected, CR crossover rate, MR
mutation rate, GN generations, TR the time of a route.  Steps 2-8 of its
Section 3 are the functions below, in its order.

Readings chosen, because the paper is silent or its figure is lost:

* Step 3: the share of a chromosome on the roulette wheel is 1/TR (a shorter
  route contributes more).  A pair is two chromosomes with different genes; when
  16 spins bring only equal ones (a converged population) the last pair stands.
* Step 4: "a gene U1 chosen randomly from P1 is used along with the sequence in
  P2": U1 is a stretch of four successive genes of P1, so that three legs are
  inherited; they come first, and the others follow in the sequence of P2.
  ``crossover="front"`` takes four scattered genes instead, ``"places"`` leaves
  scattered genes at their places of P1, the set-partition crossover of
  scheduling.  Only with a stretch does the speed come near the printed one
  (``data/experiments/htga-readings.toml`` measures the readings).
* Step 4: a pair that is not crossed goes on to Steps 5 and 6 as it is, as usual in
  a genetic algorithm: NO chromosomes were selected, and NO is "the number of
  offspring".  ``uncrossed=False`` drops it.
* Step 5: once a generation (``taguchi`` times), on two chromosomes of the
  offspring, as "only two chromosomes from the offspring population are
  analyzed".  A run of the array takes gene g from Level 1 or 2; a gene that is
  there already gives way to the missing genes, in the sequence of Level 1.
  Equation (3) prints y_t^2/t; with the one observation per run that a
  deterministic TR has, it is eta = -10 log10(y^2) either way.
* Step 6: all six arrangements of the three genes compete, the present one
  among them, so a mutation never makes a route longer.
* Step 8: copies are removed, for without that a few dozen generations leave
  nothing but copies and Step 3 finds no distinct pair any more;
  ``distinct=False`` ranks "all chromosomes" as the sentence says.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from tcp.errors import UsageError
from tcp.heuristics.arrays import orthogonal_array
from tcp.heuristics.orders import (
    TRIVIAL,
    answer,
    below,
    enumerate_all,
    length,
    orders,
    refusal,
    search,
    shuffle,
)
from tcp.heuristics.selection import rank, spin, spin_up
from tcp.instance import Instance
from tcp.jit import kernel, lean
from tcp.result import Outcome, Report
from tcp.stop import Clock
from tcp.travel import Ints

__all__ = ["refusal", "run"]

Genes = NDArray[np.int32]
Levels = NDArray[np.int8]
Floats = NDArray[np.float64]

CROSSOVERS = "stretch", "front", "places"
STRETCH, _, PLACES = range(3)

GENES = 4
"""Genes of U1 and U2 in the set-partition crossover."""

SPINS = 16
"""Spins of the roulette wheel for a second parent with other genes than the first."""


def run(
    instance: Instance,
    *,
    rng: Generator,
    clock: Clock,
    report: Report,
    np: int = 50,
    no: float = 0.8,
    cr: float = 0.6,
    mr: float = 0.2,
    gn: int = 10_000,
    crossover: str = "stretch",
    uncrossed: bool = True,
    taguchi: int = 1,
    distinct: bool = True,
) -> Outcome:
    """Search with the hybrid Taguchi genetic algorithm.

    Parameters
    ----------
    instance, rng, clock, report
        As in every solver.
    np : int
        NP, the population, >= 4 (the paper: 50 for WP1 and WP2, 100 for WP3).
    no : float
        NO as a share of NP, in (0, 1].
    cr, mr : float
        CR and MR, in [0, 1].
    gn : int
        GN, generations, >= 0 (the paper: 10,000; 20,000 for WP3).
    crossover : {"stretch", "front", "places"}
        What U1 is and where it goes; see the module's readings.
    uncrossed : bool
        Whether pairs that are not crossed are mutated and mixed too.
    taguchi : int
        Taguchi experiments a generation, >= 0; 0 is the genetic algorithm alone.
    distinct : bool
        Whether elimination removes copies.

    Returns
    -------
    Outcome
        The best route; ``details`` has the generations made and the routes evaluated.

    Raises
    ------
    UsageError
        For a parameter out of range.
    """
    _check(np, no, cr, mr, gn, crossover, taguchi)
    problem = orders(instance)
    if len(problem) <= TRIVIAL:
        return enumerate_all(instance, problem)
    pairs = max(1, round(no * np) // 2)
    genes, times, slots, searched = _empty(np, np + 2 * pairs + taguchi, len(problem))
    array = orthogonal_array(len(problem))
    _initialise(rng, problem.legs, genes, times, slots, np)

    def advance(steps: int) -> tuple[int, int]:
        made = _generations(
            rng, problem.legs, array, genes, times, slots, searched, np, pairs, cr, mr,
            CROSSOVERS.index(crossover), uncrossed, taguchi, distinct, steps,
        )  # fmt: skip
        return made, int(times[slots[0]])

    best = int(times[slots[0]])
    stopped, done = search(instance, problem, gn, clock, report, best, advance)
    return answer(
        problem,
        genes[slots[0]],
        int(times[slots[0]]),
        stopped,
        iterations=done,
        evaluations=int(searched[0]),
    )


def _empty(population: int, size: int, m: int) -> tuple[Genes, Ints, Ints, Ints]:
    """Chromosomes, their TR, the slots in order of rank, and the count of evaluations."""
    genes = np.zeros((size, m), dtype=np.int32)
    return genes, np.zeros(size, np.int64), np.arange(size), np.array([population])


def _check(np: int, no: float, cr: float, mr: float, gn: int, crossover: str, taguchi: int) -> None:
    if np < 4 or gn < 0 or taguchi < 0:
        raise UsageError("htga needs np >= 4, gn >= 0 and taguchi >= 0")
    if not (0 < no <= 1 and 0 <= cr <= 1 and 0 <= mr <= 1):
        raise UsageError("htga needs no in (0, 1] and cr, mr in [0, 1]")
    if crossover not in CROSSOVERS:
        raise UsageError(f"htga knows the crossovers {', '.join(CROSSOVERS)}, not {crossover!r}")


@lean
def _initialise(
    rng: Generator, legs: Ints, genes: Genes, times: Ints, slots: Ints, population: int
) -> None:
    """Step 2: random chromosomes, distinct as far as there are enough orders."""
    m = genes.shape[1]
    for i in range(population):
        for k in range(m):
            genes[i, k] = k
        for _ in range(SPINS):
            shuffle(rng, genes[i])
            fresh = True
            for j in range(i):
                if _equal(genes[i], genes[j]):
                    fresh = False
                    break
            if fresh:
                break
        times[i] = length(genes[i], legs)
    rank(times, slots, population)


@kernel
def _generations(
    rng: Generator,
    legs: Ints,
    array: Levels,
    genes: Genes,
    times: Ints,
    slots: Ints,
    searched: Ints,
    population: int,
    pairs: int,
    cr: float,
    mr: float,
    crossover: int,
    uncrossed: bool,
    taguchi: int,
    distinct: bool,
    steps: int,
) -> int:
    """Steps 3-8, up to ``steps`` times; ``slots[:population]`` are the parents, best first."""
    wheel = np.zeros(population)
    stamp = np.zeros(genes.shape[1], dtype=np.int64)
    for step in range(1, steps + 1):
        before = times[slots[0]]
        spin_up(times, slots, population, wheel)
        end = population
        for _ in range(pairs):
            first, second = _select(rng, genes, times, slots, wheel)
            if rng.random() < cr:
                _cross(rng, legs, genes, times, first, second, slots[end], stamp, crossover)
                _cross(rng, legs, genes, times, second, first, slots[end + 1], stamp, crossover)
                searched[0] += 2
            elif uncrossed:
                _pass(genes, times, first, slots[end])
                _pass(genes, times, second, slots[end + 1])
            else:
                continue
            end += 2
        crossed = end
        for _ in range(taguchi):
            if crossed - population >= 2:
                a = population + below(rng, crossed - population)
                b = population + below(rng, crossed - population - 1)
                b = b + 1 if b >= a else b
                child = slots[end]
                times[child] = _taguchi(array, legs, genes, slots[a], slots[b], child, stamp)
                searched[0] += array.shape[0] + 1
                end += 1
        for k in range(population, end):
            if rng.random() < mr:
                times[slots[k]] += _mutate(rng, genes[slots[k]], legs)
                searched[0] += 6
        _eliminate(genes, times, slots, end, distinct)
        if times[slots[0]] < before:
            return step
    return steps


@lean
def _equal(a: Genes, b: Genes) -> bool:
    for k in range(len(a)):  # noqa: SIM110 (numba compiles no generator expression)
        if a[k] != b[k]:
            return False
    return True


@lean
def _select(
    rng: Generator, genes: Genes, times: Ints, slots: Ints, wheel: Floats
) -> tuple[int, int]:
    """Step 3: a pair of parents with different genes."""
    first = slots[spin(rng, wheel)]
    second = first
    for _ in range(SPINS):
        second = slots[spin(rng, wheel)]
        if times[first] != times[second] or not _equal(genes[first], genes[second]):
            break
    return first, second


@lean
def _pass(genes: Genes, times: Ints, parent: int, child: int) -> None:
    """An offspring that is its parent."""
    times[child] = times[parent]
    for k in range(genes.shape[1]):
        genes[child, k] = genes[parent, k]


@lean
def _cross(
    rng: Generator, legs: Ints, genes: Genes, times: Ints, first: int, second: int, child: int,
    stamp: Ints, crossover: int,
) -> None:  # fmt: skip
    """Step 4: GENES genes of the first parent (U1), the rest in the second's sequence."""
    m = genes.shape[1]
    for gene in range(m):
        stamp[gene] = 0
    start = below(rng, m - GENES + 1) if crossover == STRETCH else 0
    chosen = 0
    while chosen < GENES:
        k = start + chosen if crossover == STRETCH else below(rng, m)
        gene = genes[first, k]
        if stamp[gene] == 0:
            stamp[gene] = 1
            genes[child, k if crossover == PLACES else chosen] = gene
            chosen += 1
    at = 0 if crossover == PLACES else GENES
    for k in range(m):
        gene = genes[second, k]
        if stamp[gene] == 0:
            while crossover == PLACES and stamp[genes[first, at]] == 1:
                at += 1
            genes[child, at] = gene
            at += 1
    times[child] = length(genes[child], legs)


@kernel
def _taguchi(
    array: Levels, legs: Ints, genes: Genes, one: int, two: int, child: int, stamp: Ints
) -> int:
    """Step 5: the best chromosome of the array, or the predicted one; returns its TR."""
    runs, m = array.shape
    effect = np.zeros((2, m))
    for gene in range(m):
        stamp[gene] = -1
    levels = np.zeros(m, dtype=np.int8)
    trial = np.zeros(m, dtype=np.int32)
    best = -1
    for r in range(runs + 1):
        for g in range(m):  # at last the predicted chromosome: the levels of higher SNR
            levels[g] = array[r, g] if r < runs else effect[1, g] > effect[0, g]
        _mix(levels, genes[one], genes[two], trial, stamp, r)
        y = length(trial, legs)
        if r < runs:
            eta = -20.0 * math.log10(max(y, 1))
            for g in range(m):
                effect[levels[g], g] += eta
        if best < 0 or y < best:
            best = y
            for g in range(m):
                genes[child, g] = trial[g]
    return best


@lean
def _mix(levels: Levels, one: Genes, two: Genes, trial: Genes, stamp: Ints, mark: int) -> None:
    """One run of the array, repaired to a legal chromosome; ``stamp`` marks used genes."""
    m = len(one)
    doubled = 0
    for g in range(m):
        gene = one[g] if levels[g] == 0 else two[g]
        if stamp[gene] == mark:
            trial[g] = -1
            doubled += 1
        else:
            stamp[gene] = mark
            trial[g] = gene
    missing = 0
    for g in range(m):
        if doubled == 0:
            break
        if trial[g] < 0:
            while stamp[one[missing]] == mark:
                missing += 1
            trial[g] = one[missing]
            missing += 1
            doubled -= 1


@lean
def _mutate(rng: Generator, order: Genes, legs: Ints) -> int:
    """Step 6: the best of the 3! arrangements of three random genes; returns the gain <= 0."""
    m = len(order)
    i = below(rng, m)
    j = below(rng, m - 1)
    j = j + 1 if j >= i else j
    k = below(rng, m - 2)
    for taken in (min(i, j), max(i, j)):
        k = k + 1 if k >= taken else k
    a, b, c = order[i], order[j], order[k]
    now = _around(order, i, j, k, legs)
    best, p, q, r = now, a, b, c
    for u, v, w in ((a, c, b), (b, a, c), (b, c, a), (c, a, b), (c, b, a)):
        order[i], order[j], order[k] = u, v, w
        cost = _around(order, i, j, k, legs)
        if cost < best:
            best, p, q, r = cost, u, v, w
    order[i], order[j], order[k] = p, q, r
    return best - now


@lean
def _around(order: Genes, i: int, j: int, k: int, legs: Ints) -> int:
    """Cost of the legs that touch three places, each leg once."""
    m = len(order)
    total = np.int64(0)
    for p in (i, j, k):
        previous = m if p == 0 else order[p - 1]
        total += legs[previous, order[p]]
        if p + 1 != i and p + 1 != j and p + 1 != k:
            following = m if p + 1 == m else order[p + 1]
            total += legs[order[p], following]
    return total


@kernel
def _eliminate(genes: Genes, times: Ints, slots: Ints, end: int, distinct: bool) -> None:
    """Step 8: parents and offspring by rank, parents first among equals; the first NP stay.

    Copies go behind all others: too small a number of distinct chromosomes is
    filled up with copies.
    """
    rank(times, slots, end)
    if not distinct:
        return
    copies = np.zeros(end, dtype=np.int64)
    kept = 0
    for k in range(end):
        slot = slots[k]
        if _copy(genes, times, slot, slots, kept):
            copies[k - kept] = slot
        else:
            slots[kept] = slot
            kept += 1
    for k in range(kept, end):
        slots[k] = copies[k - kept]


@lean
def _copy(genes: Genes, times: Ints, one: int, slots: Ints, kept: int) -> bool:
    """Whether a chromosome equals one of the kept ones of its TR."""
    k = kept - 1
    while k >= 0 and times[slots[k]] == times[one]:
        if _equal(genes[slots[k]], genes[one]):
            return True
        k -= 1
    return False
