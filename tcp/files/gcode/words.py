"""A line of G-code taken apart: its words, without comments and blanks."""

from __future__ import annotations

import re
from collections import Counter

_COMMENT = re.compile(rb"\([^()]*\)|;.*")
_WORD = re.compile(rb"[ \t]*([A-Za-z])[ \t]*([+-]?(?:\d+\.?\d*|\.\d+))[ \t]*")
_LETTERS = set("GMTXYZRQPLFSNH")

Words = list[tuple[str, bytes]]


def uncommented(text: bytes) -> bytes:
    """Text without its comments."""
    return _COMMENT.sub(b"", text)


def words_of(line: bytes) -> Words | None:
    """Letters and numbers of a line; None if it says anything else, or one letter twice."""
    words: Words = []
    for piece in _COMMENT.split(line):  # a comment never stands inside a word
        at, piece = 0, piece.strip()
        while at < len(piece):
            found = _WORD.match(piece, at)
            if found is None:
                return None
            words.append((found[1].decode().upper(), found[2]))
            at = found.end()
    letters = Counter(letter for letter, _ in words)
    repeated = {c for c, times in letters.items() if times > 1 and c not in "GM"}
    return None if repeated or not letters.keys() <= _LETTERS else words


def shortest(text: bytes) -> str:
    """A number in its shortest form: ``01.50`` is ``1.5``, ``-0`` is ``0``."""
    sign = "-" if text.startswith(b"-") else ""
    head, _, tail = text.decode().lstrip("+-").partition(".")
    head, tail = head.lstrip("0") or "0", tail.rstrip("0")
    bare = f"{head}.{tail}" if tail else head
    return bare if bare == "0" else sign + bare
