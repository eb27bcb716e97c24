"""Options that every command about a problem shares, and what they mean.

A command takes them with one decorator and receives one :class:`Problem`::

    @click.command()
    @problem_options
    def command(problem: Problem, ...):
        instance = problem.instance(problem.read(path))
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, fields
from fractions import Fraction
from pathlib import Path
from typing import Any

import click

from tcp.errors import InputError, UsageError
from tcp.files import Reading, read
from tcp.files.reading import travel_as
from tcp.fleet import BACKENDS
from tcp.instance import Ends, Instance
from tcp.rules import Balance, Rules
from tcp.travel import ALIASES, Model, Rounding, Travel, parse_model
from tcp.words import listed, shown
from tcp.workpiece import Workpiece, exact_decimal

LEGS = ("both", "out", "back")

READING: tuple[str, ...] = ("units", "tool", "format", "zeros", "sidecar", "unfinished")
"""Options that say what a file means, and nothing about the problem."""

READ = click.Path(path_type=Path, readable=False)
"""A file to read; that it may not be read is for its reader to say, with exit code 3."""


def number(text: str) -> Fraction:
    """A decimal number or a fraction such as 1/3, exactly; an option's type."""
    over, slash, under = text.partition("/")
    try:
        value = Fraction(exact_decimal(over))
        return value / Fraction(exact_decimal(under)) if slash else value
    except (InputError, ZeroDivisionError):
        raise click.BadParameter(f"{text!r} is not a number; expected e.g. 12.5") from None


def pair(text: str) -> tuple[str, str]:
    """Two ids with a comma between; an option's type."""
    first, _, second = (part.strip() for part in text.rpartition(","))
    if not first or not second:
        raise click.BadParameter(f"{text!r} is not two values with a comma between")
    return first, second


def point(text: str) -> tuple[Fraction, Fraction]:
    """A position X,Y; an option's type."""
    x, y = pair(text)
    return number(x), number(y)


def balance(text: str) -> Balance:
    """An axis balance rule ``W,LOW,HIGH[,MOST]``; an option's type."""
    parts = [part.strip() for part in text.split(",")]
    try:
        window, *most = (int(part) for part in (parts[0], *parts[3:4]))
    except ValueError:
        window, most = 0, []
    if len(parts) not in (3, 4) or window < 1:
        raise click.BadParameter(f"{text!r} is not W,LOW,HIGH[,MOST]; expected e.g. 10,0.5,2")
    return Balance(window, number(parts[1]), number(parts[2]), *most)


def setting(text: str) -> tuple[str, Any]:
    """``key=value`` with the value as int, float, bool or text.

    Raises
    ------
    UsageError
        If there is no ``=``.
    """
    key, equals, value = (part.strip() for part in text.partition("="))
    if not key or not equals:
        raise UsageError(f"--set {text!r}; expected KEY=VALUE")
    key = key.replace("-", "_")
    for kind in (int, float):
        try:
            return key, kind(value)
        except ValueError:
            continue
    return key, {"true": True, "false": False}.get(value.lower(), value)


