"""Reproduce the papers' tables and write docs/reproduction.md.

    python benchmarks/papers.py [--runs N] [--jobs N] [--boards FOLDER]

Finished runs are kept in results/papers.jsonl and results/papers-more.json: the command may be
stopped and started again.  ``--report`` makes no new runs and writes what there is.
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from tcp import Balance, Instance, Model, Rules, Stop, Travel, solve
from tcp.bounds.one_tree import one_tree_bound
from tcp.exact.pareto import front, weighted
from tcp.experiments.journal import Journal, Run
from tcp.experiments.run import conduct, optima
from tcp.experiments.spec import ROWS, Experiment, load
from tcp.experiments.statistics import Summary, summarise
from tcp.experiments.table import markdown, whole_report
from tcp.files import read
from tcp.fleet import Fleet
from tcp.result import decimal
from tcp.stop import Clock

ROOT = Path(__file__).resolve().parents[1]
FILES = ROOT / "data" / "experiments"
MORE = Path("results/papers-more.json")

RUNS = {
    "cuckoo-table-1": 1000,
    "cuckoo-table-2": 1000,
    "htga-table-vi": 1000,
    "htga-table-vii": 1000,
    "htga-table-viii": 300,
    "htga-table-ix": 300,
    "cuckoo-table-5": 100,
    "cuckoo-table-6": 100,
    "firefly-table-iii": 100,
    "htga-table-x": 100,
    "htga-table-xi": 100,
    "cuckoo-table-3": 100,
}
"""Runs of each column: what fits half an hour of one core."""

BOARDS = (
    "kicad-DIN41612-backplane.drl",
    "kicad-mnt-reform2-motherboard-PTH.drl",
    "altium-Thunderscope-4.1-round.txt",
    "kicad-c4puter-motherboard.drl",
)
"""Boards of the paper's range, 508 to 3,320 holes in the largest tool."""

METHODS: dict[str, dict[str, Any]] = {
    "mGAp": {"crossover": "points", "clusters": False},
    "mGAu": {"crossover": "uniform", "clusters": False},
    "mGAuk": {"crossover": "uniform", "clusters": True},
}

COMPARED = ("iterations", "time", "error", "fitness", "searched")
"""Kinds of figures that the verdict table sets side by side."""


def kept(name: str, make: Callable[[], Any], report: bool) -> Any:
    """A measurement from the file, or made now and kept there; None if there may be none."""
    data = json.loads(MORE.read_text()) if MORE.exists() else {}
    if name not in data and not report:
        data[name] = make()
        MORE.parent.mkdir(exist_ok=True)
        MORE.write_text(json.dumps(data, indent=1))
    return data.get(name)


# --- the tables -------------------------------------------------------------


def tables(
    journal: Journal, cap: int | None, jobs: int, report: bool
) -> list[tuple[Experiment, list[Summary | None]]]:
    """Every experiment with the summaries of its runs."""
    done, stored = [], journal.runs() if report else {}
    for name, runs in RUNS.items():
        experiment = load(FILES / f"{name}.toml")
        experiment = replace(experiment, runs=min(runs, cap or runs))
        known = optima(experiment)
        made = stored if report else conduct(experiment, known, journal, fleet=Fleet(jobs))
        done.append((experiment, summarise(experiment.columns, known, made)))
    order = [p.stem for p in sorted(FILES.glob("*.toml"))]
    return sorted(done, key=lambda pair: order.index(list(RUNS)[done.index(pair)]))


def number(text: str) -> float | None:
    """The first number of a printed figure."""
    word = text.replace(",", "").replace("%", "").split(" ")[0]
    try:
        return float(word)
    except ValueError:
        return None


