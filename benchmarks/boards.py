"""Every board of the corpus, five ways to order its holes, at equal time, with the lower bound.

    python benchmarks/boards.py [--limit 10] [--only NAME] [--tool N] [--fresh]
    python benchmarks/boards.py --table [--note ...]     # docs/boards.md from the runs so far

One line of JSON a tool is appended to benchmarks/results/boards.jsonl, so an
interrupted run goes on where it stopped; ``--fresh`` begins anew.  How long it
can take at most is said at the start: no tool has more than three times the
limit.  The corpus is found in TCP_CORPUS, or in ../shared/corpus beside the
project.

A tool's holes (repeats written out, slots left out) are one open path with free
ends in simultaneous axis travel at unit speed; the cost is in mm.  The ways:

file      the order of the file
nn        nearest neighbour from the file's first hole
nn+2opt   that, and 2-opt until no exchange helps (what pcb2gcode does)
gls       OR-Tools routing: cheapest arc, guided local search (what FlatCAM Evo does),
          given the exact open-path model
tcp       what ``tcp optimize`` does by default, with its bound; two threads while it seeks

2-opt and guided local search get the time that tcp took, and at least one second.
"""

from __future__ import annotations

import argparse
import json
import os
import time
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from ortools.constraint_solver import pywrapcp, routing_enums_pb2

from tcp import Instance, Model, Travel
from tcp.boards.effort import LIMITS, Effort, answer
from tcp.errors import InputError
from tcp.files.excellon import expanded, hints, read_program, workpiece
from tcp.kernels import cost_of_move, pack
from tcp.solve import versions
from tcp.workpiece import Workpiece

ROOT = Path(__file__).resolve().parents[1]
BOARDS = Path(os.environ.get("TCP_CORPUS", ROOT.parent / "shared" / "corpus")) / "boards"
OUT = ROOT / "benchmarks" / "results" / "boards.jsonl"
HINTS = tomllib.loads((ROOT / "tests" / "files" / "board_hints.toml").read_text())
WAYS = ("file", "nn", "nn+2opt", "gls", "tcp")
MATRIX = 2_000


def nearest_neighbour(instance: Instance) -> np.ndarray:
    """From the file's first hole always to the nearest one left."""
    form, n = instance.form, len(instance)
    left = np.arange(1, n)
    order = [0]
    while len(left):
        here = np.full(len(left), order[-1])
        k = int(np.argmin(form.costs(here, left)))
        order.append(int(left[k]))
        left = np.delete(left, k)
    return np.array(order)


@njit(cache=True)
def two_opt(order, x, y, rule, rounds):  # pragma: no cover - compiled
    """Reverse pieces of an open path while that makes it shorter; at most so many passes."""
    n = len(order)
    for _ in range(rounds):
        better = False
        for i in range(n - 1):
            for j in range(i + 1, n):
                a, b = order[i], order[j]
                old = new = 0
                if i > 0:
                    p = order[i - 1]
                    old += cost_of_move(rule, x[p] - x[a], y[p] - y[a])
                    new += cost_of_move(rule, x[p] - x[b], y[p] - y[b])
                if j < n - 1:
                    q = order[j + 1]
                    old += cost_of_move(rule, x[b] - x[q], y[b] - y[q])
                    new += cost_of_move(rule, x[a] - x[q], y[a] - y[q])
                if new < old:
                    order[i : j + 1] = order[i : j + 1][::-1].copy()
                    better = True
        if not better:
            return True
    return False


def improved(instance: Instance, order: np.ndarray, limit: float) -> np.ndarray:
    """2-opt, pass by pass, until nothing helps or the time is up."""
    form, rule = instance.form, pack(instance.rule)
    order, ends = order.astype(np.int64).copy(), time.perf_counter() + limit
    while time.perf_counter() < ends:
        if two_opt(order, form.x, form.y, rule, 1):
            break
    return order


def guided(instance: Instance, limit: float) -> int:
    """OR-Tools routing on the exact open-path model: cheapest arc, guided local search."""
    form = instance.form
    manager = pywrapcp.RoutingIndexManager(form.size, 1, form.virtual)
    model = pywrapcp.RoutingModel(manager)
    if form.size <= MATRIX:
        transit = model.RegisterTransitMatrix(form.full_matrix().tolist())
    else:
        x, y, rule = form.x.tolist(), form.y.tolist(), instance.rule.params

        def cost(i: int, j: int) -> int:
            p, q = manager.IndexToNode(i), manager.IndexToNode(j)
            if form.virtual in (p, q):
                return 0
            return max(rule[0] * abs(x[p] - x[q]), rule[1] * abs(y[p] - y[q])) // rule[2]

        transit = model.RegisterTransitCallback(cost)
    model.SetArcCostEvaluatorOfAllVehicles(transit)
    search = pywrapcp.DefaultRoutingSearchParameters()
    search.first_solution_strategy = routing_enums_pb2.FirstSolutionStrategy.PATH_CHEAPEST_ARC
    search.local_search_metaheuristic = (
        routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    )
    search.time_limit.FromMilliseconds(int(1000 * limit))
    found = model.SolveWithParameters(search)
    if found is None:  # nothing within the limit
        return instance.form.tour_cost(instance.tour(nearest_neighbour(instance).tolist()))
    route, at = [], model.Start(0)
    while not model.IsEnd(at):
        route.append(manager.IndexToNode(at))
        at = found.Value(model.NextVar(at))
    return instance.form.tour_cost(route)


