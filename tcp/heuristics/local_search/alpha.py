"""Candidates by alpha-nearness: what the lightest tree costs more if it must have a pair.

The nearest nodes are not those that good tours link: a node between two rows may need a partner
that is its tenth nearest, and never its first.  Under the node potentials of an ascent
(:mod:`tcp.bounds.ascent`), the lightest spanning tree looks like a tour, and alpha, the weight
of a pair less that of the heaviest tree edge on the way between its nodes, tells how far a tour
through the pair is from the best (K. Helsgaun, "An effective implementation of the Lin-Kernighan
traveling salesman heuristic", European Journal of Operational Research 126 (2000), section 4).
Five such candidates serve better than six near ones.

The virtual node is no part of the tree: a path is a tree already.  Floats only choose here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tcp.bounds.ascent import Ascent, lightest_tree
from tcp.bounds.candidates import distinct
from tcp.heuristics.local_search.ground import Ground, Small, prices
from tcp.heuristics.local_search.neighbours import near_nodes, sort_by
from tcp.jit import allocating
from tcp.travel import Ints

LOOK = 20
"""Near nodes out of which a node's candidates are chosen."""

LINKS = 10
"""Near nodes to which the trees of the ascent may link a node, beside those of the start tour."""

TREES, LEAST, MOST = 600_000, 60, 300
"""Trees of the ascent, times nodes; and the least and most of them."""

PRECISION = 2**10
"""Potentials are multiples of 1/1024 quantum: floats add such numbers exactly, so that alphas
that are equal, as most are on a grid, are seen to be."""


def alpha_nearest(
    ground: Ground,
    order: Small,
    real: int,
    width: int,
    late: Callable[[], bool] = lambda: False,
) -> Ground:
    """The ground with the ``width`` best candidates of each node by alpha-nearness.

    O(n log n) time for each tree of the ascent, O(n) memory.

    Parameters
    ----------
    ground : Ground
        Candidates that it has already are not looked at.
    order : int32 array (n,)
        A tour: it ties the parts of a board together.
    real : int
        Number of nodes with coordinates, 3 or more; they are the first ones.
    width : int
        Wanted length of a list.
    late : callable
        Asked between trees; if it is too late, the ground comes back as it is.

    Returns
    -------
    Ground
        With lists as :func:`tcp.heuristics.local_search.neighbours.near_nodes` makes them:
        nearest first, padded with the node itself.
    """
    near, dist = near_nodes(ground, real, LOOK)
    ends, forced = _pairs(ground, near[:real, :LINKS], order, real)
    costs = prices(ground.costs, *np.ascontiguousarray(ends.T)).astype(np.float64)
    steps = min(max(TREES // real, LEAST), MOST)
    ascent = Ascent(real, float(costs[1 - real :].clip(0).mean()), steps)
    while ascent.steps < steps:
        ascent.move(lightest_tree(real, ends, ascent.weights(ends, costs), forced)[1])
        if late():
            return ground
    ascent.now = np.rint(ascent.now * PRECISION) / PRECISION
    weights = ascent.weights(ends, costs)
    tree, _ = lightest_tree(real, ends, weights, forced)
    chosen, cost = near[:, :width].copy(), dist[:, :width].copy()
    up, turn = _merges(real, ends[tree])
    _choose(ascent.now, up, turn, weights[tree], near[:real], dist, chosen, cost)
    cost[real:] = 0  # the virtual node's candidates vary
    return ground._replace(near=chosen, dist=cost)


def _pairs(ground: Ground, near: Small, order: Small, real: int) -> tuple[Ints, int]:
    """Pairs for the trees, forced ones first: how many, and those of the tour last."""
    v, k = np.nonzero(ground.mates[:real] >= 0)
    forced = np.column_stack([v, ground.mates[v, k]])
    forced = forced[(forced[:, 0] < forced[:, 1]) & (forced[:, 1] < real)]
    whose = np.repeat(np.arange(real), near.shape[1])
    close = distinct(whose, near.ravel().astype(np.int64), real)
    path = order[order < real]
    tour = np.column_stack([path[:-1], path[1:]])
    return np.vstack([forced, close, tour]).astype(np.int64), len(forced)


@allocating
def _merges(n: int, tree: Any) -> Any:
    """How the components of a tree's edges, lightest first, become one.

    Each node but one goes ``up`` into another by the edge ``turn``; as the smaller component
    joins the larger one, all ways up are short.
    """
    up, size, turn = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    for v in range(n):
        up[v], size[v], turn[v] = v, 1, tree.shape[0]
    for e in range(tree.shape[0]):
        a, b = tree[e, 0], tree[e, 1]
        while up[a] != a:
            a = up[a]
        while up[b] != b:
            b = up[b]
        if size[a] > size[b]:
            a, b = b, a
        up[a], turn[a] = b, e
        size[b] += size[a]
    return up, turn


@allocating
def _choose(
    potential: Any,
    up: Any,
    turn: Any,
    weight: Any,
    near: Any,
    dist: Any,
    chosen: Any,
    cost: Any,
) -> None:
    """Fill the lists ``chosen`` and ``cost`` with the alpha-nearest of the ``near`` nodes."""
    look = near.shape[1]
    alpha, at = np.empty(look), np.empty(look, np.int64)
    for v in range(near.shape[0]):
        size = np.int64(0)
        for k in range(look):
            w = near[v, k]
            if w == v:
                break
            i, j, last = v, np.int64(w), 0
            while i != j:  # up to where they meet: the edge that made them one comes last
                if turn[i] < turn[j]:
                    i, last = up[i], turn[i]
                else:
                    j, last = up[j], turn[j]
            alpha[k], at[k] = dist[v, k] - potential[v] - potential[w] - weight[last], k
            size += 1
        sort_by(alpha, at, size)
        picked = min(size, chosen.shape[1])
        for m in range(picked):
            chosen[v, m], cost[v, m] = near[v, at[m]], dist[v, at[m]]
        sort_by(cost[v], chosen[v], picked)  # nearest first, of equally near ones the best
