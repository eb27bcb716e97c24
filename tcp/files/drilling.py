"""Drill files of either language behind one set of functions: read, write, compare.

Excellon and G-code programs share :class:`Program`; what differs is how their
text is read, re-ordered and held against the original.
"""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

from tcp.errors import InputError, UsageError
from tcp.files import READERS, excellon, gcode
from tcp.files.excellon import Hints, Program
from tcp.files.excellon import guard as excellon_guard
from tcp.files.excellon import rewrite as excellon_rewrite
from tcp.files.excellon.dialects import looks_excellon, looks_gcode
from tcp.files.excellon.rewrite import Orders
from tcp.files.text import read_bounded

_SOLVED = {name for name, reader in READERS.items() if not reader.endswith(("excellon", "gcode"))}
_SOLVED -= {".txt"}  # Altium's drill files


def read_drilling(path: str | Path, hints: Hints | None = None) -> Program:
    """Read a drill file: G-code by its suffix or look, everything else as Excellon.

    Raises
    ------
    InputError
        If it cannot be read or is not understood.
    UsageError
        If the hints are about numbers of a kind that G-code has not.
    """
    path = Path(path)
    data = read_bounded(path)
    if path.suffix.lower() in _SOLVED:
        message = (
            f"is no drill file: tcp solve reads {path.suffix}, tcp optimize Excellon and G-code"
        )
        raise InputError(message, path)
    if is_gcode(path, data):
        _check_hints(path, hints or Hints())
        return gcode.parse(data, path, hints)
    return excellon.parse(data, path, hints)


def _check_hints(path: Path, hints: Hints) -> None:
    given = {"--format": hints.digits, "--zeros": hints.zeros, "--sidecar": hints.sidecar}
    for flag, value in given.items():
        if value is not None:
            raise UsageError(f"{path}: G-code takes no {flag}; drop it")


def is_gcode(path: Path, data: bytes) -> bool:
    """Whether a file is a G-code program; ``.cnc``, ``.tap`` and ``.nc`` may be either."""
    if path.suffix.lower() not in gcode.SUFFIXES:
        return False
    return not looks_excellon(data) or looks_gcode(data)


def reparse(data: bytes, like: Program, hints: Hints | None = None) -> Program:
    """Read bytes in the language of a program, in its name."""
    module: ModuleType = gcode if isinstance(like, gcode.GProgram) else excellon
    program: Program = module.parse(data, like.path, hints)
    return program


def reordered(program: Program, orders: Orders) -> bytes:
    """The file with some stretches in another order."""
    if isinstance(program, gcode.GProgram):
        return gcode.reorder(program, orders)
    return excellon_rewrite.reorder(program, orders)


def compare(before: Program, after: Program, *, text: str = "same") -> None:
    """Raise :class:`LostError` unless both do the same work."""
    if isinstance(before, gcode.GProgram):
        gcode.compare(before, after, text=text)
    else:
        excellon_guard.compare(before, after, text=text)
