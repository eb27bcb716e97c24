"""Claims files: everything a paper states about routes, as TOML that is only data.

The keys are those of :mod:`tcp.files.claims_schema`; an unknown key is refused
with the nearest known one.  Sizes and depths are bounded before the TOML parser
sees the text, numbers keep the digits they are printed with, and a path in a
claims file is followed only inside the claims file's own folder.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from tcp.errors import InputError, TcpError
from tcp.files import read, toml
from tcp.files.claims_schema import FORMAT, KINDS, SOURCE, Field
from tcp.files.printed import Printed, parse_printed
from tcp.files.reading import UNITS, Reading, travel_as
from tcp.files.write import real_path
from tcp.instance import Ends, Instance
from tcp.travel import Travel, parse_model
from tcp.words import shown
from tcp.workpiece import Workpiece

MAX_CLAIMS = 20_000

_HEADER = re.compile(r"^[ \t]*\[\[[ \t]*([A-Za-z_]+)[ \t]*\]\]")
_KEY = re.compile(r"^[ \t]*([A-Za-z_]+)[ \t]*=")


@dataclass(frozen=True, eq=False)
class Claim:
    """One claim: its kind, its values, and where each of them stands.

    Parameters
    ----------
    kind : str
        A key of :data:`tcp.files.claims_schema.KINDS`.
    id : str
        Its name in the file.
    source : str
        Key of the source.
    values : mapping
        Checked values: :class:`Printed` for numbers, text, bool, int, lists.
    path : path
        The file.
    line : int or None
        Line of the claim's header.
    lines : mapping
        Line of each key.
    """

    kind: str
    id: str
    source: str
    values: Mapping[str, Any]
    path: Path
    line: int | None = None
    lines: Mapping[str, int] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """The claim's name among all files, ``SOURCE#ID``."""
        return f"{self.source}#{self.id}"

    def text(self, key: str) -> str:
        """A text, empty where it is not given."""
        return str(self.values.get(key, ""))

    def number(self, key: str) -> Printed | None:
        """A printed number, None where it is not given."""
        value = self.values.get(key)
        return value if isinstance(value, Printed) else None

    def line_of(self, key: str | None) -> int | None:
        """Line of a key, or of the claim."""
        return self.line if key is None else self.lines.get(key, self.line)


@dataclass(frozen=True, eq=False)
class ClaimsFile:
    """A claims file, read and checked.

    Parameters
    ----------
    path : path
        The file.
    source : mapping
        Key, title, authors, ... of the paper.
    claims : tuple of Claim
        In the order of the kinds, then of the file.
    workpieces : mapping
        Workpieces by id.
    travels : mapping
        The travel models that the files of workpieces state, by their ids.
    """

    path: Path
    source: Mapping[str, Any]
    claims: tuple[Claim, ...]
    workpieces: Mapping[str, Workpiece]
    travels: Mapping[str, Travel | None] = field(default_factory=dict)

    def instance(self, claim: Claim) -> Instance | None:
        """The problem that a claim is about; None if it names no workpiece.

        Raises
        ------
        InputError
            If it names a workpiece, hole or travel model that does not exist.
        """
        name = claim.text("workpiece")
        if not name:
            return None
        if name not in self.workpieces:
            known = ", ".join(self.workpieces) or "none"
            raise InputError(
                f"no workpiece {name!r} in this file (it has {known})",
                self.path,
                claim.line_of("workpiece"),
            )
        piece = self.workpieces[name]
        try:
            travel = _travel(claim, self.travels.get(name))
            return Instance(piece, travel, _ends(claim, piece))
        except TcpError as error:
            raise InputError(f"claim {claim.id}: {error}", self.path, claim.line) from None


def read_claims(path: str | Path) -> ClaimsFile:
    """Read and check a claims file.

    Raises
    ------
    InputError
        For anything that is not a claims file; names file, line and the nearest known key.
    """
    path = Path(path)
    text = toml.read_text(path, "claims file")
    data = _parsed(text, path)
    lines = _line_numbers(text)
    source = _source(data, path)
    claims = _claims(data, str(source["key"]), path, lines)
    found = {c.id: _workpiece(c, path) for c in claims if c.kind == "workpiece"}
    pieces = {name: reading.workpiece for name, reading in found.items()}
    travels = {name: reading.travel for name, reading in found.items()}
    return ClaimsFile(path, source, tuple(claims), pieces, travels)


def _parsed(text: str, path: Path) -> dict[str, Any]:
    data = toml.parse(text, path, _Digits)
    if data.get("format") != FORMAT:
        raise InputError(f"is no claims file; expected format = {FORMAT!r}", path, 1)
    _known_keys(data, {"format", "source", *KINDS}, path, None)
    return data


class _Digits(str):
    """A TOML float as it stands in the file."""


