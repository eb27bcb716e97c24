"""The command line as a whole: help is quick, subcommands load lazily, errors are one sentence."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from tcp.cli.main import COMMANDS, guarded, main
from tcp.errors import Exit

ROOT = Path(__file__).resolve().parents[1]


def test_help_lists_every_command_without_loading_any():
    code = (
        "import sys; from tcp.cli.main import main\n"
        "try: main(['--help'])\n"
        "except SystemExit as done: assert not done.code\n"
        "heavy = {'numba', 'ortools', 'pulp', 'highspy', 'scipy', 'matplotlib', 'rich'}\n"
        "loaded = heavy & set(sys.modules); assert not loaded, loaded\n"
        "assert not any(m.startswith('tcp.cli.') and m != 'tcp.cli.main' for m in sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    for name in COMMANDS:
        assert f"\n  {name} " in done.stdout


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_explains_itself(name):
    done = CliRunner().invoke(main, [name, "--help"])
    assert done.exit_code == 0
    assert "Usage:" in done.output


def test_unknown_commands_and_options_are_usage_errors():
    for words in (["walk"], ["solve"], ["solve", "--fast", "x.csv"], ["--quick"]):
        done = CliRunner().invoke(main, words)
        assert done.exit_code == 2, words
        assert done.stderr.count("\n") == 1 and done.stderr.startswith("tcp: "), done.stderr


def test_a_bug_is_one_sentence_and_exit_70(monkeypatch):
    from tcp.cli import info

    def broken(*_: object) -> None:
        raise ZeroDivisionError("of all things")

    monkeypatch.setattr(info, "facts", broken)
    path = str(ROOT / "data" / "five.csv")
    done = CliRunner().invoke(main, ["info", path])
    assert done.exit_code == 70
    assert "Traceback" not in done.stderr and "ZeroDivisionError" in done.stderr
    done = CliRunner().invoke(main, ["--debug", "info", path], env={"TCP_DEBUG": ""})
    assert done.exit_code == 70 and "Traceback" in done.stderr


def test_ctrl_c_while_loading_and_missing_permission_are_no_bugs(capsys):
    def load() -> None:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt:
            raise ImportError("initialization failed") from None

    assert guarded(load) is Exit.INTERRUPTED
    assert capsys.readouterr().err == "tcp: interrupted before there was a result\n"

    def denied() -> None:
        raise PermissionError(13, "Permission denied", "x/y")

    assert guarded(denied) is Exit.OUTPUT
    assert capsys.readouterr().err == "tcp: cannot look at x/y: permission denied\n"

    def broken() -> None:
        raise ImportError("no such thing")

    assert guarded(broken) is Exit.INTERNAL


@pytest.mark.parametrize(
    ("encoding", "words", "said"),
    [
        ("latin-1:strict", ["info"], b"1 ... \\u6f22"),
        ("utf-8:strict", ["optimize", "--dry-run"], b"caf\\udce9.drl: 2 holes"),
    ],
)
def test_names_that_the_output_cannot_spell_are_no_bugs(tmp_path, encoding, words, said):
    (tmp_path / "a.csv").write_text("id,x,y\n1,0,0\n\u6f22,1,1\n")
    board = tmp_path / os.fsdecode(b"caf\xe9.drl")
    board.write_text("M48\nMETRIC,TZ\nT1C1\n%\nT1\nX1.0Y1.0\nX2.0Y2.0\nM30\n")
    done = subprocess.run(
        [sys.executable, "-m", "tcp", *words, tmp_path / "a.csv" if words == ["info"] else board],
        capture_output=True,
        env=os.environ | {"PYTHONIOENCODING": encoding},
        cwd=ROOT,
    )
    assert done.returncode == 0 and said in done.stdout, done.stderr


@pytest.mark.parametrize("name", ["board.drl", "board.ngc"])
def test_every_command_takes_the_flags_that_readers_ask_for(name, tmp_path):
    texts = {
        "board.drl": "M48\nMETRIC,TZ,000.000\nT1C1.0\n%\nT1\nX1.0Y1.0\nX2.0Y3.0\n",
        "board.ngc": "G21 G90\nT1 M6\nG81 X1 Y1 Z-1 R1\nX2 Y3\nG80\n",
    }
    board = tmp_path / name
    board.write_text(texts[name])
    refused = CliRunner().invoke(main, ["info", str(board)])
    assert refused.exit_code == 3 and "pass --unfinished" in refused.output
    for command in (["info"], ["solve"], ["bound"], ["validate", "--route", "1 2"]):
        done = CliRunner().invoke(main, [*command, "--unfinished", str(board)])
        assert done.exit_code == 0, (command, done.output)


def test_a_sidecar_is_named_to_any_command(tmp_path):
    board = tmp_path / "board.drl"
    board.write_text("M48\nT1C1.0\n%\nT1\nX010000Y010000\nX020000Y030000\nM30\n")
    sidecar = tmp_path / "other.txt"
    sidecar.write_text("INTEGER-PLACES 2\nDECIMAL-PLACES 4\nOUTPUT-UNITS ENGLISH\n")
    done = CliRunner().invoke(main, ["info", "--sidecar", str(sidecar), "--json", str(board)])
    assert done.exit_code == 0, (done.output, done.exception)
    assert json.loads(done.stdout)["x_mm"] == ["25.4", "50.8"]


def test_the_module_of_the_command_is_the_command():
    done = subprocess.run(
        [sys.executable, "-m", "tcp.cli.main", "solv"], capture_output=True, text=True, cwd=ROOT
    )
    assert done.returncode == 2 and "No such command" in done.stderr
