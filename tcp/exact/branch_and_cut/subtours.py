"""Violated subtour cuts: components, intervals of a tour, exact minimum cuts.

The exact search contracts edges of value 1, and every node with a neighbour to
which half of its degree leads: it may as well be on that neighbour's side of a
cut (Padberg and Rinaldi 1990).  Where that ends it follows Nagamochi and Ibaraki
(1992): a maximum-adjacency order certifies many pairs as 2-connected at once;
those are contracted, and whatever is cut off by less than 2 on the way is a
violated cut.
"""

from __future__ import annotations

import heapq

import numpy as np

from tcp.exact.branch_and_cut.cuts import Cut, adjacency_lists, smaller_side
from tcp.exact.branch_and_cut.proof import Floats
from tcp.exact.branch_and_cut.support import Support, components, find, groups
from tcp.jit import kernel, lean
from tcp.travel import Ints

VIOLATION = 1e-4
"""A cut must be violated by this much to be worth a row."""


def component_cuts(support: Support) -> list[Cut]:
    """One cut for every component of the support graph; none if it is connected."""
    label = components(support.size, support.i, support.j)
    if label.max() == 0:
        return []
    return [Cut.of([smaller_side(nodes, support.size)]) for nodes in groups(label)]


def interval_cuts(support: Support, tour: Ints, longest: int = 2000) -> list[Cut]:
    """For every tour position the most violated interval that ends there.

    Parameters
    ----------
    support : Support
        The LP solution.
    tour : int64 array
        All nodes in cyclic order; a good tour makes intervals tight.
    longest : int
        Longest interval examined.
    """
    position = np.empty(support.size, np.int64)
    position[tour] = np.arange(support.size)
    value, start = _intervals(
        position, tour, support.ptr, support.other, support.weight, min(longest, support.size - 1)
    )
    return [
        Cut.of([smaller_side(tour[start[end] : end + 1], support.size)])
        for end in np.nonzero(value < 2.0 - VIOLATION)[0]
    ]


@kernel
def _intervals(
    position: Ints, tour: Ints, ptr: Ints, other: Ints, weight: Floats, longest: int
) -> tuple[Floats, Ints]:
    """Least x(delta([a..b])) over starts a, for every end b, by a sweep over b."""
    size = len(tour)
    delta = np.zeros(size)
    best = np.full(size, np.inf)
    start = np.zeros(size, np.int64)
    for b in range(size):
        low = max(0, b - longest + 1)
        for a in range(low, b + 1):
            delta[a] += 2.0
        v = tour[b]
        for e in range(ptr[v], ptr[v + 1]):
            before = position[other[e]]
            if before < b:
                for a in range(low, before + 1):
                    delta[a] -= 2.0 * weight[e]
        for a in range(low, b):
            if delta[a] < best[b] and b - a + 1 < size:
                best[b] = delta[a]
                start[b] = a
    return best, start


def minimum_cuts(support: Support) -> list[Cut]:
    """All cuts below 2 that contraction meets; empty only if there is no such cut.

    Exact up to :data:`VIOLATION` (see the module's docstring).
    """
    root = np.arange(support.size)
    found = _contract(support.size, support.i, support.j, support.x, root, 2.0 - VIOLATION)
    seen: dict[bytes, Cut] = {}
    for label in found:
        nodes = np.nonzero(label)[0]
        if 2 <= len(nodes) <= support.size - 2:
            cut = Cut.of([smaller_side(nodes, support.size)])
            seen[cut.key] = cut
    return list(seen.values())


@kernel
def _contract(size: int, i: Ints, j: Ints, x: Floats, root: Ints, limit: float) -> list[np.ndarray]:
    found = [np.zeros(size, np.bool_)]
    for k in range(len(x)):
        if x[k] >= 1.0 - 1e-9:
            root[find(root, i[k])] = find(root, j[k])
    while True:
        name = np.full(size, -1, np.int64)
        count = np.int64(0)  # a literal 0 would compile what takes it a second time
        for v in range(size):
            r = find(root, v)
            if name[r] < 0:
                name[r] = count
                count += 1
        if count <= 1:
            return found[1:]
        representative = np.empty(count, np.int64)
        for v in range(size):
            if root[v] == v:
                representative[name[v]] = v
        p, q, w = _merged(count, name, root, i, j, x)
        ptr, other, edge = adjacency_lists(p, q, count)
        _note_degrees(size, count, ptr, edge, w, root, representative, limit, found)
        if _contract_dominated(count, ptr, other, edge, w, root, representative):
            continue
        _phase(size, count, ptr, other, edge, w, root, representative, limit, found)


