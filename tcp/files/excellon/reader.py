"""From text to meaning: reads an Excellon file line by line, refusing what it does not know.

The machine is modal, so a line means something only in the machine's state:
:class:`~tcp.files.excellon.state.State` holds it, :class:`Patterns` and
:class:`Routing` add what repeats and what routs, and :class:`Reader` runs
through the lines.  Plain hits, nearly all of a file, take a short path.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tcp.errors import InputError
from tcp.files.excellon.bulk import Bools, Run, read_run
from tcp.files.excellon.dialects import find_sidecar, recognise
from tcp.files.excellon.document import Ints, cut
from tcp.files.excellon.header import header_line, note_comment
from tcp.files.excellon.numbers import PLACES
from tcp.files.excellon.program import (
    Columns,
    Copy,
    Kind,
    Mark,
    Motion,
    Pattern,
    Program,
    Repeat,
)
from tcp.files.excellon.routing import Routing
from tcp.files.excellon.settings import Hints, Settings
from tcp.files.excellon.state import NUMBER, ROUT, Words, code_of
from tcp.files.text import MAX_LINE, read_bounded
from tcp.words import shown

_HIT = re.compile(
    rb"[ \t]*+(?:X[ \t]*+(" + NUMBER + rb"))?[ \t]*+(?:Y[ \t]*+(" + NUMBER + rb"))?[ \t]*+(?:;.*)?$"
)
_RUN = re.compile(
    rb"(?:(?:X" + NUMBER + rb" *+(?:Y" + NUMBER + rb")?|Y" + NUMBER + rb") *+\r?\n){4,65536}+"
)
_WORDS = re.compile(rb"(?:[A-Z][ \t]*+(?:" + NUMBER + rb")?[ \t]*+)++$")
_WORD = re.compile(rb"([A-Z])[ \t]*+(" + NUMBER + rb")?")
_TEXT = re.compile(rb"M(45|47|97|98),?(.*)$", re.S)

NOTES = 20
"""Most notes on single lines; that there are more is one note."""

_MESSAGES_AND_STOPS = {95, 6, 9, 18, 19, 60, 61, 62, 63}


def read_program(path: str | Path, hints: Hints | None = None) -> Program:
    """Read an Excellon drill file.

    Parameters
    ----------
    path : path
        The file.
    hints : Hints, optional
        What the file itself does not state.

    Raises
    ------
    InputError
        Naming the line and the remedy, for everything that is not understood.
    """
    path = Path(path)
    return parse(read_bounded(path), path, hints)


def parse(data: bytes, path: str | Path = "drill file", hints: Hints | None = None) -> Program:
    """As :func:`read_program`, from bytes; ``path`` names them and locates sidecars."""
    path, hints = Path(path), hints or Hints()
    recognise(data, path)
    sidecar = find_sidecar(path, data, hints.sidecar)
    settings = Settings(path, hints, sidecar)
    document = cut(data)
    widths = np.diff(document.starts)
    if widths.max() > MAX_LINE:
        message = f"the line is longer than {MAX_LINE} bytes; expected one hole a line"
        raise InputError(message, path, int(widths.argmax()) + 1)
    reader = Reader(document, path, settings)
    reader.incremental = sidecar is not None and sidecar.incremental
    return reader.run()


class Reader(Routing):
    """Reads a document from its first line to its last."""

    def run(self) -> Program:
        """Read every line."""
        document, at = self.document, 0
        while at < len(document):
            self.at = at
            plain = not (self.header or self.ended or self.mode)
            runs = plain and not self.incremental and at >= self.singly
            run = self._run_of_hits(at) if runs else 0
            if run:
                at += run
                continue
            line = document.line(at).rstrip(b"\r\n")
            hit = _HIT.match(line) if plain else None
            if hit is not None and (hit[1] or hit[2]):
                self._hit(hit[1], hit[2])
            else:
                before = len(self.columns[0])
                self._line(line.strip(b" \t\x1a\x0c\xef\xbb\xbf"))
                if b"\x1a" in line and len(self.columns[0]) > before:
                    self.columns[8][-1] |= Mark.FIXED  # the end of the file, for some
            at += 1
        return self._finish()

    def _run_of_hits(self, at: int) -> int:
        """Read the plain hits that begin here all at once; how many lines they took."""
        document = self.document
        run = _RUN.match(document.data, int(document.starts[at]))
        if run is None or self.tool is None or self.x is None or self.y is None:
            return 0
        if self.pattern is not None and self.pattern_from is None:
            return 0
        words = read_run(run[0])
        values = None if words is None else self.settings.values(words.numbers)
        if words is None or values is None:
            self.singly = at + run[0].count(b"\n")
            return 0
        x, has_x = _axis(words, values, words.is_x, self.x)
        y, has_y = _axis(words, values, ~words.is_x, self.y)
        self._begin()
        n = words.lines
        first = np.arange(at, at + n)
        mark = np.where(has_x & has_y, int(Mark.COMPLETE), 0)
        same = [np.full(n, v) for v in (int(Kind.HIT), self.tool, self.barrier)]
        for column, values in zip(
            self.columns,
            (same[0], same[1], x, y, x, y, first, first + 1, mark, same[2]),
            strict=True,
        ):
            column.frombytes(values.astype(column.typecode).tobytes())
        self.x, self.y = int(x[-1]), int(y[-1])
        return n

    def _line(self, line: bytes) -> None:
        if not line or (self.ended and not line.strip(b"\0%")):
            return
        if line.startswith(b";"):
            note_comment(self, line.decode("latin-1"))
            return
        if self.ended:
            self.refuse(f"follows the end of the program ({self._m(30)}); split the file into two")
        if b";" in line:
            line = line[: line.index(b";")].rstrip()
        if line == b"M48":
            self.header = True
            self._barrier()
        elif self.header:
            header_line(self, line.decode("latin-1"))
        elif line == b"%":
            self._barrier()
        else:
            self._body(line)

    def _body(self, line: bytes) -> None:
        text = _TEXT.match(line)
        if text:
            self._barrier()
            if text[1] in (b"97", b"98"):
                self.note(f"the text drilled by M{text[1].decode()} is kept but not counted")
            return
        if self.settings.unit_line(line.decode("latin-1"), self.at + 1):
            return
        if not _WORDS.match(line):
            header_line(self, line.decode("latin-1"), strict=True)
            self._barrier()
            return
        words = [(m[1].decode(), m[2] or b"") for m in _WORD.finditer(line)]
        if words[0][0] in "GXYR" and any(c in "XYAIJ" and not text for c, text in words):
            self.refuse("a coordinate without a number; expected digits behind X and Y")
        letter = words[0][0]
        if letter == "T":
            self.select(words)
        elif letter == "R":
            self._repeat(words)
        elif letter == "M":
            self._m_code(words)
        elif letter in "GXY":
            self._move(words)
        elif {c for c, _ in words} <= set("FSBHZA") and len(words) <= 3:
            self._barrier()
        else:
            self.refuse(f"{shown(line)} is not understood; expected Excellon")

    def _m_code(self, words: Words) -> None:
        code = self._meant(code_of(words[0][1]))
        rest = words[1:]
        if rest and code != 2:
            self.refuse(
                f"{self._m(code)} with something behind it is not understood; split the line"
            )
        if code == 30:
            self._flush_open()
            self.ended = True
        elif code == 0:
            self._stop()
        elif code in (14, 15):
            self._plunge()
        elif code in (16, 17):
            self._retract()
        elif code in (25, 1, 2, 8):
            self._pattern_code(code, rest)
        elif code in _MESSAGES_AND_STOPS:
            self._barrier()
        else:
            self.refuse(
                f"{self._m(code)} is not understood; remove the line if the machine can do without"
            )

    def _stop(self) -> None:
        """M00: change to the next tool where the file has no T codes, else just a stop."""
        self._barrier()
        if not self.by_stops:
            return
        later = [n for n in self.tools if n > (self.tool or 0)]
        if not later:
            stop = self._m(0)
            self.refuse(f"{stop} changes to a tool that no comment defines; expected 'Holesize'")
        self._take(min(later))

    def _move(self, words: Words) -> None:
        if words[0][0] == "G":
            code = code_of(words[0][1])
            rest = words[1:]
            if code in (5, 81):
                routing = self.mode == ROUT
                self._drill_mode(alone=not rest)
                if not rest:
                    return
                self._drill(rest)
                if routing:  # the hole's own line ends the rout mode
                    self.columns[8][-1] |= Mark.FIXED
                return
            elif code in (0, 1, 2, 3):
                self._route(code, rest)
                return
            else:
                self._g_code(code, rest)
                return
        self._drill(words)

    def _drill(self, words: Words) -> None:
        """Coordinates, in the mode that holds."""
        letters = "".join(letter for letter, _ in words)
        if self.mode == ROUT:
            self._route(self.motion, words, named=False)
        elif letters in ("X", "Y", "XY", "YX"):
            found = dict(words)
            self._hit(found.get("X"), found.get("Y"))
        elif "G" in letters:
            self._canned(words)
        else:
            self.refuse(f"coordinates with {shown(letters)} are not understood; expected X and Y")

    def _g_code(self, code: int, rest: Words) -> None:
        if rest and code in (40, 41, 42, 90, 91):
            self.refuse(f"G{code:02d} with something behind it is not understood; split the line")
        if code in (90, 91):
            if self.incremental != (code == 91):
                self.incremental = code == 91
                self._barrier()
        elif code == 93:
            self._zero_set(dict(rest))
        elif code in (40, 41, 42):
            self.compensated = code != 40
            if not self.open:
                self._barrier()
        elif code in (4, 7):
            self._barrier()
        elif code == 85:
            self.refuse("G85 without the slot's first end; expected both on one line: X#Y#G85X#Y#")
        else:
            self.refuse(
                f"G{code:02d} is not understood; remove the line if the machine can do without"
            )

    def _zero_set(self, words: dict[str, bytes]) -> None:
        values = [self.settings.value(words.get(axis, b"") or b"0.", self.at + 1) for axis in "XY"]
        if any(values + self.zero) and (self.open or len(self.columns[0])):
            self.refuse("G93 moves the zero point between hits; write both parts as files")
        self.zero = values
        self._barrier()

    def _finish(self) -> Program:
        if not self.ended:
            if not self.settings.hints.unfinished:
                self.at = max(len(self.document) - 1, 0)
                end = self._m(30)
                self.refuse(
                    f"ends without {end}, so it may be cut off; add it or pass --unfinished"
                )
            self._flush_open()
        if self.pattern_from is not None:
            self._unended()
        self._close_pattern()
        self._multiply(0)
        if not len(self.columns[0]):
            raise InputError("holds no coordinates; expected holes to drill", self.path)
        settings = self.settings
        assert settings.units.value is not None
        finer = 10 ** (PLACES - settings.places)
        rows = self._rows(finer)
        program = Program(
            path=self.path,
            document=self.document,
            units=settings.units.value,
            step=settings.units.value.in_mm / 10**settings.places,
            style=settings.style(),
            tools=dict(self.tools),
            rows=rows,
            repeats={
                row: tuple(Repeat(r.count, r.dx // finer, r.dy // finer, r.line) for r in found)
                for row, found in self.repeats.items()
            },
            jumps={
                row: None if here is None else (here[0] // finer, here[1] // finer)
                for row, here in self.jumps.items()
            },
            routes={row: _coarsen(moves, finer) for row, moves in self.routes.items()},
            patterns=self._patterns(rows, finer),
            selections=tuple(self.selections),
            notes=tuple(self.notes[:NOTES]),
        )
        more = [f"and {n:,} more lines like these"] if (n := len(self.notes) - NOTES) > 0 else []
        return replace(program, notes=(*program.notes, *more, *self._miscounts(program)))

    def _miscounts(self, program: Program) -> list[str]:
        """Tools that drill another number of holes than comments or a report state."""
        found = {t: (n, program.drilled(t)) for t, n in self.stated.items() if t in program.used}
        return [
            f"T{tool}: {stated} holes are stated, {drilled} are drilled; is the file whole?"
            for tool, (stated, drilled) in found.items()
            if stated != drilled
        ]

    def _rows(self, finer: int) -> Columns:
        """The columns as arrays; coordinates in place, and once where all units are points."""
        kind, tool, x1, y1, x2, y2, first, last, mark, barrier = (
            np.frombuffer(column, dtype=column.typecode) for column in self.columns
        )
        for axis in (x1, y1, x2, y2):
            axis //= finer
        if np.array_equal(x1, x2) and np.array_equal(y1, y2):
            x2, y2 = x1, y1
        routed = kind == Kind.ROUTE
        sort = np.where(routed, 1 + ((mark & Mark.DRILLS_AFTER) != 0), 0)
        fixed = (mark & Mark.FIXED) != 0
        edge = (np.diff(barrier) != 0) | (np.diff(sort) != 0) | fixed[1:] | fixed[:-1]
        stretch = np.zeros(len(kind), dtype=np.int32)
        np.cumsum(edge, out=stretch[1:])
        return Columns(kind, tool, x1, y1, x2, y2, first, last, mark.astype(np.int16), stretch)

    def _patterns(self, rows: Columns, finer: int) -> tuple[Pattern, ...]:
        """The step-and-repeat blocks, and which of them may move among what."""
        found: list[Pattern] = []
        barrier, loose = self.columns[9], self._loose(rows)
        steps = bool((rows.mark & Mark.INCREMENTAL).any())  # none may follow a block's open end
        for pattern, (enter, leave, alone) in zip(self.patterns, self.gates, strict=True):
            part = slice(pattern.first, pattern.last)
            movable = alone and not steps and pattern.first < pattern.last
            movable = movable and bool(loose[part].all())
            if found and found[-1].lines[1] == pattern.lines[0]:
                movable = False  # its M25 also ends the block before
            before, behind = pattern.first - 1, pattern.last
            beside = before >= 0 and loose[before] and barrier[before] == enter
            if found and found[-1].last == pattern.first:
                beside = found[-1].movable and self.gates[len(found) - 1][1] == enter
            follows = behind < len(rows) and loose[behind] and barrier[behind] == leave
            joins = (movable and bool(beside), movable and bool(follows))
            found.append(_coarser(replace(pattern, movable=movable, joins=joins), finer))
        return tuple(found)

    def _loose(self, rows: Columns) -> NDArray[np.bool_]:
        """Units that may stand beside a block: hits and slots in absolute coordinates."""
        plain = (rows.kind == Kind.HIT) | (rows.kind == Kind.SLOT)
        lean = np.bitwise_and(rows.mark, int(Mark.FIXED | Mark.INCREMENTAL))
        loose: NDArray[np.bool_] = plain & (lean == 0)
        return loose


def _axis(words: Run, values: Ints, mine: NDArray[np.bool_], before: int) -> tuple[Ints, Bools]:
    """Values of one axis over the lines of a run, and on which of them it is named."""
    named = np.zeros(words.lines, dtype=np.bool_)
    named[words.line[mine]] = True
    stated = np.zeros(words.lines, dtype=np.int64)
    stated[words.line[mine]] = values[mine]
    last = np.maximum.accumulate(np.where(named, np.arange(words.lines), -1))
    return np.where(last >= 0, stated[np.maximum(last, 0)], before), named


def _coarsen(moves: tuple[Motion, ...], finer: int) -> tuple[Motion, ...]:
    return tuple(
        Motion(m.code, m.x // finer, m.y // finer, tuple((k, v // finer) for k, v in m.arc), m.line)
        for m in moves
    )


def _coarser(pattern: Pattern, finer: int) -> Pattern:
    copies = tuple(
        Copy(c.dx // finer, c.dy // finer, c.swap, c.mirror_x, c.mirror_y) for c in pattern.copies
    )
    return replace(pattern, copies=copies)
