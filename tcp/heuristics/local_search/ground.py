"""The ground a search runs on: a tour form as flat arrays that compiled code reads.

Nodes are renumbered along a Hilbert curve, so that neighbours on the board are
neighbours in memory; :attr:`Ground.label` leads back to the form's numbers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcp.heuristics.local_search.compiled import compiled
from tcp.kernels import cost_of_move
from tcp.travel import Ints

Small = NDArray[np.int32]

SUM, MAX, GENERAL, MATRIX = 0, 1, 2, 3
"""How the search computes a cost: the first two need no multiplication."""

HOW, VIRTUAL, RULED = 16, 17, 18
"""Where ``rule`` says how costs are computed, which node is virtual (-1: none),
and whether some pairs are ruled; a packed cost rule comes before."""


class Ground(NamedTuple):
    """What the compiled search needs to know of a tour form with ``n`` nodes.

    ``rule``, ``xy`` and ``pairs`` tell costs (:func:`price`): ``xy[v]`` are
    coordinates, scaled where that makes |dx| + |dy| or max(|dx|, |dy|) the
    cost, or whole rows of a matrix.  ``pairs`` lists forced and forbidden
    edges u-v, both ways, as (u * n + v, what they cost extra), sorted; its first
    row is (n, 0).
    ``near[v]`` holds v's candidate nodes, nearest first, and ``dist[v]`` what
    they cost; the list of the virtual node is empty (see ``search.py``).
    ``mates[v]`` are the nodes to which v's forced edges lead (-1: none).
    ``label`` are the form's node numbers; ``scales`` see ``neighbours.py``.
    """

    rule: Ints
    xy: Ints
    pairs: Ints
    near: Small
    dist: Ints
    mates: Small
    label: Ints
    scales: tuple[float, float, float]

    @property
    def size(self) -> int:
        """Number of nodes."""
        return int(self.label.size)

    @property
    def virtual(self) -> int:
        """The virtual node, -1 where there is none."""
        return int(self.rule[VIRTUAL])

    @property
    def costs(self) -> tuple[Ints, Ints, Ints]:
        """What :func:`price` takes."""
        return self.rule, self.xy, self.pairs


@compiled
def price(rule: Any, xy: Any, pairs: Any, u: int, v: int) -> int:
    """Cost of the edge u-v; forced edges are worth, forbidden ones cost a lot on top."""
    if u == rule[VIRTUAL] or v == rule[VIRTUAL]:
        c = np.int64(0)
    elif rule[HOW] == MATRIX:
        c = xy[u, v]
    else:
        dx, dy = abs(xy[u, 0] - xy[v, 0]), abs(xy[u, 1] - xy[v, 1])
        if rule[HOW] == SUM:
            c = dx + dy
        elif rule[HOW] == MAX:
            c = max(dx, dy)
        else:
            c = _general(rule, dx, dy)
    if rule[RULED]:
        c += ruled(pairs, np.int64(u), np.int64(v))
    return c


@compiled
def _general(rule: Any, dx: int, dy: int) -> int:
    return cost_of_move(rule, dx, dy)


@compiled
def ruled(pairs: Any, u: int, v: int) -> int:
    """What the rules add to the cost of the edge u-v."""
    key = u * pairs[0, 0] + v  # the first row holds the number of nodes
    low, high = 1, pairs.shape[0]
    while low < high:
        middle = (low + high) // 2
        if pairs[middle, 0] < key:
            low = middle + 1
        else:
            high = middle
    return pairs[low, 1] if low < pairs.shape[0] and pairs[low, 0] == key else np.int64(0)


@compiled
def length(rule: Any, xy: Any, pairs: Any, order: Any) -> int:
    """Cost of a cyclic order of nodes, rules included."""
    total = np.int64(0)
    last = order[order.size - 1]
    for k in range(order.size):
        total += price(rule, xy, pairs, last, order[k])
        last = order[k]
    return total