@dataclass(frozen=True)
class Problem:
    """The problem options of one call, each None (or empty) where it was not given."""

    travel: str | None = None
    vx: Fraction | None = None
    vy: Fraction | None = None
    ax: Fraction | None = None
    ay: Fraction | None = None
    axes: str | None = None
    quantum: Fraction | None = None
    rounding: str | None = None
    start: str | None = None
    end: str | None = None
    home: tuple[Fraction, Fraction] | None = None
    legs: str | None = None
    closed: bool = False
    min_jump: Fraction | None = None
    jump_diameters: Fraction | None = None
    balance: Balance | None = None
    axis_run: int | None = None
    forbid: tuple[tuple[str, str], ...] = ()
    units: str | None = None
    tool: str | None = None
    format: str | None = None
    zeros: str | None = None
    sidecar: Path | None = None
    unfinished: bool = False

    def read(self, path: str | Path) -> Reading:
        """Read a workpiece file, with what was said about its numbers and tools."""
        return read(
            path,
            units=self.units,
            tool=self.tool,
            format=self.format,
            zeros=self.zeros,
            sidecar=self.sidecar,
            unfinished=self.unfinished or None,
        )

    @property
    def asks(self) -> bool:
        """Whether any option says more than how to read a file."""
        return any(
            getattr(self, option.name) != option.default
            for option in fields(self)
            if option.name not in READING
        )

    def instance(self, reading: Reading) -> Instance:
        """The instance that the options make of a file.

        Raises
        ------
        UsageError
            If options contradict each other or name holes that are not there.
        """
        piece = reading.workpiece
        return Instance(
            piece, self.travel_of(reading.travel), self.ends_of(piece), self.rules_of(piece)
        )

    def travel_of(self, own: Travel | None) -> Travel:
        """The travel model: as asked for, else the file's own, else sequential."""
        model = None if self.travel is None else parse_model(self.travel)
        given = {
            name: getattr(self, name)
            for name in ("vx", "vy", "ax", "ay", "quantum")
            if getattr(self, name) is not None
        }
        if self.axes is not None:
            given["axes"] = Model(self.axes)
        if self.rounding is not None:
            given["rounding"] = Rounding(self.rounding)
        travel = travel_as(own, model, **given)
        if travel.model is not Model.TRAPEZOIDAL and given.keys() & {"ax", "ay", "axes"}:
            raise UsageError(
                "--ax, --ay and --axes are for trapezoidal travel; give --travel trapezoidal"
            )
        return travel

    def ends_of(self, workpiece: Workpiece) -> Ends:
        """The ends, holes looked up by id."""
        if self.legs is not None and self.home is None:
            raise UsageError("--legs says which moves from and to home count; give --home X,Y too")
        legs = self.legs or "both"
        return Ends(
            start=hole_index(workpiece, self.start, "--start"),
            end=hole_index(workpiece, self.end, "--end"),
            home=self.home,
            outward=self.home is not None and legs in ("both", "out"),
            back=self.home is not None and legs in ("both", "back"),
            closed=self.closed,
        )

    def rules_of(self, workpiece: Workpiece) -> Rules:
        """The process rules, holes looked up by id."""
        if self.jump_diameters is not None and not any(workpiece.diameters):
            raise UsageError(f"{workpiece.name} states no diameters; --jump-diameters needs them")
        forbidden = []
        for first, second in self.forbid:
            i = hole_index(workpiece, first, "--forbid")
            j = hole_index(workpiece, second, "--forbid")
            assert i is not None and j is not None
            forbidden.append((i, j))
        return Rules(
            forbidden=tuple(forbidden),
            min_jump=self.min_jump,
            jump_diameters=self.jump_diameters,
            balance=self.balance,
            axis_run=self.axis_run,
        )


def hole_index(workpiece: Workpiece, name: str | None, option: str) -> int | None:
    """Position of the hole that an option names by its id.

    Raises
    ------
    UsageError
        If there is no such hole.
    """
    if name is None:
        return None
    if name not in workpiece.index:
        ids = workpiece.ids
        some = listed(ids[:3]) + (f" ... {listed(ids[-1:])}" if len(ids) > 3 else "")
        raise UsageError(
            f"{option}: {workpiece.name} has no hole {shown(name)}; its ids are {some}"
        )
    return workpiece.index[name]


