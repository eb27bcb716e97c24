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

from tcp.errors import UsageError
from tcp.exact.native import attend
from tcp.heuristics.start import start_tour
from tcp.instance import Instance
from tcp.models.positions import Positions
from tcp.result import Outcome, Progress, Report
from tcp.stop import Clock, StopReason
from tcp.validate.route import faults

HOLES = 30
"""Largest model that is built: 26,000 moves in places."""

EXACT = 2**53
"""CP-SAT hands out its bound as a double, exact for integers up to here."""


def refusal(instance: Instance) -> str | None:
    """Why the model would be too large, or None."""
    if len(instance) > HOLES:
        return f"its model has a literal for each place and move and takes up to {HOLES} holes"
    return None


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
        For options out of range, or costs beyond 2^53 quanta.
    """
    if workers < 1 or linearization not in (0, 1, 2):
        raise UsageError("positions takes workers of 1 or more and linearization 0, 1 or 2")
    if len(instance) == 1:
        wrong = faults(instance, (0,))
        bound = None if wrong else instance.cost((0,))
        return Outcome(None if wrong else (0,), bound, infeasible=bool(wrong))
    search = Search(instance, clock, report)
    tour = start_tour(instance.form)
    if tour is not None:
        search.offer(instance.route(tour))
    return search.run(int(rng.integers(2**31)), workers, linearization)


class Search(cp_model.CpSolverSolutionCallback):  # type: ignore[misc]
    """One solve.

    Parameters
    ----------
    instance, clock, report
        As in every solver.
    scale, weight : int
        What is minimised and bounded is ``scale * travel + weight * unbalanced windows``.
    """

    def __init__(
        self, instance: Instance, clock: Clock, report: Report, scale: int = 1, weight: int = 0
    ):
        super().__init__()
        self.instance, self.clock, self.report = instance, clock, report
        self.scale, self.weight = scale, weight
        self.unit = math.gcd(scale * instance.granularity, weight)
        highest = scale * int(instance.form.full_matrix().max()) + weight
        if highest // self.unit * (instance.form.size + 1) > EXACT:
            raise UsageError("positions takes costs up to 2^53 quanta; choose a larger quantum")
        self.model = Positions(instance, scale, weight, self.unit)
        self.best: tuple[int, ...] | None = None
        self.cost: int | None = None
        self.bound = 0
        self.told: tuple[int | None, int] | None = None

    def value_of(self, route: tuple[int, ...]) -> int:
        """The objective of a route, from the instance and not from the model."""
        cost, penalty = self.instance.cost(route), self.instance.penalty(route)
        return self.scale * cost + self.weight * penalty

    def on_solution_callback(self) -> None:
        """Keep a solution (called by CP-SAT in its own thread)."""
        self.offer(self.model.route(self.value))

    def offer(self, route: tuple[int, ...]) -> None:
        """Keep a route if it is one and better than the best."""
        cost = self.value_of(route)
        if faults(self.instance, route):
            return
        if self.cost is None or cost < self.cost:
            self.best, self.cost = route, cost

    def _raise(self, bound: float) -> None:
        """Keep a bound: costs are whole, so it may be rounded up; the slack is for the double."""
        self.bound = max(self.bound, math.ceil(bound - 1e-6) * self.unit)

    def _watch(self) -> StopReason | None:
        """Pass on what is new, and see whether it is time to stop."""
        cost, bound = self.cost, self.bound
        if (cost, bound) != self.told:
            self.told = (cost, bound)
            self.report(Progress(self.clock.elapsed, cost, bound))
        return self.clock.reason(cost, bound)

    def run(self, seed: int, workers: int, linearization: int) -> Outcome:
        """Solve and say how it went."""
        solver = cp_model.CpSolver()
        solver.parameters.random_seed = seed
        solver.parameters.num_workers = workers
        solver.parameters.interleave_search = workers > 1
        solver.parameters.linearization_level = linearization
        solver.parameters.presolve_inclusion_work_limit = 0  # see the module
        solver.parameters.catch_sigint_signal = False  # Ctrl-C is the facade's
        solver.best_bound_callback = self._raise
        stopped, status = self._watch(), cp_model.UNKNOWN
        if stopped is None:
            status, stopped = attend(
                lambda: solver.solve(self.model.model, self), self._watch, solver.stop_search
            )
        if status == cp_model.MODEL_INVALID:
            raise UsageError("cp-sat cannot represent these costs; choose a larger quantum")
        if status == cp_model.OPTIMAL:
            self.bound = self.cost or 0
        if status in (cp_model.OPTIMAL, cp_model.INFEASIBLE):
            stopped = None
        self._watch()
        return Outcome(
            route=self.best,
            bound=self.bound,
            stopped=stopped or StopReason.COMPLETED,
            infeasible=status == cp_model.INFEASIBLE,
            details={"workers": workers, "linearization": linearization},
        )
