"""A tour along an LP solution: its intervals make better teeth than those of the best tour."""

from __future__ import annotations

import numpy as np

from tcp.exact.branch_and_cut.support import Support, find
from tcp.travel import Ints


def joined(support: Support, order: Ints) -> Ints:
    """A tour through the heaviest edges of a support graph, its paths in a tour's order."""
    size = support.size
    degree, root = np.zeros(size, np.int64), np.arange(size)
    links: list[list[int]] = [[] for _ in range(size)]
    for e in np.argsort(-support.x, kind="stable"):
        i, j = int(support.i[e]), int(support.j[e])
        if degree[i] < 2 and degree[j] < 2 and find(root, i) != find(root, j):
            root[find(root, i)] = find(root, j)
            degree[i] += 1
            degree[j] += 1
            links[i].append(j)
            links[j].append(i)
    tour: list[int] = []
    seen = np.zeros(size, bool)
    for v in order.tolist():
        if seen[v] or len(links[v]) == 2:
            continue
        while True:
            seen[v] = True
            tour.append(v)
            onward = [w for w in links[v] if not seen[w]]
            if not onward:
                break
            v = onward[0]
    return np.array(tour, np.int64)
