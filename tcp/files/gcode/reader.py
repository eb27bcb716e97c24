"""Drilling programs in G-code: which holes they drill, and which of them may change places.

Understood are the canned cycles of drilling, tapping and boring with modal X, Y,
Z, R, Q and P, and holes made of a rapid to a place, a plunge and a retract (G0/G1).
Two neighbouring holes may change places if everything but X and Y is the same
for both: cycle, depths, feed, speed, retract mode, work offset, tool length
offset.  Incremental moves (G91) lead from where the program has come to; a
cycle in G91 is taken where R and Z stand on its first line only, so that all
its holes are alike.  A rapid to the next hole's place goes with that hole; one
to anywhere else stays, and its travel counts.  Whatever is not understood makes
its tool section stay as it is, and is named.  Where the program does not tell how
long a way is (to a place of the machine's own, into another work offset), the
holes before and behind it stay: nothing that is not known gets longer.
"""

from __future__ import annotations

import re
from array import array
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import numpy as np

from tcp.errors import InputError
from tcp.files.excellon.document import Document, cut
from tcp.files.excellon.numbers import PLACES, Style, Units, pointed
from tcp.files.excellon.program import Columns, Kind, Mark, Place, Selection, Tool
from tcp.files.excellon.settings import Hints
from tcp.files.gcode.codes import (
    ARCS,
    AUXILIARY,
    CYCLES,
    FIRST_OFFSET,
    GROUP,
    HOME,
    LENGTH,
    PLAIN,
    STATE,
    STRANGE,
)
from tcp.files.gcode.plunge import Hover, retracted
from tcp.files.gcode.program import GProgram, Move, named
from tcp.files.gcode.words import Words, shortest, uncommented, words_of
from tcp.words import shown

_LEANING = re.compile(rb"[XYIJO#xyijo]")
_WORKING = re.compile(rb"[XYxy]|[Mm][ \t]*0*98(?!\d)|[Gg][ \t]*0*6[56](?!\d)")
_PROGRAM = re.compile(rb"[Oo]\d{1,8}")
_CHANGE = re.compile(rb"[Mm][ \t]*0*6(?!\d)")
_MODES = re.compile(rb"[Gg][ \t]*0*(20|21|90|91|1[5-9]|5[01]|6[6-9]|68\.2|1[23]\.1)(?![\d.])")
Coordinate = tuple[int, bytes]


def parse(data: bytes, path: str | Path = "program", hints: Hints | None = None) -> GProgram:
    """Read a drilling program from bytes.

    Raises
    ------
    InputError
        If it is no text, states no units, or drills nothing that is understood.
    """
    path = Path(path)
    if b"\0" in data:
        line = data.count(b"\n", 0, data.index(b"\0")) + 1
        raise InputError("holds a NUL byte; expected G-code text", path, line)
    if not data.strip():
        raise InputError("the file is empty; expected a G-code program", path)
    return _Reader(cut(data), path, hints or Hints()).run()


