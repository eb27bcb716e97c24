"""docs/reproduction.md and the committed runs behind it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tcp.experiments.journal import Journal
from tcp.experiments.run import one_run, optima
from tcp.experiments.spec import load

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results" / "papers.jsonl"
EXPERIMENTS = ROOT / "data" / "experiments"
TABLES = ["htga-table-vi", "htga-table-vii", "htga-table-viii", "htga-table-ix", "cuckoo-table-5"]


def test_the_page_is_what_the_committed_results_say(tmp_path):
    """``benchmarks/papers.py --report`` changes nothing; if it does, commit the new page."""
    page = tmp_path / "page.md"
    words = [sys.executable, "benchmarks/papers.py", "--report", "--out", str(page)]
    subprocess.run(words, cwd=ROOT, check=True)
    assert page.read_text() == (ROOT / "docs" / "reproduction.md").read_text()


@pytest.mark.parametrize("table", TABLES)
def test_committed_runs_are_what_the_solvers_give(table):
    """Made again, a run is the same: who changes a trajectory makes the runs and the page anew.

    Genetic algorithm and particle swarm only: they use no function whose last
    bit depends on the machine's mathematical library.
    """
    stored, experiment = Journal(RESULTS).runs(), load(EXPERIMENTS / f"{table}.toml")
    known = optima(experiment)
    columns = [c for c in experiment.columns if c.solver in ("htga", "pso")]
    assert columns
    for column in columns:
        for seed in (1, 2, 3):
            key = column.key(seed)
            again = one_run((key, column, seed, known[column.instance.sha256].cost))
            then = stored[key]
            assert (again.cost, again.route, again.evaluations) == (
                then.cost,
                then.route,
                then.evaluations,
            )
            assert again.trace[-1:] == then.trace
