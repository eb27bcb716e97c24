"""What a reader returns."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from tcp.travel import Model, Travel
from tcp.workpiece import INCH, Workpiece

UNITS = {"mm": Fraction(1), "inch": INCH}
"""Millimetres to the unit."""

PIPED = "a pipe has no suffix and is read as CSV; save another format as a file, such as board.drl"
"""What to do with what came through a pipe and is no table: it can be read only once."""


def piped(path: Path) -> bool:
    """Whether a pipe or the like stands there, from which a table is read."""
    return path.exists() and not (path.is_file() or path.is_dir())


@dataclass(frozen=True)
class Reading:
    """A file, read.

    Parameters
    ----------
    workpiece : Workpiece
        The holes.
    travel : Travel or None
        The travel model that the file itself states (TSPLIB), if any.
    notes : tuple of str
        What a user may want to know: ignored columns, coincident holes.
    """

    workpiece: Workpiece
    travel: Travel | None = None
    notes: tuple[str, ...] = ()


def travel_as(own: Travel | None, model: Model | None, **given: Any) -> Travel:
    """The travel model asked for, else the file's own, else sequential.

    A model that is the file's own keeps what the file says about it, so that
    ``--travel euclidean`` on a TSPLIB ``EUC_2D`` file stays in its integers; ``given`` are
    speeds, quantum and the like that are asked for.
    """
    if own is not None and model in (None, own.model):
        return replace(own, **given)
    return Travel(model or Model.SEQUENTIAL, **given)


def coincidence_note(workpiece: Workpiece) -> list[str]:
    """A note on holes that lie at one place, if there are any."""
    groups = workpiece.coincident
    if not groups:
        return []
    first = " and ".join(groups[0][:3])
    if len(groups[0]) > 3:
        first += f" and {len(groups[0]) - 3} more"
    places = "1 place" if len(groups) == 1 else f"{len(groups)} places"
    return [f"{places} with more than one hole (holes {first})"]
