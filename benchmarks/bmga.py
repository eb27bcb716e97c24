"""BMGA on real boards, and against the proved fronts of WP1 and WP2.

    python benchmarks/bmga.py [--boards FOLDER]

Measurements are kept in benchmarks/results/bmga.json, each as soon as it is made: the command may
be stopped and started again.  ``benchmarks/papers.py --report`` sets them on docs/reproduction.md.
"""

from __future__ import annotations

import argparse
import json
import os
import time
import tomllib
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from tcp import Balance, Instance, Model, Rules, Stop, Travel, solve
from tcp.bounds.one_tree import one_tree_bound
from tcp.errors import InputError
from tcp.exact.pareto import front, weighted
from tcp.experiments.table import markdown
from tcp.files import read
from tcp.files.excellon import expanded, hints, read_program, workpiece
from tcp.result import decimal
from tcp.stop import Clock

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results" / "bmga.json"
CORPUS = Path(os.environ.get("TCP_CORPUS", ROOT.parent / "shared" / "corpus")) / "boards"
HINTS = tomllib.loads((ROOT / "tests" / "files" / "board_hints.toml").read_text())

RANGE = range(508, 3_321)
"""Holes of the paper's twenty samples."""

BOUND = 20.0
"""Seconds for the lower bound of a board."""

METHODS: dict[str, dict[str, Any]] = {
    "mGAp": {"crossover": "points", "clusters": False},
    "mGAu": {"crossover": "uniform", "clusters": False},
    "mGAuk": {"crossover": "uniform", "clusters": True},
}

FRONTS = [
    (piece, window, model)
    for piece, window in (("wp1", 4), ("wp1", 3), ("wp2", 10))
    for model in (Model.SEQUENTIAL, Model.SIMULTANEOUS)
]


def stored() -> dict[str, Any]:
    """All measurements by name."""
    return dict(json.loads(RESULTS.read_text())) if RESULTS.exists() else {}


def keep(name: str, make: Callable[[], Any]) -> None:
    """Make a measurement that is missing and keep it."""
    data = stored()
    if name not in data:
        data[name] = make()
        RESULTS.write_text(json.dumps(data, indent=1) + "\n")
        print(name, flush=True)


# --- real boards ------------------------------------------------------------


def boards(folder: Path) -> Iterator[tuple[str, Instance]]:
    """The largest tool of every board in the paper's range, holes in the file's order."""
    for path in sorted(folder.iterdir()):
        try:
            program = read_program(path, hints(**HINTS.get(path.name, {})))
        except InputError:  # no drill file, or one that cannot be drilled (the corpus says why)
            continue
        tools, counts = np.unique(expanded(program)[0], return_counts=True)
        if len(counts) and int(counts.max()) in RANGE:
            piece = workpiece(program, int(tools[counts.argmax()]))
            yield path.name, Instance(piece, Travel(Model.EUCLIDEAN))


def board(instance: Instance) -> dict[str, Any]:
    """Own order, lower bound and the three methods, each until its own rule ends it (Step 6)."""
    unit = float(instance.quantum)
    bound = one_tree_bound(instance, clock=Clock(Stop(time=BOUND)))
    found: dict[str, Any] = {
        "holes": len(instance),
        "own": round(instance.cost(range(len(instance))) * unit, 3),
        "bound": round(bound.value * unit, 3),
    }
    for name, options in METHODS.items():
        began = time.process_time()
        result = solve(instance, "bmga", seed=1, **options)
        assert result.cost is not None
        found[name] = {
            "path": round(result.cost * unit, 3),
            "cpu": round(time.process_time() - began, 2),
            "epochs": result.details["iterations"] // 100,
            "substrates": result.details["substrates"],
            "unbalanced": result.details["unbalanced"],
        }
    return found


def boards_tables(data: dict[str, Any]) -> str:
    """Figures 2 to 4 as one table each, boards by their number of holes."""
    named = [(name[6:], d) for name, d in data.items() if name.startswith("board ")]
    rows = sorted(named, key=lambda pair: int(pair[1]["holes"]))
    figures = {
        "Figure 2, path reducing ratio against the file's own order, and the bound's": _figure_2,
        "Figure 3, performances between conditions (differences of those ratios)": _figure_3,
        "Figure 4, executing times for path finding, CPU seconds, and how the runs went": _figure_4,
    }
    return "\n\n".join(f"{title}:\n\n{markdown(table(rows))}" for title, table in figures.items())


Boards = list[tuple[str, dict[str, Any]]]


def _reduced(d: dict[str, Any], method: str) -> float:
    return 1 - float(d[method]["path"]) / float(d["own"])


