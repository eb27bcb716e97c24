"""Tours to start from: greedy edges, the space-filling curve, a given tour with edges forced in."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcp.heuristics.local_search.ground import MATRIX, Ground, Small, prices
from tcp.heuristics.local_search.neighbours import points
from tcp.jit import allocating, compiled, inner
from tcp.travel import Ints

FEW = 12
"""Loose ends looked at from each loose end when fragments are joined."""


BLUR = 0.3
"""Largest share by which random noise lengthens an edge."""


def greedy(g: Ground, noise: np.random.Generator | None = None) -> Small:
    """The tour of greedy edges: shortest first, forced ones before all (Bentley 1992).

    With ``noise``, costs are ranked after each has grown by up to :data:`BLUR`:
    tours that differ, above all in where an open path ends.

    Candidate edges are taken in order of cost as long as they make no cycle
    and no branching; then the nearest loose ends of the fragments are joined
    the same way, round after round.  O(n log n).
    """
    n = g.size
    links = np.full((n, 2), -1, np.int32)
    root = np.arange(n, dtype=np.int32)
    a, k = np.nonzero(g.mates >= 0)
    link(links, root, a.astype(np.int64), g.mates[a, k].astype(np.int64))
    u = np.repeat(np.arange(n), g.near.shape[1])
    v, cost = g.near.ravel().astype(np.int64), g.dist.ravel().astype(np.float64)
    if noise is not None:
        cost *= noise.uniform(1, 1 + BLUR, cost.size)
    real = u < v
    real |= (g.near[v] != u[:, None]).all(axis=1) & (u != v)
    _link_by_cost(links, root, u[real], v[real], cost[real])
    while True:
        loose = _loose_ends(g, links)
        if loose.size <= 2:
            return _walk(links)
        _link_by_cost(links, root, *_joints(g, loose, root))


def curve(g: Ground) -> Small:
    """The nodes along the Hilbert curve (their numbering), forced edges put in."""
    return with_forced(g, np.arange(g.size, dtype=np.int32))


def with_forced(g: Ground, order: Small) -> Small:
    """The order with every chain of forced edges made contiguous, where its first node stands.

    A cyclic order that has all forced edges stays as it is.
    """
    order = order.astype(np.int32)
    node, k = np.nonzero(g.mates >= 0)
    place = np.empty_like(order)
    place[order] = np.arange(order.size, dtype=np.int32)
    apart = np.abs(place[node] - place[g.mates[node, k]])
    if np.isin(apart, (1, order.size - 1)).all():
        return order
    return _with_forced(g.mates, order)


def _link_by_cost(links: Small, root: Small, u: Ints, v: Ints, cost: NDArray[Any]) -> None:
    rank = np.argsort(cost, kind="stable")
    link(links, root, u[rank], v[rank])


def _loose_ends(g: Ground, links: Small) -> Ints:
    """Nodes that still want links, without a virtual node that any fragment end can reach."""
    loose = np.nonzero(links[:, 1] < 0)[0]
    return loose[loose != g.virtual]


def _joints(g: Ground, loose: Ints, root: Small) -> tuple[Ints, Ints, Ints]:
    """Edges between near loose ends of different fragments."""
    look = min(FEW, loose.size)
    if g.rule[MATRIX] or loose.size <= 2 * FEW:
        found = np.tile(np.arange(loose.size), (loose.size, 1))
    else:
        from scipy.spatial import cKDTree

        where, p = points(g, loose)
        found = cKDTree(where).query(where, look, p=p)[1]
    u, v = np.repeat(loose, found.shape[1]), loose[found.ravel()]
    apart = _roots(root, u) != _roots(root, v)
    if not apart.any():  # every near loose end belongs to the same fragment: look everywhere
        ends = _roots(root, loose)
        first = loose[ends == ends[0]]
        rest = loose[ends != ends[0]]
        u, v = np.repeat(first, rest.size), np.tile(rest, first.size)
    else:
        u, v = u[apart], v[apart]
    return u, v, prices(g.costs, u, v)


@inner
def _root(root: Any, v: int) -> int:
    while root[v] != v:
        root[v] = root[root[v]]
        v = root[v]
    return v


@allocating
def _roots(root: Any, nodes: Any) -> Any:
    found = np.empty(nodes.size, np.int64)
    for k in range(nodes.size):
        found[k] = _root(root, nodes[k])
    return found


@compiled
def link(links: Any, root: Any, u: Any, v: Any) -> None:
    """Link the pairs in turn unless a node has two links or a cycle would close."""
    for k in range(u.size):
        a, b = u[k], v[k]
        if links[a, 1] >= 0 or links[b, 1] >= 0:
            continue
        ra, rb = _root(root, a), _root(root, b)
        if ra == rb:
            continue
        root[ra] = rb
        links[a, 0 if links[a, 0] < 0 else 1] = b
        links[b, 0 if links[b, 0] < 0 else 1] = a


@allocating
def _walk(links: Any) -> Any:
    """The order of nodes along the one path that is left (a lone virtual node comes last)."""
    n = links.shape[0]
    order = np.empty(n, np.int32)
    start, lone = -1, -1
    for v in range(n):
        if links[v, 0] < 0:
            lone = v
        elif links[v, 1] < 0 and start < 0:
            start = v
    count, last, v = 0, -1, start
    if start < 0:
        v = 0
    while v >= 0 and count < n:
        order[count] = v
        count += 1
        if links[v, 0] >= 0 and links[v, 0] != last:
            last, v = v, links[v, 0]
        elif links[v, 1] >= 0 and links[v, 1] != last:
            last, v = v, links[v, 1]
        else:
            v = -1
    if lone >= 0 and count < n:
        order[count] = lone
    return order


@allocating
def _with_forced(mates: Any, order: Any) -> Any:
    n = order.size
    out = np.empty(n, np.int32)
    done = np.empty(n, np.bool_)
    for v in range(n):
        done[v] = False
    count = 0
    for v in order:
        if done[v]:
            continue
        last, end = -1, v  # walk to one end of v's chain, unless v is one ...
        while mates[v, 1] >= 0:
            step = mates[end, 0] if mates[end, 0] != last else mates[end, 1]
            if step < 0 or step == v:
                break
            last, end = end, step
        last, u = -1, end  # ... and write it from there
        while u >= 0 and not done[u]:
            done[u] = True
            out[count] = u
            count += 1
            step = mates[u, 0] if mates[u, 0] != last else mates[u, 1]
            last, u = u, step
    return out
