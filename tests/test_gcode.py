"""G-code drilling programs: what is read, what may move, and what must not."""

from __future__ import annotations

import itertools
import os
import random
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import files
from tcp.boards.board import Wishes
from tcp.boards.effort import Effort
from tcp.boards.optimise import optimise
from tcp.cli.main import main
from tcp.errors import InputError
from tcp.files import read
from tcp.files.drilling import read_drilling
from tcp.files.excellon import Kind, oddities
from tcp.files.excellon.guard import LostError
from tcp.files.excellon.rewrite import Order, Turn
from tcp.files.excellon.settings import Hints
from tcp.files.gcode import compare, parse, read_program, reorder
from tcp.report.board import board_data, conclusions

FAST = Wishes(effort=Effort.FAST, time_limit=0.3)
CYCLES = """%
(a drilling program)
G21 G90 G17 G54
T1 M6
S2000 M3
N10 G99 G81 X1.0 Y2.0 Z-1.5 R2 F100 ; first
N20 X5
N30 Y7.5 (via)
N40 X-3. Y-4
G80
T2 M6
G98 G83 X0 Y0 Z-3 R2 Q0.5
X9 Y9
X1 Y1 Z-4
X2 Y2
G80
M5
M30
%
"""
PLUNGES = """G20
G90
G0 Z0.2
G0 X1 Y1
G1 Z-0.1 F10
G0 Z0.2
G0 X9
G1 Z-0.1
G0 Z0.2
G0 X4
G1 Z-0.1
G0 Z0.2
G0 X2 Y1
G1 Z-0.1
G1 Z-0.05
G0 Z0.2
G0 X3 Y1
G1 Z-0.1
G0 Z0.2
M2
"""


PCB2GCODE = """( pcb2gcode 2.5.0 )
( This file uses 2 drill bit sizes. )
G94       ( Millimeters per minute feed rate. )
G21       ( Units == Millimeters. )
G90       ( Absolute coordinates. )
G00 S20000     ( RPM spindle speed. )
G00 Z20.00000 ( Retract )
T1
M5      ( Spindle stop. )
G04 P1.00000
M6      ( Tool change. )
(MSG, Change tool bit to drill size 0.8mm)
M0      ( Temporary machine stop. )
M3      ( Spindle on clockwise. )
G04 P1.00000
G1 F100.00000
G81 R2.00000 Z-2.00000 X10.00000 Y10.00000
X90.00000 Y10.00000
X12.00000 Y10.00000
X88.00000 Y10.00000
X14.00000 Y10.00000
G00 Z20.000 ( All done -- retract )
T2
M5
M6
M0
M3
G0 X95.00000 Y5.00000
G1 F100.00000
G0 Z2.0
G1 Z-2.00000
G0 Z2.00000
G0 X5.00000 Y5.00000
G1 Z-2.00000
G0 Z2.00000
G0 X88.00000 Y5.00000
G1 Z-2.00000
G0 Z2.00000
M5      ( Spindle off. )
M9      ( Coolant off. )
M2      ( Program end. )
"""


def program_of(text: str, hints: Hints | None = None):
    return parse(text.encode(), "board.ngc", hints)


def holes(program):
    step = float(program.step)
    rows, hit = program.rows, program.rows.kind == Kind.HIT
    columns = (column[hit].tolist() for column in (rows.tool, rows.x1, rows.y1))
    return [(t, round(x * step, 6), round(y * step, 6)) for t, x, y in zip(*columns, strict=True)]


def test_cycles_are_read_with_all_that_is_modal():
    program = program_of(CYCLES)
    assert holes(program) == [
        (1, 1.0, 2.0),
        (1, 5.0, 2.0),
        (1, 5.0, 7.5),
        (1, -3.0, -4.0),
        (2, 0.0, 0.0),
        (2, 9.0, 9.0),
        (2, 1.0, 1.0),
        (2, 2.0, 2.0),
    ]
    assert program.rows.stretch.tolist() == [0, 0, 0, 0, 1, 1, 2, 2]
    assert program.notes == ()


