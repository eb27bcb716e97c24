"""Three mixed-integer formulations in PuLP, with the same rooms: variables, rows, objective.

``subtour``  Dantzig, Fulkerson, Johnson (1954): a variable per undirected edge,
             every node has degree 2, subtour cuts are added as they are needed.
``mtz``      Miller, Tucker, Zemlin (1960), lifted by Desrochers and Laporte
             (1991): a variable per directed move and the position of each node.
``flow``     Gavish and Graves (1978): a variable per directed move and a flow
             from the root that leaves one unit at every node.

Costs are whole multiples of the instance's granularity.  The root is the
virtual node of an open route.  At least four nodes.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence

import pulp

from tcp.instance import TourForm

Edge = tuple[int, int]


class Formulation(ABC):
    """A tour form as a PuLP problem.

    Parameters
    ----------
    form : TourForm
        At least four nodes.
    unit : int
        Costs are stated in multiples of it.
    """

    def __init__(self, form: TourForm, unit: int = 1):
        self.form, self.unit = form, unit
        self.root = form.virtual if form.virtual >= 0 else max(form.home, 0)
        self.others = [i for i in range(form.size) if i != self.root]
        self.problem = pulp.LpProblem("tour", pulp.LpMinimize)
        self.moves: dict[Edge, pulp.LpVariable] = {}
        self._variables()
        self._objective()
        self._degrees()
        self._connection()
        self._forced()

    @abstractmethod
    def _variables(self) -> None:
        """A binary variable per move that is not forbidden, and whatever connects them."""

    @abstractmethod
    def _degrees(self) -> None:
        """Every node is entered and left once."""

    @abstractmethod
    def _connection(self) -> None:
        """What keeps the moves from closing several circles."""

    @abstractmethod
    def propose(self, tour: Sequence[int]) -> None:
        """Give every variable its value in a cyclic tour, as a start for the solver."""

    def _moves(self, pairs: Iterable[Edge]) -> None:
        banned = set(self.form.forbidden)
        self.moves = {
            (i, j): self.problem.add_variable(f"x_{i}_{j}", cat=pulp.LpBinary)
            for i, j in pairs
            if (min(i, j), max(i, j)) not in banned
        }

    def _objective(self) -> None:
        costs = self.form.full_matrix() // self.unit
        self.problem.setObjective(
            pulp.LpAffineExpression([(x, int(costs[move])) for move, x in self.moves.items()])
        )

    def _forced(self) -> None:
        """A forced edge is used in one direction or the other."""
        for i, j in self.form.forced:
            both = [self.moves[m] for m in ((i, j), (j, i)) if m in self.moves]
            self._row(f"forced_{i}_{j}", pulp.lpSum(both) == 1)

    def _row(self, name: str, constraint: pulp.LpConstraint) -> None:
        self.problem.addConstraint(constraint, name)

    def _sum(self, moves: Iterable[Edge]) -> pulp.LpAffineExpression:
        return pulp.LpAffineExpression([(self.moves[m], 1) for m in moves if m in self.moves])

    def relax(self, relaxed: bool) -> None:
        """Let the moves be fractional, or binary again."""
        for x in self.moves.values():
            x.cat = pulp.LpContinuous if relaxed else pulp.LpInteger

    def support(self) -> dict[Edge, float]:
        """Values of the undirected edges (i < j) in the solver's solution; zeros left out."""
        found: dict[Edge, float] = {}
        for (i, j), x in self.moves.items():
            value = x.varValue or 0.0
            if value > 1e-9:
                edge = (min(i, j), max(i, j))
                found[edge] = found.get(edge, 0.0) + value
        return found

    def tour(self) -> list[int] | None:
        """The cyclic tour that the solver's solution is, None if it is none."""
        beside: dict[int, list[int]] = {i: [] for i in range(self.form.size)}
        for (i, j), value in self.support().items():
            if value > 0.5:
                beside[i].append(j)
                beside[j].append(i)
        if any(len(b) != 2 for b in beside.values()):
            return None
        tour, before = [0], -1
        while len(tour) <= self.form.size:
            a, b = beside[tour[-1]]
            before, onward = tour[-1], b if a == before else a
            if onward == 0:
                break
            tour.append(onward)
        return tour if len(tour) == self.form.size else None