def _figure_2(rows: Boards) -> list[list[str]]:
    head = ["Board", "Holes", "File's order, mm", *METHODS, "Lower bound", "mGAuk above the bound"]
    ratios = [_ratios(d) for _, d in rows]
    table = [_figure_2_row(name, d) for name, d in rows]
    means = [f"{sum(column) / len(rows):.1%}" for column in zip(*ratios, strict=True)]
    return [head, *table, ["mean", "", "", *means], _figure_2_row("all together", _sum(rows))]


def _figure_2_row(name: str, d: dict[str, Any]) -> list[str]:
    return [name, str(d["holes"]), f"{d['own']:.1f}", *(f"{v:.1%}" for v in _ratios(d))]


def _ratios(d: dict[str, Any]) -> list[float]:
    """What the methods and the bound reduce, and how far mGAuk is above the bound."""
    bound = float(d["bound"])
    reduced = [*(_reduced(d, k) for k in METHODS), 1 - bound / float(d["own"])]
    return [*reduced, float(d["mGAuk"]["path"]) / bound - 1]


def _sum(rows: Boards) -> dict[str, Any]:
    """All boards as if they were one."""
    found: dict[str, Any] = {k: sum(d[k] for _, d in rows) for k in ("holes", "own", "bound")}
    return found | {k: {"path": sum(d[k]["path"] for _, d in rows)} for k in METHODS}


def _figure_3(rows: Boards) -> list[list[str]]:
    pairs = (("mGAu", "mGAp"), ("mGAuk", "mGAu"))
    table = [["Board", "Holes", *(f"{a} - {b}" for a, b in pairs)]]
    for name, d in rows:
        differences = [f"{_reduced(d, a) - _reduced(d, b):+.2%}" for a, b in pairs]
        table.append([name, str(d["holes"]), *differences])
    return table


def _figure_4(rows: Boards) -> list[list[str]]:
    table = [["Board", "Holes", *METHODS, *(f"{k}: epochs" for k in METHODS)]]
    table[0] += ["mGAuk: substrates", *(f"{k}: unbalanced windows" for k in METHODS)]
    for name, d in rows:
        cells = [f"{d[k]['cpu']:.1f}" for k in METHODS] + [str(d[k]["epochs"]) for k in METHODS]
        cells += [str(d["mGAuk"]["substrates"]), *(str(d[k]["unbalanced"]) for k in METHODS)]
        table.append([name, str(d["holes"]), *cells])
    return table


# --- proved fronts ----------------------------------------------------------


def judged(piece: str, model: Model, window: int) -> list[str]:
    """The exact front, the weighted optimum, and where 20 runs of BMGA end.

    An unbalanced window costs the mean leg of the shortest route.
    """
    file = read(ROOT / "data" / f"{piece}.csv").workpiece
    instance = Instance(file, Travel(model), rules=Rules(balance=Balance(window)))
    points = front(instance)
    price = points[0].cost // (len(file) - 1)
    best = weighted(points, price)
    target = best.cost + price * best.penalty
    values = []
    for seed in range(20):
        run = solve(instance, "bmga", seed=seed, clusters=False)
        assert run.cost is not None and run.route is not None
        values.append(run.cost + price * instance.penalty(run.route))
    unit: Fraction = instance.quantum
    spelled = ", ".join(f"({decimal(p.cost * unit)}, {p.penalty})" for p in points)
    hits = sum(value == target for value in values)
    return [spelled, decimal(target * unit), decimal(min(values) * unit), str(hits)]


def fronts_table(data: dict[str, Any]) -> str:
    """Exact fronts and BMGA side by side."""
    rows = [["Workpiece", "Travel", "w", "Exact front (time, unbalanced windows)"]]
    rows[0] += ["Weighted optimum", "BMGA: weighted", "BMGA at the optimum, of 20 runs"]
    for piece, window, model in FRONTS:
        found = data.get(f"front {piece} {model} {window}")
        rows += [[piece, str(model), str(window), *found]] if found else []
    return markdown(rows)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--boards", type=Path, default=CORPUS, help="folder of drill files")
    arguments = parser.parse_args()
    for piece, window, model in FRONTS:
        keep(f"front {piece} {model} {window}", lambda p=piece, m=model, w=window: judged(p, m, w))
    if not arguments.boards.is_dir():
        parser.error(f"{arguments.boards} is no folder")
    for name, instance in boards(arguments.boards):
        keep(f"board {name}", lambda i=instance: board(i))
    data = stored()
    print(fronts_table(data), boards_tables(data), sep="\n\n")


if __name__ == "__main__":
    main()
