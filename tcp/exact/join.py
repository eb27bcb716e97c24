"""The shortest tour over the edges of several good ones, by the proof engine.

What all tours share is kept: a path that is in every one becomes one forced
edge between its ends.  Over what is left, often a few hundred nodes with
little more than one choice each, branch-and-cut finds the best tour there is
(tour merging: Cook and Seymour 2003; there shared edges are not kept, and a
branch decomposition takes the place of the cuts).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcp.exact.branch_and_cut.cutting import Cutter, Incumbent
from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.branch_and_cut.proof import Alive
from tcp.exact.branch_and_cut.relaxation import Relaxation
from tcp.exact.branch_and_cut.run import unit_of
from tcp.exact.branch_and_cut.tree import Tree
from tcp.instance import TourForm
from tcp.stop import Clock, Stop
from tcp.travel import Ints

LEAST, MOST = 4, 2_000
"""Nodes that are left when shared paths are one edge each: with fewer there is no choice, with
more the search may take minutes."""

TREE = 50
"""Most nodes of the search tree."""


@dataclass(frozen=True, eq=False)
class Core:
    """What several tours leave open.

    Parameters
    ----------
    tour : int64 array of shape (size,)
        The best of the tours: all nodes of the form.
    at : int64 array of shape (left,)
        Ascending places in it of the nodes that are left: ends of shared paths, single
        nodes, and the virtual node.
    shared : bool array of shape (left,)
        Whether what follows each of them in the tour, up to the next, is a shared path.
    nodes : int64 array of shape (left,)
        These nodes, ascending: the nodes of the smaller form.
    union : int64 array of shape (m, 2)
        Ends of the edges of all tours between nodes that are left, as numbers of the smaller form.
    """

    tour: Ints
    at: Ints
    shared: NDArray[np.bool_]
    nodes: Ints
    union: Ints

    @classmethod
    def of(cls, problem: Problem, tours: Sequence[Ints]) -> Core:
        """What ``tours``, the best of them first, leave open."""
        used = [problem.keys(tour, np.roll(tour, -1)) for tour in tours]
        union, count = np.unique(np.concatenate(used), return_counts=True)
        common = np.isin(used[0], union[count == len(tours)])
        kept = ~(common & np.roll(common, 1)) | (tours[0] == problem.form.virtual)
        at = np.flatnonzero(kept)
        nodes = np.sort(tours[0][at])
        ends = np.column_stack(problem.pairs(union))
        ends = ends[np.isin(ends, nodes).all(axis=1)]
        return cls(tours[0], at, common[at], nodes, np.searchsorted(nodes, ends))

    @cached_property
    def start(self) -> Ints:
        """The best tour over what is left, as numbers of the smaller form."""
        return np.searchsorted(self.nodes, self.tour[self.at])

    def form(self, form: TourForm) -> TourForm:
        """The smaller form: shared paths are forced edges, and what they cost is left out."""
        real = self.nodes[self.nodes != form.virtual]
        ends = np.sort(np.column_stack((self.start, np.roll(self.start, -1))), axis=1)
        banned = np.array(form.forbidden, np.int64).reshape(-1, 2)
        banned = banned[np.isin(banned, self.nodes).all(axis=1)]
        return replace(
            form,
            x=form.x[real],
            y=form.y[real],
            matrix=None if form.matrix is None else form.matrix[np.ix_(real, real)],
            holes=len(real),
            size=len(self.nodes),
            home=-1,
            virtual=-1 if form.virtual < 0 else len(real),
            forced=_tuples(ends[self.shared]),
            forbidden=_tuples(np.searchsorted(self.nodes, banned)),
        )

    def expand(self, tour: Ints) -> Ints:
        """A tour over the smaller form with all nodes in it again."""
        left = len(self.at)
        along = np.argsort(self.start)[tour]
        ends = np.append(self.at[1:], self.at[0] + len(self.tour))
        found = []
        for a, b in zip(along.tolist(), np.roll(along, -1).tolist(), strict=True):
            found.append(self.tour[self.at[a] : self.at[a] + 1])
            if self.shared[a] and b == (a + 1) % left:
                found.append(self._between(self.at[a], ends[a]))
            elif self.shared[b] and a == (b + 1) % left:
                found.append(self._between(self.at[b], ends[b])[::-1])
        return np.concatenate(found)

    def _between(self, begin: int, end: int) -> Ints:
        """The nodes between two places of the tour, cyclically."""
        return self.tour[np.arange(begin + 1, end) % len(self.tour)]


def join(form: TourForm, tours: Sequence[Ints], clock: Clock, granularity: int = 1) -> Ints:
    """A shortest tour over the edges of ``tours`` that has every edge they share.

    Parameters
    ----------
    form : TourForm
        What the tours are over.
    tours : sequence of int64 arrays of shape (form.size,)
        Tours that respect the form's rules, the best of them first.  Where they leave more than
        :data:`MOST` nodes open, only the first half of them counts, and so on.
    clock : Clock
        When to be content with the best found so far; at the latest after :data:`TREE` nodes.
    granularity : int
        Divides the cost of every pair.

    Returns
    -------
    int64 array
        A tour over the form, never longer than the first; that one itself where nothing
        shorter is found.
    """
    best, whole = tours[0], Problem(form, granularity)
    core = Core.of(whole, tours)
    while len(core.at) > MOST and len(tours) > 2:
        tours = tours[: (len(tours) + 1) // 2]
        core = Core.of(whole, tours)
    if not LEAST <= len(core.at) <= MOST:
        return best
    problem = Problem(core.form(form), granularity)
    incumbent = Incumbent(problem, core.start)
    if not incumbent.offer(core.start):
        return best
    keys = np.union1d(problem.keys(*core.union.T), problem.forced)
    cutter = Cutter(
        problem,
        Relaxation(problem, keys, unit_of(problem)),
        incumbent,
        clock.part(Stop(iterations=TREE)),
        alive=Alive.of(problem, keys),
    )
    Tree(cutter).run()
    found = core.expand(incumbent.tour)
    return found if form.tour_cost(found) < form.tour_cost(best) else best


def _tuples(pairs: Ints) -> tuple[tuple[int, int], ...]:
    """Rows as a form lists its pairs."""
    return tuple(sorted({(int(a), int(b)) for a, b in pairs}))
