"""Routers side by side at equal wall time, into docs/routers.md.

    python benchmarks/routers.py [--seconds 5] [--seeds 3] [--instances a,b] [--routers x,y]

Open path, one process, one router after another.  Peers are optional: those
not installed are left out and named.  A peer that takes a matrix gets the tour
form's, virtual node included, so that it solves the open path itself; what it
rounds is re-costed exactly.  Instances: TSPLIB and VLSI files of the corpus
(``TCP_CORPUS`` or ``../shared/corpus``) where it is there, and generated ones.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import time
from collections.abc import Callable
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from tcp import Instance, Model, Stop, Travel, Workpiece
from tcp.files.tsplib import read
from tcp.heuristics.local_search.run import warm_up
from tcp.solve import solve

CORPUS = Path(os.environ.get("TCP_CORPUS", Path(__file__).parents[2] / "shared" / "corpus"))

Router = Callable[[Instance, float, int], list[int]]


def ours(instance: Instance, seconds: float, seed: int) -> list[int]:
    result = solve(instance, "local-search", stop=Stop(time=seconds), seed=seed)
    return instance.tour(result.route)


def fast_tsp(instance: Instance, seconds: float, seed: int) -> list[int]:
    module = import_module("fast_tsp")
    matrix = instance.form.full_matrix()
    scale = max(1.0, matrix.max() / 65_000)  # it takes 16-bit distances
    return module.find_tour(np.rint(matrix / scale).astype(np.uint16), duration_seconds=seconds)


def elkai(instance: Instance, seconds: float, seed: int) -> list[int]:
    """LKH has no time limit here: one run, reported with the time it took."""
    module = import_module("elkai")
    return module.DistanceMatrix(instance.form.full_matrix().tolist()).solve_tsp(runs=1)[:-1]


def python_tsp(instance: Instance, seconds: float, seed: int) -> list[int]:
    module = import_module("python_tsp.heuristics")
    matrix = instance.form.full_matrix()
    np.random.seed(seed)  # noqa: NPY002  (the peer draws from the global generator)
    tour, _ = module.solve_tsp_local_search(matrix, max_processing_time=seconds)
    return tour


def pyvrp(instance: Instance, seconds: float, seed: int) -> list[int]:
    module, stop = import_module("pyvrp"), import_module("pyvrp.stop")
    matrix = instance.form.full_matrix()
    n = len(matrix)
    data = module.ProblemData(
        clients=[module.Client(0, 0) for _ in range(n - 1)],
        depots=[module.Depot(0, 0)],
        vehicle_types=[module.VehicleType()],
        distance_matrices=[matrix],
        duration_matrices=[np.zeros_like(matrix)],
    )
    best = module.solve(data, stop=stop.MaxRuntime(seconds), seed=seed, display=False).best
    return [0, *best.routes()[0].visits()]


def or_tools(instance: Instance, seconds: float, seed: int) -> list[int]:
    from ortools.constraint_solver import pywrapcp, routing_enums_pb2

    matrix = instance.form.full_matrix().tolist()
    manager = pywrapcp.RoutingIndexManager(len(matrix), 1, 0)
    model = pywrapcp.RoutingModel(manager)
    transit = model.RegisterTransitMatrix(matrix)
    model.SetArcCostEvaluatorOfAllVehicles(transit)
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


def nearest(instance: Instance, seconds: float, seed: int) -> list[int]:
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


def two_opt(instance: Instance, seconds: float, seed: int) -> list[int]:
    """Nearest neighbour, then all improving 2-opt moves until none is left or time is up."""
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


ROUTERS: dict[str, tuple[Router, str, int]] = {  # name: router, package, most nodes
    "tcp local-search": (ours, "tcp-drill", 10**9),
    "fast-tsp": (fast_tsp, "fast_tsp", 6_000),
    "OR-Tools routing (GLS)": (or_tools, "ortools", 6_000),
    "PyVRP": (pyvrp, "pyvrp", 6_000),
    "elkai (LKH), no limit": (elkai, "elkai", 1_500),
    "python-tsp": (python_tsp, "python_tsp", 1_500),
    "nearest neighbour": (nearest, "numpy", 10**5),
    "nearest neighbour + 2-opt": (two_opt, "numpy", 10_000),
}


def generated(name: str) -> Workpiece:
    """``uniform1000``, ``clustered1000`` or ``lattice900``, seed 0."""
    kind = name.rstrip("0123456789")
    n, rng = int(name[len(kind) :]), np.random.default_rng(0)
    if kind == "lattice":
        side = round(n**0.5)
        y, x = (v.ravel().astype(np.int64) * 100 for v in np.mgrid[:side, :side])
    elif kind == "clustered":
        centres = rng.integers(0, 40_000, (2, n // 50))
        x, y = (centres[:, np.arange(n) % (n // 50)] + rng.normal(0, 500, (2, n))).astype(np.int64)
    else:
        x, y = rng.integers(0, 40_000, (2, n))
    return Workpiece(name, tuple(map(str, range(x.size))), x, y)


def load(name: str) -> Workpiece:
    for folder in ("tsplib", "vlsi"):
        path = CORPUS / folder / f"{name}.tsp"
        if path.exists():
            return read(path, units="mm").workpiece
    return generated(name)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument(
        "--instances", default="pcb442,pbd984,pcb1173,pcb3038,uniform1000,clustered1000,lattice900"
    )
    parser.add_argument("--models", default="sequential,simultaneous,euclidean")
    parser.add_argument("--routers", default=",".join(ROUTERS))
    parser.add_argument("--json", type=Path, default=Path("docs/routers.json"))
    parser.add_argument("--out", type=Path, default=Path("docs/routers.md"))
    args = parser.parse_args()
    warm_up()
    rows, missing = [], []
    for router in args.routers.split(","):
        call, package, most = ROUTERS[router]
        try:
            release = version("tcp-drill" if package == "tcp-drill" else package)
        except PackageNotFoundError:
            missing.append(router)
            continue
        for name in args.instances.split(","):
            piece = load(name)
            for model in args.models.split(","):
                instance = Instance(piece, Travel(Model(model)))
                if instance.form.size > most:
                    continue
                seeds = 1 if call in (nearest, two_opt, elkai) else args.seeds
                rows.append(measure(router, release, call, instance, model, args.seconds, seeds))
                print(rows[-1], flush=True)
    args.json.write_text(json.dumps({"rows": rows, "missing": missing}, indent=1) + "\n")
    args.out.write_text(report(rows, missing, args.seconds))


def measure(
    router: str,
    release: str,
    call: Router,
    instance: Instance,
    model: str,
    seconds: float,
    seeds: int,
) -> dict[str, object]:
    costs, took = [], []
    for seed in range(seeds):
        began = time.perf_counter()
        tour = call(instance, seconds, seed)
        took.append(time.perf_counter() - began)
        if sorted(tour) != list(range(instance.form.size)):
            raise SystemExit(f"{router} returned no tour of {instance.name}")
        costs.append(instance.form.tour_cost(tour))
    return {
        "router": router,
        "version": release,
        "instance": instance.name,
        "holes": len(instance),
        "model": model,
        "seeds": seeds,
        "median": int(statistics.median_low(costs)),
        "worst": max(costs),
        "seconds": round(max(took), 2),
    }


def report(rows: list[dict], missing: list[str], seconds: float) -> str:
    """One line an instance and model: the best median in quanta, and everybody's excess over it."""
    routers = list(dict.fromkeys(r["router"] for r in rows))
    lines = [
        "# Routers side by side",
        "",
        "Generated by `python benchmarks/routers.py`; do not edit. Open path, "
        f"{seconds:g} s of wall time each, one after another; excess of the median (worst) cost "
        "over the best median of the row, seeds 0, 1, ... Where a router took longer than the "
        "limit, its seconds are given.",
        "",
        "| instance | travel | best | " + " | ".join(routers) + " |",
        "|---" * (3 + len(routers)) + "|",
    ]
    for key in dict.fromkeys((r["instance"], r["model"]) for r in rows):
        row = {r["router"]: r for r in rows if (r["instance"], r["model"]) == key}
        best = min(r["median"] for r in row.values())
        cells = []
        for name in routers:
            if name not in row:
                cells.append("–")
                continue
            r = row[name]
            cell = f"{100 * (r['median'] / best - 1):.2f} % ({100 * (r['worst'] / best - 1):.2f})"
            late = r["seconds"] > 1.1 * seconds + 0.5
            cells.append(cell + (f" in {r['seconds']:.0f} s" if late else ""))
        lines.append(f"| {key[0]} | {key[1]} | {best} | " + " | ".join(cells) + " |")
    releases = ", ".join(dict.fromkeys(f"{r['router']} {r['version']}" for r in rows))
    lines += [
        "",
        f"Python {platform.python_version()}, {os.cpu_count()} cores, load average "
        f"{os.getloadavg()[2]:.1f}; ours uses two threads, the peers one. {releases}."
        + (f" Not installed here: {', '.join(missing)}." if missing else ""),
        "",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
