"""How messages put what a file says: quoted and cut short, listed, counted."""

from __future__ import annotations

from collections.abc import Iterable


def plain(text: str) -> str:
    """Text that cannot move the cursor or spoil a picture: control characters are spelled out."""
    return "".join(c if c.isprintable() else f"\\x{ord(c):02x}" for c in text)


def shown(text: str | bytes, most: int = 40) -> str:
    """What a file says, quoted for a message: so many characters, and ``...`` for the rest."""
    if isinstance(text, bytes):
        text = text[: most + 1].decode("latin-1")
    return f"{text[:most]!r}..." if len(text) > most else repr(text)


def listed(names: Iterable[str], most: int = 8) -> str:
    """Names that a file gives, for a message: the first few, each cut short, and how many more."""
    names = list(names)
    first = [repr(name[:30])[1:-1] + "..." * (len(name) > 30) for name in names[:most]]
    return ", ".join(first) + (f" and {len(names) - most} more" if len(names) > most else "")


def counted(number: int, name: str) -> str:
    """``1 hole``, ``12 holes``: a number of things whose plural takes an s."""
    return f"{number} {name}" if number == 1 else f"{number} {name}s"
