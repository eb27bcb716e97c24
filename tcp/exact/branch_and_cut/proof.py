"""What a dual solution proves, in whole numbers.

For any potentials pi and multipliers y (of the right sign),

    scale * LB = sum 2 pi_i + sum y_k rhs_k + sum over pairs of min over allowed x of rc(i, j) x

bounds every tour of a node of the search tree from below.  The LP's floats are
rounded to integers once; from there on nothing is approximate.  A pair that is
*out* (eliminated by an earlier proof, forbidden or branched to 0) adds
nothing, a pair that is *in* adds its rc, any other adds ``min(0, rc)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcp.exact.branch_and_cut.cuts import Cut, Family
from tcp.exact.branch_and_cut.pricing import Prices
from tcp.exact.branch_and_cut.problem import Problem
from tcp.travel import Ints

Floats = NDArray[np.float64]

ROOM = 2**60
"""Every scaled potential and reduced cost stays below this; their sums are Python integers."""

FINEST = 2**30
"""Largest scale: finer duals would only make certificates longer."""

ADMITTED = 3000
"""Most pairs that one pricing of all pairs offers to the LP."""


@dataclass(frozen=True, eq=False)
class Duals:
    """Integer dual multipliers: the evidence for a bound.

    Parameters
    ----------
    pi : int64 array of shape (size,)
        Node potentials over ``scale``.
    cuts : tuple of (Cut, rhs, y)
        Cuts with nonzero multipliers; ``rhs`` differs from the cut's own for a
        branch on its set (>= 4, or <= 2 with y < 0).
    scale : int
        The common denominator; 0 for a proof of infeasibility.
    """

    pi: Ints
    cuts: tuple[tuple[Cut, int, int], ...]
    scale: int

    def prices(self, problem: Problem) -> Prices:
        """The multipliers ready for pricing."""
        family = Family.of([cut for cut, _, _ in self.cuts])
        y = np.array([y for _, _, y in self.cuts], np.int64)
        return Prices(problem, family, self.pi, y, self.scale)

    @property
    def constant(self) -> int:
        """The bound's part that no pair enters: sum 2 pi + sum y rhs."""
        return 2 * exact_sum(self.pi) + sum(y * rhs for _, rhs, y in self.cuts)


@dataclass(frozen=True, eq=False)
class Alive:
    """Pairs that may still be in a better tour: a list, or all of them (keys is None)."""

    i: Ints
    j: Ints
    cost: Ints
    keys: Ints | None = None

    @classmethod
    def everything(cls) -> Alive:
        """No pair eliminated yet."""
        none = np.zeros(0, np.int64)
        return cls(none, none, none)

    @classmethod
    def of(cls, problem: Problem, keys: Ints) -> Alive:
        """Only the given pairs (ascending keys)."""
        i, j = problem.pairs(keys)
        return cls(i, j, problem.costs(i, j), keys)


@dataclass(frozen=True, eq=False)
class Fixings:
    """Pairs decided at a node of the tree: ascending keys that are in, and out."""

    inside: Ints
    outside: Ints

    @classmethod
    def root(cls, problem: Problem) -> Fixings:
        """What the instance itself demands."""
        return cls(problem.forced, problem.forbidden)

    @property
    def contradict(self) -> bool:
        """Whether a pair must be both in and out: no tour is left."""
        return bool(np.isin(self.inside, self.outside).any())

    def with_pair(self, key: int, value: int) -> Fixings:
        """One more pair decided."""
        if value:
            return Fixings(np.union1d(self.inside, [key]), self.outside)
        return Fixings(self.inside, np.union1d(self.outside, [key]))


@dataclass(frozen=True, eq=False)
class Verdict:
    """What duals prove at a node, and the pairs that would disprove the LP's optimum.

    ``scaled`` is the bound times the scale; ``i``, ``j`` are free pairs of
    negative reduced cost ``rc``, most negative first.
    """

    scaled: int
    i: Ints
    j: Ints
    rc: Ints


