"""Proved optima of published instances, each with a checked certificate: docs/proofs.md.

    python benchmarks/proofs.py [NAME ...] [--limit 60] [--most 700] [--metric closed ...]
    python benchmarks/proofs.py --table      # only write docs/proofs.md from the results so far

Every proof is written to a file, verified by the independent checker, and only
then counted.  Results are kept in benchmarks/results/proofs.json, one record
an instance and metric; a new run replaces the records of what it runs.  The
instances are found in TCP_CORPUS, or in ../shared/corpus beside the project.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import tempfile
import time
from fractions import Fraction
from pathlib import Path
from typing import Any

from tcp import Ends, Instance, Model, Stop, Travel, solve
from tcp.files import read
from tcp.result import Proof
from tcp.validate import certificate as checker

ROOT = Path(__file__).resolve().parents[1]
CORPUS = Path(os.environ.get("TCP_CORPUS", ROOT.parent / "shared" / "corpus"))
RESULTS = ROOT / "benchmarks" / "results" / "proofs.json"
PAGE = ROOT / "docs" / "proofs.md"
ROUNDED = Travel(Model.EUCLIDEAN, quantum=Fraction(1))
METRICS = {
    "closed": (ROUNDED, Ends(closed=True)),
    "manhattan": (Travel(Model.SEQUENTIAL), Ends()),
    "chebyshev": (Travel(Model.SIMULTANEOUS), Ends()),
    "euclidean": (ROUNDED, Ends()),
}
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


def published() -> dict[str, dict[str, str]]:
    """What others have published about the closed tours, by instance."""
    with (CORPUS / "tsplib" / "PUBLISHED.tsv").open() as stream:
        known = {row["name"]: row for row in csv.DictReader(stream, delimiter="\t")}
    for name, optimum in VLSI.items():
        known[name] = {"name": name, "n": name[3:], "optimum": str(optimum)}
    return known


def prove(path: Path, metric: str, limit: float) -> dict[str, Any]:
    """One proof: solved, written, checked."""
    travel, ends = METRICS[metric]
    instance = Instance(read(path).workpiece, travel, ends)
    with tempfile.TemporaryDirectory() as folder:
        proof = Path(folder) / "proof.cert.json.gz"
        wall, cpu = time.perf_counter(), time.process_time()
        result = solve(
            instance, "branch-and-cut", stop=Stop(time=limit), exact=True, certificate=proof
        )
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        size = proof.stat().st_size
        check = time.process_time()
        verdict = checker.check(checker.unzip(proof), None, instance.sha256)
        check = time.process_time() - check
    assert verdict.lower == result.bound
    assert verdict.upper == result.cost
    return {
        "instance": path.stem,
        "holes": len(instance),
        "metric": metric,
        "cost": result.cost,
        "bound": result.bound,
        "quantum": str(instance.quantum),
        "granularity": instance.granularity,
        "optimal": result.cost == result.bound,
        "certified": result.proof is Proof.CERTIFIED,
        "nodes": result.details["nodes"],
        "seconds": round(wall, 2),
        "cpu_seconds": round(cpu, 2),
        "check_seconds": round(check, 2),
        "certificate_bytes": size,
        "limit": limit,
        "versions": dict(result.versions),
    }


def outcome(record: dict[str, Any] | None) -> str:
    """A cell of the open-path table."""
    if record is None:
        return "–"
    if record["optimal"]:
        return f"{record['cost']} ({record['cpu_seconds']:g} s, {record['nodes']})"
    gap = 100 * (record["cost"] - record["bound"]) / record["cost"]
    return f"{record['bound']} … {record['cost']} ({gap:.2g} % at {record['limit']:g} s)"


def page(records: dict[str, dict[str, Any]]) -> str:
    """The whole of docs/proofs.md."""
    known = published()
    lines = [
        "# Proved optima",
        "",
        "Written by `benchmarks/proofs.py`. Each line is a certificate that the independent",
        "checker (`tcp check`) verified in the same run. Seconds are CPU seconds of one thread on",
        "a two-core machine, from the holes to the checked certificate, start route included;",
        "limits are wall-clock seconds. One run each.",
        "",
        "## Closed tours, Euclidean distances rounded as TSPLIB does",
        "",
        "Concorde's seconds and nodes are those published in 1999, on a machine of that time.",
        "",
        "| instance | published optimum | proved here | seconds | nodes | check | certificate "
        "| Concorde's seconds | nodes |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    names = sorted({r["instance"] for r in records.values()}, key=lambda n: (_size(records, n), n))
    for name in names:
        r, other = records.get(f"{name} closed"), known.get(name, {})
        if r is None:
            continue
        proved = str(r["cost"]) if r["optimal"] else outcome(r)
        lines.append(
            f"| {name} | {other.get('optimum', '')} | {proved} | {r['cpu_seconds']:g} "
            f"| {r['nodes']} | {r['check_seconds']:g} s | {r['certificate_bytes'] / 1000:.3g} kB "
            f"| {other.get('concorde99_s') or '–'} | {other.get('concorde99_bbnodes') or '–'} |"
        )
    lines += [
        "",
        "## Open paths, free ends",
        "",
        "The shortest drilling order itself, for both axes one after the other (Manhattan), both",
        "at once (Chebyshev) and the Euclidean distance rounded to whole units. Published nowhere",
        "else to our knowledge. In brackets: CPU seconds and nodes of the tree. Costs are in",
        "quanta of the travel model (the file's unit, or its last decimal place).",
        "",
        "| instance | Manhattan | Chebyshev | Euclidean |",
        "|---|---:|---:|---:|",
    ]
    for name in names:
        cells = [records.get(f"{name} {m}") for m in ("manhattan", "chebyshev", "euclidean")]
        if any(cells):
            lines.append(f"| {name} | " + " | ".join(outcome(c) for c in cells) + " |")
    return "\n".join([*lines, ""])


def _size(records: dict[str, dict[str, Any]], name: str) -> int:
    return max(int(r["holes"]) for r in records.values() if r["instance"] == name)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="instances; default: all up to --most nodes")
    parser.add_argument("--limit", type=float, default=60.0, help="wall seconds an instance")
    parser.add_argument("--most", type=int, default=700)
    parser.add_argument("--metric", action="append", choices=METRICS, help="default: all four")
    parser.add_argument("--table", action="store_true", help="run nothing")
    arguments = parser.parse_args()
    records = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    sizes = {name: int(row["n"]) for name, row in published().items()}
    chosen = arguments.names or [n for n in sizes if sizes[n] <= arguments.most]
    for name in [] if arguments.table else sorted(chosen, key=lambda n: sizes[n]):
        path = next(CORPUS.glob(f"*/{name}.tsp"))
        for metric in arguments.metric or METRICS:
            record = prove(path, metric, arguments.limit)
            print(name, metric, outcome(record), flush=True)
            records = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
            records[f"{name} {metric}"] = record
            RESULTS.parent.mkdir(exist_ok=True)
            RESULTS.write_text(json.dumps(records, indent=1, sort_keys=True) + "\n")
    PAGE.write_text(page(records))


if __name__ == "__main__":
    main()