def _known_keys(data: Mapping[str, Any], known: set[str], path: Path, line: int | None) -> None:
    for key in data:
        if key not in known:
            near = difflib.get_close_matches(key, sorted(known), n=1)
            hint = (
                f"; did you mean {near[0]!r}?" if near else f"; expected {', '.join(sorted(known))}"
            )
            raise InputError(f"unknown key {key[:80]!r}{hint}", path, line)


def _source(data: Mapping[str, Any], path: Path) -> dict[str, Any]:
    if not isinstance(data.get("source"), dict):
        raise InputError("has no table [source]", path)
    return _checked(data["source"], SOURCE, path, None, {})


def _claims(
    data: Mapping[str, Any], source: str, path: Path, lines: Mapping[str, list[_Lines]]
) -> list[Claim]:
    claims: list[Claim] = []
    seen: dict[str, Claim] = {}
    for kind, fields in KINDS.items():
        entries = data.get(kind, [])
        if not isinstance(entries, list) or not all(isinstance(e, dict) for e in entries):
            raise InputError(f"{kind} must be an array of tables: [[{kind}]]", path)
        places = lines.get(kind, [])
        if len(places) != len(entries):
            places = [_Lines(None, {})] * len(entries)
        for values, place in zip(entries, places, strict=True):
            checked = _checked(values, fields, path, place.header, place.keys)
            claim = Claim(kind, checked["id"], source, checked, path, place.header, place.keys)
            if claim.id in seen:
                first = seen[claim.id].line
                raise InputError(
                    f"the claim {claim.id!r} is there twice, first in line {first}",
                    path,
                    claim.line_of("id"),
                )
            seen[claim.id] = claim
            claims.append(claim)
    if len(claims) > MAX_CLAIMS:
        raise InputError(f"{len(claims)} claims; at most {MAX_CLAIMS} are read", path)
    return claims


def _checked(
    values: Mapping[str, Any],
    fields: Mapping[str, Field],
    path: Path,
    line: int | None,
    lines: Mapping[str, int],
) -> dict[str, Any]:
    """Values in the types of their fields, or one sentence about the first that is not."""
    for key in values:
        _known_keys({key: 0}, set(fields), path, lines.get(key, line))
    for key, entry in fields.items():
        if entry.required and key not in values:
            raise InputError(f"the key {key!r} is missing: {entry.doc}", path, line)
    checked = {}
    for key, value in values.items():
        try:
            checked[key] = _CASTS[fields[key].type](value)
        except InputError as error:
            raise InputError(f"{key}: {error}", path, lines.get(key, line)) from None
    return checked


def _as_text(value: Any) -> str:
    if not isinstance(value, str) or isinstance(value, _Digits):
        raise InputError("expected text in quotes")
    return value


def _as_texts(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list):
        raise InputError("expected a list of texts")
    return tuple(_as_text(v) for v in value)


def _as_whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**62:
        raise InputError("expected a whole number, 0 or more")
    return value


def _as_number(value: Any) -> Printed:
    if isinstance(value, bool) or not isinstance(value, (int, str)):
        raise InputError("expected a number")
    return parse_printed(value)


def _as_flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise InputError("expected true or false")
    return value


def _as_sequence(value: Any) -> str | tuple[str, ...]:
    if isinstance(value, str) and not isinstance(value, _Digits):
        return value
    if isinstance(value, list) and all(
        isinstance(v, (int, str)) and not isinstance(v, (bool, _Digits)) for v in value
    ):
        return tuple(str(v) for v in value)
    raise InputError("expected text, or a list of hole ids")


def _as_formula(value: Any) -> Any:
    """A number, a name, or a list whose first item is an operation; see validate.formula."""
    if isinstance(value, list):
        return tuple(_as_formula(v) for v in value)
    if isinstance(value, _Digits) or (isinstance(value, int) and not isinstance(value, bool)):
        return parse_printed(value)
    return _as_text(value)


def _as_figures(value: Any) -> dict[str, str]:
    if not isinstance(value, dict):
        raise InputError("expected a table of parameters")
    if any(
        isinstance(v, (bool, dict, list)) or not isinstance(v, (int, str)) for v in value.values()
    ):
        raise InputError("parameters are numbers or texts")
    return {k: str(v) for k, v in value.items()}


def _as_point(value: Any) -> tuple[Printed, Printed]:
    if not isinstance(value, list) or len(value) != 2:
        raise InputError("expected a position [x, y]")
    return _as_number(value[0]), _as_number(value[1])


def _as_choices(value: Any) -> tuple[tuple[str, Any], ...]:
    good = isinstance(value, list) and all(
        isinstance(v, dict) and set(v) == {"says", "compute"} for v in value
    )
    if not good:
        raise InputError("expected a list of {says = ..., compute = ...}")
    return tuple((_as_text(v["says"]), _as_formula(v["compute"])) for v in value)