def test_plunges_are_read_as_holes():
    program = program_of(PLUNGES)
    assert holes(program) == [(0, x, 25.4) for x in (25.4, 228.6, 101.6, 50.8, 76.2)]
    assert program.rows.stretch.tolist() == [0, 0, 0, 1, 2]


def test_only_places_change():
    program = program_of(CYCLES)
    data = reorder(program, {0: Order.of([Turn(3), Turn(0), Turn(2), Turn(1)])})
    assert b"N10 G99 G81 X-3. Y-4 Z-1.5 R2 F100 ; first\n" in data
    assert b"N20 X1.0 Y2.0\n" in data and b"N40 X5 Y2.0\n" in data and b"(via)" in data
    compare(program, parse(data, "board.ngc"))
    assert reorder(program, {}) == CYCLES.encode()


def test_a_later_line_that_leans_on_a_coordinate_is_spelled_out():
    text = "G21 G90\nG81 X1 Y1 Z-1 R1\nX2 Y5\nG80\nG0 X7\nM30\n"
    program = program_of(text)
    data = reorder(program, {0: Order.of([Turn(1), Turn(0)])})
    assert b"G0 X7 Y5\n" in data


@pytest.mark.parametrize(
    "line",
    [
        "G1 X5 Y5",
        "G2 X1 Y1 I3 J0",
        "O100 sub",
        "#2 = [1+2]",
        "G81 X1 Y1 L3",
        "G68 R45",
        "Q",
        "T.5",
        "T99999999",
    ],
)
def test_what_is_not_understood_keeps_its_section(line):
    text = CYCLES.replace("G80\nT2", f"{line}\nG80\nT2")
    program = program_of(text)
    assert "is not understood; the order of T1 is kept" in program.notes[0]
    assert program.rows.stretch.tolist()[:4] == [0, 1, 2, 3]
    board = optimise(program, FAST)
    assert holes(board.after)[:4] == holes(program)[:4]
    assert board.data.decode().splitlines()[:10] == text.splitlines()[:10]


INCREMENTAL = """G21 G90
T1 M6
G0 X0 Y0 Z10
G91
G98 G81 X1 Y1 Z-3 R-8 F100
X9
N40 X-5.5 Y.25 (a)
Y-1
G80
G0 X3 Y3
G1 Z-7
G0 Z7
G0 X-5
G1 Z-7
G0 Z3
G0 Z4
G0 X4 Y1
G1 Z-7
G0 Z7
G0 X-5
G1 Z-7
G0 Z7
G90 G0 X50
M2
"""


def test_incremental_programs_get_new_steps():
    program = program_of(INCREMENTAL)
    assert program.notes == () and holes(program)[:3] == [(1, 1, 1), (1, 10, 1), (1, 4.5, 1.25)]
    board = optimise(program, FAST)
    assert board.changed and sorted(holes(board.after)) == sorted(holes(program))
    lines = board.data.decode().splitlines()
    assert "N40 X" in lines[6] and lines[6].endswith("(a)")
    assert lines[-2] == "G90 G0 X50 Y4.25"
    assert not optimise(board.after, FAST).changed


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("G91\nG81 X1 Y1 Z-1 R1\nX1\n", "line 3: .* starts from a place"),
        ("G81 X1 Y1 Z-1 R1\nG91 X9\nX-8 Z-2\nX5\n", "line 4: .* changes the depth of a cycle"),
        ("G0 X1 Y1\nG91\nG0 X1 Z1\n", "line 4: .* is not understood"),
    ],
)
def test_incremental_moves_that_lean_keep_their_section(lines, said):
    text = f"G21\n{lines}G90\nG81 X5 Y5 Z-1 R1\nX1 Y1\nX3 Y3\nM30\n"
    program = program_of(text)
    board = optimise(program, FAST)
    assert not board.changed and re.search(said, program.notes[-1])


def test_a_hole_with_an_approach_of_its_own_is_one_hole():
    text = "G21 G90\nG0 Z20\nG0 X5 Y5\nG0 Z2\nG1 Z-2 F9\nG0 Z2\n"
    text += "".join(f"G0 X{x} Y5\nG1 Z-2\nG0 Z2\n" for x in (95, 7, 60))
    program = program_of(text + "M2\n")
    assert [x for _, x, _ in holes(program)] == [5, 95, 7, 60]
    assert program.rows.stretch.tolist() == [0, 0, 0, 0]
    full = "".join(f"G0 X{x} Y5\nG0 Z2\nG1 Z-2 F9\nG0 Z20\n" for x in (95, 7, 60))
    program = program_of("G21 G90\nG0 Z20\n" + full + "M2\n")
    assert program.rows.stretch.tolist() == [0, 0, 0]