def scale_for(problem: Problem, potentials: Floats, weights: Floats) -> int:
    """The largest scale up to :data:`FINEST` that keeps every quantity below :data:`ROOM`.

    ``weights`` are those of all sets of all cuts.

    Basic duals are fractions with small denominators, so a multiple of 2520
    (or of a part of it) often represents them exactly, where a power of two
    would leave every pair of the basis a little off.
    """
    reach = 4.0 * (problem.peak + np.abs(potentials).max(initial=0.0) + weights.sum()) + 1
    most = int(max(1.0, min(float(FINEST), ROOM / reach)))
    base = next(part for part in (2520, 840, 120, 60, 12, 6, 2, 1) if part <= most)
    return base << ((most // base).bit_length() - 1)


def rounded(
    problem: Problem, pi: Floats, rows: Sequence[tuple[Cut, int, float, bool]], unit: float
) -> Duals:
    """Integer multipliers from the LP's floats.

    Parameters
    ----------
    problem : Problem
        Nodes and costs.
    pi : float array
        Duals of the degree rows, in LP cost units.
    rows : sequence of (cut, rhs, dual, equality)
        Cut rows; a negative dual is noise unless the row is an equality.
    unit : float
        Quanta to the unit of LP costs; 0 makes a proof of infeasibility (unit 1, no costs).
    """
    factor = unit or 1.0
    y = np.array([d if eq else max(d, 0.0) for _, _, d, eq in rows]) * factor
    sets = np.array([cut.total for cut, _, _, _ in rows])
    scale = scale_for(problem, pi * factor, np.abs(y) * sets)
    whole = np.rint(y * scale).astype(np.int64).tolist()
    cuts = tuple((cut, rhs, w) for (cut, rhs, _, _), w in zip(rows, whole, strict=True) if w)
    return Duals(np.rint(pi * factor * scale).astype(np.int64), cuts, scale if unit else 0)


def verdict(problem: Problem, duals: Duals, fixings: Fixings, alive: Alive) -> Verdict:
    """The bound that duals prove at a node: every pair that is not out is priced exactly."""
    prices = duals.prices(problem)
    total = duals.constant
    if alive.keys is None:
        i, j, _, rc, count, negative = prices.below(0, 64 * problem.size + 1024)
        if count > len(i):
            i, j, _, rc, count, negative = prices.below(0, count)
        keys = problem.keys(i, j)
    else:
        rc = prices.of(alive.i, alive.j, alive.cost)
        below = np.nonzero(rc < 0)[0]
        i, j, rc, keys = alive.i[below], alive.j[below], rc[below], alive.keys[below]
        negative = exact_sum(rc)
    total += int(negative)
    out, inside = np.isin(keys, fixings.outside), np.isin(keys, fixings.inside)
    total -= exact_sum(rc[out | inside])
    total += _inside(problem, prices, fixings)
    free = np.nonzero(~out & ~inside)[0]
    order = free[np.argsort(rc[free], kind="stable")]
    return Verdict(total, i[order], j[order], rc[order])


def _inside(problem: Problem, prices: Prices, fixings: Fixings) -> int:
    """Contribution of the pairs that are in."""
    i, j = problem.pairs(fixings.inside)
    return exact_sum(prices.of(i, j, problem.costs(i, j)))


def exact_sum(values: Ints) -> int:
    """The sum as a Python integer, which cannot overflow."""
    return int(values.sum(dtype=object))


def ceiling(scaled: int, scale: int, granularity: int) -> int:
    """The smallest multiple of the granularity that is not below ``scaled / scale``."""
    step = scale * granularity
    return -(-scaled // step) * granularity


@dataclass(frozen=True, eq=False)
class Survivors:
    """Keys of the pairs that a better tour may use, and of those with a negative reduced cost."""

    kept: Ints
    negative: Ints


def survivors(
    problem: Problem, duals: Duals, scaled: int, need: int, alive: Alive, limit: int
) -> Survivors | None:
    """The pairs that a tour of cost up to ``need`` may use, or None if too many.

    A pair with ``LB + rc > need`` is in no such tour: its own rc adds to the
    bound if it is used.  One with ``LB - rc > need`` is in all of them: the checker demands it
    below, and may do so for a pair of any negative rc, since the tours that a finished proof asks
    about are cheaper than those known now.  So these stay, in whatever later proofs exclude: the
    checker's domain must not be larger than this.

    Parameters
    ----------
    scaled : int
        The bound of ``duals``, times the scale.
    need : int
        Quanta.
    limit : int
        How many survivors are few enough.
    """
    slack = min(need * duals.scale - scaled, ROOM)
    prices = duals.prices(problem)
    if alive.keys is not None:
        keys, rc = alive.keys, prices.of(alive.i, alive.j, alive.cost)
    else:
        i, j, _, rc, count, _ = prices.below(max(slack + 1, 0), limit)
        if count > limit:
            return None
        keys = problem.keys(i, j)
    kept = np.unique(keys[rc <= max(slack, -1)])
    return Survivors(kept, np.setdiff1d(keys[rc < 0], problem.forbidden))
