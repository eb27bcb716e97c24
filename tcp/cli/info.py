"""``tcp info``: what is in a file."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import click

from tcp.cli.main import complain
from tcp.cli.options import READ, Problem, problem_options
from tcp.errors import Exit, TcpError
from tcp.files import Reading
from tcp.instance import Instance
from tcp.report.table import describe
from tcp.result import decimal
from tcp.words import counted, plain

EPILOG = """\b
Examples:
  tcp info data/wp3.csv
  tcp info --json --travel case2 boards/*.csv"""


@click.command(epilog=EPILOG)
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=READ)
@problem_options
@click.option("--json", "as_json", is_flag=True, help="One JSON object a file, on one line.")
def command(problem: Problem, files: tuple[Path, ...], as_json: bool) -> int:
    """Describe the workpiece in each FILE and the problem that the options make of it."""
    worst = Exit.OK
    for path in files:
        try:
            reading = problem.read(path)
            data = facts(reading, problem.instance(reading))
        except TcpError as error:
            worst = max(worst, complain(error))
            continue
        click.echo(json.dumps(data) if as_json else _table(data))
    return worst


def facts(reading: Reading, instance: Instance) -> dict[str, Any]:
    """Everything worth knowing about a file, as plain data; lengths in mm."""
    piece = reading.workpiece
    corners = [(int(v.min()) * piece.step, int(v.max()) * piece.step) for v in (piece.x, piece.y)]
    return {
        "name": piece.name,
        "holes": len(piece),
        "ids": [piece.ids[0], piece.ids[-1]],
        "x_mm": [decimal(v) for v in corners[0]],
        "y_mm": [decimal(v) for v in corners[1]],
        "step_mm": decimal(piece.step),
        "diameters_mm": _counted(decimal(d) if d is not None else "none" for d in piece.diameters),
        "tools": _counted(t if t is not None else "none" for t in piece.tools),
        "coincident": len(piece.coincident),
        "problem": describe(instance),
        "quantum": decimal(instance.quantum),
        "granularity": instance.granularity,
        "file_order": decimal(instance.cost(range(len(piece))) * instance.quantum),
        "workpiece_sha256": piece.sha256,
        "instance_sha256": instance.sha256,
        "notes": list(reading.notes),
    }


def _counted(values: Any) -> dict[str, int]:
    """How often each value comes, 2 before 10 and T2 before T10."""
    return dict(sorted(Counter(values).items(), key=lambda one: (len(one[0].split(".")[0]), one)))


def _table(data: dict[str, Any]) -> str:
    lines = [plain(f"{data['name']}: {data['problem']}")]
    for key, value in data.items():
        if key in ("name", "problem") or value in ([], {}):
            continue
        if isinstance(value, dict):
            value = ", ".join(f"{k} ({counted(n, 'hole')})" for k, n in value.items())
        if isinstance(value, list):
            value = (" ... " if key != "notes" else "; ").join(value)
        lines.append(plain(f"  {key.replace('_', ' '):<17} {value}"))
    return "\n".join(lines)
