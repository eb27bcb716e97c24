"""Two tours into a better one: alternating cycles of edges, each applied where it gains.

The edges that only one of two tours A and B has form cycles that take an edge
of A and one of B in turn (AB-cycles; Nagata and Kobayashi 2013).  Exchanging
along one of them turns A into a tour or into several; here a cycle is applied
to A if it gains and leaves one tour, alone or together with a second one that
lies next to it.  What A and B agree on is never touched: as in partition
crossover (Whitley, Hains and Howe 2009) the child takes the better of every
part that can be told apart.  O(n) for the cycles, O(k log k) to try one of k
exchanges.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tcp.heuristics.local_search.compiled import allocating
from tcp.heuristics.local_search.exchange import apply, keep
from tcp.heuristics.local_search.ground import price

PARTNERS = 8
"""With how many cycles on either side (in order of discovery) a cycle is tried together."""


@allocating
def merge(g: Any, t: Any, other: Any) -> int:
    """Improve tour ``t`` with what the order ``other`` does better; returns the gain."""
    nodes, starts, count = ab_cycles(t.order, t.pos, other)
    gains = np.empty(count, np.int64)
    for c in range(count):
        gains[c] = _gain(g, nodes, starts[c], starts[c + 1])
    ends = np.full((t.order.size, 2), -1, np.int64)
    total = np.int64(0)
    open_ = np.ones(count, np.bool_)
    again = True
    while again:
        again = False
        for c in range(count):
            if open_[c] and gains[c] > 0 and _exchange(t, ends, nodes, starts, c, c):
                total += gains[c]
                open_[c] = False
                again = True
        for c in range(count):
            for d in range(c + 1, min(count, c + 1 + PARTNERS)):
                both = open_[c] and open_[d] and gains[c] + gains[d] > 0
                if both and _exchange(t, ends, nodes, starts, c, d):
                    total += gains[c] + gains[d]
                    open_[c] = open_[d] = False
                    again = True
    keep(t)
    return total


@allocating
def ab_cycles(order: Any, pos: Any, other: Any) -> Any:
    """All AB-cycles: nodes one cycle after another, where each starts, and how many there are.

    Within a cycle the edges node 0 - node 1, node 2 - node 3 ... belong to
    ``order`` alone, the ones between to ``other`` alone.
    """
    n = order.size
    links = np.full((2, n, 2), -1, np.int32)
    place = np.empty(n, np.int64)
    for i in range(n):
        place[other[i]] = i
    for i in range(n):
        u, v = order[i], order[(i + 1) % n]
        if abs(place[u] - place[v]) not in (1, n - 1):
            _add(links[0], u, v)
        u, v = other[i], other[(i + 1) % n]
        if abs(np.int64(pos[u]) - pos[v]) not in (1, n - 1):
            _add(links[1], u, v)
    nodes = np.empty(4 * n + 4, np.int32)
    starts = np.zeros(n + 2, np.int64)
    path = np.empty(4 * n + 4, np.int32)
    at = np.full((n, 2), -1, np.int64)
    count, used = 0, 0
    for start in range(n):
        while links[0, start, 0] >= 0 or links[0, start, 1] >= 0:
            size = 0
            v = start
            while True:
                first = at[v, size % 2]
                if first >= 0:
                    shift = first % 2
                    for i in range(size - first):
                        nodes[used + i] = path[first + (i + shift) % (size - first)]
                    for i in range(first, size):
                        at[path[i], i % 2] = -1
                    used += size - first
                    count += 1
                    starts[count] = used
                    size = first
                    v = path[first]
                    if size == 0:
                        break
                at[v, size % 2] = size
                path[size] = v
                v = _take(links[size % 2], v)
                size += 1
    return nodes, starts, count


@allocating
def _add(links: Any, u: int, v: int) -> None:
    links[u, 0 if links[u, 0] < 0 else 1] = v
    links[v, 0 if links[v, 0] < 0 else 1] = u


@allocating
def _take(links: Any, u: int) -> int:
    """Walk along an edge of u that is left, and strike it off."""
    k = 0 if links[u, 0] >= 0 else 1
    v = links[u, k]
    links[u, k] = -1
    links[v, 0 if links[v, 0] == u else 1] = -1
    return v


@allocating
def _gain(g: Any, nodes: Any, low: int, high: int) -> int:
    gain = np.int64(0)
    for i in range(low, high):
        c = price(g, nodes[i], nodes[i + 1 if i + 1 < high else low])
        gain += c if (i - low) % 2 == 0 else -c
    return gain


@allocating
def _exchange(t: Any, ends: Any, nodes: Any, starts: Any, c: int, d: int) -> bool:
    """Exchange along cycle c, and d if it is another one, if that leaves a single tour."""
    n = t.order.size
    some = nodes[starts[c] : starts[c + 1]]
    if d != c:
        some = np.concatenate((some, nodes[starts[d] : starts[d + 1]]))
    k = some.size // 2
    cuts = np.empty(k, np.int64)  # place before each edge that goes
    for i in range(k):
        p, q = np.int64(t.pos[some[2 * i]]), np.int64(t.pos[some[2 * i + 1]])
        cuts[i] = p if (p + 1 - q) % n == 0 else q
    cuts.sort()
    base = cuts[0] + 1  # segment i: linear places cuts[i] + 1 - base .. cuts[i + 1] - base
    for i in range(k):
        ends[t.order[(cuts[i] + 1) % n], 0] = 2 * i
        ends[t.order[cuts[(i + 1) % k]], 1] = 2 * i + 1
    link = np.empty(2 * k, np.int64)
    second = starts[c + 1] - starts[c]
    for i in range(1, 2 * k, 2):
        last = second if i < second else 2 * k
        first = 0 if i < second else second
        a = _end(ends, some[i])
        b = _end(ends, some[i + 1 if i + 1 < last else first])
        link[a], link[b] = b, a
    segs = np.empty((k, 2), np.int64)
    e, size = 0, 0
    while size < k:
        i = e // 2
        low = cuts[i] + 1 - base
        high = (cuts[i + 1] if i + 1 < k else cuts[0] + n) - base
        segs[size, 0], segs[size, 1] = (low, high) if e % 2 == 0 else (high, low)
        size += 1
        e = link[e ^ 1]
        if e // 2 == 0:
            break
    if size < k:
        return False
    apply(t, base % n, 0, segs, k)
    return True


@allocating
def _end(ends: Any, v: int) -> int:
    """A loose segment end at node v; each is used once."""
    side = 0 if ends[v, 0] >= 0 else 1
    e = ends[v, side]
    ends[v, side] = -1
    return e
