"""Excellon reader: real boards, dialects, and files it must refuse."""

from __future__ import annotations

import csv
import math
import warnings
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Model, Travel, files
from tcp.errors import InputError, UsageError
from tcp.files.excellon import (
    Digits,
    Hints,
    Kind,
    Mark,
    Units,
    Zeros,
    choose_tool,
    expanded,
    hints,
    oddities,
    parse,
    parse_digits,
    read_program,
    workpiece,
)
from tcp.files.excellon.dialects import read_sidecar
from tcp.files.excellon.document import cut
from tcp.files.excellon.rewrite import Order, reorder

REFUSED = {
    "altium-AFCv2-EIA.drl": "EIA",
    "altium-AFCv2.DRR": "report",
    "upverter-design_export.xln": "Gerber",
    "neg-syntax_error.exc": r":12: T99 is not defined",
}


def index(corpus: Path) -> list[dict[str, str]]:
    with (corpus / "boards" / "INDEX.tsv").open() as file:
        return list(csv.DictReader(file, delimiter="\t"))


def test_counts_equal_the_index_on_every_board(corpus, unstated):
    rows = [r for r in index(corpus) if r["file"] not in REFUSED]
    assert len(rows) >= 48
    for row in rows:
        program = read_program(
            corpus / "boards" / row["file"], hints(**unstated.get(row["file"], {}))
        )
        found = (program.hits, program.slots, program.routed)
        listed = tuple(int(row[c]) for c in ("hits", "slots_G85", "routed_M15"))
        assert found == listed, row["file"]
        repeats = sum(map(len, program.repeats.values()))
        assert repeats == int(row["R_repeats"]), row["file"]
        assert len(expanded(program)[0]) == program.hits, row["file"]
        assert not [note for note in program.notes if "are stated" in note], row["file"]


def test_every_byte_of_every_board_belongs_to_a_line(corpus):
    for path in sorted((corpus / "boards").iterdir()):
        data = path.read_bytes()
        assert cut(data).write() == data, path.name


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_drill_file_is_refused_by_name(corpus, name):
    with pytest.raises(InputError, match=REFUSED[name]):
        read_program(corpus / "boards" / name)


def test_what_a_file_does_not_state_is_not_guessed(corpus, unstated):
    assert len(unstated) == 6
    for name in unstated:
        with pytest.raises(InputError, match=r":\d+: .*--(units|format|zeros)"):
            read_program(corpus / "boards" / name)


def test_tool_travel_of_the_altium_report(corpus):
    """Altium's report states the Euclidean length of the file's order: 7677.79 mm."""
    program = read_program(corpus / "boards" / "altium-AFCv2-round-plated.txt")
    piece = workpiece(program, choose_tool(program, None))
    steps = np.hypot(np.diff(piece.x), np.diff(piece.y)).sum() * float(piece.step)
    assert steps == pytest.approx(7677.84, abs=0.01)
    counts = read_sidecar(corpus / "boards" / "altium-AFCv2.DRR").counts
    assert {t: program.drilled(t) for t in program.used} == {t: counts[t] for t in program.used}


def second_opinion(path: Path) -> list[tuple[float, float]] | None:
    """The holes as gerbonara reads them, in mm; None where it gives up."""
    from gerbonara import excellon

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            theirs = excellon.ExcellonFile.open(path)
        except (SyntaxError, ValueError):
            return None
        to_mm = [
            (h.unit.convert_to("mm", h.x), h.unit.convert_to("mm", h.y)) for h in theirs.drills()
        ]
    return sorted((round(float(x), 3), round(float(y), 3)) for x, y in to_mm)


def near(ours: list[tuple[float, float]], theirs: list[tuple[float, float]]) -> bool:
    return len(ours) == len(theirs) and all(map(lambda p, q: math.dist(p, q) < 0.003, ours, theirs))


