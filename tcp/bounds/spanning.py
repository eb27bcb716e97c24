"""Exact minimum spanning trees over all pairs of nodes, under integer node potentials.

The weight of a pair is ``scale * cost - p[i] - p[j]``.  No list of near neighbours is exact here,
because a large potential reaches far.  Boruvka's rounds over a k-d tree are: a cell of the tree
cannot hold a better partner than ``scale * cost(nearest corner) - p[i] - largest potential in it``,
which is an exact integer bound because every travel model's cost grows with |dx| and with |dy|.
Memory is O(n); J. L. Bentley and J. H. Friedman, "Fast algorithms for constructing minimal
spanning trees in coordinate spaces", IEEE Trans. Computers C-27 (1978), adapted to potentials.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tcp.jit import kernel, lean
from tcp.kernels import cost_of_move
from tcp.travel import Ints

BUCKET = 6
"""Most points in a leaf of the k-d tree."""

HUGE = np.int64(2**62)


class Cells(NamedTuple):
    """A k-d tree as arrays: cell k holds ``order[first[k] : last[k]]``, children 2k+1 and 2k+2.

    ``box`` has rows (x least, x most, y least, y most).
    """

    order: Ints
    first: Ints
    last: Ints
    box: Ints


def cells(x: Ints, y: Ints) -> Cells:
    """The k-d tree of some points (int64 arrays of one length)."""
    depth = 0
    while x.size > BUCKET << depth:
        depth += 1
    count = 2 ** (depth + 1) - 1
    first, last = np.zeros(count, np.int64), np.zeros(count, np.int64)
    box, order = np.zeros((count, 4), np.int64), np.arange(x.size)
    last[0] = x.size
    _split(x, y, order, first, last, box)
    return Cells(order, first, last, box)


@kernel
def _split(x: Ints, y: Ints, order: Ints, first: Ints, last: Ints, box: Any) -> None:
    for k in range(first.size):
        a, b = first[k], last[k]
        mine = order[a:b]
        box[k, 0], box[k, 1] = x[mine].min(), x[mine].max()
        box[k, 2], box[k, 3] = y[mine].min(), y[mine].max()
        if 2 * k + 2 < first.size:
            wide = box[k, 1] - box[k, 0] >= box[k, 3] - box[k, 2]
            order[a:b] = mine[np.argsort(x[mine] if wide else y[mine])]
            middle = (a + b) // 2
            first[2 * k + 1], last[2 * k + 1] = a, middle
            first[2 * k + 2], last[2 * k + 2] = middle, b


@lean
def _root(up: Ints, i: int) -> int:
    while up[i] != i:
        up[i] = up[up[i]]
        i = up[i]
    return i


@lean
def _join(up: Ints, i: int, j: int) -> bool:
    """Unite the components of two nodes; False if they are one already."""
    a, b = _root(up, i), _root(up, j)
    if a == b:
        return False
    up[max(a, b)] = min(a, b)
    return True


@lean
def _summarise(
    first: Ints, last: Ints, order: Ints, value: Ints, group: Ints, top: Ints, own: Ints
) -> None:
    """Largest potential in every cell, and its component (-1 for several)."""
    for k in range(first.size - 1, -1, -1):
        if 2 * k + 2 < first.size:
            a, b = 2 * k + 1, 2 * k + 2
            top[k] = max(top[a], top[b])
            own[k] = own[a] if own[a] == own[b] else -1
        else:
            top[k], own[k] = -HUGE, group[order[first[k]]]
            for at in range(first[k], last[k]):
                top[k] = max(top[k], value[order[at]])
                if group[order[at]] != own[k]:
                    own[k] = -1


@lean
def _nearest(
    i: int, best: int, rule: Ints, scale: int, x: Ints, y: Ints, value: Ints, group: Ints,
    first: Ints, last: Ints, order: Ints, box: Any, top: Ints, own: Ints, stack: Ints, bans: Ints,
) -> tuple[int, int]:  # fmt: skip
    """Lightest pair from ``i`` into another component that is lighter than ``best``; -1 if none."""
    found, depth = -1, 1
    stack[0] = 0
    while depth > 0:
        depth -= 1
        k = stack[depth]
        if own[k] == group[i] or _reach(i, k, rule, scale, x, y, value, box, top) >= best:
            continue
        if 2 * k + 2 < first.size:
            a, b = 2 * k + 1, 2 * k + 2
            near = _reach(i, a, rule, scale, x, y, value, box, top)
            if near <= _reach(i, b, rule, scale, x, y, value, box, top):
                a, b = b, a
            stack[depth], stack[depth + 1] = a, b
            depth += 2
            continue
        for at in range(first[k], last[k]):
            j = order[at]
            if group[j] == group[i]:
                continue
            w = scale * cost_of_move(rule, x[i] - x[j], y[i] - y[j]) - value[i] - value[j]
            if w < best and not _banned(bans, min(i, j) * x.size + max(i, j)):
                best, found = w, j
    return best, found


@lean
def _reach(
    i: int, k: int, rule: Ints, scale: int, x: Ints, y: Ints, value: Ints, box: Any, top: Ints
) -> int:
    """No pair of ``i`` with a node of cell ``k`` weighs less."""
    dx = max(box[k, 0] - x[i], x[i] - box[k, 1], 0)
    dy = max(box[k, 2] - y[i], y[i] - box[k, 3], 0)
    return scale * cost_of_move(rule, dx, dy) - value[i] - top[k]


@lean
def _banned(bans: Ints, key: int) -> bool:
    at = np.searchsorted(bans, key)
    return at < bans.size and bans[at] == key


@kernel
def boruvka(
    rule: Ints, scale: int, x: Ints, y: Ints, value: Ints, forced: Any, bans: Ints,
    order: Ints, first: Ints, last: Ints, box: Any,
) -> Any:  # fmt: skip
    """Edges of a minimum spanning tree over all pairs, those of ``forced`` first.

    Any choice among ties is right: an edge that is the lightest to leave a component may be
    added as long as it joins two components that are still apart.

    Parameters
    ----------
    rule : int64 array
        Packed cost rule; see :func:`tcp.kernels.pack`.
    scale : int
        Weight of the costs.
    x, y, value : int64 arrays of shape (n,)
        Coordinates and potentials.
    forced : int64 array of shape (f, 2)
        Pairs that the tree has to contain.
    bans : int64 array, ascending
        Keys ``min * n + max`` of pairs that it must not contain.
    order, first, last, box
        The k-d tree of the points.

    Returns
    -------
    int64 array of shape (m, 2)
        m = n - 1 unless the bans leave the nodes disconnected.
    """
    n = x.size
    up, group = np.arange(n), np.arange(n)
    edges, m = np.empty((max(n - 1, 0), 2), np.int64), 0
    for f in range(forced.shape[0]):
        if _join(up, forced[f, 0], forced[f, 1]):
            edges[m, 0], edges[m, 1] = forced[f, 0], forced[f, 1]
            m += 1
    top, own = np.empty(first.size, np.int64), np.empty(first.size, np.int64)
    best, source, target = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    stack = np.empty(256, np.int64)
    grown = True
    while m < n - 1 and grown:
        for i in range(n):
            group[i] = _root(up, i)
            best[i], target[i] = HUGE, -1
        _summarise(first, last, order, value, group, top, own)
        for at in range(n):
            i = order[at]
            g = group[i]
            w, j = _nearest(
                i, best[g], rule, scale, x, y, value, group, first, last, order, box, top, own,
                stack, bans,
            )  # fmt: skip
            if j >= 0:
                best[g], source[g], target[g] = w, i, j
        grown = False
        for g in range(n):
            if target[g] >= 0 and _join(up, source[g], target[g]):
                edges[m, 0], edges[m, 1] = source[g], target[g]
                m, grown = m + 1, True
    return edges[:m]


@kernel
def prim(weights: Any, forced: Any) -> Any:
    """Edges of a minimum spanning tree of a full int64 matrix; ``forced`` pairs are in it."""
    n = weights.shape[0]
    work = weights.copy()
    for f in range(forced.shape[0]):
        i, j = forced[f]
        work[i, j] = work[j, i] = -HUGE
    near, best = np.zeros(n, np.int64), np.full(n, HUGE)
    inside = np.zeros(n, np.bool_)
    edges = np.empty((max(n - 1, 0), 2), np.int64)
    at = 0
    for m in range(n - 1):
        inside[at] = True
        for j in range(n):
            if not inside[j] and work[at, j] < best[j]:
                best[j], near[j] = work[at, j], at
        at = -1
        for j in range(n):
            if not inside[j] and (at < 0 or best[j] < best[at]):
                at = j
        edges[m, 0], edges[m, 1] = near[at], at
    return edges


@kernel
def kruskal(n: int, ends: Any, sequence: Ints, free: int) -> tuple[Ints, Ints]:
    """A spanning tree from pairs in the given sequence: indices of its pairs, degrees.

    The first ``free`` pairs of ``ends`` are forced: they come before all others.
    """
    up, degree = np.empty(n, np.int64), np.empty(n, np.int64)
    for i in range(n):
        up[i], degree[i] = i, 0
    chosen, m = np.empty(max(n - 1, 0), np.int64), 0
    for turn in range(2):
        for e in range(free) if turn == 0 else range(sequence.size):
            k = e if turn == 0 else sequence[e]
            i, j = ends[k, 0], ends[k, 1]
            if m < n - 1 and _join(up, i, j):
                chosen[m] = k
                m += 1
                degree[i] += 1
                degree[j] += 1
    return chosen[:m], degree
