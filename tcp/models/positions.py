"""The position model for CP-SAT: which move is made at which place of the sequence.

One literal per place and directed move (the time-dependent formulation of
Picard and Queyranne).  It is larger than the circuit model by a factor n, but
it sees the order of the moves, so the rules about successive moves become
linear: the travel of move k along an axis is a sum over its literals.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ortools.sat.python import cp_model

from tcp.instance import Instance
from tcp.rules import Balance

Move = tuple[int, int, int]
"""Place, hole before, hole after."""


class Positions:
    """Every drilling order of an instance, with its rules; about n^3 literals.

    Parameters
    ----------
    instance : Instance
        At least two holes.
    scale, weight : int
        The objective is ``scale * travel + weight * unbalanced windows``.
    unit : int
        It is stated in multiples of this common divisor.
    """

    def __init__(self, instance: Instance, scale: int = 1, weight: int = 0, unit: int = 1):
        self.instance, self.scale, self.weight, self.unit = instance, scale, weight, unit
        self.n = len(instance)
        self.model = cp_model.CpModel()
        self.windows: list[cp_model.IntVar] = []
        self._variables()
        self._one_hole_a_place()
        self._moves_join_places()
        self._ends()
        self._together()
        self._axis_runs()
        if instance.rules.balance is not None:
            self._balance(instance.rules.balance)
        self._objective()

    def _variables(self) -> None:
        """A literal per hole and place, and per place and allowed move."""
        n, banned = self.n, set(self.instance.form.forbidden)
        places = n if self.instance.ends.closed else n - 1
        self.at = [[self.model.new_bool_var("") for _ in range(n)] for _ in range(n)]
        self.moves: dict[Move, cp_model.IntVar] = {
            (k, i, j): self.model.new_bool_var("")
            for k in range(places)
            for i in range(n)
            for j in range(n)
            if i != j and (min(i, j), max(i, j)) not in banned
        }
        self.at_place: list[list[tuple[int, int, cp_model.IntVar]]] = [[] for _ in range(places)]
        for (k, i, j), move in self.moves.items():
            self.at_place[k].append((i, j, move))

    def _one_hole_a_place(self) -> None:
        for hole in range(self.n):
            self.model.add_exactly_one(self.at[hole])
        for place in range(self.n):
            self.model.add_exactly_one(self.at[hole][place] for hole in range(self.n))

    def _moves_join_places(self) -> None:
        """The move at place k leaves its hole and enters that of the next place."""
        leaving: dict[tuple[int, int], list[Any]] = {}
        entering: dict[tuple[int, int], list[Any]] = {}
        for (k, i, j), move in self.moves.items():
            leaving.setdefault((k, i), []).append(move)
            entering.setdefault(((k + 1) % self.n, j), []).append(move)
        closed = self.instance.ends.closed
        for hole in range(self.n):
            for place in range(self.n):
                here = self.at[hole][place]
                if place < self.n - 1 or closed:
                    self.model.add(sum(leaving.get((place, hole), [])) == here)
                if place > 0 or closed:
                    self.model.add(sum(entering.get((place, hole), [])) == here)

    def _ends(self) -> None:
        """Fixed holes; a closed route without rules about moves may begin anywhere."""
        ends = self.instance.ends
        start = ends.start
        if start is None and ends.closed and not self.instance.rules.sequential and not self.weight:
            start = 0
        if start is not None:
            self.model.add(self.at[start][0] == 1)
        if ends.end is not None:
            self.model.add(self.at[ends.end][self.n - 1] == 1)

    def _together(self) -> None:
        for p, q in self.instance.rules.together:
            self.model.add_bool_or(m for (_, i, j), m in self.moves.items() if {i, j} == {p, q})

    def _axis_runs(self) -> None:
        """Not one move more than the limit along one axis in a row."""
        most, piece = self.instance.rules.axis_run, self.instance.workpiece
        if most is None:
            return
        for still, other in ((piece.y, piece.x), (piece.x, piece.y)):
            along = [
                sum(m for i, j, m in moves if still[i] == still[j] and other[i] != other[j])
                for moves in self.at_place[: self.n - 1]
            ]
            for first in range(len(along) - most):
                self.model.add(sum(along[first : first + most + 1]) <= most)

    def _balance(self, rule: Balance) -> None:
        """A literal per window, true where it is unbalanced, and their number at most ``most``."""
        piece, a, b, c, d = self.instance.workpiece, *rule.limits()
        for first in range(max(0, self.n - rule.window)):
            window = [m for k in range(first, first + rule.window) for m in self.at_place[k]]
            i, j, moves = ([m[part] for m in window] for part in range(3))
            dx, dy = abs(piece.x[i] - piece.x[j]), abs(piece.y[i] - piece.y[j])
            wrong = self.model.new_bool_var("")
            for excess in (a * dy - b * dx, c * dx - d * dy):
                total = cp_model.LinearExpr.weighted_sum(moves, excess.tolist())
                self.model.add(total <= 0).only_enforce_if(~wrong)
            self.windows.append(wrong)
        if rule.most is not None:
            self.model.add(sum(self.windows) <= min(rule.most, len(self.windows)))

    def _objective(self) -> None:
        form, ends = self.instance.form, self.instance.ends
        costs = form.full_matrix() * self.scale // self.unit
        terms = [int(costs[i, j]) * m for (_, i, j), m in self.moves.items()]
        for leg, place in ((ends.outward, 0), (ends.back, self.n - 1)):
            if leg:
                home = costs[form.home]
                terms += [int(home[h]) * self.at[h][place] for h in range(self.n)]
        self.model.minimize(sum(terms) + self.weight // self.unit * sum(self.windows))

    def route(self, value: Callable[[cp_model.IntVar], int]) -> tuple[int, ...]:
        """The drilling order of a solution."""
        where = [(k, h) for h in range(self.n) for k in range(self.n) if value(self.at[h][k])]
        return tuple(hole for _, hole in sorted(where))
