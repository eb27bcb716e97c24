"""Machine profiles: how a machine moves, and what a tool change and a hole cost it."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

from tcp.errors import InputError, TcpError, UsageError
from tcp.files import toml
from tcp.travel import Model, Rounding, Travel, parse_model
from tcp.workpiece import exact_decimal

KEYS = {"name", "note", "tool_change", "drill", "travel"}
TRAVEL_KEYS = {"model", "vx", "vy", "ax", "ay", "axes", "quantum", "rounding"}


@dataclass(frozen=True)
class Machine:
    """A drill machine.

    Parameters
    ----------
    travel : Travel
        How long a move takes; at the default unit speed, its length in mm.
    tool_change, drill : Fraction
        Seconds to change a tool, and to drill one hole.
    name : str
        Shown in reports.
    timed : bool
        Whether the speeds are a machine's, so that costs are seconds.
    """

    travel: Travel = field(default_factory=lambda: Travel(Model.SIMULTANEOUS))
    tool_change: Fraction = Fraction(0)
    drill: Fraction = Fraction(0)
    name: str = ""
    timed: bool = False

    @property
    def unit(self) -> str:
        """Unit of costs: seconds, or millimetres at unit speed."""
        return "s" if self.timed else "mm"

    def work(self, holes: int, changes: int) -> Fraction:
        """Seconds for everything that is no travel."""
        return self.drill * holes + self.tool_change * changes


def read_machine(path: str | Path) -> Machine:
    """Read a machine profile (TOML).

    Parameters
    ----------
    path : path
        A file with ``name``, ``tool_change`` and ``drill`` in seconds and a table
        ``[travel]`` with ``model``, ``vx``, ``vy`` in mm/s, ``ax``, ``ay`` in mm/s^2.

    Raises
    ------
    InputError
        If the file cannot be read, is no TOML, or has unknown keys or values.
    """
    path = Path(path)
    data = toml.parse(toml.read_text(path, "machine profile"), path, str)
    _known(data, KEYS, "the profile", path)
    table = data.get("travel", {})
    if not isinstance(table, Mapping):
        raise InputError("[travel] must be a table", path)
    _known(table, TRAVEL_KEYS, "[travel]", path)
    name = data.get("name", path.stem)
    if not isinstance(name, str):
        raise InputError(f"name = {name!r} is not a text", path)
    travel = _travel(table, path)
    change, drill = (_number(data, key, path, zero=True) for key in ("tool_change", "drill"))
    wrong = misfit(travel.model, set(table))
    if not wrong and "vx" not in table and (change or drill):
        wrong = "tool_change and drill are seconds; give the speeds vx and vy, too"
    if wrong:
        raise InputError(f"[travel]: {wrong}", path)
    return Machine(
        travel=travel,
        tool_change=change or Fraction(0),
        drill=drill or Fraction(0),
        name=name,
        timed="vx" in table,
    )


def misfit(model: Model, given: Set[str]) -> str | None:
    """What is wrong about the speeds and accelerations that a model is given; None if nothing."""
    if len(given & {"vx", "vy"}) == 1:
        return "vx and vy belong together; give both"
    if model is Model.TRAPEZOIDAL:
        return None if "vx" in given else "trapezoidal travel needs the speeds vx and vy"
    if given & {"ax", "ay"}:
        return f"ax and ay are for trapezoidal travel, not for {model}"
    return None


def _known(data: Mapping[str, Any], keys: set[str], where: str, path: Path) -> None:
    for key in data:
        if key not in keys:
            known = ", ".join(sorted(keys))
            raise InputError(f"{where} has the unknown key {key!r}; expected {known}", path)


def _number(data: Mapping[str, Any], key: str, path: Path, zero: bool = False) -> Fraction | None:
    if key not in data:
        return None
    try:
        value = Fraction(exact_decimal(data[key]))
    except (TcpError, TypeError, ValueError):
        value = None
    if value is None or isinstance(data[key], bool):
        raise InputError(f"{key} = {data[key]!r} is not a number", path)
    if value < 0 or (value == 0 and not zero):
        least = "0 or more" if zero else "greater than 0"
        raise InputError(f"{key} must be {least}, not {value}", path)
    return value


def _rounding(text: str) -> Rounding:
    if text not in list(Rounding):
        raise UsageError(f"unknown rounding {text!r}; expected {' or '.join(Rounding)}")
    return Rounding(text)


def _travel(table: Mapping[str, Any], path: Path) -> Travel:
    try:
        given: dict[str, Any] = {
            key: _number(table, key, path)
            for key in ("vx", "vy", "ax", "ay", "quantum")
            if key in table
        }
        if "axes" in table:
            given["axes"] = parse_model(str(table["axes"]))
        if "rounding" in table:
            given["rounding"] = _rounding(str(table["rounding"]))
        return Travel(parse_model(str(table.get("model", "simultaneous"))), **given)
    except InputError:
        raise
    except (TcpError, ValueError) as error:
        raise InputError(f"[travel]: {error}", path) from None
