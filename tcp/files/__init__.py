"""Readers and writers: text in, Workpiece out, and back.

:func:`read` looks at a file's name and first line and calls the reader for its
format; a new format is one module and one line in :data:`READERS`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from tcp.errors import InputError, UsageError
from tcp.files.reading import PIPED, UNITS, Reading, piped

READERS: dict[str, str] = {
    ".csv": "tcp.files.csv",
    ".tsv": "tcp.files.csv",
    ".txt": "tcp.files.csv",
    ".tsp": "tcp.files.tsplib",
    **dict.fromkeys(
        (".drl", ".drd", ".xln", ".exc", ".xnc", ".ncd", ".drill", ".rou", ".drr"),
        "tcp.files.excellon",
    ),
    ".kicad_pcb": "tcp.files.kicad",
    ".dxf": "tcp.files.dxf",
    **dict.fromkeys((".ngc", ".gcode", ".gc"), "tcp.files.gcode"),
}
"""The module that reads files of a suffix; it offers ``read(path, **options) -> Reading``."""


def read(path: str | Path, *, units: str | None = None, **options: Any) -> Reading:
    """Read a workpiece from a file of any format that ``tcp`` knows.

    Parameters
    ----------
    path : path
        The file; its suffix tells the format; an unknown one, and ``.txt``, is read as CSV
        unless it looks like a drill file.
    units : {"mm", "inch"}, optional
        Unit of the coordinates, where the file does not say.
    **options
        What a format's own reader understands.

    Returns
    -------
    Reading
        The workpiece, the file's own travel model if it has one, and notes.

    Raises
    ------
    InputError
        If the file cannot be read or is not valid; names file and line.
    UsageError
        For options that the file's format does not take, or units that are none.
    """
    path = Path(path)
    if units is not None and units not in UNITS:
        raise UsageError(f"units {units!r} is unknown; expected mm or inch")
    if "\0" in str(path):
        raise InputError(f"{str(path)!r} is no name of a file")
    name = _reader(path)
    reader: Callable[..., Reading] = import_module(name).read
    given = {key: value for key, value in options.items() if value is not None}
    unknown = given.keys() - inspect.signature(reader).parameters.keys()
    if unknown:
        advice = f"; {PIPED}" if name == "tcp.files.csv" and piped(path) else ""
        raise UsageError(f"{path}: files of this format take no option {min(unknown)!r}{advice}")
    return reader(path, units=units, **given)


def _reader(path: Path) -> str:
    """The module that reads a file; Altium and others call their drill files ``.txt``."""
    suffix = path.suffix.lower()
    if suffix in READERS and suffix != ".txt":
        return READERS[suffix]
    if not path.is_file():
        return "tcp.files.csv"  # a pipe can be read only once; what is missing is said there
    try:
        with path.open("rb") as file:
            head = file.read(65536)
    except OSError:
        return "tcp.files.csv"  # whose message says what is wrong with the file
    dialects = import_module("tcp.files.excellon.dialects")
    if suffix in (".nc", ".cnc", ".tap") and dialects.looks_gcode(head):
        return "tcp.files.gcode"
    return "tcp.files.excellon" if dialects.looks_excellon(head) else "tcp.files.csv"


__all__ = ["READERS", "Reading", "read"]
