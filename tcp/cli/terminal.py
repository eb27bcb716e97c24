"""What commands say beside their result, and where their files go."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

import click

from tcp.errors import UsageError


def on_terminal() -> bool:
    """Whether a person watches: both output and messages go to a terminal."""
    return sys.stdout.isatty() and sys.stderr.isatty()


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