def test_a_rapid_to_a_place_and_a_height_is_followed():
    program = program_of("G21 G90\nG0 X5 Y5 Z9\nG81 Y3 Z-1 R1\nX7\nM30\n")
    assert holes(program) == [(0, 5, 3), (0, 7, 3)]


def test_a_program_of_pcb2gcode_keeps_every_other_line():
    program = program_of(PCB2GCODE)
    assert len(program.rows) == 8 and program.notes == ()
    board = optimise(program, FAST)
    before, after = PCB2GCODE.splitlines(), board.data.decode().splitlines()
    assert board.proved and board.costs_after.total < board.costs_before.total
    changed = [i for i, pair in enumerate(zip(before, after, strict=True)) if pair[0] != pair[1]]
    assert changed and all(before[i].startswith(("X", "G81", "G0 X")) for i in changed)


@pytest.mark.parametrize("name", ["cycles", "plunges"])
def test_boards_are_optimised_and_stay_so(name):
    text = CYCLES if name == "cycles" else PLUNGES
    board = optimise(program_of(text), FAST)
    assert board.costs_after.total < board.costs_before.total
    assert sorted(holes(board.after)) == sorted(holes(board.before))
    again = optimise(board.after, FAST)
    assert not again.changed


BAD = {
    "empty": ("", "is empty"),
    "nul": ("G21\n\0\n", r":2: holds a NUL"),
    "no units": ("G90\nG81 X1 Y1 Z-1 R1\nM30\n", r":2: the program does not state its units"),
    "two units": ("G21\nG81 X1 Y1 Z-1 R1\nG20\nM30\n", r":3: states inch, but line 1 says mm"),
    "no end": ("G21\nG81 X1 Y1 Z-1 R1\n", r":2: ends without M2 or M30"),
    "no holes": ("G21\nG0 X1 Y1\nM30\n", "drills no hole"),
    "milling": ("G21\nG1 X1 Y1\nM30\n", r"line 2: 'G1 X1 Y1' is not understood"),
    "huge": ("G21\nG81 X99999999999 Y1 Z-1 R1\nM30\n", r":2: .*no coordinate"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_programs_get_one_sentence(name):
    text, said = BAD[name]
    with pytest.raises(InputError, match=said) as caught:
        program_of(text)
    assert "\n" not in str(caught.value)


MUTATIONS = {
    "drop": ("N20 X5\n", "N20\n"),
    "move": ("X9 Y9", "X9 Y8"),
    "swap": ("X9 Y9\nX1 Y1 Z-4", "X1 Y1\nX9 Y9 Z-4"),
    "depth": ("Z-1.5", "Z-1.6"),
    "feed": ("F100", "F90"),
    "cycle": ("G83", "G81"),
    "tool": ("T2 M6", "T3 M6"),
    "comment": ("(via)", "(pad)"),
    "units": ("G21", "G20"),
    "retract": ("G98 ", "G99 "),
}


@pytest.mark.parametrize("name", MUTATIONS)
def test_the_guard_catches(name):
    before, after = MUTATIONS[name]
    assert before in CYCLES
    with pytest.raises(LostError):
        compare(program_of(CYCLES), program_of(CYCLES.replace(before, after, 1)))


@st.composite
def programs(draw: st.DrawFn) -> str:
    """Programs of cycles and plunges, modal or not, numbered or not."""
    at = st.sampled_from(["0", "1", "-2.5", "3.25", ".5", "10."])
    lines = [draw(st.sampled_from(["G21 G90", "G20\nG90", "g21 g90 g17"])), "G0 Z5"]
    number = itertools.count(10, 10)
    for tool in range(1, draw(st.integers(1, 3)) + 1):
        lines += [f"T{tool} M6", f"G0 X{draw(at)} Y{draw(at)} Z5"]
        if draw(st.booleans()):
            lines.append(f"G81 X{draw(at)} Y{draw(at)} Z-1 R1 F{draw(st.integers(1, 2))}00")
            for _ in range(draw(st.integers(0, 6))):
                words = draw(st.sampled_from(["X{}", "Y{}", "X{} Y{}", "y{} x{}", "X{}Y{} Z-2"]))
                lines.append(words.format(draw(at), draw(at)))
            lines.append("G80")
        elif draw(st.booleans()):
            for _ in range(draw(st.integers(1, 5))):
                lines.append(f"G0 X{draw(at)} Y{draw(at)}")
                up = draw(
                    st.sampled_from(["G0 Z5", "G1 Z0\nG0 Z2", "G0 Z2\nG1 Z-2\nG0 Z5", "G0 Z-.5"])
                )
                lines += [f"G1 Z-{draw(st.integers(1, 2))} F50", up]
                if draw(st.integers(0, 9)) == 0:
                    lines.append(draw(st.sampled_from(["G0 X7 Y7", "G43 H1 Z9", "M8", "G0 Z9"])))
        else:
            lines.append(f"G91 G81 X{draw(at)} Z-1 R-4 F100")
            for _ in range(draw(st.integers(0, 6))):
                lines.append(
                    draw(st.sampled_from(["X{}", "Y{}", "X{} Y{}"])).format(draw(at), draw(at))
                )
            lines.append(draw(st.sampled_from(["G80 G90", "G90 G80"])))
    if draw(st.booleans()):
        lines = [f"N{next(number)} {line}" if line[0] not in "(%" else line for line in lines]
    end = draw(st.sampled_from(["\n", "\r\n"]))
    return end.join([*"\n".join(lines).splitlines(), "M30", ""])


@settings(max_examples=150, deadline=None)
@given(programs(), st.integers(0, 2**32))
def test_any_order_of_any_program_drills_the_same_holes(text, seed):
    program, rng = program_of(text), random.Random(seed)
    assert reorder(program, {}) == text.encode()
    orders = {}
    for a, b in program.stretches():
        turns = [Turn(row) for row in range(a, b)]
        rng.shuffle(turns)
        orders[a] = Order.of(turns)
    compare(program, parse(reorder(program, orders), "board.ngc"))


def test_programs_are_found_by_suffix_or_look(tmp_path):
    for name in ("a.ngc", "a.nc", "a.tap", "a.gcode"):
        (tmp_path / name).write_text(CYCLES)
        reading = files.read(tmp_path / name)
        assert len(reading.workpiece) == 4 and "T2" in reading.notes[-1] + "T2"
        assert len(read_drilling(tmp_path / name).rows) == 8
    (tmp_path / "a.drl").write_text(CYCLES)
    with pytest.raises(InputError, match="is a G-code program"):
        read_drilling(tmp_path / "a.drl")
    done = CliRunner().invoke(main, ["optimize", str(tmp_path / "a.ngc")])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "a-optimized.ngc").exists()
    for option in (["--expand"], ["--merge-tool-selections"], ["--tool-order", "optimise"]):
        done = CliRunner().invoke(main, ["optimize", *option, str(tmp_path / "a.nc")])
        assert done.exit_code == 2
    for flag, value in (("--format", "2:4"), ("--zeros", "lz"), ("--sidecar", "nosuch")):
        done = CliRunner().invoke(main, ["optimize", flag, value, str(tmp_path / "a.tap")])
        assert done.exit_code == 2 and f"takes no {flag}" in done.output


OPENINGS = {
    "overrides": "M48\nG21 G90\nT1 M6\nG81 X1 Y1 Z-1 R1 F100\nX9 Y9\nX2 Y2\nG80\nM30\n",
    "overrides below": "%\nN1 G21\nN2 M48\nG99 G82 X1 Y1 Z-1 R1 P.1 F100\nX9 Y9\nX2 Y2\nM30\n%\n",
    "several a line": "%\nG90 G54 G80 G21\nT1 M6\nG99 G82 X1 Y1 Z-1 R1 \nX9Y9\nX2Y2\nM30\n%\n",
    "cycle first": "%\nT1 M6\nG99 G83 G21 X1 Y1 Z-1 R1 Q.5 F100\nX9Y9\nX2Y2\nM30\n%\n",
}


@pytest.mark.parametrize("opening", OPENINGS)
def test_programs_are_known_by_their_words(tmp_path, opening):
    for name in ("a.ngc", "a.nc", "a.tap"):
        (tmp_path / name).write_text(OPENINGS[opening])
        assert len(read_drilling(tmp_path / name).rows) == 3
        assert len(files.read(tmp_path / name).workpiece) == 3


def test_a_header_makes_it_excellon(tmp_path):
    for header in ("M48\nMETRIC\nT1C1.0\n%\n", "M48 ; header\nMETRIC\nG90\nT1C1.0\nM95\n"):
        (tmp_path / "a.nc").write_text(f"{header}G90\nG05\nT1\nG81\nX1.0Y1.0\nM30\n")
        assert len(files.read(tmp_path / "a.nc").workpiece) == 1
        assert read_drilling(tmp_path / "a.nc").tools[1].diameter == 1


def drilled(program):
    """Tool and number of holes a section, as the program understands itself."""
    kinds, parts = program.rows.kind.tolist(), program.selections
    firsts = [s.first for s in parts] + [len(kinds)]
    counts = [kinds[a:b].count(Kind.HIT) for a, b in itertools.pairwise(firsts)]
    return [(s.tool, n) for s, n in zip(parts, counts, strict=True) if n]


FUSION = """%
(Drill1)
O1001
N10 G90 G94 G17 G91.1
N15 G21
N20 G53 G0 Z0.
N30 T1 M6
N35 S10000 M3
N40 G54
N45 M8
N50 G0 X20. Y5.
N55 G43 Z15. H1
N60 G0 Z5.
N65 G98 G81 X20. Y5. Z-1.8 R2. F100.
N70 X45.
N75 X6. Y7.
N80 X44. Y6.
N85 G80
N90 Z15.
N95 M9
N100 G91 G28 Z0.
N105 G90
N110 M30
%
"""


def test_programs_of_cam_systems_are_re_ordered():
    program = program_of(FUSION)
    assert program.notes == () and drilled(program) == [(1, 4)]
    board = optimise(program, FAST)
    lines = board.data.decode().splitlines()
    approach, first = (re.search(r"X(\S+) ?Y(\S+)", lines[i]).groups() for i in (10, 13))
    assert approach == first != ("20.", "5.")  # the rapid goes with the hole that it leads to
    assert board.proved and board.costs_after.total * board.rule.quantum == 39


FLATCAM = """G21
G90
G94
M5
G00 Z15.0000
T1
{change}(MSG, Change to Tool Dia = 0.8)
M0
M03 S10000
G00 X10.0000Y10.0000
G01 Z-1.7000 F150
G01 Z0
G00 Z2.0000
G00 X40.0000Y10.0000
G01 Z-0.7
G00 Z2
G01 Z-1.7000
G01 Z0
G00 Z2.0000
G00 X41.0000Y11.0000
G01 Z-1.7000
G01 Z0
G00 Z2.0000
G00 X11.0000Y11.0000
G01 Z-1.7000
G01 Z0
G00 Z2.0000
G00 X43.0000Y11.0000
G01 Z-1.7000
G01 Z0
G00 Z2.0000
M05
G00 Z15.00
G00 X0Y0
M02
"""


@pytest.mark.parametrize("change", ["M6\n", ""])
def test_holes_of_flatcam_are_all_counted_with_the_way_home(change):
    program = program_of(FLATCAM.format(change=change))
    assert program.notes == () and drilled(program) == [(1, 5)]
    board = optimise(program, FAST)
    worth = board.rule.quantum
    assert board.costs_before.total * worth == 30 + 1 + 30 + 32 + 43
    assert board.costs_after.total * worth == 30 + 1 + 2 + 32 + 11
    assert [x for _, x, _ in holes(board.after)][:2] == [10, 40]  # the one in two pecks stays


def test_a_rapid_to_nowhere_stays_and_its_travel_counts():
    rapids = "".join(f"G0 X{x} Y0\nG1 Z-1 F9\nG0 Z5\n" for x in (0, 100, 50, 1))
    text = f"G21 G90\nT1 M6\nG0 Z5\n{rapids}M2\n".replace("X50 Y0\nG1 Z-1 F9\n", "X50 Y90\n")
    program = program_of(text)
    assert drilled(program) == [(1, 3)]
    board = optimise(program, FAST)
    assert board.costs_before.total * board.rule.quantum == 100 + 90 + 90
    assert board.costs_after.total <= board.costs_before.total


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("G0 X1 Y1\nG1 Z-1 F9\nG0 X9 Y1\nG1 Z-1\nG0 Z5\n", "line 4: .*without coming back up"),
        ("G0 X1 Y1\nG1 Z-1 F9\nG0 Z5\nM0\nG1 Z-2\nG0 Z5\n", "line 8: .*no rapid has led"),
        ("G1 X1 Y1\nG1 Z-1 F9\nG0 Z5\n", "line 4: 'G1 X1 Y1' is not understood"),
    ],
)
def test_what_is_no_hole_keeps_its_section(lines, said):
    text = f"G21 G90\nT1 M6\nG0 Z5\n{lines}" + "".join(
        f"G0 X{x} Y0\nG1 Z-1 F9\nG0 Z5\n" for x in (0, 100, 2)
    )
    program = program_of(text + "M2\n")
    assert re.search(said, program.notes[0]) and not optimise(program, FAST).changed