def measure(instance: Instance, limit: float) -> dict[str, Any]:
    """All ways on one tool; costs in quanta."""
    as_is = tuple(range(len(instance)))
    ours = answer(instance, as_is, Effort.NORMAL, limit, 0)
    equal = max(1.0, min(ours.seconds, limit))
    near = nearest_neighbour(instance)
    costs = {
        "file": instance.cost(as_is),
        "nn": instance.cost(near.tolist()),
        "nn+2opt": instance.cost(improved(instance, near, equal).tolist()),
        "gls": guided(instance, equal) if len(instance) > 3 else ours.cost,
        "tcp": ours.cost,
    }
    return {
        "costs": costs,
        "bound": ours.bound or 0,
        "optimal": ours.optimal,
        "seconds": round(ours.seconds, 2),
        "quantum": str(instance.quantum),
    }


def tools_of_the_corpus(only: str, number: int | None) -> Iterator[tuple[str, int, Instance]]:
    """Every tool with two holes or more: board, tool, and its holes as a problem."""
    for path in sorted(BOARDS.iterdir()):
        try:
            program = read_program(path, hints(**HINTS.get(path.name, {})))
        except InputError:
            continue
        tools, counts = np.unique(expanded(program)[0], return_counts=True)
        for tool in tools[counts > 1].tolist():
            if only in path.name and number in (None, tool):
                piece = workpiece(program, tool)
                yield path.name, tool, Instance(piece, Travel(Model.SIMULTANEOUS))


def run(limit: float, only: str, number: int | None, out: Path) -> None:
    """Measure what is not yet in the output."""
    done = {(row["board"], row["tool"]) for row in load(out) if row["limit"] == limit}
    todo = [t for t in tools_of_the_corpus(only, number) if t[:2] not in done]
    most = sum(4.0 if len(instance) <= 16 else 3 * max(limit, 1.0) for _, _, instance in todo)
    print(f"{len(todo)} tools to measure, at most {most / 60:.0f} minutes and compilation")
    out.parent.mkdir(parents=True, exist_ok=True)
    warm = np.random.default_rng(0).integers(0, 9999, (2, 300))
    piece = Workpiece("warm", tuple(map(str, range(300))), *warm, Fraction(1, 1000))
    measure(Instance(piece, Travel(Model.SIMULTANEOUS)), 3.0)  # compiles
    for board, tool, instance in todo:
        row = {"board": board, "tool": tool, "holes": len(instance), "limit": limit}
        row |= measure(instance, limit)
        row |= {"load": round(os.getloadavg()[0], 2), "cores": os.cpu_count()}
        row |= {"versions": versions(("ortools", "highspy"))}
        with out.open("a") as file:
            file.write(json.dumps(row) + "\n")
        print(f"{board:40} T{tool:<4} {len(instance):6}", row["costs"], row["bound"], flush=True)


def load(out: Path) -> list[dict[str, Any]]:
    """The rows measured so far; not those of an older form, without the machine's load."""
    rows = map(json.loads, out.read_text().splitlines() if out.exists() else [])
    return [row for row in rows if "load" in row]


def table(rows: list[dict[str, Any]], note: str = "") -> str:
    """``docs/boards.md``."""
    boards: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        boards[row["board"]].append(row)
    lines = [
        "| board | holes | tools | proved | " + " | ".join(WAYS) + " | bound | gap |",
        "|---|--:|--:|--:|" + "--:|" * (len(WAYS) + 2),
    ]
    sums: dict[str, float] = defaultdict(float)
    for name, mine in sorted(boards.items()):
        worth = {way: sum(mm(row, row["costs"][way]) for row in mine) for way in WAYS}
        worth["bound"] = sum(mm(row, row["bound"]) for row in mine)
        for key, value in worth.items():
            sums[key] += value
        lines.append(cells(name, mine, worth))
    lines.append(cells("**all**", rows, sums))
    return "\n".join([*heading(rows, note), *lines, "", *conclusions(rows, sums), ""])


