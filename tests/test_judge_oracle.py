"""The oracle: pinned optima that are checked on every load, and the pytest plugin."""

from __future__ import annotations

import gzip
import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest
from click.testing import CliRunner

from tcp import Ends, Instance, Model, Travel, Workpiece
from tcp.cli.main import main
from tcp.errors import InputError
from tcp.files import read
from tcp.oracle import NoProofError, Oracle, judge
from tcp.pytest_plugin import DrillOracle
from tcp.solve import solve
from tcp.stop import StopReason
from tcp.validate.store import CertificateFolder, file_name

ROOT = Path(__file__).resolve().parents[1]
PINNED = ROOT / "data" / "certificates"
CI = ROOT / "examples" / "ci"

OPTIMA = {
    ("wp1", "sequential"): "322.5",
    ("wp1", "simultaneous"): "235.25",
    ("wp2", "sequential"): "280",
    ("wp2", "simultaneous"): "220.04",
    ("wp3", "sequential"): "1482.604",
    ("wp3", "simultaneous"): "1127.248",
    ("fa14", "sequential"): "280",
    ("fa14", "simultaneous"): "220.02",
    ("five", "sequential"): "10",
    ("five", "simultaneous"): "8",
}


def instance_of(name: str, model: str) -> Instance:
    return Instance(read(ROOT / "data" / f"{name}.csv").workpiece, Travel(Model(model)))


@pytest.mark.parametrize(("name", "model"), OPTIMA, ids=str)
def test_the_papers_optima_are_pinned_and_pass_the_checker(name, model):
    instance = instance_of(name, model)
    known = CertificateFolder(PINNED).known(instance)
    assert known is not None and known.optimal and known.certified
    assert known.lower * instance.quantum == Fraction(OPTIMA[name, model])
    assert known.route is not None and instance.cost(known.route) == known.upper


def test_another_instance_finds_nothing():
    piece = read(ROOT / "data" / "wp3.csv").workpiece
    folder = CertificateFolder(PINNED)
    assert folder.known(Instance(piece, ends=Ends(closed=True))) is None
    assert folder.known(Instance(piece, Travel(vx=Fraction(2)))) is None
    y = piece.y.copy()
    y[13] += 1000
    moved = Workpiece("wp3", piece.ids, piece.x.copy(), y, piece.step)
    assert folder.known(Instance(moved)) is None


def test_a_certificate_is_checked_on_every_load(tmp_path):
    instance = instance_of("wp3", "sequential")
    source = CertificateFolder(PINNED).path(instance)
    data = json.loads(gzip.decompress(source.read_bytes()))
    data["claim"]["lower"] += 1
    data["claim"]["upper"] += 1
    target = tmp_path / file_name(instance)
    target.write_bytes(gzip.compress(json.dumps(data).encode()))
    with pytest.raises(InputError, match="no valid certificate"):
        CertificateFolder(tmp_path).known(instance)
    other = instance_of("wp3", "simultaneous")
    (tmp_path / file_name(other)).write_bytes(source.read_bytes())
    with pytest.raises(InputError, match="no valid certificate"):
        CertificateFolder(tmp_path).known(other)
    target.write_bytes(b"\x1f\x8bnot gzip")
    with pytest.raises(InputError, match="no valid certificate"):
        CertificateFolder(tmp_path).known(instance)


