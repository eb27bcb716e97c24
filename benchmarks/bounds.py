"""Lower bounds of growing workpieces: 1-tree ascent, and the LP without branching.

    python benchmarks/bounds.py [--only TEXT] [--limit 600] [--most 10000]
    python benchmarks/bounds.py --table      # only write docs/bounds.md from the results so far

Random uniform workpieces (Euclidean, quantum 1/1000 of the mean spacing) of 1,000 to 100,000 holes,
and the corpus's TSPLIB files from 1,000 holes on as open paths in three travel models; on these the
LP bound of ``tcp bound --method lp`` as well, within ``--limit`` seconds.  For random points the
Held-Karp bound of a closed tour is about 0.7080 sqrt(n A) (Johnson, McGeoch and Rothberg, SODA
1996).  Each bound is found in a process of its own; one line of JSON each is appended to
benchmarks/results/bounds.jsonl, and what is there is not run again.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from tcp import Instance, Model, Stop, Travel, Workpiece
from tcp.bounds.one_tree import one_tree_bound
from tcp.files import read

ROOT = Path(__file__).resolve().parents[1]
CORPUS = Path(os.environ.get("TCP_CORPUS", ROOT.parent / "shared" / "corpus"))
RESULTS = ROOT / "benchmarks" / "results" / "bounds.jsonl"
PROOFS = ROOT / "benchmarks" / "results" / "proofs.jsonl"
PAGE = ROOT / "docs" / "bounds.md"
TRAVELS = {
    "manhattan": Travel(Model.SEQUENTIAL),
    "chebyshev": Travel(Model.SIMULTANEOUS),
    "euclidean": Travel(Model.EUCLIDEAN, quantum=Fraction(1)),
}
HEAD = """\
# Lower bounds beyond exact

Printed by `python benchmarks/bounds.py`; raw results in `benchmarks/results/bounds.jsonl`. Open
paths, free ends. `tcp bound` (1-tree ascent) and `tcp bound --method lp` (the proof engine's linear
programme, unbranched); both are exact integer bounds. CPU seconds of one thread, instance built and
code compiled, each in a process of its own; MiB is its peak, libraries included. *Best route*: from
`benchmarks/results/proofs.jsonl`; the gaps are the bounds' distance from it.

| instance | travel | holes | 1-tree | seconds | MiB | LP | seconds | MiB | best route | gaps |
|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|"""


def scattered(n: int) -> Instance:
    """``n`` random holes on a square whose side is 1000 sqrt(n) steps."""
    side = int(1000 * n**0.5)
    x, y = np.random.default_rng(n).integers(0, side, (2, n))
    piece = Workpiece(f"random {n}", tuple(map(str, range(n))), x, y)
    return Instance(piece, Travel(Model.EUCLIDEAN, quantum=Fraction(1)))


def instance_of(name: str, travel: str) -> Instance:
    """A random workpiece, or one of the corpus."""
    if name.startswith("random"):
        return scattered(int(name.split()[1]))
    return Instance(read(CORPUS / "tsplib" / f"{name}.tsp").workpiece, TRAVELS[travel])


def jobs() -> Iterator[tuple[str, str, str, int]]:
    """Name, travel, method, holes."""
    for n in (1_000, 10_000, 100_000):
        yield f"random {n}", "euclidean", "one-tree", n
    found = [(len(read(path).workpiece), path.stem) for path in CORPUS.glob("tsplib/*.tsp")]
    for holes, name in sorted(found):
        for travel in TRAVELS if holes >= 1_000 else ():
            for method in ("one-tree", "lp"):
                yield name, travel, method, holes


def bound(name: str, travel: str, method: str, limit: float) -> dict[str, Any]:
    """One bound, in this process."""
    from tcp.solve import solve

    instance = instance_of(name, travel)
    if method == "one-tree":
        one_tree_bound(scattered(100))  # compile
    wall, cpu = time.perf_counter(), time.process_time()
    if method == "one-tree":
        value = one_tree_bound(instance).value
    else:
        found = solve(instance, "branch-and-cut", stop=Stop(time=limit, iterations=1))
        value = found.bound or 0
    return {
        "name": name,
        "travel": travel,
        "method": method,
        "holes": len(instance),
        "bound": value,
        "quantum": str(instance.quantum),
        "seconds": round(time.perf_counter() - wall, 1),
        "cpu_seconds": round(time.process_time() - cpu, 1),
        "memory_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
        "limit": limit,
    }


def load(path: Path) -> list[dict[str, Any]]:
    """The lines of a results file."""
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def page(records: list[dict[str, Any]]) -> str:
    """docs/bounds.md."""
    best: dict[tuple[str, str], int] = {}
    for r in load(PROOFS):
        if r["section"] == "open" and "cost" in r:
            key = (r["name"], r["metric"])
            best[key] = min(r["cost"], best.get(key, r["cost"]))
    at = {(r["name"], r["travel"], r["method"]): r for r in records}
    lines = [HEAD]
    for holes, name, travel in sorted({(r["holes"], r["name"], r["travel"]) for r in records}):
        cells, gaps, cost = [name, travel, f"{holes:,}"], [], best.get((name, travel))
        for method in ("one-tree", "lp"):
            r = at.get((name, travel, method))
            cells += (
                ["–"] * 3
                if r is None
                else [str(r["bound"]), f"{r['cpu_seconds']:g}", str(r["memory_mib"])]
            )
            if r is not None and cost:
                gaps.append(f"{100 * (cost - r['bound']) / cost:.2f} %")
        lines.append("| " + " | ".join([*cells, str(cost or "–"), ", ".join(gaps) or "–"]) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="only names, travels or methods with this text")
    parser.add_argument("--limit", type=float, default=600.0, help="seconds of an LP")
    parser.add_argument("--most", type=int, default=100_000, help="most holes")
    parser.add_argument("--table", action="store_true", help="run nothing")
    parser.add_argument("--job", nargs=3, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.job:
        print(json.dumps(bound(*given.job, given.limit)))
        return
    done = {(r["name"], r["travel"], r["method"]) for r in load(RESULTS)}
    for name, travel, method, holes in [] if given.table else jobs():
        key, text = (name, travel, method), f"{name} {travel} {method}"
        if key in done or holes > given.most or given.only not in text:
            continue
        command = [sys.executable, __file__, "--limit", str(given.limit), "--job", *key]
        line = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        print(line.strip(), flush=True)
        with RESULTS.open("a") as stream:
            stream.write(line)
    PAGE.write_text(page(load(RESULTS)))


if __name__ == "__main__":
    main()
