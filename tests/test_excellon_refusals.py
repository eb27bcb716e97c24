"""What the Excellon reader refuses: one sentence with the line and what to do about it."""

from __future__ import annotations

from fractions import Fraction

import pytest

from tcp.errors import InputError
from tcp.files.excellon import Hints, parse, read_program

HEAD = "M48\nMETRIC,TZ\nT1C0.3\nT2C0.5\n%\n"
FORMAT_1 = b"M48\nFMAT,1\nMETRIC,TZ\nT1C0.3\n%\nT1\n"

BAD = {
    "empty": (b"", "is empty"),
    "blank": (b" \n\r\n", "is empty"),
    "nul": (HEAD.encode() + b"T1\nX1Y\x001\nM30\n", r":7: holds a NUL"),
    "utf16": ("\ufeff" + HEAD).encode("utf-16-le"),
    "utf16-bare": (HEAD.encode("utf-16-le"), "UTF-16"),
    "utf16-be": (HEAD.encode("utf-16-be"), "UTF-16"),
    "nul padded": (HEAD.encode() + b"T1\nX1Y1\nM30\n" + b"\0" * 500, r":9: holds a NUL"),
    "eia": (bytes([0x54, 0x07, 0x01, 0x80, 0x37, 0x20, 0x13, 0x80]) * 20, "EIA-coded"),
    "png": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "binary file"),
    "program": (b"\x7fELF\2\1\1" + b"\0" * 9 + b"\3\0>\0\1\0\0\0" * 20, "binary file"),
    "pdf": (b"%PDF-1.4\n1 0 obj\n", "PDF"),
    "zip": (b"PK\x03\x04", "archive"),
    "cut off": (HEAD.encode() + b"T1\nX1Y1\n", r":7: ends without M30"),
    "cut in a line": (HEAD.encode() + b"T1\nX1Y1\nX2", "ends without M30"),
    "no holes": (HEAD.encode() + b"M30\n", "holds no coordinates"),
    "no tool": (HEAD.encode() + b"X1Y1\nT1\nX1Y1\nM30\n", r":6: coordinates while no tool"),
    "no tool at all": (b"METRIC,TZ\n%\nX1Y1\nM30\n", r":3: coordinates before any tool"),
    "unknown tool": (HEAD.encode() + b"T7\nX1Y1\nM30\n", r":6: T7 is not defined"),
    "unknown word": (HEAD.encode() + b"T1\nX1Y1Q3\nM30\n", r":7: .*not understood"),
    "unknown line": (HEAD.encode() + b"T1\nhello world\nM30\n", r":7: .*not understood"),
    "unknown G": (HEAD.encode() + b"T1\nG77\nM30\n", r":7: G77 is not understood"),
    "words behind M": (HEAD.encode() + b"T1\nX1Y1\nM08X5\nM30\n", r":8: M08 with something behind"),
    "places behind S": (HEAD.encode() + b"T1\nS5X1Y1\nM30\n", r":7: 'S5X1Y1' is not understood"),
    "unknown M": (HEAD.encode() + b"T1\nM77\nM30\n", r":7: M77 is not understood"),
    "no X yet": (HEAD.encode() + b"T1\nY1\nM30\n", r":7: X is omitted"),
    "too long": (HEAD.encode() + b"T1\nX1234567Y1\nM30\n", r":7: .1234567. has more than the 6"),
    "huge": (HEAD.encode() + b"T1\nX99999999999.0Y1\nM30\n", r":7: .*no coordinate"),
    "decimals": (HEAD.encode() + b"T1\nX0.12345678901Y1\nM30\n", r":7: .*no coordinate"),
    "down": (HEAD.encode() + b"T1\nG00X1Y1\nM15\nG01X2\nM30\n", r":10: the router is still down"),
    "plunge": (HEAD.encode() + b"T1\nX1Y1\nM15\nM30\n", r":8: M15 plunges"),
    "repeat": (HEAD.encode() + b"T1\nR2X1\nM30\n", r":7: R repeats a hit"),
    "repeat count": (HEAD.encode() + b"T1\nX1Y1\nR0X1\nM30\n", r":8: R needs a count"),
    "too many": (HEAD.encode() + b"T1\nM25\nX1Y1\nR9999X1\nM01\nR9999M02X1\nM30\n", r":11: .*100,"),
    "other copy": (HEAD.encode() + b"T1\nM25\nX1Y1\nM01\nR2M30X1\nM30\n", r":10: R repeats copies"),
    "pattern": (HEAD.encode() + b"T1\nM25\nX1Y1\nM30\n", r":7: the pattern that begins here"),
    "slot without a start": (HEAD.encode() + b"T1\nX1Y1\nG85X5\nM30\n", r":8: G85 without"),
    "copy": (HEAD.encode() + b"T1\nX1Y1\nM02X5\nM30\n", r":8: M02 repeats a pattern"),
    "format 1, no pattern": (FORMAT_1 + b"M24\n", r":7: M24 ends a pattern, but no M25"),
    "format 1, no copy": (FORMAT_1 + b"M26X5\n", r":7: M26 repeats .* expected M25 \.\.\. M24"),
    "format 1, open": (FORMAT_1 + b"M25\nX1Y1\nM27\n", r":9: M27 ends .* M24 is missing"),
    "format 1, words": (FORMAT_1 + b"M27X1\n", r":7: M27 with something behind"),
    "format 1, cut": (FORMAT_1 + b"X1Y1\n", r":7: ends without M02"),
    "negative": (b"M48\nMETRIC,TZ\nT1C-0.8\n%\nT1\nX1Y1\nM30\n", r":3: '-0.8' is no diameter"),
    "after end": (HEAD.encode() + b"T1\nX1Y1\nM30\nX2Y2\n", r":9: follows the end"),
    "other units": (HEAD.encode() + b"T1\nX1Y1\nINCH\nM30\n", r":8: states units inch, but line 2"),
    "format late": (HEAD.encode() + b"T1\nX1Y1\nMETRIC,0000.00\nM30\n", r":8: states the format"),
    "zero set": (HEAD.encode() + b"T1\nX1Y1\nG93X5Y5\nX2Y2\nM30\n", r":8: G93 moves"),
    "zero set back": (HEAD.encode() + b"G93X5Y5\nT1\nX1Y1\nG93X0Y0\nX2Y2\nM30\n", r":9: G93 moves"),
    "zero set, bare": (HEAD.encode() + b"G93X5Y5\nT1\nX1Y1\nG93\nX2Y2\nM30\n", r":9: G93 moves"),
    "zero set in a path": (HEAD.encode() + b"T1\nG00X1Y1\nM15\nG93X5Y5\n", r":9: G93 moves"),
    "other diameter": (b"M48\nMETRIC\nT1C0.8\nT1F200\nT1C1.2\n%\nT1\nX1Y1\n", r":5: .*on line 3"),
    "two diameters": (b"M48\nMETRIC\nT1C0.8C0.9\n%\nT1\nX1Y1\n", r":3: T1 has several diameters"),
    "other units in KiCad's words": (
        b"M48\n; FORMAT={-:-/ absolute / inch / decimal}\nMETRIC\n",
        r":3: states units mm, but line 2 says inch",
    ),
    "a format of 24 digits": (b"M48\n;FILE_FORMAT=4:22\nINCH\n", r":2: states .* but 4:22 is no"),
    "the same in KiCad's words": (
        b"M48\n; FORMAT={3:33/ absolute / metric / keep zeros}\n",
        r":2: states .* but 3:33 is no",
    ),
    "the same in Siemens' words": (
        b"M48\n; Format  : 2.44 / Absolute / Inch / Trailing\n",
        r":2: states .* but 2:44 is no",
    ),
    "gerber": (b"G04 x*\n%FSLAX24Y24*%\nM02*\n", "Gerber"),
    "hpgl": (b"IN;SP1;PU100,100;PD;\n", "HPGL"),
    "gcode": (b"G21\nG90\nG0 X1 Y1 Z5\nG1 Z-2\nM30\n", "G-code"),
    "report": (b"NCDrill File Report For: x\n", "report"),
    "html": (b"<!DOCTYPE html>\n<html>", "HTML"),
}  # fmt: skip
BAD["utf16"] = (BAD["utf16"], "UTF-16")


