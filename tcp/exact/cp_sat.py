"""CP-SAT on the circuit model, with a hint, bounds as they come, and stops that are obeyed.

One worker with ``linearization_level=2`` is the default because it was the
fastest of six settings at every size from 15 to 147 holes, by a factor of
three at 49 holes, where other linearizations on one worker do not end at all:
``python benchmarks/exact_models.py --cp-sat`` prints the comparison.
"""

from __future__ import annotations

import math

import numpy as np
from ortools.sat.python import cp_model

from tcp.errors import UsageError
from tcp.exact.native import attend
from tcp.exact.tiny import settle
from tcp.heuristics.start import start_tour
from tcp.instance import Instance
from tcp.models.circuit import Circuit
from tcp.result import Outcome, Progress, Report
from tcp.stop import Clock, StopReason

NODES = 500
"""Largest model that is built: a quarter of a million literals."""

EXACT = 2**53
"""CP-SAT hands out its bound as a double, exact for integers up to here."""


def refusal(instance: Instance) -> str | None:
    """Why the model would be too large, or None."""
    form = instance.form
    if form.size > NODES:
        return f"its model has a literal for each ordered pair and takes up to {NODES} nodes"
    if int(form.full_matrix().max()) // instance.granularity * form.size > EXACT:
        return "its bounds are exact up to 2^53 units of cost; choose a larger quantum"
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
    """Solve the circuit model; see :func:`tcp.solve.solve`.

    Parameters
    ----------
    workers : int
        Threads, >= 1.  Several are interleaved, so that each number of workers
        is deterministic; but it is another search, and among several shortest
        routes it may end in another one.
    linearization : int
        CP-SAT's ``linearization_level``, 0 to 2: how much of the model its
        linear relaxation sees.
    """
    if workers < 1 or linearization not in (0, 1, 2):
        raise UsageError("cp-sat takes workers of 1 or more and linearization 0, 1 or 2")
    settled = settle(instance)
    if settled is not None:
        return settled
    search = _Search(instance, clock, report)
    search.parameters(int(rng.integers(2**31)), workers, linearization)
    return search.run()


class _Search(cp_model.CpSolverSolutionCallback):  # type: ignore[misc]
    """One solve: what it has found so far, and the news that the main thread passes on."""

    def __init__(self, instance: Instance, clock: Clock, report: Report):
        super().__init__()
        self.instance, self.clock, self.report = instance, clock, report
        self.unit = instance.granularity
        self.circuit = Circuit(instance.form, self.unit)
        self.best = start_tour(instance.form)
        self.bound = 0
        self.told: tuple[int | None, int] | None = None
        if self.best is not None:
            self.circuit.hint(self.best)

    def parameters(self, seed: int, workers: int, linearization: int) -> None:
        """Set up the solver; all randomness comes from ``seed``."""
        self.solver = cp_model.CpSolver()
        self.solver.parameters.random_seed = seed
        self.solver.parameters.num_workers = workers
        self.solver.parameters.interleave_search = workers > 1
        self.solver.parameters.linearization_level = linearization
        self.solver.parameters.catch_sigint_signal = False  # Ctrl-C is the facade's
        self.solver.best_bound_callback = self._raise

    @property
    def cost(self) -> int | None:
        """Cost of the best tour so far, in quanta."""
        return None if self.best is None else self.instance.form.tour_cost(self.best)

    def on_solution_callback(self) -> None:
        """Keep a solution (called by CP-SAT in its own thread)."""
        tour = self.circuit.tour(self.value)
        if self.cost is None or self.instance.form.tour_cost(tour) < self.cost:
            self.best = tour

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

    def run(self) -> Outcome:
        """Solve and say how it went."""
        stopped, status = self._watch(), cp_model.UNKNOWN
        details = {
            "workers": self.solver.parameters.num_workers,
            "linearization": self.solver.parameters.linearization_level,
        }
        if stopped is None:
            status, stopped = attend(
                lambda: self.solver.solve(self.circuit.model, self),
                self._watch,
                self.solver.stop_search,
            )
            details["branches"] = self.solver.num_branches
            details["conflicts"] = self.solver.num_conflicts
        if status == cp_model.MODEL_INVALID:
            raise UsageError("cp-sat cannot represent these costs; choose a larger quantum")
        if status == cp_model.OPTIMAL:
            self.bound = self.cost or 0
        if status in (cp_model.OPTIMAL, cp_model.INFEASIBLE):
            stopped = None
        self._watch()
        return Outcome(
            route=None if self.best is None else self.instance.route(self.best),
            bound=self.bound,
            stopped=stopped or StopReason.COMPLETED,
            infeasible=status == cp_model.INFEASIBLE,
            details=details,
        )