def test_gerbonara_agrees_where_it_succeeds(corpus, unstated, tmp_path):
    """Same holes, in mm, as read and as re-ordered, on boards that state their format."""
    pytest.importorskip("gerbonara", reason="gerbonara is not installed")
    agreed = holes = 0
    for path in sorted((corpus / "boards").iterdir()):
        try:
            program = read_program(path, hints(**unstated.get(path.name, {})))
        except InputError:
            continue
        theirs = second_opinion(path)
        if theirs is None or "format" in unstated.get(path.name, {}):  # they guess, or give up
            continue
        _, x, y = expanded(program)
        mm = [(round(float(v * program.step), 3) for v in axis.tolist()) for axis in (x, y)]
        assert near(sorted(zip(*mm, strict=True)), theirs), path.name
        orders = {
            a: Order(np.arange(a, b)[::-1], np.zeros(b - a, bool)) for a, b in program.stretches()
        }
        turned = tmp_path / path.name
        turned.write_bytes(reorder(program, orders))
        assert near(second_opinion(turned) or [], theirs), path.name
        agreed, holes = agreed + 1, holes + len(theirs)
    assert agreed >= 30 and holes > 25_000


# -- dialects ------------------------------------------------------------------------------

HEAD = "M48\nMETRIC,TZ\nT1C0.3\nT2C0.8\n%\n"


def read(body: str, head: str = HEAD, hints: Hints | None = None, end: str = "M30\n"):
    return parse((head + body + end).encode("latin-1"), "board.drl", hints)


def places(program):
    tool, x, y = expanded(program)
    step = program.step
    return [
        (t, str(float(a * step)), str(float(b * step)))
        for t, a, b in zip(tool.tolist(), x.tolist(), y.tolist(), strict=True)
    ]


def test_modal_coordinates_survive_a_tool_change():
    program = read("T1\nX1000Y2000\nX3000\nY4000\nT2\nX5000\n")
    assert places(program) == [
        (1, "1.0", "2.0"),
        (1, "3.0", "2.0"),
        (1, "3.0", "4.0"),
        (2, "5.0", "4.0"),
    ]


def test_long_runs_equal_single_lines():
    lines = [
        (f"X{i * 7}" if i % 3 else "") + (f"Y{i * i}" if i % 2 or not i % 3 else "")
        for i in range(1, 200)
    ]
    body = "T1\nX0Y0\n" + "\n".join(lines) + "\n"
    slow = "T1\nX0Y0\n" + " \n\n".join(lines) + "\n"
    assert places(read(body)) == places(read(slow))


@pytest.mark.parametrize(
    ("unit", "text", "mm"),
    [
        ("INCH,LZ", "X01Y0025", ("25.4", "6.35")),
        ("INCH,TZ", "X10000Y2500", ("25.4", "6.35")),
        ("METRIC,LZ", "X01Y-0025", ("10.0", "-2.5")),
        ("METRIC,LZ,0000.00", "X01Y0025", ("100.0", "25.0")),
        ("METRIC,TZ,000.000", "X+1Y-25", ("0.001", "-0.025")),
        ("METRIC,0000.00", "X000100Y002500", ("1.0", "25.0")),
        ("INCH", "X1.5Y-.25", ("38.1", "-6.35")),
        ("METRIC", "X5.Y-0.125", ("5.0", "-0.125")),
        ("M71,TZ", "X1500Y2", ("1.5", "0.002")),
    ],
)
def test_number_formats(unit, text, mm):
    program = read(f"T1\n{text}\n", f"M48\n{unit}\nT1C0.3\n%\n")
    assert places(program) == [(1, *mm)]


def test_formats_from_comments_flags_and_defaults():
    head = "M48\n;FILE_FORMAT=4:4\nMETRIC,LZ\nT1C0.3\n%\n"
    assert places(read("T1\nX0012Y0034\n", head)) == [(1, "12.0", "34.0")]
    kicad = "M48\n;FORMAT={3:3/ absolute / metric / suppress leading zeros}\nMETRIC,TZ\nT1C.3\n%\n"
    assert places(read("T1\nX12Y34\n", kicad)) == [(1, "0.012", "0.034")]
    plain = "%\nT1C.3F095S3\n"
    hints = Hints(Units.MM, Digits(3, 4), Zeros.LZ)
    assert places(read("X0123Y1\n", plain, hints)) == [(1, "12.3", "100.0")]