def heading(rows: list[dict[str, Any]], note: str) -> list[str]:
    """What was measured, with what and where."""
    loads = [row["load"] for row in rows]
    programs = ", ".join(f"{k} {v}" for k, v in rows[-1]["versions"].items())
    return [
        "# Real boards",
        "",
        "Printed by `python benchmarks/boards.py` and `--table`; the module's first lines say",
        f"what is measured. Limit {rows[0]['limit']:g} s a tool; {programs};",
        f"{rows[-1]['cores']} cores, load {min(loads):.1f} to {max(loads):.1f} while it ran.",
        "Travel in mm, simultaneous axes, one open path a tool; *proved*: how many tools' orders",
        "are proved shortest.",
        "",
        *([note, ""] if note else []),
    ]


def conclusions(rows: list[dict[str, Any]], sums: dict[str, float]) -> list[str]:
    """The table in sentences."""
    small = [row for row in rows if row["holes"] <= 400]
    medium = [row for row in rows if row["holes"] <= 500]
    large = [row for row in rows if row["holes"] > 400]
    quick = sum(row["optimal"] and row["seconds"] <= 5 for row in medium)
    peer = min(("nn", "nn+2opt", "gls"), key=lambda way: sums[way])
    kicad = [row for row in rows if row["board"].startswith("kicad")]
    ours = sum(mm(r, r["costs"]["tcp"]) for r in kicad)
    ratio = sum(mm(r, r["costs"]["file"]) for r in kicad) / ours if ours else 0.0
    found = [
        f"* Tools with up to 400 holes: {sum(r['optimal'] for r in small)} of {len(small)} "
        "proved optimal within the limit.",
        f"* Tools with up to 500 holes: {quick} of {len(medium)} proved within 5 s.",
        f"* Tools above 400: {sum(r['optimal'] for r in large)} of {len(large)} proved; "
        f"largest gap {100 * max(map(gap, large), default=0):.2f} %.",
        f"* Best peer: {peer}, {100 * (sums[peer] / sums['tcp'] - 1):.1f} % above ours.",
        *([f"* KiCad's files travel {ratio:.1f} times what our order needs."] if kicad else []),
        f"* Longest run of one tool: {max(row['seconds'] for row in rows):.1f} s.",
    ]
    if not large:
        return found
    return [
        *found,
        "",
        "Tools above 400 holes:",
        "",
        "| board | tool | holes | tcp | bound | gap | s |",
        "|---|--:|--:|--:|--:|--:|--:|",
        *(
            f"| {r['board']} | T{r['tool']} | {r['holes']} | {mm(r, r['costs']['tcp']):.2f} | "
            f"{mm(r, r['bound']):.2f} | {100 * gap(r):.2f} % | {r['seconds']:.1f} |"
            for r in sorted(large, key=gap, reverse=True)
        ),
    ]


def mm(row: dict[str, Any], cost: int) -> float:
    """A cost in mm."""
    over, _, under = row["quantum"].partition("/")
    return cost * int(over) / int(under or 1)


def gap(row: dict[str, Any]) -> float:
    """(cost - bound) / cost of ours."""
    cost = row["costs"]["tcp"]
    return (cost - row["bound"]) / cost if cost else 0.0


def cells(name: str, rows: list[dict[str, Any]], worth: dict[str, float]) -> str:
    """One line of the table."""
    share = (worth["tcp"] - worth["bound"]) / worth["tcp"] if worth["tcp"] else 0.0
    numbers = " | ".join(f"{worth[way]:.1f}" for way in (*WAYS, "bound"))
    proved = sum(row["optimal"] for row in rows)
    holes = sum(row["holes"] for row in rows)
    return f"| {name} | {holes} | {len(rows)} | {proved} | {numbers} | {100 * share:.2f} % |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--limit", type=float, default=LIMITS[Effort.NORMAL], help="Seconds a tool."
    )
    parser.add_argument(
        "--only", default="", metavar="NAME", help="Boards with this in their name."
    )
    parser.add_argument("--tool", type=int, metavar="N", help="One tool of them.")
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--fresh", action="store_true", help="Forget the runs so far.")
    parser.add_argument("--table", action="store_true", help="Only write docs/boards.md.")
    parser.add_argument("--note", default="", help="A sentence about the machine, for the page.")
    given = parser.parse_args()
    if given.fresh:
        given.out.unlink(missing_ok=True)
    if not given.table:
        run(given.limit, given.only, given.tool, given.out)
    rows = [row for row in load(given.out) if row["limit"] == given.limit]
    page = table(rows, given.note)
    if given.table:
        (ROOT / "docs" / "boards.md").write_text(page)
    print(page)


if __name__ == "__main__":
    main()
