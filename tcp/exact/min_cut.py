"""Which subtour constraints a point violates: components, then minimum cuts, exactly."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

Floats = NDArray[np.float64]


def violated_sets(
    size: int, support: Mapping[tuple[int, int], float], slack: float = 1e-6
) -> list[frozenset[int]]:
    """Node sets that are left by less than 2.

    A disconnected support violates the constraint of every component.  A
    connected one is searched by Stoer and Wagner's algorithm (1997), whose
    phases end in cuts of which the least is a minimum cut: none is returned if
    and only if every set is left by at least ``2 - slack``.

    Parameters
    ----------
    size : int
        Number of nodes.
    support : mapping
        Values of the undirected edges, i < j.
    slack : float
        Violation that is not worth a cut.

    Returns
    -------
    list of frozenset of int
        Different sets, each at most half of the nodes.
    """
    i, j = np.array(list(support), dtype=np.int64).reshape(-1, 2).T
    values = np.fromiter(support.values(), dtype=np.float64)
    graph = coo_matrix((values, (i, j)), shape=(size, size))
    count, label = connected_components(graph, directed=False)
    if count > 1:
        sets = [frozenset(np.flatnonzero(label == k).tolist()) for k in range(count)]
    else:
        dense = graph.toarray()
        sets = _light_cuts(dense + dense.T, 2 - slack)
    everyone = frozenset(range(size))
    return sorted({min(s, everyone - s, key=_order) for s in sets}, key=_order)


def _order(nodes: frozenset[int]) -> tuple[int, list[int]]:
    return len(nodes), sorted(nodes)


def _light_cuts(weight: Floats, limit: float) -> list[frozenset[int]]:
    """All cuts of a phase lighter than ``limit``; the least of all phases is a minimum cut."""
    weight = weight.copy()
    members = [{v} for v in range(len(weight))]
    alive = np.ones(len(weight), dtype=bool)
    found = []
    for _ in range(len(weight) - 1):
        before, last, value = _phase(weight, alive)
        if value < limit:
            found.append(frozenset(members[last]))
        members[before] |= members[last]
        weight[before] += weight[last]
        weight[:, before] += weight[:, last]
        weight[before, before] = 0.0
        alive[last] = False
    return found


def _phase(weight: Floats, alive: NDArray[np.bool_]) -> tuple[int, int, float]:
    """A maximum adjacency order: its last two nodes, and how tightly the last is attached."""
    pull = np.where(alive, 0.0, -np.inf)
    last = before = -1
    value = 0.0
    for _ in range(int(alive.sum())):
        before, last = last, int(pull.argmax())
        value = float(pull[last])
        pull += weight[last]
        pull[last] = -np.inf
    return before, last, value
