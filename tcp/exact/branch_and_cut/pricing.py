"""Exact reduced costs: of listed pairs, and of all pairs without listing them.

With integer potentials pi and set weights w (a cut's multiplier weighs on each
of its sets) over a common scale,

    rc(i, j) = scale * c(i, j) - pi_i - pi_j - sum of w_S over sets S with one of i, j inside.

A set with w_S > 0 can lower rc only for pairs it separates, so with
``P_i = pi_i + sum of the positive w_S over S holding i`` no pair's rc is below
``scale * c - P_i - P_j``: a filter of three additions that leaves only few
pairs to be priced exactly (Applegate et al. 2006, section 12.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tcp.exact.branch_and_cut.cuts import Family
from tcp.exact.branch_and_cut.problem import Geometry, Problem, edge_cost
from tcp.jit import cached, kernel, lean
from tcp.travel import Ints


@dataclass(frozen=True, eq=False)
class Prices:
    """Integer potentials and cut multipliers, ready to price pairs.

    Parameters
    ----------
    problem : Problem
        Nodes and costs.
    family : Family
        The cuts with multipliers, all nonzero.
    pi : int64 array of shape (size,)
        Node potentials.
    y : int64 array of shape (family.count,)
        Cut multipliers; negative only for a branch x(delta(S)) <= 2.
    scale : int
        Multiplier of the costs; 0 prices a proof of infeasibility.
    """

    problem: Problem
    family: Family
    pi: Ints
    y: Ints
    scale: int

    @cached_property
    def weights(self) -> Ints:
        """The weight of every set."""
        return self.y[self.family.owner] * self.family.weight

    @cached_property
    def membership(self) -> tuple[Ints, Ints]:
        """The sets of every node."""
        return self.family.membership(self.problem.size)

    @cached_property
    def potential(self) -> Ints:
        """P of the module's docstring."""
        total = self.pi.copy()
        weight = np.repeat(np.maximum(self.weights, 0), np.diff(self.family.ptr))
        np.add.at(total, self.family.nodes, weight)
        return total

    def of(self, i: Ints, j: Ints, cost: Ints) -> Ints:
        """Reduced costs of the pairs ``i[k]``-``j[k]`` of the given costs."""
        ptr, sets = self.membership
        return _listed(self.scale, self.pi, ptr, sets, self.weights, i, j, cost)

    def below(self, limit: int, capacity: int) -> tuple[Ints, Ints, Ints, Ints, int, int]:
        """All pairs with a reduced cost below ``limit``.

        Returns
        -------
        i, j, cost, rc : int64 arrays
            The first ``capacity`` of them in the order of their nodes.
        count : int
            How many there are.
        negative : int
            Sum of all reduced costs below 0 (complete if ``limit >= 0``).
        """
        ptr, sets = self.membership
        found = np.empty((4, capacity), np.int64)
        count, high, low = _all_pairs(
            self.problem.geometry,
            self.scale,
            self.pi,
            self.potential,
            ptr,
            sets,
            self.weights,
            limit,
            found,
        )
        i, j, cost, rc = found[:, : min(count, capacity)]
        return i, j, cost, rc, count, (int(high) << 31) + int(low)


@cached(inline="always")
def _separated(ptr: Ints, sets: Ints, weights: Ints, i: int, j: int) -> int:
    """Total weight of the sets that hold exactly one of ``i`` and ``j``."""
    a, a_end = ptr[i], ptr[i + 1]
    b, b_end = ptr[j], ptr[j + 1]
    total = np.int64(0)
    while a < a_end and b < b_end:
        p, q = sets[a], sets[b]
        if p == q:
            a += 1
            b += 1
        elif p < q:
            total += weights[p]
            a += 1
        else:
            total += weights[q]
            b += 1
    while a < a_end:
        total += weights[sets[a]]
        a += 1
    while b < b_end:
        total += weights[sets[b]]
        b += 1
    return total


@kernel
def _listed(
    scale: int, pi: Ints, ptr: Ints, sets: Ints, weights: Ints, i: Ints, j: Ints, cost: Ints
) -> Ints:
    rc = np.empty(len(i), np.int64)
    for k in range(len(i)):
        p, q = i[k], j[k]
        rc[k] = scale * cost[k] - pi[p] - pi[q] - _separated(ptr, sets, weights, p, q)
    return rc


@lean
def _all_pairs(
    geometry: Geometry,
    scale: int,
    pi: Ints,
    potential: Ints,
    ptr: Ints,
    sets: Ints,
    weights: Ints,
    limit: int,
    found: Ints,
) -> tuple[int, int, int]:
    size, capacity = len(pi), found.shape[1]
    count, high, low = 0, np.int64(0), np.int64(0)  # the sum in two halves: it may not fit one
    for i in range(size):
        for j in range(i + 1, size):
            cost = edge_cost(geometry, i, j)
            if scale * cost - potential[i] - potential[j] >= limit:
                continue
            rc = scale * cost - pi[i] - pi[j] - _separated(ptr, sets, weights, i, j)
            if rc >= limit:
                continue
            high += min(rc, 0) >> 31
            low += min(rc, 0) & 0x7FFFFFFF
            if count < capacity:
                found[0, count], found[1, count] = i, j
                found[2, count], found[3, count] = cost, rc
            count += 1
    return count, high, low
