"""Groups of nodes that lie close together and apart from all others: the last resort of branching.

Where holes stand in rows and grids, tours of one length lead through a grid in very many ways,
and to forbid one pair gains nothing.  What costs is how often a tour comes into the grid.
"""

from __future__ import annotations

from heapq import heappop, heappush
from itertools import count

import numpy as np

from tcp.exact.branch_and_cut.cuts import Cut
from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.branch_and_cut.support import find

LEAST = 3
"""Fewest nodes of a cluster, and fewest outside it."""

MOST = 400
"""Most clusters of a problem: those that lie farthest apart, for what is between their nodes."""


def clusters(problem: Problem) -> list[Cut]:
    """The clusters of single linkage: what pairs up to some cost connect, and no pair of it more.

    Of the candidate pairs, in the order of their costs; the virtual node is in no cluster.
    """
    i, j = problem.pairs(problem.neighbours)
    real = j != problem.form.virtual
    cost = problem.costs(i, j)[real]
    i, j = i[real], j[real]
    root = np.arange(problem.size)
    members: dict[int, list[int]] = {v: [v] for v in range(problem.size)}
    inside = dict.fromkeys(members, 0)
    found: list[tuple[float, int, list[int]]] = []  # a heap: the lists of all would fill O(n^2)
    age = count()
    for k in np.argsort(cost, kind="stable"):
        a, b = find(root, i[k]), find(root, j[k])
        if a == b:
            continue
        height = int(cost[k])
        for part in (a, b):
            apart = LEAST <= len(members[part]) <= problem.size - LEAST
            if apart and height > inside[part]:
                heappush(found, (height / (inside[part] + 1), -next(age), members[part]))
        while len(found) > MOST:
            heappop(found)
        members[a] = members[a] + members.pop(b)
        root[b], inside[a] = a, height
    return [Cut.of([nodes]) for _, _, nodes in sorted(found, reverse=True)]
