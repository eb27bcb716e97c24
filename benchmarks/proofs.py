"""Proved optima, each with a checked certificate: the papers, published instances, real boards.

    python benchmarks/proofs.py [--section NAME ...] [--only TEXT] [--limit S] [--finish]
                                [--jobs 1|2]
    python benchmarks/proofs.py --list       # what would run, and for how long at most
    python benchmarks/proofs.py --table      # only write docs/proofs.md from the results so far

Sections: ``papers`` (WP1 to WP3 in both cases, against CP-SAT's best setting on WP3), ``closed``
(tours, Euclidean distances rounded as TSPLIB does, optima published), ``open`` (paths in three
travel models), ``made`` (the same for generated instances, whose bounds ``routers.py`` needs),
``boards`` (every tool of every board, simultaneous axes).  Limits are those that
the project set itself: 60 s up to 500 holes, 3 min up to 700, 15 min up to 1,000, 60 min up to
1,400, 10 min beyond; boards 3 min up to 1,000 holes, 15 min beyond; ``--limit`` caps them all.
Where a small gap is the target (0.05 % from 1,000 nodes on, 0.3 % from 1,400 on, 0.1 % for tools of
more than 2,000 holes), a proof ends when it is reached; with ``--finish`` it goes on.

Every proof runs in a process of its own, which tells its peak memory; its certificate is written to
a file and verified by the independent checker before it counts.  One line of JSON a proof is
appended to benchmarks/results/proofs.jsonl.  A run that was interrupted goes on where it stopped; a
proof that is open is tried again only with a longer limit.  With ``--jobs 2`` two proofs run side
by side.  The corpus is in TCP_CORPUS, or in ../shared/corpus beside the project.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import proofs_page
from generated import MADE, generated

ROOT = Path(__file__).resolve().parents[1]
CORPUS = Path(os.environ.get("TCP_CORPUS", ROOT.parent / "shared" / "corpus"))
RESULTS = ROOT / "benchmarks" / "results" / "proofs.jsonl"
PAGE = ROOT / "docs" / "proofs.md"
SECTIONS = ("papers", "closed", "open", "made", "boards")
REPEATS = 7
PAPERS = {"wp1": 9, "wp2": 14, "wp3": 49}
VLSI = {
    "xqf131": 564,
    "pma343": 1368,
    "pbk411": 1343,
    "xql662": 2513,
    "rbu737": 3314,
    "dkg813": 3199,
    "pbd984": 2797,
    "dka1376": 4666,
}
"""Published closed-tour optima of the VLSI instances."""

Record = dict[str, Any]


@dataclass(frozen=True)
class Job:
    """One proof: ``name`` of an instance or board, ``metric`` or tool, seconds at most.

    ``enough`` is the gap, as a share of the cost, at which it may end.
    """

    section: str
    name: str
    metric: str
    holes: int
    limit: float
    enough: float = 0.0

    @property
    def key(self) -> tuple[str, str, str]:
        return self.section, self.name, self.metric


# --- what there is to prove -------------------------------------------------------------


def published() -> dict[str, dict[str, str]]:
    """What others have published about the closed tours, by instance."""
    with (CORPUS / "tsplib" / "PUBLISHED.tsv").open() as stream:
        known = {row["name"]: row for row in csv.DictReader(stream, delimiter="\t")}
    for name, optimum in VLSI.items():
        known[name] = {"name": name, "n": name[3:], "optimum": str(optimum)}
    return known


def rounded_otherwise(name: str) -> int:
    """Pairs of holes whose distance doubles round otherwise than exact decimals."""
    import numpy as np

    path = next(CORPUS.glob(f"*/{name}.tsp"))
    lines = (line.split() for line in path.read_text().splitlines())
    points = np.array([w[1:] for w in lines if len(w) == 3 and w[0].isdigit()], dtype=float)
    delta = points[:, None] - points
    doubles = np.floor(np.sqrt((delta**2).sum(axis=2)) + 0.5).astype(np.int64)
    exact = instance_of(Job("closed", name, "closed", len(points), 0.0)).form.full_matrix()
    return int((np.triu(exact) != np.triu(doubles)).sum())


def allowed(holes: int, board: bool = False) -> float:
    """The limit in seconds that the project set itself."""
    if board:
        return 180.0 if holes <= 1_000 else 900.0
    steps = ((500, 60.0), (700, 180.0), (1_000, 900.0), (1_400, 3600.0))
    return next((limit for most, limit in steps if holes <= most), 600.0)


def enough(holes: int, board: bool = False) -> float:
    """The gap that the project set itself, as a share of the cost."""
    if board:
        return 0.0 if holes <= 2_000 else 0.000_99
    steps = ((1_000, 0.0), (1_400, 0.000_49), (100_000, 0.002_99))
    return next(gap for most, gap in steps if holes <= most)


def jobs() -> Iterator[Job]:
    """Everything, in the order of the sections."""
    for name in ("wp1", "wp2", "wp3"):
        for metric in ("manhattan", "chebyshev"):
            yield Job("papers", name, metric, PAPERS[name], 60.0)
    known = {name: int(row["n"]) for name, row in published().items()}
    axes = ("manhattan", "chebyshev", "euclidean")
    for section, sizes, metrics in (
        ("closed", known, ("closed",)),
        ("open", known, axes),
        ("made", MADE, axes),
    ):
        for name in sorted(sizes, key=lambda n: (sizes[n], n)):
            for metric in metrics:
                n = sizes[name]
                yield Job(section, name, metric, n, allowed(n), enough(n))
    yield from sorted(tools(), key=lambda job: (job.holes, job.name, job.metric))


def tools() -> Iterator[Job]:
    """Every tool with two holes or more of every board that can be read."""
    import numpy as np

    from tcp.errors import InputError
    from tcp.files.excellon import expanded

    for path in sorted((CORPUS / "boards").iterdir()):
        try:
            program = board(path)
        except InputError:
            continue
        numbers, counts = np.unique(expanded(program)[0], return_counts=True)
        for tool, count in zip(numbers.tolist(), counts.tolist(), strict=True):
            if count >= 2:
                limit, gap = allowed(count, board=True), enough(count, board=True)
                yield Job("boards", path.name, f"T{tool}", count, limit, gap)


def board(path: Path) -> Any:
    """A board's program, read with the hints that the tests give."""
    import tomllib

    from tcp.files.excellon import hints, read_program

    known = tomllib.loads((ROOT / "tests" / "files" / "board_hints.toml").read_text())
    return read_program(path, hints(**known.get(path.name, {})))


