"""All exact models on the papers' workpieces, in one run: seconds to the proof.

    python benchmarks/exact_models.py [--limit 20] [--repeats 3] [--out benchmarks/results]
    python benchmarks/exact_models.py --cp-sat     # CP-SAT's parameters on growing instances

Prints a Markdown table and writes it beside a JSON file with every run, the
versions and the seed.  A cell is the median of the wall seconds of all
repeats, model building included and imports not; where the limit came first,
the gap that was left.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tcp import Instance, Model, Stop, Travel, Workpiece, solve
from tcp.errors import TcpError
from tcp.files import read
from tcp.result import Result, Status
from tcp.solve import SOLVERS, versions

ROOT = Path(__file__).resolve().parents[1]
SEED = 0

MODELS: list[tuple[str, str, dict[str, Any]]] = [
    ("held-karp", "held-karp", {}),
    ("routing (its CP-SAT search)", "routing", {}),
    ("cp-sat", "cp-sat", {}),
    ("milp subtour, HiGHS", "milp", {}),
    ("milp subtour, CBC", "milp", {"backend": "cbc"}),
    ("milp subtour, SCIP", "milp", {"backend": "scip"}),
    ("milp flow, HiGHS", "milp", {"formulation": "flow"}),
    ("milp mtz, HiGHS", "milp", {"formulation": "mtz"}),
    ("branch-and-cut", "branch-and-cut", {}),
]
CP_SAT: list[tuple[str, str, dict[str, Any]]] = [
    (f"cp-sat, {w} worker{'s' * (w > 1)}, linearization {k}", "cp-sat", o)
    for w in (1, 2)
    for k in (0, 1, 2)
    for o in [{"workers": w, "linearization": k}]
]


def papers() -> Iterator[Instance]:
    """WP1 to WP3 in both cases."""
    for name in ("wp1", "wp2", "wp3"):
        for model in (Model.SEQUENTIAL, Model.SIMULTANEOUS):
            yield Instance(read(ROOT / "data" / f"{name}.csv").workpiece, Travel(model))


def growing() -> Iterator[Instance]:
    """The first 9 to 49 holes of WP3, and WP3 beside copies of itself."""
    piece = read(ROOT / "data" / "wp3.csv").workpiece
    x, y = piece.x.tolist(), piece.y.tolist()
    for n in (15, 25, 35, 49):
        yield Instance(_board(f"wp3[:{n}]", x[:n], y[:n], piece))
    for copies in (2, 3):
        shift = max(x) - min(x) + 30_000
        xs = [v + k * shift for k in range(copies) for v in x]
        yield Instance(_board(f"{copies} x wp3", xs, y * copies, piece))


def _board(name: str, x: list[int], y: list[int], like: Workpiece) -> Workpiece:
    step = like.step
    decimals = [(str(float(a * step)), str(float(b * step))) for a, b in zip(x, y, strict=True)]
    return Workpiece.from_decimals(name, decimals)


def measure(
    instance: Instance, solver: str, options: dict[str, Any], limit: float, repeats: int
) -> list[Result]:
    """Run a solver; once is enough where the limit comes first."""
    results: list[Result] = []
    while len(results) < repeats:
        results.append(
            solve(instance, solver, stop=Stop(time=limit), seed=SEED, exact=True, **options)
        )
        if results[-1].status is not Status.OPTIMAL:
            break
    return results


def cell(results: list[Result]) -> str:
    """What the table says about the runs of one model on one instance."""
    last = results[-1]
    if last.status is Status.OPTIMAL:
        return f"{statistics.median(r.seconds for r in results):.3f}"
    return "no bound" if last.gap is None else f"gap {100 * last.gap:.1f} %"


def record(label: str, results: list[Result]) -> dict[str, Any]:
    """The runs as plain data."""
    last = results[-1]
    return {
        "model": label,
        "instance": last.instance.describe(),
        "seconds": [round(r.seconds, 4) for r in results],
        "cost": str(last.time),
        "bound": str(last.lower_bound),
        "status": str(last.status),
        "details": {k: str(v) for k, v in last.details.items()},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--limit", type=float, default=20, help="seconds a run (default 20)")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--cp-sat", action="store_true", help="compare CP-SAT's parameters")
    parser.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "results")
    given = parser.parse_args()
    models = CP_SAT if given.cp_sat else [m for m in MODELS if m[1] in SOLVERS]
    instances = list(growing() if given.cp_sat else papers())
    header = [f"{i.name} {i.travel.model}" for i in instances]
    table = [["model", *header], ["---"] + ["---:"] * len(header)]
    runs: list[dict[str, Any]] = []
    for _, solver, options in models:  # compile and import before the first second counts
        measure(instances[0], solver, options, given.limit, 1)
    for label, solver, options in models:
        row = [label]
        for instance in instances:
            try:
                results = measure(instance, solver, options, given.limit, given.repeats)
            except TcpError as refusal:
                row.append("refused")
                runs.append({"model": label, "instance": instance.name, "refused": str(refusal)})
                continue
            row.append(cell(results))
            runs.append(record(label, results))
        table.append(row)
        print("done:", " | ".join(row), flush=True)
    libraries = versions(("ortools", "pulp", "highspy", "pyscipopt", "numba"))
    about = {"seed": SEED, "limit_s": given.limit, "repeats": given.repeats, "versions": libraries}
    about |= {"machine": platform.machine(), "cores": os.cpu_count()}
    lines = ["| " + " | ".join(row) + " |" for row in table]
    text = "\n".join([*lines, "", "`" + json.dumps(about) + "`", ""])
    given.out.mkdir(parents=True, exist_ok=True)
    stem = "cp_sat_parameters" if given.cp_sat else "exact_models"
    (given.out / f"{stem}.md").write_text(text)
    (given.out / f"{stem}.json").write_text(json.dumps(about | {"runs": runs}, indent=1) + "\n")
    print("\n" + text)


if __name__ == "__main__":
    main()
