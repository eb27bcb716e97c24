"""The ground a search runs on: a tour form as flat arrays that compiled code reads.

Nodes are renumbered along a Hilbert curve, so that neighbours on the board are
neighbours in memory; :attr:`Ground.label` leads back to the form's numbers.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcp.jit import allocating, compiled, inlined, inner
from tcp.kernels import cost_of_move
from tcp.travel import Ints

Small = NDArray[np.int32]

HOW, VIRTUAL, MATRIX, RULED = 16, 17, 18, 19
"""What ``rule`` says behind a packed cost rule: how costs are computed, which node is virtual
(-1: none), whether ``xy`` holds a matrix, and whether some pairs are ruled."""

SUM, MAX, ROOT, OTHERWISE = 0, 1, 2, 3
"""How costs are computed; the first two need no multiplication, the first three know no rules."""

CLEAR = 1e-6
"""A root this far from where rounding changes is rounded right by floats: what is under it has
less than 60 bits (:meth:`tcp.travel.Travel.bind`), so that 53 bits leave an error of 3e-7."""


class Ground(NamedTuple):
    """What the compiled search needs to know of a tour form with ``n`` nodes.

    ``rule``, ``xy`` and ``pairs`` tell costs (:func:`price`): ``xy[v]`` are
    coordinates, scaled where that makes |dx| + |dy| or max(|dx|, |dy|) the
    cost, or whole rows of a matrix.  ``pairs`` lists forced and forbidden
    edges u-v, both ways, as (u * n + v, what they cost extra), sorted; its first
    row is (n, what all forced edges are worth).
    ``near[v]`` holds v's candidate nodes, nearest first, and ``dist[v]`` what
    they cost; the list of the virtual node is empty (see ``search.py``).
    ``mates[v]`` are the nodes to which v's forced edges lead (-1: none).
    ``label`` are the form's node numbers; ``scales`` see :func:`tcp.nearness.norm`.
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

    def order(self, tour: Ints) -> Small:
        """A tour of the form, all nodes by their numbers there, as an order of this ground."""
        number = np.empty(self.size, np.int32)
        number[self.label] = np.arange(self.size)
        return number[tour]

    @property
    def costs(self) -> tuple[Ints, Ints, Ints]:
        """What :func:`price` takes: ``rule``, ``xy`` and ``pairs``."""
        return self.rule, self.xy, self.pairs


@inlined
def price(costs: Any, u: int, v: int) -> int:
    """Cost of the edge u-v; forced edges are worth, forbidden ones cost a lot on top."""
    rule, xy, _ = costs
    how = rule[HOW]
    if how != OTHERWISE:
        if u == rule[VIRTUAL] or v == rule[VIRTUAL]:
            return np.int64(0)
        dx, dy = abs(xy[u, 0] - xy[v, 0]), abs(xy[u, 1] - xy[v, 1])
        if how != ROOT:
            return dx + dy if how == SUM else max(dx, dy)
        square = rule[2] * dx * dx + rule[3] * dy * dy
        root = math.sqrt(square / rule[4]) + (1.0 if rule[1] else 0.5)
        whole = np.int64(root)
        if CLEAR < root - whole < 1 - CLEAR:
            return whole
    return elaborate_price(costs, np.int64(u), np.int64(v))


@inner
def called_price(costs: Any, u: int, v: int) -> int:
    """The same as a call, for everything but the inner search.

    Copied into all its callers :func:`price` takes a third of the time to compile them.
    """
    return price(costs, u, v)


@inner
def elaborate_price(costs: Any, u: int, v: int) -> int:
    """The same for everything that is not a plain sum or maximum."""
    rule, xy, pairs = costs
    c = np.int64(0)
    if u != rule[VIRTUAL] and v != rule[VIRTUAL]:
        if rule[MATRIX]:
            c = xy[u, v]
        else:
            c = cost_of_move(rule, xy[u, 0] - xy[v, 0], xy[u, 1] - xy[v, 1])
    return c + ruled(pairs, u, v) if rule[RULED] else c


@inner
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


@allocating
def prices(costs: Any, u: Any, v: Any) -> Any:
    """Costs of many edges."""
    found = np.empty(u.size, np.int64)
    for k in range(u.size):
        found[k] = called_price(costs, np.int32(u[k]), np.int32(v[k]))
    return found


@compiled
def length(costs: Any, order: Any) -> int:
    """Cost of a cyclic order of nodes, the true one if it respects the rules."""
    total = costs[2][0, 1]
    last = order[order.size - 1]
    for k in range(order.size):
        total += called_price(costs, last, order[k])
        last = order[k]
    return total