def instance_of(job: Job) -> Any:
    """The instance that a job is about."""
    from tcp import Ends, Instance, Model, Travel
    from tcp.files import read
    from tcp.files.excellon import workpiece

    rounded = Travel(Model.EUCLIDEAN, quantum=Fraction(1))
    metrics = {
        "closed": (rounded, Ends(closed=True)),
        "manhattan": (Travel(Model.SEQUENTIAL), Ends()),
        "chebyshev": (Travel(Model.SIMULTANEOUS), Ends()),
        "euclidean": (rounded, Ends()),
    }
    if job.section == "boards":
        piece = workpiece(board(CORPUS / "boards" / job.name), int(job.metric[1:]))
        return Instance(piece, Travel(Model.SIMULTANEOUS))
    if job.section == "made":
        return Instance(generated(job.name), *metrics[job.metric])
    if job.section == "papers":
        path = ROOT / "data" / f"{job.name}.csv"
    else:
        path = next(CORPUS.glob(f"*/{job.name}.tsp"))
    return Instance(read(path).workpiece, *metrics[job.metric])


# --- one proof, in the process that runs it ---------------------------------------------


def prove(job: Job) -> Record:
    """Solved, written, checked; and once more for the papers, whose times are medians."""
    from tcp import Stop, solve
    from tcp.result import Proof
    from tcp.solve import versions
    from tcp.validate import certificate as checker

    instance = instance_of(job)
    with tempfile.TemporaryDirectory() as folder:

        def run(name: str) -> tuple[Any, float, float]:
            proof = Path(folder) / f"{name}.cert.json.gz"
            wall, cpu = time.perf_counter(), time.process_time()
            stop = Stop(time=job.limit, gap=job.enough or None)
            result = solve(instance, "branch-and-cut", stop=stop, exact=True, certificate=proof)
            return result, time.perf_counter() - wall, time.process_time() - cpu

        result, wall, cpu = run("first")
        first, extra = wall, Record()
        proof = result.certificate
        size, check = proof.stat().st_size, time.process_time()
        verdict = checker.check(checker.unzip(proof), None, instance.sha256)
        check = time.process_time() - check
        if job.section == "papers":
            _, walls, cpus = zip(*(run(f"again-{k}") for k in range(REPEATS)), strict=True)
            wall, cpu = statistics.median(walls), statistics.median(cpus)
            extra = {"first_seconds": round(first, 3), "repeats": REPEATS}
            if job.name == "wp3":
                extra["cp_sat"] = cp_sat(instance)
    assert verdict.lower is not None and verdict.lower <= result.bound
    assert verdict.upper == result.cost
    return {
        **asdict(job),
        "cost": result.cost,
        "bound": verdict.lower,
        "quantum": str(instance.quantum),
        "granularity": instance.granularity,
        "optimal": result.cost == result.bound and result.proof is Proof.CERTIFIED,
        "nodes": result.details["nodes"],
        "seconds": round(wall, 3),
        "cpu_seconds": round(cpu, 3),
        "check_seconds": round(check, 3),
        "certificate_bytes": size,
        "memory_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
        "versions": dict(versions(("highspy", "ortools"))),
        **extra,
    }


