"""The circuit model for CP-SAT: one literal per directed move, one circuit through all nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ortools.sat.python import cp_model

from tcp.instance import TourForm

Arc = tuple[int, int]


class Circuit:
    """CP-SAT's ``AddCircuit`` over a tour form; size^2 literals.

    Parameters
    ----------
    form : TourForm
        At least four nodes: on fewer an edge and its arcs are not the same thing.
    unit : int
        Costs are stated in multiples of it (the instance's granularity).
    """

    def __init__(self, form: TourForm, unit: int = 1):
        self.form, self.unit = form, unit
        self.model = cp_model.CpModel()
        self._variables()
        self._one_circuit()
        self._forced_moves()
        self._objective()

    def _variables(self) -> None:
        """A literal per directed move; forbidden moves get none."""
        n = self.form.size
        banned = set(self.form.forbidden)
        self.arcs: dict[Arc, cp_model.IntVar] = {
            (i, j): self.model.new_bool_var("")
            for i in range(n)
            for j in range(n)
            if i != j and (min(i, j), max(i, j)) not in banned
        }

    def _one_circuit(self) -> None:
        """AddCircuit ignores a node that has no arcs; here nobody may be left out."""
        for i in set(range(self.form.size)) - {i for i, _ in self.arcs}:
            self.model.add_bool_or([]).with_name(f"node {i} cannot be reached")
        self.model.add_circuit([(i, j, move) for (i, j), move in self.arcs.items()])

    def _forced_moves(self) -> None:
        """A forced edge is used in one direction or the other."""
        for i, j in self.form.forced:
            self.model.add_bool_or([self.arcs[a] for a in ((i, j), (j, i)) if a in self.arcs])

    def _objective(self) -> None:
        costs = self.form.full_matrix() // self.unit
        objective = self.model.proto.objective  # a call for each literal would take seconds
        objective.vars.extend([move.index for move in self.arcs.values()])
        objective.scaling_factor = 1.0
        objective.coeffs.extend([int(costs[arc]) for arc in self.arcs])

    def hint(self, tour: Sequence[int]) -> None:
        """Propose a cyclic tour as the first solution."""
        used = {(tour[k - 1], tour[k]) for k in range(len(tour))}
        proposed = self.model.proto.solution_hint
        proposed.vars.extend([move.index for move in self.arcs.values()])
        proposed.values.extend([arc in used for arc in self.arcs])

    def tour(self, value: Callable[[cp_model.IntVar], int]) -> list[int]:
        """The cyclic tour of a solution."""
        after = {i: j for (i, j), move in self.arcs.items() if value(move)}
        nodes = [0]
        while (node := after[nodes[-1]]) != 0:
            nodes.append(node)
        return nodes