def test_holes_in_two_pockets_stay_each_in_its_own():
    text = "G21 G90\nT1 M6\nG0 Z5\n"
    for x in (1, 31):
        text += f"G0 X{x} Y1\nG1 Z-3 F100\nG0 Z-1\n"
        text += f"G0 X{x + 4} Y1\nG1 Z-3\nG0 Z-1\nG0 X{x + 1} Y1\nG1 Z-3\nG0 Z5\n"
    program = program_of(text + "M2\n")
    assert program.rows.stretch.tolist() == [0, 0, 1, 2, 2, 3]


@pytest.mark.parametrize("line", ["N50 G0 X20. Y5.", "N65 G98 G81 X20. Y5."])
def test_the_guard_sees_a_rapid_that_was_left_behind(line):
    moved = FUSION.replace(line, line.replace("X20.", "X45.")).replace("N70 X45.", "N70 X20.")
    with pytest.raises(LostError):
        compare(program_of(FUSION), program_of(moved))


def test_modes_hold_on_lines_that_are_not_understood():
    text = "G21 G90\nT1 M6\nG28.1 G91\nT2 M6\nG0 X1 Y1\nG81 X5 Y1 Z-6 R-3\nX50\nX-8\nG90\nM2\n"
    with pytest.raises(InputError, match=r"G28.1 G91.* is not understood"):
        program_of(text)
    program = program_of(text.replace("G28.1 G91", "G28.1"))
    assert holes(program) == [(2, 5, 1), (2, 50, 1), (2, -8, 1)]


