"""Holes of drawings and layouts, grouped into tools by plating and diameter."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from tcp.errors import InputError
from tcp.files.reading import Reading
from tcp.travel import Model, Travel
from tcp.words import listed, shown
from tcp.workpiece import MAX_STEPS, Workpiece

STEP = Fraction(1, 10**6)
"""Positions are whole nanometres: KiCad's own unit, and finer than any drawing is drilled."""


@dataclass(frozen=True)
class Drill:
    """One hole: position in nanometres, diameter in mm, and what tells tools apart beside it.

    A diameter of 0 is that of a point, of which none is known.
    """

    x: int
    y: int
    diameter: Fraction
    group: str = ""


def reading(
    path: Path, drills: Sequence[Drill], tool: str | int | None, notes: Sequence[str] = ()
) -> Reading:
    """The holes of one tool (default: the busiest; ``all``: of all) as a workpiece.

    Raises
    ------
    InputError
        If there are no holes, or none for the tool.
    """
    if not drills:
        raise InputError("holds no drilled hole", path)
    if max(max(abs(d.x), abs(d.y)) for d in drills) > MAX_STEPS:
        raise InputError("a hole lies beyond any workpiece; expected a board's coordinates", path)
    groups = sorted({(d.group, d.diameter) for d in drills})
    names = {group: f"T{i + 1}" for i, group in enumerate(groups)}
    counts = Counter(names[d.group, d.diameter] for d in drills)
    table = listed(
        f"{name} ({counts[name]}) {float(g[1]):g} mm{' ' + g[0] if g[0] else ''}"
        for g, name in names.items()
    )
    chosen = max(names.values(), key=counts.__getitem__) if tool is None else str(tool).upper()
    chosen = f"T{chosen}" if chosen.isdecimal() else chosen
    mine = [d for d in drills if chosen in ("ALL", names[d.group, d.diameter])]
    if not mine:
        raise InputError(f"has no tool {shown(str(tool))}; its tools are {table}", path)
    more = (
        [f"tools: {table}; {'all are' if chosen == 'ALL' else f'{chosen} is'} taken"]
        if len(groups) > 1
        else []
    )
    piece = Workpiece(
        path.stem if chosen == "ALL" else f"{path.stem}-{chosen}",
        tuple(str(i + 1) for i in range(len(mine))),
        np.array([d.x for d in mine], dtype=np.int64),
        np.array([d.y for d in mine], dtype=np.int64),
        STEP,
        tuple(d.diameter or None for d in mine),
        tuple(names[d.group, d.diameter] for d in mine),
    )
    return Reading(piece, Travel(Model.SIMULTANEOUS), (*notes, *more))