def _as_value(value: Any) -> Printed | tuple[int, ...]:
    return tuple(_as_whole(v) for v in value) if isinstance(value, list) else _as_number(value)


_CASTS: dict[str, Callable[[Any], Any]] = {
    "text": _as_text,
    "texts": _as_texts,
    "whole": _as_whole,
    "number": _as_number,
    "flag": _as_flag,
    "sequence": _as_sequence,
    "formula": _as_formula,
    "figures": _as_figures,
    "point": _as_point,
    "choices": _as_choices,
    "value": _as_value,
}


@dataclass(frozen=True)
class _Lines:
    """Where a claim and its keys stand."""

    header: int | None
    keys: dict[str, int]


def _line_numbers(text: str) -> dict[str, list[_Lines]]:
    """Lines of claims and keys, found by their headers; strings over several lines are skipped."""
    found: dict[str, list[_Lines]] = {}
    keys: dict[str, int] = {}
    for number, line in enumerate(toml.without_strings(text).split("\n"), 1):
        header, key = _HEADER.match(line), _KEY.match(line)
        if header:
            keys = {}
            found.setdefault(header[1], []).append(_Lines(number, keys))
        elif key:
            keys.setdefault(key[1], number)
    return found


def _travel(claim: Claim, own: Travel | None) -> Travel:
    name, vx, vy = claim.text("travel"), claim.number("vx"), claim.number("vy")
    travel = travel_as(own, parse_model(name) if name else None)
    return replace(travel, vx=vx.value if vx else travel.vx, vy=vy.value if vy else travel.vy)


def _ends(claim: Claim, piece: Workpiece) -> Ends:
    holes = {k: _hole(claim, piece, k) for k in ("start", "end")}
    home = claim.values.get("home")
    legs = claim.text("legs") or "both"
    if legs not in ("both", "out", "back"):
        raise InputError(f"legs must be both, out or back, not {legs!r}")
    return Ends(
        start=holes["start"],
        end=holes["end"],
        home=None if home is None else (home[0].value, home[1].value),
        outward=home is not None and legs in ("both", "out"),
        back=home is not None and legs in ("both", "back"),
        closed=bool(claim.values.get("closed", False)),
    )


def _hole(claim: Claim, piece: Workpiece, key: str) -> int | None:
    name = claim.text(key)
    if not name:
        return None
    if name not in piece.index:
        raise InputError(f"there is no hole {name!r} to {key} at")
    return piece.index[name]


def _workpiece(claim: Claim, path: Path) -> Reading:
    given = [k for k in ("holes", "file", "from") if k in claim.values]
    if len(given) != 1:
        raise InputError("a workpiece needs one of holes, file and from", path, claim.line)
    try:
        units = claim.text("units") or None
        if units and units not in UNITS:
            raise InputError(f"units must be mm or inch, not {shown(units)}")
        if given == ["holes"]:
            return Reading(_inline(claim, UNITS[units or "mm"]))
        if given == ["file"]:
            return read(inside(path, claim.text("file")), units=units)
        return _borrowed(path, claim.text("from"))
    except InputError as error:
        if error.path is not None:
            raise
        raise InputError(f"workpiece {claim.id}: {error}", path, claim.line_of(given[0])) from None


def _inline(claim: Claim, unit: Fraction) -> Workpiece:
    rows = [row.split() for row in claim.values["holes"]]
    bad = next((row for row in rows if len(row) != 3), None)
    if bad is not None:
        raise InputError(f"{' '.join(bad)[:80]!r} is not 'id x y'")
    ids = [row[0] for row in rows]
    return Workpiece.from_decimals(claim.id, [(r[1], r[2]) for r in rows], ids, unit=unit)


def _borrowed(path: Path, reference: str) -> Reading:
    """A workpiece of another claims file in the same folder, one step only."""
    name, _, key = reference.partition("#")
    other = inside(path, name)
    text = toml.read_text(other, "claims file")
    data = _parsed(text, other)
    for claim in _claims(data, "", other, _line_numbers(text)):
        if claim.kind == "workpiece" and claim.id == key:
            if "from" in claim.values:
                raise InputError(f"{reference} is itself borrowed; name its origin")
            return _workpiece(claim, other)
    raise InputError(f"there is no workpiece {key!r} in {name}")


def inside(path: Path, name: str) -> Path:
    """The file ``name`` in the folder of ``path``.

    Raises
    ------
    InputError
        If it lies outside of that folder, symbolic links included.
    """
    folder = real_path(path).parent
    target = real_path(folder / name)
    if not target.is_relative_to(folder) or not name:
        raise InputError(f"{name[:80]!r} leads outside of the claims file's folder")
    return target
