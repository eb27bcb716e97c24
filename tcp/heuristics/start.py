"""A quick, honest first tour: nearest neighbour, then 2-opt and Or-opt moves.

Exact models want a hint and an answer to give when time runs out at once.
Rules weigh before costs: a move is better if it breaks fewer of them (counts
of forbidden edges used minus forced edges used), or as many at a lower cost,
so no penalty has to be chosen and nothing can overflow.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tcp.instance import TourForm
from tcp.travel import Ints

Marks = NDArray[np.int8]

STARTS = 12
"""Nearest-neighbour tours that are improved; the best is kept."""

SEGMENT = 3
"""Longest chain that an Or-opt move carries elsewhere."""


def start_tour(form: TourForm, starts: int = STARTS) -> list[int] | None:
    """A cyclic tour that respects the rules, or None if none was found.

    Parameters
    ----------
    form : TourForm
        The instance; needs its full matrix, so at most a few thousand nodes.
    starts : int
        Nodes to begin at, spread evenly over the numbering.

    Returns
    -------
    list of int or None
        All nodes in cyclic order.  None does not mean that there is no route.
    """
    costs, marks = form.full_matrix(), rule_marks(form)
    if form.size <= 3:
        tour = np.arange(form.size, dtype=np.int64)
        return tour.tolist() if not form.forbidden else None
    best: Ints | None = None
    value = (0, 0)
    for first in np.unique(np.linspace(0, form.size - 1, min(starts, form.size)).astype(np.int64)):
        tour = nearest_neighbour(costs, marks, first)
        improve(tour, costs, marks)
        after = np.roll(tour, -1)
        found = (int(marks[tour, after].sum()), int(costs[tour, after].sum()))
        if best is None or found < value:
            best, value = tour, found
    assert best is not None
    return [int(v) for v in best] if value[0] == -len(form.forced) else None


def rule_marks(form: TourForm) -> Marks:
    """+1 at forbidden edges, -1 at forced ones (a pair that is both is 0: never satisfied)."""
    marks = np.zeros((form.size, form.size), dtype=np.int8)
    for sign, edges in ((-1, form.forced), (1, form.forbidden)):
        for i, j in edges:
            marks[i, j] += sign
            marks[j, i] += sign
    return marks


@njit(cache=True)
def nearest_neighbour(costs: Ints, marks: Marks, first: int) -> Ints:
    """Always on to the nearest unvisited node; forced edges first, forbidden ones last."""
    n = len(costs)
    tour = np.empty(n, np.int64)
    seen = np.zeros(n, np.bool_)
    here = first
    for at in range(n):
        tour[at] = here
        seen[here] = True
        best = -1
        for j in range(n):
            if not seen[j] and (
                best < 0
                or marks[here, j] < marks[here, best]
                or (marks[here, j] == marks[here, best] and costs[here, j] < costs[here, best])
            ):
                best = j
        here = best
    return tour


@njit(cache=True)
def improve(tour: Ints, costs: Ints, marks: Marks) -> None:
    """2-opt and Or-opt in place until neither finds a better tour."""
    going = True
    while going:
        going = _two_opt(tour, costs, marks)
        going = _or_opt(tour, costs, marks) or going


@njit(cache=True)
def _two_opt(tour: Ints, costs: Ints, marks: Marks) -> bool:
    n, improved = len(tour), False
    for i in range(n - 2):
        for j in range(i + 2, n - (i == 0)):
            a, b, c, d = tour[i], tour[i + 1], tour[j], tour[(j + 1) % n]
            rules = marks[a, c] + marks[b, d] - marks[a, b] - marks[c, d]
            if rules > 0:
                continue
            if rules < 0 or costs[a, c] + costs[b, d] < costs[a, b] + costs[c, d]:
                tour[i + 1 : j + 1] = tour[i + 1 : j + 1][::-1].copy()
                improved = True
    return improved


@njit(cache=True)
def _or_opt(tour: Ints, costs: Ints, marks: Marks) -> bool:
    n, improved = len(tour), False
    for length in range(1, min(SEGMENT, n - 3) + 1):
        for i in range(n):
            if _carry(tour, costs, marks, i, length):
                improved = True
    return improved


@njit(cache=True)
def _carry(tour: Ints, costs: Ints, marks: Marks, i: int, length: int) -> bool:
    """Move the chain of ``length`` nodes from position ``i`` to a better place, if there is one."""
    n = len(tour)
    turned = np.concatenate((tour[i:], tour[:i]))
    head, tail, before = turned[0], turned[length - 1], turned[n - 1]
    after = turned[length]
    for k in range(length, n - 1):
        p, q = turned[k], turned[k + 1]
        for flip in range(2):
            s, t = (tail, head) if flip else (head, tail)
            rules = marks[p, s] + marks[t, q] + marks[before, after]
            rules -= marks[before, head] + marks[tail, after] + marks[p, q]
            if rules > 0:
                continue
            old = costs[before, head] + costs[tail, after] + costs[p, q]
            if rules < 0 or costs[p, s] + costs[t, q] + costs[before, after] < old:
                chain = turned[:length][::-1] if flip else turned[:length]
                rest = turned[length:]
                m = k - length + 1
                tour[:m] = rest[:m]
                tour[m : m + length] = chain
                tour[m + length :] = rest[m:]
                return True
    return False
