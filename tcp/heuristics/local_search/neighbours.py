"""Who lies near whom: Hilbert order and candidate lists in the travel model's own norm."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcp.heuristics.local_search.ground import MATRIX, Ground, called_price
from tcp.instance import TourForm
from tcp.jit import allocating, inner
from tcp.nearness import norm, places
from tcp.travel import Ints

GRID_BITS = 20
"""The Hilbert curve visits a grid of 2^20 x 2^20 cells."""

CHUNK = 65_536
"""Nodes whose neighbours are queried at a time, which bounds the memory."""

LOOK = 3
"""How many times the wanted neighbours are looked at, to find some in every quadrant."""


def points(ground: Ground, nodes: Any) -> tuple[NDArray[np.float64], float]:
    """Places of nodes for a k-d tree and the exponent of the norm that ranks them."""
    fx, fy, p = ground.scales
    return places(ground.xy[nodes], fx, fy), p


def hilbert_order(form: TourForm) -> Ints:
    """The real nodes of ``form`` along a Hilbert curve (file order for a matrix)."""
    if form.matrix is not None or form.real < 3:
        return np.arange(form.real)
    fx, fy, _ = norm(form.rule)
    x, y = (form.x - form.x.min()) * fx, (form.y - form.y.min()) * fy
    unit = (2**GRID_BITS - 1) / max(float(x.max()), float(y.max()), 1e-9)
    keys = _hilbert_keys((x * unit).astype(np.int64), (y * unit).astype(np.int64), GRID_BITS)
    return np.argsort(keys, kind="stable")


@allocating
def _hilbert_keys(x: Any, y: Any, bits: int) -> Any:
    """Position of each cell on the curve (Skilling's rotations, two dimensions)."""
    keys = np.empty(x.size, np.int64)
    for i in range(x.size):
        a, b, key = x[i], y[i], np.int64(0)
        side = np.int64(1) << (bits - 1)
        while side > 0:
            right = 1 if a & side else 0
            upper = 1 if b & side else 0
            key += side * side * ((3 * right) ^ upper)
            if upper == 0:
                if right == 1:
                    a, b = side - 1 - (a & (side - 1)), side - 1 - (b & (side - 1))
                a, b = b, a
            a &= side - 1
            b &= side - 1
            side >>= 1
        keys[i] = key
    return keys


def near_nodes(
    ground: Ground, real: int, width: int, late: Callable[[], bool] = lambda: False
) -> tuple[NDArray[np.int32], Ints]:
    """Candidate nodes of every real node and their costs, nearest first.

    Parameters
    ----------
    ground : Ground
        Without its lists yet.
    real : int
        Number of nodes with coordinates; they are the first ones.
    width : int
        Wanted length of a list: the nearest nodes, but at least one from
        every quadrant where there is one close by.
    late : callable
        Asked after every :data:`CHUNK` nodes; if it is too late, the lists that
        are still missing stay empty.

    Returns
    -------
    near : int32 array (n, width)
        Rows of real nodes are padded with the node itself, which the search
        recognises as the end of the list.
    dist : int64 array (n, width)
        Costs of these edges.
    """
    n = ground.size
    width = max(1, min(width, real - 1))
    near = np.repeat(np.arange(n, dtype=np.int32)[:, None], width, axis=1)
    dist = np.full((n, width), np.iinfo(np.int64).max // 4)
    if real < 2:
        return near, dist
    banned = ground.pairs[1:][ground.pairs[1:, 1] > 0, 0] // n
    most = int(np.bincount(banned, minlength=1).max())
    look = min(real, LOOK * width + 1 + most)
    if ground.rule[MATRIX]:
        for v in range(real):
            row = np.argpartition(ground.xy[v], look - 1)[:look].astype(np.int32)
            _pick(ground.costs, v, row[None, :], near, dist, 0)
        return near, dist
    from scipy.spatial import cKDTree

    where, p = points(ground, np.arange(real))
    tree = cKDTree(where)
    for low in range(0, real, CHUNK):
        if low and late():
            break
        found = tree.query(where[low : low + CHUNK], look, p=p)[1]
        balance = width // 2 if width > 4 else 0
        _pick(ground.costs, low, found.astype(np.int32), near, dist, balance)
    return near, dist


@allocating
def _pick(costs: Any, low: int, found: Any, near: Any, dist: Any, balance: int) -> None:
    """Fill the lists of the nodes from ``low`` on out of what was found around them.

    The last ``balance`` places go to quadrants that have nobody yet, as far as possible.
    """
    width, look = near.shape[1], found.shape[1]
    cost = np.empty(look, np.int64)
    for i in range(found.shape[0]):
        v = np.int32(low + i)
        row = found[i]
        size = np.int64(0)
        for k in range(look):
            if row[k] != v:
                cost[size], row[size] = called_price(costs, v, row[k]), row[k]
                size += 1
        sort_by(cost, row, size)
        picked = min(size, width - balance)
        quadrants = np.int64(0)
        for k in range(picked):
            quadrants |= _quadrant(costs[1], v, row[k])
        for wanted in range(2):  # first the empty quadrants, then simply the nearest
            for k in range(picked, size):
                if picked == width:
                    break
                side = _quadrant(costs[1], v, row[k])
                if wanted == 1 or not quadrants & side:
                    quadrants |= side
                    c, w = cost[k], row[k]
                    for m in range(k, picked, -1):
                        cost[m], row[m] = cost[m - 1], row[m - 1]
                    cost[picked], row[picked] = c, w
                    picked += 1
        sort_by(cost, row, picked)
        for k in range(picked):
            near[v, k], dist[v, k] = row[k], cost[k]


@inner
def sort_by(costs: Any, nodes: Any, size: int) -> None:
    """Sort the first nodes by cost, equal ones as they stand."""
    for k in range(1, size):
        c, w = costs[k], nodes[k]
        m = k
        while m > 0 and costs[m - 1] > c:
            costs[m], nodes[m] = costs[m - 1], nodes[m - 1]
            m -= 1
        costs[m], nodes[m] = c, w


@inner
def _quadrant(xy: Any, v: int, w: int) -> int:
    """One bit for the quadrant of v in which w lies, turned so that axes belong to one each."""
    dx, dy = xy[w, 0] - xy[v, 0], xy[w, 1] - xy[v, 1]
    if dx > 0 and dy >= 0:
        return 1
    if dx <= 0 and dy > 0:
        return 2
    if dx < 0:
        return 4
    return 8
