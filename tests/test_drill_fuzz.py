"""What fuzzing the drill readers found, kept; and a short run of the same fuzzer."""

from __future__ import annotations

import random

import pytest

from tcp.errors import InputError, UsageError
from tcp.files import excellon, gcode
from tcp.files.excellon import Hints, Mark, guard, rewrite
from tcp.files.excellon.blocks import folded
from tcp.files.excellon.rewrite import Order, Turn

HEAD = b"M48\nINCH,TZ\nT1C.02\n%\nT1\n"

FOUND = {
    "point in a G-code": HEAD + b"G054.5256Y0.561G85X4.2697Y0.505\nM30\n",
    "point in an M-code": HEAD + b"X1Y1\nM48.\nM30\n",
    "axis twice in a slot": HEAD + b"X031G85X1Y1400Y080900\nM30\n",
    "axis twice in a repeat": HEAD + b"X1Y1\nR2X1X5\nM30\n",
    "axis twice in a copy": HEAD + b"M25\nX1Y1\nM01\nM02X1X5\nM08\nM30\n",
    "two points in a hole size": (
        b";T01 Holesize 1. = 40.0. Tolerance = +0.0/-0.0 PLATED MILS Quantity = 4\nT01\nX1Y1\nM30\n"
    ),
    "a path that begins nowhere": HEAD + b"X1Y1\nG00\nM15\nG01X5\nM16\nM30\n",
    "an axis without a number": HEAD + b"X1Y1\nX\nY5\nM30\n",
    "a format of too many digits": b"M48\n;FILE_FORMAT=8:4\nINCH\nT1C.02\n%\nT1\nX1Y1\nM30\n",
    "a command behind G90": HEAD + b"X1Y1\nG90M48\nX2Y2\nM30\n",
    "a damaged line that begins with a G-code": HEAD + b"X1Y1\nG00X1X*Y1i\nX2Y2\nM30\n",
    "an optional hole": HEAD + b"X1Y1\n/X2Y2\nM30\n",
    "a repeat inside a path": HEAD + b"X1Y1\nX2\nG02Y3\nR2Y2\nG01X5\nM16\nG05\nT00\nM30\n",
    "a slot without its first end": HEAD + b"X1Y0G85X2Y2\nG05G85X2Y5\nM30\n",
    "a pattern without its end before the next": (
        HEAD + b"M25\nX3Y4\nM25\nX3Y4\nM01\nM02X5M70\nM08\nX0Y5\nM30\n"
    ),
    "huge G-code": HEAD + b"G49999999999999999999\nX1Y1\nM30\n",
}


@pytest.mark.parametrize("name", FOUND)
def test_what_the_fuzzer_found_is_refused(name):
    with pytest.raises(InputError):
        excellon.parse(FOUND[name])


def test_a_hole_whose_line_ends_the_rout_mode_is_a_unit_of_its_own():
    text = HEAD + b"X1Y1\nG00X5Y5\nM15\nG01X6\nM16\nG05Y5X9\nX7Y7\nX8Y8\nM30\n"
    program = excellon.parse(text)
    assert rewrite.reorder(program, {}) == text
    assert program.rows.last[1] == program.rows.first[2] and program.rows.mark[2] & Mark.FIXED
    assert program.rows.stretch.tolist() == [0, 1, 2, 3, 3]


@pytest.mark.parametrize(
    "text",
    [
        HEAD + b"X1Y1\nG01\nM25\nX3.\nM01\nM02X1.5\nM08\nM30\n",
        HEAD + b"X1Y1\nM25\nM01\nM02X1.5\nM08\nX2Y2\nM30\n",
        HEAD + b"X1Y1\nM25\nX3.Y4.\nM01\nM02X1.5M70\nM08\nX0.Y0.\x1a",
        HEAD + b"X1Y1\nM25\nX3.Y4.\nM01\nM02X1.5M70\nM08\nX0.Y0.",
        HEAD + b"G91\nX1Y1\nX1\nG00X1Y1\nM15\nG90\nG01X9Y9\nM16\nG05\nX1Y1\nX2\nM30\n",
        HEAD + b"X1Y1\nX2\nG00X1\nM15\nG91\nG01X9Y9\nM16\nG05\nX1Y1\nX2\nM30\n",
        HEAD + b"M25\nX3Y4\nM01\nM02X1.5\nX3Y4\nX3\nM01\nM30\n",
        HEAD + b"M25\nX1Y2\nM01\nM02X1\nX1Y1\nM25\nX1Y1\nM01\nM02X1\nM08\nM30\n",
        HEAD + b"M25\nX1Y1\nM01\nM02X1Y1\nM08\nX1Y1\nG91\nX1Y1\nM30\n",
        HEAD + b"X3Y4G82X5Y4\nX9Y9\nX3Y4\nX7\nM30\n",
        HEAD + b"X1Y1\nT0\nG00X9Y9\nG05\nT1\nX5\nX1Y1\nM30\n",
        HEAD[:-3]
        + b"G00X1Y1\nG05\nT1\nM25\nX5\nM01\nM02X1\nM08\nM25\nX3Y3\nM01\nM02X1\nM08\nM30\n",
    ],
    ids=[
        "a path across a block",
        "an empty block",
        "ctrl-z behind a hole",
        "no last line end",
        "a path that ends in G90",
        "a path that ends in G91",
        "a block ended by a hit that the next hit leans on",
        "a block behind a hit that ends another",
        "a step behind a hit behind a block",
        "a hit that leans on the place where a canned cycle stands",
        "a hit that leans on a lone G00",
        "a block that leans on a lone G00",
    ],
)
def test_blocks_and_paths_that_the_fuzzer_made(text):
    program = excellon.parse(text, hints=Hints(unfinished=True))
    assert rewrite.reorder(program, {}) == text
    view = folded(program)
    orders = {a: Order.of(Turn(r) for r in range(b - 1, a - 1, -1)) for a, b in view.stretches()}
    other = rewrite.reorder(view, orders)
    guard.compare(program, excellon.parse(other, hints=Hints(unfinished=True)))


def test_a_comment_inside_a_word_keeps_the_section():
    program = gcode.parse(b"G21\nG81 X1 Y2 Z-1 R2\nX(a)5\nY7\nG80\nM30\n")
    assert "not understood" in program.notes[0]


def test_a_vertical_tab_inside_a_word_keeps_the_section():
    program = gcode.parse(b"G21\nG81 X1 Y2 Z-1 R2\nX5\nN3 Y\x0b7\nG80\nM30\n")
    assert "not understood" in program.notes[0]


def test_a_plunge_after_something_unknown_is_no_hole():
    text = b"G21\nG0 X1 Y1\n#1=2\nG1 Z-1\nG0 Z2\nG81 X1 Y1 Z-1 R1\nM30\n"
    assert len(gcode.parse(text).rows) == 1


SNIPPETS = [
    *(b"T1\n", b"T0\n", b"M25\n", b"M01\n", b"M02X10Y0\n", b"M02M80\n", b"M08\n", b"R3X5\n"),
    *(b"G85X1Y1", b"G00X1Y1\n", b"M15\n", b"M16\n", b"G01X5\n", b"G05\n", b"G91\n", b"G90\n"),
    *(b"M48\n", b"%\n", b"METRIC,TZ\n", b"X", b"Y", b"-", b"+", b".", b"9" * 30, b"\0", b"\r"),
    *(b";x\n", b"ICI,ON\n", b"M30\n", b"T1C0.5\n", b"G93X0Y0\n", b"G82", b"R", b"M00\n", b"\xff"),
    *(b"G81", b"Z1\n", b"(a)", b"#1=2\n", b"L2", b"T2 M6\n", b"G80\n", b"G0", b"G1", b"N5", b"G98"),
]
SEEDS = [
    HEAD + b"X1Y1\nX2\nY3\nR2X5\nX1Y1G85X2Y2\nG00X1Y1\nM15\nG01X5\nM16\nG05\nT00\nM30\n",
    b"M48\nMETRIC\nT1C.5\n%\nT1\nX1.5Y2.25\nM25\nX3.Y4.\nM01\nM02X1.5\nM08\nX0.Y0.\nM30\n",
    b"G21 G90\nT1 M6\nG99 G81 X1. Y2 Z-1 R2 F100\nX5\nN3 Y7\nG80\nG0 X1 Y1\nG1 Z-1\nG0 Z2\nM30\n",
]


@pytest.mark.parametrize("seed", range(4))
def test_mutated_files_are_refused_or_kept_whole(seed):
    """Any answer but one sentence or the same work is a bug."""
    rng, read = random.Random(seed), 0
    for _ in range(700):
        data = bytearray(rng.choice(SEEDS))
        for _ in range(rng.randrange(1, 5)):
            at, kind = rng.randrange(len(data) + 1), rng.random()
            if kind < 0.5:
                data[at:at] = rng.choice(SNIPPETS)
            elif kind < 0.75:
                del data[at : at + rng.randrange(1, 9)]
            else:
                data[at % len(data)] = rng.randrange(256)
        text = bytes(data)
        language = gcode if text.startswith(b"G21") else excellon
        try:
            program = language.parse(text, "f.drl", Hints(unfinished=rng.random() < 0.5))
        except InputError as refusal:
            assert "\n" not in str(refusal)
            continue
        orders, view = {}, folded(program)
        for a, b in view.stretches():
            turns = [Turn(row, bool(view.rows.mark[row] & Mark.FREE)) for row in range(a, b)]
            rng.shuffle(turns)
            orders[a] = Order.of(turns)
        writer, judge = (gcode, gcode) if language is gcode else (rewrite, guard)
        assert writer.reorder(program, {}) == text
        try:
            other = writer.reorder(view, orders)
        except UsageError:
            continue
        judge.compare(program, language.parse(other, "f.drl", Hints(unfinished=True)))
        read += 1
    assert read > 20
