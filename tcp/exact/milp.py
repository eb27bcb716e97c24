"""Mixed-integer programmes through PuLP: three formulations, three backends.

What is trusted: that a backend's dual bound is wrong by less than
:func:`margin`.  The bound is lowered by that much before it is rounded up to
the next whole cost, and a route is optimal only if its own integer cost, never
the backend's objective, reaches that bound.
"""

from __future__ import annotations

import math

import numpy as np

from tcp.errors import UsageError
from tcp.exact.backends import Answer, Backend, End, backend
from tcp.exact.min_cut import violated_sets
from tcp.exact.tiny import settle
from tcp.exact.watch import Watch
from tcp.heuristics.start import start_tour
from tcp.instance import Instance
from tcp.models.milp import FORMULATIONS, Formulation, Subtour
from tcp.result import Outcome, Report, silent
from tcp.stop import Clock, StopReason

NODES = 200
"""Largest model that is built: twenty thousand edges, each a Python object."""

FINE = 10**9
"""Tours that cost more units than this are too fine for proofs in floating point."""

GAP = 0.5
"""Costs are whole units: backends may stop this close."""


def margin(bound: float) -> float:
    """What a float bound may be off: a twentieth of a unit and a few parts in 10^10."""
    return 0.05 + 2e-10 * abs(bound)


def refusal(instance: Instance) -> str | None:
    """Why the model would be too large, or its costs too fine; None if neither."""
    form = instance.form
    if form.size > NODES:
        return f"it builds models of up to {NODES} nodes"
    tour = start_tour(form) or range(form.size)
    if form.tour_cost(tour) // instance.granularity > FINE:
        return f"it proves tours of up to {FINE} units of cost; choose a larger quantum"
    return None


def run(
    instance: Instance,
    *,
    rng: np.random.Generator,
    clock: Clock,
    report: Report,
    formulation: str = "subtour",
    backend: str = "highs",
) -> Outcome:
    """Solve a mixed-integer programme; see :func:`tcp.solve.solve`.

    Parameters
    ----------
    formulation : str
        ``subtour``, ``mtz`` or ``flow``; see :mod:`tcp.models.milp`.
    backend : str
        ``highs``, ``cbc`` or ``scip``.
    """
    if formulation not in FORMULATIONS:
        known = ", ".join(FORMULATIONS)
        raise UsageError(f"unknown formulation {formulation!r}; expected one of {known}")
    search = _Search(instance, clock, report, backend, int(rng.integers(2**31)))
    settled = settle(instance)
    return settled or search.run(FORMULATIONS[formulation](instance.form, instance.granularity))


def formulate(instance: Instance, formulation: str, clock: Clock) -> tuple[Formulation, bool]:
    """The programme itself, for other solvers.

    Parameters
    ----------
    instance : Instance
        At least four nodes, rules that do not contradict each other.
    formulation : str
        A name of :data:`tcp.models.milp.FORMULATIONS`.
    clock : Clock
        Limits the search for subtour cuts.

    Returns
    -------
    model, complete
        Whether the model's optimum is that of the instance: always for ``mtz``
        and ``flow``; for ``subtour``, whose constraints are too many to write
        down, once those found suffice to prove the optimum.
    """
    model = FORMULATIONS[formulation](instance.form, instance.granularity)
    if not isinstance(model, Subtour):
        return model, True
    search = _Search(instance, clock, silent, "highs", seed=0)
    search.run(model)
    model.relax(False)
    return model, search.infeasible or search.cost == search.bound


class _Search:
    """One solve: the best tour and bound, and the solver that improves them."""

    def __init__(self, instance: Instance, clock: Clock, report: Report, name: str, seed: int):
        self.instance, self.clock = instance, clock
        self.solver: Backend = backend(name)(seed, GAP, self._raise)
        self.details: dict[str, object] = {"backend": name}
        self.best = start_tour(instance.form)
        self.bound = 0
        self.watch = Watch(clock, report)
        self.infeasible = False
        self.stopped: StopReason | None = None

    @property
    def cost(self) -> int | None:
        """Cost of the best tour so far, in quanta."""
        return None if self.best is None else self.instance.form.tour_cost(self.best)

    def _raise(self, bound: float) -> None:
        """Keep a dual bound, made safe and whole (may come from the solver's thread)."""
        if math.isfinite(bound):
            whole = math.ceil(bound - margin(bound))
            self.bound = max(self.bound, whole * self.instance.granularity)

    def _take(self, tour: list[int]) -> None:
        if self.cost is None or self.instance.form.tour_cost(tour) < self.cost:
            self.best = tour

    def _watch(self) -> StopReason | None:
        """Pass on what is new, and see whether it is time to stop."""
        return self.watch.look(self.cost, self.bound)

    def run(self, model: Formulation) -> Outcome:
        """Solve the model and say how it went."""
        if isinstance(model, Subtour):
            self._cut_rounds(model, relaxed=True)
            if not self._done():
                self._cut_rounds(model, relaxed=False)
            self.details |= {"cuts": model.cuts}
        elif not self._done():
            self._solve(model)
        self._watch()
        route = None if self.best is None else self.instance.route(self.best)
        return Outcome(
            route=None if self.infeasible else route,
            bound=None if self.infeasible else self.bound,
            stopped=self.stopped or StopReason.COMPLETED,
            infeasible=self.infeasible,
            details=self.details,
        )

    def _done(self) -> bool:
        """Whether all is proved, or it is time to stop."""
        if self.infeasible or self.cost == self.bound:
            return True
        self.stopped = self.stopped or self._watch()
        return self.stopped is not None

    def _cut_rounds(self, model: Subtour, relaxed: bool) -> None:
        """Solve and cut off every violated set, until there is none."""
        model.relax(relaxed)
        rounds = 0
        while not self._done():
            rounds += 1
            if self._solve(model).end is not End.OPTIMAL:
                break
            sets = violated_sets(self.instance.form.size, model.support())
            for nodes in sets:
                model.cut(nodes)
            if not sets:
                break
        self.details["relaxed_rounds" if relaxed else "integer_rounds"] = rounds

    def _solve(self, model: Formulation) -> Answer:
        """Run the backend once; take the bound, and the solution if it is a tour."""
        start = self.best is not None and model.problem.isMIP()
        if start and self.best is not None:
            model.propose(self.best)
        answer = self.solver.solve(model.problem, start, self._watch, self.clock.remaining)
        self._raise(answer.bound)
        self.infeasible = answer.end is End.INFEASIBLE
        if answer.end is End.STOPPED:  # by us, or by its own limit just before
            self.stopped = answer.stopped or self._watch() or StopReason.TIME
        tour = model.tour() if answer.solved else None
        if tour is not None:
            self._take(tour)
        return answer