def test_pin_and_show(tmp_path):
    board = tmp_path / "b.csv"
    board.write_text("id,x,y\n1,0,0\n2,3,0\n3,3,4\n4,1,1\n")
    run = CliRunner().invoke
    assert run(main, ["oracle", "show", str(board)]).exit_code == 2
    done = run(main, ["oracle", "pin", str(board), "--travel", "case2"])
    assert done.exit_code == 0 and "optimum" in done.stdout
    files = list((tmp_path / "certificates").iterdir())
    assert len(files) == 1 and files[0].name.startswith("b.simultaneous.")
    before = files[0].read_bytes()
    again = run(main, ["oracle", "pin", str(board), "--travel", "case2"])
    assert again.stdout == done.stdout and files[0].read_bytes() == before
    shown = run(main, ["oracle", "show", str(board), "--travel", "case2"])
    assert shown.stdout == done.stdout
    judged = run(main, ["validate", str(board), "--travel", "case2", "--route", "1 4 2 3"])
    assert re.search(r"TCP30[12]", judged.stdout)
    files[0].write_bytes(before[:-20])
    assert run(main, ["oracle", "show", str(board), "--travel", "case2"]).exit_code == 3


def test_every_file_is_pinned_that_can_be_and_notes_are_told(tmp_path):
    bad, good, drill = tmp_path / "bad.csv", tmp_path / "b.csv", tmp_path / "c.drl"
    bad.write_text("nothing\n")
    good.write_text("id,x,y\n1,0,0\n2,3,0\n")
    drill.write_text("M48\nMETRIC,TZ\nT1C1\nT2C2\n%\nT1\nX1.0Y1.0\nX2.0Y2.0\nT2\nX3.0Y3.0\nM30\n")
    done = CliRunner().invoke(main, ["oracle", "pin", str(bad), str(good), str(drill)])
    assert done.exit_code == 3 and done.stdout.count("optimum") == 2
    assert "bad.csv" in done.stderr and "T1 drills most holes" in done.stderr
    done = CliRunner().invoke(main, ["oracle", "show", str(drill)])
    assert done.exit_code == 0 and "T1 drills most holes" in done.stderr


def test_ctrl_c_in_a_proof_ends_the_pinning(tmp_path, monkeypatch):
    files = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for path in files:
        path.write_text("id,x,y\n1,0,0\n2,3,0\n")

    def cut_short(*args, **options):
        return replace(solve(*args, **options), stopped=StopReason.INTERRUPTED)

    monkeypatch.setattr("tcp.oracle.solve", cut_short)
    done = CliRunner().invoke(main, ["oracle", "pin", *map(str, files)])
    assert done.exit_code == 130 and done.stdout == ""


def test_the_oracle_proves_what_is_missing_only_if_it_may(tmp_path):
    instance = instance_of("five", "euclidean")
    with pytest.raises(NoProofError, match="tcp oracle pin"):
        Oracle((PINNED,)).known(instance)
    cached = Oracle((PINNED,), tmp_path)
    time = cached.time(instance)
    assert len(list(tmp_path.iterdir())) == 1
    assert Oracle((tmp_path,)).time(instance) == time


def test_judge_allows_what_is_within():
    instance = instance_of("wp1", "sequential")
    known = CertificateFolder(PINNED).known(instance)
    best = "3 2 1 6 7 8 5 4 9"
    assert not judge(instance, best, known=known, within=Fraction(0)).failed()
    late = "2 3 1 6 7 8 5 4 9"
    assert judge(instance, late, known=known, within=Fraction(0)).failed()
    assert not judge(instance, late, known=known, within=Fraction(1)).failed()
    assert not judge(instance, late).failed()
    assert judge(instance, "1 1 2", known=known, within=Fraction(1)).failed()


