"""TSPLIB 95 files: points with EUC_2D, CEIL_2D, MAN_2D or MAX_2D, and explicit matrices.

Source: G. Reinelt, "TSPLIB 95", Universität Heidelberg.  ``EUC_2D`` is the
Euclidean distance rounded to the nearest integer, ``CEIL_2D`` rounded up,
``MAN_2D`` and ``MAX_2D`` the Manhattan and Chebyshev distance rounded to the
nearest integer.  The file's type becomes its default travel model with quantum
1.  Asymmetric matrices and geographic distances are refused.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

import numpy as np

from tcp.errors import InputError
from tcp.files.numbers import Decimals, TooFine, common_steps
from tcp.files.reading import UNITS, Reading, coincidence_note
from tcp.files.text import read_lines
from tcp.travel import Model, Rounding, Travel
from tcp.words import shown
from tcp.workpiece import Ints, Workpiece

ONE = Fraction(1)

TRAVELS = {
    "EUC_2D": Travel(Model.EUCLIDEAN, quantum=ONE),
    "CEIL_2D": Travel(Model.EUCLIDEAN, quantum=ONE, rounding=Rounding.UP),
    "MAN_2D": Travel(Model.SEQUENTIAL, quantum=ONE),
    "MAX_2D": Travel(Model.SIMULTANEOUS, quantum=ONE),
    "EXPLICIT": Travel(Model.EXPLICIT),
}
"""The travel model that each ``EDGE_WEIGHT_TYPE`` stands for."""

MAX_EXPLICIT = 6_000
"""Most nodes of an explicit matrix."""

MAX_POINTS = 100_000_000
"""More points do not fit into the largest file that is read."""

_POINTS = ("NODE_COORD_SECTION", "DISPLAY_DATA_SECTION")
_IGNORED = ("FIXED_EDGES_SECTION",)


@dataclass
class _File:
    """Specification by keyword, and sections as (line number, words)."""

    path: Path
    values: dict[str, tuple[int, str]] = field(default_factory=dict)
    sections: dict[str, list[tuple[int, list[str]]]] = field(default_factory=dict)

    def value(self, keyword: str) -> tuple[int, str]:
        """Line and value of a keyword that must be there."""
        if keyword not in self.values:
            raise InputError(f"there is no line {keyword}; expected a TSPLIB file", self.path)
        return self.values[keyword]


def read(path: str | Path, *, units: str | None = None) -> Reading:
    """Read a TSPLIB problem.

    Parameters
    ----------
    path : path
        The ``.tsp`` file.
    units : {"mm", "inch"}, optional
        What one unit of the coordinates is; default mm.

    Raises
    ------
    InputError
        If the file is not a symmetric TSPLIB problem of a known kind.
    """
    file = _parse(Path(path))
    line, kind = file.value("EDGE_WEIGHT_TYPE")
    if kind.upper() not in TRAVELS:
        known = ", ".join(TRAVELS)
        raise InputError(
            f"EDGE_WEIGHT_TYPE {shown(kind)}; expected one of {known}", file.path, line
        )
    travel = TRAVELS[kind.upper()]
    explicit = travel.model is Model.EXPLICIT
    n = _dimension(file, MAX_EXPLICIT if explicit else MAX_POINTS)
    matrix = _matrix(file, n) if explicit else None
    ids, x, y, step = _points(file, n, travel, UNITS[units or "mm"])
    name = file.values.get("NAME", (0, file.path.stem))[1] or file.path.stem
    workpiece = Workpiece(name, ids, x, y, step, matrix=matrix)
    notes = [] if matrix is not None else coincidence_note(workpiece)
    return Reading(workpiece, travel, tuple(notes))


def _parse(path: Path) -> _File:
    file = _File(path)
    section: list[tuple[int, list[str]]] | None = None
    for number, line in enumerate(read_lines(path), 1):
        words = line.split()
        if not words:
            continue
        if section is not None and _starts_number(words[0]):
            section.append((number, words))
            continue
        section = None
        keyword, _, value = (part.strip() for part in line.partition(":"))
        keyword = keyword.upper()
        if keyword == "EOF":
            break
        if keyword.endswith("_SECTION"):
            section = file.sections.setdefault(keyword, [])
        elif ":" not in line:
            message = f"{shown(line.strip())}; expected KEYWORD : value or a section's numbers"
            raise InputError(message, path, number)
        else:
            first, before = file.values.setdefault(keyword, (number, value))
            if value != before and keyword != "COMMENT":
                message = f"{keyword} {shown(value)}, but line {first} says {shown(before)}"
                raise InputError(message, path, number)
    _check_kind(file)
    return file


def _starts_number(word: str) -> bool:
    return word[0].isdigit() or word[0] in "+-."


def _check_kind(file: _File) -> None:
    line, kind = file.values.get("TYPE", (None, "TSP"))
    if kind.upper().split()[:1] != ["TSP"]:
        raise InputError(f"TYPE {shown(kind)}; expected TSP", file.path, line)
    for section in file.sections:
        if section in _IGNORED and file.sections[section]:
            raise InputError(f"{section} is not supported", file.path)


def _dimension(file: _File, most: int) -> int:
    line, text = file.value("DIMENSION")
    whole = text.isascii() and text.isdigit() and len(text) <= 12
    if not whole or not 1 <= int(text) <= most:
        raise InputError(f"DIMENSION {shown(text)}; expected 1 to {most}", file.path, line)
    return int(text)


def _points(
    file: _File, n: int, travel: Travel, unit: Fraction
) -> tuple[tuple[str, ...], Ints, Ints, Fraction]:
    rows = next((file.sections[s] for s in _POINTS if s in file.sections), None)
    if rows is None:
        if travel.model is not Model.EXPLICIT:
            raise InputError("there is no NODE_COORD_SECTION", file.path)
        nowhere = np.zeros(n, dtype=np.int64)
        return tuple(map(str, range(1, n + 1))), nowhere, nowhere.copy(), ONE
    if len(rows) != n:
        message = f"found {len(rows)} points where DIMENSION says {n}"
        raise InputError(message, file.path, rows[-1][0] if rows else None)
    x, y, seen = Decimals(), Decimals(), dict[str, int]()
    for line, words in rows:
        if len(words) != 3:
            raise InputError(f"found {len(words)} columns; expected id x y", file.path, line)
        if words[0] in seen:
            message = f"hole id {shown(words[0])} stands in line {seen[words[0]]} already"
            raise InputError(message, file.path, line)
        seen[words[0]] = line
        try:
            x.add(words[1])
            y.add(words[2])
        except InputError as error:
            raise InputError(str(error), file.path, line) from None
    try:
        (steps_x, steps_y), places = common_steps(x, y)
    except TooFine as error:
        raise InputError(str(error), file.path, rows[error.row][0]) from None
    return tuple(seen), steps_x, steps_y, unit / 10**places


def _matrix(file: _File, n: int) -> Ints:
    line, name = file.value("EDGE_WEIGHT_FORMAT")
    if name.upper() not in _FORMATS:
        known = ", ".join(_FORMATS)
        raise InputError(
            f"EDGE_WEIGHT_FORMAT {shown(name)}; expected one of {known}", file.path, line
        )
    expected, rows, columns = _FORMATS[name.upper()](n)
    weights = _weights(file, expected)
    matrix = np.zeros((n, n), dtype=np.int64)
    matrix[rows, columns] = weights
    if name.upper() != "FULL_MATRIX":
        matrix[columns, rows] = weights
    elif not np.array_equal(matrix, matrix.T):
        i, j = (int(v) for v in np.argwhere(matrix != matrix.T)[0])
        message = f"the matrix is not symmetric: {i + 1} to {j + 1} is not {j + 1} to {i + 1}"
        raise InputError(message, file.path, file.sections["EDGE_WEIGHT_SECTION"][0][0])
    np.fill_diagonal(matrix, 0)
    return matrix


def _weights(file: _File, expected: int) -> list[int]:
    weights: list[int] = []
    rows = file.sections.get("EDGE_WEIGHT_SECTION", [])
    for line, words in rows:
        for word in words:
            if not word.isascii() or not word.isdigit() or len(word) > 15:
                message = f"{shown(word)} in the matrix; expected a whole number, 0 or more"
                raise InputError(message, file.path, line)
            weights.append(int(word))
    if len(weights) != expected:
        message = f"found {len(weights)} weights; DIMENSION and format ask for {expected}"
        raise InputError(message, file.path, rows[-1][0] if rows else None)
    return weights


_Places = tuple[int, Ints, Ints]


def _full(n: int) -> _Places:
    rows, columns = np.divmod(np.arange(n * n, dtype=np.int64), n)
    return n * n, rows, columns


def _triangle(upper: bool, offset: int) -> Callable[[int], _Places]:
    """Row by row: an upper or a lower triangle, with (0) or without (1) the diagonal."""

    def places(n: int) -> _Places:
        if upper:
            rows, columns = np.triu_indices(n, offset)
        else:
            rows, columns = np.tril_indices(n, -offset)
        return len(rows), rows, columns

    return places


def _swapped(rule: Callable[[int], _Places]) -> Callable[[int], _Places]:
    def places(n: int) -> _Places:
        count, rows, columns = rule(n)
        return count, columns, rows

    return places


_FORMATS: dict[str, Callable[[int], _Places]] = {
    "FULL_MATRIX": _full,
    "UPPER_ROW": _triangle(True, 1),
    "LOWER_ROW": _triangle(False, 1),
    "UPPER_DIAG_ROW": _triangle(True, 0),
    "LOWER_DIAG_ROW": _triangle(False, 0),
    # column by column, an upper triangle is a lower one row by row, turned over
    "UPPER_COL": _swapped(_triangle(False, 1)),
    "LOWER_COL": _swapped(_triangle(True, 1)),
    "UPPER_DIAG_COL": _swapped(_triangle(False, 0)),
    "LOWER_DIAG_COL": _swapped(_triangle(True, 0)),
}
