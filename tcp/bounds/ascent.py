"""The ascent of Held and Karp: node potentials under which a lightest tree looks like a tour.

Each step looks at one tree, and lowers or raises the potential of every node by what its degree
there differs from 2.  The step is a geometrically falling share of the mean tree edge, its
direction a mix of this tree's degrees and the last one's (M. Held and R. M. Karp, "The
traveling-salesman problem and minimum spanning trees: part II", Mathematical Programming 1 (1971)).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tcp.bounds.spanning import kruskal
from tcp.travel import Ints

FIRST, LAST = 2.0, 0.0003
"""First and last step, as shares of the mean length of a tree edge."""


class Ascent:
    """Potentials on their way up.

    Parameters
    ----------
    n : int
        Number of nodes.
    length : float
        Mean cost of a tree edge.
    total : int
        Steps there will be.
    """

    def __init__(self, n: int, length: float, total: int):
        self.length, self.total, self.steps = length, total, 0
        self.now: Any = np.zeros(n)
        self._drift: Any = np.zeros(n)

    def weights(self, ends: Ints, costs: Any) -> Any:
        """What pairs of nodes weigh: their costs less the potentials of both."""
        return costs - self.now[ends[:, 0]] - self.now[ends[:, 1]]

    def move(self, degree: Ints) -> None:
        """One step, after a tree of these degrees."""
        missing = 2.0 - degree
        self._drift = missing if self.steps == 0 else 0.7 * missing + 0.3 * self._drift
        pace = FIRST * self.length * (LAST / FIRST) ** (self.steps / self.total)
        self.now = self.now + pace * self._drift
        self.steps += 1


def lightest_tree(n: int, ends: Ints, weights: Any, forced: int) -> tuple[Ints, Ints]:
    """A lightest tree of pairs, the first ``forced`` of them anyway: its pairs, its degrees."""
    return kruskal(n, ends, ranked(weights[forced:]) + forced, forced)


def ranked(weights: Any) -> Ints:
    """Indices from the lightest on, equal ones as they stand: a stable sort, several times faster.

    numpy's quick sort is vectorised, but orders ties as the processor likes.
    """
    rank: Ints = np.argsort(weights)
    light = weights[rank]
    tied = light[1:] == light[:-1]
    if tied.any():
        group = np.append(0, np.cumsum(~tied))
        rank = rank[np.argsort(group * rank.size + rank)]
    return rank
