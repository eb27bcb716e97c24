"""Writing a file so that a reader never sees half of it."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from tcp.errors import OutputError, system_reason


def write_file(
    path: str | Path,
    content: str | bytes,
    check: Callable[[bytes], None] | None = None,
    like: Sequence[Path] = (),
) -> None:
    """Write to a temporary file beside ``path``, read it back, and rename it into place.

    ``check`` sees what was read back and may raise: then nothing is renamed.
    A new file is kept from whom any of the files ``like`` is kept from.
    Devices and pipes such as ``/dev/stdout`` are written directly, see :func:`is_stream`.

    Raises
    ------
    OutputError
        If the file cannot be written; what stood there before is untouched.
    """
    path = Path(path)
    data = content.encode("utf-8", "replace") if isinstance(content, str) else content
    try:
        number = _our_output(path)
        if number is not None:
            (sys.stdout if number == 1 else sys.stderr).flush()
            with os.fdopen(os.dup(number), "wb") as stream:
                stream.write(data)
        elif is_stream(path):
            path.write_bytes(data)
        else:
            _replace(real_path(path), data, check, like)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {system_reason(error)}") from None


def is_stream(path: Path) -> bool:
    """Whether a path is a device or pipe, or a file that this process' output goes to.

    ``/dev/stdout`` may lead to a file: it is written on, never replaced.
    """
    if path.is_dir() or not path.exists():
        return False
    return not path.is_file() or _our_output(path) is not None


def _our_output(path: Path) -> int | None:
    """The descriptor, 1 or 2, that is open to the file at ``path``; None for any other file."""
    for number in (1, 2):
        try:
            ours, found = os.fstat(number), path.stat()
        except OSError:  # closed, or not there
            continue
        if (found.st_dev, found.st_ino) == (ours.st_dev, ours.st_ino):
            return number
    return None


def real_path(path: Path) -> Path:
    """The path behind all symbolic links; a loop stays (``resolve`` raises)."""
    return Path(os.path.realpath(path))


def _replace(
    path: Path, data: bytes, check: Callable[[bytes], None] | None, like: Sequence[Path]
) -> None:
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".tcp-")
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        written = temporary.read_bytes()
        if written != data:
            raise OutputError(f"cannot write {path}: what was read back differs")
        if check is not None:
            check(written)
        temporary.chmod(_mode(path, like))
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def _mode(path: Path, like: Sequence[Path]) -> int:
    """Permissions for the new file: the old file's, else what umask and ``like`` grant."""
    if path.exists():
        return path.stat().st_mode & 0o777
    mask = os.umask(0)
    os.umask(mask)
    granted = 0o666 & ~mask
    for one in like:
        if one.is_file():
            granted &= one.stat().st_mode
    return granted | 0o600