def test_steps_without_a_point_stay_without():
    text = "G21 G90\nT1 M6\nG0 X0 Y0 Z5\nG91 G99 G81 X1 Y1 Z-8 R-3 F100\nX8\nX-7{}\nX2\nG80\n"
    text += "G90\nM2\n"
    data = optimise(program_of(text.format("")), FAST).data
    assert b"\nX1Y0\nX2Y0\nX5Y0\n" in data
    data = optimise(program_of(text.format(".")), FAST).data
    assert b"\nX1Y0\nX2.Y0.\nX5Y0\n" in data


def interpreted(path: Path, program: str) -> list[tuple[str, ...]]:
    """Where LinuxCNC's interpreter goes down: the canonical feeds below the surface.

    It maps its tool table from a file in the home folder: two at once need two of them.
    """
    call, home = [program, "-g", str(path)], {**os.environ, "HOME": str(path.parent)}
    done = subprocess.run(call, capture_output=True, text=True, timeout=60, check=True, env=home)
    found = re.findall(r"STRAIGHT_FEED\(([-\d.]+), ([-\d.]+), (-[\d.]+)", done.stdout)
    return sorted(found)


@pytest.mark.parametrize(
    "text",
    [
        CYCLES,
        PLUNGES,
        INCREMENTAL,
        PCB2GCODE,
        FUSION.replace("N90 Z15", "N90 G0 Z15"),  # LinuxCNC forgets G0 after a cycle
        FLATCAM.format(change="M6\n"),
    ],
    ids=["cycles", "plunges", "incremental", "pcb2gcode", "fusion", "flatcam"],
)
def test_linuxcnc_accepts_the_output_and_drills_the_same_holes(text, tmp_path):
    program = shutil.which("rs274")
    if program is None:
        pytest.skip("rs274 is not installed (Debian: apt-get install linuxcnc-uspace)")
    board = optimise(program_of(text), FAST)
    before, after = tmp_path / "before.ngc", tmp_path / "after.ngc"
    before.write_text(text)
    after.write_bytes(board.data)
    assert board.changed
    feeds = interpreted(before, program)
    assert feeds and feeds == interpreted(after, program)


