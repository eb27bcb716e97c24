"""A solve by CP-SAT: what both models share.

The model is built only if there is time for it.  Routes are costed by the
instance and not by the model, and a route is optimal only if its cost reaches
the bound that CP-SAT states.
"""

from __future__ import annotations

import math
from abc import abstractmethod

from ortools.sat.python import cp_model

from tcp.errors import UsageError
from tcp.exact.native import attend
from tcp.exact.watch import Watch
from tcp.instance import Instance
from tcp.result import Outcome, Report
from tcp.stop import Clock, StopReason

EXACT = 2**53
"""CP-SAT hands out its bound as a double, exact for integers up to here."""

WORKERS = 1000
"""Most threads."""


def check_options(name: str, workers: int, linearization: int) -> None:
    """Refuse what CP-SAT's parameters cannot be.

    Raises
    ------
    UsageError
        For options out of range.
    """
    if not 1 <= workers <= WORKERS or linearization not in (0, 1, 2):
        raise UsageError(
            f"{name} takes workers of 1 or more, up to {WORKERS}, and linearization 0, 1 or 2"
        )


class SatSearch(cp_model.CpSolverSolutionCallback):  # type: ignore[misc]
    """One solve: what it has found so far, and the news that the main thread passes on.

    Parameters
    ----------
    instance, clock, report
        As in every solver.
    unit : int
        The model's objective is a route's value in multiples of it.
    """

    def __init__(self, instance: Instance, clock: Clock, report: Report, unit: int):
        super().__init__()
        self.instance, self.unit = instance, unit
        self.best: tuple[int, ...] | None = None
        self.cost: int | None = None
        self.bound = 0
        self.watch = Watch(clock, report)

    @abstractmethod
    def build(self) -> cp_model.CpModel:
        """The model, from the best route so far."""

    @abstractmethod
    def found(self) -> tuple[int, ...]:
        """The drilling order of the solution that CP-SAT has just found."""

    def value_of(self, route: tuple[int, ...]) -> int:
        """What is minimised."""
        return self.instance.cost(route)

    def offer(self, route: tuple[int, ...]) -> None:
        """Keep a route if it is better than the best."""
        cost = self.value_of(route)
        if self.cost is None or cost < self.cost:
            self.best, self.cost = route, cost

    def on_solution_callback(self) -> None:
        """Keep a solution (called by CP-SAT in its own thread)."""
        self.offer(self.found())

    def _raise(self, bound: float) -> None:
        """Keep a bound: costs are whole, so it may be rounded up; the slack is for the double."""
        self.bound = max(self.bound, math.ceil(bound - 1e-6) * self.unit)

    def _watch(self) -> StopReason | None:
        """Pass on what is new, and see whether it is time to stop."""
        return self.watch.look(self.cost, self.bound)

    def solver(self, seed: int, workers: int, linearization: int) -> cp_model.CpSolver:
        """CP-SAT, set up; all randomness comes from ``seed``."""
        solver = cp_model.CpSolver()
        solver.parameters.random_seed = seed
        solver.parameters.num_workers = workers
        solver.parameters.interleave_search = workers > 1
        solver.parameters.linearization_level = linearization
        solver.parameters.catch_sigint_signal = False  # Ctrl-C is the facade's
        solver.best_bound_callback = self._raise
        return solver

    def run(self, seed: int, workers: int, linearization: int) -> Outcome:
        """Solve and say how it went."""
        solver = self.solver(seed, workers, linearization)
        stopped, status = self._watch(), cp_model.UNKNOWN
        details = {"workers": workers, "linearization": linearization}
        if stopped is None:
            model = self.build()
            status, stopped = attend(
                lambda: solver.solve(model, self), self._watch, solver.stop_search
            )
            details |= {"branches": solver.num_branches, "conflicts": solver.num_conflicts}
        if status == cp_model.MODEL_INVALID:
            raise UsageError("cp-sat cannot represent these costs; choose a larger quantum")
        if status == cp_model.OPTIMAL:
            self._raise(solver.best_objective_bound)
        if status in (cp_model.OPTIMAL, cp_model.INFEASIBLE):
            stopped = None
        self._watch()
        return Outcome(
            route=self.best,
            bound=self.bound,
            stopped=stopped or StopReason.COMPLETED,
            infeasible=status == cp_model.INFEASIBLE,
            details=details,
        )
