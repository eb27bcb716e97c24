"""Drilling programs in G-code: read, re-ordered within what is understood, and compared."""

from __future__ import annotations

from pathlib import Path

from tcp.errors import InputError
from tcp.files.excellon import hints
from tcp.files.excellon.piece import choose_tool, oddities, workpiece
from tcp.files.excellon.settings import Hints
from tcp.files.gcode.program import GProgram
from tcp.files.gcode.reader import parse
from tcp.files.gcode.rewrite import compare, reorder
from tcp.files.reading import Reading
from tcp.files.text import read_bounded
from tcp.travel import Model, Travel
from tcp.words import listed

SUFFIXES = (".ngc", ".nc", ".gcode", ".tap", ".cnc", ".gc")


def read_program(path: str | Path, known: Hints | None = None) -> GProgram:
    """Read a drilling program from a file.

    Raises
    ------
    InputError
        If it cannot be read or drills nothing that is understood.
    """
    path = Path(path)
    return parse(read_bounded(path), path, known)


def read(
    path: Path,
    *,
    units: str | None = None,
    tool: str | int | None = None,
    unfinished: bool = False,
) -> Reading:
    """The holes of one tool of a drilling program; see :func:`tcp.files.read`."""
    program = read_program(path, hints(units, unfinished=unfinished))
    chosen = choose_tool(program, tool)
    _refuse_the_unknown(program, chosen)
    notes = [*program.notes, *oddities(program)]
    others = [t for t in program.used if t != chosen]
    if tool is None and others:
        names = ", ".join(f"T{t}" for t in others)
        notes.append(f"T{chosen} drills most holes and is taken; --tool chooses among {names}")
    return Reading(workpiece(program, chosen), Travel(Model.SIMULTANEOUS), tuple(notes))


def _refuse_the_unknown(program: GProgram, tool: int | None) -> None:
    """Refuse holes that are not all known, or whose distances only the machine knows."""
    for n in sorted(program.uncounted):
        number = program.selections[n].tool
        if tool in (None, number):
            reason = f"not all holes of T{number} are known: {program.unclear[n]}"
            raise InputError(reason, program.path)
    sets = [program.offsets[t] for t in program.offsets if tool in (None, t)]
    offsets = sorted(set().union(*sets))
    if len(offsets) > 1:
        names = listed(f"G{offset}" for offset in offsets)
        raise InputError(
            f"drills in the work offsets {names}, whose distance is not known; split the file",
            program.path,
        )


__all__ = ["SUFFIXES", "GProgram", "compare", "parse", "read", "read_program", "reorder"]
