"""Reproduce the papers' tables and write docs/reproduction.md.

    python benchmarks/papers.py [TABLE...] [--runs N] [--jobs N]
    python benchmarks/papers.py --report

Finished runs are kept in benchmarks/results/papers.jsonl, one line a run: the command may be killed
and started again, and later runs extend what is there.  ``--report`` makes no new runs and writes
the page from the committed results, those of ``benchmarks/bmga.py`` among them.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import bmga

from tcp import Instance, solve
from tcp.experiments.journal import Journal, Run
from tcp.experiments.run import conduct, optima, rehearse
from tcp.experiments.spec import ROWS, Experiment, load
from tcp.experiments.statistics import Summary, summarise
from tcp.experiments.table import markdown, whole_report
from tcp.fleet import Fleet

ROOT = Path(__file__).resolve().parents[1]
FILES = ROOT / "data" / "experiments"
RESULTS = ROOT / "benchmarks" / "results"
RUNS_FILE = RESULTS / "papers.jsonl"
PROOFS = RESULTS / "papers-proofs.json"

RUNS = {
    "cuckoo-table-1": 1000,
    "cuckoo-table-2": 1000,
    "htga-table-vi": 1000,
    "htga-table-vii": 1000,
    "htga-table-viii": 1000,
    "htga-table-ix": 1000,
    "cuckoo-table-5": 1000,
    "cuckoo-table-6": 1000,
    "firefly-table-iii": 100,
    "htga-table-x": 100,
    "htga-table-xi": 100,
    "cuckoo-table-3": 100,
}
"""Runs of each column: 1,000 where they take less than half an hour of two cores."""

READINGS = "htga-readings", "firefly-readings"
"""Experiments that set one reading of a paper beside others, 100 runs each."""

COMPARED = ("iterations", "time", "error", "fitness", "searched")
"""Kinds of figures that the verdict table sets side by side."""


# --- the tables -------------------------------------------------------------


def experiments(names: Sequence[str], cap: int | None) -> list[Experiment]:
    """The named experiments, or those of all tables, cheapest first."""
    known = RUNS | dict.fromkeys(READINGS, 100)
    for name in names:
        if name not in known:
            raise SystemExit(f"no table {name!r}; one of {', '.join(known)}")
    return [
        replace(load(FILES / f"{name}.toml"), runs=min(known[name], cap or known[name]))
        for name in names or RUNS
    ]


def conduct_all(arguments: argparse.Namespace, journal: Journal) -> None:
    """Make the runs that are missing."""
    for experiment in experiments(arguments.tables or (*RUNS, *READINGS), arguments.runs):
        began = time.perf_counter()
        rehearse(experiment, journal)
        conduct(experiment, optima(experiment), journal, fleet=Fleet(jobs=arguments.jobs))
        print(f"{experiment.title}: {time.perf_counter() - began:.0f} s", flush=True)


def tables(
    names: Sequence[str], stored: dict[str, Run]
) -> list[tuple[Experiment, list[Summary | None]]]:
    """The named experiments with the summaries of their stored runs."""
    return [(e, summarise(e.columns, optima(e), stored)) for e in experiments(names, None)]


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
                        _verdict(theirs, ours, _base(key, s)) + _few(key, s),
                    ]
                )
    return markdown(rows)


def _few(key: str, s: Summary) -> str:
    """A reminder where an average is over few runs."""
    over_hits = key.endswith(("iterations", "searched")) and 0 < s.success < 0.99
    return f", but only {s.success:.0%} of the runs got there" if over_hits else ""


def _base(key: str, s: Summary) -> float:
    """The optimum that no time lies below, 0 for other figures."""
    return s.optimum.cost * s.unit_of_cost if key.endswith(("time", "fitness")) else 0.0


def _verdict(theirs: float, ours: float | None, base: float) -> str:
    if ours is None:
        return "not confirmed: no run got there"
    if theirs <= base:
        return "not confirmed: not above the optimum"
    what = "gap " if base else ""
    ratio = (ours - base) / (theirs - base)
    if 0.9 <= ratio <= 1.1:
        return f"confirmed ({what}within 10 %)"
    if 0.5 <= ratio <= 2:
        return f"same order ({what}{ratio:.2f} times)"
    return f"not confirmed ({what}{ratio:.2g} times)"


# --- heuristics against a proof ---------------------------------------------


def compared(
    done: list[tuple[Experiment, list[Summary | None]]],
) -> dict[tuple[str, str, str], Summary]:
    """The summary with most runs of each workpiece, travel model and heuristic."""
    seen: dict[tuple[str, str, str], Summary] = {}
    for _, summaries in done:
        for s in (s for s in summaries if s is not None):
            where = s.column.instance
            name = s.column.name if s.column.solver != "cuckoo" else "CS"
            key = (where.name, str(where.travel.model), name)
            if key not in seen or len(s.runs) > len(seen[key].runs):
                seen[key] = s
    return dict(sorted(seen.items()))


def conduct_proofs() -> None:
    """Time the proof of every instance of the tables that is not timed yet."""
    data = dict(json.loads(PROOFS.read_text())) if PROOFS.exists() else {}
    for experiment in experiments((), None):
        for column in experiment.columns:
            name = f"{column.instance.name} {column.instance.travel.model}"
            if name not in data:
                data[name] = proof_seconds(column.instance)
                PROOFS.write_text(json.dumps(data, indent=1) + "\n")


def proof_seconds(instance: Instance) -> float:
    """Processor seconds to a proof by the exact default: the median of three, after a first."""
    times = []
    for seed in range(4):
        began = time.process_time()
        assert solve(instance, exact=True, seed=seed).gap == 0
        times.append(round(time.process_time() - began, 4))
    return sorted(times[1:])[1]


def comparison(done: list[tuple[Experiment, list[Summary | None]]]) -> str:
    """Success and time to the optimum of each heuristic, and the time to a proof."""
    proofs = dict(json.loads(PROOFS.read_text())) if PROOFS.exists() else {}
    head = ["Workpiece", "Travel", "Heuristic", "Runs", "Success", "CPU seconds a run"]
    rows = [[*head, "CPU seconds to the optimum, expected", "CPU seconds to a proof (exact)"]]
    for (piece, model, name), s in compared(done).items():
        expected = f"{s.cpu / s.success:.3f}" if s.success else f"over {s.cpu * len(s.runs):.0f}"
        proof = proofs.get(f"{piece} {model}")
        rows.append(
            [
                *(piece, model, name, str(len(s.runs)), f"{s.success:.1%}", f"{s.cpu:.3f}"),
                *(expected, "not measured" if proof is None else f"{proof:.3f}"),
            ]
        )
    return markdown(rows)


# --- the page ---------------------------------------------------------------

PROSE = (ROOT / "benchmarks" / "papers.md").read_text(encoding="utf-8")


def page() -> str:
    """The whole of docs/reproduction.md, from what is stored."""
    stored = Journal(RUNS_FILE).runs()
    done, readings = tables(sorted(RUNS), stored), tables(READINGS, stored)
    measured = bmga.stored()
    spent = sum(run.cpu for run in stored.values())
    parts = {
        "MADE": f"{len(stored):,} runs, {spent / 60:.0f} CPU minutes in all",
        "VERDICTS": verdicts(done),
        "COMPARISON": comparison(done),
        "READINGS": "\n".join(whole_report(e, s) for e, s in readings),
        "FRONTS": bmga.fronts_table(measured),
        "BOARDS": bmga.boards_tables(measured),
        "TABLES": "\n".join(whole_report(e, s) for e, s in done),
    }
    text = PROSE
    for name, value in parts.items():
        text = text.replace("{" + name + "}", value)
    return text


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("tables", nargs="*", metavar="TABLE", help="only these")
    parser.add_argument("--runs", type=int, help="at most so many runs of each column")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--report", action="store_true", help="make no new runs")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "reproduction.md")
    arguments = parser.parse_args()
    if not arguments.report:
        conduct_all(arguments, Journal(RUNS_FILE, curves=False))
        conduct_proofs()
    arguments.out.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