@pytest.mark.parametrize("name", BAD)
def test_bad_files_get_one_sentence_with_line_and_remedy(name):
    data, said = BAD[name]
    with pytest.raises(InputError, match=said) as caught:
        parse(data, "board.drl")
    assert "\n" not in str(caught.value)


def test_a_file_without_its_end_can_be_accepted():
    assert parse(HEAD.encode() + b"T1\nX1Y1\n", hints=Hints(unfinished=True)).hits == 1


def test_a_diameter_of_zero_is_one_that_nobody_knows():
    head = HEAD.replace("C0.3", "C0.000").encode()
    program = parse(head + b"T1\nX1Y1\nT2\nX2Y2\nM30\n")
    assert [tool.diameter for tool in program.tools.values()] == [None, Fraction(1, 2)]


def test_a_line_with_other_words_of_a_tool_keeps_its_diameter():
    program = parse(b"M48\nMETRIC,TZ\nT1C0.8\nT1F200S65\n%\nT1\nX1Y1\nM30\n")
    assert program.tools[1].diameter == Fraction(4, 5)


def test_missing_files_and_folders(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_program(tmp_path / "none.drl")
    with pytest.raises(InputError, match="is a directory"):
        read_program(tmp_path)
    loop = tmp_path / "loop.drl"
    loop.symlink_to(loop)
    with pytest.raises(InputError, match="symbolic links"):
        read_program(loop)


@pytest.mark.parametrize(
    "line", ["{0}!", "X{0}!", "X1{0}!", "X 1{0}Y{0}!", "X1{1}!", "{2}!", "({1}"]
)
def test_no_line_takes_long_to_be_refused(line):
    """Such lines took longer than any test waits: quadratic, cubic, exponential."""
    line = line.format(" " * 20_000, "1" * 20_000, "X " * 10_000)
    with pytest.raises(InputError, match=r":6: "):
        parse(f"{HEAD}{line}\nM30\n".encode(), "f.drl")


def test_a_line_without_end_is_refused_before_it_is_read():
    with pytest.raises(InputError, match=r":7: the line is longer than 1048576 bytes"):
        parse(HEAD.encode() + b"T1\n" + b"X1Y1" * 300_000 + b"\nM30\n", "f.drl")


def test_notes_on_single_lines_are_few():
    notes = parse(b"M48\n" + b"NONE,1\n" * 500 + b"METRIC,TZ\nT1C1.\n%\nT1\nX1Y1\nM30\n").notes
    assert len(notes) == 21 and notes[-1] == "and 480 more lines like these"


@pytest.mark.parametrize(
    ("repeats", "line"),
    [("R999999M02X1\nM08\n" * 9, 30), ("M08\nX1Y1\n" + "R1000000X1\n" * 30, 51)],
)
def test_repeats_that_ask_for_more_than_memory_are_refused_on_their_line(repeats, line):
    """Copies were built first, and counted at the end."""
    block = "M25\n" + "X1Y1\n" * 21 + "M01\n"
    with pytest.raises(InputError, match=rf":{line}: the file makes 2.,\d+,\d+ holes up to here"):
        parse(f"{HEAD}T1\n{block}{repeats}".encode(), "f.drl")


LONG = "\x81\\'\t" * 2000
PLACES = [
    *(
        "M48\nINCH,{}\n",
        "M48\nT1C{}\n",
        "M48\n;FILE_FORMAT={}\n%\nX1\n",
        "M48\nINCH\nT1C.02\n%\n{}\n",
    ),
    *("INCH\nT1C.02\nX1.{}\n", "INCH\nT1C.02\nX{}1\n", "INCH\nT1C.02\nX1{}Y1G85\n"),
    *("INCH\nT1C.02\nX1.Y1.\nR2X{}\n", "INCH\nT1C.02\nX1.Y1.\nM02{}\n", "INCH\nT1C.02\nT{}\n"),
]


@pytest.mark.parametrize("junk", [LONG, "9" * 5000, "M" * 5000, "1." * 2000, "é" * 5000])
@pytest.mark.parametrize("place", PLACES)
def test_no_message_repeats_a_long_line(place, junk):
    with pytest.raises(InputError) as caught:
        parse(place.format(junk).encode("latin-1"), "f.drl")
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 300