def pytest_on_examples(crossover: str, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "pytest", "-q", "-p", "tcp.pytest_plugin"]
    command += ["-p", "no:cacheprovider", "-c", os.devnull, "--rootdir", str(CI), str(CI), *options]
    environment = {**os.environ, "CROSSOVER": crossover, "PYTHONPATH": str(ROOT)}
    environment["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
    return subprocess.run(command, capture_output=True, text=True, env=environment, cwd=CI)


def test_the_classic_bug_fails_the_third_partys_tests():
    done = pytest_on_examples("one-point")
    assert done.returncode == 1, done.stderr
    assert "2 failed, 1 passed" in done.stdout
    assert re.search(r"TCP101 error: hole \d+ is drilled more than once: at places", done.stdout)
    assert re.search(r"TCP102 error: hole \d+ is never drilled", done.stdout)
    assert re.search(r"test_genetic.py:\d+: AssertionError", done.stdout)


def test_the_fixed_solver_passes():
    done = pytest_on_examples("order")
    assert done.returncode == 0 and "3 passed" in done.stdout, done.stdout


@pytest.mark.parametrize(("crossover", "exit_code"), [("one-point", 1), ("order", 0)])
def test_answers_as_claims_are_audited_at_their_lines(tmp_path, crossover, exit_code):
    script = [sys.executable, str(CI / "write_claims.py"), crossover]
    text = subprocess.run(script, capture_output=True, text=True, check=True).stdout
    (tmp_path / "board.csv").write_text((CI / "board.csv").read_text())
    path = tmp_path / "answers.claims.toml"
    path.write_text(text)
    words = ["audit", str(path), "--format", "sarif", "--certificates", str(CI / "certificates")]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == exit_code
    results = json.loads(done.stdout)["runs"][0]["results"]
    errors = [r for r in results if r["level"] == "error"]
    assert bool(errors) == bool(exit_code)
    for result in errors:
        line = result["locations"][0]["physicalLocation"]["region"]["startLine"]
        assert text.splitlines()[line - 1].startswith(("sequence", "time"))


def test_the_plugin_is_an_entry_point_and_the_hook_runs():
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["entry-points"]["pytest11"] == {"tcp.pytest_plugin": "tcp.pytest_plugin"}
    hook = (ROOT / ".pre-commit-hooks.yaml").read_text()
    entry = re.search(r"entry: tcp (.*)", hook)[1].split()
    claims = [str(p) for p in (ROOT / "data" / "claims").glob("*.toml")]
    assert CliRunner().invoke(main, [*entry, *claims]).exit_code == 1


def test_without_a_workpiece_the_fixture_says_what_to_do():
    with pytest.raises(pytest.UsageError, match=r"pytest.mark.drill\('board.csv'\)"):
        DrillOracle(CI, None, 1.0).assert_valid("1 2 3")
    with pytest.raises(NoProofError, match="tcp oracle pin"):
        DrillOracle(CI, None, 1.0).on("board.csv", "case2").assert_optimal(range(13))


def test_which_tool_of_a_drill_file_is_judged_is_said_or_chosen(tmp_path):
    drill = tmp_path / "c.drl"
    drill.write_text("M48\nMETRIC,TZ\nT1C1\nT2C2\n%\nT1\nX1.0Y1.0\nX2.0Y2.0\nT2\nX3.0Y3.0\nM30\n")
    oracle = DrillOracle(tmp_path, None, 1.0)
    with pytest.warns(UserWarning, match=r"c\.drl: T1 drills most holes and is taken"):
        oracle.on("c.drl").assert_valid("1 2")
    oracle.on("c.drl", tool="T2").assert_valid("1")
    oracle.on("c.drl", tool="all").assert_valid("1 2 3")


@pytest.mark.parametrize(
    "words", [["validate", "--route", "1 2"], ["export", "--out", "c.mps"]], ids=lambda w: w[0]
)
def test_every_command_tells_what_readers_note(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    holes = "X1.0Y1.0\nX2.0Y2.0\nX5.0Y2.0\nX2.0Y9.0\n"
    Path("c.drl").write_text(f"M48\nMETRIC,TZ\nT1C1\nT2C2\n%\nT1\n{holes}T2\nX3.0Y3.0\nM30\n")
    done = CliRunner().invoke(main, [words[0], "c.drl", *words[1:]])
    assert "T1 drills most holes" in done.stderr


def test_optima_of_files_and_workpieces_in_memory():
    oracle = DrillOracle(CI, None, 1.0)
    piece = read(CI / "board.csv").workpiece
    assert oracle.optimum("board.csv") == oracle.optimum(piece) == 140
