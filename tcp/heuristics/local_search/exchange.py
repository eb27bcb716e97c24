"""Exchanging edges of a tour kept in an array, without touching it until it pays.

Cut the tour between two neighbours and read it as a path of *linear* places
0 .. n-1, forwards or backwards (:func:`place`, :func:`node_at`).  Every tour
that a few exchanges can reach is then a short list of segments ``(a, b)`` of
that path, read backwards where a > b.  A search tries exchanges on such lists
at a cost that depends on their length alone; :func:`apply` writes the winner
into the array, leaving its longest segment where it is.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tcp.heuristics.local_search.compiled import compiled, inlined
from tcp.heuristics.local_search.ground import Small
from tcp.travel import Ints


class Tour(NamedTuple):
    """A tour that can go back: ``order`` is at work, ``kept`` is what it was.

    ``pos[order[i]] == i`` always.  Places where ``order`` and ``kept`` may
    differ lie in the ranges ``dirty[1 .. dirty[0, 0]]`` of (start, length),
    cyclic; ``dirty[0, 1]`` is 1 when there were too many to list.
    """

    order: Small
    pos: Small
    kept: Small
    spare: Small
    dirty: Ints


RANGES = 256
"""Most ranges that are listed before everything counts as dirty."""


def new_tour(order: Small) -> Tour:
    """A tour that stands at ``order`` (copied)."""
    order = order.astype(np.int32).copy()
    pos = np.empty_like(order)
    pos[order] = np.arange(order.size, dtype=np.int32)
    return Tour(order, pos, order.copy(), np.empty_like(order), np.zeros((RANGES + 1, 2), np.int64))


@inlined
def place(t: Any, base: int, back: int, v: int) -> int:
    """Linear place of node v on the path that starts at array place ``base``."""
    q = base - t.pos[v] if back else t.pos[v] - base
    return q + t.order.size if q < 0 else q


@inlined
def node_at(t: Any, base: int, back: int, q: int) -> int:
    """Node at linear place q."""
    n = t.order.size
    p = base - q if back else base + q
    return t.order[p + n if p < 0 else p - n if p >= n else p]


@inlined
def find(segs: Any, count: int, q: int) -> int:
    """Which segment holds the linear place q."""
    for s in range(count - 1, 0, -1):
        a, b = segs[s, 0], segs[s, 1]
        if (a <= q <= b) or (b <= q <= a):
            return s
    return 0


@compiled
def longest(segs: Any, count: int) -> int:
    """Which segment is the longest."""
    best, m = np.int64(-1), 0
    for s in range(count):
        size = abs(segs[s, 1] - segs[s, 0])
        if size > best:
            best, m = size, s
    return m


@compiled
def effort(n: int, segs: Any, count: int) -> int:
    """How many places :func:`apply` will write."""
    m = longest(segs, count)
    return n - 1 - abs(segs[m, 1] - segs[m, 0])


@compiled
def apply(t: Any, base: int, back: int, segs: Any, count: int) -> None:
    """Make the cyclic order of the segments the tour; note which places changed."""
    n = t.order.size
    m = longest(segs, count)
    total = 0
    for k in range(1, count):
        s = m + k if m + k < count else m + k - count
        a, b = segs[s, 0], segs[s, 1]
        step = 1 if a <= b else -1
        q = a
        while True:
            t.spare[total] = node_at(t, base, back, q)
            total += 1
            if q == b:
                break
            q += step
    if total == 0:
        return
    ahead = segs[m, 0] <= segs[m, 1]  # the longest segment's direction on the path ...
    step = 1 if ahead != (back != 0) else -1  # ... and in the array
    q = segs[m, 1]
    p = base - q if back else base + q
    p = (p + step + n) % n
    first = p
    for k in range(total):
        v = t.spare[k]
        t.order[p] = v
        t.pos[v] = p
        p += step
        if p == n:
            p = 0
        elif p < 0:
            p = n - 1
    _note(t, first if step > 0 else (p + 1) % n, total)


@compiled
def _note(t: Any, start: int, size: int) -> None:
    used = t.dirty[0, 0]
    if used + 1 >= t.dirty.shape[0]:
        t.dirty[0, 1] = 1
        return
    t.dirty[0, 0] = used + 1
    t.dirty[used + 1, 0] = start
    t.dirty[used + 1, 1] = size


@compiled
def keep(t: Any) -> None:
    """Accept the tour as it stands."""
    _settle(t, True)


@compiled
def undo(t: Any) -> None:
    """Go back to the tour that was kept last."""
    _settle(t, False)


@compiled
def _settle(t: Any, accept: bool) -> None:
    n = t.order.size
    if t.dirty[0, 1]:
        t.dirty[1, 0], t.dirty[1, 1] = 0, n
        t.dirty[0, 0] = 1
    for k in range(1, t.dirty[0, 0] + 1):
        p = t.dirty[k, 0]
        for _ in range(t.dirty[k, 1]):
            if accept:
                t.kept[p] = t.order[p]
            else:
                v = t.kept[p]
                t.order[p] = v
                t.pos[v] = p
            p += 1
            if p == n:
                p = 0
    t.dirty[0, 0] = 0
    t.dirty[0, 1] = 0
