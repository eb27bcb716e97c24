"""A tour along an LP solution: its intervals make better teeth than those of the best tour."""

from __future__ import annotations

import numpy as np

from tcp.exact.branch_and_cut.support import Support
from tcp.heuristics.local_search.ground import Small
from tcp.heuristics.local_search.starts import link
from tcp.jit import kernel
from tcp.travel import Ints


def joined(support: Support, order: Ints) -> Ints:
    """A tour through the heaviest edges of a support graph, its paths in a tour's order."""
    heaviest = np.argsort(-support.x, kind="stable")
    links = np.full((support.size, 2), -1, np.int32)
    root = np.arange(support.size, dtype=np.int32)
    link(links, root, support.i[heaviest], support.j[heaviest])
    return _along(links, order)


@kernel
def _along(links: Small, order: Ints) -> Ints:
    """All paths of the links, each from its end that comes first in the order."""
    size = len(order)
    tour, seen, count = np.empty(size, np.int64), np.zeros(size, np.bool_), 0
    for first in order:
        v = first
        if links[v, 1] >= 0:
            continue
        while v >= 0 and not seen[v]:
            seen[v] = True
            tour[count] = v
            count += 1
            v = links[v, 1] if links[v, 0] < 0 or seen[links[v, 0]] else links[v, 0]
    return tour
