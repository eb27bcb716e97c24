"""Edge assembly: a child of two tours that takes from the second what it does better.

The edges that only one of two tours A and B has form cycles that take an edge
of A and one of B in turn (AB-cycles; Nagata and Kobayashi 2013).  Exchanging
along some of them turns A into a tour or into several, which are joined by the
best exchanges of two edges, smallest first.  A cycle that makes A shorter by
itself ("single", the local form of EAX) is ranked by what it gains for what the
population loses of its diversity (entropy; equation 6 there), and the child
takes a share of them at once, the best.  One cycle a child would keep most
diversity, but where tours differ in many places, breeding would take as many
generations.  O(n) for the cycles of a pair, and for a child of k exchanges
O(k log k), the size of the tours that have to be joined and O(k) for each.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tcp.heuristics.local_search.ground import called_price
from tcp.heuristics.local_search.kicks import draw
from tcp.jit import allocating, inner

KNOWN = 10
"""Most different neighbours of a node that are counted in a population."""


@allocating
def mate(
    costs: Any,
    near: Any,
    order: Any,
    pos: Any,
    cycles: Any,
    starts: Any,
    child: Any,
    counts: Any,
    members: int,
    greed: float,
) -> int:
    """Write a better child of a tour along some AB-cycles to ``child``; returns its gain.

    A gain of 0 leaves ``child`` as it is: no cycle makes it shorter.  ``cycles`` and
    ``starts`` are what :func:`ab_cycles` says of the tour and another, ``counts``
    what :func:`census` says of a population of ``members`` tours, ``greed`` how
    many of the cycles that make it shorter are taken, from 0 (the best one) to 1.
    """
    n = order.size
    link = np.empty((n, 2), np.int32)
    for p in range(n):
        link[order[p], 0] = order[p - 1 if p else n - 1]
        link[order[p], 1] = order[p + 1 if p + 1 < n else 0]
    parts = np.empty((3, cycles.shape[0] // 2), np.int64)
    room = np.empty((3 * cycles.shape[0], 3), np.int32)
    better, rank = np.empty(starts.size, np.int64), np.empty(starts.size)
    gains, found = np.empty(starts.size, np.int64), 0
    for c in range(starts.size - 1):
        cycle = cycles[starts[c] : starts[c + 1]]
        gain, used = assemble(costs, near, order, pos, link, cycle, parts, room)
        lost = restore(order, pos, link, room, used, counts, members)
        if gain > 0:
            gains[c], better[found], rank[found] = gain, c, -gain / max(lost, 1e-6)
            found += 1
    sort(rank[:found], better[:found])
    taken, take = np.empty_like(cycles), min(found, max(1, math.ceil(greed * found)))
    while take > 0:
        size = 0
        for i in range(take):
            for k in range(starts[better[i]], starts[better[i] + 1]):
                taken[size, 0], taken[size, 1] = cycles[k, 0], cycles[k, 1]
                size += 1
        gain, used = assemble(costs, near, order, pos, link, taken[:size], parts, room)
        if gain >= gains[better[0]]:
            write_tour(link, child)
            return gain
        restore(order, pos, link, room, used, counts, members)
        take //= 2  # they get in each other's way
    return np.int64(0)


@inner
def write_tour(link: Any, order: Any) -> None:
    """Write the tour that ``link`` describes."""
    last, v = link[0, 0], np.int32(0)
    for p in range(order.size):
        order[p] = v
        last, v = v, (link[v, 0] if link[v, 0] != last else link[v, 1])


@allocating
def ab_cycles(order: Any, pos: Any, other: Any, other_pos: Any, random: Any) -> Any:
    """All AB-cycles, at random where there is a choice: their edges, and where each starts.

    The edges belong to ``order`` alone and to ``other`` alone in turn, an even
    number to a cycle, and each begins where the one before it ends.
    """
    n = order.size
    links = np.empty((2, n, 2), np.int32)  # edges that only one of them has
    at = np.empty((n, 2), np.int32)  # where the path left a node along each tour
    for v in range(n):
        for k in range(2):
            links[0, v, k] = links[1, v, k] = at[v, k] = -1
    todo, count = np.empty(n, np.int32), 0
    for tour in range(2):
        here, there = (other, pos) if tour else (order, other_pos)
        u = here[n - 1]
        for v in here:
            apart = abs(np.int64(there[u]) - there[v])
            if 1 < apart < n - 1:
                links[tour, u, 0 if links[tour, u, 0] < 0 else 1] = v
                links[tour, v, 0 if links[tour, v, 0] < 0 else 1] = u
                if not tour:
                    todo[count] = v
                    count += 1
            u = v
    nodes, used = np.empty(2 * count, np.int32), 0
    starts, found = np.empty(count + 1, np.int64), 0
    starts[0] = 0
    path = np.empty(2 * count + 2, np.int32)
    for i in range(count):
        j = i + draw(random, count - i)
        todo[i], todo[j] = todo[j], todo[i]
        size, v = 0, todo[i]
        while size > 0 or links[0, v, 0] >= 0 or links[0, v, 1] >= 0:
            first = at[v, size % 2]
            if first < 0:
                at[v, size % 2] = size
                path[size] = v
                v = walk(links, size % 2, v, random)
                size += 1
                continue
            for k in range(first, size):  # the path's end is a cycle
                nodes[used + k - first] = path[k]
                at[path[k], k % 2] = -1
            if first % 2:  # it must start with an edge of ``order``
                for k in range(used, used + size - first - 1):
                    nodes[k] = nodes[k + 1]
                nodes[used + size - first - 1] = path[first]
            used += size - first
            found += 1
            starts[found] = used
            size = first
    cycles = np.empty((used, 2), np.int32)
    for c in range(found):
        for k in range(starts[c], starts[c + 1]):
            onward = k + 1 if k + 1 < starts[c + 1] else starts[c]
            cycles[k, 0], cycles[k, 1] = nodes[k], nodes[onward]
    return cycles, starts[: found + 1]


@inner
def walk(links: Any, tour: int, u: int, random: Any) -> int:
    """Go along one of the tour's edges at u that are left, and strike it off."""
    k = 1 if links[tour, u, 0] < 0 else 0
    if k == 0 and links[tour, u, 1] >= 0:
        k = draw(random, np.int64(2))
    v = links[tour, u, k]
    links[tour, u, k] = -1
    links[tour, v, 0 if links[tour, v, 0] == u else 1] = -1
    return v


