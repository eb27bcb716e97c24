"""Headers and comments: tool tables, settings, and what CAD tools hide behind a semicolon."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import TYPE_CHECKING

from tcp.files.excellon.program import Tool
from tcp.words import shown

if TYPE_CHECKING:
    from tcp.files.excellon.state import State

_KNOWN = re.compile(
    r"(?:AFS|ATC|BLKD|CCW|CP|DETECT|DN|DTMDIST|EXDA|FMAT|FSB|HBCK|HPCK|ICI|NCSL|OM48|OSTOP|OTCLMP|"
    r"PCKPARAM|PF|PLTMODE|R,|RC?T?,|RSB|SBK|SG|SIXM|TCST|TP|UP|VER|Z[A,C]|(?:XY|YX|/)$|M\d+,|%)"
)
_INPUT = re.compile(r"ICI|(?:[GMN]\d++[ \t]*+)*G[ \t]*+0*+9[01](?!\d)", re.I)
_TOOL = re.compile(r"T\d++(?:[A-Z][+-]?[\d.]*+)*+$")
_WORD = re.compile(r"([A-Z])([+-]?[\d.]*)")
_HOLESIZE = re.compile(
    r";\s*(?:T(\d+)\s+)?Holesize\s+(\d+)\.\s*=\s*(\d++(?:\.\d*+)?|\.\d++)\s+Tolerance\s*=\s*\S+\s+"
    r"(PLATED|NON_PLATED|OPTIONAL)?\s*(MILS|MM|INCH|INCHES|MILLIMETERS)?"
    r"(?:\s+Quantity\s*=\s*(\d{1,9})\b)?"
)
_MM = {
    "MILS": Fraction(254, 10000),
    "MM": Fraction(1),
    "MILLIMETERS": Fraction(1),
    "INCH": Fraction(254, 10),
    "INCHES": Fraction(254, 10),
}


def header_line(reader: State, line: str, strict: bool = False) -> None:
    """One line between M48 and ``%`` (or a setting of that kind further down: ``strict``)."""
    if not strict and line in ("%", "M95"):
        reader.header = False
    elif line.startswith("T") and _TOOL.match(line):
        reader.select([(letter, text.encode()) for letter, text in _WORD.findall(line)])
    elif reader.settings.unit_line(line, reader.at + 1):
        pass
    elif _INPUT.match(line):
        reader.incremental = _incremental(reader, line)
    elif line.startswith("FMAT"):
        reader.format_1 = line.endswith("1")
    elif not strict and re.match(r"[XYR]?[XY][+-]?\d", line):
        reader.refuse("coordinates inside the header; expected % or M95 before them")
    elif not _KNOWN.match(line) and (strict or not re.match(r"[GM]\d+", line)):
        if strict:
            reader.refuse(f"{shown(line)} is not understood; expected an Excellon command")
        reader.note(f"the header line {shown(line)} is not known; it is kept as it is")


def _incremental(reader: State, line: str) -> bool:
    """Whether a line about incremental input (ICI, G90, G91) turns it on."""
    word = re.sub(r"^G0+", "G", "".join(line.upper().split()))
    if word not in ("ICI", "ICI,ON", "ICI,OFF", "G90", "G91"):
        expected = "expected ICI,ON, ICI,OFF, G90 or G91 alone on its line"
        reader.refuse(f"{shown(line)} does not say whether input is incremental; {expected}")
    return word in ("ICI", "ICI,ON", "G91")


def note_comment(reader: State, text: str) -> None:
    """Tool definitions, plating and number formats that comments state."""
    reader.settings.comment(text, reader.at + 1)
    if "TYPE=" in text:
        if re.match(r";\s*TYPE=PLATED", text):
            reader.plated = True
        elif re.match(r";\s*TYPE=NON_PLATED", text):
            reader.plated = False
    if "#@!" in text and "NonPlated" in text:
        reader.plated = False
    elif "#@!" in text and "Plated," in text:
        reader.plated = True
    found = _HOLESIZE.match(text)
    if not found or not found[5] or reader.selections:
        return
    number = int(found[1] or found[2])
    if found[6]:
        reader.stated.setdefault(number, int(found[6]))
    if number not in reader.tools:
        diameter = Fraction(found[3]) * _MM[found[5]] or None
        plated = None if found[4] is None else found[4] == "PLATED"
        reader.tools[number] = Tool(number, diameter, plated, reader.at + 1)
