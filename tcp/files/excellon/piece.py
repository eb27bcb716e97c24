"""The round holes of a drill file as a workpiece, and what looks odd about them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from tcp.errors import InputError
from tcp.files.excellon.document import Ints
from tcp.files.excellon.numbers import tool_number
from tcp.files.excellon.program import Kind, Program, repeated
from tcp.words import listed, shown
from tcp.workpiece import Workpiece

WIDEST = Fraction(460)
"""Boards longer than this (mm) do not fit a standard panel: the scale is likely wrong."""


def expanded(program: Program) -> tuple[Ints, Ints, Ints]:
    """Tool, x and y of every round hole in the order it is drilled, repeats and copies included."""
    rows = program.rows
    pieces: list[tuple[Ints, Ints, Ints]] = []
    at = 0
    for pattern in program.patterns:
        pieces.append(_holes(program, at, pattern.first))
        tool, x, y = _holes(program, pattern.first, pattern.last)
        pieces.append((tool, x, y))
        pieces += [(tool, *copy.place(x, y)) for copy in pattern.copies]
        at = pattern.last
    pieces.append(_holes(program, at, len(rows)))
    tool, x, y = (np.concatenate(columns) for columns in zip(*pieces, strict=True))
    return tool, x, y


def _holes(program: Program, first: int, last: int) -> tuple[Ints, Ints, Ints]:
    rows, start = program.rows, first
    tool, x, y = [], [], []
    for row in [*(r for r in program.repeats if first <= r < last), last]:
        hits = np.arange(start, row)[rows.kind[start:row] == Kind.HIT]
        tool.append(rows.tool[hits])
        x.append(rows.x1[hits])
        y.append(rows.y1[hits])
        if row < last:
            places = list(repeated(int(rows.x1[row]), int(rows.y1[row]), program.repeats[row]))
            x.append(np.array([p[0] for p in places], dtype=np.int64))
            y.append(np.array([p[1] for p in places], dtype=np.int64))
            tool.append(np.full(len(places), rows.tool[row]))
            start = row + 1
    return np.concatenate(tool), np.concatenate(x), np.concatenate(y)


def choose_tool(program: Program, wanted: str | int | None) -> int | None:
    """The tool that ``--tool`` means; None for ``all``; the busiest one by default.

    Raises
    ------
    InputError
        If the file has no such tool, or the tool drills no round hole.
    """
    text = str(wanted)
    if text.strip().upper().removeprefix("T") == "ALL":
        return None
    tools, counts = np.unique(expanded(program)[0], return_counts=True)
    if not len(tools):
        raise InputError("drills no round hole, only slots or routed paths", program.path)
    if wanted is None:
        return int(tools[np.argmax(counts)])
    number = tool_number(text)
    if number is None or number not in tools:
        names = listed(f"T{t}" for t in tools)
        raise InputError(
            f"has no holes for the tool {shown(str(wanted))}; expected one of {names}", program.path
        )
    return number


def workpiece(program: Program, tool: int | None) -> Workpiece:
    """The round holes of one tool (None: of all) as a workpiece; ids count from 1.

    Parameters
    ----------
    program : Program
        The file.
    tool : int or None
        The tool's number.
    """
    tools, x, y = expanded(program)
    if tool is not None:
        chosen = tools == tool
        tools, x, y = tools[chosen], x[chosen], y[chosen]
    name = program.path.stem if tool is None else f"{program.path.stem}-T{tool}"
    sizes = {number: program.tools[number].diameter for number in np.unique(tools).tolist()}
    return Workpiece(
        name,
        tuple(map(str, range(1, len(x) + 1))),
        x.astype(np.int64),
        y.astype(np.int64),
        program.step,
        tuple(sizes[t] for t in tools.tolist()),
        tuple(f"T{t}" for t in tools.tolist()),
    )


def oddities(program: Program) -> list[str]:
    """Warnings about scale and spacing, and duplicates; sentences, none of them an error."""
    rows, found = program.rows, []
    reach = [
        (max(int(a.max()), int(b.max())) - min(int(a.min()), int(b.min()))) * program.step
        for a, b in ((rows.x1, rows.x2), (rows.y1, rows.y2))
    ]
    if max(reach) > WIDEST:
        found.append(
            f"the board would be {float(reach[0]):.1f} x {float(reach[1]):.1f} mm, more than "
            f"{WIDEST} mm; check units, format and zeros"
        )
    tools, x, y = expanded(program)
    for number in np.unique(tools).tolist():
        if len(program.offsets.get(number, ())) > 1:
            continue
        mine = tools == number
        found += _crowding(program, number, x[mine], y[mine])
    return found


def _crowding(program: Program, number: int, x: Ints, y: Ints) -> list[str]:
    """Duplicates and overlaps of one tool's holes."""
    from scipy.spatial import cKDTree

    places, counts = np.unique(np.stack([x, y], axis=1), axis=0, return_counts=True)
    found = []
    if (counts > 1).any():
        more = int((counts - 1).sum())
        found.append(f"T{number}: {more} hole(s) drilled more than once at one place; kept")
    size = program.tools[number].diameter
    if size is None or len(places) < 2:
        return found
    near = float(cKDTree(places).query(places, k=2)[0][:, 1].min()) * float(program.step)
    if near < 0.999 * float(size):
        found.append(
            f"T{number}: holes {near:.3f} mm apart overlap at a diameter of {float(size):.3f} mm; "
            f"check units, format and zeros"
        )
    return found