def cp_sat(instance: Any) -> dict[str, float]:
    """Median seconds to CP-SAT's proof by setting, the slow ones once; inf where 20 s are short."""
    from tcp import Stop, solve

    found = {}
    for workers in (1, 2):
        for level in (1, 2):
            seconds: list[float] = []
            while len(seconds) < REPEATS and (not seconds or seconds[0] < 3):
                started = time.perf_counter()
                options = {"workers": workers, "linearization": level}
                result = solve(instance, "cp-sat", stop=Stop(time=20), exact=True, **options)
                taken = time.perf_counter() - started
                seconds.append(taken if result.bound == result.cost else float("inf"))
            median = statistics.median(seconds)
            if median < float("inf"):
                found[f"{workers} workers, linearization {level}"] = round(median, 4)
    return found


# --- all proofs, each in a process of its own -------------------------------------------


def spawn(job: Job) -> Record:
    """Run a job in its own process; a failure is a record too, and no proof."""
    command = [sys.executable, __file__, "--job", json.dumps(asdict(job))]
    patience = 2 * job.limit + 300
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=patience)
        if done.returncode == 0:
            return dict(json.loads(done.stdout.splitlines()[-1]))
        error = (done.stderr.strip().splitlines() or ["no message"])[-1]
        error = f"exit {done.returncode}: {error}"
    except subprocess.TimeoutExpired:
        error = f"killed after {patience:g} s"
    return {**asdict(job), "optimal": False, "error": error}


def settled(record: Record | None, job: Job) -> bool:
    """Whether a job need not run again: proved, or tried for as long."""
    if record is None or "error" in record or "memory_mib" not in record:
        return False
    near = proofs_page.gap(record) <= 100 * job.enough
    as_long = record["limit"] >= job.limit and record.get("enough", 0.0) <= job.enough
    return bool(record["optimal"]) or near or as_long


def load() -> dict[tuple[str, str, str], Record]:
    """The last record of every job."""
    lines = RESULTS.read_text().splitlines() if RESULTS.exists() else []
    records = [json.loads(line) for line in lines]
    return {(r["section"], r["name"], r["metric"]): r for r in records}


def run(chosen: list[Job], side_by_side: int) -> None:
    """Run what is not settled; every result is on disk before the next job begins."""
    known = load()
    todo = [job for job in chosen if not settled(known.get(job.key), job)]
    print(f"{len(chosen)} proofs, {len(todo)} to run", flush=True)
    for metric in ("manhattan", "chebyshev", "euclidean") if todo else ():
        spawn(Job("open", "lin318", metric, 318, 5.0))  # compiled code is then on disk
    RESULTS.parent.mkdir(exist_ok=True)

    def one(job: Job) -> None:
        record = spawn(job)
        with RESULTS.open("a") as stream:
            stream.write(json.dumps(record) + "\n")
        print(*job.key, proofs_page.outcome(record), flush=True)

    with ThreadPoolExecutor(side_by_side) as pool:
        try:
            list(pool.map(one, todo))
        except KeyboardInterrupt:
            pool.shutdown(cancel_futures=True)
            raise


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--section", action="append", choices=SECTIONS, help="default: all")
    parser.add_argument("--only", default="", help="only names or metrics with this text")
    parser.add_argument("--most", type=int, default=10_000, help="most holes")
    parser.add_argument("--limit", type=float, default=float("inf"), help="cap on every limit")
    parser.add_argument("--finish", action="store_true", help="no gap but 0 is small enough")
    parser.add_argument("--jobs", type=int, default=1, choices=(1, 2), help="proofs at a time")
    parser.add_argument("--list", action="store_true", help="run nothing, show what would run")
    parser.add_argument("--table", action="store_true", help="run nothing, write the page")
    parser.add_argument("--note", default="", help="a sentence about the machine, for the page")
    parser.add_argument("--job", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.job:
        print(json.dumps(prove(Job(**json.loads(given.job)))))
        return
    if not CORPUS.is_dir():
        parser.error(f"there is no corpus at {CORPUS}; set TCP_CORPUS")
    if not given.table:
        chosen = [
            replace(
                job,
                limit=min(job.limit, given.limit),
                enough=0.0 if given.finish else job.enough,
            )
            for job in jobs()
            if job.section in (given.section or SECTIONS)
            and job.holes <= given.most
            and given.only in f"{job.name} {job.metric}"
        ]
        if given.list:
            for job in chosen:
                print(*job.key, f"{job.holes} holes, at most {job.limit:g} s")
            print(f"{len(chosen)} proofs, at most {sum(j.limit for j in chosen) / 3600:.1f} h")
            return
        run(chosen, given.jobs)
    records, known = list(load().values()), published()
    for record in records:
        if record["section"] == "closed" and record["optimal"]:
            other = known[record["name"]]
            if str(record["cost"]) != other["optimum"]:
                other["rounded otherwise"] = str(rounded_otherwise(record["name"]))
    done = load().keys()
    missing = [f"{job.name} {job.metric}" for job in jobs() if job.key not in done]
    PAGE.write_text(proofs_page.page(records, known, given.note, missing))


if __name__ == "__main__":
    main()
