"""``tcp pareto``: every best compromise between travel time and axis balance, proved."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from itertools import count
from pathlib import Path
from typing import Any

import click

from tcp.cli.options import READ, Problem, number, problem_options
from tcp.cli.terminal import status_line, tell
from tcp.errors import Exit, ProofError, UsageError
from tcp.exact.pareto import Point, front, weighted
from tcp.instance import Instance
from tcp.result import decimal
from tcp.rules import Balance
from tcp.solve import interruptible
from tcp.stop import Clock, Stop

EPILOG = """\b
Examples:
  tcp pareto data/wp1.csv --balance 4,0.5,2
  tcp pareto data/wp2.csv --balance 4,0.5,2 --weight 5 --json

\b
Exit codes: 0 done, 2 usage, 3 unreadable or invalid input, 4 no route keeps the
rules, 5 not complete within the time limit, 70 internal error, 130 interrupted."""


@click.command(epilog=EPILOG)
@click.argument("file", metavar="FILE", type=READ)
@problem_options
@click.option("--weight", type=number, help="Also name the best of travel + WEIGHT x windows.")
@click.option("--time-limit", type=float, metavar="S", help="Seconds of wall time.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of CP-SAT.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object.")
def command(
    problem: Problem,
    file: Path,
    weight: Fraction | None,
    time_limit: float | None,
    seed: int,
    as_json: bool,
) -> int:
    """Prove the whole Pareto front of travel time against unbalanced windows of moves.

    Without --balance, the BMGA paper's rule holds: 10 moves, ratio 0.5 to 2.
    """
    reading = problem.read(file)
    tell(file, reading.notes)
    instance = problem.instance(reading)
    if instance.rules.balance is None:
        instance = replace(instance, rules=replace(instance.rules, balance=Balance()))
    price = None if weight is None else _price(instance, weight)
    points = _prove(instance, Clock(Stop(time=time_limit)), seed)
    chosen = None if price is None or not points else weighted(points, price)
    click.echo(_json(instance, points, chosen) if as_json else _table(instance, points, chosen))
    return Exit.OK if points else Exit.INFEASIBLE


def _prove(instance: Instance, clock: Clock, seed: int) -> tuple[Point, ...]:
    """The front; on a terminal with a counter. Ctrl-C ends it in an orderly way."""
    try:
        with interruptible(clock), status_line(instance.name) as say:
            number = count(1)
            return front(
                instance, clock=clock, told=lambda _: say(f"{next(number)} proved"), seed=seed
            )
    except ProofError:
        if clock.interrupted:
            raise KeyboardInterrupt from None
        raise


def _price(instance: Instance, weight: Fraction) -> int:
    """The weight, given in the unit of travel, in quanta."""
    price = weight / instance.quantum
    if price < 0 or price.denominator != 1:
        unit = decimal(instance.quantum)
        raise UsageError(f"--weight must be a multiple of {unit} from 0 on, not {decimal(weight)}")
    return int(price)


def _rows(instance: Instance, points: tuple[Point, ...]) -> list[dict[str, Any]]:
    ids = instance.workpiece.ids
    return [
        {
            "time": decimal(p.cost * instance.quantum),
            "unbalanced": p.penalty,
            "route": [ids[h] for h in p.route],
        }
        for p in points
    ]


def _json(instance: Instance, points: tuple[Point, ...], chosen: Point | None) -> str:
    data: dict[str, Any] = {"instance": instance.describe(), "front": _rows(instance, points)}
    if chosen is not None:
        data["weighted"] = _rows(instance, (chosen,))[0]
    return json.dumps(data)


def _table(instance: Instance, points: tuple[Point, ...], chosen: Point | None) -> str:
    if not points:
        return f"{instance.name}: no route keeps the rules"
    lines = [f"{instance.name}: {len(points)} proved point(s)", "      time  unbalanced  route"]
    for point, row in zip(points, _rows(instance, points), strict=True):
        mark = "  <- least weighted sum" if point is chosen else ""
        lines.append(f"{row['time']:>10}  {row['unbalanced']:>10}  {' '.join(row['route'])}{mark}")
    return "\n".join(lines)
