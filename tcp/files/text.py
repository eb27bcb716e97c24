"""Bytes to lines, within bounds: what every text reader does first."""

from __future__ import annotations

import codecs
from pathlib import Path

from tcp.errors import InputError, system_reason

MAX_BYTES = 512 * 2**20
"""A larger file is refused: 20 million rows of CSV fit."""

MAX_LINE = 2**20
"""A longer line is refused without loading it."""

_FOREIGN = {
    codecs.BOM_UTF32_LE: "UTF-32",
    codecs.BOM_UTF32_BE: "UTF-32",
    codecs.BOM_UTF16_LE: "UTF-16",
    codecs.BOM_UTF16_BE: "UTF-16",
}


def read_lines(path: Path) -> list[str]:
    """The lines of a UTF-8 text file, without their ends (LF, CRLF or CR) and without a BOM.

    Raises
    ------
    InputError
        If the file cannot be read, is empty, binary, not UTF-8 or beyond
        :data:`MAX_BYTES` or :data:`MAX_LINE`.
    """
    data = _bounded_bytes(path)
    if not data.strip():
        raise InputError("the file is empty; expected a list of holes", path)
    data = data.removeprefix(codecs.BOM_UTF8)
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        message = f"byte 0x{data[error.start]:02X} is not UTF-8; save the file as UTF-8 text"
        raise InputError(message, path, _line_at(data, error.start)) from None
    return text.replace("\r\n", "\n").replace("\r", "\n").removesuffix("\n").split("\n")


def read_bounded(path: Path, what: str = "file", most: int | None = None) -> bytes:
    """All bytes of a file of at most ``most`` bytes, :data:`MAX_BYTES` unless it is given.

    Raises
    ------
    InputError
        If it cannot be read or is larger.
    """
    most = MAX_BYTES if most is None else most
    try:
        with path.open("rb") as file:
            data = file.read(most + 1)
    except OSError as error:
        raise InputError(f"cannot be read: {system_reason(error)}", path) from None
    if len(data) > most:
        raise InputError(f"the {what} is larger than {most >> 20} MiB", path)
    return data


def read_text(path: Path, what: str, form: str, most: int) -> str:
    """The text of a UTF-8 file of at most ``most`` bytes, without a BOM; LF ends its lines.

    Parameters
    ----------
    path : path
        The file.
    what, form : str
        What it should be, and in which form, for the messages: "route", "a route as text".
    most : int
        Bytes.

    Raises
    ------
    InputError
        If it cannot be read, is larger, binary or not UTF-8.
    """
    data = read_bounded(path, what, most)
    if b"\0" in data:
        raise InputError(f"is binary; expected {form}", path)
    try:
        return data.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise InputError("is not UTF-8 text", path, line) from None


def _line_at(data: bytes, position: int) -> int:
    before = data[:position].replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return before.count(b"\n") + 1


def _bounded_bytes(path: Path) -> bytes:
    """All bytes of a file; stops reading as soon as a bound is passed."""
    lines: list[bytes] = []
    total = 0
    try:
        with path.open("rb") as file:
            while line := file.readline(MAX_LINE + 1):
                lines.append(line)
                total += len(line)
                if len(line) > MAX_LINE:
                    message = f"the line is longer than {MAX_LINE} bytes; expected one hole a line"
                    raise InputError(message, path, len(lines))
                if total > MAX_BYTES:
                    raise InputError(f"the file is larger than {MAX_BYTES // 2**20} MiB", path)
                if b"\0" in line:
                    raise InputError(_foreign(lines[0]), path, len(lines))
    except OSError as error:
        reason = (error.strerror or "the file cannot be read").lower()
        raise InputError(f"{reason}; expected a readable file", path) from None
    return b"".join(lines)


def _foreign(first: bytes) -> str:
    """What a file with NUL bytes is, judged by its first line."""
    for bom, encoding in _FOREIGN.items():
        if first.startswith(bom):
            return f"the file is {encoding}; save it as UTF-8 text"
    return "found a NUL byte; expected UTF-8 text, not a binary or UTF-16 file"
