"""Which column of a table holds what: delimiter, header, units."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tcp.errors import InputError
from tcp.files.numbers import Decimals
from tcp.words import listed, shown

_NAMES = {
    "id": "id no no. nr nr. number name hole holeid holeno holenumber # index",
    "x": "x xcoord xcoordinate xpos xposition posx",
    "y": "y ycoord ycoordinate ypos yposition posy",
    "diameter": "diameter dia diam d ø drill drilldiameter holesize size",
    "tool": "tool t toolid toolno toolnumber",
    "unit": "unit units",
}
_COLUMNS = {alias: column for column, aliases in _NAMES.items() for alias in aliases.split()}
_UNIT_WORDS = {"mm": "mm", "inch": "inch", "in": "inch", "inches": "inch", '"': "inch"}
LENGTHS = ("x", "y", "diameter")
"""Columns that are lengths."""

_HEADING = re.compile(r"(?P<name>.*?)\s*(?:[(\[](?P<unit>[^)\]]*)[)\]]|[ _](?P<word>mm|inch|in))?")
_UNITS_COMMENT = re.compile(r"#\s*units?\s*[:=]\s*(.*)", re.IGNORECASE)


@dataclass(frozen=True)
class Layout:
    """Which column holds what: delimiter, width, positions by name, units if stated."""

    delimiter: str | None
    width: int
    columns: dict[str, int]
    unit: str | None = None
    diameters_unit: str | None = None
    header: bool = False
    ignored: tuple[str, ...] = ()


def layout_of(row: str, path: Path, line: int, comments: Sequence[str] = ()) -> Layout:
    """The layout that a table's first row shows, a header or not.

    Parameters
    ----------
    row, path, line
        The row, and where it stands.
    comments : sequence of str
        The lines before it: one of them may be the header, as in ``#,x,y`` or ``# x y``.

    Raises
    ------
    InputError
        If there is no x or y, or the row can be read in more than one way.
    """
    delimiter = next((d for d in "\t;," if d in row), None)
    try:
        cells = split(row, delimiter)
    except InputError as error:
        raise InputError(str(error), path, line) from None
    if any(_is_number(cell, delimiter) for cell in cells):
        while len(cells) > 2 and not cells[-1]:
            cells = cells[:-1]
        for number, names in _name_columns(comments, delimiter, len(cells)):
            return replace(_namedlayout_of(delimiter, names, path, number), header=False)
        return _barelayout_of(delimiter, cells, path, line)
    return _namedlayout_of(delimiter, cells, path, line)


def _name_columns(
    lines: Sequence[str], delimiter: str | None, width: int
) -> Iterator[tuple[int, list[str]]]:
    """Line and cells of comments that name x, y and so many columns; ``#`` may be one of them."""
    for number, line in enumerate(lines, 1):
        comment = line.lstrip()
        if not comment.startswith("#"):
            continue
        for text in (comment, comment.removeprefix("#")):
            cells = [cell.strip() for cell in text.split(delimiter)]
            while len(cells) > width and not cells[-1]:
                cells.pop()
            if len(cells) == width and {"x", "y"} <= {_heading(cell)[0] for cell in cells}:
                yield number, cells
                break


def _barelayout_of(delimiter: str | None, cells: list[str], path: Path, line: int) -> Layout:
    """Columns of a file without a header: nothing is guessed beyond x, y and id, x, y."""
    if len(cells) not in (2, 3):
        count = "1 column" if len(cells) == 1 else f"{len(cells)} columns"
        raise InputError(
            f"found {count} and no header; expected x,y or id,x,y, "
            "or a header line such as id,x,y,diameter",
            path,
            line,
        )
    names = ("x", "y") if len(cells) == 2 else ("id", "x", "y")
    return Layout(delimiter, len(cells), {name: i for i, name in enumerate(names)})


def _namedlayout_of(delimiter: str | None, cells: list[str], path: Path, line: int) -> Layout:
    columns: dict[str, int] = {}
    stated: dict[str, str] = {}
    ignored = []
    for i, cell in enumerate(cells):
        name, unit = _heading(cell)
        if name is None:
            ignored.append(cell or f"number {i + 1}")
            continue
        if name in columns:
            raise InputError(f"two columns are named {name}; expected one", path, line)
        columns[name] = i
        if name in LENGTHS and unit is not None:
            if unit not in _UNIT_WORDS:
                message = f"column {shown(cell)} is in {shown(unit)}; expected mm or inch"
                raise InputError(message, path, line)
            stated[name] = _UNIT_WORDS[unit]
    for name in ("x", "y"):
        if name not in columns:
            found = listed(c for c in cells if c)
            raise InputError(f"column {name} is missing; the columns are {found}", path, line)
    if len(set(stated.values())) > 1:
        raise InputError("the columns are partly in mm and partly in inch", path, line)
    unit = stated.get("x", stated.get("y"))
    return Layout(
        delimiter, len(cells), columns, unit, stated.get("diameter"), True, tuple(ignored)
    )