def verdicts(done: list[tuple[Experiment, list[Summary | None]]]) -> str:
    """Each published average beside ours, and whether they agree."""
    rows = [["Table", "Column", "Figure", "Paper", "Ours", "Success", "Verdict"]]
    for experiment, summaries in done:
        table = experiment.title.split(":")[0]
        for s in (s for s in summaries if s is not None):
            for key in experiment.rows:
                theirs = number(s.column.published.get(key, ""))
                if not key.startswith("average_") or key.partition("_")[2] not in COMPARED:
                    continue
                if theirs is None or theirs == 0:
                    continue
                printed, ours = s.figure(key), number(s.figure(key))
                rows.append(
                    [
                        *(table, s.column.name, ROWS[key], s.column.published[key], printed),
                        f"{s.success:.1%} of {len(s.runs)}",
                        _verdict(theirs, ours) + _few(key, s),
                    ]
                )
    return markdown(rows)


def _few(key: str, s: Summary) -> str:
    """A reminder where an average is over few runs."""
    over_hits = key.endswith(("iterations", "searched")) and 0 < s.success < 0.99
    return f", but only {s.success:.0%} of the runs got there" if over_hits else ""


def _verdict(theirs: float, ours: float | None) -> str:
    if ours is None:
        return "not confirmed: no run got there"
    ratio = ours / theirs
    if 0.9 <= ratio <= 1.1:
        return "confirmed (within 10 %)"
    if 0.5 <= ratio <= 2:
        return f"same order ({ratio:.2f} times)"
    return f"not confirmed ({ratio:.2g} times)"


# --- heuristics against a proof ---------------------------------------------


def proof_seconds(instance: Instance) -> float:
    """Median time to a proof of three runs of the exact default, the first one not counted."""
    times = []
    for seed in range(4):
        result = solve(instance, exact=True, seed=seed)
        assert result.gap == 0
        times.append(result.seconds)
    return sorted(times[1:])[1]


def comparison(done: list[tuple[Experiment, list[Summary | None]]], report: bool) -> str:
    """Success and time to the optimum of each heuristic, and the time to a proof."""
    seen: dict[tuple[str, str, str], Summary] = {}
    for _, summaries in done:
        for s in (s for s in summaries if s is not None):
            where = s.column.instance
            key = (where.name, str(where.travel.model), s.column.name)
            if key not in seen or len(s.runs) > len(seen[key].runs):
                seen[key] = s
    head = ["Workpiece", "Travel", "Heuristic", "Runs", "Success", "Seconds a run"]
    rows = [[*head, "Seconds to the optimum, expected", "Seconds to a proof (exact)"]]
    for (piece, model, name), s in sorted(seen.items()):
        if name in ("Case 1", "Case 2"):
            continue
        instance = s.column.instance
        proof = kept(f"proof {piece} {model}", lambda i=instance: proof_seconds(i), report)
        expected = f"{s.seconds / s.success:.3f}" if s.success else "never"
        rows.append(
            [
                *(piece, model, name, str(len(s.runs)), f"{s.success:.1%}", f"{s.seconds:.3f}"),
                expected,
                "not measured" if proof is None else f"{proof:.3f}",
            ]
        )
    return markdown(rows)


# --- BMGA -------------------------------------------------------------------


def bmga_boards(folder: Path | None, report: bool) -> str:
    """Path reduction against the file's own order, as in Figures 2 to 4, with a lower bound."""
    rows = [["Board", "Holes", "File's order, mm", "Method", "Path, mm", "Reduction"]]
    rows[0] += ["Seconds", "Unbalanced windows", "Lower bound, mm", "Above the bound"]
    for name in BOARDS:
        make = None if folder is None else folder / name
        data = kept(f"board {name}", lambda p=make: board(p), report or make is None)
        for method, found in (data or {}).get("methods", {}).items():
            own, path, bound = data["own"], found["path"], data["bound"]
            rows.append(
                [
                    *(name, str(data["holes"]), f"{own:.1f}", method, f"{path:.1f}"),
                    *(f"{1 - path / own:.1%}", f"{found['seconds']:.1f}"),
                    *(str(found["unbalanced"]), f"{bound:.1f}", f"{path / bound - 1:.1%}"),
                ]
            )
    return markdown(rows)


