"""Writing a file so that a reader never sees half of it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

from tcp.errors import OutputError, system_reason


def write_file(
    path: str | Path, content: str | bytes, check: Callable[[bytes], None] | None = None
) -> None:
    """Write to a temporary file beside ``path``, read it back, and rename it into place.

    ``check`` sees what was read back and may raise: then nothing is renamed.
    Devices and pipes such as ``/dev/stdout`` are written directly.

    Raises
    ------
    OutputError
        If the file cannot be written; what stood there before is untouched.
    """
    path = Path(path)
    data = content.encode() if isinstance(content, str) else content
    try:
        if path.exists() and not path.is_file():
            path.write_bytes(data)
        else:
            _replace(real_path(path), data, check)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {system_reason(error)}") from None


def real_path(path: Path) -> Path:
    """The path behind all symbolic links; a loop stays (``resolve`` raises)."""
    return Path(os.path.realpath(path))


def _replace(path: Path, data: bytes, check: Callable[[bytes], None] | None) -> None:
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name[:100]}.")
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
        temporary.chmod(_mode(path))
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def _mode(path: Path) -> int:
    """Permissions for the new file: the old file's, else what the umask grants."""
    if path.exists():
        return path.stat().st_mode & 0o777
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask
