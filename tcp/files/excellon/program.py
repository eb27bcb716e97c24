"""What a drill file means: its units of work, tools and stretches of free order.

A *unit* is the smallest piece of text that can change places: a hit with its
``R`` repeats, a slot, a routed path.  A *stretch* is a run of units whose
order is free; everything the reader knows to be sensitive to order (a tool
change, a dwell, a message, a path that must keep its direction) ends one.
Units are columns of integers, not objects: a million hits are 60 MB.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, field
from enum import IntEnum, IntFlag
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tcp.files.excellon.document import Document, Ints
from tcp.files.excellon.numbers import PLACES, Style, Units

Place = tuple[int, int]
Ints32 = NDArray[np.int32]


class Kind(IntEnum):
    """What a unit does."""

    HIT = 1
    SLOT = 2
    ROUTE = 3
    CANNED = 4
    BLOCK = 5  # a whole step-and-repeat block, in a folded program
    PASS = 6  # a rapid to a place where nothing is drilled, in a G-code program


class Mark(IntFlag):
    """What the writer has to know about a unit."""

    COMPLETE = 1  # its first coordinates name both axes
    INCREMENTAL = 2  # written in G91
    FREE = 4  # may be worked from either end
    DRILLS_AFTER = 8  # a routed path that ends with G05
    PLUNGED = 16  # a routed path with M15
    FIXED = 32  # stays where it is


@dataclass(frozen=True)
class Tool:
    """A tool as the file defines it.

    Parameters
    ----------
    number : int
        Its number.
    diameter : Fraction or None
        Millimetres, None where the file does not say.
    plated : bool or None
        Whether its holes are plated, None where the file does not say.
    line : int
        Where it is defined, from 1; 0 for a tool that is only selected.
    """

    number: int
    diameter: Fraction | None = None
    plated: bool | None = None
    line: int = 0

    @property
    def name(self) -> str:
        """``T3``."""
        return f"T{self.number}"


@dataclass(frozen=True)
class Repeat:
    """``R``: so many further hits, each so far from the one before; the line it stands on."""

    count: int
    dx: int
    dy: int
    line: int


@dataclass(frozen=True)
class Motion:
    """One move of a routed path: G-code, target, arc words as written, and its line."""

    code: int
    x: int
    y: int
    arc: tuple[tuple[str, int], ...] = ()
    line: int = 0


@dataclass(frozen=True)
class Copy:
    """One repetition of a pattern: shift, then (before it) axes swapped or mirrored."""

    dx: int
    dy: int
    swap: bool = False
    mirror_x: bool = False
    mirror_y: bool = False

    def place(self, x: Ints, y: Ints) -> tuple[Ints, Ints]:
        """Where the pattern's points come to lie."""
        if self.swap:
            x, y = y, x
        return (-x if self.mirror_x else x) + self.dx, (-y if self.mirror_y else y) + self.dy


@dataclass(frozen=True)
class Pattern:
    """A step-and-repeat block: units ``first .. last - 1``, drilled once and once a copy.

    Parameters
    ----------
    first, last : int
        Its units.
    copies : tuple of Copy
        What is repeated.
    lines : (int, int)
        Its first line (M25) and its last (M08).
    movable : bool
        Whether the block as a whole depends on nothing around it, and nothing on it.
    joins : (bool, bool)
        Whether the units before and behind it may change places with it.
    """

    first: int
    last: int
    copies: tuple[Copy, ...]
    lines: tuple[int, int]
    movable: bool = False
    joins: tuple[bool, bool] = (False, False)


@dataclass(frozen=True)
class Selection:
    """A stretch of the file with one tool: its first unit, and the line that selects it."""

    tool: int
    line: int
    first: int


@dataclass(frozen=True, eq=False)
class Columns:
    """One row a unit, in file order; coordinates in the file's own integer units.

    ``x2`` and ``y2`` are the same arrays as ``x1`` and ``y1`` where all units are points.
    """

    kind: NDArray[np.int8]
    tool: Ints32
    x1: Ints
    y1: Ints
    x2: Ints
    y2: Ints
    first: Ints32
    last: Ints32
    mark: NDArray[np.int16]
    stretch: Ints32

    def __len__(self) -> int:
        return len(self.kind)