@pytest.mark.parametrize(
    ("hints", "said"),
    [
        (Hints(units=Units.INCH), "states units mm, but --units says inch"),
        (Hints(zeros=Zeros.LZ), "states zeros tz, but --zeros says lz"),
    ],
)
def test_a_flag_that_contradicts_the_file_is_refused(hints, said):
    with pytest.raises(InputError, match=said):
        read("T1\nX1Y1\n", hints=hints)


def test_repeats():
    program = read("T1\nX1000Y1000\nR2X500\nR01X0Y1000\nX9000Y9000\n")
    assert [p[1:] for p in places(program)] == [
        ("1.0", "1.0"),
        ("1.5", "1.0"),
        ("2.0", "1.0"),
        ("2.0", "2.0"),
        ("9.0", "9.0"),
    ]
    assert program.hits == 5 and len(program.rows) == 2


def test_incremental_input():
    program = read("T1\nG91\nX1000Y1000\nX500\nY-500\nR2X100\nG90\nX0Y0\n")
    assert [p[1:] for p in places(program)] == [
        ("1.0", "1.0"),
        ("1.5", "1.0"),
        ("1.5", "0.5"),
        ("1.6", "0.5"),
        ("1.7", "0.5"),
        ("0.0", "0.0"),
    ]
    assert places(read("T1\nX1Y1\nX1Y1\n", HEAD.replace("M48", "M48\nICI,ON")))[1][1] == "0.002"


@pytest.mark.parametrize(
    ("line", "second"),
    [("ICI", "2.0"), ("ICI, on", "2.0"), ("ici,off", "1.0"), ("G091", "2.0"), ("G 90", "1.0")],
)
def test_a_header_says_whether_input_is_incremental(line, second):
    head = HEAD.replace("M48", f"M48\n{line}")
    assert places(read("T1\nX1000Y1000\nX1000Y1000\n", head))[1][1] == second


@pytest.mark.parametrize("line", ["ICI ON", "ICI,YES", "ICI,", "G91X5", "G05G91", "N5 G91"])
def test_a_header_that_says_it_otherwise_is_refused(line):
    with pytest.raises(
        InputError, match=rf":2: '{line}' does not say whether input is incremental"
    ):
        read("T1\nX1Y1\n", HEAD.replace("M48", f"M48\n{line}"))


def test_step_and_repeat_with_mirrors():
    body = "T1\nM25\nX1000Y2000\nX3000\nM01\nM02X10000\nM02Y5000M80\nM02X0Y0M70\nM08\nX0Y0\n"
    program = read(body)
    assert program.hits == 9
    assert [p[1:] for p in places(program)] == [
        ("1.0", "2.0"), ("3.0", "2.0"),
        ("11.0", "2.0"), ("13.0", "2.0"),
        ("9.0", "7.0"), ("7.0", "7.0"),
        ("12.0", "6.0"), ("12.0", "8.0"),
        ("0.0", "0.0"),
    ]  # fmt: skip


def test_several_patterns_in_one_block_and_repeated_copies():
    body = "M25\nT1\nX1Y1\nM01\nM02X100\nT2\nX2Y2\nM01\nR3M02Y100\nM08\n"
    program = read(body)
    assert (program.hits, program.drilled(1), program.drilled(2)) == (6, 2, 4)


