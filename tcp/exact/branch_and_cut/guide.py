"""A tour along an LP solution: its intervals make better teeth than those of the best tour."""

from __future__ import annotations

import numpy as np

from tcp.exact.branch_and_cut.support import Support, find
from tcp.jit import kernel
from tcp.travel import Ints


def joined(support: Support, order: Ints) -> Ints:
    """A tour through the heaviest edges of a support graph, its paths in a tour's order."""
    heaviest = np.argsort(-support.x, kind="stable")
    return _joined(order, support.i[heaviest], support.j[heaviest])


@kernel
def _joined(order: Ints, i: Ints, j: Ints) -> Ints:
    size = len(order)
    links, root = np.full((size, 2), -1, np.int64), np.arange(size)
    for e in range(len(i)):
        a, b = i[e], j[e]
        if links[a, 1] < 0 and links[b, 1] < 0 and find(root, a) != find(root, b):
            root[find(root, a)] = find(root, b)
            links[a, 1 if links[a, 0] >= 0 else 0] = b
            links[b, 1 if links[b, 0] >= 0 else 0] = a
    tour, seen, count = np.empty(size, np.int64), np.zeros(size, np.bool_), 0
    for v in order:
        if links[v, 1] >= 0:
            continue
        while v >= 0 and not seen[v]:  # from a path's end along it
            seen[v] = True
            tour[count] = v
            count += 1
            v = links[v, 1] if links[v, 0] < 0 or seen[links[v, 0]] else links[v, 0]
    return tour
