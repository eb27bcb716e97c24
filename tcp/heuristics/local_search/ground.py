"""The ground a search runs on: a tour form as flat arrays that compiled code reads.

Nodes are renumbered along a Hilbert curve, so that neighbours on the board are
neighbours in memory; :attr:`Ground.label` leads back to the form's numbers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcp.heuristics.local_search.compiled import compiled, inlined
from tcp.kernels import cost_of_move
from tcp.travel import Ints

Small = NDArray[np.int32]

SUM, MAX, GENERAL, MATRIX = 0, 1, 2, 3
"""How the search computes a cost: the first two need no multiplication."""


class Ground(NamedTuple):
    """What the compiled search needs to know of a tour form with ``n`` nodes.

    ``form`` is SUM, where |dx| + |dy| is the cost (``x`` and ``y`` are scaled
    for that), MAX alike, GENERAL for what ``rule`` says, or MATRIX.
    ``near[v]`` holds v's candidate nodes, nearest first, and ``dist[v]`` what
    they cost; the list of the virtual node is empty (see ``search.py``).
    ``mates[v]`` are the nodes to which v's forced edges lead (-1: none).  The
    forbidden partners of v are ``ban[ban_from[v]:ban_from[v + 1]]``, sorted;
    a forbidden edge costs ``penalty`` on top (0: nothing is forbidden).
    ``label`` are the form's node numbers; ``scales`` see ``neighbours.py``.
    """

    x: Ints
    y: Ints
    form: int
    rule: Ints
    matrix: Ints
    virtual: int
    penalty: int
    near: Small
    dist: Ints
    mates: Small
    ban_from: Ints
    ban: Small
    label: Ints
    scales: tuple[float, float, float]


@compiled
def banned(ban_from: Any, ban: Any, u: int, v: int) -> bool:
    """Whether the edge u-v is forbidden."""
    low, high = ban_from[u], ban_from[u + 1]
    while low < high:
        middle = (low + high) // 2
        if ban[middle] < v:
            low = middle + 1
        else:
            high = middle
    return low < ban_from[u + 1] and ban[low] == v


@compiled
def general_cost(rule: Any, dx: int, dy: int) -> int:
    """Cost of a move under any rule with coordinates."""
    return cost_of_move(rule, dx, dy)


@inlined
def price(g: Any, u: int, v: int) -> int:
    """Cost of the edge u-v, forbidden ones penalised."""
    if u == g.virtual or v == g.virtual:
        c = np.int64(0)
    else:
        dx, dy = abs(g.x[u] - g.x[v]), abs(g.y[u] - g.y[v])
        if g.form == SUM:
            c = dx + dy
        elif g.form == MAX:
            c = max(dx, dy)
        elif g.form == GENERAL:
            c = general_cost(g.rule, dx, dy)
        else:
            c = g.matrix[u, v]
        if g.penalty > 0 and banned(g.ban_from, g.ban, u, v):
            c += g.penalty
    return c


@inlined
def bound_together(g: Any, u: int, v: int) -> bool:
    """Whether the edge u-v is forced."""
    return g.mates[u, 0] == v or g.mates[u, 1] == v


@compiled
def length(g: Any, order: Any) -> int:
    """Cost of a cyclic order of nodes, forbidden edges penalised."""
    total = np.int64(0)
    last = order[order.size - 1]
    for k in range(order.size):
        total += price(g, last, order[k])
        last = order[k]
    return total
