"""Local cuts: whatever a few parts of the graph can tell, without a template.

The LP solution x is looked at through a keyhole: a few *atoms* (node sets) and
one more for all the rest.  Among all inequalities

    sum over sets S of atoms of weight_S x(delta(S)) >= 1,    weight_S >= 0,

that hold for every tour of the atoms, a small LP finds one that x violates
most; its rows are tours, found as they are needed, at last by the dynamic
programme of Held and Karp.  Such an inequality holds for every tour of the
nodes: weights on sets make a metric, so what a tour does within an atom costs
nothing and skipping repeated visits costs no more.  Every violated subtour cut,
comb, path inequality ... that the keyhole shows is found, and many that nobody
named.

The idea is Applegate, Bixby, Chvatal and Cook's (2001, "TSP cuts which do not
conform to the template paradigm"); to search among sums of set boundaries is
our simplification: it needs no tilting to facets, and keeps the form of all
other cuts.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import gcd

import numpy as np
from numpy.typing import NDArray

from tcp.exact.branch_and_cut.covering import extended, minimised, opened, solution
from tcp.exact.branch_and_cut.cuts import Cut, smaller_side
from tcp.exact.branch_and_cut.proof import Floats
from tcp.jit import allocating
from tcp.travel import Ints

VIOLATION = 0.004
"""A local cut must miss its right-hand side by this share to be worth a row."""

LIGHT = 4.0
"""Only sets with x(delta(S)) up to this get weights: heavier ones never did."""

ROUNDS = 60
"""Most times that tours are added for one keyhole."""

PARTS = 16
"""Most parts of a local cut: certificates know no more."""

UNIT, FAR = 1 << 26, np.int32(1 << 30)
"""The whole number that stands for the length 1 of a tour, and one that no tour exceeds."""

Short = NDArray[np.int32]

LARGEST_WEIGHT = 60
"""Weights are fractions; the smallest is made a whole number up to this."""


@allocating
def separated(x: Floats) -> tuple[float, Ints, Floats]:
    """The least of ``sum weight_S x(delta(S))`` over weights with at least 1 for every tour.

    Returns the value, sets as bit masks of atoms (the rest of the graph is in
    none), and their weights.  The value is 1 where nothing is violated by more
    than VIOLATION, or nothing was found in time.
    """
    sets, values = _light(x)
    nonbasic = np.arange(len(sets))
    basic = np.zeros(0, np.int64)
    dictionary = opened(values)
    tours = _short_tours(-x, np.inf)
    for _ in range(ROUNDS):
        fresh = _crossings(tours, sets)
        dictionary, basic = extended(dictionary, basic, nonbasic, fresh)
        if not minimised(dictionary, basic, nonbasic, 1.0 - VIOLATION):
            break  # the value only grows
        weights = solution(dictionary, basic)
        tours = _too_short(_lengths(sets, weights, len(x)))
        if not len(tours):
            return dictionary[-1, -1], sets, weights
    return 1.0, sets, np.zeros(len(sets))


def cut_at(atoms: Sequence[Ints], sets: Ints, weights: Floats, size: int) -> Cut | None:
    """The cut in whole numbers; None if they would be too large, or a set is all there is."""
    used = np.nonzero(weights)[0]
    sets, whole = sets[used], _whole(weights[used])
    if whole is None:
        return None
    parts, kept = [], []
    for mask, weight in zip(sets.tolist(), whole.tolist(), strict=True):
        nodes = np.concatenate([nodes for k, nodes in enumerate(atoms) if mask >> k & 1])
        part = smaller_side(nodes, size)
        if len(part) > 1:  # the degree of a node is 2 in every solution
            parts.append(part)
            kept.append(weight)
    return cut_of(parts, kept, size) if parts else None


def cut_of(sets: Sequence[Ints], weights: Sequence[int], size: int) -> Cut:
    """The cut over weighted sets of ``size`` nodes: its right-hand side is the least of any tour.

    Raises
    ------
    ValueError
        If the sets split the nodes into more than :data:`PARTS` parts, or weigh too much.
    """
    if len(sets) == 1:
        return Cut.of(sets)
    nodes = np.unique(np.concatenate(sets))
    inside = np.array([np.isin(nodes, part) for part in sets])
    if len(nodes) < size:
        inside = np.pad(inside, ((0, 0), (0, 1)))  # the nodes in no set are a part as well
    parts = np.unique(inside, axis=1).T
    if len(parts) > PARTS:
        raise ValueError(f"a local cut has at most {PARTS} parts, not {len(parts)}")
    if PARTS * sum(weights) > FAR:
        raise ValueError(f"the weights of a local cut are at most {FAR // PARTS} in all")
    lengths = (parts[:, None] != parts) @ np.array(weights, np.int64)
    return Cut.weighted(sets, weights, int(shortest_tour(lengths.astype(np.int32))[1]))


def _whole(weights: Floats) -> Ints | None:
    """The weights in lowest whole numbers; None if they need too large ones."""
    share = weights / weights.min()
    for factor in range(1, LARGEST_WEIGHT + 1):
        nearest = np.rint(share * factor)
        if np.abs(share * factor - nearest).max() < 1e-4:
            whole = nearest.astype(np.int64)
            return whole // gcd(*whole.tolist())
    return None


@allocating
def _too_short(lengths: Floats) -> Ints:
    """Tours shorter than 1 if there are any: found quickly if possible, else by trying all."""
    tours = _short_tours(lengths, 1.0 - 1e-6)
    if not len(tours):
        whole = np.rint(np.minimum(lengths, 1.0) * UNIT).astype(np.int32)
        tour, length = shortest_tour(whole)
        if length < (1.0 - 1e-6) * UNIT:
            return tour.reshape(1, -1)
    return tours


@allocating
def _short_tours(lengths: Floats, below: float) -> Ints:
    """Different tours shorter than ``below``: nearest neighbours from every atom, then 2-opt."""
    size = len(lengths)
    tours = np.empty((size, size), np.int64)
    name = np.empty(size, np.int64)
    count = 0
    for start in range(size):
        tour = tours[count]
        for k in range(size):
            tour[k] = (start + k) % size
        for k in range(1, size - 1):
            best = k
            for m in range(k + 1, size):
                if lengths[tour[k - 1], tour[m]] < lengths[tour[k - 1], tour[best]] - 1e-12:
                    best = m
            tour[k], tour[best] = tour[best], tour[k]
        better = True
        while better:
            better = False
            for k in range(size - 1):
                for m in range(k + 2, size if k else size - 1):
                    a, b, c = tour[k], tour[k + 1], tour[m]
                    d = tour[m + 1] if m + 1 < size else tour[0]
                    gain = lengths[a, b] + lengths[c, d] - lengths[a, c] - lengths[b, d]
                    if gain > 1e-9:
                        for t in range((m - k) // 2):
                            tour[k + 1 + t], tour[m - t] = tour[m - t], tour[k + 1 + t]
                        better = True
        length, key = 0.0, np.int64(0)
        for k in range(size):
            a, b = tour[k], tour[k + 1] if k + 1 < size else tour[0]
            length += lengths[a, b]
            key += ((1 << a) + (1 << b)) ** 3  # names the set of edges
        fresh = length < below
        for t in range(count):
            fresh = fresh and name[t] != key
        if fresh:
            name[count] = key
            count += 1
    return tours[:count]


@allocating
def shortest_tour(lengths: Short) -> tuple[Ints, int]:
    """A shortest closed tour of up to PARTS atoms, and its length (Held and Karp 1962).

    No tour may be longer than FAR.
    """
    last = len(lengths) - 1
    best = _shortest_paths(lengths)
    visited, end = (1 << last) - 1, 0
    for a in range(last):
        if best[visited, a] + lengths[a, last] < best[visited, end] + lengths[end, last]:
            end = a
    length = best[visited, end] + lengths[end, last]
    tour = np.empty(last + 1, np.int64)
    tour[0] = last
    for k in range(last):
        tour[k + 1] = end
        before = visited ^ 1 << end
        for a in range(last):
            if best[before, a] + lengths[a, end] == best[visited, end]:
                visited, end = before, a
                break
    return tour, length


@allocating
def _shortest_paths(lengths: Short) -> Short:
    """From the last atom through a set of others, by bit mask, to each of them; else FAR."""
    last = len(lengths) - 1
    to = np.zeros((PARTS, PARTS), np.int32)  # always as many, so that the loop is unrolled
    to[:last, :last] = lengths[:last, :last]
    best = np.full((1 << last, PARTS), FAR, np.int32)
    for a in range(last):
        best[1 << a, a] = lengths[last, a]
    for visited in range(3, 1 << last):
        if not visited & (visited - 1):
            continue
        for b in range(last):
            if visited >> b & 1:
                before, way = best[visited ^ 1 << b], to[b]
                low = FAR
                for a in range(PARTS):
                    low = min(low, np.int32(before[a] + way[a]))
                best[visited, b] = low
    return best


@allocating
def _light(x: Floats) -> tuple[Ints, Floats]:
    """The sets of atoms without the last, by bit mask, with x(delta(S)) up to LIGHT, and that."""
    last = len(x) - 1
    value = np.zeros(1 << last)
    for mask in range(1, 1 << last):
        low = 0
        while not mask >> low & 1:
            low += 1
        rest = mask & (mask - 1)
        value[mask] = value[rest]
        for k in range(last + 1):
            value[mask] += -x[low, k] if rest >> k & 1 else x[low, k]
    count = 0
    sets = np.empty(1 << last, np.int64)
    for mask in range(1, 1 << last):
        if value[mask] < LIGHT + 1e-6:
            sets[count], value[count] = mask, value[mask]
            count += 1
    return sets[:count].copy(), value[:count].copy()


@allocating
def _crossings(tours: Ints, sets: Ints) -> Floats:
    """How often each tour of the atoms crosses the boundary of each set."""
    count = np.zeros((len(tours), len(sets)))
    for t in range(len(tours)):
        before = tours[t, -1]
        for here in tours[t]:
            for s in range(len(sets)):  # innermost: several sets at a time
                count[t, s] += (sets[s] >> before ^ sets[s] >> here) & 1
            before = here
    return count


@allocating
def _lengths(sets: Ints, weights: Floats, size: int) -> Floats:
    """The metric that the weights make: the weight of all sets that separate two atoms."""
    total = np.zeros((size, size))
    for s in range(len(sets)):
        if weights[s] > 0.0:
            for a in range(size):
                for b in range(size):
                    if (sets[s] >> a & 1) != (sets[s] >> b & 1):
                        total[a, b] += weights[s]
    return total
