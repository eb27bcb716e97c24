"""OR-Tools routing: its local search for a good route, or its CP-SAT search for a proof.

The library holds Python's interpreter while it solves, so the search runs in
the calling thread: local search looks at the clock through the library's own
limit callback; the CP-SAT search obeys the time limit and answers Ctrl-C
itself.  Gap and target are not watched during a CP-SAT search.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from ortools.constraint_solver import pywrapcp, routing_enums_pb2
from ortools.util import optional_boolean_pb2

from tcp.errors import UsageError
from tcp.exact.tiny import settle
from tcp.heuristics.start import start_tour
from tcp.instance import Instance
from tcp.models.routing import Routing
from tcp.result import Outcome, Progress, Report
from tcp.stop import Clock, StopReason

NODES = 2_000
"""Largest model that is built: its costs are handed over as Python lists."""

EXACT = 2**53
"""The CP-SAT search passes its bound through a double, exact for integers up to here."""

DECADES = 1e9
"""From so many seconds on a time limit is none: the library could not hold it."""

ON, OFF = optional_boolean_pb2.BOOL_TRUE, optional_boolean_pb2.BOOL_FALSE
FIRST = routing_enums_pb2.FirstSolutionStrategy.Value
META = routing_enums_pb2.LocalSearchMetaheuristic.Value
STATUS = routing_enums_pb2.RoutingSearchStatus.Value
FIRST_SOLUTIONS = (
    "automatic",
    "path_cheapest_arc",
    "savings",
    "christofides",
    "parallel_cheapest_insertion",
    "local_cheapest_insertion",
    "global_cheapest_arc",
    "local_cheapest_arc",
)
METAHEURISTICS = (
    "automatic",
    "greedy_descent",
    "guided_local_search",
    "simulated_annealing",
    "tabu_search",
)


def refusal(instance: Instance) -> str | None:
    """Why the model would be too large, or None."""
    if instance.form.size > NODES:
        return f"its matrix of Python numbers takes up to {NODES} nodes"
    return None


def run(
    instance: Instance,
    *,
    rng: np.random.Generator,
    clock: Clock,
    report: Report,
    exact: bool = False,
    first_solution: str = "automatic",
    metaheuristic: str = "automatic",
) -> Outcome:
    """Solve the routing model; see :func:`tcp.solve.solve`.  Deterministic: no randomness.

    Parameters
    ----------
    exact : bool
        Use the CP-SAT search, which ends in a proof, instead of local search.
    first_solution : str
        One of :data:`FIRST_SOLUTIONS`, for local search.
    metaheuristic : str
        One of :data:`METAHEURISTICS`.  ``automatic`` is guided local search
        under a limit and greedy descent without one; the others but greedy
        descent never end by themselves and need a limit.
    """
    settled = settle(instance)
    if settled is not None:
        return settled
    if first_solution not in FIRST_SOLUTIONS or metaheuristic not in METAHEURISTICS:
        raise UsageError(
            f"first_solution is one of {', '.join(FIRST_SOLUTIONS)}; "
            f"metaheuristic one of {', '.join(METAHEURISTICS)}"
        )
    search = _Search(instance, clock, report)
    if exact:
        return search.prove()
    return search.improve(first_solution, _endless(metaheuristic, clock))


def _endless(metaheuristic: str, clock: Clock) -> str:
    """The metaheuristic to use, with a limit where it needs one."""
    stop = clock.stop
    limited = any(v is not None for v in (stop.time, stop.iterations, stop.target))
    if metaheuristic == "automatic":
        return "guided_local_search" if limited else "greedy_descent"
    if metaheuristic != "greedy_descent" and not limited:
        raise UsageError(f"{metaheuristic} never ends by itself; set a time limit")
    return metaheuristic


class _Search:
    """One solve of the routing model."""

    def __init__(self, instance: Instance, clock: Clock, report: Report):
        self.instance, self.clock, self.report = instance, clock, report
        self.routing = Routing(instance.form, instance.granularity)
        self.model = self.routing.model
        self.best: list[int] | None = None
        self.solutions = 0
        self.stopped: StopReason | None = None
        self.parameters = pywrapcp.DefaultRoutingSearchParameters()
        if clock.remaining < DECADES:
            self.parameters.time_limit.FromNanoseconds(max(1, int(clock.remaining * 1e9)))

    @property
    def cost(self) -> int | None:
        """Cost of the best tour so far, in quanta."""
        return None if self.best is None else self.instance.form.tour_cost(self.best)

    def improve(self, first_solution: str, metaheuristic: str) -> Outcome:
        """Local search."""
        self.parameters.first_solution_strategy = FIRST.Value(first_solution.upper())
        self.parameters.local_search_metaheuristic = META.Value(metaheuristic.upper())
        self.model.AddSearchMonitor(self.model.solver().CustomLimit(self._over))
        self.model.AddAtSolutionCallback(self._solution)
        if not self._over():
            self._keep(self.model.SolveWithParameters(self.parameters))
        details = {"first_solution": first_solution, "metaheuristic": metaheuristic}
        return self._outcome(details, proving=False)

    def prove(self) -> Outcome:
        """The CP-SAT search, from a heuristic tour."""
        if self.routing.largest > EXACT:
            raise UsageError("routing proves costs up to 2^53 quanta; choose a larger quantum")
        self._take(start_tour(self.instance.form))
        self.parameters.use_cp = OFF
        self.parameters.use_cp_sat = ON
        if not self._over():
            self.model.CloseModelWithParameters(self.parameters)
            hint = None if self.best is None else self.routing.assignment(self.best)
            if hint is None:
                found = self.model.SolveWithParameters(self.parameters)
            else:
                found = self.model.SolveFromAssignmentWithParameters(hint, self.parameters)
            self._keep(found)
        return self._outcome({"search": "cp-sat"}, proving=True)

    def _over(self) -> bool:
        """Whether it is time to stop; asked by the library all the time."""
        if self.stopped is None:
            self.stopped = self.clock.reason(self.cost, None, self.solutions)
        return self.stopped is not None

    def _solution(self) -> None:
        """Count a solution and keep it (called by the library)."""
        self.solutions += 1
        self._take(self.routing.tour())

    def _keep(self, solution: pywrapcp.Assignment | None) -> None:
        if solution is not None:
            self._take(self.routing.tour(solution))

    def _take(self, tour: list[int] | None) -> None:
        """Remember a tour that is better than the best, and tell."""
        if tour is None:
            return
        if self.cost is None or self.instance.form.tour_cost(tour) < self.cost:
            self.best = tour
            self.report(Progress(self.clock.elapsed, self.cost, iteration=self.solutions))

    def _outcome(self, details: Mapping[str, str], proving: bool) -> Outcome:
        """Status and bound as the library reports them, never better."""
        status, lower = self.model.status(), self.model.objective_lower_bound()
        bound = self.routing.bound(lower) if lower > 0 else 0
        infeasible = status == STATUS.Value("ROUTING_INFEASIBLE") or bound is None
        proved = infeasible or status == STATUS.Value("ROUTING_OPTIMAL")
        route = None if self.best is None else self.instance.route(self.best)
        return Outcome(
            route=None if infeasible else route,
            bound=bound,
            stopped=StopReason.COMPLETED if proved else self._why(proving),
            infeasible=infeasible,
            details={**details, "status": STATUS.Name(status), "solutions": self.solutions},
        )

    def _why(self, proving: bool) -> StopReason:
        """Why the library came back without a proof: it may have looked at a limit before us."""
        if self.stopped is not None:
            return self.stopped
        if self.clock.remaining <= 0.02:
            return StopReason.TIME
        # an unlimited CP-SAT search gives up only when Ctrl-C told it to
        return StopReason.INTERRUPTED if proving else StopReason.COMPLETED
