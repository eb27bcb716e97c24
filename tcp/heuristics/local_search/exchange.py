"""Exchanging edges of a tour kept in an array, and going back.

Cut the tour between two neighbours and read it as a path of *linear* places
0 .. n-1, forwards or backwards (:func:`place`, :func:`node_at`).  Every tour
that a few exchanges can reach is then a short list of segments of that path,
``segs = first, last, first, last, ...``, read backwards where first > last.  A
search tries exchanges on such lists at a cost that depends on their length
alone; :func:`apply` writes the winner into the array, leaving its longest
segment where it is, and logs what it overwrites for :func:`undo`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tcp.heuristics.local_search.ground import Small
from tcp.jit import compiled, inlined, inner

MOST_LOGGED = 400_000
"""Most places that can be undone, whatever the size of the tour."""


class Tour(NamedTuple):
    """A tour that can go back.

    ``pos[order[i]] == i`` always.  ``log[1 .. log[0, 0]]`` are the places
    written since the tour was last kept, and the nodes that stood there.
    """

    order: Small
    pos: Small
    spare: Small
    log: Small


def new_tour(order: Small) -> Tour:
    """A tour that stands at ``order`` (copied)."""
    order = order.astype(np.int32)
    pos = np.empty_like(order)
    pos[order] = np.arange(order.size, dtype=np.int32)
    room = min(16 * order.size + 1_000, MOST_LOGGED)
    return Tour(order, pos, np.empty_like(order), np.zeros((room, 2), np.int32))


@inlined
def place(pos: Any, base: int, back: int, v: int) -> int:
    """Linear place of node v on the path that starts at array place ``base``."""
    q = base - pos[v] if back else pos[v] - base
    return q + pos.size if q < 0 else q


@inlined
def array_place(n: int, base: int, back: int, q: int) -> int:
    """Array place of the linear place q."""
    p = base - q if back else base + q
    return p + n if p < 0 else p - n if p >= n else p


@inlined
def node_at(order: Any, base: int, back: int, q: int) -> int:
    """Node at linear place q."""
    return order[array_place(order.size, base, back, q)]


@inner
def longest(segs: Any, count: int) -> int:
    """Which segment is the longest."""
    best, m = np.int64(-1), 0
    for s in range(count):
        size = abs(segs[2 * s + 1] - segs[2 * s])
        if size > best:
            best, m = size, s
    return m


@inner
def effort(n: int, segs: Any, count: int) -> int:
    """How many places :func:`apply` will write."""
    m = longest(segs, count)
    return n - 1 - abs(segs[2 * m + 1] - segs[2 * m])


@compiled
def apply(
    order: Any, pos: Any, spare: Any, log: Any, base: int, back: int, segs: Any, count: int
) -> None:
    """Make the cyclic order of the segments the tour; the log must have room."""
    n = order.size
    m = longest(segs, count)
    total = 0
    for k in range(1, count):
        s = m + k if m + k < count else m + k - count
        a, b = segs[2 * s], segs[2 * s + 1]
        step = 1 if (a <= b) != (back != 0) else -1
        p = array_place(n, base, back, a)
        for _ in range(abs(b - a) + 1):
            spare[total] = order[p]
            total += 1
            p += step
            if p == n:
                p = 0
            elif p < 0:
                p = n - 1
    a, b = segs[2 * m], segs[2 * m + 1]
    step = 1 if (a <= b) != (back != 0) else -1
    p = array_place(n, base, back, b)
    used = log[0, 0]
    for k in range(total):
        p += step
        if p == n:
            p = 0
        elif p < 0:
            p = n - 1
        v = spare[k]
        used += 1
        log[used, 0], log[used, 1] = p, order[p]
        order[p] = v
        pos[v] = p
    log[0, 0] = used


@compiled
def undo(order: Any, pos: Any, log: Any) -> None:
    """Go back to the tour that was kept last (``log[0, 0] = 0`` keeps one)."""
    for k in range(log[0, 0], 0, -1):
        p, v = log[k, 0], log[k, 1]
        order[p] = v
        pos[v] = p
    log[0, 0] = 0
