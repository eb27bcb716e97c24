"""Where a board's new file goes, and how it gets there without ever losing the old one."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tcp.boards.board import Board
from tcp.errors import InputError, OutputError, TcpError, UsageError, system_reason
from tcp.files.drilling import compare, reparse
from tcp.files.excellon.dialects import HEAD, looks_excellon, looks_gcode
from tcp.files.excellon.settings import Hints
from tcp.files.write import is_stream, write_file
from tcp.result import decimal

SUFFIXES = {
    ".drl",
    ".drd",
    ".xln",
    ".exc",
    ".xnc",
    ".ncd",
    ".drill",
    ".rou",
    ".ngc",
    ".gcode",
    ".gc",
}
"""What a folder's drill files are called."""

PERHAPS = {".txt", ".nc", ".cnc", ".tap"}
"""Files that are looked into: Altium's and gEDA's drill files, and programs of any kind."""

MARK = "-optimized"


@dataclass(frozen=True)
class Target:
    """Where to write.

    Parameters
    ----------
    out : path, optional
        A file, or a directory; default: beside the input, named ``-optimized``.
    in_place : bool
        Replace the input and keep it as ``.bak``.
    force : bool
        Overwrite an existing file.
    """

    out: Path | None = None
    in_place: bool = False
    force: bool = False

    def path(self, source: Path, many: bool) -> Path:
        """The file to write for one input.

        Raises
        ------
        UsageError
            If the wishes contradict each other.
        """
        if self.in_place:
            return source
        if self.out is None and source.exists() and not source.is_file():
            raise UsageError(f"{source} is no file to write beside; give --out")
        if self.out is None:
            return source.with_name(f"{source.stem}{MARK}{source.suffix}")
        if self.out.is_dir():
            return self.out / source.name
        if many:
            raise UsageError(f"{self.out} cannot hold several boards; give a directory")
        return self.out


def write_board(board: Board, target: Target, many: bool, hints: Hints | None) -> Path | None:
    """Write the new file, read it back, compare it hole by hole, and rename it into place.

    Returns
    -------
    Path or None
        The file written; None where the input is to be replaced and stays as it is.

    Raises
    ------
    OutputError
        If it cannot be written or stands already, or if the input that it is to
        replace is another one by now.
    LostError
        If what was read back does other work than the input.
    """
    source = board.before.path
    path = target.path(source, many)

    def check(written: bytes) -> None:
        compare(board.before, reparse(written, board.before, hints), text=board.text_guard)

    if not target.in_place and path.is_file() and not is_stream(path):
        if path.samefile(source):
            raise OutputError(f"{path} is the input itself; say --in-place to replace it")
        if not target.force and path.read_bytes() != board.data:
            raise OutputError(f"{path} exists already; say --force to overwrite it")
    if target.in_place:
        if not board.changed:
            return None
        _unchanged_since(board)
        _back_up(board, hints, target.force)
    write_file(path, board.data, check, like=(source,))
    return path


def backup_of(source: Path) -> Path:
    """Where the input is kept that is replaced: ``NAME.bak``.

    Raises
    ------
    OutputError
        If something stands there that is no file.
    """
    backup = source.with_name(source.name + ".bak")
    if backup.exists() and not backup.is_file():
        raise OutputError(f"{backup} is in the way of the backup; move it away first")
    return backup


def _unchanged_since(board: Board) -> None:
    """Refuse to replace what somebody saved while the board was worked on."""
    source = board.before.path
    try:
        now = source.read_bytes()
    except OSError as error:
        raise OutputError(f"cannot read {source}: {system_reason(error)}") from None
    if now != board.original:
        raise OutputError(f"{source} has changed meanwhile and stays; optimise it again")


def _back_up(board: Board, hints: Hints | None, force: bool) -> None:
    """Keep the input, unless an older version of the same board is kept already."""
    backup = backup_of(board.before.path)
    try:
        kept = backup.read_bytes() if backup.exists() else None
    except OSError as error:
        raise OutputError(f"cannot read {backup}: {system_reason(error)}") from None
    if kept is None:
        write_file(backup, board.original, like=(board.before.path,))
    elif not (force or kept == board.original or _same_work(board, kept, hints)):
        raise OutputError(
            f"{backup} holds another board; say --force to leave it as it is, or move it away"
        )


def _same_work(board: Board, kept: bytes, hints: Hints | None) -> bool:
    try:
        compare(board.before, reparse(kept, board.before, hints), text="free")
    except TcpError:
        return False
    return True


def collect(given: Sequence[Path]) -> tuple[list[Path], list[InputError]]:
    """The boards that arguments mean: files, folders (their drill files) and patterns.

    Returns
    -------
    list of Path, list of InputError
        The boards, each once, and what is wrong with arguments that mean none.
    """
    found: list[Path] = []
    errors: list[InputError] = []
    for path in given:
        try:
            found += _meant(path)
        except InputError as error:
            errors.append(error)
        except OSError as error:
            errors.append(InputError(f"cannot be read: {system_reason(error)}", path))
    return list(dict.fromkeys(found)), errors


def _meant(path: Path) -> Iterable[Path]:
    if path.is_dir():
        return _inside(path)
    if path.exists() or not any(c in str(path) for c in "*?["):
        return [path]
    anchor = Path(path.anchor)
    matches = sorted(anchor.glob(str(path.relative_to(anchor))))
    if MARK not in path.name:
        matches = [match for match in matches if not match.stem.endswith(MARK)]
    if not matches:
        raise InputError("matches no drill file", path)
    return matches


def _inside(folder: Path) -> Iterable[Path]:
    try:
        files = sorted(p for p in folder.iterdir() if p.is_file())
    except OSError as error:
        raise InputError(f"cannot be listed: {system_reason(error)}", folder) from None
    boards = [p for p in files if not p.stem.endswith(MARK) and _is_board(p)]
    if not boards:
        raise InputError("holds no drill file", folder)
    return boards


def _is_board(path: Path) -> bool:
    suffix = path.suffix.lower()
    if suffix not in PERHAPS:
        return suffix in SUFFIXES
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError:
        return False
    return looks_excellon(head) or (suffix != ".txt" and looks_gcode(head))


def manifest(written: Sequence[tuple[Board, Path | None]]) -> bytes:
    """Hashes of what went in and what came out, as JSON."""
    rows: list[dict[str, Any]] = []
    for board, path in written:
        rows.append(
            {
                "input": str(board.before.path),
                "input_sha256": hashlib.sha256(board.original).hexdigest(),
                "output": None if path is None else str(path),
                "output_sha256": hashlib.sha256(board.data).hexdigest(),
                "holes": board.before.hits,
                "slots": board.before.slots,
                "routed": board.before.routed,
                "travel_before": decimal(board.worth(board.costs_before.total)),
                "travel_after": decimal(board.worth(board.costs_after.total)),
                "lower_bound": decimal(board.worth(board.bound)),
                "unit": board.wishes.machine.unit,
            }
        )
    return (json.dumps({"format": "tcp-manifest-1", "boards": rows}, indent=2) + "\n").encode()
