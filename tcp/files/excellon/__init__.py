"""Excellon drill files: lossless text, exact meaning, and a writer that only re-orders."""

from __future__ import annotations

from pathlib import Path

from tcp.errors import UsageError
from tcp.files.excellon.numbers import Digits, Units, Zeros, parse_digits
from tcp.files.excellon.piece import choose_tool, expanded, oddities, workpiece
from tcp.files.excellon.program import Kind, Mark, Program, Tool
from tcp.files.excellon.reader import parse, read_program
from tcp.files.excellon.settings import Hints
from tcp.files.reading import Reading
from tcp.travel import Model, Travel
from tcp.words import counted, listed

__all__ = [
    "Digits",
    "Hints",
    "Kind",
    "Mark",
    "Program",
    "Tool",
    "Units",
    "Zeros",
    "choose_tool",
    "expanded",
    "hints",
    "oddities",
    "parse",
    "parse_digits",
    "read",
    "read_program",
    "workpiece",
]


def hints(
    units: str | None = None,
    format: str | None = None,
    zeros: str | None = None,
    unfinished: bool = False,
    sidecar: str | Path | None = None,
) -> Hints:
    """Hints from what users type: ``mm``, ``2:4``, ``lz``.

    Raises
    ------
    UsageError
        If a word is none of them.
    """
    for name, word, known in (("units", units, ["mm", "inch"]), ("zeros", zeros, ["lz", "tz"])):
        if word is not None and word.lower() not in known:
            raise UsageError(f"{name} {word!r} is unknown; expected {' or '.join(known)}")
    return Hints(
        None if units is None else Units(units.lower()),
        None if format is None else parse_digits(format),
        None if zeros is None else Zeros(zeros.lower()),
        unfinished,
        None if sidecar is None else Path(sidecar),
    )


def read(
    path: Path,
    *,
    units: str | None = None,
    tool: str | int | None = None,
    format: str | None = None,
    zeros: str | None = None,
    unfinished: bool = False,
    sidecar: str | Path | None = None,
) -> Reading:
    """The round holes of one tool as a workpiece; see :func:`tcp.files.read`.

    Parameters
    ----------
    path : path
        The drill file.
    units, format, zeros : str, optional
        What the file does not state: ``mm`` or ``inch``, ``2:4``, ``lz`` or ``tz``.
    tool : str or int, optional
        ``T3``, ``3`` or ``all``; by default the tool that drills most holes.
    unfinished : bool
        Accept a file without M30.
    sidecar : path, optional
        The ``nc_param.txt`` that explains the file.

    Returns
    -------
    Reading
        With simultaneous travel: what drill machines do.
    """
    program = read_program(path, hints(units, format, zeros, unfinished, sidecar))
    chosen = choose_tool(program, tool)
    notes = [*program.notes, *oddities(program)]
    others = [t for t in program.used if t != chosen]
    if tool is None and others:
        names = listed(f"T{t}" for t in others)
        notes.append(f"T{chosen} drills most holes and is taken; --tool chooses among {names}")
    counts = [(program.slots, "slot"), (program.routed, "routed path")]
    if left := " and ".join(counted(n, name) for n, name in counts if n):
        notes.append(f"left out: {left}; tcp optimize orders them too")
    return Reading(workpiece(program, chosen), Travel(Model.SIMULTANEOUS), tuple(notes))