def test_alignment_holes_are_holes_and_not_the_rapids_before_them():
    rapids = "".join(f"G0 X{x} Y0\nG1 Z-1 F9\nG0 Z5\n" for x in (50, 99, 40, 30))
    program = program_of(f"G21 G90\nT1 M6\nG0 Z5\nG0 X0 Y0\n{rapids}M2\n")
    for first, after in ((0, [30, 40, 50, 99]), (1, [50, 40, 30, 99]), (2, [50, 99, 40, 30])):
        board = optimise(program, replace(FAST, keep_first=first))
        assert [x for _, x, _ in holes(board.after)] == after


def test_another_plane_holds_until_it_is_taken_back():
    drills = "G81 X1 Z1 Y-1 R2 F9\nX9\nX2\nG80\n"
    text = f"G21 G90 G18\nT1 M6\n{drills}T2 M6\n{drills}T3 M6\nG17\n{drills}T4 M6\n{drills}M2\n"
    program = program_of(text)
    said = "line 1: G18 drills in another plane; the order of T{} is kept"
    said += ", and its places are not all known"
    assert program.notes == (said.format(1), said.format(2), said.format(3))
    board = optimise(program, FAST)
    assert [part.before > part.after for part in board.parts] == [False, False, False, True]


def test_places_behind_a_line_that_is_not_understood_are_said_to_be_left_out():
    text = "G21 G90\nT1 M6\nG81 X1 Y1 Z-1 R2 F9\nX50\n{}\nX60\nX2\nG80\nM2\n"
    program = program_of(text.format("G92 X0"))
    assert drilled(program) == [(1, 2)]
    assert program.notes[0].endswith("of T1 is kept, and its places are not all known")
    program = program_of(text.format("M99\nG81 Y1 X60 Z-1 R2"))
    assert drilled(program) == [(1, 5)] and program.notes[0].endswith("of T1 is kept")


