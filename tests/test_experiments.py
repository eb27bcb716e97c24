"""Experiments: files, journal, statistics, tables, and the same results on every backend."""

from __future__ import annotations

import errno
import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from click.testing import CliRunner

from tcp.cli.main import main
from tcp.errors import InputError, OutputError
from tcp.experiments.journal import Journal, Run
from tcp.experiments.plot import best_so_far, save_convergence
from tcp.experiments.run import Optimum, conduct, optima, rehearse
from tcp.experiments.spec import load
from tcp.experiments.statistics import Summary, mean_interval, summarise, wilson
from tcp.experiments.table import honest_table, paper_table, whole_report
from tcp.fleet import Fleet
from tcp.solve import SOLVERS, solve
from tcp.stop import Stop, StopReason

ROOT = Path(__file__).resolve().parents[1]
SHIPPED = sorted((ROOT / "data" / "experiments").glob("*.toml"))

SMALL = """
title = "A small one"
runs = {runs}
seed = 5
rows = ["sequence", "least_iterations", "average_iterations", "least_time", "optimal_time"]

[[column]]
name = "CS"
workpiece = "{wp1}"
travel = "case2"
solver = "cuckoo"
options = {{ np = 10, generations = 900 }}
[column.published]
least_iterations = "1"
optimal_time = "235.2"

[[column]]
name = "quoted"
workpiece = "{wp1}"
[column.published]
least_iterations = "7"

[[column]]
name = "GA"
workpiece = "{wp1}"
solver = "htga"
options = {{ np = 10, gn = 40 }}
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "small.toml"
    path.write_text(SMALL.format(runs=6, wp1=ROOT / "data" / "wp1.csv"))
    return path


def some_run(seed: int = 0, **changes: object) -> Run:
    run = Run(f"key {seed}", seed, 90, 90, "1 2", [[0, 120], [7, 90]], 7, 80, 0.25, 0.2)
    return replace(run, **changes)


def facts(runs: dict[str, Run]) -> dict[str, Run]:
    """What must be the same everywhere: all but the times."""
    return {key: replace(run, seconds=0.0, cpu=0.0) for key, run in runs.items()}


@pytest.mark.parametrize("holes", [1, 170, 171, 400])
def test_more_holes_than_a_float_has_orders(holes, tmp_path):
    """Half of 171 factorial is no float any more."""
    board, spec = tmp_path / "board.csv", tmp_path / "large.toml"
    board.write_text("x,y\n" + "".join(f"{7 * k % 180},{11 * k % 190}\n" for k in range(holes)))
    spec.write_text(
        'title = "Large"\nruns = 1\nseed = 1\nrows = ["average_ratio", "least_time"]\n'
        f'[[column]]\nname = "LS"\nworkpiece = "{board}"\nsolver = "local-search"\n'
    )
    column = load(spec).columns[0]
    summary = Summary(column, Optimum(90, 0.0, "trusted"), (some_run(),))
    assert summary.figure("least_time") == "90"
    assert float(summary.figure("average_ratio").removesuffix("%")) >= 0


# --- experiment files -------------------------------------------------------


@pytest.mark.parametrize("path", SHIPPED, ids=lambda p: p.stem)
def test_shipped_experiments_are_valid(path):
    experiment = load(path)
    assert experiment.runs >= 50 and experiment.source
    for column in experiment.columns:
        assert column.solver or column.published
        assert not column.solver or column.solver in SOLVERS


def test_every_published_table_has_a_file():
    names = {path.stem for path in SHIPPED}
    assert {f"htga-table-{n}" for n in ("vi", "vii", "viii", "ix", "x", "xi")} <= names
    assert {f"cuckoo-table-{n}" for n in (1, 2, 3, 5, 6)} <= names
    assert "firefly-table-iii" in names


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (("title =", "titel ="), "no key 'titel'"),
        (('"least_time", ', '"last_time", '), "unknown row 'last_time'"),
        (("runs = 6", "runs = 0"), "from 1 to 1,000,000"),
        (("runs = 6", 'runs = "6"'), "from 1 to 1,000,000"),
        (("runs = 6", f"runs = {10**20}"), "from 1 to 1,000,000"),
        (("seed = 5", "seed = -1"), "from 0 to 1,000,000"),
        (('solver = "cuckoo"', 'solver = "koel"'), "column 'CS': unknown solver 'koel'"),
        (("np = 10, generations = 900", "nq = 10"), "column 'CS': cuckoo has no option 'nq'"),
        (("np = 10, generations = 900", 'np = "x"'), "np is a whole number up to 10^12, not 'x'"),
        (("np = 10, generations = 900", "np = 2020-01-01"), "np is a whole number"),
        (("np = 10, generations = 900", f"np = {10**20}"), "np is a whole number up to 10^12"),
        (("np = 10, generations = 900", "pa = nan"), "column 'CS': cuckoo: pa is a finite number"),
        (("np = 10, generations = 900", "beta = -inf"), "beta is a finite number, not -inf"),
        (("np = 10, generations = 900", 'pa = "x"'), "pa is a finite number, not 'x'"),
        (('optimal_time = "235.2"', "optimal_time = [1]"), "must be one line or a number"),
        (('[column.published]\nleast_iterations = "7"', "published = 5"), "must be a table"),
        (('travel = "case2"', 'travel = "hover"'), "column 'CS': unknown travel model 'hover'"),
        (('travel = "case2"', 'travel = "case2"\nclosed = "yes"'), "expected true or false"),
        (('travel = "case2"', 'travel = "case2"\nclosed = true\nend = 9'), "column 'CS': a closed"),
        (('travel = "case2"', 'travel = "case2"\nlegs = "out"'), "legs needs home"),
        (('travel = "case2"', 'travel = "case2"\nmin_jump = "x"'), "expected mm from 0 on"),
        (('travel = "case2"', 'travel = "case2"\nmin_jump = -1'), "expected mm from 0 on"),
        (('solver = "cuckoo"', 'solvr = "cuckoo"'), "column 'CS' has no key 'solvr'"),
        (("options = { np = 10, generations = 900 }", "options = 3"), "must be a table"),
        (('least_iterations = "7"', 'most_time = "7"'), "no key 'most_time'"),
        (("seed = 5", "seeds = 5"), "no key 'seeds'"),
        (('name = "GA"', "name = 5"), "name must be a text"),
        (('travel = "case2"', 'travel = "case2"\nstart = 77'), "names no hole"),
        (('travel = "case2"', 'travel = "case2"\nhome = "here"'), "expected"),
        (("rows = [", "rows = ["[:-1] + "{"), "is not TOML"),
        (('travel = "case2"', 'travel = "case2"\nhome = "12"'), "expected [X, Y] in mm"),
        (('travel = "case2"', 'travel = "case2"\nhome = { 1 = 0, 2 = 0 }'), "expected [X, Y]"),
        (('travel = "case2"', 'travel = "case2"\nhome = [1, 2, 3]'), "expected [X, Y] in mm"),
        (('solver = "cuckoo"\n', ""), "column 'CS' needs a solver, or only what is published"),
        (('[column.published]\nleast_iterations = "7"', ""), "column 'quoted' needs a solver"),
        (('name = "GA"', 'name = "CS"'), "the column 'CS' is there twice"),
        (('rows = ["sequence", ', 'rows = ["sequence", "sequence", '), "'sequence' is there twice"),
        (('name = "GA"', 'name = " "'), "name must be a text of one line, not ' '"),
        (('name = "GA"', 'name = "G\\nA"'), "name must be a text of one line"),
        (('title = "A', 'title = "\\n'), "title must be a text of one line"),
        (('optimal_time = "235.2"', "optimal_time = nan"), "must be one line or a number"),
        (('optimal_time = "235.2"', "optimal_time = true"), "must be one line or a number"),
        (('optimal_time = "235.2"', 'optimal_time = "2\\n3"'), "must be one line or a number"),
        (("runs = 6", f"runs = {'9' * 5000}"), "small.toml:3: a key or number of more than 1,000"),
        (("rows = [", f"rows = {'[' * 3000}"), "small.toml:5: nested more than 20 deep"),
        (("wp1.csv", "wp\\u0000.csv"), "is no name of a file"),
        (('title = "A', 'title = "\0'), "is binary"),
    ],
)
def test_files_that_make_no_sense_are_refused(small, change, complaint):
    small.write_text(small.read_text().replace(*change))
    with pytest.raises(InputError, match=re.escape(complaint)):
        load(small)


def test_a_missing_file_and_a_missing_workpiece_are_refused(small, tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        load(tmp_path / "none.toml")
    small.write_text(small.read_text().replace("wp1.csv", "wp9.csv"))
    with pytest.raises(InputError):
        load(small)


def test_a_file_with_a_byte_order_mark_is_read(small):
    plain = load(small)
    small.write_bytes(b"\xef\xbb\xbf" + small.read_bytes())
    assert load(small).columns[0].key(5) == plain.columns[0].key(5)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (("np = 10, gn = 40", "np = 2"), "second.toml: column 'GA': htga needs np >= 4"),
        (("runs = 6", "runs = 0"), "second.toml: runs must be"),
    ],
)
def test_every_file_and_option_is_looked_at_before_any_proof(small, monkeypatch, change, complaint):
    def too_early(*_):
        raise AssertionError("a proof before all files were checked")

    monkeypatch.setattr("tcp.cli.experiment.optima", too_early)
    second = small.with_name("second.toml")
    second.write_text(small.read_text().replace(*change))
    folder = str(small.parent / "r")
    done = CliRunner().invoke(main, ["experiment", str(small), str(second), "--results", folder])
    assert done.exit_code == 3 and complaint in done.output


# --- the journal ------------------------------------------------------------


def test_journal_keeps_what_it_is_given(tmp_path):
    journal = Journal(tmp_path / "deep" / "j.jsonl")
    assert journal.runs() == {}
    for seed in range(3):
        journal.append(some_run(seed))
    assert journal.runs() == {f"key {k}": some_run(k) for k in range(3)}


def test_half_written_and_damaged_lines_are_recognised(tmp_path):
    journal = Journal(tmp_path / "j.jsonl")
    for seed in range(4):
        journal.append(some_run(seed))
    whole = journal.path.read_bytes()
    first = whole.index(b"\n") + 1
    for cut in range(len(whole) - 1, len(whole) - 60, -7):
        journal.path.write_bytes(whole[:cut])
        assert set(journal.runs()) == {"key 0", "key 1", "key 2"}
    journal.append(some_run(9))  # behind half a line: on a line of its own
    assert set(journal.runs()) == {"key 0", "key 1", "key 2", "key 9"}
    flipped = whole[:first].replace(b"120", b"121") + whole[first:]
    journal.path.write_bytes(flipped)
    assert set(journal.runs()) == {"key 1", "key 2", "key 3"}
    journal.path.write_bytes(b"\n\xff\xfe garbage\n" + whole)
    assert len(journal.runs()) == 4


def test_hits_and_last_improvements():
    assert some_run().hit == 7 and some_run().last == 7
    assert some_run(optimum=80).hit is None
    assert some_run(optimum=130).hit == 0


def test_a_run_that_never_told_of_its_route_has_the_optimum_at_its_end():
    silent = some_run(trace=[], iterations=40)
    assert silent.optimal and silent.hit == 40
    assert some_run(trace=[[0, 120]], iterations=40).hit == 40
    assert some_run(optimum=80).optimal is False
    uncounted = some_run(iterations=None, evaluations=None)
    assert uncounted.optimal and uncounted.hit is None and uncounted.last is None


@pytest.mark.parametrize("solver", ["held-karp", "htga"])
def test_solvers_that_report_nothing_on_the_way_have_their_optimum_counted(solver, tmp_path):
    board, spec = tmp_path / "three.csv", tmp_path / "three.toml"
    board.write_text("x,y\n0,0\n3,0\n1,0\n")
    spec.write_text(
        'title = "Three"\nrows = ["success", "population", "least_iterations", "least_searched"]\n'
        f'[[column]]\nname = "S"\nworkpiece = "{board}"\nsolver = "{solver}"\n'
    )
    experiment = load(spec)
    known = optima(experiment)
    runs = conduct(experiment, known, Journal(tmp_path / "j.jsonl"), fleet=Fleet(1))
    summaries = summarise(experiment.columns, known, runs)
    figures = [summaries[0].figure(row) for row in experiment.rows]
    counts = {"held-karp": ["none", "none", "none"], "htga": ["50", "0", "6"]}
    assert figures == ["1 of 1", *counts[solver]]
    assert "| 0.00% ± - " in honest_table(summaries)


# --- running ----------------------------------------------------------------


def test_results_are_the_same_for_one_and_two_processes(small, tmp_path):
    experiment = load(small)
    known = optima(experiment)
    alone = conduct(experiment, known, Journal(tmp_path / "1.jsonl"), fleet=Fleet(1))
    assert len(alone) == 12 and all(run.cost >= run.optimum for run in alone.values())
    two = conduct(experiment, known, Journal(tmp_path / "2.jsonl"), fleet=Fleet(2))
    assert facts(two) == facts(alone)


@pytest.mark.filterwarnings("default")  # the cluster's own libraries may warn
def test_a_dask_cluster_of_two_processes_gives_the_same_results(small, tmp_path):
    distributed = pytest.importorskip("distributed", reason="the dask extra is not installed")
    experiment = load(small)
    known = optima(experiment)
    alone = conduct(experiment, known, Journal(tmp_path / "1.jsonl"), fleet=Fleet(1))
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        journal = Journal(tmp_path / "d.jsonl")
        fleet = Fleet(backend="dask", scheduler=cluster.scheduler_address)
        dask = conduct(experiment, known, journal, fleet=fleet)
    assert facts(dask) == facts(alone) == facts(journal.runs())


@pytest.mark.slow
@pytest.mark.timeout(120)
@pytest.mark.filterwarnings("default")
def test_a_ray_cluster_gives_the_same_results(small, tmp_path, monkeypatch):
    pytest.importorskip("ray", reason="the ray extra is not installed")
    monkeypatch.setenv("RAY_AUTH_MODE", "disabled")
    from tests.test_fleet import ray_cluster

    experiment = load(small)
    known = optima(experiment)
    alone = conduct(experiment, known, Journal(tmp_path / "1.jsonl"), fleet=Fleet(1))
    with ray_cluster() as address:
        fleet = Fleet(backend="ray", scheduler=address)
        ray = conduct(experiment, known, Journal(tmp_path / "r.jsonl"), fleet=fleet)
    assert facts(ray) == facts(alone)


def test_a_run_is_its_column_and_seed(small, tmp_path):
    experiment = load(small)
    known = optima(experiment)
    journal = Journal(tmp_path / "j.jsonl")
    heard = []
    few = conduct(
        replace(experiment, runs=2), known, journal, fleet=Fleet(1), told=lambda *n: heard.append(n)
    )
    assert heard == [(k, 4) for k in range(5)]
    all_runs = conduct(experiment, known, journal, fleet=Fleet(1))
    assert facts(few).items() <= facts(all_runs).items()
    stamp = journal.path.read_bytes()
    assert conduct(experiment, known, journal, fleet=Fleet(1)) == all_runs
    assert journal.path.read_bytes() == stamp
    other = replace(experiment.columns[0], options={"np": 11, "generations": 900})
    assert other.key(5) != experiment.columns[0].key(5)


def test_killed_at_any_moment_it_continues_and_ends_with_the_same_table(small, tmp_path):
    small.write_text(small.read_text().replace("runs = 6", "runs = 150"))
    words = [sys.executable, "-m", "tcp", "experiment", str(small), "--jobs", "1", "--results"]
    folder, lines = tmp_path / "killed", tmp_path / "killed" / "small.jsonl"
    process = subprocess.Popen([*words, str(folder)], cwd=ROOT, stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 60
    while not (lines.exists() and lines.stat().st_size > 4000) and time.monotonic() < deadline:
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()
    kept = len(Journal(lines).runs())
    assert 0 < kept < 300, "killed too late or too early to show anything"
    os.truncate(lines, lines.stat().st_size - 17)
    experiment = load(small)
    known = optima(experiment)
    resumed = conduct(experiment, known, Journal(lines), fleet=Fleet(1))
    fresh = conduct(experiment, known, Journal(tmp_path / "fresh.jsonl"), fleet=Fleet(1))
    assert facts(resumed) == facts(fresh)
    tables = [
        paper_table(experiment, summarise(experiment.columns, known, runs))
        for runs in (resumed, fresh)
    ]
    assert tables[0] == tables[1]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--results", "plain"], "cannot read the results: not a directory"),
        (["--results", "/dev/null/x"], "cannot read the results: not a directory"),
        (["--results", "folder"], "cannot read the results: is a directory"),
        (["--plot", "x.xyz"], "ends in .svg or .png or .pdf"),
        (["--plot", "folder"], "cannot write folder: is a directory"),
        (["--plot", "link.svg"], "is an input"),
        (["--plot", "none/x.svg"], "there is no folder none"),
    ],
)
def test_results_and_pictures_that_cannot_be_written_are_told_before_any_run(
    small, tmp_path, monkeypatch, words, complaint
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plain").touch()
    (tmp_path / "folder" / "small.jsonl").mkdir(parents=True)
    (tmp_path / "link.svg").symlink_to(small)
    done = CliRunner().invoke(main, ["experiment", str(small), *words])
    assert complaint in str(done.exception) + done.output and "Runs" not in done.output


def test_a_folder_that_takes_no_file_is_told_before_any_run(small, tmp_path):
    experiment, folder = load(small), tmp_path / "closed"
    folder.touch()
    with pytest.raises(OutputError, match="cannot write"):
        Journal(folder / "x" / "j.jsonl").prepare()
    alone = replace(experiment.columns[2], options={"np": 2})
    with pytest.raises(InputError, match=r"small\.toml: column 'GA': htga needs np >= 4"):
        rehearse(replace(experiment, columns=(alone,)), Journal(tmp_path / "j"))


def test_a_journal_without_curves_keeps_every_table(small, tmp_path):
    """All but the trace is there, and a torn line costs one run."""
    experiment = load(small)
    known = optima(experiment)
    whole = conduct(experiment, known, Journal(tmp_path / "w.jsonl"), fleet=Fleet(1))
    short = Journal(tmp_path / "s.jsonl", curves=False)
    conduct(experiment, known, short, fleet=Fleet(1))
    os.truncate(short.path, short.path.stat().st_size - 3)
    assert len(short.runs()) == len(whole) - 1
    conduct(experiment, known, short, fleet=Fleet(1))
    tables = [
        paper_table(experiment, summarise(experiment.columns, known, runs))
        for runs in (whole, short.runs())
    ]
    assert tables[0] == tables[1]
    assert all(len(run.trace) == 1 for run in short.runs().values())


# --- statistics, tables, plots ----------------------------------------------


def test_an_interrupted_run_is_not_taken_for_a_finished_one(small, tmp_path, monkeypatch):
    """The solver answers the first Ctrl-C with its best so far; the experiment must not keep it."""
    experiment, journal = load(small), Journal(tmp_path / "j.jsonl")
    known = optima(experiment)

    def cut_short(*args, **options):
        return replace(solve(*args, **options), stopped=StopReason.INTERRUPTED)

    monkeypatch.setattr("tcp.experiments.run.solve", cut_short)
    with pytest.raises(KeyboardInterrupt):
        conduct(experiment, known, journal, fleet=Fleet(1))
    assert journal.runs() == {}


def test_ctrl_c_tells_what_is_kept(small, tmp_path, monkeypatch):
    """The line of a user who wonders whether hours of runs are lost."""
    words = ["experiment", str(small), "--jobs", "1", "--results", str(tmp_path / "kept")]
    append = Journal.append

    def interrupted(journal, run):
        append(journal, run)
        if len(journal.runs()) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(Journal, "append", interrupted)
    done = CliRunner().invoke(main, words)
    path = tmp_path / "kept" / f"{small.stem}.jsonl"
    assert done.exit_code == 130
    assert done.stderr == f"tcp: interrupted: 2 runs are kept in {path}\n"
    assert len(Journal(path).runs()) == 2


@pytest.mark.parametrize("step", [optima, lambda e: rehearse(e, Journal(e.path.with_suffix("")))])
def test_ctrl_c_ends_proofs_and_rehearsals_too(small, monkeypatch, step):
    experiment = load(small)
    bare = tuple(replace(column, certificates=None) for column in experiment.columns)

    def cut_short(*args, **options):
        found = solve(*args, stop=Stop(iterations=0), seed=1)
        return replace(found, stopped=StopReason.INTERRUPTED)

    monkeypatch.setattr("tcp.experiments.run.solve", cut_short)
    with pytest.raises(KeyboardInterrupt):
        step(replace(experiment, columns=bare))


def test_nothing_is_proved_for_what_is_only_quoted(small, monkeypatch):
    experiment = load(small)
    quoted = replace(experiment.columns[1], certificates=None)
    monkeypatch.setattr("tcp.experiments.run.solve", None)
    alone = replace(experiment, columns=(quoted,))
    assert optima(alone) == {}
    assert "quoted: paper" in whole_report(alone, summarise(alone.columns, {}, {}))


def test_a_picture_that_finds_no_space_leaves_the_old_one(small, tmp_path, monkeypatch):
    plot = tmp_path / "a.svg"
    plot.write_text("old")

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OutputError, match="cannot write"):
        save_convergence(load(small), [], plot)
    assert plot.read_text() == "old"


def test_intervals_are_the_textbooks():
    low, high = wilson(8, 10)
    assert (low, high) == (pytest.approx(0.4902, abs=1e-4), pytest.approx(0.9433, abs=1e-4))
    assert wilson(0, 5)[0] == 0 and wilson(5, 5)[1] == 1
    mean, half = mean_interval([1.0, 2.0, 3.0, 4.0])
    assert mean == 2.5 and half == pytest.approx(2.0542, abs=1e-4)  # t(3) = 3.1824, s = 1.2910
    assert mean_interval([7.0]) == (7.0, None)


def test_the_table_shows_the_papers_figures_and_ours(small, tmp_path):
    experiment = load(small)
    known = optima(experiment)
    runs = conduct(experiment, known, Journal(tmp_path / "j.jsonl"), fleet=Fleet(1))
    summaries = summarise(experiment.columns, known, runs)
    assert [s is None for s in summaries] == [False, True, False]
    text = whole_report(experiment, summaries)
    head = next(line for line in text.splitlines() if line.startswith("| Criteria"))
    cells = [c.strip() for c in head.strip("|").split("|")]
    assert cells == ["Criteria", "CS: paper", "CS: ours", "quoted: paper", "GA: ours"]
    first = summaries[0]
    assert first.success == 1.0 and first.figure("optimal_time") == "235.25"
    hits = sorted(run.hit for run in first.runs)
    assert first.figure("least_iterations") == str(hits[0])
    assert first.figure("most_iterations") == str(hits[-1])
    assert f"{sum(hits) / len(hits):.1f}".removesuffix(".0") == first.figure("average_iterations")
    assert first.figure("least_time") == "235.25"
    assert first.gap_interval() == (0.0, 0.0)
    ratio = min(run.evaluations for run in first.runs) / 181440  # 9! / 2, equation (17)
    assert first.figure("least_ratio") == f"{ratio * 100:.2E}%"


def test_a_column_without_success_says_so(small, tmp_path):
    experiment = load(small)
    known = optima(experiment)
    runs = conduct(experiment, known, Journal(tmp_path / "j.jsonl"), fleet=Fleet(1))
    worse = {k: replace(r, cost=r.optimum * 2, trace=[[0, r.optimum * 2]]) for k, r in runs.items()}
    summary = summarise(experiment.columns, known, worse)[0]
    assert summary.figure("least_iterations") == "none"
    assert summary.figure("success") == "0 of 6"
    assert summary.gap_interval()[0] == pytest.approx(1.0)


def test_curves_follow_the_trace():
    grid = np.array([0, 1, 2, 5, 6, 100])
    assert best_so_far([[0, 9], [2, 7], [6, 3]], grid).tolist() == [9, 9, 7, 7, 3, 3]


def test_the_command_prints_tables_and_draws(small, tmp_path):
    plot = tmp_path / "curves.svg"
    words = ["experiment", str(small), "--runs", "3", "--jobs", "1"]
    words += ["--results", str(tmp_path / "r")]
    done = CliRunner().invoke(main, [*words, "--table", "--plot", str(plot)])
    assert done.exit_code == 0, done.output
    assert "GA: ours" in done.output and "Ours: 3 runs a column" in done.output
    assert plot.read_text().lstrip().startswith("<?xml")
    short = CliRunner().invoke(main, words)
    assert "Criteria" not in short.output and "95 % interval" in short.output
    twice = CliRunner().invoke(main, [*words, str(small), "--plot", str(plot)])
    assert twice.exit_code == 2


def test_a_picture_takes_any_title_and_names_every_column(small, tmp_path):
    text = small.read_text().replace("A small one", "1 $ and 2 $^").replace('"GA"', '"_hidden $"')
    small.write_text(text)
    experiment, plot = load(small), tmp_path / "curves.svg"
    known = optima(experiment)
    runs = conduct(experiment, known, Journal(tmp_path / "j.jsonl"), fleet=Fleet(1))
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        save_convergence(experiment, summarise(experiment.columns, known, runs), plot)
    drawn = plot.read_text()
    assert "1 $ and 2 $^" in drawn and "runs: _hidden $" in drawn


def test_results_lines_are_plain_json_behind_a_checksum(tmp_path):
    journal = Journal(tmp_path / "j.jsonl")
    journal.append(some_run(3))
    _, _, body = journal.path.read_text().partition(" ")
    assert json.loads(body)["trace"] == [[0, 120], [7, 90]]


def test_the_optimum_is_certified_where_a_certificate_stands_and_proved_elsewhere(small, tmp_path):
    experiment = load(small)
    assert {o.proof for o in optima(experiment).values()} == {"certificate checked"}
    bare = tuple(replace(column, certificates=None) for column in experiment.columns)
    proved = optima(replace(experiment, columns=bare))
    assert all(o.proof.startswith("trusted (") for o in proved.values())
    assert {k: o.cost for k, o in proved.items()} == {
        k: o.cost for k, o in optima(experiment).items()
    }
