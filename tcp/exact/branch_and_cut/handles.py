"""Candidate handles of combs, from the fractional part of an LP solution."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from tcp.exact.branch_and_cut.cuts import adjacency_lists, smaller_side
from tcp.exact.branch_and_cut.support import Support, components, groups
from tcp.jit import kernel
from tcp.travel import Ints

THRESHOLDS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
"""Handles are components of the edges with threshold < x < 1, and of their blocks."""


def fractional_handles(support: Support) -> list[Ints]:
    """Candidate handles: components of the fractional graph at several thresholds, and blocks."""
    found: dict[bytes, Ints] = {}
    for threshold in THRESHOLDS:
        part = (support.x > threshold + 1e-6) & (support.x < 1.0 - 1e-6)
        heavy = components(support.size, support.i[part], support.j[part])
        _collect(found, support, groups(heavy, 3))
        light = (support.x > 1e-6) & (support.x < 1.0 - threshold - 1e-6)
        near = components(support.size, support.i[light], support.j[light])
        _collect(found, support, groups(near, 3))
    part = (support.x > 1e-6) & (support.x < 1.0 - 1e-6)
    _collect(found, support, blocks(support.size, support.i[part], support.j[part]))
    _collect(found, support, blocks(support.size, support.i, support.j))
    return list(found.values())


def _collect(found: dict[bytes, Ints], support: Support, candidates: Iterable[Ints]) -> None:
    """Note sets of ascending nodes, or their complements."""
    for nodes in candidates:
        if 3 <= len(nodes) <= support.size - 3:
            handle = nodes if 2 * len(nodes) <= support.size else smaller_side(nodes, support.size)
            found[handle.tobytes()] = handle


def blocks(size: int, i: Ints, j: Ints) -> list[Ints]:
    """Biconnected components with at least three nodes."""
    ptr, other, edge = adjacency_lists(i, j, size)
    label = _block_of_edge(size, len(i), ptr, other, edge)
    block, node = np.divmod(np.unique(np.concatenate((label * size + i, label * size + j))), size)
    ends = np.cumsum(np.bincount(block)) if len(block) else block
    starts = ends - np.bincount(block) if len(block) else block
    return [node[a:b] for a, b in zip(starts, ends, strict=True) if b - a >= 3]


@kernel
def _block_of_edge(size: int, edges: int, ptr: Ints, other: Ints, edge: Ints) -> Ints:
    """The biconnected component of every edge (Hopcroft and Tarjan 1973, without recursion)."""
    label = np.full(edges, -1, np.int64)
    order = np.zeros(size, np.int64)
    low = np.zeros(size, np.int64)
    at = ptr[:-1].copy()
    parent_edge = np.full(size, -1, np.int64)
    path = np.empty(size, np.int64)
    waiting = np.empty(edges, np.int64)
    clock, count, pending = 0, 0, 0
    for root in range(size):
        if order[root] != 0:
            continue
        depth = 0
        path[0] = root
        clock += 1
        order[root] = low[root] = clock
        while depth >= 0:
            v = path[depth]
            if at[v] < ptr[v + 1]:
                e, u = edge[at[v]], other[at[v]]
                at[v] += 1
                if e == parent_edge[v]:
                    continue
                if order[u] == 0:
                    waiting[pending] = e
                    pending += 1
                    parent_edge[u] = e
                    clock += 1
                    order[u] = low[u] = clock
                    depth += 1
                    path[depth] = u
                elif order[u] < order[v]:
                    waiting[pending] = e
                    pending += 1
                    low[v] = min(low[v], order[u])
                continue
            depth -= 1
            if depth >= 0:
                u = path[depth]
                low[u] = min(low[u], low[v])
                if low[v] >= order[u]:
                    while True:
                        pending -= 1
                        label[waiting[pending]] = count
                        if waiting[pending] == parent_edge[v]:
                            break
                    count += 1
    return label