def test_a_rapid_to_nowhere_may_come_to_lead_to_a_hole():
    text = "G21 G90\nT1 M6\nG0 X9 Y0\nG81 X1 Y0 Z-1 R2 F9\nX5\nX9\nG80\nM2\n"
    program = program_of(text)
    assert program.rows.kind.tolist() == [Kind.PASS, *[Kind.HIT] * 3]
    for turns in itertools.permutations((1, 2, 3)):
        data = reorder(program, {1: [Turn(row) for row in turns]})
        compare(program, parse(data, "board.ngc"))
    board = optimise(program, FAST)
    assert [x for _, x, _ in holes(board.after)] == [9, 5, 1]
    with pytest.raises(LostError, match="rapid of line 3"):
        compare(program, program_of(text.replace("G0 X9 Y0", "G0 X8 Y0")))


HEAD = "G21 G90\nT1 M6\nG0 Z5\nG99 G81 X10 Y10 Z-3 R2 F100\n"


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("X50\nZ-6\nX20 Z-3\n", "line 6: 'Z-6' drills again where the tool stands"),
        ("X50\nR3\nX20\n", "line 6: 'R3' drills again"),
        ("X50 Y20 G4 P0.1\nX30\nX20\n", "line 5: 'X50 Y20 G4 P0.1' is not understood"),
        ("X50\nX20 K3\n", "line 6: 'X20 K3' is not understood"),
        ("X50\n/X20\n", "line 6: '/X20' is not understood"),
        ("X50\nM98 P100\nX20\n", "line 6: 'M98 P100' is not understood"),
        ("X50\nG93\nG65 P9 A1\nX20\n", "line 7: 'G65 P9 A1' is not understood"),
        ("X50\nG55\nX0\nX20\n", "line 7: 'X0' starts from a place"),
    ],
)
def test_nothing_is_claimed_of_holes_that_are_not_all_known(lines, said, tmp_path):
    path = tmp_path / "board.ngc"
    path.write_text(f"{HEAD}{lines}X40\nG80\nM30\n")
    program = read_program(path)
    assert said in program.notes[0] and "its places are not all known" in program.notes[0]
    board = optimise(program, FAST)
    part = board.parts[0]
    assert not board.changed and not board.proved and part.bound is None and not part.optimal
    assert "the file's own order is kept" in conclusions(board, None)[-1]
    with pytest.raises(InputError, match="not all holes of T1 are known: line"):
        read(path)


