"""Workpieces as CSV, read as people have them.

Accepted: comma, semicolon, tab or blanks between columns; a header or none
(then the columns are x, y or id, x, y); a BOM; CRLF; lines of comment with
``#``, one of which may be the header; decimal comma where the comma does not
separate columns; further columns (ignored, with a note); units mm or inch, by
header (``x_mm``, ``X [inch]``), by a comment ``# units: inch``, a column or a
flag.  Columns by name, in any order: id, x, y, diameter, tool, unit.  What could
be read in two ways is refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path

from tcp.errors import InputError
from tcp.files.layout import (
    LENGTHS,
    Layout,
    agreed_unit,
    comments_unit,
    layout_notes,
    layout_of,
    split,
    unit_word,
)
from tcp.files.numbers import Decimals, TooFine, common_steps
from tcp.files.reading import PIPED, UNITS, Reading, coincidence_note, piped
from tcp.files.text import read_lines
from tcp.words import shown
from tcp.workpiece import Workpiece, exact_decimal


def read(path: str | Path, *, units: str | None = None) -> Reading:
    """Read a workpiece from a CSV file.

    Parameters
    ----------
    path : path
        The file.
    units : {"mm", "inch"}, optional
        Unit of coordinates and diameters; a file that states another is refused.

    Raises
    ------
    InputError
        For whatever is not a table of holes; names the line.
    """
    path = Path(path)
    lines = read_lines(path)
    number, first = _first_row(lines, path)
    layout = _layout(first, path, number, lines[: number - 1])
    comment = comments_unit(lines, layout, path)
    table = _Table(layout, path)
    table.fill(lines, number if layout.header else number - 1)
    unit = agreed_unit(layout, (comment, *table.units, units), path, number)
    workpiece = table.workpiece(UNITS[unit])
    notes = layout_notes(layout) + coincidence_note(workpiece)
    return Reading(workpiece, notes=tuple(notes))


def _first_row(lines: Sequence[str], path: Path) -> tuple[int, str]:
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if text.strip(",;\t ") and not text.startswith("#"):
            return number, line
    raise InputError("there are no holes, only blank lines and comments", path)


def _layout(first: str, path: Path, number: int, comments: Sequence[str]) -> Layout:
    """The table's columns; what else comes through a pipe is told what to do."""
    try:
        return layout_of(first, path, number, comments)
    except InputError as error:
        if not piped(path):
            raise
        raise InputError(f"{error}; {PIPED}") from None


class _Table:
    """Columns as they fill up, row by row."""

    def __init__(self, layout: Layout, path: Path):
        comma = layout.delimiter != ","
        self._layout, self._path = layout, path
        self._x, self._y = Decimals(comma), Decimals(comma)
        self._ids: list[str] = []
        self._diameters: list[str] = []
        self._tools: list[str | None] = []
        self._lines: list[int] = []
        self._comma = comma
        self._marks: dict[str, int] = {}
        self.units: set[str] = set()

    def fill(self, lines: Sequence[str], skip: int) -> None:
        """Read all rows after the first ``skip`` lines."""
        layout, columns = self._layout, self._layout.columns
        at_id, at_x, at_y = columns.get("id", -1), columns["x"], columns["y"]
        at_diameter, at_tool = columns.get("diameter", -1), columns.get("tool", -1)
        at_unit = columns.get("unit", -1)
        lengths = [columns[name] for name in LENGTHS if name in columns]
        for number, cells in self._rows(lines, skip):
            try:
                self._x.add(cells[at_x])
                self._y.add(cells[at_y])
            except InputError as error:
                raise InputError(str(error), self._path, number) from None
            if self._comma:
                self._check_marks("".join(cells[at] for at in lengths), number)
            if at_id >= 0:
                if not cells[at_id]:
                    raise InputError("the hole has no id", self._path, number)
                self._ids.append(cells[at_id])
            if at_diameter >= 0:
                self._diameters.append(cells[at_diameter])
            if at_tool >= 0:
                self._tools.append(cells[at_tool] or None)
            if at_unit >= 0:
                self.units.add(unit_word(cells[at_unit], self._path, number))
            self._lines.append(number)
        if not self._lines:
            raise InputError("there are no holes below the header", self._path, skip)
        if layout.columns.get("id") is not None:
            self._check_ids()

    def _check_marks(self, lengths: str, line: int) -> None:
        """Refuse decimal commas beside decimal points: one of them may group thousands."""
        for mark in ",.":
            if mark in lengths:
                self._marks.setdefault(mark, line)
        if len(self._marks) == 2:
            first = min(self._marks.values())
            message = f"decimal commas and points are mixed, from line {first} on; expected one"
            raise InputError(message, self._path, line)

    def _rows(self, lines: Sequence[str], skip: int) -> Iterator[tuple[int, list[str]]]:
        delimiter, width = self._layout.delimiter, self._layout.width
        for number in range(skip + 1, len(lines) + 1):
            line = lines[number - 1]
            if line.lstrip().startswith("#"):
                continue
            try:
                cells = split(line, delimiter)
            except InputError as error:
                raise InputError(str(error), self._path, number) from None
            if not any(cells):
                continue
            if len(cells) < width or any(cells[width:]):
                found = "1 column" if len(cells) == 1 else f"{len(cells)} columns"
                message = f"found {found} where the first row has {width}"
                raise InputError(message, self._path, number)
            yield number, cells

    def _check_ids(self) -> None:
        if len(set(self._ids)) == len(self._ids):
            return
        seen: dict[str, int] = {}
        for name, line in zip(self._ids, self._lines, strict=True):
            if name in seen:
                message = f"hole id {shown(name)} stands in line {seen[name]} already; expected one"
                raise InputError(message, self._path, line)
            seen[name] = line

    def _exact_diameters(self, unit: Fraction) -> list[Fraction | None]:
        if not self._diameters:
            return []
        known: dict[str, Fraction | None] = {"": None}
        for text, line in zip(self._diameters, self._lines, strict=True):
            if text not in known:
                known[text] = _diameter(text, unit, self._comma, self._path, line)
        return [known[text] for text in self._diameters]

    def workpiece(self, unit: Fraction) -> Workpiece:
        """All rows as a workpiece named after the file."""
        diameters = self._exact_diameters(unit)
        try:
            (x, y), places = common_steps(self._x, self._y)
        except TooFine as error:
            raise InputError(str(error), self._path, self._lines[error.row]) from None
        ids = tuple(self._ids) or tuple(map(str, range(1, len(x) + 1)))
        step = unit / 10**places
        return Workpiece(self._path.stem, ids, x, y, step, tuple(diameters), tuple(self._tools))


def _diameter(text: str, unit: Fraction, comma: bool, path: Path, line: int) -> Fraction:
    if comma:
        text = text.replace(",", ".")
    try:
        value = Fraction(exact_decimal(text)) * unit
    except InputError:
        raise InputError(f"diameter {shown(text)} is not a number", path, line) from None
    if value <= 0:
        raise InputError(f"diameter {shown(text)}; expected more than 0", path, line)
    return value
