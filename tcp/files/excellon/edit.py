"""Changes to a drill file's text beyond the order of units: whole sections, merged, expanded.

Each function returns a new file that does the same work; the caller reads it
back and compares.  What cannot be changed safely is refused with its line, so
that the caller can say why a wish was not granted.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tcp.errors import UsageError
from tcp.files.excellon.document import ending
from tcp.files.excellon.program import (
    Copy,
    Kind,
    Mark,
    Pattern,
    Place,
    Program,
    Selection,
    repeated,
)
from tcp.files.excellon.rewrite import AXES, Put, Text, Turn, Writer, plan
from tcp.files.excellon.state import NUMBER

_TOOL = re.compile(rb"\s*T\d+")
_WORD = re.compile(r"([A-Z])[ \t]*(" + NUMBER.decode() + r")?")
_HARMLESS = re.compile(rb"\s*(;.*|T\d+.*|G0?5|G81|G90|M1[67]|M71|M72|G40)?\s*$", re.S)
_PATTERN_CODE = re.compile(rb"\s*(?:R\d+)?M(?:25|01|02|08)(?![0-9])")


@dataclass(frozen=True)
class Section:
    """The text of a tool selection: lines ``first .. last - 1`` and its units."""

    number: int
    first: int
    last: int
    rows: tuple[int, int]


def sections(program: Program) -> list[Section]:
    """The tool selections as blocks of text that can change places.

    A block begins with the comments right above its tool line; the last one
    ends with its last unit.

    Raises
    ------
    UsageError
        Where a line between the blocks would not mean the same at another place.
    """
    _check_sections(program)
    starts = [_with_comments(program, s.line) for s in program.selections]
    firsts = [s.first for s in program.selections]
    ends = [*starts[1:], int(program.rows.last[-1])]
    rows = zip(firsts, [*firsts[1:], len(program.rows)], strict=True)
    blocks = zip(starts, ends, rows, strict=True)
    return [Section(i, a, b, r) for i, (a, b, r) in enumerate(blocks)]


def _check_sections(program: Program) -> None:
    document, rows = program.document, program.rows
    if program.patterns:
        raise _refusal(program, program.patterns[0].lines[0], "step and repeat spans lines")
    if (rows.mark & Mark.INCREMENTAL).any():
        raise _refusal(program, int(rows.first[0]), "coordinates are incremental")
    at = program.selections[0].line
    for row in [*range(len(rows)), len(rows)]:
        stop = int(rows.first[row]) if row < len(rows) else int(rows.last[-1])
        for line in range(at, stop):
            if not _HARMLESS.match(document.line(line)):
                raise _refusal(program, line, "this line depends on what stands before it")
        at = int(rows.last[row]) if row < len(rows) else stop
    for selection in program.selections:
        if not _TOOL.match(document.line(selection.line)):
            raise _refusal(program, selection.line, "tools change by M00")
    _check_stated(program)
    routed = (rows.kind == Kind.ROUTE) & ((rows.mark & Mark.DRILLS_AFTER) == 0)
    drills = ~(rows.kind == Kind.ROUTE)
    if routed.any() and drills.any():
        row = int(routed.nonzero()[0][0])
        raise _refusal(program, int(rows.first[row]), "the rout mode that begins here goes on")


def _check_stated(program: Program) -> None:
    """Refuse a tool line without a feed, a speed or the like that another tool line has."""
    stated = [_stated(program, selection) for selection in program.selections]
    letters = sorted(set().union(*stated) - {"C"})
    for selection, words in zip(program.selections, stated, strict=True):
        for letter in letters:
            if letter not in words:
                reason = f"this line states no {letter}, that of another tool does"
                raise _refusal(program, selection.line, reason)


def _stated(program: Program, selection: Selection) -> dict[str, str]:
    """What a tool line says beside the tool: diameter, feed, speed, by letter."""
    words = program.document.line(selection.line).partition(b";")[0].decode("latin-1")
    return {letter: value for letter, value in _WORD.findall(words) if letter != "T"}


def _refusal(program: Program, line: int, reason: str) -> UsageError:
    return UsageError(f"{program.path}:{line + 1}: tools cannot change places: {reason}")


def _with_comments(program: Program, line: int) -> int:
    """The first of the comment lines that stand right above a line."""
    while line > 0 and program.document.line(line - 1).lstrip().startswith(b";"):
        line -= 1
    return line


def move_sections(program: Program, order: Sequence[int]) -> bytes:
    """The file with its tool selections in another order.

    Parameters
    ----------
    program : Program
        The file.
    order : sequence of int
        Positions of the selections, each once.
    """
    blocks, writer = sections(program), Writer(program)
    out = [program.document.text(0, blocks[0].first)]
    for number in order:
        block = blocks[number]
        text = writer.write(plan(program, {}, block.first, block.last))
        out.append(text if ending(text[-2:]) else text + _line_end(program))
    tail = program.document.text(blocks[-1].last, len(program.document))
    return b"".join([*out, tail])


def _line_end(program: Program) -> bytes:
    return ending(program.document.line(0)) or b"\n"


def merge_selections(program: Program) -> bytes:
    """The file with each tool selected once: later selections join the tool's first.

    The lines that selected the tool again go; all other lines stay.

    Raises
    ------
    UsageError
        As :func:`sections`, and where a tool is selected again with another feed or speed.
    """
    blocks, writer = sections(program), Writer(program)
    tools = [s.tool for s in program.selections]
    out = [program.document.text(0, blocks[0].first)]
    for block in blocks:
        if tools[block.number] in tools[: block.number]:
            continue
        for other in blocks[block.number :]:
            if tools[other.number] != tools[block.number]:
                continue
            skip = -1 if other is block else _repeated_line(program, block.number, other.number)
            items = _without(plan(program, {}, other.first, other.last), skip)
            text = writer.write(items)
            out.append(text if not text or ending(text[-2:]) else text + _line_end(program))
    tail = program.document.text(blocks[-1].last, len(program.document))
    return b"".join([*out, tail])


def _repeated_line(program: Program, first: int, again: int) -> int:
    """The line that selects a tool again and says nothing that its first selection does not."""
    selection, kept = program.selections[again], _stated(program, program.selections[first])
    for letter, value in _stated(program, selection).items():
        if kept.get(letter) != value:
            line = program.selections[first].line + 1
            before = f"{letter}{kept[letter]}" if letter in kept else f"no {letter}"
            reason = f"T{selection.tool} has {letter}{value} here, but {before} on line {line}"
            raise _refusal(program, selection.line, reason)
    return selection.line


def _without(items: Iterator[Text | Put], line: int) -> Iterator[Text | Put]:
    """A plan without one line of text."""
    for item in items:
        if isinstance(item, Text) and item.first <= line < item.last:
            yield Text(item.first, line)
            yield Text(line + 1, item.last)
        else:
            yield item


# -- expanding -----------------------------------------------------------------------------


def expand(program: Program) -> tuple[bytes, tuple[str, ...]]:
    """The file with repeats and step-and-repeat blocks written out hole by hole.

    Returns
    -------
    bytes
        The new file.
    tuple of str
        What had to stay as it is, and why.
    """
    writer, notes, out, at, row = _Expander(program), [], [], 0, 0
    ends = {pattern.lines[1] for pattern in program.patterns}
    for pattern in program.patterns:
        reason = _stubborn(program, pattern, pattern.lines[0] in ends)
        if reason:
            notes.append(reason)
            continue
        begin, end = pattern.lines[0], pattern.lines[1] + 1
        out.append(writer.lines(at, begin, row))
        out.append(writer.pattern(pattern, begin, end))
        at, row = end, pattern.last
    out.append(writer.lines(at, len(program.document), row))
    return b"".join(out), tuple(notes)


def _stubborn(program: Program, pattern: Pattern, shared: bool) -> str | None:
    """Why a pattern (``shared``: its first line ends another) cannot be written out, if so."""
    rows, part = program.rows, slice(pattern.first, pattern.last)
    line, reason = pattern.lines[0] + 1, None
    if not set(rows.kind[part].tolist()) <= {Kind.HIT, Kind.SLOT}:
        reason = "it routs"
    elif (rows.mark[part] & Mark.INCREMENTAL).any():
        reason = "its coordinates are incremental"
    elif shared:
        reason = "its first line also ends the pattern before"
    elif not _only_pattern(program, pattern):
        reason = "other commands stand inside"
    return None if reason is None else f"line {line}: the pattern is not expanded, because {reason}"


def _only_pattern(program: Program, pattern: Pattern) -> bool:
    document, units = program.document, _unit_lines(program, pattern)
    closed = re.match(rb"\s*M(?:08|27)\b", document.line(pattern.lines[1])) is not None
    rest = (n for n in range(pattern.lines[0], pattern.lines[1] + 1) if n not in units)
    return closed and all(
        _PATTERN_CODE.match(document.line(n)) or document.line(n).lstrip()[:1] in (b"", b";")
        for n in rest
    )


def _unit_lines(program: Program, pattern: Pattern) -> set[int]:
    """The lines of a pattern that belong to its units."""
    rows = program.rows
    return {
        line
        for row in range(pattern.first, pattern.last)
        for line in range(int(rows.first[row]), int(rows.last[row]))
    }


def _comment(line: bytes) -> bytes:
    """A line's comment as a line of its own, empty where it has none."""
    _, mark, text = line.partition(b";")
    return mark + text.rstrip(b"\r\n") + (ending(line) or b"\n") if mark else b""


