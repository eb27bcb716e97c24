"""TOML from anybody: size, depth and words are bounded before the parser sees the text."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tcp.errors import InputError
from tcp.files import text as text_file

MAX_BYTES = 8 * 2**20
MAX_DEPTH = 20
MAX_DOTS = 8
MAX_WORD = 1_000

_STRINGS = re.compile(
    r'"""(?s:.*?)"""|\'\'\'(?s:.*?)\'\'\'|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'|#[^\n]*'
)


def read_text(path: Path, what: str) -> str:
    """The text of a TOML file, without a BOM.

    Parameters
    ----------
    path : path
        The file.
    what : str
        What it should be, for the message: "claims file".

    Raises
    ------
    InputError
        If it cannot be read, is empty, binary or not UTF-8, or beyond the bounds.
    """
    text = text_file.read_text(path, what, f"the {what} in TOML", MAX_BYTES)
    if not text.strip():
        raise InputError(f"is empty; expected the {what} in TOML", path)
    _check_bounds(text, path)
    return text


def parse(text: str, path: Path, number: Callable[[str], Any] = float) -> dict[str, Any]:
    """The tables of a text of :func:`read_text`; ``number`` makes what a float stands for.

    Raises
    ------
    InputError
        If it is not TOML.
    """
    try:
        return tomllib.loads(text, parse_float=number)
    except tomllib.TOMLDecodeError as error:
        where = re.search(r"at line (\d+)", str(error))
        said = str(error).split(" (at ")[0][:120]
        raise InputError(f"is not TOML: {said}", path, int(where[1]) if where else None) from None
    except (RecursionError, ValueError) as error:
        raise InputError(f"is not TOML: {str(error)[:120]}", path) from None


def without_strings(text: str) -> str:
    """The text with its lines as they were, but every string and comment as one letter."""
    return _STRINGS.sub(lambda m: "s" + "\n" * m.group().count("\n"), text)


def _check_bounds(text: str, path: Path) -> None:
    """Refuse nesting that a TOML parser would recurse into, and what takes it forever."""
    bare = without_strings(text)
    depth = 0
    for mark in re.finditer(r"[\[\]{}\n]", bare):
        character = mark.group()
        depth += (character in "[{") - (character in "]}")
        if depth > MAX_DEPTH:
            line = bare.count("\n", 0, mark.start()) + 1
            raise InputError(f"nested more than {MAX_DEPTH} deep", path, line)
    bounds = {
        rf"(?:[\w-]+[ \t]*\.[ \t]*){{{MAX_DOTS},}}": f"a dotted key of more than {MAX_DOTS} parts",
        rf"\w{{{MAX_WORD + 1},}}": f"a key or number of more than {MAX_WORD:,} characters",
    }
    for pattern, what in bounds.items():
        found = re.search(pattern, bare, re.ASCII)
        if found:
            raise InputError(what, path, bare.count("\n", 0, found.start()) + 1)
