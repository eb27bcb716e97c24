"""``tcp export``: what it writes is read and solved by a solver that knows nothing of us."""

from __future__ import annotations

from pathlib import Path

import highspy
import pytest
from click.testing import CliRunner

from tcp.cli.main import main
from tcp.errors import Exit

DATA = Path(__file__).resolve().parents[1] / "data"


def export(*arguments: object):
    return CliRunner().invoke(main, ["export", *map(str, arguments)])


def optimum(path: Path) -> float:
    solver = highspy.Highs()
    solver.setOptionValue("output_flag", False)
    assert solver.readModel(str(path)) == highspy.HighsStatus.kOk
    solver.run()
    assert solver.getModelStatus() == highspy.HighsModelStatus.kOptimal
    return solver.getInfo().objective_function_value


@pytest.mark.parametrize("formulation", ["subtour", "mtz", "flow"])
@pytest.mark.parametrize("suffix", ["mps", "lp"])
def test_an_exported_model_has_the_instance_s_optimum(tmp_path, formulation, suffix):
    out = tmp_path / f"wp1.{suffix}"
    done = export("--formulation", formulation, "--out", out, DATA / "wp1.csv")
    assert done.exit_code == 0, done.output
    text = out.read_text()
    unit = float(text.partition("one unit of the objective is ")[2].split()[0])
    assert optimum(out) * unit == pytest.approx(322.5)
    assert "node 0: hole 1" in text and "node 9: virtual" in text


def test_ends_are_part_of_the_model(tmp_path):
    out = tmp_path / "fa14.lp"
    done = export(
        "--home", "0,0", "--start", "3", "--travel", "case2", "--out", out, DATA / "wp1.csv"
    )
    assert done.exit_code == 0, done.output
    text = out.read_text()
    assert "node 9: home" in text and "virtual" not in text and "forced_2_9" in text


def test_an_unfinished_subtour_model_says_so(tmp_path):
    out = tmp_path / "wp3.mps"
    arguments = ["--formulation", "subtour", "--time-limit", 0, "--out", out, DATA / "wp3.csv"]
    done = export(*arguments)
    assert done.exit_code == Exit.NO_PROOF
    assert "a relaxation" in out.read_text()


def test_what_cannot_be_written_is_refused(tmp_path):
    assert export("--out", tmp_path / "model.txt", DATA / "wp1.csv").exit_code == Exit.USAGE
    assert export("--out", tmp_path / "no" / "m.lp", DATA / "wp1.csv").exit_code == Exit.OUTPUT
    small = tmp_path / "two.csv"
    small.write_text("x,y\n0,0\n1,0\n")
    assert export("--out", tmp_path / "m.lp", small).exit_code == Exit.USAGE
    assert not (tmp_path / "m.lp").exists()
    far = ["--min-jump", 1000, "--out", tmp_path / "m.lp", DATA / "wp1.csv"]
    assert export(*far).exit_code == Exit.INFEASIBLE


@pytest.mark.parametrize("rule", [("--axis-run", 2), ("--balance", "2,0.5,2,0")])
def test_rules_about_moves_are_not_left_out_of_a_model(tmp_path, rule):
    out = tmp_path / "wp1.lp"
    done = export("--out", out, *rule, DATA / "wp1.csv")
    assert done.exit_code == Exit.USAGE and "rules about successive moves" in done.output
    assert not out.exists()
    counted = export("--out", out, "--balance", "2,0.5,2", DATA / "wp1.csv")
    assert counted.exit_code == 0, counted.output
