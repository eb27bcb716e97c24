"""``tcp validate``: what is true of a route and its claimed time."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import click

from tcp.cli.judging import Judging, judging_options
from tcp.cli.options import READ, Problem, problem_options
from tcp.cli.terminal import tell
from tcp.errors import UsageError
from tcp.files.order import NUMBERINGS, Order, order_of, read_order
from tcp.files.printed import parse_printed
from tcp.instance import Instance
from tcp.validate.auditing import Audit, single
from tcp.validate.known import Known
from tcp.workpiece import exact_decimal

EPILOG = """\b
Examples:
  tcp validate data/wp3.csv --route "2 39 40 41 ..." --claimed 1460.216 --travel case1
  tcp validate board.csv --route-file solver-output.json --numbering 0 --repair
  tcp validate board.csv --column order --report sarif --out findings.sarif

\b
Exit codes: 0 all hold, 1 findings of severity error (with --strict also
warnings), 2 usage, 3 unreadable or invalid input, 70 internal error."""


@click.command(epilog=EPILOG)
@click.argument("file", type=READ)
@click.option("--route", metavar="TEXT", help="The sequence; any separators.")
@click.option(
    "--route-file",
    type=click.Path(path_type=Path),
    help="The sequence in a file: text, CSV, JSON, TSPLIB tour.",
)
@click.option("--column", metavar="NAME", help="Column of FILE with each hole's place.")
@click.option(
    "--numbering",
    type=click.Choice(NUMBERINGS),
    default="ids",
    show_default=True,
    help="Entries are hole ids, or numbers counted from 0 or 1.",
)
@click.option("--claimed", metavar="TIME", help="The claimed time, with the digits as printed.")
@click.option("--optimal", is_flag=True, help="The claim calls the route optimal.")
@click.option("--optimum", metavar="TIME", help="A known optimum, instead of a certificate.")
@click.option("--lower-bound", metavar="TIME", help="A known lower bound, likewise.")
@click.option("--repair", "mend", is_flag=True, help="Repair a sequence that is no route.")
@problem_options
@judging_options("--report")
def command(
    problem: Problem,
    judging: Judging,
    file: Path,
    route: str | None,
    route_file: Path | None,
    column: str | None,
    numbering: str,
    claimed: str | None,
    optimal: bool,
    optimum: str | None,
    lower_bound: str | None,
    mend: bool,
) -> int:
    """Judge a route of the workpiece in FILE: valid, its time, its distance from optimal."""
    if sum(v is not None for v in (route, route_file, column)) != 1:
        raise UsageError("give the sequence by one of --route, --route-file and --column")
    judging.check_out(file, route_file)
    reading = problem.read(file)
    tell(file, reading.notes)
    instance = problem.instance(reading)
    piece = instance.workpiece
    order: Order
    if route is not None:
        order = order_of(route, piece, numbering)
    elif route_file is not None:
        order = read_order(route_file, piece, numbering)
    else:
        order = read_order(file, piece, numbering, column=column)
    known = _given(instance, optimum, lower_bound)
    if known is None:
        known = judging.knowledge(file).known(instance)
    entry = single(
        instance,
        order,
        claimed=None if claimed is None else parse_printed(claimed),
        known=known,
        optimal=optimal,
        mend=mend,
        ignore=judging.codes(),
    )
    return judging.report(Audit((entry,)), [file] if route_file is None else [file, route_file])


def _given(instance: Instance, optimum: str | None, lower: str | None) -> Known | None:
    """A bound that the user states, in whole quanta."""
    if optimum is not None and lower is not None:
        raise UsageError("give --optimum or --lower-bound, not both")
    stated = optimum if optimum is not None else lower
    if stated is None:
        return None
    cost = Fraction(exact_decimal(stated)) / instance.quantum
    if optimum is not None and cost.denominator != 1:
        raise UsageError(f"--optimum {stated} is no multiple of the quantum {instance.quantum}")
    whole = -(-cost.numerator // cost.denominator)
    return Known(whole, whole if optimum is not None else None, certified=False)
