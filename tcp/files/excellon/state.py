"""The machine's state while it reads a file, and the units it has found so far.

What a line does depends on the unit, number format, tool, mode (drill or
rout), absolute or incremental input and the last position; :class:`State`
carries all of that and nothing else.
"""

from __future__ import annotations

import re
from array import array
from pathlib import Path
from typing import NoReturn

from tcp.errors import InputError
from tcp.files.excellon.document import Document
from tcp.files.excellon.program import (
    Copy,
    Kind,
    Mark,
    Motion,
    Pattern,
    Place,
    Repeat,
    Selection,
    Tool,
)
from tcp.files.excellon.settings import Settings
from tcp.words import listed

NUMBER = rb"[+-]?(?:\d++(?:\.\d*+)?|\.\d++)"
"""Digits with an optional point and sign; possessive, so that no line takes quadratic time."""

MOST = 20_000_000
"""Most holes of a file, repeats and copies expanded; a few lines could ask for more than memory."""

DRILL, ROUT = 0, 1

Words = list[tuple[str, bytes]]


class State:
    """Everything that a line can read and change."""

    def __init__(self, document: Document, path: Path, settings: Settings):
        self.document, self.path, self.settings = document, path, settings
        self.tools: dict[int, Tool] = {}
        self.plated: bool | None = None
        self.stated: dict[int, int] = dict(settings.sidecar.counts) if settings.sidecar else {}
        self.notes: list[str] = []
        self.header = self.ended = False
        self.format_1 = False
        self.incremental = False
        self.by_stops = False
        self.tool: int | None = None
        self.mode, self.motion, self.down = DRILL, 0, False
        self.compensated = False
        self.x: int | None = None
        self.y: int | None = None
        self.zero = [0, 0]
        self.at = 0
        self.columns = tuple(array(code) for code in "biqqqqiiii")
        self.barrier = 0
        self.singly = 0  # lines before this one are read one by one
        self.jumps: dict[int, Place | None] = {}
        self.repeats: dict[int, list[Repeat]] = {}
        self.routes: dict[int, tuple[Motion, ...]] = {}
        self.open: list[Motion] = []
        self.open_first = 0
        self.open_mark = Mark(0)
        self.open_state = (0, False)
        self.selections: list[Selection] = []
        self.patterns: list[Pattern] = []
        self.pattern_from: int | None = None
        self.pattern_line = 0
        self.pattern_named = False
        self.pattern: tuple[int, int] | None = None
        self.further = 0  # holes that repeats and copies have made
        self.before_pattern = self.in_pattern = 0
        self.pattern_codes = self.pattern_enter = 0
        self.gates: list[tuple[int, int, bool]] = []
        self.copies: list[Copy] = []

    def refuse(self, message: str) -> NoReturn:
        """Give up at the current line."""
        raise InputError(message, self.path, self.at + 1)

    def note(self, message: str) -> None:
        """Say something about the current line."""
        self.notes.append(f"line {self.at + 1}: {message}")

    @property
    def holes(self) -> int:
        """Holes so far, repeats and copies expanded."""
        return len(self.columns[0]) + self.further

    def _multiply(self, further: int) -> None:
        """Count holes that repeats and copies make, before anything is built of them."""
        self.further += further
        if self.holes > MOST:
            self.refuse(f"the file makes {self.holes:,} holes up to here; at most {MOST:,}")

    def _barrier(self) -> None:
        """No unit may move across this line."""
        self.barrier += 1

    def _place(self, x: bytes | None, y: bytes | None) -> tuple[int, int]:
        """The position that the coordinates of this line lead to."""
        line = self.at + 1
        value = self.settings.value
        if self.incremental:
            if self.x is None and self.columns[0]:
                self.refuse("an incremental step from a position that the file leaves open")
            self.x = (self.x or 0) + (value(x, line) if x else 0)
            self.y = (self.y or 0) + (value(y, line) if y else 0)
            return self.x, self.y
        if x:
            self.x = value(x, line)
        if y:
            self.y = value(y, line)
        if self.x is None or self.y is None:
            missing = "X" if self.x is None else "Y"
            self.refuse(f"{missing} is omitted, but no line before states it")
        assert self.x is not None and self.y is not None
        return self.x, self.y

    def _begin(self) -> None:
        """A unit begins: note where the machine is, if not where the last unit left it."""
        row = len(self.columns[0])
        here = None if self.x is None or self.y is None else (self.x, self.y)
        if here is None and self.incremental and not row:
            here = (0, 0)
        left = (self.columns[4][-1], self.columns[5][-1]) if row else None
        self.jumps.pop(row, None)
        if here != left:
            self.jumps[row] = here

    def _row(self, kind: Kind, ends: tuple[int, int, int, int], first: int, mark: int) -> int:
        """Append a unit that ends with the current line."""
        if self.tool is None:
            self._no_tool()
        if self.pattern is not None and self.pattern_from is None:
            self._close_pattern()
            self.pattern_from, self.pattern_line = len(self.columns[0]), self.at
            self.before_pattern = self.holes
            self.pattern_named = False
        if self.incremental:
            mark |= Mark.INCREMENTAL
        assert self.tool is not None
        row = (int(kind), self.tool, *ends, first, self.at + 1, mark, self.barrier)
        for column, value in zip(self.columns, row, strict=True):
            column.append(value)
        return len(self.columns[0]) - 1

    def _no_tool(self) -> None:
        data = self.document.data
        if self.selections or re.search(rb"(?m)^[ \t]*T\d", data):
            reason = "no tool is selected" if not self.selections else "T0 has unloaded the tool"
            self.refuse(f"coordinates while {reason}; expected a tool selection such as T1 before")
        if not self.tools:
            self.refuse("coordinates before any tool; expected a tool selection such as T1")
        self.by_stops = True
        self._take(min(self.tools))

    def _take(self, tool: int) -> None:
        self.tool = tool
        self.selections.append(Selection(tool, self.at, len(self.columns[0])))
        self._barrier()

    def _hit(self, x: bytes | None, y: bytes | None) -> None:
        self._begin()
        px, py = self._place(x, y)
        complete = Mark.COMPLETE if x and y and not self.incremental else 0
        self._row(Kind.HIT, (px, py, px, py), self.at, complete)

    def select(self, words: Words) -> None:
        """``T3`` selects; ``T3C.015`` defines and, outside a header, selects."""
        number = code_of(words[0][1]) if words[0][1].isdigit() else -1
        if number < 0:
            self.refuse("T without a tool number")
        sizes = [text for letter, text in words[1:] if letter == "C"]
        if len(sizes) > 1:
            self.refuse(f"T{number} has several diameters on its line; expected one C")
        unknown = [letter for letter, _ in words[1:] if letter not in "CFSHBZIUVO"]
        if unknown:
            self.refuse(f"{unknown[0]!r} in a tool line is not understood; expected C, F or S")
        if sizes or self.header:
            self.define(number, sizes[0] if sizes else b"")
        if self.header:
            return
        self._flush_open()
        if number == 0 and 0 not in self.tools:
            self.tool = None
            self._barrier()
            return
        if number not in self.tools:
            if any(tool.line for tool in self.tools.values()):
                defined = listed(t.name for t in self.tools.values())
                self.refuse(f"T{number} is not defined; the file defines {defined}")
            self.tools[number] = Tool(number)
        self._take(number)

    def define(self, number: int, size: bytes) -> None:
        """A tool definition with its diameter as written; one without keeps a known diameter."""
        tool = Tool(number, self.settings.length(size, self.at + 1), self.plated, self.at + 1)
        known = self.tools.get(number)
        if known and known.line and known.diameter is not None:
            if tool.diameter not in (None, known.diameter):
                self.refuse(
                    f"T{number} is defined again with another diameter (first on line {known.line})"
                )
            return
        self.tools[number] = tool

    def _flush_open(self) -> None:
        """End a rout that no M16 ends; see :class:`~tcp.files.excellon.routing.Routing`."""

    def _close_pattern(self, by_name: bool = False) -> None:
        """End a step-and-repeat block, by M08 or by whatever follows it.

        Its gate, the barriers before and behind it and whether none but its
        own commands stand inside, tells later whether it may move.
        """
        if self.pattern is not None and self.copies and self.pattern[0] < self.pattern[1]:
            lines = (self.pattern_line, self.at)
            self.patterns.append(Pattern(*self.pattern, tuple(self.copies), lines))
            alone = self.barrier - self.pattern_enter == self.pattern_codes
            self.gates.append((self.pattern_enter, self.barrier, by_name and alone))
        self.pattern, self.copies = None, []


def code_of(text: bytes) -> int:
    """The number of a G- or M-code; -1, which nothing knows, where it is none."""
    return int(text) if text.isdigit() and len(text) < 5 else -1
