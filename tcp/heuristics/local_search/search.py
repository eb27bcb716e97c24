"""The inner search: Lin-Kernighan chains over segment lists, complete for three exchanges.

A search starts by taking the edge t1-t2 out of the tour, which leaves a path
from t2 to t1.  A *step* links the path's free end to a candidate node c and
takes out the edge that leads to c; what comes before c is thereby turned
round, the edge's other node becomes the free end, and the path can be closed
into a tour at any time (Lin and Kernighan 1973).  The first step has an
alternative that leaves a path and a cycle, which the next exchange opens
again: with it, every improving exchange of two or three edges along candidate
lists is found.  Only positive partial gains are followed.

The virtual node costs nothing to reach and has no neighbours of its own.  When
it is the free end, the useful partners are the nodes next to the neighbours of
t1, for the path then closes with a short edge.  So free ends need no care.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tcp.heuristics.local_search.compiled import compiled, inlined
from tcp.heuristics.local_search.exchange import apply, effort, find, node_at, place
from tcp.heuristics.local_search.ground import Small, bound_together, price
from tcp.travel import Ints

DEPTH = 8
"""Most steps of a chain that the work space can hold."""

BREADTH = (1, 1, 1, 1, 1, 1, 1, 1)
"""How many continuations of each step are tried, best first, when speed counts."""

THOROUGH = (1_000, 3, 2, 1, 1, 1, 1, 1)
"""The same where nothing may be missed: every first step, hence every exchange of three."""

STEP, ACROSS, AGAINST = 0, 1, 2


class Work(NamedTuple):
    """Work space of one search; ``queue`` is a ring of nodes to look at again.

    ``segs[l]``, ``counts[l]`` are the segments before step l, ``ends[l]`` and
    ``gains[l]`` the free end and what has been gained so far.  ``moves[l, k]``
    is the k-th continuation as (kind, c, f, new free end, gain): places
    for c and f.  ``state`` is (queue head, queue size, steps to go deep,
    places an exchange may write).
    """

    segs: Ints
    counts: Ints
    ends: Ints
    gains: Ints
    moves: Ints
    found: Ints
    breadth: Ints
    virtual_near: Small
    virtual_dist: Ints
    queue: Small
    queued: Any
    state: Ints


HEAD, SIZE, STEPS, CAP = 0, 1, 2, 3


def new_work(n: int, width: int, depth: int = 6, cap: int = 50_000) -> Work:
    """Work space for ``n`` nodes with ``width`` candidates each."""
    most = width * (1 + 4 * width) + 1
    state = np.array([0, 0, min(depth, DEPTH), cap], np.int64)
    return Work(
        segs=np.zeros((DEPTH + 2, 2 * DEPTH + 4, 2), np.int64),
        counts=np.zeros(DEPTH + 2, np.int64),
        ends=np.zeros(DEPTH + 2, np.int64),
        gains=np.zeros(DEPTH + 2, np.int64),
        moves=np.zeros((DEPTH + 2, most, 5), np.int64),
        found=np.zeros((DEPTH + 2, 2), np.int64),
        breadth=np.array(BREADTH, np.int64),
        virtual_near=np.zeros(width, np.int32),
        virtual_dist=np.zeros(width, np.int64),
        queue=np.zeros(n, np.int32),
        queued=np.zeros(n, np.bool_),
        state=state,
    )


@compiled
def push(w: Any, v: int) -> None:
    """Ask for another look at node v."""
    if not w.queued[v]:
        n = w.queue.size
        w.queued[v] = True
        at = w.state[HEAD] + w.state[SIZE]
        w.queue[at - n if at >= n else at] = v
        w.state[SIZE] += 1


@compiled
def pop(w: Any) -> int:
    """The node that waits longest."""
    v = w.queue[w.state[HEAD]]
    w.queued[v] = False
    w.state[HEAD] += 1
    if w.state[HEAD] == w.queue.size:
        w.state[HEAD] = 0
    w.state[SIZE] -= 1
    return v


@compiled
def settle(g: Any, t: Any, w: Any, most: int) -> int:
    """Look at queued nodes, at most ``most`` of them, and improve; returns the gain."""
    total = np.int64(0)
    while w.state[SIZE] > 0 and most > 0:
        most -= 1
        v = pop(w)
        while True:
            gain = improve_at(g, t, w, v)
            if gain == 0:
                break
            total += gain
    return total


@compiled
def improve_at(g: Any, t: Any, w: Any, t1: int) -> int:
    """Find and make an improving exchange that takes out an edge at t1; returns its gain."""
    n = t.order.size
    for back in range(2):
        base = t.pos[t1] + (-1 if back else 1)
        base = n - 1 if base < 0 else 0 if base == n else base
        t2 = t.order[base]
        if bound_together(g, t1, t2):
            continue
        level, gain = _chain(g, t, w, t1, t2, base, back)
        if gain > 0:
            segs, count = w.segs[level], w.counts[level]
            for s in range(count):
                push(w, node_at(t, base, back, segs[s, 0]))
                push(w, node_at(t, base, back, segs[s, 1]))
            apply(t, base, back, segs, count)
            return gain
    return 0


@compiled
def _chain(g: Any, t: Any, w: Any, t1: int, t2: int, base: int, back: int) -> tuple[int, int]:
    """Depth-first search for a chain that gains; the level whose segments hold it, and its gain."""
    n = t.order.size
    w.segs[0, 0, 0], w.segs[0, 0, 1] = 0, n - 1
    w.counts[0], w.ends[0], w.gains[0] = 1, t2, price(g, t1, t2)
    level = 0
    while True:
        gain, at = _continue(g, t, w, t1, base, back, level)
        if gain == 0:
            level, at = _next(w, level)
            if at < 0:
                return 0, np.int64(0)
        _take(w, level, at)
        level += 1
        if gain > 0:
            if effort(n, w.segs[level], w.counts[level]) <= w.state[CAP]:
                return level, gain
            level, at = _next(w, level - 1)
            if at < 0:
                return 0, np.int64(0)
            _take(w, level, at)
            level += 1


@inlined
def _next(w: Any, level: int) -> tuple[int, int]:
    """The deepest level that has a continuation left to try, and the one with the largest gain."""
    best = -1
    while level >= 0:
        if w.found[level, 1] < w.breadth[level] and level + 1 < w.state[STEPS]:
            moves, most = w.moves[level], np.int64(0)
            for k in range(w.found[level, 0]):
                if moves[k, 4] > most:
                    best, most = k, moves[k, 4]
            if best >= 0:
                w.found[level, 1] += 1
                break
        level -= 1
    return level, best


@inlined
def _take(w: Any, level: int, k: int) -> None:
    """Write the segments after continuation k of ``level`` to the next level; strike k off."""
    move, old, new = w.moves[level, k], w.segs[level], w.segs[level + 1]
    kind, qc, qf = move[0], move[1], move[2]
    w.ends[level + 1], w.gains[level + 1] = move[3], move[4]
    move[4] = -1
    if kind == STEP:
        count = w.counts[level]
        s = find(old, count, qc)
        a, b = old[s, 0], old[s, 1]
        new[0, 0], new[0, 1] = (qc - 1 if a < b else qc + 1), a
        for r in range(s):
            new[s - r, 0], new[s - r, 1] = old[r, 1], old[r, 0]
        new[s + 1, 0], new[s + 1, 1] = qc, b
        for r in range(s + 1, count):
            new[r + 1, 0], new[r + 1, 1] = old[r, 0], old[r, 1]
        w.counts[level + 1] = count + 1
        return
    last = old[0, 1]  # the alternatives start from one segment
    if kind == ACROSS:
        new[0, 0], new[0, 1] = qf + 1, qc
        new[1, 0], new[1, 1] = 0, qf
    else:
        new[0, 0], new[0, 1] = qf - 1, 0
        new[1, 0], new[1, 1] = qc, qf
    new[2, 0], new[2, 1] = qc + 1, last
    w.counts[level + 1] = 3


@inlined
def _continue(g: Any, t: Any, w: Any, t1: int, base: int, back: int, level: int) -> tuple[int, int]:
    """List the continuations at ``level``; the best gain of closing one, and which one it is."""
    end, gain, segs, count = w.ends[level], w.gains[level], w.segs[level], w.counts[level]
    w.found[level, 0] = w.found[level, 1] = 0
    near, dist = _partners(g, t, w, end, t1)
    best, best_at = np.int64(0), -1
    for k in range(near.size):
        c = near[k]
        rest = gain - dist[k]
        if rest <= 0:
            break
        if (c == t1) | (c == end):
            continue
        q = place(t, base, back, c)
        s = find(segs, count, q)
        a, b = segs[s, 0], segs[s, 1]
        if q != a:
            d = node_at(t, base, back, q - 1 if a < b else q + 1)
            if d != end and not bound_together(g, d, c):
                total = rest + price(g, d, c)
                at = _list(w, level, STEP, q, 0, d, total)
                closed = total - price(g, d, t1)
                if closed > best:
                    best, best_at = closed, at
        if level == 0:
            closed, at = _alternatives(g, t, w, t1, base, back, q, c, rest)
            if closed > best:
                best, best_at = closed, at
    return best, best_at


@inlined
def _list(w: Any, level: int, kind: int, qc: int, qf: int, end: int, gain: int) -> int:
    at = w.found[level, 0]
    w.found[level, 0] = at + 1
    move = w.moves[level, at]
    move[0], move[1], move[2], move[3], move[4] = kind, qc, qf, end, gain
    return at


@inlined
def _alternatives(
    g: Any, t: Any, w: Any, t1: int, base: int, back: int, q: int, c: int, rest: int
) -> tuple[int, int]:
    """First steps that close a cycle t2 .. c and open it again; best closing gain and its place."""
    best, best_at = np.int64(0), -1
    e = node_at(t, base, back, q + 1)
    if bound_together(g, c, e):
        return best, best_at
    rest += price(g, c, e)
    near, dist = _partners(g, t, w, e, t1)
    for k in range(near.size):
        f = near[k]
        left = rest - dist[k]
        if left <= 0:
            break
        qf = place(t, base, back, f)
        if qf > q or f == e:
            continue
        for kind in (ACROSS, AGAINST):
            if qf == (q if kind == ACROSS else 0):
                continue
            h = node_at(t, base, back, qf + 1 if kind == ACROSS else qf - 1)
            if bound_together(g, f, h):
                continue
            total = left + price(g, f, h)
            at = _list(w, 0, kind, q, qf, h, total)
            closed = total - price(g, h, t1)
            if closed > best:
                best, best_at = closed, at
    return best, best_at


@inlined
def _partners(g: Any, t: Any, w: Any, end: int, t1: int) -> tuple[Any, Any]:
    """Candidates of the free end and their costs."""
    if end != g.virtual:
        return g.near[end], g.dist[end]
    n = t.order.size
    width = g.near.shape[1]
    for k in range(width):
        p = t.pos[g.near[t1, k // 2]]
        p = p + 1 if k % 2 else p - 1
        w.virtual_near[k] = t.order[0 if p == n else p]
    return w.virtual_near, w.virtual_dist