def test_slots_paths_and_canned_cycles():
    body = (
        "T1\nX0Y0G85X5000Y0\nX1Y1G82X3Y3\nX5Y5\nT2\nG00X1000Y1000\nM15\nG01X2000\nM16\nG05\n"
        "G00X4000Y1000\nM15\nG01X5000Y2000\nX6000\nG02X7000Y2000A500\nM16\nG05\nX9Y9\n"
    )
    program = read(body)
    assert (program.hits, program.slots, program.routed) == (2, 1, 2)
    kinds = [Kind(k) for k in program.rows.kind.tolist()]
    assert kinds == [Kind.SLOT, Kind.CANNED, Kind.HIT, Kind.ROUTE, Kind.ROUTE, Kind.HIT]
    assert program.rows.stretch.tolist() == [0, 1, 2, 3, 3, 4]


def test_paths_share_a_stretch_and_straight_ones_are_free():
    def path(x: int, more: str = "") -> str:
        return f"G00X{x}Y0\nM15\nG01X{x}Y900\n{more}M16\nG05\n"

    program = read("T1\n" + path(1) + path(2) + path(3, "X9\n") + path(4))
    assert program.rows.stretch.tolist() == [0, 0, 0, 0]
    free = [bool(mark & Mark.FREE) for mark in program.rows.mark.tolist()]
    assert free == [True, True, False, True]


@pytest.mark.parametrize(
    "inside", ["F100\n", "M47,look\n", "G41\n", "G93X0Y0\n"], ids=lambda text: text.strip()
)
def test_a_path_with_a_command_that_outlasts_it_stays(inside):
    path = "G00X{}Y0\nM15\n{}G01X{}Y9\nM16\nG05\n"
    program = read(
        "T1\n" + path.format(1, "", 1) + path.format(2, inside, 2) + path.format(3, "", 3)
    )
    assert len(set(program.rows.stretch.tolist())) == 3
    assert program.rows.mark[1] & Mark.FIXED


def test_a_path_that_leans_on_the_mode_before_it_stays():
    program = read("T1\nG00X1Y0\nM15\nM16\nX5Y0\nM15\nG01X5Y9\nM16\nG05\n")
    assert not program.rows.mark[0] & Mark.FIXED and program.rows.mark[1] & Mark.FIXED


def test_m00_changes_tools_in_allegro_files():
    comments = "".join(
        f";   Holesize {n}. = {n}0.0 Tolerance = +0.000000/-0.000000 PLATED MILS Quantity = 1\n"
        for n in (1, 2)
    )
    program = read(
        "G90\nX000001Y000002\nM00\nX000003Y000004\n", comments + "%\n", Hints(Units.INCH)
    )
    assert [(p[0]) for p in places(program)] == [1, 2]
    assert program.tools[2].diameter == Fraction(508, 1000) and program.tools[2].plated


def test_tool_zero_is_real_where_it_is_defined():
    program = read("T0\nX1Y1\n", "M48\nMETRIC,TZ\nT0C0.5\n%\n")
    assert program.used == (0,)
    with pytest.raises(InputError, match=r"board.drl:7: .*T0 has unloaded"):
        read("T1\nT0\nX1Y1\n".replace("T1\n", "T1\n", 1), HEAD.replace("T2C0.8\n", ""))


def test_middle_headers_and_same_tool_again():
    body = "T1\nX1Y1\nM48\nT3C0.9\n%\nT3\nX2Y2\nT1\nX3Y3\n"
    program = read(body)
    assert program.used == (1, 3) and len(program.selections) == 3
    with pytest.raises(InputError, match="another diameter"):
        read("T1\nX1Y1\nM48\nT1C0.9\n%\n")


def test_format_1_codes():
    head = "M48\nFMAT,1\nMETRIC,TZ\nT1C0.3\n%\nM25\n"
    program = parse((head + "T1\nX1Y1\nM24\nM26X5\nM27\nM02\n").encode(), "b.drl")
    assert program.hits == 2


def test_plating_and_units_of_tools():
    head = "M48\nINCH,TZ\n;TYPE=PLATED\nT1C0.01\n;TYPE=NON_PLATED\nT2F00S00C.02\n%\n"
    program = read("T1\nX1Y1\n", head)
    assert program.tools[1].diameter == Fraction(254, 1000)
    assert [program.tools[t].plated for t in (1, 2)] == [True, False]