@inner
def relink(link: Any, u: int, old: int, new: int) -> None:
    """Let u's edge to ``old`` lead to ``new``."""
    link[u, 0 if link[u, 0] == old else 1] = new


@inner
def assemble(
    costs: Any,
    near: Any,
    order: Any,
    pos: Any,
    link: Any,
    cycles: Any,
    parts: Any,
    room: Any,
) -> tuple[int, int]:
    """Exchange along one or more ``cycles`` in ``link`` and join what falls apart.

    Returns the gain and how many entries of ``room`` name a node whose edges
    may have changed.
    """
    n, k, nobody = order.size, cycles.shape[0] // 2, np.int32(-1)
    cuts, part, size = parts[0, :k], parts[1, :k], parts[2, :k]
    gain = np.int64(0)
    for i in range(2 * k):
        c = called_price(costs, cycles[i, 0], cycles[i, 1])
        gain += -c if i % 2 else c
    if gain <= 0:  # joining hardly ever gains anything
        return gain, 0
    for i in range(0, 2 * k, 2):
        u, v = cycles[i, 0], cycles[i, 1]
        room[i, 0], room[i + 1, 0] = u, v
        p, q = np.int64(pos[u]), np.int64(pos[v])
        cuts[i // 2] = p if q == (p + 1 if p + 1 < n else 0) else q
        relink(link, u, v, nobody)
        relink(link, v, u, nobody)
    for i in range(1, 2 * k, 2):
        u, v = cycles[i, 0], cycles[i, 1]
        relink(link, u, nobody, v)
        relink(link, v, nobody, u)
    sort(cuts, cuts)
    used = 2 * k
    apart = trace(order, pos, link, cuts, part, size)
    while apart > 1:
        small: Any = np.int64(0)
        for i in range(1, k):
            if size[i] < size[small]:
                small = i
        joined, into = join(costs, near, order, pos, link, cuts, part, small, room, used)
        if into < 0:
            return np.int64(-1), used
        gain += joined
        used += 4
        for i in range(k):
            if part[i] == small:
                part[i] = into
        size[into] += size[small]
        size[small] = n + 1
        apart -= 1
    return gain, used


@inner
def sort(keys: Any, items: Any) -> None:
    """Sort keys and with them items (Shell 1959); numpy's sort takes seconds to compile."""
    gap = keys.size // 2
    while gap > 0:
        for i in range(gap, keys.size):
            key, item, j = keys[i], items[i], i
            while j >= gap and keys[j - gap] > key:
                keys[j], items[j] = keys[j - gap], items[j - gap]
                j -= gap
            keys[j], items[j] = key, item
        gap //= 2


@inner
def stretch(cuts: Any, p: int) -> int:
    """Number of the stretch that holds place p; stretch i ends at ``cuts[i]``."""
    low, high = 0, cuts.size
    while low < high:
        middle = (low + high) // 2
        if cuts[middle] < p:
            low = middle + 1
        else:
            high = middle
    return low if low < cuts.size else 0


@inner
def trace(order: Any, pos: Any, link: Any, cuts: Any, part: Any, size: Any) -> int:
    """Tell which of the closed tours in ``link`` holds each stretch, and their sizes.

    Returns how many there are; the other sizes are more than n.
    """
    n, k = order.size, cuts.size
    found = 0
    for i in range(k):
        part[i], size[i] = -1, n + 1
    for i in range(k):
        if part[i] >= 0:
            continue
        s, total = i, 0
        low = cuts[s - 1] + 1 if s else cuts[k - 1] + 1 - n
        v = order[low if low >= 0 else low + n]  # the node by which we come into a stretch ...
        last = np.int32(-1)  # ... and the one we come from
        while part[s] < 0:
            part[s] = found
            low = cuts[s - 1] + 1 if s else cuts[k - 1] + 1 - n
            total += cuts[s] - low + 1
            first = order[low if low >= 0 else low + n]
            if low == cuts[s]:
                end, inner = v, (last if last >= 0 else link[v, 1])
            elif v == first:
                end, inner = order[cuts[s]], order[cuts[s] - 1 if cuts[s] else n - 1]
            else:
                end, inner = first, order[low + 1 if low + 1 >= 0 else low + 1 + n]
            v = link[end, 0] if link[end, 0] != inner else link[end, 1]
            last = end
            s = stretch(cuts, pos[v])
        size[found] = total
        found += 1
    return found


@inner
def join(
    costs: Any,
    near: Any,
    order: Any,
    pos: Any,
    link: Any,
    cuts: Any,
    part: Any,
    small: int,
    room: Any,
    used: int,
) -> tuple[int, int]:
    """Join the closed tour ``small`` to another by the best exchange of two edges.

    Returns the gain and the other one's number, -1 if no candidate lies outside.
    """
    s = 0
    while part[s] != small:
        s += 1
    start = order[cuts[s]]
    v, last = start, link[start, 0]
    best, into = np.int64(-1) << 60, np.int64(-1)
    while True:
        one, two = called_price(costs, v, link[v, 0]), called_price(costs, v, link[v, 1])
        for j in range(near.shape[1]):
            w = near[v, j]
            home = part[stretch(cuts, pos[w])]
            if home == small:
                continue
            across = called_price(costs, v, w)
            before, after = called_price(costs, w, link[w, 0]), called_price(costs, w, link[w, 1])
            for a in range(2):
                v2 = link[v, a]
                for b in range(2):
                    w2 = link[w, b]
                    gain = (two if a else one) + (after if b else before) - across
                    gain -= called_price(costs, v2, w2)
                    if gain > best:
                        best, into = gain, home
                        room[used, 0], room[used + 1, 0] = v, v2
                        room[used + 2, 0], room[used + 3, 0] = w, w2
        last, v = v, (link[v, 0] if link[v, 0] != last else link[v, 1])
        if v == start:
            break
    if into >= 0:
        v, v2, w, w2 = room[used, 0], room[used + 1, 0], room[used + 2, 0], room[used + 3, 0]
        relink(link, v, v2, w)
        relink(link, v2, v, w2)
        relink(link, w, w2, v)
        relink(link, w2, w, v2)
    return best, into


@inner
def restore(
    order: Any, pos: Any, link: Any, room: Any, used: int, counts: Any, members: int
) -> float:
    """Note the new edges in ``room`` and put the old ones back into ``link``.

    Returns the entropy that the population loses if the new tour takes the old one's place.
    """
    n = order.size
    for i in range(used):
        room[i, 1], room[i, 2] = link[room[i, 0], 0], link[room[i, 0], 1]
    lost = 0.0
    for i in range(used):
        u = room[i, 0]
        p = pos[u]
        a, b = order[p - 1 if p else n - 1], order[p + 1 if p + 1 < n else 0]
        for k in range(2):
            old, new = (b if k else a), link[u, k]
            if old not in (link[u, 0], link[u, 1]):
                c = count_of(counts, u, old)
                lost += share(c - 1, members) - share(c, members)
            if new not in (a, b):
                c = count_of(counts, u, new)
                lost += share(c + 1, members) - share(c, members)
        link[u, 0], link[u, 1] = a, b
    return lost / 2


@inner
def share(count: int, members: int) -> float:
    """An edge's part of the entropy, negative: f log f with f the share of tours that have it."""
    f = count / members
    return f * math.log(f) if count > 0 else 0.0


@inner
def count_of(counts: Any, u: int, v: int) -> int:
    """How many tours have the edge u-v."""
    for j in range(counts.shape[1]):
        if counts[u, j, 0] == v:
            return np.int64(counts[u, j, 1])
    return np.int64(0)


@allocating
def census(orders: Any) -> Any:
    """Which neighbours a node has in the tours, and in how many: (neighbour, number) lists."""
    members, n = orders.shape
    counts = np.empty((n, KNOWN, 2), np.int32)
    for v in range(n):
        for j in range(KNOWN):
            counts[v, j, 0], counts[v, j, 1] = -1, 0
    for m in range(members):
        u = orders[m, n - 1]
        for v in orders[m]:
            for k in range(2):
                a, b = (v, u) if k else (u, v)
                j = 0
                while j < KNOWN and counts[a, j, 0] >= 0 and counts[a, j, 0] != b:
                    j += 1
                if j < KNOWN:
                    counts[a, j, 0] = b
                    counts[a, j, 1] += 1
            u = v
    return counts