class Subtour(Formulation):
    """Degree constraints; :meth:`cut` adds the rest where it is violated."""

    def _variables(self) -> None:
        n = self.form.size
        self._moves((i, j) for i in range(n) for j in range(i + 1, n))
        self.cuts = 0

    def _degrees(self) -> None:
        n = self.form.size
        for i in range(n):
            star = self._sum((min(i, j), max(i, j)) for j in range(n) if j != i)
            self._row(f"degree_{i}", star == 2)

    def _connection(self) -> None:
        """Nothing to begin with."""

    def cut(self, inside: Iterable[int]) -> None:
        """A tour enters and leaves the set: its edges within are fewer than its nodes."""
        nodes = sorted(inside)
        if 2 * len(nodes) > self.form.size:
            nodes = sorted(set(range(self.form.size)) - set(nodes))
        within = self._sum((i, j) for k, i in enumerate(nodes) for j in nodes[k + 1 :])
        self._row(f"subtour_{self.cuts}", within <= len(nodes) - 1)
        self.cuts += 1

    def propose(self, tour: Sequence[int]) -> None:
        """Undirected: an edge is used in whichever direction."""
        used = {(tour[k - 1], tour[k]) for k in range(len(tour))}
        for (i, j), x in self.moves.items():
            x.setInitialValue(int((i, j) in used or (j, i) in used), check=False)


class _Directed(Formulation):
    """What both directed formulations share."""

    def _pairs(self) -> list[Edge]:
        n = self.form.size
        return [(i, j) for i in range(n) for j in range(n) if i != j]

    def _degrees(self) -> None:
        n = self.form.size
        for i in range(n):
            beside = [j for j in range(n) if j != i]
            self._row(f"leave_{i}", self._sum((i, j) for j in beside) == 1)
            self._row(f"enter_{i}", self._sum((j, i) for j in beside) == 1)

    def _from_root(self, tour: Sequence[int]) -> list[int]:
        at = list(tour).index(self.root)
        return [*tour[at:], *tour[:at]]

    def _propose_moves(self, path: Sequence[int]) -> None:
        used = {(path[k - 1], path[k]) for k in range(len(path))}
        for move, x in self.moves.items():
            x.setInitialValue(int(move in used), check=False)


class MillerTuckerZemlin(_Directed):
    """Positions u, 1 for the node after the root to size - 1 for the last; a move raises u by 1."""

    def _variables(self) -> None:
        self._moves(self._pairs())
        last = self.form.size - 1
        self.place = {i: self.problem.add_variable(f"u_{i}", 1, last) for i in self.others}

    def _connection(self) -> None:
        """Desrochers and Laporte's rows: the opposite move lifts, the root's moves fix the ends."""
        n, r, u = self.form.size, self.root, self.place
        for i in self.others:
            first, last = self._sum([(r, i)]), self._sum([(i, r)])
            self._row(f"early_{i}", u[i] >= 2 - first + (n - 3) * last)
            self._row(f"late_{i}", u[i] <= n - 2 + last - (n - 3) * first)
            for j in self.others:
                if (i, j) in self.moves:
                    there, back = self.moves[i, j], self.moves[j, i]
                    lifted = u[i] - u[j] + (n - 1) * there + (n - 3) * back
                    self._row(f"order_{i}_{j}", lifted <= n - 2)

    def propose(self, tour: Sequence[int]) -> None:
        """Moves as they come, places counted from the root."""
        path = self._from_root(tour)
        self._propose_moves(path)
        for k, i in enumerate(path[1:], 1):
            self.place[i].setInitialValue(k, check=False)


class Flow(_Directed):
    """The root sends out a unit for every other node; flow needs a move to travel on."""

    def _variables(self) -> None:
        self._moves(self._pairs())
        inner = self.form.size - 2
        self.flow = {
            (i, j): self.problem.add_variable(f"f_{i}_{j}", 0, inner)
            for i, j in self.moves
            if self.root not in (i, j)
        }

    def _connection(self) -> None:
        """From the root size - 1 units, back to it none; each node keeps one."""
        n, r = self.form.size, self.root
        for j in self.others:
            arriving = [(self.flow[i, j], 1) for i in self.others if (i, j) in self.flow]
            leaving = [(self.flow[j, k], -1) for k in self.others if (j, k) in self.flow]
            balance = pulp.LpAffineExpression(arriving + leaving)
            self._row(f"keep_{j}", balance + (n - 1) * self._sum([(r, j)]) == 1)
        for (i, j), f in self.flow.items():
            self._row(f"ride_{i}_{j}", f <= (n - 2) * self.moves[i, j])
            self._row(f"carry_{i}_{j}", f >= self.moves[i, j])

    def propose(self, tour: Sequence[int]) -> None:
        """Moves as they come, and the units that are still on board."""
        path = self._from_root(tour)
        self._propose_moves(path)
        for f in self.flow.values():
            f.setInitialValue(0, check=False)
        for k in range(1, len(path) - 1):
            self.flow[path[k], path[k + 1]].setInitialValue(len(path) - 1 - k, check=False)


FORMULATIONS: dict[str, type[Formulation]] = {
    "subtour": Subtour,
    "mtz": MillerTuckerZemlin,
    "flow": Flow,
}