def problem_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command all problem options, passed to it as one ``problem``."""
    names = [f.name for f in fields(Problem)]

    @functools.wraps(function)
    def wrapped(*args: Any, **given: Any) -> Any:
        problem = Problem(**{name: given.pop(name) for name in names})
        return function(*args, problem=problem, **given)

    for option in reversed(_OPTIONS):
        wrapped = option(wrapped)
    return wrapped


def fleet_options(default: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a command ``jobs``, ``backend``, ``scheduler``; ``default`` is what no jobs mean."""
    options = (
        click.option(
            "--jobs", type=click.IntRange(min=1), metavar="N",
            help=f"Processes.  [default: {default}; all of a cluster]",
        ),
        click.option(
            "--backend", type=click.Choice(BACKENDS), default=BACKENDS[0], show_default=True,
            help="Processes of this machine, or an existing Dask or Ray cluster.",
        ),
        click.option("--scheduler", metavar="HOST:PORT", help="Where the cluster's scheduler is."),
    )  # fmt: skip

    def give(function: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed(options):
            function = option(function)
        return function

    return give


_OPTIONS = [
    click.option(
        "--travel",
        metavar="MODEL",
        help="How the machine moves: "
        + ", ".join(Model)
        + f" ({', '.join(f'{a} = {m}' for a, m in ALIASES.items())}). "
        "Default: the file's own, else sequential.",
    ),
    click.option("--vx", type=number, help="Speed of the x axis in mm/s.  [default: 1]"),
    click.option("--vy", type=number, help="Speed of the y axis in mm/s.  [default: 1]"),
    click.option("--ax", type=number, help="Acceleration of the x axis in mm/s² (trapezoidal)."),
    click.option("--ay", type=number, help="Acceleration of the y axis in mm/s² (trapezoidal)."),
    click.option(
        "--axes",
        type=click.Choice([str(Model.SEQUENTIAL), str(Model.SIMULTANEOUS)]),
        help="Trapezoidal: axes one after the other, or at once (default).",
    ),
    click.option(
        "--quantum",
        type=number,
        help="Round costs to multiples of this; sequential and simultaneous are exact without.",
    ),
    click.option(
        "--rounding",
        type=click.Choice([str(r) for r in Rounding]),
        help="How to round to the quantum: nearest (default), or up.",
    ),
    click.option("--start", metavar="ID", help="Hole that must come first."),
    click.option("--end", metavar="ID", help="Hole that must come last."),
    click.option("--home", type=point, metavar="X,Y", help="Home position in mm."),
    click.option(
        "--legs",
        type=click.Choice(LEGS),
        help="Which moves from and to home count.  [default: both]",
    ),
    click.option("--closed", is_flag=True, help="Return from the last hole to the first."),
    click.option(
        "--min-jump", type=number, metavar="MM", help="Forbid moves shorter than this distance."
    ),
    click.option(
        "--jump-diameters",
        type=number,
        metavar="K",
        help="Forbid moves shorter than K times the larger hole's diameter.",
    ),
    click.option(
        "--axis-run",
        type=click.IntRange(min=1),
        metavar="N",
        help="Most successive moves along one axis.",
    ),
    click.option(
        "--balance",
        type=balance,
        metavar="W,LOW,HIGH[,MOST]",
        help="Axis balance: LOW <= sum|dx| / sum|dy| <= HIGH over each W moves; count the windows "
        "that are not, or allow at most MOST.",
    ),
    click.option(
        "--forbid",
        type=pair,
        metavar="ID,ID",
        multiple=True,
        help="Two holes that must not follow each other; may be repeated.",
    ),
    click.option(
        "--units",
        type=click.Choice(["mm", "inch"]),
        help="Unit of the file's coordinates, where it does not say.  [default: mm; none for drill "
        "files, G-code and DXF]",
    ),
    click.option(
        "--tool",
        metavar="T",
        help="Drill files: the tool whose holes to take, or all.  [default: the busiest]",
    ),
    click.option(
        "--format",
        metavar="N:M",
        help="Drill files: digits before and behind the point that is left out, e.g. 2:4.",
    ),
    click.option(
        "--zeros",
        type=click.Choice(["lz", "tz"]),
        help="Drill files: keep leading (lz) or trailing (tz) zeros.",
    ),
    click.option(
        "--sidecar", type=click.Path(path_type=Path), help="Drill files: the nc_param.txt."
    ),
    click.option(
        "--unfinished", is_flag=True, help="Drill files and G-code: accept one that just ends."
    ),
]
