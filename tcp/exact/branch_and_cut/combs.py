"""Violated combs: handles from the fractional graph, teeth by a dynamic programme.

Given a handle H, the best teeth among the intervals of a good tour follow
from a programme over tour positions with the parity of the number of teeth as
state: f(b, parity) = least sum of (x(delta(T)) - 3) over disjoint intervals up
to position b, each with nodes inside and outside H.  The comb is violated if
f(n, odd) + x(delta(H)) < 1.  All tooth sizes compete, so blossoms (teeth of two
nodes) are contained.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tcp.exact.branch_and_cut.cuts import Cut, adjacency_lists, smaller_side
from tcp.exact.branch_and_cut.proof import Floats
from tcp.exact.branch_and_cut.support import Support, components, groups
from tcp.travel import Ints

VIOLATION = 0.02
"""A comb must be violated by this much to be worth a row."""

LONGEST = 60
"""Longest tooth, in nodes."""

LIGHT = 3.0
"""Only intervals with x(delta(T)) below this are teeth: others cannot help but by parity."""

THRESHOLDS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
"""Handles are components of the edges with threshold < x < 1, and of their blocks."""

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Teeth:
    """All light intervals of a tour, grouped by their last position.

    ``start[ptr[b]:ptr[b+1]]`` are the first positions of those that end at
    position b, ``weight`` their x(delta(T)) - 3.
    """

    tour: Ints
    position: Ints
    ptr: Ints
    start: Ints
    weight: Floats

    @classmethod
    def of(
        cls, support: Support, tour: Ints, longest: int = LONGEST, light: float = LIGHT
    ) -> Teeth:
        """The light intervals of a tour under an LP solution."""
        position = np.empty(support.size, np.int64)
        position[tour] = np.arange(support.size)
        longest = min(longest, support.size - 2)
        ptr, start, weight = _light(
            position, tour, support.ptr, support.other, support.weight, longest, light
        )
        return cls(tour, position, ptr, start, weight)


@njit(cache=True)
def _light(
    position: Ints,
    tour: Ints,
    ptr: Ints,
    other: Ints,
    weight: Floats,
    longest: int,
    light: float,
) -> tuple[Ints, Ints, Floats]:
    size = len(tour)
    delta = np.zeros(size)
    start = np.empty(1024, np.int64)
    value = np.empty(1024)
    ends = np.zeros(size + 1, np.int64)
    filled = 0
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
        for a in range(b - 1, low - 1, -1):
            if delta[a] < light - 1e-9:
                if filled == len(start):
                    start = np.concatenate((start, np.empty_like(start)))
                    value = np.concatenate((value, np.empty_like(value)))
                start[filled], value[filled] = a, delta[a] - 3.0
                filled += 1
        ends[b + 1] = filled
    return ends, start[:filled], value[:filled]


@njit(cache=True)
def best_teeth(
    inside: Flags, ptr: Ints, start: Ints, weight: Floats, longest: int
) -> tuple[float, Ints]:
    """Lightest odd family of disjoint crossing intervals; (sum, indices of the intervals).

    ``inside[p]`` tells whether the node at tour position p is in the handle.
    """
    size = len(inside)
    count = np.zeros(size + 1, np.int64)
    for p in range(size):
        count[p + 1] = count[p] + inside[p]
    best = np.full((size + 1, 2), np.inf)
    best[0, 0] = 0.0
    chosen = np.full((size + 1, 2), -1, np.int64)
    since_switch = longest
    for b in range(size):
        best[b + 1] = best[b]
        since_switch += 1
        if b > 0 and inside[b] != inside[b - 1]:
            since_switch = 1
        if since_switch >= longest:
            continue
        for t in range(ptr[b], ptr[b + 1]):
            a = start[t]
            held = count[b + 1] - count[a]
            if held == 0 or held == b - a + 1:
                continue
            w = weight[t]
            if best[a, 0] + w < best[b + 1, 1]:
                best[b + 1, 1] = best[a, 0] + w
                chosen[b + 1, 1] = t
            if best[a, 1] + w < best[b + 1, 0]:
                best[b + 1, 0] = best[a, 1] + w
                chosen[b + 1, 0] = t
    picked = np.empty(size, np.int64)
    used, b, parity = 0, size, 1
    if not np.isfinite(best[size, 1]):
        return np.inf, picked[:0]
    while b > 0:
        t = chosen[b, parity]
        if t < 0 or best[b, parity] == best[b - 1, parity]:
            b -= 1
            continue
        picked[used] = t
        used += 1
        b = start[t]
        parity = 1 - parity
    return best[size, 1], picked[:used]


def comb_cuts(support: Support, tour: Ints, handles: Iterable[Ints]) -> list[tuple[float, Cut]]:
    """The most violated comb of every handle, with its violation, most violated first."""
    teeth = Teeth.of(support, tour)
    found: dict[bytes, tuple[float, Cut]] = {}
    for nodes in handles:
        comb = comb_of(support, teeth, nodes)
        if comb is not None:
            found[comb[1].key] = comb
    return sorted(found.values(), key=lambda item: -item[0])


def comb_of(support: Support, teeth: Teeth, nodes: Ints) -> tuple[float, Cut] | None:
    """The most violated comb with this handle, with its violation; None if none is violated."""
    member = np.zeros(support.size, np.bool_)
    member[nodes] = True
    crossing = member[support.i] != member[support.j]
    delta = float(support.x[crossing].sum())
    value, picked = best_teeth(
        member[teeth.tour], teeth.ptr, teeth.start, teeth.weight, LONGEST
    )
    violation = 1.0 - value - delta
    if violation < VIOLATION or len(picked) < 3:
        return None
    ends = np.searchsorted(teeth.ptr, picked, side="right") - 1
    sets = [teeth.tour[teeth.start[t] : b + 1] for t, b in zip(picked, ends, strict=True)]
    return violation, Cut.of([smaller_side(nodes, support.size), *sets])


def fractional_handles(support: Support) -> list[Ints]:
    """Candidate handles: components of the fractional graph at several thresholds, and blocks."""
    found: dict[bytes, Ints] = {}
    for threshold in THRESHOLDS:
        part = (support.x > threshold + 1e-6) & (support.x < 1.0 - 1e-6)
        _collect(found, support, groups(components(support.size, support.i[part], support.j[part])))
        light = (support.x > 1e-6) & (support.x < 1.0 - threshold - 1e-6)
        _collect(
            found, support, groups(components(support.size, support.i[light], support.j[light]))
        )
    part = (support.x > 1e-6) & (support.x < 1.0 - 1e-6)
    _collect(found, support, blocks(support.size, support.i[part], support.j[part]))
    _collect(found, support, blocks(support.size, support.i, support.j))
    return list(found.values())


def _collect(found: dict[bytes, Ints], support: Support, candidates: Iterable[Ints]) -> None:
    for nodes in candidates:
        if 3 <= len(nodes) <= support.size - 3:
            handle = smaller_side(nodes, support.size)
            found[handle.astype(np.int32).tobytes()] = handle


def blocks(size: int, i: Ints, j: Ints) -> list[Ints]:
    """Biconnected components with at least three nodes."""
    ptr, other, edge = adjacency_lists(i, j, size)
    label = _block_of_edge(size, len(i), ptr, other, edge)
    order = np.argsort(label, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(label))[:-1]) if len(label) else []
    nodes = [np.unique(np.concatenate((i[part], j[part]))) for part in parts]
    return [n for n in nodes if len(n) >= 3]


@njit(cache=True)
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
