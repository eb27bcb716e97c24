"""Separation of a point inward of the LP solution (in-out separation; Ben-Ameur and Neto 2007).

An LP solution is a vertex that jumps about from round to round.  Cuts that are violated
by the mean of it and of where the LP has been of late cut deeper: fewer of them reach
a better bound, until they have no more to give and the solution itself must be cut off.
"""

from __future__ import annotations

import numpy as np

from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.branch_and_cut.proof import Floats
from tcp.exact.branch_and_cut.support import Support
from tcp.travel import Ints

MEMORY = 0.7
"""What remains of the mean when a round's solution enters it."""

STEP = 0.5
"""How far the point lies from the mean towards the solution."""

VISIBLE = 1e-3
"""Least value of an edge at the point; below, it is forgotten."""


class Mean:
    """The running mean of a node's LP solutions."""

    def __init__(self) -> None:
        self.keys = np.zeros(0, np.int64)
        self.x = np.zeros(0)

    def inward(self, problem: Problem, keys: Ints, x: Floats) -> Support | None:
        """Take a solution in and return the support of the point; None for the first one."""
        order = np.argsort(keys)
        keys, x = keys[order], x[order]
        first = not len(self.keys)
        old = x if first else self._at(keys)
        self.keys, self.x = keys, MEMORY * old + (1.0 - MEMORY) * x
        if first:
            return None
        point = STEP * x + (1.0 - STEP) * self.x
        seen = point > VISIBLE
        i, j = problem.pairs(keys[seen])
        return Support.of(problem.size, i, j, point[seen])

    def _at(self, keys: Ints) -> Floats:
        """The mean's values of these pairs; 0 for those it does not know."""
        at = np.minimum(np.searchsorted(self.keys, keys), len(self.keys) - 1)
        return np.where(self.keys[at] == keys, self.x[at], 0.0)
