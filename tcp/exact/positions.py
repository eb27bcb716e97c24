"""CP-SAT on the position model: exact with every rule about successive moves, for small boards.

The model has rows that hold only where a literal does (a window is balanced
unless it is counted).  OR-Tools 9.15 may lose such a literal in presolve: it
adds up the row's coefficients in 32 bits
(https://github.com/google/or-tools/issues/5293), and then "proves" a route
optimal that is not.  That step is left out if its work limit is 0.
"""

from __future__ import annotations

import math

import numpy as np
from ortools.sat.python import cp_model

from tcp.exact.sat import EXACT, SatSearch, check_options
from tcp.heuristics.start import start_tour
from tcp.instance import Instance
from tcp.models.positions import Positions
from tcp.result import Outcome, Report
from tcp.stop import Clock
from tcp.validate.route import faults

HOLES = 30
"""Largest model that is built: 26,000 moves in places."""

WIDE = 2**61
"""What the terms of a row of the model may add up to."""


def refusal(instance: Instance, scale: int = 1, weight: int = 0) -> str | None:
    """Why the model would be too large, or its numbers too fine, or None.

    Parameters
    ----------
    instance : Instance
        The problem.
    scale, weight : int
        As in :class:`Search`.
    """
    n = len(instance)
    if n > HOLES:
        return f"its model has a literal for each place and move and takes up to {HOLES} holes"
    highest = scale * int(instance.form.full_matrix().max()) + weight
    if highest // _unit(instance, scale, weight) * (instance.form.size + 1) > EXACT:
        return "its bounds are exact up to 2^53 units of cost; choose a larger quantum"
    rule, piece = instance.rules.balance, instance.workpiece
    if rule is not None:
        reach = int(np.ptp(piece.x)) + int(np.ptp(piece.y))
        if max(rule.limits()) * reach * min(rule.window, n) * n * n > WIDE:
            return "the ratios of the balance rule have too many digits for places so fine"
    return None


def _unit(instance: Instance, scale: int, weight: int) -> int:
    """What divides every value of the objective."""
    return math.gcd(scale * instance.granularity, weight)


def run(
    instance: Instance,
    *,
    rng: np.random.Generator,
    clock: Clock,
    report: Report,
    workers: int = 1,
    linearization: int = 2,
) -> Outcome:
    """Solve the position model; see :func:`tcp.solve.solve`.

    Parameters
    ----------
    workers : int
        Threads, >= 1.  More than one are interleaved deterministically.
    linearization : int
        CP-SAT's ``linearization_level``, 0 to 2.

    Raises
    ------
    UsageError
        For options out of range.
    """
    check_options("positions", workers, linearization)
    if len(instance) == 1:
        wrong = faults(instance, (0,))
        bound = None if wrong else instance.cost((0,))
        return Outcome(None if wrong else (0,), bound, infeasible=bool(wrong))
    search = Search(instance, clock, report)
    tour = start_tour(instance.form)
    if tour is not None:
        search.offer(instance.route(tour))
    return search.run(int(rng.integers(2**31)), workers, linearization)


class Search(SatSearch):
    """One solve of the position model.

    Parameters
    ----------
    instance, clock, report
        As in every solver; :func:`refusal` has nothing against it.
    scale, weight : int
        What is minimised and bounded is ``scale * travel + weight * unbalanced windows``.
    """

    def __init__(
        self, instance: Instance, clock: Clock, report: Report, scale: int = 1, weight: int = 0
    ):
        super().__init__(instance, clock, report, _unit(instance, scale, weight))
        self.scale, self.weight = scale, weight

    def value_of(self, route: tuple[int, ...]) -> int:
        """The objective of a route, from the instance and not from the model."""
        cost, penalty = self.instance.cost(route), self.instance.penalty(route)
        return self.scale * cost + self.weight * penalty

    def offer(self, route: tuple[int, ...]) -> None:
        """Keep a route that keeps the rules; the start tour does not know all of them."""
        if not faults(self.instance, route):
            super().offer(route)

    def build(self) -> cp_model.CpModel:
        """The model, without a hint."""
        self.positions = Positions(self.instance, self.scale, self.weight, self.unit)
        return self.positions.model

    def found(self) -> tuple[int, ...]:
        """The order of the holes' places."""
        return self.positions.route(self.value)

    def solver(self, seed: int, workers: int, linearization: int) -> cp_model.CpSolver:
        """Without the step that overflows."""
        solver = super().solver(seed, workers, linearization)
        solver.parameters.presolve_inclusion_work_limit = 0
        return solver
