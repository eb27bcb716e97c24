"""What the documents promise is there: commands, exit codes, the solver of CONTRIBUTING."""

from __future__ import annotations

import doctest
import re
import shlex
import sys
import textwrap
import tomllib
import types
from collections.abc import Iterator
from fractions import Fraction
from importlib import import_module
from pathlib import Path

import click
import pytest

from tcp import Instance, Model, __version__, solve
from tcp.boards.machine import read_machine
from tcp.cli.main import COMMANDS, main
from tcp.errors import Exit
from tcp.files import read
from tcp.solve import SOLVERS, Entry

ROOT = Path(__file__).resolve().parents[1]


def document(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def test_the_readme_opens_with_the_two_commands():
    assert re.match(r"# tcp\n\n(    make demo[^\n]*\n    make test[^\n]*\n)", document("README.md"))


def test_links_lead_somewhere():
    for page in (
        "README.md",
        "CONTRIBUTING.md",
        *(f"docs/{p.name}" for p in ROOT.glob("docs/*.md")),
    ):
        for target in re.findall(r"\]\((?!https?://|#)([^)#]+)", document(page)):
            assert (ROOT / page).parent.joinpath(target).exists(), (page, target)


@pytest.mark.parametrize("code", Exit, ids=str)
def test_every_exit_code_is_documented(code):
    assert re.search(rf"^\| {code.value} \| {code.name} \| \S", document("docs/cli.md"), re.M)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_documented(name):
    sections = re.split(r"^## ", document("docs/cli.md"), flags=re.M)
    assert any(section.startswith(f"tcp {name}\n") for section in sections)


def commands() -> Iterator[tuple[str, click.Command]]:
    """Every command, and those of a group, with the section that describes it."""
    for name in COMMANDS:
        command = main.get_command(click.Context(main), name)
        assert command is not None
        yield name, command
        if isinstance(command, click.Group):
            yield from ((name, member) for member in command.commands.values())


def test_every_option_is_documented():
    """In the section of its command, or in that of the problem, or of fleets, for all of them."""
    sections = re.split(r"^##+ ", document("docs/cli.md"), flags=re.M)
    common = "".join(s for s in sections if s.startswith(("The problem\n", "Fleets\n")))
    missing = []
    for name, command in commands():
        text = common + "".join(s for s in sections if s.startswith(f"tcp {name}\n"))
        options = (p for p in command.params if isinstance(p, click.Option))
        missing += [
            (name, option.opts[0])
            for option in options
            if not re.search(rf"(?<![\w-]){option.opts[0]}(?![\w-])", text)
        ]
    assert missing == []


def calls() -> Iterator[tuple[str, list[str]]]:
    """Every call of ``tcp`` that a page shows to be pasted."""
    for page in ("README.md", "docs/guide.md", "docs/oracle.md", "docs/cli.md"):
        for line in re.findall(r"^(?:    |.*run: |.*`)tcp ([a-z][^`#\n]*)", document(page), re.M):
            words = shlex.split(line)
            about_a_file = any(re.search(r"[\w*]\.\w", word) for word in words)
            if about_a_file and not re.search(r"[\[(|]|\b[A-Z]{4}", line):
                yield page, words


def test_the_calls_that_are_shown_fit_together():
    """They are parsed, not made: their options exist and take such values."""
    shown = list(calls())
    assert len({page for page, _ in shown}) == 4 and len(shown) > 15
    for page, (name, *words) in shown:
        command = main.get_command(click.Context(main), name)
        assert command is not None, (page, name)
        if isinstance(command, click.Group):
            command = command.commands[words.pop(0)]
        command.make_context(name, words)
        for file in re.findall(r"(?<!\S)(?:data|examples)/[\w./-]+", " ".join(words)):
            assert "optimized" in file or (ROOT / file).exists(), (page, file)


def test_the_machine_of_the_guide_is_one(tmp_path):
    profile = tmp_path / "machine.toml"
    profile.write_text(re.search(r"```toml\n(.*?)```", document("docs/guide.md"), re.S)[1])
    machine = read_machine(profile)
    assert machine.timed and machine.travel.model is Model.TRAPEZOIDAL


def test_the_citation_names_this_version():
    for page, pattern in (("CITATION.cff", "version: {}\n"), ("docs/guide.md", "= {{{}}}")):
        assert pattern.format(__version__) in document(page)


def test_the_layers_are_those_of_the_contract():
    contract = tomllib.loads(document("pyproject.toml"))["tool"]["importlinter"]["contracts"][0]
    block = document("docs/architecture.md").split("## The layers")[1].split("```")[1].split("\n")
    assert block[1:-1] == [layer.replace("tcp.", "") for layer in contract["layers"]]


def test_every_folder_has_its_paragraph():
    text = document("docs/architecture.md")
    for folder in (p.parent.name for p in (ROOT / "tcp").glob("*/__init__.py")):
        assert f"**`tcp/{folder}/`**" in text, folder


def test_the_readmes_python_works(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    code = re.search(r"```python\n(.*?)```", document("README.md"), re.S)
    exec(code[1], {})
    assert len(capsys.readouterr().out.split(",")) == 14


@pytest.mark.parametrize("name", ["tcp", "tcp.validate.claim"])
def test_the_examples_of_docstrings_work(name):
    failed, tried = doctest.testmod(import_module(name))
    assert tried and not failed


def test_the_solver_of_contributing_works(monkeypatch):
    code = re.search(r"```python\n(   \"\"\".*?)```", document("CONTRIBUTING.md"), re.S)
    module = types.ModuleType("nearest")
    exec(textwrap.dedent(code[1]), module.__dict__)
    monkeypatch.setitem(sys.modules, "nearest", module)
    monkeypatch.setitem(SOLVERS, "nearest", Entry("nearest", exact=False))
    result = solve(Instance(read(ROOT / "data" / "wp3.csv").workpiece), "nearest", starts=20)
    assert Fraction("1482.604") <= result.time < 2000 and result.trace
