"""A drilling program in G-code: its holes, and what its lines say beside their places."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from tcp.files.excellon.numbers import PLACES
from tcp.files.excellon.program import Place, Program


@dataclass(frozen=True)
class Move:
    """Where a line with X or Y leads.

    Parameters
    ----------
    place : (x, y)
        In units of ``10**-PLACES``.
    names : (bytes, bytes)
        X and Y as the program writes them, or would write them in G90.
    incremental : bool
        Whether the line is in G91.
    """

    place: Place
    names: tuple[bytes, bytes]
    incremental: bool = False


@dataclass(frozen=True, eq=False)
class GProgram(Program):
    """A drilling program: a :class:`Program` whose units know what else their lines say.

    Parameters
    ----------
    keys : tuple of str
        For each hole everything but its place: what must be equal to change places.
    moves : mapping of line to Move
        Where lines with X or Y lead.
    approaches : mapping of line to line
        Rapids to the place of a hole, and the line of that hole: both lead to one place.
    """

    keys: tuple[str, ...] = ()
    moves: Mapping[int, Move] = field(default_factory=dict)
    approaches: Mapping[int, int] = field(default_factory=dict)


def named(value: int) -> bytes:
    """A value in units of ``10**-PLACES`` as a word's number, with a point."""
    bare = b"%0*d" % (PLACES + 1, abs(value))
    return (b"-" if value < 0 else b"") + bare[:-PLACES] + b"." + bare[-PLACES:].rstrip(b"0")
