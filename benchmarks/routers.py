"""Routers side by side at equal wall time, into docs/routers.md.

    python benchmarks/routers.py [--minutes 60] [--seconds 5,30] [--seeds 5]
                                 [--instances a,b] [--models sequential,...] [--routers x,y]
    python benchmarks/routers.py --list       # what would run, and for how long
    python benchmarks/routers.py --table      # docs/routers.md from the runs so far
    python benchmarks/routers.py --fresh      # forget them first (a new version, another machine)

Open path; one run at a time, each in a process of its own, which tells its peak memory; making a
peer's matrix and compiling count for nobody.  One line of JSON a run is appended to
benchmarks/results/routers.jsonl.  A call starts no run after ``--minutes``; the same command goes
on where the last one stopped, seed by seed, so that the table is fair at any time.  The default
selection at 5 s and one seed takes about an hour, all of it about fifteen; a run that has not
ended at three times its limit and 60 s more is noted as late.

Instances: the largest tools of real boards (simultaneous axes), TSPLIB and VLSI files, generated
ones (uniform, clustered, lattice), all in three travel models; ``--instances small`` stands for
every tool of a board with up to 500 holes and a proved optimum.  The gap is to the best certified
lower bound in benchmarks/results (proofs.jsonl, boards.jsonl); where there is none, to the best
route known from any run here, which the table marks with a star.  The corpus is in ``TCP_CORPUS``
or ``../shared/corpus``; what is not there is left out and named.

The peers: ``pip install 'tcp-drill[benchmark]'`` and ``pip install --no-deps python-tsp`` (it asks
for networkx 2); those not installed are named in the table.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import statistics
import subprocess
import sys
import time
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from generated import MADE, generated
from peers import ROUTERS

from tcp import Instance, Model, Travel, Workpiece

ROOT = Path(__file__).resolve().parents[1]
CORPUS = Path(os.environ.get("TCP_CORPUS", ROOT.parent / "shared" / "corpus"))
RESULTS = ROOT / "benchmarks" / "results"
RUNS = RESULTS / "routers.jsonl"
PAGE = ROOT / "docs" / "routers.md"
HINTS = ROOT / "tests" / "files" / "board_hints.toml"

BOARDS = (  # the tool with the most holes of each board with more than 500
    "allegro-parallella-MetaModule.drl:1",
    "altium-LimeSDR-QPCIe-round.txt:1",
    "kicad-Thunderscope-5.3.drl:1",
    "kicad-c4puter-motherboard.drl:1",
    "siemens-80101-ThruHolePlated.ncd:1",
    "eagle-axiom-beta-main.xln:1",
    "altium-AFCv2-round-plated.txt:1",
    "kicad-Thunderscope-5.2-PTH.drl:1",
    "allegro-BeagleVAhead-L1-5.drl:1",
    "altium-LimeSDR-USB-1v4-round.txt:1",
    "allegro-MinnowMax.drl:1",
    "allegro-BeagleBoneAI-2019.drl:1",
    "kicad-ciaa_acc-PTH.drl:1",
    "altium-Thunderscope-4.1-round.txt:1",
    "kicad-mnt-reform2-motherboard-PTH.drl:3",
    "altium-LimeSDR-XTRX-1v1.txt:2",
    "kicad-DIN41612-backplane.drl:1",
    "orcad-arena_12-12.drl:1",
    "pads-Drill.drl:1",
)
FILES = (
    "pcb442",
    "pbd984",
    "pcb1173",
    "d1291",
    "dka1376",
    "u1432",
    "u2319",
    "pcb3038",
    "fl3795",
    "rl5915",
)
SMALL = 500
"""Most holes of a tool for which ours must find the optimum within 5 s."""

METRICS = {"sequential": "manhattan", "simultaneous": "chebyshev", "euclidean": "euclidean"}
"""Our names of the travel models, and those in proofs.jsonl."""


@dataclass(frozen=True)
class Job:
    """One run."""

    router: str
    instance: str
    model: str
    seconds: float
    seed: int

    @property
    def key(self) -> str:
        return json.dumps(asdict(self), sort_keys=True)


# --- instances ----------------------------------------------------------------------------


def workpiece(name: str) -> Workpiece | None:
    """A board's tool (``file:tool``), a corpus file, or a generated one; None if not here."""
    board, colon, tool = name.partition(":")
    if colon:
        from tcp.files.excellon import hints, read_program
        from tcp.files.excellon.piece import workpiece as piece

        path = CORPUS / "boards" / board
        known = tomllib.loads(HINTS.read_text()).get(board, {})
        return piece(read_program(path, hints(**known)), int(tool)) if path.exists() else None
    for folder in ("tsplib", "vlsi"):
        path = CORPUS / folder / f"{name}.tsp"
        if path.exists():
            from tcp.files.tsplib import read

            return read(path, units="mm").workpiece
    return None if name in FILES else generated(name)


def make(name: str, model: str) -> Instance | None:
    piece = workpiece(name)
    quantum = 1 if model == "euclidean" and ":" not in name else None
    return None if piece is None else Instance(piece, Travel(Model(model), quantum=quantum))


