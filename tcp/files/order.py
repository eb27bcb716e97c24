"""A drilling order as people hand it over: text, CSV, JSON, a TSPLIB tour.

The reader does not judge: an entry that is no hole is kept with its label, a
hole that comes twice comes twice.  Only what cannot be read at all is refused.
Plain numbers are read by array operations, ten million in seconds.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tcp.errors import InputError, UsageError
from tcp.files.text import read_text
from tcp.words import listed, shown
from tcp.workpiece import Workpiece

Ints = NDArray[np.int64]
Numbering = Literal["ids", "0", "1"]

NUMBERINGS: tuple[Numbering, ...] = ("ids", "0", "1")

MAX_BYTES = 512 * 2**20
"""Route files beyond this are refused."""

MAX_LABEL = 80
"""Longer labels are shortened in messages."""

_MAX_DIGITS = 18
_BREAKS = re.compile(r"""(?:->|–>|→|[\s,;|>\[\](){}"'])+""")
_ORDER_COLUMNS = ("order", "rank", "position", "sequence", "step", "drill_order", "drill-order")
_HOLE_COLUMNS = ("hole", "id", "no.", "no", "nr", "number", "name", "node")


@dataclass(frozen=True, eq=False)
class Order:
    """A drilling order as it was written, right or wrong.

    Parameters
    ----------
    entries : int64 array
        Position of the hole in the workpiece, or ``-1 - k`` for ``unknown[k]``.
    unknown : tuple of str
        Labels that are no hole, each once.
    numbering : str
        ``ids``, or ``0`` or ``1`` for numbers counted from there.
    numbers : int64 array, optional
        The labels as numbers, where all of them are.
    joined : bool
        Whether text without separators was read one character a hole.
    lines : int64 array, optional
        Line of each entry in its file, from 1.
    path : str, optional
        The file.
    """

    entries: Ints
    unknown: tuple[str, ...] = ()
    numbering: str = "ids"
    numbers: Ints | None = None
    joined: bool = False
    lines: Ints | None = None
    path: str | None = None

    def __len__(self) -> int:
        return len(self.entries)

    @property
    def as_numbers(self) -> dict[str, Ints]:
        """The hole indices that numbers counted from 0 and from 1 would mean."""
        if self.numbers is None:
            return {}
        return {"0": self.numbers, "1": self.numbers - 1}

    def line(self, place: int) -> int | None:
        """Line of the entry at a place counted from 1."""
        if self.lines is None or not 1 <= place <= len(self.lines):
            return None
        return int(self.lines[place - 1])


def order_of(
    route: str | Iterable[str | int] | Ints | Order,
    workpiece: Workpiece,
    numbering: str = "ids",
) -> Order:
    """A drilling order from text, labels or numbers.

    Parameters
    ----------
    route : str, iterable of (str or int), int64 array, or Order
        Text with separators of any kind, or one label per entry.
    numbering : str
        ``ids`` (labels are hole ids), ``0`` or ``1`` (whole numbers counted
        from there).

    Raises
    ------
    InputError
        If there are no entries, or an entry is no label.
    UsageError
        For another numbering.
    """
    if numbering not in NUMBERINGS:
        raise UsageError(f"unknown numbering {numbering!r}; expected {', '.join(NUMBERINGS)}")
    if isinstance(route, Order):
        return route
    if isinstance(route, str):
        return _from_text(route, workpiece, numbering)
    if isinstance(route, np.ndarray):
        if route.ndim != 1 or not np.issubdtype(route.dtype, np.integer):
            raise InputError("a route array must hold whole numbers in one dimension")
        return _from_numbers(route.astype(np.int64), workpiece, numbering)
    return _from_labels([_label(v) for v in route], workpiece, numbering)


def read_order(
    path: str | Path,
    workpiece: Workpiece,
    numbering: str = "ids",
    column: str | None = None,
) -> Order:
    """A drilling order from a file: JSON, a TSPLIB tour, CSV, or plain text.

    Parameters
    ----------
    path : path
        The file; its content decides what it is, ``.json`` and ``.csv`` help.
    column : str, optional
        CSV column with each hole's place in the order.

    Raises
    ------
    InputError
        If the file cannot be read as any of these.
    """
    form = "a route as text, CSV, JSON or TSPLIB tour"
    text = read_text(Path(path), "route", form, MAX_BYTES)
    try:
        order = _from_file_text(text, Path(path), workpiece, numbering, column)
    except InputError as error:
        if error.path is not None:
            raise
        raise InputError(str(error), path) from None
    return replace(order, path=str(path))


def _from_file_text(
    text: str, path: Path, workpiece: Workpiece, numbering: str, column: str | None
) -> Order:
    if column is not None:
        return _from_csv(text, path, workpiece, numbering, column)
    if path.suffix.lower() == ".json" or text.lstrip()[:1] == "{":
        return _from_json(text, workpiece, numbering)
    if re.search(r"^\s*TOUR_SECTION", text, re.MULTILINE):
        return _from_tsplib(text, path, workpiece, numbering)
    if path.suffix.lower() == ".csv" and _header(text):
        return _from_csv(text, path, workpiece, numbering, None)
    return _from_text(text, workpiece, numbering, with_lines=True)


def _from_json(text: str, workpiece: Workpiece, numbering: str) -> Order:
    try:
        data: Any = json.loads(text)
    except RecursionError:
        raise InputError("JSON is nested too deeply for a route") from None
    except ValueError as error:
        raise InputError(f"is not JSON: {str(error)[:120]}") from None
    if isinstance(data, dict):
        keys = [k for k in ("route", "sequence", "tour", "order") if k in data]
        if not keys:
            raise InputError("JSON object without a route; expected a key 'route'")
        data = data[keys[0]]
    if not isinstance(data, list):
        raise InputError("JSON does not hold a list of holes")
    if data and all(type(v) is int and abs(v) < 10**_MAX_DIGITS for v in data):
        return _from_numbers(np.array(data, dtype=np.int64), workpiece, numbering)
    return _from_labels([_label(v) for v in data], workpiece, numbering)


def _from_tsplib(text: str, path: Path, workpiece: Workpiece, numbering: str) -> Order:
    """A tour over nodes by their ids, if all of these are numbers, or else counted from 1."""
    section = re.search(r"^\s*TOUR_SECTION\s*:?", text, re.MULTILINE)
    assert section is not None
    first = text.count("\n", 0, section.end()) + 1
    body = enumerate(text[section.end() :].split("\n"), first)
    found = [(token, number) for number, line in body for token in line.split()]
    tokens = [token for token, _ in found]
    last = tokens.index("EOF") if "EOF" in tokens else len(tokens)
    end = tokens.index("-1", 0, last) if "-1" in tokens[:last] else last
    if end == len(tokens):
        raise InputError("the tour ends without -1; is the file truncated?", path)
    more = [number for token, number in found[end:last] if token != "-1"]
    if more:
        raise InputError("more follows after the tour's -1; expected EOF", path, more[0])
    if numbering == "ids" and not numbered(workpiece):
        numbering = "1"
    order = _from_labels(tokens[:end], workpiece, numbering)
    return replace(order, lines=np.array([number for _, number in found[:end]], dtype=np.int64))


def numbered(workpiece: Workpiece) -> bool:
    """Whether all ids are whole numbers, so that a TSPLIB tour may name the holes by them."""
    return all(v.isdecimal() and v.isascii() for v in workpiece.ids)


def _header(text: str) -> list[str] | None:
    """The cells of a CSV header, lower case; None if the first row holds no known name."""
    cells = [c.strip().strip('"').lower() for c in re.split(r"[,;\t]", _first_line(text))]
    return cells if any(c in _HOLE_COLUMNS + _ORDER_COLUMNS for c in cells) else None


def _first_line(text: str) -> str:
    """The first line that is neither blank nor a comment."""
    match = re.search(r"^[ \t]*[^\s#].*$", text, re.MULTILINE)
    return match.group() if match else ""


def _from_csv(
    text: str, path: Path, workpiece: Workpiece, numbering: str, column: str | None
) -> Order:
    """Holes in row order, or sorted by a column of places."""
    cells = _header(text)
    if cells is None:
        raise InputError("has no header row; expected columns such as hole and order", path)
    ranks = [column.lower()] if column else [c for c in _ORDER_COLUMNS if c in cells]
    if column and ranks[0] not in cells:
        raise InputError(f"has no column {shown(column)}; its columns are {listed(cells)}", path)
    holes = [c for c in _HOLE_COLUMNS if c in cells and c not in ranks]
    if not holes:
        raise InputError("has no column of holes; expected one named hole or id", path)
    delimiter = next((d for d in "\t;," if d in _first_line(text)), ",")
    rows = _rows(text, delimiter, len(cells), path)
    hole, rank = cells.index(holes[0]), cells.index(ranks[0]) if ranks else None
    labels, lines, places = [], [], []
    for line, row in rows:
        labels.append(row[hole].strip())
        lines.append(line)
        if rank is not None:
            places.append(_place(row[rank], path, line))
    found = replace(
        _from_labels(labels, workpiece, numbering), lines=np.array(lines, dtype=np.int64)
    )
    return _sorted_by(found, places, path) if rank is not None else found


def _rows(text: str, delimiter: str, width: int, path: Path) -> list[tuple[int, list[str]]]:
    rows: list[tuple[int, list[str]]] = []
    bare = ("\n" if line.lstrip().startswith("#") else line for line in io.StringIO(text))
    reader = csv.reader(bare, delimiter=delimiter)
    seen_header = False
    try:
        for row in reader:
            if not row or not "".join(row).strip():
                continue
            if not seen_header:
                seen_header = True
                continue
            if len(row) != width:
                raise InputError(
                    f"{len(row)} cells where the header has {width}", path, reader.line_num
                )
            rows.append((reader.line_num, row))
    except csv.Error as error:
        raise InputError(f"is no CSV: {error}", path, reader.line_num) from None
    return rows


def _place(cell: str, path: Path, line: int) -> int:
    if not re.fullmatch(r"\s*\d{1,18}\s*", cell, re.ASCII):
        raise InputError(f"{shown(cell)} is not a place in the order", path, line)
    return int(cell)


def _sorted_by(order: Order, places: list[int], path: Path) -> Order:
    ranks = np.array(places, dtype=np.int64)
    by = np.argsort(ranks, kind="stable")
    twice = np.flatnonzero(np.diff(ranks[by]) == 0)
    assert order.lines is not None
    if len(twice):
        first, second = by[twice[0]], by[twice[0] + 1]
        raise InputError(
            f"place {ranks[first]} is given twice, first in line {order.lines[first]}",
            path,
            int(order.lines[second]),
        )
    numbers = None if order.numbers is None else order.numbers[by]
    return replace(order, entries=order.entries[by], lines=order.lines[by], numbers=numbers)


def _label(value: Any) -> str:
    if isinstance(value, (str, int, np.integer)) and not isinstance(value, bool):
        return str(value)
    raise InputError(f"{shown(str(value))} is no hole; expected an id or a whole number")


def _short(label: str) -> str:
    return label if len(label) <= MAX_LABEL else f"{label[: MAX_LABEL - 3]}..."


def _from_text(text: str, workpiece: Workpiece, numbering: str, with_lines: bool = False) -> Order:
    if with_lines and "#" in text:
        text = re.sub(r"(?m)^[ \t]*#.*$", "", text)
    fast = _parse_numbers(text)
    if fast is not None and not _one_word(fast[0], text, workpiece, numbering):
        numbers, starts = fast
        order = _from_numbers(numbers, workpiece, numbering)
        return replace(order, lines=_lines_at(text, starts)) if with_lines else order
    labels, starts = _tokens(text, workpiece)
    if len(labels) == 1 and numbering == "ids":
        joined = _one_character_each(labels[0], workpiece)
        if joined:
            return replace(_from_labels(joined, workpiece, numbering), joined=True)
    order = _from_labels(labels, workpiece, numbering)
    return replace(order, lines=_lines_at(text, starts)) if with_lines else order


def _one_word(numbers: Ints, text: str, workpiece: Workpiece, numbering: str) -> bool:
    """Whether the text may be a sequence without separators."""
    return len(numbers) == 1 and numbering == "ids" and text.strip() not in workpiece.index


def _one_character_each(word: str, workpiece: Workpiece) -> list[str]:
    letters = list(word)
    known = len(letters) > 1 and all(c in workpiece.index for c in letters)
    return letters if known and word not in workpiece.index else []


def _lines_at(text: str, starts: Ints) -> Ints:
    data = np.frombuffer(text.encode(), dtype=np.uint8)
    return np.searchsorted(np.flatnonzero(data == 10), starts).astype(np.int64) + 1


def _tokens(text: str, workpiece: Workpiece) -> tuple[list[str], Ints]:
    """Words between separators; a hyphen separates where no id has one."""
    hyphens = any("-" in name for name in workpiece.ids)
    labels: list[str] = []
    starts: list[int] = []
    at = 0
    for gap in (*_BREAKS.finditer(text), None):
        word, start = text[at : gap.start() if gap else len(text)], at
        at = gap.end() if gap else len(text)
        pieces = re.split(r"(?<=\w)-(?=\w)", word) if not hyphens else [word]
        for piece in filter(None, pieces):
            labels.append(piece)
            starts.append(start)
    exact = np.array(starts, dtype=np.int64)
    if not text.isascii():  # places were counted in characters; lines are found in bytes
        widths = np.cumsum([len(c.encode()) for c in text])
        exact = np.where(exact > 0, widths[np.maximum(exact, 1) - 1], 0)
    return labels, exact


def _parse_numbers(text: str) -> tuple[Ints, Ints] | None:
    """Whole numbers between separators and where they begin; None for any other text."""
    if not text.isascii():
        return None
    data = np.frombuffer(text.encode(), dtype=np.uint8)
    digit = (data >= 48) & (data <= 57)
    allowed = np.zeros(256, dtype=bool)
    allowed[list(b" \t\r\n\f\v,;|>[](){}\"'-")] = True
    if not (digit | allowed[data]).all():
        return None
    edges = np.diff(digit.astype(np.int8), prepend=0, append=0)
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    width = ends - starts
    if len(starts) == 0 or int(width.max()) > _MAX_DIGITS:
        return None
    if bool(((data[starts] == 48) & (width > 1)).any()) or _signs(data, digit):
        return None
    values = np.zeros(len(starts), dtype=np.int64)
    for k in range(int(width.max())):
        more = width > k
        values[more] = values[more] * 10 + (data[starts[more] + k] - 48)
    return values, starts


def _signs(data: NDArray[np.uint8], digit: NDArray[np.bool_]) -> bool:
    """Whether a hyphen could be a minus sign: not right behind a digit, not part of ->."""
    at = np.flatnonzero(data == 45)
    if len(at) == 0:
        return False
    after_digit = (at > 0) & digit[np.maximum(at - 1, 0)]
    nxt = data[np.minimum(at + 1, len(data) - 1)]
    return not bool((after_digit | (nxt == 62)).all())


def _from_numbers(numbers: Ints, workpiece: Workpiece, numbering: str) -> Order:
    if len(numbers) == 0:
        raise InputError("holds no route; expected hole ids")
    n = len(workpiece)
    if numbering != "ids":
        entries = numbers - int(numbering)
        entries = np.where((entries >= 0) & (entries < n), entries, -1)
    else:
        distinct, where = _distinct(numbers)
        index = workpiece.index
        entries = np.array([index.get(str(v), -1) for v in distinct.tolist()])[where]
    unknown: tuple[str, ...] = ()
    bad = np.flatnonzero(entries < 0)
    if len(bad):
        labels, first, which = np.unique(numbers[bad], return_index=True, return_inverse=True)
        by_place = np.argsort(first, kind="stable")
        rank = np.empty_like(by_place)
        rank[by_place] = np.arange(len(by_place))
        entries = entries.copy()
        entries[bad] = -1 - rank[which]
        unknown = tuple(str(v) for v in labels[by_place].tolist())
    return Order(entries.astype(np.int64), unknown, numbering, numbers)


def _distinct(numbers: Ints) -> tuple[Ints, Ints]:
    """The different numbers, and for each entry its place among them; no sorting if dense."""
    low, high = int(numbers.min()), int(numbers.max())
    if high - low > 4 * len(numbers) + 1000:
        found, where = np.unique(numbers, return_inverse=True)
        return found, where
    present = np.bincount(numbers - low) > 0
    return np.flatnonzero(present) + low, (np.cumsum(present) - 1)[numbers - low]


def _from_labels(labels: Sequence[str], workpiece: Workpiece, numbering: str) -> Order:
    if not labels:
        raise InputError("holds no route; expected hole ids")
    try:
        "".join(labels).encode()
    except UnicodeEncodeError:
        raise InputError("holds half of a character (a lone surrogate)") from None
    numbers = _as_numbers(labels)
    if numbering != "ids" and numbers is None:
        plain = (v for v in labels if not re.fullmatch(r"-?\d{1,18}", v, re.ASCII))
        wrong = next(plain, max(labels, key=len))
        raise InputError(f"{shown(wrong)} is not a whole number below 10^18")
    if numbering != "ids" and numbers is not None:
        return _from_numbers(numbers, workpiece, numbering)
    index = workpiece.index
    unknown: dict[str, int] = {}
    entries = np.array(
        [
            index[v] if v in index else -1 - unknown.setdefault(_short(v), len(unknown))
            for v in labels
        ],
        dtype=np.int64,
    )
    return Order(entries, tuple(unknown), numbering, numbers)


def _as_numbers(labels: Sequence[str]) -> Ints | None:
    """The labels as numbers, if all of them are plain whole numbers."""
    if not all(v.lstrip("-").isdecimal() and v.isascii() and len(v) <= _MAX_DIGITS for v in labels):
        return None
    try:
        return np.array([int(v) for v in labels], dtype=np.int64)
    except ValueError:
        return None
