"""Which kind of file this is, and what the files beside it say.

Drill extensions are worn by many formats.  What is no Excellon file is
refused by its name before anything is read; Allegro and Altium write a second
file that explains the first.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

from tcp.errors import InputError, system_reason
from tcp.files.excellon.numbers import Digits, Units, Zeros
from tcp.files.excellon.settings import Sidecar

HEAD = 65_536
"""Bytes that are looked at to recognise a format."""


def recognise(data: bytes, path: Path) -> None:
    """Refuse, by name, what is no Excellon text.

    Raises
    ------
    InputError
        Naming the format and what to do about it.
    """
    head = data[:HEAD]
    if not head.strip() and not data.strip():
        raise InputError("the file is empty; expected an Excellon drill file", path)
    name = _binary(head) or _textual(head.decode("latin-1"))
    if name:
        raise InputError(name, path)
    at = data.find(b"\0")
    if at >= 0:
        line = data.count(b"\n", 0, at) + 1
        raise InputError("holds a NUL byte; expected text, so the file is damaged", path, line)


def _binary(head: bytes) -> str | None:
    if _wide(head):
        return "is UTF-16 text; convert it to ASCII (iconv -f UTF-16 -t ASCII)"
    if head[:2] in (b"PK", b"\x1f\x8b") or head[:4] == b"Rar!":
        return "is an archive; unpack it first"
    if b"\x80" in head and sum(b.bit_count() % 2 for b in head) > 0.95 * len(head):
        return "is an EIA-coded (binary) drill tape; export the ASCII drill file instead"
    if sum(b < 32 and b not in b"\t\r\n\x0c\x1a\0" for b in head) > len(head) // 20:
        return "is a binary file; expected an Excellon drill file"
    return None


def _wide(head: bytes) -> bool:
    """Whether text is UTF-16: a byte order mark, or zeros in every other place and only there."""
    start = head[:1000]
    zeros = start[::2].count(0), start[1::2].count(0)
    return head[:2] in (b"\xff\xfe", b"\xfe\xff") or (
        max(zeros) > len(start) // 10 and min(zeros) <= len(start) // 100
    )


_REPORTED = re.compile(r"^T(\d+)\s+\S+\s+\([^)]*\)\s+(?:Round|Slot)\s+(\d+)\s", re.M)
_GCODE = re.compile(
    r"^[ \t]*+(?:N\d++[ \t]*+)?"
    r"(?:G\d.*Z[-+.\d]|(?:[GM][\d.]++[ \t]*+){0,8}G(?:20|21|17|54|81|82|83|73)(?!\d)|Z[-+.\d])",
    re.M,
)
_EXCELLON = re.compile(  # a line that begins with T1, or with %, and goes on is a table's
    rb"^[ \t]*+(?:(?:M48|%|T\d++[^\s,;]*+)[ \t]*+(?:[\r\n]|\Z)|X[-+]?[\d.]+Y)", re.M
)
_HEADER = re.compile(r"^[ \t]*+M48[ \t\r]*+$(.*?)(?:^[ \t]*+(?:%|M95)|\Z)", re.M | re.S)
_LOOKS = (
    (r"^%(?:FS|MO|AD|AM|LP|TF)|^[ \t]*+X-?\d++Y-?\d++D0[123]\*", "is a Gerber file"),
    (r"^(?:IN;|PU|PD|SP\d)[^\n]*;", "is an HPGL plot"),
    (r"NCDrill File Report|^-{20,}+[ \t\r]*+$", "is a drill report, not a drill file"),
    (r"^[ \t]*+\(kicad_pcb\b", "is a KiCad board"),
    (r"\A%PDF-", "is a PDF document"),
    (r"^[ \t]*+0[ \t]*+\r?\n[ \t]*+SECTION[ \t]*+\r?\n", "is a DXF drawing"),
    (r"^[ \t]*+<(?i:\?xml|!DOCTYPE|html)", "is an XML or HTML page"),
)
_CELLS = [(re.compile(look, re.M), name) for look, name in _LOOKS]


def _textual(head: str) -> str | None:
    for pattern, name in _CELLS:
        if pattern.search(head):
            return f"{name}; expected an Excellon drill file"
    if looks_gcode(head.encode("latin-1")):
        return "is a G-code program, not an Excellon drill file; name it .ngc, .nc or .gcode"
    return None


def looks_excellon(data: bytes) -> bool:
    """Whether a file of unknown name is worth reading as Excellon."""
    head = data[:HEAD]
    if _binary(head) or _textual(head.decode("latin-1")):
        return False
    return bool(_EXCELLON.search(head))


def looks_gcode(data: bytes) -> bool:
    """Whether a file has a G-code program's words (Z, plane) and no Excellon header."""
    head = data[:HEAD].decode("latin-1")
    bare = re.sub(r"\([^()]*+\)|;[^\n]*+", "", head)
    header = _HEADER.search(bare)  # to G-code, M48 is no header but enables overrides
    return bool(_GCODE.search(bare)) and not (header and not _GCODE.search(header[1]))


def find_sidecar(path: Path, data: bytes, given: Path | None = None) -> Sidecar | None:
    """The sidecar that explains a file: the given one, its namesake, or its folder's.

    ``nc_param.txt`` of a folder speaks for Allegro's files only, which name themselves by a
    ``;LEADER:`` comment, and a report (``.DRR``) for the Altium files that it names.
    """
    if given is not None:
        return read_sidecar(given)
    head, beside = data[:HEAD], [path.with_suffix(".nc_param.txt")]
    if re.search(rb"^;\s*LEADER\s*:", head, re.M):
        beside.append(path.with_name("nc_param.txt"))
    if re.search(rb"^;\s*FILE_FORMAT\s*=", head, re.M):
        reports = [*path.parent.glob("*.DRR"), *path.parent.glob("*.drr")]
        beside += [report for report in sorted(reports) if path.name in _text(report)]
    return next((read_sidecar(p) for p in beside if p.is_file()), None)


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return file.read(HEAD).decode("latin-1")
    except OSError as error:
        raise InputError(f"the sidecar cannot be read: {system_reason(error)}", path) from None


def read_sidecar(path: Path) -> Sidecar:
    """Read Allegro's ``nc_param.txt`` or the hole counts of Altium's ``.DRR``.

    Raises
    ------
    InputError
        If the file is neither or cannot be read.
    """
    text = _text(path)
    if "NCDrill File Report" in text:
        counts = Counter[int]()
        for tool, holes in _REPORTED.findall(text):
            counts[int(tool)] += int(holes)
        return Sidecar(path, counts=counts)
    words = dict(re.findall(r"^([A-Z_-]+)\s+(\S+)\s*$", text, re.M))
    if not {"INTEGER-PLACES", "DECIMAL-PLACES"} <= words.keys():
        raise InputError("is neither an nc_param.txt nor an Altium drill report", path)
    try:
        digits = Digits(int(words["INTEGER-PLACES"]), int(words["DECIMAL-PLACES"]))
    except ValueError:
        raise InputError("states a number format that is no number", path) from None
    units = {"ENGLISH": Units.INCH, "METRIC": Units.MM}.get(words.get("OUTPUT-UNITS", ""))
    zeros = None
    if words.get("SUPPRESS-LEAD-ZEROES") == "YES":
        zeros = Zeros.TZ
    elif words.get("SUPPRESS-TRAIL-ZEROES") == "YES":
        zeros = Zeros.LZ
    return Sidecar(path, units, digits, zeros, words.get("COORDINATES") == "INCREMENTAL")