class _Reader:
    """The state of the machine while it reads a program."""

    def __init__(self, document: Document, path: Path, hints: Hints):
        self.document, self.path, self.hints = document, path, hints
        self.units = hints.units
        self.units_line = 0
        self.absolute = True
        self.motion = ""
        self.state: dict[str, str] = {}
        self.cycle: dict[str, str] = {}
        self.x: tuple[int, bytes] | None = None
        self.y: tuple[int, bytes] | None = None
        self.z: Decimal | None = None
        self.hover: Hover | None = None
        self.plunge: list[tuple[str, Decimal]] = []
        self.depth = Decimal(0)
        self.waiting: list[Hover] = []
        self.tool, self.pending = 0, 0
        self.changes = _CHANGE.search(uncommented(document.data)) is not None
        self.at = self.barrier = self.places = 0
        self.columns = tuple(array("q") for _ in range(7))
        self.keys: list[str] = []
        self.moves: dict[int, Move] = {}
        self.approaches: dict[int, int] = {}
        self.selections = [Selection(0, 0, 0)]
        self.atomic: dict[int, str] = {}
        self.uncounted: set[int] = set()
        self.strange: dict[str, str] = {}
        self.pinned: set[int] = set()
        self.offsets: dict[int, set[str]] = {}
        self.ended = False

    def run(self) -> GProgram:
        """Read every line."""
        for at in range(len(self.document)):
            self.at = at
            line = self.document.line(at).strip()
            if line in (b"", b"%") or self.ended:
                continue
            self._line(line)
        self._end_section()
        return self._finish()

    def _line(self, line: bytes) -> None:
        bare = uncommented(line).strip()
        if not bare or _PROGRAM.fullmatch(bare):
            return
        words = words_of(line)
        if words is None:
            self._stubborn(bare)
        else:
            self._block(words, bare)

    @property
    def section(self) -> int:
        """The tool section that is being read."""
        return len(self.selections) - 1

    def _keep(self, line: int, reason: str) -> None:
        """Keep the whole tool section as it is."""
        bare = uncommented(self.document.line(line)).strip()
        note = f"line {line + 1}: {shown(bare)} {reason}"
        self.atomic.setdefault(self.section, note)

    def _stubborn(self, bare: bytes, reason: str = "is not understood") -> None:
        """What is not understood keeps its section; the modes that it sets hold all the same."""
        if _WORKING.search(bare) and self.section not in self.uncounted:
            self.uncounted.add(self.section)
            self.atomic.pop(self.section, None)
        self._keep(self.at, reason)
        self._end_plunge()
        for mode in _MODES.findall(bare):
            self._code(mode.decode())
        if _LEANING.search(bare):
            self._lose_way()
        self.motion, self.x, self.y, self.z = "", None, None, None
        self.barrier += 1

    def _lose_way(self) -> None:
        """How far it is from the hole before to the next one is not known: both stay."""
        self.pinned |= {len(self.keys) - 1, len(self.keys)}
        self.x = self.y = self.z = None
        self.waiting = []

    def _block(self, words: Words, bare: bytes) -> None:
        codes = [shortest(text) for letter, text in words if letter == "G"]
        values = {letter: text for letter, text in words if letter not in "GMN"}
        moving = {"X", "Y", "Z"} & values.keys()
        if not re.fullmatch(rb"\+?\d{1,6}(\.0*)?", values.get("T", b"0")):
            self._stubborn(bare)
            return
        for code in codes:
            if not self._code(code):
                self._stubborn(bare)
                return
        for code in (shortest(text) for letter, text in words if letter == "M"):
            if not self._auxiliary(code, values):
                self._stubborn(bare)
                return
        if "T" in values:
            self.pending = int(values["T"].split(b".")[0])
            self.barrier += 1
            if not self.changes:  # a program without M6: the tool is changed where T is
                self._change(self.pending)
        for letter in "FS":
            if letter in values:
                self.state[letter] = shortest(values[letter])
        if "43" in codes:
            self.state["length"] = f"H{shortest(values.get('H', b'0'))}"
        if "4" in codes:
            if {"Y", "Z"} & values.keys() or {"X", "P"} <= values.keys():  # X alone is seconds
                self._stubborn(bare)
            elif self.plunge:
                self.plunge.append((f"G4 P{shortest(values.get('P', b'0'))}", self.plunge[-1][1]))
            else:
                self.barrier += 1
        elif HOME & set(codes):
            self._go_home(values, bare)
        elif self.motion in CYCLES:
            self._drill(values, bare)
        elif moving:
            self._move(values, bare)

    def _code(self, code: str) -> bool:
        """Take a G-code; False if it is not understood."""
        if code in ("20", "21"):
            self._state_units(Units.INCH if code == "20" else Units.MM)
        elif code in ("90", "91"):
            if self.absolute != (code == "90"):
                self._end_plunge()
            self.absolute = code == "90"
            self.barrier += 1
        elif code in ("0", "1", "80") or code in CYCLES:
            if code != self.motion and (code in CYCLES or self.motion in CYCLES):
                self._end_plunge()
                if self.motion in CYCLES and self.state.get("retract") == "99":
                    self.z = None
                self.cycle = {}
                self.barrier += 1
            self.motion = "" if code == "80" else code
        elif code in STRANGE:
            plain, what = STRANGE[code]
            self.strange[plain] = f"line {self.at + 1}: G{code} {what}"
            return False
        elif code in ("98", "99"):
            self.state["retract"] = code
        elif code in STATE or code in GROUP or code in LENGTH:
            self._end_plunge()
            group = "length" if code in LENGTH else GROUP.get(code, f"G{code}")
            if group == "offset" and code != self.state.get(group, FIRST_OFFSET):
                self._lose_way()
            self.state[group] = code
            self.barrier += 1
        elif code not in PLAIN:
            return code == "4" or code in HOME or code in ARCS
        self.strange.pop(code, None)
        return True

    def _state_units(self, units: Units) -> None:
        if self.units is not None and self.units is not units:
            where = f"line {self.units_line}" if self.units_line else "--units"
            raise InputError(
                f"states {units}, but {where} says {self.units}", self.path, self.at + 1
            )
        self.units, self.units_line = units, self.units_line or self.at + 1

    def _auxiliary(self, code: str, values: dict[str, bytes]) -> bool:
        """Take an M-code; False if it is not understood."""
        self._end_plunge()
        self.barrier += 1
        if code in ("2", "30"):
            self.ended = True
        elif code == "6":
            self._change(int(values["T"].split(b".")[0]) if "T" in values else self.pending)
        return code in AUXILIARY or code in ("2", "30", "6")

    def _change(self, tool: int) -> None:
        """A section of another tool begins."""
        self._end_section()
        self.tool = self.pending = tool
        self.selections.append(Selection(tool, self.at, len(self.columns[0])))
        if self.strange:
            self.atomic[self.section] = next(iter(self.strange.values()))
            self.uncounted.add(self.section)

    def _end_section(self) -> None:
        """Where a tool goes after its last hole counts; a section without holes is none."""
        self._end_plunge()
        if len(self.columns[0]) > self.selections[-1].first:
            self._pass(self.waiting)
        self.waiting = []

    # -- places ----------------------------------------------------------------------------

    def _place(self, values: dict[str, bytes]) -> bool:
        """Take X and Y; False if the place is not known."""
        self.x = self._axis(values.get("X"), self.x)
        self.y = self._axis(values.get("Y"), self.y)
        if self.x is None or self.y is None:
            return False
        if "X" in values or "Y" in values:
            (x, x_name), (y, y_name) = self.x, self.y
            self.moves[self.at] = Move((x, y), (x_name, y_name), not self.absolute)
        return True

    def _axis(self, text: bytes | None, before: tuple[int, bytes] | None) -> Coordinate | None:
        """One axis behind a word; None where it leads on from nobody knows where."""
        if text is None:
            return before
        value = self._value(text)
        if self.absolute:
            return value, text
        return None if before is None else (before[0] + value, named(before[0] + value))

    def _value(self, text: bytes) -> int:
        if self.units is None:
            raise InputError(
                "the program does not state its units (G20, G21); pass --units mm or --units inch",
                self.path,
                self.at + 1,
            )
        try:
            value, places = pointed(text if b"." in text else text + b".")
        except ValueError:
            message = f"{shown(text)} is no coordinate of a board"
            raise InputError(message, self.path, self.at + 1) from None
        self.places = max(self.places, places)
        return value

    def _drill(self, values: dict[str, bytes], bare: bytes) -> None:
        """A line while a cycle is active: it drills where it names X or Y."""
        again = not self.absolute and bool(self.cycle) and bool({"Z", "R"} & values.keys())
        self.cycle |= {c: shortest(values[c]) for c in "ZRQP" if c in values}
        if "L" in values and shortest(values["L"]) != "1":
            self._stubborn(bare)
            return
        if again:
            self._stubborn(bare, "changes the depth of a cycle in G91")
            return
        if not {"X", "Y"} & values.keys():
            if {"Z", "R"} & values.keys():
                self.uncounted.add(self.section)
                self._stubborn(bare, "drills again where the tool stands")
            return
        if not self._place(values):
            self._stubborn(bare, "starts from a place that the program does not state")
            return
        mode = "90" if self.absolute else "91"
        key = f"G{self.motion} {sorted(self.cycle.items())} {sorted(self.state.items())} {self.z}"
        self._hole(self.at, f"G{mode} {key}")

    def _go_home(self, values: dict[str, bytes], bare: bytes) -> None:
        """G28, G30 or G53: to a height of the machine's own, or to a place of it."""
        if self.motion in CYCLES:
            self._stubborn(bare)
            return
        self._end_plunge()
        if "Z" not in values or {"X", "Y"} & values.keys():
            self._lose_way()
        self.z = None
        self.barrier += 1

    def _move(self, values: dict[str, bytes], bare: bytes) -> None:
        """A G0 or G1 line: a way to a place, a plunge, or a retract."""
        flat = {"X", "Y"} & values.keys()
        rises = not flat and self.absolute and Decimal(shortest(values["Z"])) > (self.z or 0)
        if self.motion not in ("0", "1") and not (self.motion == "" and rises):
            self._stubborn(bare)
            return
        if not flat:
            self._vertical(Decimal(shortest(values["Z"])), bare)
            return
        self._end_plunge()
        known, slanted = self._place(values), "Z" in values
        if self.motion == "1" or (slanted and not self.absolute):
            self._stubborn(bare)
            return
        if slanted:
            self.z = Decimal(shortest(values["Z"]))
        if known:
            assert self.x is not None and self.y is not None
            self.hover = Hover(self.at, (self.x[0], self.y[0]), self.z, slanted)
        if slanted or not known:
            self.barrier += 1

    def _vertical(self, height: Decimal, bare: bytes) -> None:
        """A move of Z alone."""
        before = self.z
        if self.absolute or before is not None:
            self.z = here = height if self.absolute or before is None else before + height
        else:
            here = self.depth = self.depth + height
        if self.hover is None and self.motion == "1" and here < (0 if before is None else before):
            if not self.waiting or self.x is None or self.y is None:
                self._stubborn(bare, "cuts where no rapid has led")
                return
            self.hover = replace(self.waiting.pop(), level=before)
        if self.hover is None:
            self.depth = Decimal(0)
            self.barrier += 1
            return
        feed = self.state.get("F", "") if self.motion == "1" else ""
        self.plunge.append((f"G{self.motion} Z{here.normalize()} F{feed}", here))

    def _end_plunge(self) -> None:
        """What came after a rapid was a hole, or else the rapid leads on to the next one."""
        hover, plunge = self.hover, self.plunge
        first = next((i for i, (move, _) in enumerate(plunge) if move.startswith("G1")), None)
        if hover is not None and first is None:
            self.waiting.append(hover)
        elif hover is not None and first is not None:
            relative = not self.absolute and hover.level is None
            level = Decimal(0) if relative else hover.level
            start = plunge[first - 1][1] if first else level
            heights = [height for _, height in plunge[first:]]
            levels = {level, *(height for _, height in plunge[:first])}
            end = retracted(start, heights, levels, strict=relative)
            if end is None:
                self._keep(hover.line, "drills without coming back up")
                end = len(heights) - 1
            moves, top = [move for move, _ in plunge[first : first + end + 1]], heights[end]
            over = "" if level is not None and level >= top else f"over {level}"
            down = "" if start is not None and start >= top else f"from {start}"
            self._hole(hover.line, f"{moves} {relative} {over} {down} {sorted(self.state.items())}")
            if hover.slanted or end + 1 < len(heights):
                self.barrier += 1
        self.hover, self.plunge, self.depth = None, [], Decimal(0)

    def _hole(self, line: int, key: str) -> None:
        """A hole where the machine stands; rapids to its place go with it."""
        assert self.x is not None and self.y is not None
        place = (self.x[0], self.y[0])
        while self.waiting and self.waiting[-1].place == place and not self.waiting[-1].slanted:
            self.approaches[self.waiting.pop().line] = line
        self._pass(self.waiting)
        self.waiting = []
        self.offsets.setdefault(self.tool, set()).add(self.state.get("offset", FIRST_OFFSET))
        self._row(Kind.HIT, line, place, key)

    def _pass(self, rapids: list[Hover]) -> None:
        """Rapids to where nothing is drilled."""
        for rapid in rapids:
            self._row(Kind.PASS, rapid.line, rapid.place, "pass")

    def _row(self, kind: Kind, first: int, place: Place, key: str) -> None:
        if self.keys and key != self.keys[-1]:
            self.barrier += 1
        row = (self.tool, *place, first, self.at + 1, self.barrier, int(kind))
        for column, value in zip(self.columns, row, strict=True):
            column.append(value)
        self.keys.append(key)

    # -- the end ---------------------------------------------------------------------------

    def _finish(self) -> GProgram:
        if int(Kind.HIT) not in self.columns[-1]:
            reason = "; ".join(list(self.atomic.values())[:1])
            more = f" ({reason})" if reason else ""
            raise InputError(f"drills no hole that is understood{more}", self.path)
        if not self.ended and not self.hints.unfinished:
            raise InputError(
                "ends without M2 or M30, so it may be cut off; pass --unfinished to accept it",
                self.path,
                len(self.document),
            )
        assert self.units is not None
        used = sorted({*self.columns[0]})
        busy = {self._selection(row) for row in range(len(self.keys))}
        notes = [
            f"{reason}; the order of T{self.selections[n].tool} is kept"
            + (", and its places are not all known" if n in self.uncounted else "")
            if n in busy
            else f"{reason}; what it does is left out"
            for n, reason in self.atomic.items()
            if n in busy | self.uncounted
        ]
        return GProgram(
            path=self.path,
            document=self.document,
            units=self.units,
            step=self.units.in_mm / 10**self.places,
            style=Style(self.places, None, None),
            tools={tool: Tool(tool) for tool in used},
            rows=self._rows(),
            repeats={},
            routes={},
            patterns=(),
            selections=tuple(self.selections),
            notes=tuple(notes),
            unclear=self.atomic,
            uncounted=frozenset(self.uncounted),
            keys=tuple(self.keys),
            moves=self.moves,
            approaches=self.approaches,
            offsets=self.offsets,
        )

    def _selection(self, row: int) -> int:
        return sum(s.first <= row for s in self.selections) - 1

    def _rows(self) -> Columns:
        finer = 10 ** (PLACES - self.places)
        tool, x, y, first, last, barrier, kind = (
            np.frombuffer(column, dtype=np.int64) for column in self.columns
        )
        n = len(x)
        part = np.searchsorted([s.first for s in self.selections], np.arange(n), side="right") - 1
        fixed = np.isin(part, list(self.atomic)) | (kind == Kind.PASS)
        fixed |= np.isin(np.arange(n), list(self.pinned))
        edge = (np.diff(barrier) != 0) | fixed[1:] | fixed[:-1] | (np.diff(part) != 0)
        mark = np.where(fixed, int(Mark.FIXED), 0) | int(Mark.COMPLETE)
        x, y = x // finer, y // finer
        stretch = np.concatenate(([0], np.cumsum(edge)))
        return Columns(
            kind.astype(np.int8),
            tool.astype(np.int32),
            x,
            y,
            x,
            y,
            first.astype(np.int32),
            last.astype(np.int32),
            mark.astype(np.int16),
            stretch.astype(np.int32),
        )
