"""CP-SAT on the circuit model, with a hint, bounds as they come, and stops that are obeyed.

One worker with ``linearization_level=2`` is the default because it was the
fastest of six settings at every size from 15 to 147 holes, by a factor of
three at 49 holes, where other linearizations on one worker do not end at all:
``python benchmarks/exact_models.py --cp-sat`` prints the comparison.
"""

from __future__ import annotations

import numpy as np
from ortools.sat.python import cp_model

from tcp.exact.sat import EXACT, SatSearch, check_options
from tcp.exact.tiny import settle
from tcp.heuristics.start import start_tour
from tcp.instance import Instance
from tcp.models.circuit import Circuit
from tcp.result import Outcome, Report
from tcp.stop import Clock

NODES = 500
"""Largest model that is built: a quarter of a million literals."""


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
    check_options("cp-sat", workers, linearization)
    settled = settle(instance)
    if settled is not None:
        return settled
    search = _Search(instance, clock, report, hinted=workers == 1)
    tour = start_tour(instance.form)
    if tour is not None:
        search.offer(instance.route(tour))
    return search.run(int(rng.integers(2**31)), workers, linearization)


class _Search(SatSearch):
    """One solve of the circuit model.

    Parameters
    ----------
    instance, clock, report
        As in every solver.
    hinted : bool
        Whether CP-SAT is told the best route: not where several workers are interleaved, for
        there OR-Tools 9.15 may end the process (``solution->size() == postsolve_mapping.size()``)
        when it is stopped early.
    """

    def __init__(self, instance: Instance, clock: Clock, report: Report, hinted: bool):
        super().__init__(instance, clock, report, instance.granularity)
        self.hinted = hinted

    def build(self) -> cp_model.CpModel:
        """The model, with the best route as a hint."""
        self.circuit = Circuit(self.instance.form, self.unit)
        if self.hinted and self.best is not None:
            self.circuit.hint(self.instance.tour(self.best))
        return self.circuit.model

    def found(self) -> tuple[int, ...]:
        """The drilling order of the circuit."""
        return self.instance.route(self.circuit.tour(self.value))