@dataclass(frozen=True, eq=False)
class Program:
    """A drill file, read.

    Parameters
    ----------
    path : Path
        Where it came from.
    document : Document
        Its text.
    units : Units
        Its unit of length.
    step : Fraction
        Millimetres to one of its own integer units.
    style : Style
        How it writes numbers.
    tools : mapping of int to Tool
        Tools by number, in the order of their definition.
    rows : Columns
        The units.
    repeats, routes : mapping of row to repeats, motions
        What a hit and a routed path consist of.
    patterns : tuple of Pattern
        Step-and-repeat blocks.
    selections : tuple of Selection
        Tool selections in file order.
    jumps : mapping of row to place
        Where the machine is when it comes to a unit, for units that do not begin where the
        unit before ends: the first one, and those behind a line that moves the machine
        without work (M02, a lone G00).  None where the file leaves it open.
    notes : tuple of str
        Warnings and choices worth telling.
    unclear : mapping of int to str
        Positions of the selections with lines that are not understood, and the first such
        line: their order stays, and nothing is proved of it.
    uncounted : frozenset of int
        Those of which not even all places are known.
    offsets : mapping of tool to set of str
        Work offsets (``54`` for G54) in which a tool drills: how far they are apart, only
        the machine knows.
    weights : mapping of row to int
        Holes that a folded step-and-repeat block makes; see ``blocks.folded``.
    """

    path: Path
    document: Document
    units: Units
    step: Fraction
    style: Style
    tools: Mapping[int, Tool]
    rows: Columns
    repeats: Mapping[int, tuple[Repeat, ...]]
    routes: Mapping[int, tuple[Motion, ...]]
    patterns: tuple[Pattern, ...]
    selections: tuple[Selection, ...]
    jumps: Mapping[int, Place | None] = field(default_factory=dict)
    notes: tuple[str, ...] = field(default=())
    unclear: Mapping[int, str] = field(default_factory=dict)
    uncounted: frozenset[int] = frozenset()
    offsets: Mapping[int, Set[str]] = field(default_factory=dict)
    weights: Mapping[int, int] = field(default_factory=dict)

    @property
    def finer(self) -> int:
        """Units of ``10**-PLACES`` to one of the file's own: files of any resolution compare."""
        return int(10**PLACES * self.step / self.units.in_mm)

    @property
    def hits(self) -> int:
        """Round holes drilled, repeats and copies expanded."""
        return int(self._drilled(Kind.HIT).sum())

    @property
    def slots(self) -> int:
        """G85 slots, copies expanded."""
        return int(self._drilled(Kind.SLOT).sum())

    @property
    def routed(self) -> int:
        """Routed paths with a plunge (M15), copies expanded."""
        plunged = (self.rows.mark & Mark.PLUNGED) != 0
        return int(self._drilled(Kind.ROUTE)[plunged].sum())

    def drilled(self, tool: int) -> int:
        """Holes, slots and paths of one tool."""
        return int(self.times()[self.rows.tool == tool].sum())

    def times(self) -> Ints:
        """How many holes (or slots, or paths) each unit makes."""
        times = np.ones(len(self.rows), dtype=np.int64)
        for row, repeats in self.repeats.items():
            times[row] += sum(r.count for r in repeats)
        for row, count in self.weights.items():
            times[row] = count
        for pattern in self.patterns:
            times[pattern.first : pattern.last] *= 1 + len(pattern.copies)
        times[self.rows.kind == Kind.PASS] = 0
        return times

    def _drilled(self, kind: Kind) -> Ints:
        return np.where(self.rows.kind == kind, self.times(), 0)

    @property
    def used(self) -> tuple[int, ...]:
        """Tools that do any work, by first use."""
        seen = dict.fromkeys(s.tool for s in self.selections)
        busy = set(np.unique(self.rows.tool).tolist())
        return tuple(tool for tool in seen if tool in busy)

    def stretches(self) -> Iterator[tuple[int, int]]:
        """Row ranges whose order is free."""
        edges = np.flatnonzero(np.diff(self.rows.stretch)) + 1
        bounds = [0, *edges.tolist(), len(self.rows)]
        yield from ((a, b) for a, b in pairwise(bounds) if b > a)

    def selection_of(self, row: int) -> int:
        """Position in :attr:`selections` of the selection that a unit belongs to."""
        firsts = [s.first for s in self.selections]
        return int(np.searchsorted(firsts, row, side="right")) - 1


def repeated(x: int, y: int, repeats: tuple[Repeat, ...]) -> Iterator[Place]:
    """All hits of a unit: the first one, and its repeats."""
    yield x, y
    for repeat in repeats:
        for _ in range(repeat.count):
            x, y = x + repeat.dx, y + repeat.dy
            yield x, y