def test_oddities_are_warned_about():
    found = oddities(read("T1\nX0Y0\nX100Y0\nX0Y0\nX900000Y0\n"))
    assert found[0].startswith("the board would be 900.0 x 0.0 mm, more than 460 mm")
    assert [s.split(":")[0] for s in found[1:]] == ["T1", "T1"]
    assert oddities(read("T1\nX0Y0\nX1000Y0\n")) == []


# -- what stands beside a file, and what is asked of it ---------------------------------------


def test_sidecars(tmp_path):
    (tmp_path / "nc_param.txt").write_text(
        "INTEGER-PLACES 3\nDECIMAL-PLACES 4\nOUTPUT-UNITS METRIC\nSUPPRESS-LEAD-ZEROES YES\n"
    )
    board = tmp_path / "board.drl"
    text = "T1C.3\n%\nX12Y34\nM30\n"
    board.write_text(text)
    with pytest.raises(InputError, match="does not state its units"):
        read_program(board)
    board.write_text(";LEADER: 12\n" + text)
    assert places(read_program(board)) == [(1, "0.0012", "0.0034")]
    board.write_text(";LEADER: 12\nINCH\n" + text)
    with pytest.raises(InputError, match=r"nc_param\.txt says mm"):
        read_program(board)
    with pytest.raises(InputError, match="neither"):
        read_sidecar(board)
    with pytest.raises(InputError, match="the sidecar cannot be read: is a directory"):
        read_program(board, Hints(sidecar=tmp_path))


REPORT = """NCDrill File Report For: x.PcbDoc
ASCII Plated RoundHoles File : board.TXT
T1        0.2mm (7.874mil)         Round          2             7.79 mm (0.28 Inch)
T2        8mil (0.2032mm)          Slot           1   NPTH      0.96 mm (0.43 Inch)
T2        8mil (0.2032mm)          Round          1             0.96 mm (0.43 Inch)
"""


def test_holes_that_comments_or_a_report_state_are_counted(tmp_path):
    board = tmp_path / "board.TXT"
    text = "M48\n;FILE_FORMAT=4:4\nMETRIC,LZ\nT1C.2\nT2C.2\n%\nT1\nX1Y1\nX2Y2\nT2\nX1Y1G85X2Y2\n"
    board.write_text(text + "X3Y3\nM30\n")
    (tmp_path / "other.DRR").write_text(REPORT.replace("board", "other").replace("2   ", "9   "))
    assert read_program(board).notes == ()
    (tmp_path / "board.DRR").write_text(REPORT)
    assert read_program(board).notes == ()
    board.write_text(text + "M30\n")
    said = "T2: 2 holes are stated, 1 are drilled; is the file whole?"
    assert read_program(board).notes == (said,)
    comment = ";T01 Holesize 1. = 8.0 Tolerance = +3.0/-3.0 PLATED MILS Quantity = 3\n"
    assert read("X1Y1\nX2Y2\n", comment + "METRIC,TZ\nT01\n").notes[0].startswith("T1: 3 holes")


@pytest.mark.parametrize("text", ["", "24", "2:4:1", "a:b", "0:0", "12:4", "2:10"])
def test_number_formats_that_are_none(text):
    with pytest.raises(UsageError):
        parse_digits(text)


def test_tools_are_chosen_by_name_or_by_size():
    program = read("T1\nX1Y1\nT2\nX2Y2\nX3Y3\n")
    assert choose_tool(program, None) == 2
    assert choose_tool(program, "T1") == choose_tool(program, 1) == 1
    assert len(workpiece(program, choose_tool(program, "all"))) == 3
    with pytest.raises(InputError, match="expected one of T1, T2"):
        choose_tool(program, "T9")


# -- as a workpiece ------------------------------------------------------------------------