def bounds() -> dict[tuple[str, str], int]:
    """The best lower bound of each instance and model that is certified, in quanta."""
    known: dict[tuple[str, str], int] = defaultdict(int)
    models = {metric: model for model, metric in METRICS.items()}
    for row in records(RESULTS / "proofs.jsonl"):
        if row["section"] in ("open", "made") and row["bound"] is not None:
            key = row["name"], models[row["metric"]]
            known[key] = max(known[key], row["bound"])
        if row["section"] == "boards" and "error" not in row:
            key = f"{row['name']}:{row['metric'][1:]}", "simultaneous"
            known[key] = max(known[key], row["bound"])
    for row in records(RESULTS / "boards.jsonl"):
        key = f"{row['board']}:{row['tool']}", "simultaneous"
        known[key] = max(known[key], row["bound"])
    return known


def small_tools() -> list[str]:
    """All tools of boards with up to :data:`SMALL` holes whose optimum is proved."""
    rows = records(RESULTS / "proofs.jsonl")
    small = [row for row in rows if row["section"] == "boards" and row["holes"] <= SMALL]
    return sorted({f"{r['name']}:{r['metric'][1:]}" for r in small if r.get("optimal")})


def records(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


# --- runs ---------------------------------------------------------------------------------


def jobs(given: argparse.Namespace) -> Iterator[Job]:
    """All runs that are asked for: seed by seed, short ones first."""
    for seed in range(given.seeds):
        for seconds in given.seconds:
            for name in given.instances:
                for model in ("simultaneous",) if ":" in name else given.models:
                    for router in given.routers:
                        if seed == 0 or ROUTERS[router].seeded:
                            yield Job(router, name, model, seconds, seed)


def run(given: argparse.Namespace) -> None:
    """Make the runs that are missing, until the time is up."""
    done = {row["key"] for row in records(RUNS)}
    until = time.monotonic() + 60 * given.minutes
    RUNS.parent.mkdir(parents=True, exist_ok=True)
    for job in jobs(given):
        if time.monotonic() > until:
            print("time is up; the same command goes on from here")
            return
        if job.key in done:
            continue
        row = measured(job)
        with RUNS.open("a") as file:
            file.write(json.dumps(row) + "\n")
        print({k: v for k, v in row.items() if k not in ("key", "load")}, flush=True)


def measured(job: Job) -> dict[str, Any]:
    """The row of one run, made in a process of its own."""
    row: dict[str, Any] = {"key": job.key, **asdict(job), "load": round(os.getloadavg()[0], 1)}
    words = [sys.executable, __file__, "--one", job.key]
    try:
        done = subprocess.run(
            words, capture_output=True, text=True, timeout=3 * job.seconds + 60, check=False
        )
    except subprocess.TimeoutExpired:
        return row | {"outcome": "late"}
    if done.returncode:
        return row | {"outcome": (done.stderr.strip().splitlines() or ["failed"])[-1][:200]}
    return row | json.loads(done.stdout.splitlines()[-1])


def one(job: Job) -> dict[str, Any]:
    """Run a router, in this process."""
    router = ROUTERS[job.router]
    try:
        release = version(router.package)
    except PackageNotFoundError:
        return {"outcome": "not installed"}
    instance = make(job.instance, job.model)
    if instance is None:
        return {"outcome": "not in the corpus here"}
    size = {"holes": len(instance), "version": release}
    if instance.form.size > router.most:
        return size | {"outcome": "too large"}
    food = router.prepare(instance)
    began = time.perf_counter()
    tour = router.call(food, job.seconds, job.seed)
    took = time.perf_counter() - began
    if sorted(tour) != list(range(instance.form.size)):
        return size | {"outcome": "no tour"}
    return size | {
        "outcome": "ok",
        "cost": instance.form.tour_cost(tour),
        "took": round(took, 2),
        "peak_mb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
    }


# --- the page -----------------------------------------------------------------------------


def page(rows: list[dict[str, Any]], note: str) -> str:
    """docs/routers.md: a table for each time limit."""
    if not rows:
        return "# Routers side by side\n\nNo runs yet.\n"
    known = bounds()
    for row in rows:  # where nothing is certified, the best route of any run
        if row["outcome"] == "ok" and known.get((row["instance"], row["model"]), 0) <= 0:
            key = row["instance"], row["model"]
            known[key] = max(known.get(key, -row["cost"]), -row["cost"])
    lines = [
        "# Routers side by side",
        "",
        "Generated by `python benchmarks/routers.py`; do not edit. Open path; gap of the median",
        "(worst) seed to the best certified lower bound, or, with a star, to the best route of",
        "any run. Equal wall time for all; seconds in brackets where a router overran it by 10 %.",
        "*Seeds*: 5/1 is five of one router and one of another.",
        "",
    ]
    tools = {row["instance"] for row in rows if ":" in row["instance"]}.difference(BOARDS)
    small = [row for row in rows if row["instance"] in tools]
    large = [row for row in rows if row["instance"] not in tools]
    for seconds in sorted({row["seconds"] for row in large}):
        mine = [row for row in large if row["seconds"] == seconds]
        lines += [f"## {seconds:g} s", "", *table(mine, known), ""]
    lines += small_table(small, known)
    versions = {r["router"]: r["version"] for r in rows if "version" in r}
    loads = [row["load"] for row in rows]
    lines += [
        f"Python {platform.python_version()}, {os.cpu_count()} cores, load average before a run "
        f"{statistics.median(loads):.1f} in the median and {max(loads):.1f} at most; ours uses two "
        "threads, the peers one. "
        + ", ".join(
            f"{name} ({'ours, ' if ROUTERS[name].package == 'numpy' else ''}"
            f"{ROUTERS[name].package} {release})"
            for name, release in versions.items()
        )
        + ". elkai wraps LKH, whose licence is for academic and non-commercial use: here it is "
        "measured, never shipped.",
        *(["", note] if note else []),
        "",
    ]
    return "\n".join(lines)


def table(rows: list[dict[str, Any]], known: dict[tuple[str, str], int]) -> list[str]:
    """One line an instance and model, one column a router."""
    routers = [name for name in ROUTERS if any(row["router"] == name for row in rows)]
    groups: dict[tuple[str, str], dict[str, list[dict[str, Any]]]] = defaultdict(
        lambda: defaultdict(list)
    )
    for row in rows:
        groups[row["instance"], row["model"]][row["router"]].append(row)
    lines = [
        "| instance | holes | travel | seeds | " + " | ".join(routers) + " |",
        "|---|--:|---|--:|" + "--:|" * len(routers),
    ]
    for (name, model), by_router in groups.items():
        holes = max((r.get("holes", 0) for rs in by_router.values() for r in rs), default=0)
        base = known.get((name, model), 0)
        star = "" if base > 0 else "*"
        counts = {len(rs) for rs in by_router.values()}
        seeds = "/".join(str(count) for count in sorted({max(counts), min(counts)}, reverse=True))
        cells = [cell(by_router.get(router, []), abs(base)) for router in routers]
        lines.append(f"| {name}{star} | {holes} | {model} | {seeds} | " + " | ".join(cells) + " |")
    return lines


def small_table(rows: list[dict[str, Any]], known: dict[tuple[str, str], int]) -> list[str]:
    """How many of the boards' smaller tools each router solved to the proved optimum."""
    groups: dict[tuple[str, float], list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        groups[row["router"], row["seconds"]].append(row)
    lines = [
        f"## Every tool of a board with up to {SMALL} holes",
        "",
        "| router | seconds | runs | optimal | else |",
        "|---|--:|--:|--:|---|",
    ]
    for (router, seconds), mine in groups.items():
        wrong = [r for r in mine if r.get("cost") != known[r["instance"], r["model"]]]
        names = ", ".join(f"{r['instance']} ({r.get('cost', r['outcome'])})" for r in wrong)
        count = f"{len(mine)} | {len(mine) - len(wrong)}"
        lines.append(f"| {router} | {seconds:g} | {count} | {names or '–'} |")
    return [*lines, ""] if rows else []


def cell(rows: list[dict[str, Any]], base: int) -> str:
    """Median (worst) gap in percent."""
    good = [row for row in rows if row["outcome"] == "ok"]
    if not good:
        return rows[0]["outcome"] if rows else "–"
    costs = [row["cost"] for row in good]
    median, worst = statistics.median_low(costs), max(costs)
    gaps = [100 * (cost / base - 1) if base else 0.0 for cost in (median, worst)]
    text = f"{gaps[0]:.2f} % ({gaps[1]:.2f})"
    took = max(row["took"] for row in good)
    return text + (f" [{took:.0f} s]" if took > 1.1 * good[0]["seconds"] + 0.1 else "")


def words(text: str) -> list[str]:
    return [part for part in text.split(",") if part]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=60.0, help="Start no run after that.")
    parser.add_argument("--seconds", type=lambda t: [float(s) for s in words(t)], default=[5, 30])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--instances", type=words, default=[*BOARDS, *FILES, *MADE])
    parser.add_argument("--models", type=words, default=list(METRICS))
    parser.add_argument("--routers", type=words, default=list(ROUTERS))
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--fresh", action="store_true")
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--note", default="", help="A sentence about the machine, for the page.")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        print(json.dumps(one(Job(**json.loads(given.one)))))
        return
    if given.instances == ["small"]:
        given.instances = small_tools()
    if given.list:
        every = list(jobs(given))
        longest = sum(job.seconds + 3 for job in every) / 3600
        print(f"{len(every)} runs, {longest:.1f} hours at most; {given.minutes:g} minutes a call")
        return
    if given.fresh:
        RUNS.unlink(missing_ok=True)
    if not given.table:
        run(given)
    PAGE.write_text(page(records(RUNS), given.note))


if __name__ == "__main__":
    main()
