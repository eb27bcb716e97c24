"""Iterated local search: a small random disturbance, repaired, kept unless worse.

The disturbance is a double bridge (Martin, Otto and Felten 1991) of three
short neighbouring stretches of the tour, A B C D -> A D C B: four exchanged
edges that no sequential exchange of three can take back.  Only the nodes it
touched are looked at again (Applegate, Cook and Rohe 2003), so a kick costs
the same on a board of any size.

Keeping only what is not worse gets stuck after some ten kicks a node.  A loss
is therefore kept with probability exp(-loss / heat), as in simulated annealing
(Martin, Otto and Felten 1991 do so for their large steps), and the caller
lowers the heat to zero.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tcp.heuristics.local_search.exchange import apply, node_at, undo
from tcp.heuristics.local_search.ground import called_price
from tcp.heuristics.local_search.search import FOREVER, push, settle
from tcp.jit import compiled, inner


@inner
def draw(random: Any, below: int) -> int:
    """Random whole number in [0, below), below < 2^31 (xorshift64*); ``random`` is one uint64."""
    s = random[0]
    s ^= s >> np.uint64(12)
    s ^= s << np.uint64(25)
    s ^= s >> np.uint64(27)
    random[0] = s
    high = (s * np.uint64(2685821657736338717)) >> np.uint64(33)
    return np.int64((high * np.uint64(below)) >> np.uint64(31))


@compiled
def kick_and_repair(
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
    random: Any,
    kicks: int,
    reach: int,
    heat: float,
) -> int:
    """Try ``kicks`` disturbances of stretches up to ``reach`` nodes; returns the total gain.

    The gain is negative where more losses were put up with than gains found.
    """
    total = np.int64(0)
    reach = min(reach, (order.size - 1) // 3)
    for _ in range(kicks):
        log[0, 0] = 0
        base = draw(random, order.size)
        segs[0] = 1 + draw(random, reach)
        segs[1] = segs[0] + 1 + draw(random, reach)
        segs[2] = segs[1] + 1 + draw(random, reach)
        cost = double_bridge(costs, order, pos, spare, log, segs, queue, queued, state, base)
        gain = -cost + settle(
            costs, near, dist, order, pos, spare, log, segs, free, queue, queued, state,
            np.int64(FOREVER),
        )  # fmt: skip
        if gain >= 0 or (heat > 0.0 and accepted(random, -gain, heat)):
            total += gain
        else:
            undo(order, pos, log)
    log[0, 0] = 0
    return total


@inner
def accepted(random: Any, loss: int, heat: float) -> bool:
    """Whether a loss is put up with: with probability exp(-loss / heat)."""
    return loss < -heat * math.log((1.0 + draw(random, np.int64(1 << 30))) / (1 << 30))


@inner
def double_bridge(
    costs: Any,
    order: Any,
    pos: Any,
    spare: Any,
    log: Any,
    segs: Any,
    queue: Any,
    queued: Any,
    state: Any,
    base: int,
) -> int:
    """Exchange the stretches that ``segs`` says behind ``base``; returns what it costs.

    Nothing happens, at no cost, where an edge is forced.
    """
    n, back, count = order.size, np.int64(0), np.int64(4)
    b, c, d = segs[0], segs[1], segs[2]
    segs[0], segs[1], segs[2], segs[3] = c, d - 1, b, c - 1
    segs[4], segs[5], segs[6], segs[7] = 0, b - 1, d, n - 1
    cost = np.int64(0)
    for s in range(4):
        first = node_at(order, base, back, segs[2 * s])
        last = node_at(order, base, back, segs[2 * s + 1])
        before = node_at(order, base, back, segs[2 * s] - 1 if segs[2 * s] else n - 1)
        after = node_at(order, base, back, segs[2 * s + 2] if s < 3 else segs[0])
        old = called_price(costs, before, first)
        if old < 0:
            return np.int64(0)
        cost += called_price(costs, last, after) - old
    for s in range(8):
        push(queue, queued, state, node_at(order, base, back, segs[s]))
    apply(order, pos, spare, log, base, back, segs, count)
    return cost