@pytest.mark.parametrize("code", ["G16", "G68 X0 Y0 R45", "G51 X0 Y0 P2", "G68.2 X0 Y0 Z0"])
def test_what_gives_places_another_meaning_holds_for_the_tools_behind_it(code):
    drills = "".join(f"T{t} M6\nG81 X1 Y1 Z-1 R2 F9\nX9\nX2\nG80\n" for t in (1, 2, 3))
    plain = {"G16": "G15", "G51 X0 Y0 P2": "G50"}.get(code, "G69")
    text = f"G21 G90\n{code}\n{drills}M2\n".replace("T3", f"{plain}\nT3")
    board = optimise(program_of(text), FAST)
    assert [part.optimal for part in board.parts] == [False, False, True]
    assert [part.before > part.after for part in board.parts] == [False, False, True]


def test_a_line_that_is_not_understood_is_proved_of_nothing_but_counted():
    board = optimise(program_of(HEAD + "X50\nX20\nG80\nG93\nM30\n"), FAST)
    assert not board.proved and board.parts[0].bound == board.parts[0].after
    assert board_data(board, None)["tools"][0]["understood"] is False


def test_a_tool_without_a_hole_that_is_understood_is_named():
    tail = "X50\nX20\nG80\nT2 M6\nG0 Z5\nG87 X10 Y10 Z-3 R2\nX50\nG80\nM30\n"
    program = program_of(HEAD + tail)
    assert len(program.notes) == 1 and "what it does is left out" in program.notes[0]
    board = optimise(program, FAST)
    assert [x for _, x, _ in holes(board.after)][-1] == 20  # G87's line may lean on it
    board = optimise(program_of(HEAD + tail.replace("G87", "G84")), FAST)
    assert [part.after < part.before for part in board.parts] == [True, False]


@pytest.mark.parametrize("way", ["G91 G28 Z0\nG28 X0 Y0\nG90", "G30", "G53 G0 X0 Y0", "#5=#5420"])
def test_holes_beside_a_way_of_unknown_length_stay(way):
    text = HEAD + f"X50\nX20\nX60\nG80\nT2 M6\n{way}\n"
    text += "T3 M6\nG81 X70 Y10 Z-3 R2\nX90\nX65\nM30\n"
    board = optimise(program_of(text), FAST)
    assert [x for _, x, _ in holes(board.after)][3:5] == [60, 70]
    assert board.parts[0].before > board.parts[0].after


def test_work_offsets_are_as_far_apart_as_the_machine_says(tmp_path):
    path = tmp_path / "board.ngc"
    one = "X10 Y10\nX50\nX20\nX30\n"
    path.write_text(f"G21 G90 G54\nT1 M6\nG99 G81 Z-3 R2 F9 {one}G55\n{one}G54\nG80\nM30\n")
    program = read_program(path)
    board = optimise(program, FAST)
    after = [x for _, x, _ in holes(board.after)]
    assert after[3:5] == [30, 10]
    assert board.parts[0].before > board.parts[0].after and not oddities(program)
    with pytest.raises(InputError, match="offsets G54, G55, whose distance is not known"):
        read(path)
