"""Iterated local search: a small random disturbance, repaired, kept unless worse.

The disturbance is a double bridge (Martin, Otto and Felten 1991) of three
short neighbouring stretches of the tour, A B C D -> A D C B: four exchanged
edges that no sequential exchange of three can take back.  Only the nodes it
touched are looked at again, so a kick costs the same on a board of any size.

Keeping only what is not worse gets stuck after some ten kicks a node.  A loss
is therefore kept with probability exp(-loss / heat), as in simulated annealing
(Martin, Otto and Felten 1991 do so for their large steps), and the caller
lowers the heat to zero.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tcp.heuristics.local_search.compiled import compiled, inlined
from tcp.heuristics.local_search.exchange import apply, keep, node_at, undo
from tcp.heuristics.local_search.ground import bound_together, price
from tcp.heuristics.local_search.search import push, settle


@compiled
def draw(state: Any, below: int) -> int:
    """Random whole number in [0, below) (xorshift64*); ``state`` is one uint64."""
    s = state[0]
    s ^= s >> np.uint64(12)
    s ^= s << np.uint64(25)
    s ^= s >> np.uint64(27)
    state[0] = s
    return np.int64(((s * np.uint64(2685821657736338717)) >> np.uint64(33)) % np.uint64(below))


@compiled
def kick_and_repair(
    g: Any, t: Any, w: Any, random: Any, kicks: int, reach: int, heat: float
) -> int:
    """Try ``kicks`` disturbances of stretches up to ``reach`` nodes; returns the total gain.

    The gain is negative where more losses were put up with than gains found.
    """
    n = t.order.size
    total = np.int64(0)
    reach = min(reach, (n - 1) // 3)
    for _ in range(kicks):
        cost = _disturb(g, t, w, random, reach)
        gain = settle(g, t, w, np.int64(1) << 60) - cost
        if gain >= 0 or (heat > 0.0 and accepted(random, -gain, heat)):
            total += gain
            keep(t)
        else:
            undo(t)
    return total


@inlined
def accepted(random: Any, loss: int, heat: float) -> bool:
    """Whether a loss is put up with: with probability exp(-loss / heat)."""
    return loss < -heat * math.log((1.0 + draw(random, 1 << 30)) / (1 << 30))


@compiled
def _disturb(g: Any, t: Any, w: Any, random: Any, reach: int) -> int:
    """One local double bridge; returns what it costs (0 and no change if an edge is forced)."""
    n = t.order.size
    base = draw(random, n)
    b = 1 + draw(random, reach)
    c = b + 1 + draw(random, reach)
    d = c + 1 + draw(random, reach)
    cuts = (n - 1, b - 1, c - 1, d - 1)
    cost = np.int64(0)
    for q in cuts:
        u = node_at(t, base, 0, q)
        v = node_at(t, base, 0, q + 1 if q + 1 < n else 0)
        if bound_together(g, u, v):
            return 0
        cost -= price(g, u, v)
    segs = w.segs[0]
    segs[0, 0], segs[0, 1] = c, d - 1
    segs[1, 0], segs[1, 1] = b, c - 1
    segs[2, 0], segs[2, 1] = 0, b - 1
    segs[3, 0], segs[3, 1] = d, n - 1
    for s in range(4):
        u = node_at(t, base, 0, segs[s, 1])
        v = node_at(t, base, 0, segs[s + 1 if s < 3 else 0, 0])
        cost += price(g, u, v)
        push(w, u)
        push(w, v)
    apply(t, base, 0, segs, 4)
    return cost
