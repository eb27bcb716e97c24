"""``tcp export``: the integer programme of a workpiece, for other solvers."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click

from tcp.cli.options import READ, Problem, problem_options
from tcp.cli.terminal import check_outputs, tell
from tcp.errors import Exit, InfeasibleError, UsageError
from tcp.files.write import write_file
from tcp.instance import Instance
from tcp.result import decimal
from tcp.solve import no_moves
from tcp.stop import Clock, Stop

NODES = 400
"""Most nodes of a model that is written: a third of a million variables with ``flow``."""

COMMENT = {".mps": "* ", ".lp": "\\ "}
"""What begins a comment in each format."""

EPILOG = """\b
Examples:
  tcp export --formulation mtz --out wp1.mps data/wp1.csv
  tcp export --formulation flow --travel case2 --out wp3.lp data/wp3.csv

The file begins with comments that say which node is which hole and what one
unit of the objective is worth. A subtour model holds the cuts that this
command needs to prove its optimum; if the time limit comes first, the file is
written all the same and the model is a relaxation (exit 5)."""


@click.command(epilog=EPILOG)
@click.argument("file", metavar="FILE", type=READ)
@problem_options
@click.option(
    "--formulation",
    type=click.Choice(["subtour", "mtz", "flow"]),
    default="mtz",
    show_default=True,
    help="Dantzig-Fulkerson-Johnson, Miller-Tucker-Zemlin, or single-commodity flow.",
)
@click.option("--out", required=True, type=click.Path(path_type=Path), help="FILE.mps or FILE.lp.")
@click.option("--time-limit", type=float, metavar="S", help="Seconds to look for subtour cuts.")
def command(
    problem: Problem, file: Path, formulation: str, out: Path, time_limit: float | None
) -> int:
    """Write the mixed-integer programme of the workpiece in FILE as MPS or LP."""
    check_outputs([(out, tuple(COMMENT))], [file])
    if out.suffix not in COMMENT:  # a device has no ending that tells the format
        raise UsageError(f"--out {out}: expected a name that ends in .mps or .lp")
    clock = Clock(Stop(time_limit))
    reading = problem.read(file)
    tell(file, reading.notes)
    instance = problem.instance(reading)
    text, complete = programme(instance, formulation, out.suffix, clock)
    write_file(out, text, like=(file,))
    click.echo(f"{out}: {formulation} model of {instance.name}")
    if not complete:
        click.echo("tcp: more subtour cuts are needed: the model is a relaxation", err=True)
    return Exit.OK if complete else Exit.NO_PROOF


def programme(instance: Instance, formulation: str, suffix: str, clock: Clock) -> tuple[str, bool]:
    """The model's text, and whether its optimum is the instance's.

    Raises
    ------
    UsageError
        If the instance is too small or too large for a model, or has rules about successive moves.
    InfeasibleError
        If the rules contradict each other.
    """
    from tcp.exact.milp import formulate
    from tcp.exact.tiny import impossible

    if instance.rules.sequential:
        raise UsageError(f"no {formulation} model of {instance.name}: {no_moves()}")
    size = instance.form.size
    if not 4 <= size <= NODES:
        raise UsageError(f"{instance.name} has {size} nodes; a model is written for 4 to {NODES}")
    contradiction = impossible(instance.form)
    if contradiction is not None:
        raise InfeasibleError(f"{instance.name} has no route: {contradiction}")
    model, complete = formulate(instance, formulation, clock)
    with tempfile.TemporaryDirectory(prefix="tcp-export-") as folder:
        path = Path(folder) / f"model{suffix}"
        if suffix == ".mps":
            model.problem.writeMPS(str(path))
        else:
            model.problem.writeLP(str(path))
        body = path.read_text()
    lines = [*header(instance, formulation), "" if complete else "a relaxation: cuts are missing"]
    return "".join(f"{COMMENT[suffix]}{line}\n" for line in lines if line) + body, complete


def header(instance: Instance, formulation: str) -> list[str]:
    """What a reader of the model has to know."""
    form, ids = instance.form, instance.workpiece.ids
    names = [f"hole {name}" for name in ids]
    names += ["home"] * (form.home >= 0)
    names += ["virtual: before the first and after the last node of the open route"] * (
        form.virtual >= 0
    )
    unit = decimal(instance.granularity * instance.quantum)
    return [
        f"{instance.name}, {formulation} formulation, {instance.travel.model} travel",
        f"instance {instance.sha256}",
        f"one unit of the objective is {unit} (seconds; mm at unit speed)",
        *(f"node {i}: {name}" for i, name in enumerate(names)),
    ]
