"""What an experiment file says: columns of a published table, each a repeated solver run.

The format (TOML) is described in ``docs/experiments.md``.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

from tcp.errors import InputError, UsageError
from tcp.files import read, toml
from tcp.files.reading import travel_as
from tcp.instance import Ends, Instance, Rules
from tcp.solve import SOLVERS, check_options, defaults
from tcp.travel import parse_model
from tcp.workpiece import exact_decimal

ROWS = {
    "sequence": "Optimal sequence",
    "population": "Population number",
    "success": "Runs that reached the optimum",
    "least_iterations": "The least iteration number during global convergence",
    "average_iterations": "The average iteration number during global convergence",
    "most_iterations": "The most iteration number during global convergence",
    "average_last": "The average iteration of a run's last improvement",
    "least_searched": "The least number of solutions searched",
    "average_searched": "The average number of solutions searched",
    "least_ratio": "The least search ratio",
    "average_ratio": "The average search ratio",
    "least_time": "The least time required",
    "average_time": "The average time required",
    "most_time": "The most time required",
    "least_error": "Percentage error for the least time required",
    "average_error": "Percentage error for average time required",
    "most_error": "Percentage error for most time required",
    "average_fitness": "Average fitness",
    "length": "Length of optimal path",
    "optimal_time": "The optimal time required",
}
"""Rows of the papers' tables by the key an experiment file uses, in the papers' words."""

MOST = 1_000_000
"""Largest number of runs, and largest first seed."""

TOP = {"title", "source", "notes", "runs", "seed", "rows", "column"}
COLUMN = {"name", "workpiece", "travel", "start", "end", "home", "legs", "closed", "min_jump"}
COLUMN |= {"solver", "options", "published"}


@dataclass(frozen=True)
class Column:
    """One column of a table: what the paper printed, and the runs that we set beside it.

    Parameters
    ----------
    name : str
        The column's head.
    instance : Instance
        What is solved.
    solver : str
        Name of the solver, empty for a column that is only quoted.
    options : mapping
        The solver's options.
    published : mapping from row key to text
        The paper's figures as printed.
    certificates : path, optional
        Folder in which a certificate of the optimum may stand.
    """

    name: str
    instance: Instance
    solver: str
    options: Mapping[str, Any] = field(default_factory=dict)
    published: Mapping[str, str] = field(default_factory=dict)
    certificates: Path | None = None

    def key(self, seed: int) -> str:
        """What a run depends on, as a hash: a stored run with this key need not be made again.

        The solver's defaults are part of it: where one changes, old runs do not count.
        """
        options = defaults(self.solver) | dict(self.options)
        data = [self.instance.sha256, self.solver, sorted(options.items()), seed]
        return hashlib.sha256(json.dumps(data).encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Experiment:
    """One experiment file.

    Parameters
    ----------
    path : path
        The file.
    title, source, notes : str
        Head line, citation of the table, remarks printed below it.
    runs, seed : int
        Runs of each column, and the seed of the first; run k has seed ``seed + k``.
    rows : tuple of str
        Keys of :data:`ROWS` in the paper's order.
    columns : tuple of Column
        The table's columns.
    """

    path: Path
    title: str
    source: str
    notes: str
    runs: int
    seed: int
    rows: tuple[str, ...]
    columns: tuple[Column, ...]


def load(path: str | Path) -> Experiment:
    """Read an experiment file.

    Raises
    ------
    InputError
        If it cannot be read or does not follow the format, or if travel, ends,
        workpiece, solver and options of a column do not fit together.
    """
    path = Path(path)
    data = toml.parse(toml.read_text(path, "experiment file"), path)
    _only(data, TOP, "the experiment", path)
    rows = _texts(data, "rows", path)
    for row in rows:
        if row not in ROWS:
            raise InputError(f"unknown row {row!r}; expected one of {', '.join(ROWS)}", path)
    _once(rows, "row", path)
    columns = data.get("column")
    if not isinstance(columns, list) or not columns:
        raise InputError("an experiment needs at least one [[column]]", path)
    _once((c.get("name") for c in columns if isinstance(c, dict)), "column", path)
    return Experiment(
        path=path,
        title=_line(data, "title", path),
        source=_text(data, "source", path, ""),
        notes=_text(data, "notes", path, ""),
        runs=_whole(data, "runs", path, 1),
        seed=_whole(data, "seed", path, 0),
        rows=rows,
        columns=tuple(_column(c, rows, path) for c in columns),
    )


def _column(data: Any, rows: tuple[str, ...], path: Path) -> Column:
    if not isinstance(data, dict):
        raise InputError("a [[column]] must be a table", path)
    name = _line(data, "name", path)
    _only(data, COLUMN, f"column {name!r}", path)
    published = _table(data, "published", name, path)
    _only(published, set(rows), f"what is published in column {name!r}", path)
    for key, value in published.items():
        if not _printable(value):
            raise InputError(f"{key} of column {name!r} must be one line or a number", path)
    solver, options = _text(data, "solver", path, ""), _table(data, "options", name, path)
    if not solver and (options or not published):
        raise InputError(f"column {name!r} needs a solver, or only what is published", path)
    if solver and solver not in SOLVERS:
        expected = ", ".join(SOLVERS)
        raise InputError(f"column {name!r}: unknown solver {solver!r}; one of {expected}", path)
    try:
        if solver:
            check_options(solver, options)
        instance = _instance(data, path)
    except UsageError as error:
        raise InputError(f"column {name!r}: {error}", path) from None
    return Column(
        name=name,
        instance=instance,
        solver=solver,
        options=options,
        published={key: str(value) for key, value in published.items()},
        certificates=(path.parent / _text(data, "workpiece", path)).parent / "certificates",
    )


def _instance(data: Mapping[str, Any], path: Path) -> Instance:
    reading = read(path.parent / _text(data, "workpiece", path))
    piece = reading.workpiece
    index = piece.index

    def hole(key: str) -> int | None:
        if key not in data:
            return None
        if str(data[key]) not in index:
            raise InputError(f"{key} = {data[key]!r} names no hole of {piece.name}", path)
        return index[str(data[key])]

    home = _home(data, path)
    if "legs" in data and home is None:
        raise InputError("legs needs home", path)
    legs = data.get("legs", "both") if home else ""
    if legs not in ("both", "out", "back", ""):
        raise InputError(f"legs = {legs!r}; expected both, out or back", path)
    named = _text(data, "travel", path, "")
    closed = data.get("closed", False)
    if not isinstance(closed, bool):
        raise InputError(f"closed = {closed!r}; expected true or false", path)
    return Instance(
        piece,
        travel_as(reading.travel, parse_model(named) if named else None),
        Ends(
            start=hole("start"),
            end=hole("end"),
            home=home,
            outward=legs in ("both", "out"),
            back=legs in ("both", "back"),
            closed=closed,
        ),
        Rules(min_jump=_jump(data, path)),
    )


def _jump(data: Mapping[str, Any], path: Path) -> Fraction | None:
    if "min_jump" not in data:
        return None
    try:
        jump = Fraction(exact_decimal(str(data["min_jump"])))
    except InputError:
        jump = Fraction(-1)
    if jump < 0:
        raise InputError(f"min_jump = {data['min_jump']!r}; expected mm from 0 on", path)
    return jump


def _home(data: Mapping[str, Any], path: Path) -> tuple[Fraction, Fraction] | None:
    if "home" not in data:
        return None
    home = data["home"]
    try:
        if not isinstance(home, list):
            raise ValueError
        x, y = (Fraction(exact_decimal(str(v))) for v in home)
    except (ValueError, InputError):
        raise InputError(f"home = {home!r}; expected [X, Y] in mm", path) from None
    return x, y


def _printable(value: Any) -> bool:
    """Whether a published figure is one line of text, or a number."""
    if isinstance(value, str):
        return len(value.splitlines()) < 2
    return not isinstance(value, bool) and isinstance(value, int | float) and math.isfinite(value)


def _once(names: Iterable[Any], what: str, path: Path) -> None:
    """Refuse a name that is there twice."""
    seen: list[Any] = []
    for name in names:
        if name in seen:
            raise InputError(f"the {what} {name!r} is there twice", path)
        seen.append(name)


def _only(data: Mapping[str, Any], known: set[str], where: str, path: Path) -> None:
    unknown = sorted(set(data) - known)
    if unknown:
        expected = ", ".join(sorted(known))
        raise InputError(f"{where} has no key {unknown[0]!r}; expected {expected}", path)


def _table(data: Mapping[str, Any], key: str, name: str, path: Path) -> dict[str, Any]:
    value = data.get(key, {})
    if not isinstance(value, dict):
        raise InputError(f"{key} of column {name!r} must be a table", path)
    return value


def _text(data: Mapping[str, Any], key: str, path: Path, default: str | None = None) -> str:
    value = data.get(key, default)
    if not isinstance(value, str):
        raise InputError(f"{key} must be a text", path)
    return value


def _line(data: Mapping[str, Any], key: str, path: Path) -> str:
    value = _text(data, key, path)
    if not value.strip() or value.splitlines() != [value]:
        raise InputError(f"{key} must be a text of one line, not {value!r:.40}", path)
    return value


def _texts(data: Mapping[str, Any], key: str, path: Path) -> tuple[str, ...]:
    value = data.get(key)
    if not isinstance(value, list) or not value or not all(isinstance(v, str) for v in value):
        raise InputError(f"{key} must be a list of texts", path)
    return tuple(value)


def _whole(data: Mapping[str, Any], key: str, path: Path, least: int) -> int:
    value = data.get(key, least)
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= MOST:
        raise InputError(f"{key} must be a whole number from {least} to {MOST:,}", path)
    return value