def test_files_read_knows_drill_files_by_suffix_or_by_look(tmp_path):
    text = HEAD + "T1\nX1Y1\nT2\nX2Y2\nX3Y3\nX0Y0G85X9Y9\nM30\n"
    for name in ("board.drl", "board.TXT", "board.exc", "board"):
        path = tmp_path / name
        path.write_text(text)
        reading = files.read(path)
        assert reading.workpiece.name.endswith("-T2") and len(reading.workpiece) == 2
        assert reading.travel == Travel(Model.SIMULTANEOUS)
        assert "T1" in reading.notes[-2] and "left out: 1 slot;" in reading.notes[-1]
    assert len(files.read(path, tool="all").workpiece) == 3
    (tmp_path / "holes.txt").write_text("1,2\n3,4\n")
    assert len(files.read(tmp_path / "holes.txt").workpiece) == 2
    with pytest.raises(UsageError, match="take no option 'tool'"):
        files.read(tmp_path / "holes.txt", tool="T1")
    for name in ("board", "holes.txt"):
        with pytest.raises(UsageError, match="expected mm or inch"):
            files.read(tmp_path / name, units="mil")


@pytest.mark.parametrize(
    "text", ["id,x,y\nT1,1,2\nT2,3,4\n", "T1;1,5;2\nT2;3;4\n", "T1 1 2\r\n", "# a\nT1\t1\t2\n"]
)
def test_a_table_whose_holes_are_called_like_tools_is_a_table(tmp_path, text):
    path = tmp_path / "holes.txt"
    path.write_bytes(text.encode())
    assert files.read(path).workpiece.ids[0] == "T1"
    path.write_bytes(b"T1\rX1.0Y2.0\rX2.0\rM30\r")
    assert len(files.read(path, units="mm").workpiece) == 2


@pytest.mark.parametrize("word", ["²", "9" * 5000])
def test_words_that_are_no_numbers_are_refused(tmp_path, word):
    path = tmp_path / "b.drl"
    path.write_text(HEAD + "T1\nX1.0Y1.0\nM30\n")
    with pytest.raises(InputError, match="has no holes for the tool"):
        files.read(path, tool=word)
    with pytest.raises(UsageError, match="is no number format"):
        files.read(path, format=f"{word}:4")
    assert len(files.read(path, tool="ALL").workpiece) == 1


# -- runs of hits, read at once --------------------------------------------------------------

RUNS = st.lists(
    st.tuples(
        st.sampled_from(["X{}", "Y{}", "X{}Y{}"]),
        st.sampled_from(["1", "-25", "000100", "1.5", "+.25", "-3.", "12345.123456789", "+7", "0"]),
        st.sampled_from(["2", "-0", "999999", "0.001", "+1.0"]),
    ),
    min_size=4,
    max_size=30,
)


@settings(max_examples=200, deadline=None)
@given(RUNS, st.sampled_from(["METRIC,TZ", "INCH,LZ", "METRIC", "METRIC,LZ,0000.00"]))
def test_hits_read_at_once_are_those_read_one_by_one(rows, unit):
    lines = [form.format(x, y) if form != "Y{}" else form.format(y) for form, x, y in rows]
    text = f"M48\n{unit}\nT1C.3\n%\nT1\nX000001Y000001\n" + "".join(f"{line}\n" for line in lines)
    results = []
    blanks = text.replace("Y", "  Y").replace("\n", " \n")
    for body in (text, blanks, text.replace("\n", "\n ")):  # a blank before a hit ends a run
        try:
            program = parse((body + "M30\n").encode(), "board.drl")
        except InputError as error:
            results.append(str(error))
            continue
        columns = (program.rows.x1, program.rows.y1, program.rows.mark)
        results.append(([c.tolist() for c in columns], program.step, program.style))
    assert results[0] == results[1] == results[2]


def test_a_bad_number_far_down_is_found_in_one_pass():
    good = "".join(f"X{i:06d}Y0\n" for i in range(30_000))
    with pytest.raises(InputError, match=r":30007: .12345678901. has more than the 6 digits"):
        read("T1\n" + good + "X12345678901Y0\n")
