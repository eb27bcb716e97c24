"""The OR-Tools routing model: one vehicle whose depot is the virtual node of an open route.

Ends fix moves in the domains of ``Next``; these are the only side constraints
that the library's CP-SAT search sees.  Other rules are therefore priced.  A
``toll``, more than any tour costs, is due for every forbidden edge, and at
each end of an edge that parts a node from its forced partner.  No tour pays
fewer than ``tolls`` of them, and a tour keeps the rules if and only if it pays
just so many: a bound that exceeds this proves that there is no route.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from ortools.constraint_solver import pywrapcp

from tcp.instance import TourForm
from tcp.travel import Ints


class Routing:
    """A tour form as a routing model; costs are stated in multiples of ``unit``.

    Parameters
    ----------
    form : TourForm
        At least four nodes whose rules do not contradict each other.
    unit : int
        The instance's granularity.
    """

    def __init__(self, form: TourForm, unit: int = 1):
        self.form, self.unit = form, unit
        self.depot = form.virtual if form.virtual >= 0 else max(form.home, 0)
        self.manager = pywrapcp.RoutingIndexManager(form.size, 1, self.depot)
        self.model = pywrapcp.RoutingModel(self.manager)
        self._ends()
        self._objective()

    def _ends(self) -> None:
        """Forced edges that hang together with the depot have a direction: fix their moves."""
        partners: dict[int, list[int]] = {}
        for i, j in self.form.forced:
            partners.setdefault(i, []).append(j)
            partners.setdefault(j, []).append(i)
        self.loose = set(self.form.forced)
        for leaving, first in zip((True, False), list(partners.get(self.depot, [])), strict=False):
            here, there = self.depot, first
            while self._edge(here, there) in self.loose:
                self.loose.discard(self._edge(here, there))
                self._fix(here, there) if leaving else self._fix(there, here)
                onward = [p for p in partners[there] if p != here]
                if there == self.depot or not onward:
                    break
                here, there = there, onward[0]

    @staticmethod
    def _edge(i: int, j: int) -> tuple[int, int]:
        return min(i, j), max(i, j)

    def _fix(self, i: int, j: int) -> None:
        """Make ``j`` follow ``i``, and nobody else."""
        target = self._target(j)
        for k in range(self.form.size):
            if k == i:
                self.model.NextVar(self._source(k)).SetValue(target)
            elif k != j:
                self.model.NextVar(self._source(k)).RemoveValue(target)

    def _source(self, node: int) -> int:
        return self.model.Start(0) if node == self.depot else self.manager.NodeToIndex(node)

    def _target(self, node: int) -> int:
        return self.model.End(0) if node == self.depot else self.manager.NodeToIndex(node)

    def _objective(self) -> None:
        """Travel costs, and tolls on the edges that break a rule."""
        costs = self.form.full_matrix() // self.unit
        self.toll, self.tolls = 0, 0
        if self.loose or self.form.forbidden:
            self.toll = int(costs.max(axis=0).sum()) + 1
            costs = costs + self.toll * self._dues()
        self.largest = int(costs.max()) * self.form.size
        evaluator = self.model.RegisterTransitMatrix(costs.tolist())
        self.model.SetArcCostEvaluatorOfAllVehicles(evaluator)

    def _dues(self) -> Ints:
        """How many tolls each edge pays."""
        paired = np.zeros(self.form.size, dtype=np.int64)
        paired[sorted({v for edge in self.loose for v in edge})] = 1
        self.tolls = 2 * int(paired.sum()) - 2 * len(self.loose)
        dues = paired[:, None] + paired[None, :]
        for i, j in self.loose:
            dues[i, j] = dues[j, i] = 0
        for i, j in self.form.forbidden:
            dues[i, j] = dues[j, i] = dues[i, j] + 1
        return dues

    def bound(self, value: int) -> int | None:
        """What a bound on the objective says about tours, in quanta; None: there is no tour."""
        free = value - self.toll * self.tolls
        if self.toll and free >= self.toll:
            return None
        return max(0, free) * self.unit

    def assignment(self, tour: Sequence[int]) -> pywrapcp.Assignment:
        """A cyclic tour as a solution to start from; valid once the model is closed."""
        nodes = [int(v) for v in tour]
        at = nodes.index(self.depot)
        path = nodes[at + 1 :] + nodes[:at]
        for way in (path, path[::-1]):
            found = self.model.ReadAssignmentFromRoutes([way], True)
            if found is not None:
                return found
        return None

    def tour(self, solution: pywrapcp.Assignment | None = None) -> list[int] | None:
        """The cyclic tour of a solution (or of the current one, in a callback).

        None if it breaks a rule.
        """
        nodes, index = [], self.model.Start(0)
        while not self.model.IsEnd(index):
            nodes.append(self.manager.IndexToNode(index))
            after = self.model.NextVar(index)
            index = after.Value() if solution is None else solution.Value(after)
        used = {self._edge(nodes[k - 1], nodes[k]) for k in range(len(nodes))}
        kept = used.issuperset(self.form.forced) and used.isdisjoint(self.form.forbidden)
        return nodes if kept else None
