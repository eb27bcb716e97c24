"""Readers and writers: text in, Workpiece out, and back.

:func:`read` looks at a file's name and first line and calls the reader for its
format; a new format is one module and one line in :data:`READERS`.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from tcp.files.reading import Reading

READERS: dict[str, str] = {
    ".csv": "tcp.files.csv",
    ".tsv": "tcp.files.csv",
    ".txt": "tcp.files.csv",
    ".tsp": "tcp.files.tsplib",
}
"""The module that reads files of a suffix; it offers ``read(path, **options) -> Reading``."""


def read(path: str | Path, *, units: str | None = None, **options: Any) -> Reading:
    """Read a workpiece from a file of any format that ``tcp`` knows.

    Parameters
    ----------
    path : path
        The file; its suffix tells the format, and an unknown suffix is read as CSV.
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
    """
    path = Path(path)
    module = import_module(READERS.get(path.suffix.lower(), "tcp.files.csv"))
    reader: Callable[..., Reading] = module.read
    return reader(path, units=units, **options)


__all__ = ["READERS", "Reading", "read"]
