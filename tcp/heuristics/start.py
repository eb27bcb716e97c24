"""A tour to begin with for the exact solvers: deterministic, in milliseconds.

Up to :data:`SMALL` nodes: nearest neighbour, 2-opt and Or-opt on whole cost
matrices in numpy, so that a first call compiles nothing.  Beyond: the local
search.  Costs are floats here: they choose a tour and prove nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tcp.errors import InfeasibleError
from tcp.instance import TourForm
from tcp.stop import Clock, Stop
from tcp.travel import Ints

Floats = NDArray[np.float64]

SMALL = 200
"""Most nodes for which whole matrices are faster than loading compiled code."""

STARTS = 12
"""Nearest-neighbour tours that are improved at most; the best is kept."""

WORK = 600
"""Nodes improved in total over all starts: large forms get fewer."""

SEGMENT = 3
"""Longest chain that an Or-opt move carries elsewhere."""


def start_tour(form: TourForm, starts: int = STARTS) -> list[int] | None:
    """A cyclic tour that respects the rules, or None if none was found.

    Parameters
    ----------
    form : TourForm
        The instance, of any size.
    starts : int
        How many nearest-neighbour tours a small form is improved from, at most.

    Returns
    -------
    list of int or None
        All nodes in cyclic order.  None does not mean that there is no route.
    """
    if form.size <= 3:
        return list(range(form.size)) if not form.forbidden else None
    tour = _small(form, starts) if form.size <= SMALL else _large(form)
    return tour if tour is not None and _keeps_rules(form, tour) else None


def _keeps_rules(form: TourForm, tour: list[int]) -> bool:
    used = {(min(p), max(p)) for p in pairwise([*tour, tour[0]])}
    return used.issuperset(form.forced) and used.isdisjoint(form.forbidden)


def _large(form: TourForm) -> list[int] | None:
    """The local search's first descent."""
    from tcp.heuristics.local_search import improve

    rng, clock = np.random.default_rng(0), Clock(Stop())
    try:
        return improve(form, None, rng=rng, clock=clock, kicks=0)
    except InfeasibleError:
        return None


def _small(form: TourForm, starts: int) -> list[int]:
    """The best of a few improved nearest-neighbour tours."""
    costs = _ruled_costs(form)
    count = max(1, min(starts, WORK // form.size, form.size))
    firsts = np.linspace(0, form.size - 1, count).astype(np.int64)
    tours = [improve(nearest_neighbour(costs, first), costs) for first in np.unique(firsts)]
    best = min(tours, key=lambda tour: float(costs[tour, np.roll(tour, -1)].sum()))
    return [int(v) for v in best]


def _ruled_costs(form: TourForm) -> Floats:
    """Costs where keeping one more rule is worth more than all else in an exchange."""
    costs = form.full_matrix().astype(np.float64)
    worth = 8 * costs.max() + 1
    for sign, edges in ((-1, form.forced), (1, form.forbidden)):
        for i, j in edges:
            costs[i, j] += sign * worth
            costs[j, i] += sign * worth
    np.fill_diagonal(costs, np.inf)
    return costs


def nearest_neighbour(costs: Floats, first: int) -> Ints:
    """Always on to the cheapest unvisited node."""
    tour = np.full(len(costs), first, dtype=np.int64)
    seen = np.zeros(len(costs), dtype=bool)
    for at in range(1, len(costs)):
        seen[tour[at - 1]] = True
        tour[at] = np.where(seen, np.inf, costs[tour[at - 1]]).argmin()
    return tour


def improve(tour: Ints, costs: Floats) -> Ints:
    """The best 2-opt move, or where there is none the best Or-opt move, until there is neither."""
    least = 1e-9 * float(np.abs(costs[np.isfinite(costs)]).max())
    while True:
        along = costs[np.ix_(tour, tour)]
        gain, places = _two_opt(along)
        if gain <= least:
            chains = range(1, min(SEGMENT, len(tour) - 3) + 1)
            moves = [(gain, places), *(_or_opt(along, size) for size in chains)]
            gain, places = max(moves, key=lambda move: move[0])
        if gain <= least:
            return tour
        tour = tour[places()]


Move = tuple[float, Callable[[], Ints]]
"""What a move gains, and the tour's places in their new order."""


def _two_opt(along: Floats) -> Move:
    """The best pair of edges (i, i+1), (j, j+1) to exchange; ``along`` are costs by place."""
    edge = np.diagonal(np.roll(along, -1, axis=1))
    gain = edge[:, None] + edge[None, :] - along - np.roll(along, (-1, -1), axis=(0, 1))
    i, j = sorted(np.unravel_index(int(gain.argmax()), gain.shape))

    def places() -> Ints:
        everyone = np.arange(len(along))
        everyone[i + 1 : j + 1] = everyone[i + 1 : j + 1][::-1].copy()
        return everyone

    return float(gain[i, j]), places


def _or_opt(along: Floats, size: int) -> Move:
    """The best chain of ``size`` nodes from place i to carry, maybe turned, between k and k+1."""
    n = len(along)
    here = np.arange(n)
    edge = along[here, (here + 1) % n]
    last, after = (here + size - 1) % n, (here + size) % n
    closed = edge[here - 1] + edge[last] - along[here - 1, after]
    tail = along[last]
    straight = along + np.roll(tail, -1, axis=1)
    turned = tail + np.roll(along, -1, axis=1)
    gain = closed[:, None] + edge[None, :] - np.minimum(straight, turned)
    for step in range(-1, size):  # the edges that the chain itself touches
        gain[here, (here + step) % n] = -np.inf
    i, k = divmod(int(gain.argmax()), n)

    def places() -> Ints:
        around = (here + i) % n
        chain, rest = around[:size], around[size:]
        at = (k - i - size) % n + 1
        if turned[i, k] < straight[i, k]:
            chain = chain[::-1]
        return np.concatenate((rest[:at], chain, rest[at:]))

    return float(gain[i, k]), places