@kernel
def _merged(
    count: int, name: Ints, root: Ints, i: Ints, j: Ints, x: Floats
) -> tuple[Ints, Ints, Floats]:
    """Edges between contracted nodes, parallel ones added up."""
    a, b, value = np.empty(len(x), np.int64), np.empty(len(x), np.int64), np.empty(len(x))
    used = 0
    for k in range(len(x)):
        a[used], b[used], value[used] = name[find(root, i[k])], name[find(root, j[k])], x[k]
        used += a[used] != b[used]
    ptr, other, edge = adjacency_lists(a[:used], b[:used], count)
    p, q, w = np.empty(used, np.int64), np.empty(used, np.int64), np.empty(used)
    at = np.full(count, -1, np.int64)  # the edge that leads to a node
    filled = np.int64(0)
    for u in range(count):
        first = filled
        for e in range(ptr[u], ptr[u + 1]):
            v = other[e]
            if v < u:
                continue
            if at[v] < first:
                at[v] = filled
                p[filled], q[filled], w[filled] = u, v, 0.0
                filled += 1
            w[at[v]] += value[edge[e]]
    return p[:filled], q[:filled], w[:filled]


@kernel
def _members(size: int, root: Ints, r: int) -> np.ndarray:
    inside = np.zeros(size, np.bool_)
    for v in range(size):
        inside[v] = find(root, v) == r
    return inside


@kernel
def _note_degrees(
    size: int,
    count: int,
    ptr: Ints,
    edge: Ints,
    w: Floats,
    root: Ints,
    representative: Ints,
    limit: float,
    found: list[np.ndarray],
) -> None:
    for v in range(count):
        degree = 0.0
        for e in range(ptr[v], ptr[v + 1]):
            degree += w[edge[e]]
        if degree < limit:
            found.append(_members(size, root, representative[v]))


@lean
def _contract_dominated(
    count: int, ptr: Ints, other: Ints, edge: Ints, w: Floats, root: Ints, representative: Ints
) -> bool:
    """Contract every node with a neighbour to which half of its degree leads; whether any was.

    All at once: put the nodes of a cut on their neighbours' sides in turn, the
    last neighbour of each chain first; no move makes the cut heavier.
    """
    any_ = False
    for v in range(count):
        degree, most, at = 0.0, 0.0, -1
        for e in range(ptr[v], ptr[v + 1]):
            degree += w[edge[e]]
            if w[edge[e]] > most:
                most, at = w[edge[e]], other[e]
        if 2.0 * most >= degree - 1e-9 and at >= 0:
            a, b = find(root, representative[v]), find(root, representative[at])
            if a != b:
                root[max(a, b)] = min(a, b)
                any_ = True
    return any_


@kernel
def _phase(
    size: int,
    count: int,
    ptr: Ints,
    other: Ints,
    edge: Ints,
    w: Floats,
    root: Ints,
    representative: Ints,
    limit: float,
    found: list[np.ndarray],
) -> None:
    """One maximum-adjacency order; contracts its certified pairs and its last two nodes."""
    reach = np.zeros(count)
    done = np.zeros(count, np.bool_)
    heap = [(0.0, 0)]
    before, last = -1, -1
    for _ in range(count):
        v = -1
        while len(heap) > 0:
            value, u = heapq.heappop(heap)
            if not done[u] and -value >= reach[u]:
                v = u
                break
        if v < 0:
            for u in range(count):
                if not done[u]:
                    v = u
                    break
        done[v] = True
        before, last = last, v
        for e in range(ptr[v], ptr[v + 1]):
            u = other[e]
            if done[u]:
                continue
            reach[u] += w[edge[e]]
            if reach[u] >= 2.0 - 1e-9:
                a, b = find(root, representative[u]), find(root, representative[v])
                if a != b:
                    root[max(a, b)] = min(a, b)
            heapq.heappush(heap, (-reach[u], u))
    if reach[last] < limit:
        found.append(_members(size, root, representative[last]))
    a, b = find(root, representative[last]), find(root, representative[before])
    if a != b:
        root[max(a, b)] = min(a, b)