def board(path: Path) -> dict[str, Any]:
    """The largest tool of a board: its own order, the three methods, a lower bound."""
    piece = read(path).workpiece
    instance = Instance(piece, Travel(Model.EUCLIDEAN))
    bound = one_tree_bound(instance, clock=Clock(Stop(time=10.0)))
    unit = float(instance.quantum)
    methods = {}
    for name, options in METHODS.items():
        result = solve(instance, "bmga", stop=Stop(time=30.0), seed=1, **options)
        methods[name] = {
            "path": result.cost * unit,
            "seconds": result.seconds,
            "unbalanced": result.details["unbalanced"],
        }
    own = instance.cost(range(len(piece))) * unit
    return {"holes": len(piece), "own": own, "bound": bound.value * unit, "methods": methods}


def bmga_fronts(report: bool) -> str:
    """The exact front of WP1 and WP2, and where BMGA ends for the same rule and price."""
    rows = [["Workpiece", "Travel", "w", "Exact front (time, unbalanced windows)"]]
    rows[0] += ["Weighted optimum", "BMGA: weighted", "BMGA at the optimum, of 20 runs"]
    for piece, window in (("wp1", 4), ("wp1", 3), ("wp2", 10)):
        for model in (Model.SEQUENTIAL, Model.SIMULTANEOUS):
            name = f"front {piece} {model} {window}"
            data = kept(name, lambda p=piece, m=model, w=window: judged(p, m, w), report)
            if data is not None:
                rows.append([piece, str(model), str(window), *data])
    return markdown(rows)


def judged(piece: str, model: Model, window: int) -> list[str]:
    """One row of the fronts' table; a window costs the mean leg of the shortest route."""
    workpiece = read(ROOT / "data" / f"{piece}.csv").workpiece
    instance = Instance(workpiece, Travel(model), rules=Rules(balance=Balance(window)))
    points = front(instance)
    price = points[0].cost // (len(workpiece) - 1)
    best = weighted(points, price)
    target = best.cost + price * best.penalty
    values = []
    for seed in range(20):
        run = solve(instance, "bmga", seed=seed, clusters=False)
        values.append(run.cost + price * instance.penalty(run.route))
    unit: Fraction = instance.quantum
    spelled = ", ".join(f"({decimal(p.cost * unit)}, {p.penalty})" for p in points)
    hits = sum(value == target for value in values)
    return [spelled, decimal(target * unit), decimal(min(values) * unit), str(hits)]


# --- the page ---------------------------------------------------------------

PROSE = (ROOT / "benchmarks" / "papers.md").read_text(encoding="utf-8")


def page(arguments: argparse.Namespace) -> str:
    """The whole of docs/reproduction.md."""
    journal = Journal(arguments.journal)
    done = tables(journal, arguments.runs, arguments.jobs, arguments.report)
    runs: dict[str, Run] = journal.runs()
    spent = sum(run.seconds for run in runs.values())
    made = f"{len(runs)} runs, {spent / 60:.0f} minutes in all on shared cores, " + (
        f"Python {platform.python_version()} on {platform.machine()}"
    )
    parts = {
        "MADE": made,
        "VERDICTS": verdicts(done),
        "COMPARISON": comparison(done, arguments.report),
        "FRONTS": bmga_fronts(arguments.report),
        "BOARDS": bmga_boards(arguments.boards, arguments.report),
        "TABLES": "\n".join(whole_report(e, s) for e, s in done),
    }
    text = PROSE
    for name, value in parts.items():
        text = text.replace("{" + name + "}", value)
    return text


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, help="at most so many runs of each column")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--journal", type=Path, default=Path("results/papers.jsonl"))
    parser.add_argument("--boards", type=Path, help="folder of drill files for BMGA")
    parser.add_argument("--report", action="store_true", help="make no new runs")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "reproduction.md")
    arguments = parser.parse_args()
    began = time.perf_counter()
    arguments.out.write_text(page(arguments), encoding="utf-8")
    print(f"{arguments.out} written in {time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