class _Expander(Writer):
    """Writes units out hole by hole."""

    def lines(self, first: int, last: int, row: int) -> bytes:
        """Lines of the original, repeats expanded; units from ``row`` on may stand there."""
        out, at = [], first
        table = self.rows
        while row < len(table) and table.first[row] < last:
            if table.first[row] >= first:
                out.append(self.program.document.text(at, int(table.first[row])))
                out.append(self._expanded(row))
                at = int(table.last[row])
            row += 1
        out.append(self.program.document.text(at, last))
        return b"".join(out)

    def pattern(self, pattern: Pattern, first: int, last: int) -> bytes:
        """A block as plain holes, first as it stands and then once a copy."""
        apart = set(range(first, last)) - _unit_lines(self.program, pattern)
        kept = [_comment(self.program.document.line(number)) for number in sorted(apart)]
        out = [*kept, *(self._written(row, None) for row in range(pattern.first, pattern.last))]
        for copy in pattern.copies:
            out += [self._written(row, copy) for row in range(pattern.first, pattern.last)]
        return b"".join(out)

    def _expanded(self, row: int) -> bytes:
        """A unit of the original; one with repeats as so many lines."""
        self._come_to(row)
        self.slot = row
        if row not in self.program.repeats:
            text = self.unit(Turn(row))
            self.at = self._end(Turn(row))
            return text
        if self.rows.mark[row] & Mark.INCREMENTAL:
            self.at = self._end(Turn(row))
            return self.program.document.text(self.rows.first[row], self.rows.last[row])
        return self._written(row, None)

    def _written(self, row: int, copy: Copy | None) -> bytes:
        """The holes of a unit in absolute coordinates, moved by a copy."""
        document = self.program.document
        line, *more = (document.line(i) for i in range(self.rows.first[row], self.rows.last[row]))
        end = ending(line) or b"\n"

        def moved(x: int, y: int) -> Place:
            if copy is None:
                return x, y
            xs, ys = copy.place(np.array([x]), np.array([y]))
            return int(xs[0]), int(ys[0])

        if self.rows.kind[row] == Kind.SLOT:
            first = self._text(*moved(*self._first(row)))
            self.at = moved(*self._last(row))
            comment = _comment(line) if copy is None else b""
            return first + b"G85" + self._text(*self.at) + (comment or end)
        repeats = self.program.repeats.get(row, ())
        places = [moved(x, y) for x, y in repeated(*self._first(row), repeats)]
        self.at = places[-1]
        if copy is None:
            hit = AXES.sub(self._text(*places[0]), line, count=1)
            further = (self._text(*place) + end for place in places[1:])
            return b"".join([hit, *map(_comment, more), *further])
        return b"".join(self._text(*place) + end for place in places)
