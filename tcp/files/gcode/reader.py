"""Drilling programs in G-code: which holes they drill, and which of them may change places.

Understood are the canned cycles G81, G82, G83 and G73 with modal X, Y, Z, R,
Q and P, and holes made of a rapid to a place, a plunge and a retract (G0/G1).
Two neighbouring holes may change places if everything but X and Y is the same
for both: cycle, depths, feed, speed, retract mode, work offset.  Incremental
moves (G91) lead from where the program has come to; a cycle in G91 is taken
where R and Z stand on its first line only, so that all its holes are alike.
Whatever is not understood makes its tool section stay as it is, and is named.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path

import numpy as np

from tcp.errors import InputError, shown
from tcp.files.excellon.document import Document, cut
from tcp.files.excellon.numbers import PLACES, Style, Units, pointed
from tcp.files.excellon.program import Columns, Kind, Mark, Place, Program, Selection, Tool
from tcp.files.excellon.settings import Hints

_COMMENT = re.compile(rb"\([^()]*\)|;.*")
_WORD = re.compile(rb"[ \t]*([A-Za-z])[ \t]*([+-]?(?:\d+\.?\d*|\.\d+))[ \t]*")
_LEANING = re.compile(rb"[XYIJO#xyijo]")
_CYCLES = {"81", "82", "83", "73"}
_STATE = {"17", "40", "49", "54", "55", "56", "57", "58", "59", "61", "64", "94", "98", "99"}
_AUXILIARY = {"0", "1", "3", "4", "5", "7", "8", "9"}
_LETTERS = set("GMTXYZRQPLFSNH")

Coordinate = tuple[int, bytes]


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
    leaning : frozenset of int
        Lines that are not understood and may depend on where the machine stands.
    """

    keys: tuple[str, ...] = ()
    moves: Mapping[int, Move] = field(default_factory=dict)
    leaning: frozenset[int] = frozenset()


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
        self.z = ""
        self.hover: tuple[int, str] | None = None
        self.plunge: list[str] = []
        self.depth = Decimal(0)
        self.levels: set[str] = set()
        self.tool, self.pending = 0, 0
        self.at = self.barrier = self.places = 0
        self.columns = tuple(array("q") for _ in range(7))
        self.keys: list[str] = []
        self.moves: dict[int, Move] = {}
        self.selections = [Selection(0, 0, 0)]
        self.atomic: dict[int, str] = {}
        self.leaning: set[int] = set()
        self.ended = False

    def run(self) -> GProgram:
        """Read every line."""
        for at in range(len(self.document)):
            self.at = at
            line = self.document.line(at).strip()
            if line in (b"", b"%") or self.ended:
                continue
            self._line(line)
        self._end_plunge()
        return self._finish()

    def _line(self, line: bytes) -> None:
        bare = _COMMENT.sub(b"", line).strip()
        if not bare:
            return
        words = []
        for piece in _COMMENT.split(line):  # a comment never stands inside a word
            at, piece = 0, piece.strip()
            while at < len(piece):
                found = _WORD.match(piece, at)
                if found is None:
                    self._stubborn(bare)
                    return
                words.append((found[1].decode().upper(), found[2]))
                at = found.end()
        letters = [letter for letter, _ in words]
        repeated = {c for c in letters if letters.count(c) > 1 and c not in "GM"}
        if not set(letters) <= _LETTERS or repeated:
            self._stubborn(bare)
            return
        self._block(words, bare)

    def _stubborn(self, bare: bytes, reason: str = "is not understood") -> None:
        """What is not understood keeps the whole tool section as it is."""
        note = f"line {self.at + 1}: {shown(bare)} {reason}"
        self.atomic.setdefault(len(self.selections) - 1, note)
        if _LEANING.search(bare):
            self.leaning.add(self.at)
        self._end_plunge()
        self.motion, self.x, self.y, self.z = "", None, None, ""
        self.barrier += 1

    def _block(self, words: list[tuple[str, bytes]], bare: bytes) -> None:
        codes = [_number(text) for letter, text in words if letter == "G"]
        values = {letter: text for letter, text in words if letter not in "GMN"}
        moving = {"X", "Y", "Z"} & values.keys()
        if not re.fullmatch(rb"\+?\d{1,6}(\.0*)?", values.get("T", b"0")):
            self._stubborn(bare)
            return
        for code in codes:
            if not self._code(code):
                self._stubborn(bare)
                return
        for code in (_number(text) for letter, text in words if letter == "M"):
            if not self._auxiliary(code, values):
                self._stubborn(bare)
                return
        if "T" in values:
            self.pending = int(values["T"].split(b".")[0])
            self.barrier += 1
        for letter in "FS":
            if letter in values:
                self.state[letter] = _number(values[letter])
        if "4" in codes:
            if self.hover is not None:
                self.plunge.append(f"G4 P{_number(values.get('P', b'0'))}")
            else:
                self.barrier += 1
        elif self.motion in _CYCLES:
            self._drill(values, bool(codes), bare)
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
        elif code in ("0", "1", "80") or code in _CYCLES:
            if code != self.motion and (code in _CYCLES or self.motion in _CYCLES):
                self._end_plunge()
                self.cycle = {}
                self.barrier += 1
            self.motion = "" if code == "80" else code
        elif code in ("98", "99"):
            self.state["retract"] = code
        elif code in _STATE:
            self.state[f"G{code}"] = code
            self.barrier += 1
        else:
            return code == "4"
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
            tool = int(values["T"].split(b".")[0]) if "T" in values else self.pending
            self.tool = self.pending = tool
            self.selections.append(Selection(tool, self.at, len(self.columns[0])))
        return code in _AUXILIARY or code in ("2", "30", "6")

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

    def _drill(self, values: dict[str, bytes], named: bool, bare: bytes) -> None:
        """A line while a cycle is active: it drills where it names X or Y."""
        again = not self.absolute and bool(self.cycle) and bool({"Z", "R"} & values.keys())
        self.cycle |= {c: _number(values[c]) for c in "ZRQP" if c in values}
        if "L" in values and _number(values["L"]) != "1":
            self._stubborn(bare)
            return
        if again:
            self._stubborn(bare, "changes the depth of a cycle in G91")
            return
        if not {"X", "Y"} & values.keys():
            if named and {"Z", "R"} & values.keys():
                self._stubborn(bare)
            return
        if not self._place(values):
            self._stubborn(bare, "starts from a place that the program does not state")
            return
        mode = "90" if self.absolute else "91"
        key = f"G{self.motion} {sorted(self.cycle.items())} {sorted(self.state.items())} {self.z}"
        self._row(self.at, f"G{mode} {key}")

    def _move(self, values: dict[str, bytes], bare: bytes) -> None:
        """A G0 or G1 line: a way to a place, a plunge, or a retract."""
        level, flat = {"Z"} & values.keys(), {"X", "Y"} & values.keys()
        if self.motion not in ("0", "1") or (level and flat and self.hover and self.plunge):
            self._stubborn(bare)
            return
        if flat:
            self._end_plunge()
            known = self._place(values)
            if self.motion == "1" or level or not known:
                self.barrier += 1
                if level:
                    self.z = _number(values["Z"]) if self.absolute else ""
                if self.motion == "1" or not self.absolute:
                    self._stubborn(bare)
                return
            self.hover = self.at, self.z
            return
        height = _number(values["Z"])
        if self.hover is None:
            self.z = height if self.absolute else ""
            self.barrier += 1
            return
        feed = self.state.get("F", "") if self.motion == "1" else ""
        by = "" if self.absolute else "by "
        self.plunge.append(f"G{self.motion} Z{by}{height} F{feed}")
        if self.absolute:
            here, self.z = height, height
        else:
            self.depth += Decimal(height)
            here, self.z = f"by {self.depth.normalize()}", "" if self.depth else self.hover[1]
        if not self._cut:
            self.levels.add(here)  # an approach, from which the plunge begins
        elif here in self.levels or here in (self.hover[1], "by 0"):
            self._end_plunge(closed=True)

    @property
    def _cut(self) -> bool:
        """Whether the plunge has begun to drill."""
        return any(move.startswith("G1") for move in self.plunge)

    def _end_plunge(self, closed: bool = False) -> None:
        """Close the hole that a plunge made; one that does not come back up is left alone."""
        if self.hover is not None and self.plunge:
            if closed and self._cut:
                key = f"{self.plunge} from {self.hover[1]} {sorted(self.state.items())}"
                self._row(self.hover[0], key)
            else:
                self.barrier += 1
        self.hover, self.plunge, self.depth, self.levels = None, [], Decimal(0), set()

    def _row(self, first: int, key: str) -> None:
        assert self.x is not None and self.y is not None
        if self.keys and key != self.keys[-1]:
            self.barrier += 1
        row = (self.tool, self.x[0], self.y[0], first, self.at + 1, self.barrier, 0)
        for column, value in zip(self.columns, row, strict=True):
            column.append(value)
        self.keys.append(key)

    # -- the end ---------------------------------------------------------------------------

    def _finish(self) -> GProgram:
        if not self.keys:
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
            for n, reason in self.atomic.items()
            if n in busy
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
            keys=tuple(self.keys),
            moves=self.moves,
            leaning=frozenset(self.leaning),
        )

    def _selection(self, row: int) -> int:
        return sum(s.first <= row for s in self.selections) - 1

    def _rows(self) -> Columns:
        finer = 10 ** (PLACES - self.places)
        tool, x, y, first, last, barrier, _ = (
            np.frombuffer(column, dtype=np.int64) for column in self.columns
        )
        n = len(x)
        part = np.searchsorted([s.first for s in self.selections], np.arange(n), side="right") - 1
        fixed = np.isin(part, list(self.atomic))
        edge = (np.diff(barrier) != 0) | fixed[1:] | fixed[:-1] | (np.diff(part) != 0)
        mark = np.where(fixed, int(Mark.FIXED), 0) | int(Mark.COMPLETE)
        x, y = x // finer, y // finer
        kind = np.full(n, int(Kind.HIT), dtype=np.int8)
        stretch = np.concatenate(([0], np.cumsum(edge)))
        return Columns(
            kind,
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


def named(value: int) -> bytes:
    """A value in units of ``10**-PLACES`` as a word's number, with a point."""
    bare = b"%0*d" % (PLACES + 1, abs(value))
    return (b"-" if value < 0 else b"") + bare[:-PLACES] + b"." + bare[-PLACES:].rstrip(b"0")


def _number(text: bytes) -> str:
    """A number in its shortest form: ``01.50`` is ``1.5``, ``-0`` is ``0``."""
    sign = "-" if text.startswith(b"-") else ""
    head, _, tail = text.decode().lstrip("+-").partition(".")
    head, tail = head.lstrip("0") or "0", tail.rstrip("0")
    bare = f"{head}.{tail}" if tail else head
    return bare if bare == "0" else sign + bare
