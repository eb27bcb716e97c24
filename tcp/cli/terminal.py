"""What commands say beside their result, and where their files go."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import click

from tcp.errors import OutputError, UsageError
from tcp.files.write import is_stream, real_path


def on_terminal() -> bool:
    """Whether a person watches: both output and messages go to a terminal."""
    return all(stream is not None and stream.isatty() for stream in (sys.stdout, sys.stderr))


PROOF = ".cert.json.gz"
"""What a certificate is called in a folder, behind the stem of its file."""

PROOF_ENDINGS = (".json", ".json.gz")
"""How the name of a certificate may end."""

Say = Callable[[str], None]
"""Shows where a long piece of work stands."""


@contextmanager
def status_line(name: str) -> Iterator[Say]:
    """A line on stderr that says what it was told last; on a terminal only, gone at the end."""
    if not on_terminal():
        yield lambda text: None
        return
    from rich.console import Console

    with Console(stderr=True).status(name) as status:
        yield lambda text: status.update(f"{name}: {text}")


def tell(path: Path, notes: Iterable[str]) -> None:
    """Notes about a file, on stderr."""
    for note in notes:
        click.echo(f"tcp: {path}: note: {note}", err=True)


def output_path(wish: Path, source: Path, many: bool, suffix: str) -> Path:
    """The file to write for one of possibly many inputs.

    Parameters
    ----------
    wish : path
        What the user gave: a file, or a directory that exists.
    source : path
        The input; its stem names the output in a directory.
    many : bool
        Whether there are several inputs: then only a directory will do.
    suffix : str
        Put after the stem in a directory.

    Raises
    ------
    UsageError
        If several inputs would be written to one file.
    """
    if wish.is_dir():
        return wish / f"{source.stem}{suffix}"
    if many:
        raise UsageError(f"{wish} cannot hold the output of several files; give a directory")
    return wish


def check_outputs(targets: Iterable[tuple[Path, tuple[str, ...]]], sources: Iterable[Path]) -> None:
    """See before the work begins that what it yields has a place to go.

    Parameters
    ----------
    targets : iterable of (path, suffixes)
        Files that will be written, and the endings their names may have (none: any).
    sources : iterable of path
        The input files, which must not be overwritten.

    Raises
    ------
    UsageError
        If an output is an input or another output, or its ending is unknown or needs
        what is not installed.
    OutputError
        If an output's folder does not exist or cannot be written to.
    """
    inputs = {real_path(source) for source in sources}
    seen: set[Path] = set()
    for path, suffixes in targets:
        if path.is_dir():
            raise OutputError(f"cannot write {path}: is a directory")
        if suffixes and not path.name.lower().endswith(suffixes):
            raise UsageError(f"{path}: expected a name that ends in {' or '.join(suffixes)}")
        if is_stream(path):  # such as /dev/stdout
            continue
        if path.suffix.lower() == ".png" and find_spec("matplotlib") is None:
            raise UsageError(f"{path}: PNG needs matplotlib: pip install 'tcp-drill[plot]'")
        place = real_path(path)
        if place in inputs:
            raise UsageError(f"{path} is an input and would be overwritten; choose another name")
        if place in seen:
            raise UsageError(f"{path} would be written twice; choose different names")
        check_folder(path)
        seen.add(place)


def check_folder(path: Path) -> None:
    """See before the work begins that a file can be made in its folder.

    Raises
    ------
    OutputError
        If the folder does not exist or must not be written to.
    """
    folder = real_path(path).parent
    if not os.access(folder, os.F_OK) or not folder.is_dir():
        raise OutputError(f"cannot write {path}: there is no folder {path.parent}")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(f"cannot write {path}: the folder {path.parent} cannot be written to")
