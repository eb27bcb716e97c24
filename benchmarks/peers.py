"""The routers that ``routers.py`` compares: each through the best interface it offers.

A router gets an instance, seconds and a seed, and returns a cyclic tour over the nodes of its tour
form: the virtual node is an ordinary node that costs nothing to reach, so that everybody solves the
open path itself.  What a peer rounds is re-costed exactly.  ``prepare`` makes what a peer takes (a
matrix, a graph) before the clock starts.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from itertools import pairwise
from typing import Any

import numpy as np

from tcp import Instance, Stop
from tcp.solve import solve

Tour = list[int]


def matrix(instance: Instance) -> np.ndarray:
    return instance.form.full_matrix()


def lists(instance: Instance) -> list[list[int]]:
    return instance.form.full_matrix().tolist()


def itself(instance: Instance) -> Instance:
    return instance


def compiled(instance: Instance) -> Instance:
    """Compiling happens once a machine and counts nowhere."""
    import_module("tcp.heuristics.local_search.warm").warm_up()
    return instance


def ours(instance: Instance, seconds: float, seed: int) -> Tour:
    result = solve(instance, "local-search", stop=Stop(time=seconds), seed=seed)
    return instance.tour(result.route)


def short_matrix(instance: Instance) -> np.ndarray:
    """fast-tsp takes 16-bit distances."""
    full = matrix(instance)
    return np.rint(full / max(1.0, full.max() / 65_000)).astype(np.uint16)


def fast_tsp(costs: np.ndarray, seconds: float, seed: int) -> Tour:
    """Or-opt with 2-opt moves from a greedy start; it draws its own seed."""
    return import_module("fast_tsp").find_tour(costs, duration_seconds=seconds)


def elkai(costs: list[list[int]], seconds: float, seed: int) -> Tour:
    """LKH, one run; the binding has no limit and no seed."""
    return import_module("elkai").DistanceMatrix(costs).solve_tsp(runs=1)[:-1]


def python_tsp(costs: np.ndarray, seconds: float, seed: int) -> Tour:
    """Its Lin-Kernighan search (no limit of its own), again and again; the best of all."""
    np.random.seed(seed)  # noqa: NPY002  (the peer draws from the global generator)
    search = import_module("python_tsp.heuristics").solve_tsp_lin_kernighan
    began, best = time.perf_counter(), search(costs)
    while time.perf_counter() - began < seconds:
        best = min(best, search(costs), key=lambda found: found[1])
    return best[0]


def pyvrp(costs: np.ndarray, seconds: float, seed: int) -> Tour:
    """One vehicle without capacity; the tour's first node is the depot, client k is node k + 1."""
    vrp, stop = import_module("pyvrp"), import_module("pyvrp.stop")
    data = vrp.ProblemData(
        locations=[vrp.Location(0, 0) for _ in costs],
        clients=[vrp.Client(k) for k in range(1, len(costs))],
        depots=[vrp.Depot(0)],
        vehicle_types=[vrp.VehicleType()],
        distance_matrices=[costs],
        duration_matrices=[np.zeros_like(costs)],
    )
    best = vrp.solve(data, stop=stop.MaxRuntime(seconds), seed=seed, display=False).best
    return [0, *(stop.idx + 1 for stop in best.routes()[0] if stop.is_client())]


def or_tools(costs: list[list[int]], seconds: float, seed: int) -> Tour:
    """Cheapest arc, then guided local search; it takes no seed."""
    from ortools.constraint_solver import pywrapcp, routing_enums_pb2

    manager = pywrapcp.RoutingIndexManager(len(costs), 1, len(costs) - 1)
    model = pywrapcp.RoutingModel(manager)
    model.SetArcCostEvaluatorOfAllVehicles(model.RegisterTransitMatrix(costs))
    search = pywrapcp.DefaultRoutingSearchParameters()
    search.first_solution_strategy = routing_enums_pb2.FirstSolutionStrategy.PATH_CHEAPEST_ARC
    search.local_search_metaheuristic = (
        routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    )
    search.time_limit.FromMilliseconds(int(seconds * 1000))
    solution = model.SolveWithParameters(search)
    tour, index = [], model.Start(0)
    while not model.IsEnd(index):
        tour.append(manager.IndexToNode(index))
        index = solution.Value(model.NextVar(index))
    return tour


def graph(instance: Instance) -> Any:
    return import_module("networkx").from_numpy_array(matrix(instance))


def networkx(complete: Any, seconds: float, seed: int) -> Tour:
    """Threshold accepting from the greedy tour, again again with new seeds; the best of all."""
    approximation = import_module("networkx.algorithms.approximation")
    began, n = time.perf_counter(), len(complete)
    for a, b in [(a, b) for a, b in complete.edges if a == b]:
        complete.remove_edge(a, b)
    if complete.number_of_edges() < n * (n - 1) // 2:  # edges of no cost are left out by networkx
        present = set(complete.edges)
        absent = ((a, b) for a in range(n) for b in range(a + 1, n) if (a, b) not in present)
        complete.add_edges_from(absent, weight=0)
    best, least = approximation.greedy_tsp(complete), None
    while time.perf_counter() - began < seconds:
        tour = approximation.threshold_accepting_tsp(complete, best, seed=seed, max_iterations=1)
        cost = sum(complete[a][b]["weight"] for a, b in pairwise(tour))
        if least is None or cost < least:
            best, least = tour, cost
        seed += 1_000
    return best[:-1]


def nearest(instance: Instance, seconds: float, seed: int) -> Tour:
    """Nearest neighbour from the first hole of the file."""
    form = instance.form
    left, tour = np.ones(form.real, bool), [0]
    left[0] = False
    for _ in range(form.real - 1):
        rest = np.flatnonzero(left)
        nearby = rest[np.argmin(form.costs(np.full(rest.size, tour[-1]), rest))]
        tour.append(int(nearby))
        left[nearby] = False
    return [*tour, form.virtual] if form.virtual >= 0 else tour


def two_opt(instance: Instance, seconds: float, seed: int) -> Tour:
    """Nearest neighbour, then the best 2-opt move of each node, until none helps or time is up."""
    form, began = instance.form, time.perf_counter()
    tour = np.array(nearest(instance, seconds, seed))
    improved = True
    while improved:
        improved = False
        for i in range(form.size - 1):
            if time.perf_counter() - began > seconds:
                return tour.tolist()
            after = np.roll(tour, -1)
            j = np.arange(i + 1, form.size)
            a, b = np.full(j.size, tour[i]), np.full(j.size, after[i])
            gain = form.costs(a, b) + form.costs(tour[j], after[j])
            gain -= form.costs(a, tour[j]) + form.costs(b, after[j])
            best = int(np.argmax(gain))
            if gain[best] > 0:
                k = int(j[best])
                tour[i + 1 : k + 1] = tour[i + 1 : k + 1][::-1].copy()
                improved = True
    return tour.tolist()


@dataclass(frozen=True)
class Router:
    """A router: its package, the most nodes it is given, and whether a seed changes anything."""

    call: Callable[[Any, float, int], Tour]
    package: str
    most: int
    prepare: Callable[[Instance], Any] = itself
    seeded: bool = True


ROUTERS = {
    "tcp local-search": Router(ours, "tcp-drill", 10**9, compiled),
    "fast-tsp": Router(fast_tsp, "fast-tsp", 5_990, short_matrix),
    "OR-Tools routing (GLS)": Router(or_tools, "ortools", 5_990, lists, seeded=False),
    "PyVRP": Router(pyvrp, "pyvrp", 5_990, matrix),
    "elkai (LKH; no limit)": Router(elkai, "elkai", 1_500, lists, seeded=False),
    "python-tsp": Router(python_tsp, "python-tsp", 1_500, matrix),
    "networkx": Router(networkx, "networkx", 1_500, graph),
    "nearest neighbour": Router(nearest, "numpy", 10**5, seeded=False),
    "nearest neighbour + 2-opt": Router(two_opt, "numpy", 10_000, seeded=False),
}
