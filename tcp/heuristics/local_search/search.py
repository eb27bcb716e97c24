"""The inner search: every exchange of three edges, then one Lin-Kernighan chain on from the best.

A search starts by taking the edge t1-t2 out of the tour, which leaves a path
from t2 to t1, read as linear places 0 .. n-1 (``exchange.py``).  It links t2
to a candidate c, takes out an edge at c, links that edge's other end d to a
candidate f, and takes out an edge at f.  What comes before the two cuts, X,
what lies between them, Y, and the rest Z can be joined in four ways:

======  =========  ===================================================
YXZ     Y X Z      f before c; both edges behind their nodes go
XrYrZ   X' Y' Z    f before c; the edges behind c and before f go
YXrZ    Y X' Z     f before c; the edges before c and behind f go
YrXZ    Y' X Z     f behind c; the edges before both go
======  =========  ===================================================

(X' is X turned round.)  With the exchange of two edges, X' Z, and both sides
of t1, that is every improving exchange of two or three edges along candidate
lists (Bentley 1992; the basis move of Helsgaun 2009).  Only positive partial gains are followed.
If none of them closes with a gain, the best is continued step by step, each
turning round what comes before the next cut (Lin and Kernighan 1973).

The virtual node costs nothing to reach and has no neighbours of its own.  When
it is the free end, the useful partners are the nodes next to the neighbours of
t1, for the path then closes with a short edge.  So free ends need no care.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tcp.heuristics.local_search.exchange import apply, effort, node_at, place
from tcp.heuristics.local_search.ground import VIRTUAL, Small, price
from tcp.jit import compiled, inner
from tcp.travel import Ints

DEPTH = 8
"""Most edges that one exchange takes out (at most :data:`DEEPEST`)."""

DEEPEST = 16

XRZ, YXZ, XRYRZ, YXRZ, YRXZ = 0, 1, 2, 3, 4


class Work(NamedTuple):
    """Work space of one search.

    ``segs`` are the segments of the exchange under examination, ``free`` the
    virtual node's candidates.  ``queue`` is a ring of nodes to look at again,
    ``queued`` tells which nodes are in it, ``state`` is (queue head, queue
    size, most edges of an exchange, places it may write, whether exchanges are
    kept at once and cannot be undone).
    """

    segs: Ints
    free: Small
    queue: Small
    queued: Any
    state: Ints


FOREVER = 1 << 60
"""More looks, or places to write, than there will ever be."""

HEAD, SIZE, STEPS, CAP, FIRM = 0, 1, 2, 3, 4


def new_work(n: int, width: int, depth: int = DEPTH, cap: int = 50_000) -> Work:
    """Work space for ``n`` nodes with ``width`` candidates each."""
    return Work(
        segs=np.zeros(2 * DEEPEST + 4, np.int64),
        free=np.zeros(width, np.int32),
        queue=np.zeros(n, np.int32),
        queued=np.zeros(n, np.bool_),
        state=np.array([0, 0, min(depth, DEEPEST), cap, 0], np.int64),
    )


@inner
def push(queue: Any, queued: Any, state: Any, v: int) -> None:
    """Ask for another look at node v."""
    if not queued[v]:
        n = queue.size
        queued[v] = True
        at = state[HEAD] + state[SIZE]
        queue[at - n if at >= n else at] = v
        state[SIZE] += 1


@inner
def pop(queue: Any, queued: Any, state: Any) -> int:
    """The next node to look at."""
    v = queue[state[HEAD]]
    queued[v] = False
    state[HEAD] += 1
    if state[HEAD] == queue.size:
        state[HEAD] = 0
    state[SIZE] -= 1
    return v


@compiled
def push_all(queue: Any, queued: Any, state: Any, nodes: Any) -> None:
    """Ask for another look at many nodes."""
    for v in nodes:
        push(queue, queued, state, v)


@compiled
def settle(
    costs: Any,
    near: Any,
    dist: Any,
    order: Any,
    pos: Any,
    spare: Any,
    log: Any,
    segs: Any,
    free: Any,
    queue: Any,
    queued: Any,
    state: Any,
    most: int,
) -> int:
    """Look at queued nodes, at most ``most`` of them, and improve; returns the gain."""
    n = order.size
    total: Any = np.int64(0)
    while state[SIZE] > 0 and most > 0:
        most -= 1
        t1 = pop(queue, queued, state)
        back: Any = np.int64(0)
        while back < 2:  # take out the edge behind t1, then the one before it
            base = pos[t1] + (-1 if back else 1)
            base = n - 1 if base < 0 else 0 if base == n else base
            gain, count = three(
                costs, near, dist, order, pos, segs, free, state[CAP], t1, base, back
            )
            if gain < 0:  # not closed yet: -gain is what the open path has gained
                gain, count = deepen(
                    costs, near, dist, order, pos, segs, free, state[STEPS], count,
                    -gain, t1, base, back,
                )  # fmt: skip
            writes = effort(n, segs, count) if gain > 0 else FOREVER
            if writes > state[CAP] or log[0, 0] + writes >= log.shape[0]:
                back += 1
                continue
            for s in range(2 * count):
                push(queue, queued, state, node_at(order, base, back, segs[s]))
            apply(order, pos, spare, log, base, back, segs, count)
            total += gain
            back = 0
            if state[FIRM]:
                log[0, 0] = 0
    return total


@inner
def look_around(near: Any, free: Any, order: Any, pos: Any, t1: int) -> None:
    """Make the nodes next to the neighbours of t1 the virtual node's candidates."""
    n = order.size
    for k in range(free.size):
        p = pos[near[t1, k // 2]]
        p = p + 1 if k % 2 else p - 1
        free[k] = order[0 if p == n else n - 1 if p < 0 else p]


@inner
def three(
    costs: Any,
    near: Any,
    dist: Any,
    order: Any,
    pos: Any,
    segs: Any,
    free: Any,
    cap: int,
    t1: int,
    base: int,
    back: int,
) -> tuple[int, int]:
    """The best exchange of two or three edges without t1-t2, written to ``segs``.

    Returns its gain and the number of segments; if none closes with a gain,
    minus the gain of the best open path (0: there is none).
    """
    n = order.size
    virtual = costs[0][VIRTUAL]
    t2 = order[base]
    zero: Any = np.int64(0)  # a literal would compile :func:`write` once more
    best, best_kind, best_low, best_high = zero, zero, zero, zero
    open_, open_kind, open_low, open_high = zero, zero, zero, zero
    g0 = price(costs, t1, t2)
    if t2 == virtual:
        look_around(near, free, order, pos, t1)
    for k in range(near.shape[1]):
        g1 = g0 - dist[t2, k]
        if g1 <= 0:
            break
        c = free[k] if t2 == virtual else near[t2, k]
        q = place(pos, base, back, c)
        if q == 0 or q == n - 1:
            continue
        for behind in range(2):
            if q == 1 and not behind:
                continue
            d = node_at(order, base, back, q + 1 if behind else q - 1)
            g2 = g1 + price(costs, c, d)
            if not behind:
                closed = g2 - price(costs, d, t1)
                if closed > best and min(q, n - q) <= cap:
                    best, best_kind, best_low, best_high = closed, XRZ, q, q
            if d == virtual:
                look_around(near, free, order, pos, t1)
            for j in range(near.shape[1]):
                g3 = g2 - dist[d, j]
                if g3 <= 0:
                    break
                f = free[j] if d == virtual else near[d, j]
                qf = place(pos, base, back, f)
                if qf == q or (qf > q and (behind or qf == n - 1)):
                    continue
                for way in range(1 + behind):
                    if behind:
                        kind, high = (XRYRZ if way else YXZ), q + 1
                        low = qf if way else qf + 1
                        first = low - 1 if way else low
                        if low == 0:
                            continue
                    elif qf < q:
                        kind, low, high, first = YXRZ, qf + 1, q, qf + 1
                        if low >= q - 1:
                            continue
                    else:
                        kind, low, high, first = YRXZ, q, qf, qf - 1
                    h = node_at(order, base, back, first)
                    g4 = g3 + price(costs, f, h)
                    if g4 <= best and g4 <= open_:
                        continue
                    writes = n - max(low, high - low, n - high)
                    if writes > cap:
                        continue
                    closed = g4 - price(costs, h, t1)
                    if closed > best:
                        best, best_kind, best_low, best_high = closed, kind, low, high
                    if g4 > open_:
                        open_, open_kind, open_low, open_high = g4, kind, low, high
    if best > 0:
        return best, write(segs, best_kind, best_low, best_high, n)
    if open_ > 0:
        return -open_, write(segs, open_kind, open_low, open_high, n)
    return np.int64(0), 0


@inner
def write(segs: Any, kind: int, low: int, high: int, n: int) -> int:
    """Write the segments of a basic exchange; returns how many there are."""
    x, y = (0, low - 1), (low, high - 1)
    if kind == XRZ:
        segs[0], segs[1], segs[2], segs[3] = low - 1, 0, low, n - 1
        return 2
    if kind == YXZ:
        segs[0], segs[1], segs[2], segs[3] = y[0], y[1], x[0], x[1]
    elif kind == XRYRZ:
        segs[0], segs[1], segs[2], segs[3] = x[1], x[0], y[1], y[0]
    elif kind == YXRZ:
        segs[0], segs[1], segs[2], segs[3] = y[0], y[1], x[1], x[0]
    else:
        segs[0], segs[1], segs[2], segs[3] = y[1], y[0], x[0], x[1]
    segs[4], segs[5] = high, n - 1
    return 3


@inner
def deepen(
    costs: Any,
    near: Any,
    dist: Any,
    order: Any,
    pos: Any,
    segs: Any,
    free: Any,
    steps: int,
    count: int,
    gain: int,
    t1: int,
    base: int,
    back: int,
) -> tuple[int, int]:
    """Continue the open path in ``segs``, best step first, until it closes with a gain.

    Returns that gain (0: it never did) and the number of segments.
    """
    virtual = costs[0][VIRTUAL]
    zero: Any = np.int64(0)
    while count < steps:
        end = node_at(order, base, back, segs[0])
        if end == virtual:
            look_around(near, free, order, pos, t1)
        best, at, within = zero, zero - 1, zero
        for k in range(near.shape[1]):
            g = gain - dist[end, k]
            if g <= 0:
                break
            c = free[k] if end == virtual else near[end, k]
            if c in (t1, end):
                continue
            q = place(pos, base, back, c)
            s = count - 1
            while s > 0:
                a, b = segs[2 * s], segs[2 * s + 1]
                if (a <= q <= b) or (b <= q <= a):
                    break
                s -= 1
            a, b = segs[2 * s], segs[2 * s + 1]
            if q == a:  # the edge that leads to c is new
                continue
            d = node_at(order, base, back, q - 1 if a < b else q + 1)
            g += price(costs, d, c)
            if g > best and d != end:
                best, at, within = g, q, s
        if at < 0:
            break
        turn(segs, count, within, at)
        count += 1
        gain = best
        closed = gain - price(costs, node_at(order, base, back, segs[0]), t1)
        if closed > 0:
            return closed, count
    return np.int64(0), count


@inner
def turn(segs: Any, count: int, s: int, q: int) -> None:
    """Cut segment s before place q and turn round everything before the cut."""
    a, b = segs[2 * s], segs[2 * s + 1]
    for r in range(2 * count - 1, 2 * s + 1, -1):
        segs[r + 2] = segs[r]
    segs[2 * s + 1] = q - 1 if a < b else q + 1
    segs[2 * s + 2], segs[2 * s + 3] = q, b
    i, j = 0, 2 * s + 1
    while i < j:
        segs[i], segs[j] = segs[j], segs[i]
        i += 1
        j -= 1
