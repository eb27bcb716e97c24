"""Time, memory and gap of ``local-search`` from 10^2 to 10^6 holes, into docs/scaling.md.

    python benchmarks/scaling.py [--largest 1000000] [--note TEXT]
    python benchmarks/scaling.py --fresh      # forget the rows measured so far

Uniform random holes, simultaneous axes, open path.  Every size runs in a process of its own, so
that its peak memory is its own: the holes are written as a CSV file, read, routed within the
size's time limit, validated and written, as ``tcp solve --out`` does.  A second process then
computes a proved lower bound, Held and Karp's one-tree bound in exact integers, within a limit of
its own.  One line of JSON a size is kept in benchmarks/results/scaling.jsonl; an interrupted run
goes on where it stopped.  All sizes together take less than 25 minutes.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
ROWS = ROOT / "benchmarks" / "results" / "scaling.jsonl"
PAGE = ROOT / "docs" / "scaling.md"
PLOT = ROOT / "docs" / "scaling.svg"

SIZES = {  # holes: seconds for the route, seconds for the bound
    100: (1, 5),
    300: (2, 10),
    1_000: (5, 20),
    3_000: (10, 30),
    10_000: (20, 60),
    30_000: (40, 90),
    100_000: (60, 200),
    300_000: (120, 0),
    1_000_000: (300, 0),
}


def write_holes(n: int, path: Path) -> None:
    import numpy as np

    side = 10 * int(1000 * n**0.5)
    xy = np.random.default_rng(0).integers(0, side, (n, 2)) / 1000
    lines = (f"{i},{x:.3f},{y:.3f}\n" for i, (x, y) in enumerate(xy.tolist(), 1))
    path.write_text("id,x,y\n" + "".join(lines))


def instance(path: Path) -> Any:
    from tcp import Instance, Model, Travel
    from tcp.files import read

    return Instance(read(path).workpiece, Travel(Model.SIMULTANEOUS))


def route(path: Path, seconds: float) -> dict[str, Any]:
    """Read, route, validate, write: one size, in this process."""
    from importlib import import_module

    from tcp import Stop
    from tcp.report.route import save_route
    from tcp.solve import solve

    import_module("tcp.heuristics.local_search.warm").warm_up()
    news: list[Any] = []
    began, spent = time.perf_counter(), time.process_time()
    problem = instance(path)
    read = time.perf_counter() - began
    result = solve(problem, "local-search", stop=Stop(time=seconds), report=news.append)
    solved = time.perf_counter() - began
    save_route(result, path.with_name("route.csv"))
    at = {p.note: p for p in reversed(news)}
    descent = at.get("descent", at["start"])
    return {
        "limit": seconds,
        "read_s": round(read, 2),
        "start_s": round(at["start"].seconds, 2),
        "start": at["start"].cost,
        "descent_s": round(descent.seconds, 2),
        "descent": descent.cost,
        "search_s": round(result.seconds, 2),
        "check_s": round(solved - read - result.seconds, 2),
        "total_s": round(time.perf_counter() - began, 2),
        "cpu_s": round(time.process_time() - spent, 2),
        "cost": result.cost,
        "peak_mb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
    }


def bound(path: Path, seconds: float) -> dict[str, Any]:
    """The one-tree bound of one size, in this process."""
    from tcp.bounds.one_tree import one_tree_bound
    from tcp.solve import sharpen
    from tcp.stop import Clock, Stop

    problem = instance(path)
    value = sharpen(problem, one_tree_bound(problem, clock=Clock(Stop(seconds))).value)
    return {"bound": value, "bound_limit": seconds}


def measure(n: int) -> dict[str, Any]:
    """Both processes of one size."""
    seconds, more = SIZES[n]
    row: dict[str, Any] = {"holes": n, "load": round(os.getloadavg()[0], 1)}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "holes.csv"
        write_holes(n, path)
        row |= apart("route", path, seconds)
        row |= apart("bound", path, more) if more else {"bound": None}
    return row


def apart(what: str, path: Path, seconds: float) -> dict[str, Any]:
    """What a process of its own prints."""
    words = [sys.executable, __file__, "--do", what, str(path), str(seconds)]
    answer = subprocess.run(words, check=True, capture_output=True, text=True)
    return json.loads(answer.stdout.splitlines()[-1])


def gap(row: dict[str, Any]) -> float | None:
    """(cost - bound) / cost in percent."""
    return None if row["bound"] is None else 100 * (row["cost"] - row["bound"]) / row["cost"]


def page(rows: list[dict[str, Any]], note: str) -> str:
    """docs/scaling.md."""
    lines = [
        "| holes | limit | read | start | descent | search | check | whole | CPU | peak memory | "
        "start | descent | gap |",
        "|--:|" + "--:|" * 12,
    ]
    for r in rows:
        over = [f"+{100 * (r[k] / r['cost'] - 1):.2f} %" for k in ("start", "descent")]
        closed = gap(r)
        lines.append(
            f"| {r['holes']:,} | {r['limit']:g} s | {r['read_s']:.1f} s | {r['start_s']:.1f} s "
            f"| {r['descent_s']:.1f} s | {r['search_s']:.1f} s | {r['check_s']:.1f} s "
            f"| {r['total_s']:.1f} s | {r['cpu_s']:.0f} s | {r['peak_mb']:,} MB | {over[0]} "
            f"| {over[1]} | {'–' if closed is None else f'{closed:.2f} %'} |"
        )
    loads = [r["load"] for r in rows]
    text = [
        "# From a hundred holes to a million",
        "",
        "Generated by `python benchmarks/scaling.py`; do not edit.",
        "",
        "Uniform random holes, simultaneous axes, open path, seed 0. *Start*, *descent*: seconds",
        "from the call of the solver until the greedy tour, and until no exchange helps, and how",
        "much longer than the final route they are. *Check*: validation and exact cost. *Whole*:",
        "from reading the CSV file to the written route. *Gap*: of the final route to Held and",
        "Karp's bound, proved in exact integers; of uniform random points that bound is itself",
        "about 0.7 % below the optimum (Johnson, McGeoch and Rothberg 1996). Compiling, once a",
        "machine, is not counted.",
        "",
        *lines,
        "",
        "![Seconds, memory and gap](scaling.svg)",
        "",
        f"Python {platform.python_version()}, {os.cpu_count()} cores, load average before a size "
        f"{min(loads)} to {max(loads)} (other work competes for the cores where it is above zero).",
        *(["", note] if note else []),
        "",
    ]
    return "\n".join(text)


def draw(rows: list[dict[str, Any]]) -> None:
    """Seconds to the end of the descent, peak memory and gap against holes."""
    import matplotlib

    matplotlib.use("svg")
    from matplotlib import pyplot

    pyplot.rcParams["svg.hashsalt"] = "tcp"
    figure, (left, middle, right) = pyplot.subplots(1, 3, figsize=(11, 3.2))
    holes = [r["holes"] for r in rows]
    left.loglog(holes, [max(r["read_s"], 0.01) for r in rows], "o-", label="reading")
    left.loglog(holes, [max(r["descent_s"], 0.01) for r in rows], "o-", label="to local optimum")
    left.set(xlabel="holes", ylabel="seconds")
    left.legend()
    middle.loglog(holes, [r["peak_mb"] for r in rows], "o-")
    middle.set(xlabel="holes", ylabel="peak memory, MB")
    known = [(r["holes"], gap(r)) for r in rows if r["bound"] is not None]
    right.semilogx([h for h, _ in known], [g for _, g in known], "o-")
    right.set(xlabel="holes", ylabel="gap to the bound, %", ylim=(0, None))
    figure.tight_layout()
    figure.savefig(PLOT, metadata={"Date": None})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--largest", type=int, default=max(SIZES))
    parser.add_argument("--fresh", action="store_true")
    parser.add_argument("--note", default="", help="A sentence about the machine, for the page.")
    parser.add_argument("--do", nargs=3, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.do:
        what, path, seconds = given.do
        print(json.dumps({"route": route, "bound": bound}[what](Path(path), float(seconds))))
        return
    if given.fresh:
        ROWS.unlink(missing_ok=True)
    kept = ROWS.read_text().splitlines() if ROWS.exists() else []
    rows = {row["holes"]: row for row in map(json.loads, kept)}
    for n in SIZES:
        if n > given.largest or n in rows:
            continue
        rows[n] = measure(n)
        with ROWS.open("a") as file:
            file.write(json.dumps(rows[n]) + "\n")
        print(rows[n], flush=True)
    ordered = [rows[n] for n in sorted(rows)]
    PAGE.write_text(page(ordered, given.note))
    draw(ordered)


if __name__ == "__main__":
    main()