def _heading(cell: str) -> tuple[str | None, str | None]:
    """Column and unit that a heading names: ``X (mm)`` is x in mm."""
    match = _HEADING.fullmatch(cell.strip().lower())
    assert match is not None
    unit = match["unit"] if match["unit"] is not None else match["word"]
    name = re.sub(r"[\s_-]", "", match["name"])
    return _COLUMNS.get(name), unit.strip() if unit is not None else None


def comments_unit(lines: Sequence[str], layout: Layout, path: Path) -> str | None:
    """The one unit that comments state, wherever they stand; None if they state none.

    Raises
    ------
    InputError
        If they contradict each other, or name other columns than are read.
    """
    stated = sorted((*_unit_comments(lines, path), *_heading_comments(lines, layout, path)))
    for number, unit in stated:
        first, expected = stated[0]
        if unit != expected:
            message = f"units are {unit} here, but {expected} in line {first}; expected one"
            raise InputError(message, path, number)
    return stated[0][1] if stated else None


def _unit_comments(lines: Sequence[str], path: Path) -> Iterator[tuple[int, str]]:
    """Line and unit of comments such as ``# units: inch``."""
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if text.startswith("#") and (match := _UNITS_COMMENT.fullmatch(text.rstrip(",;\t "))):
            yield number, unit_word(match[1], path, number)


def _heading_comments(
    lines: Sequence[str], layout: Layout, path: Path
) -> Iterator[tuple[int, str]]:
    """Line and unit of comments such as ``# x_in,y_in``, of which one may be the header."""
    for number, cells in _name_columns(lines, layout.delimiter, layout.width):
        named = _namedlayout_of(layout.delimiter, cells, path, number)
        if not layout.header and named.columns != layout.columns:
            message = "this comment names other columns than are read; expected one header, on top"
            raise InputError(message, path, number)
        if named.diameters_unit not in (None, named.unit, layout.diameters_unit):
            message = f"the diameters are in {named.diameters_unit}; expected x and y stated too"
            raise InputError(message, path, number)
        if named.unit is not None:
            yield number, named.unit


def unit_word(text: str, path: Path, line: int) -> str:
    """``mm`` or ``inch``, from what a comment or a cell says."""
    unit = _UNIT_WORDS.get(text.lower())
    if unit is None:
        raise InputError(f"units {shown(text)}; expected mm or inch", path, line)
    return unit


def agreed_unit(layout: Layout, others: Sequence[str | None], path: Path, line: int) -> str:
    """The one unit that header, comment, column and flag agree on; mm where all are silent."""
    said = {unit for unit in (layout.unit, *others) if unit is not None}
    if len(said) > 1:
        raise InputError(
            "header, comment, unit column and --units contradict each other about mm and inch",
            path,
            line,
        )
    unit = said.pop() if said else "mm"
    if layout.diameters_unit not in (None, unit):
        message = f"the diameters are in {layout.diameters_unit}, x and y in {unit}"
        raise InputError(f"{message}; expected one unit, stated for x and y too", path, line)
    return unit


def layout_notes(layout: Layout) -> list[str]:
    """A note on the columns that were not read, if there are any."""
    if not layout.ignored:
        return []
    plural = "s" if len(layout.ignored) > 1 else ""
    return [f"ignored column{plural}: {listed(layout.ignored, 5)}"]


def _is_number(cell: str, delimiter: str | None) -> bool:
    try:
        Decimals(decimal_comma=delimiter != ",").add(cell)
    except InputError:
        return False
    return True


def split(line: str, delimiter: str | None) -> list[str]:
    """The cells of a row; quotes protect delimiters.

    Raises
    ------
    InputError
        If quoting is broken.
    """
    if '"' in line:
        if delimiter is None:
            line, delimiter = " ".join(line.split()), " "
        try:
            cells = next(
                csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True)
            )
        except csv.Error as error:
            raise InputError(f"broken quotes: {error}") from None
    else:
        cells = line.split(delimiter)
    return [cell.strip() for cell in cells]
