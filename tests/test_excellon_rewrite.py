"""Writing drill files in another order: nothing lost, and a guard that would notice."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp.boards.choose import permuted
from tcp.errors import InputError
from tcp.files.excellon import Mark, Program, guard, hints, parse, read_program, rewrite
from tcp.files.excellon.blocks import folded
from tcp.files.excellon.guard import LostError, compare, work
from tcp.files.excellon.program import Columns
from tcp.files.excellon.rewrite import Order, Turn, Writer, reorder


def shuffled(program: Program, rng: random.Random) -> dict[int, Order]:
    orders = {}
    for a, b in program.stretches():
        turns = [
            Turn(row, bool(program.rows.mark[row] & Mark.FREE) and rng.random() < 0.5)
            for row in range(a, b)
        ]
        rng.shuffle(turns)
        orders[a] = Order.of(turns)
    return orders


def test_every_board_survives_a_shuffle(corpus, unstated):
    """Any order of any board is the same work, and its text is the same around the holes."""
    rng, boards = random.Random(1), 0
    for path in sorted((corpus / "boards").iterdir()):
        known = hints(**unstated.get(path.name, {}))
        try:
            program = read_program(path, known)
        except InputError:
            continue
        data = path.read_bytes()
        assert reorder(program, {}) == data, path.name
        orders = shuffled(program, rng)
        other = parse(reorder(program, orders), path, known)
        compare(program, other)
        compare(other, program)
        model = permuted(program, orders)
        for column in ("x1", "y1", "x2", "y2", "tool", "kind"):
            assert np.array_equal(getattr(model.rows, column), getattr(other.rows, column))
        boards += 1
    assert boards >= 48


# -- documents in many dialects ------------------------------------------------------------

UNIT = st.sampled_from(
    [
        ("METRIC,TZ", "tz", 3, 6),
        ("METRIC,LZ", "lz", 3, 6),
        ("INCH,LZ", "lz", 4, 6),
        ("INCH,TZ", "tz", 4, 6),
        ("METRIC", "point", 3, 6),
        ("INCH", "point", 4, 6),
        ("METRIC,000.000", "full", 3, 6),
        ("METRIC,LZ,0000.00", "lz", 2, 6),
    ]
)


def written(value: int, style: str, places: int, width: int, plus: bool) -> str:
    sign = "-" if value < 0 else "+" if plus else ""
    digits = f"{abs(value):0{width}d}"
    if style == "lz":
        return sign + (digits.rstrip("0") or "0")
    if style == "tz":
        return sign + (digits.lstrip("0") or "0")
    if style == "full":
        return sign + digits
    return (
        f"{sign}{digits[:-places].lstrip('0')}.{digits[-places:].rstrip('0')}".replace(
            "-.", "-0."
        ).replace("+.", "+0.")
        if digits[-places:].rstrip("0") or digits[:-places].strip("0")
        else (sign + "0.")
    )


class Scribe:
    """Writes random drill files the way CAD tools do."""

    def __init__(self, draw: st.DrawFn):
        self.draw = draw
        self.unit, self.style, self.places, self.width = draw(UNIT)
        self.plus = draw(st.booleans())
        self.end = draw(st.sampled_from(["\n", "\r\n", "\r"]))
        self.modal = draw(st.booleans())
        self.incremental = draw(st.booleans()) and self.style != "lz"
        self.x = self.y = None
        self.lines: list[str] = []

    def number(self, value: int) -> str:
        return written(value, self.style, self.places, self.width, self.plus)

    def place(self) -> tuple[int, int]:
        at = st.integers(-40, 40).map(lambda v: v * 25)
        return self.draw(at), self.draw(at)

    def coordinates(self, x: int, y: int) -> str:
        if self.incremental:
            px, py = self.x or 0, self.y or 0
            text = f"X{self.number(x - px)}Y{self.number(y - py)}"
        else:
            text = ""
            if not (self.modal and x == self.x):
                text += f"X{self.number(x)}"
            if not (self.modal and y == self.y) or not text:
                text += f"Y{self.number(y)}"
        self.x, self.y = x, y
        return text

    def hit(self) -> None:
        comment = self.draw(st.sampled_from(["", "", "", " ; via"]))
        self.lines.append(self.coordinates(*self.place()) + comment)

    def repeat(self) -> None:
        self.hit()
        count, step = self.draw(st.integers(1, 4)), self.draw(st.integers(-9, 9)) * 25
        self.lines.append(f"R{count}X{self.number(step)}")
        self.x += count * step

    def slot(self) -> None:
        if self.incremental:
            return self.hit()
        first = self.coordinates(*self.place())
        self.lines.append(f"{first}G85{self.coordinates(*self.place())}")
        return self.lines.append("G05") if self.draw(st.booleans()) else None

    def path(self) -> None:
        if self.incremental:
            return self.hit()
        self.lines += [f"G00{self.coordinates(*self.place())}", "M15"]
        for _ in range(self.draw(st.integers(1, 2))):
            self.lines.append(f"G01{self.coordinates(*self.place())}")
        self.lines += ["M16", "G05"]
        return None

    def block(self) -> None:
        """A step-and-repeat block; behind it both coordinates are open."""
        if self.incremental:
            return self.hit()
        self.lines.append("M25")
        for _ in range(self.draw(st.integers(1, 3))):
            self.draw(st.sampled_from([self.hit, self.hit, self.repeat, self.slot, self.comment]))()
        self.hit()
        self.lines.append("M01")
        for _ in range(self.draw(st.integers(1, 3))):
            turn = self.draw(st.sampled_from(["", "M70", "M80", "M90", "M80M90"]))
            step = self.draw(st.integers(-9, 9)) * 25
            self.lines.append(f"M02X{self.number(step)}Y{self.number(step)}{turn}")
        self.x = self.y = None
        return self.lines.append("M08")

    def comment(self) -> None:
        self.lines.append(
            self.draw(st.sampled_from(["; note", "", "G90" * (not self.incremental)]))
        )

    def document(self) -> bytes:
        tools = self.draw(st.integers(1, 3))
        head = ["M48", "; made by a test", self.unit, "FMAT,2"]
        head += [f"T{t:02d}C0.{t}" for t in range(1, tools + 1)] + ["%"]
        head += ["G91"] if self.incremental else self.draw(st.sampled_from([[], ["G90"]]))
        act = st.sampled_from(["hit"] * 6 + ["repeat", "slot", "path", "comment", "block"])
        for tool in range(1, tools + 1):
            self.lines.append(f"T{tool:02d}")
            for name in ["hit", *self.draw(st.lists(act, min_size=0, max_size=12))]:
                getattr(self, name)()
        tail = self.draw(st.sampled_from([["M30"], ["T00", "M30", ""], ["M30", ""]]))
        return self.end.join(head + self.lines + tail).encode()


@st.composite
def documents(draw: st.DrawFn) -> bytes:
    return Scribe(draw).document()


@settings(max_examples=300, deadline=None)
@given(documents(), st.integers(0, 2**32))
def test_any_order_of_any_document_is_the_same_work(data, seed):
    program = parse(data, "made.drl")
    assert program.document.write() == data
    assert reorder(program, {}) == data
    view = folded(program)
    assert reorder(view, {}) == data and view.times().sum() == program.times().sum()
    moved = parse(reorder(view, shuffled(view, random.Random(seed))), "made.drl")
    compare(program, moved)
    other = parse(reorder(program, shuffled(program, random.Random(seed))), "made.drl")
    compare(program, other)
    compare(moved, other)
    again = parse(reorder(other, shuffled(other, random.Random(seed + 1))), "made.drl")
    compare(program, again)


@settings(max_examples=100, deadline=None)
@given(documents(), st.data())
def test_a_damaged_document_is_refused_or_read_losslessly(data, draw):
    at = draw.draw(st.integers(0, len(data) - 1))
    junk = draw.draw(st.binary(max_size=4))
    damaged = data[:at] + junk + data[at + draw.draw(st.integers(0, 5)) :]
    try:
        program = parse(damaged, "made.drl")
    except InputError as refusal:
        assert "\n" not in str(refusal)
        return
    assert reorder(program, {}) == damaged


# -- the guard -----------------------------------------------------------------------------

SAMPLE = (
    b"M48\nMETRIC,TZ\nT1C0.3\nT2C0.5\n%\nT1\nX100Y100\nX200\nY300\nX500Y500\nR3X100\n"
    b"X900Y900G85X950Y900\nG00X50Y60\nM15\nG01X70Y60\nM16\nG05\nT2\nX100Y100\n; end\nM30\n"
)


def spoiled(before: bytes, after: bytes, text: str = "same") -> None:
    assert before in SAMPLE
    compare(parse(SAMPLE), parse(SAMPLE.replace(before, after, 1)), text=text)


MUTATIONS = {
    "drop a hit": (b"X500Y500\nR3X100\n", b"X500Y500\n"),
    "drop a modal hit": (b"Y300\n", b""),
    "swap a modal coordinate": (b"X200\nY300\n", b"Y300\nX200\n"),
    "lose a repeat": (b"R3X100", b"R2X100"),
    "turn a repeat": (b"R3X100", b"R3Y100"),
    "move a hit": (b"X500Y500", b"X500Y501"),
    "hit twice": (b"X500Y500\nR3X100\n", b"X500Y500\nX500Y500\nR3X100\n"),
    "other tool": (b"T2\nX100Y100\n; end", b"T1\nX100Y100\n; end"),
    "slot becomes hit": (b"X900Y900G85X950Y900", b"X900Y900"),
    "slot shifted": (b"G85X950Y900", b"G85X950Y901"),
    "path shifted": (b"G01X70Y60", b"G01X70Y61"),
    "path lifted": (b"M15\n", b""),
    "diameter": (b"T1C0.3", b"T1C0.4"),
    "units": (b"METRIC,TZ", b"INCH,TZ"),
    "comment": (b"; end", b"; fin"),
    "comment lost": (b"; end\n", b""),
    "line ending": (b"X200\n", b"X200\r\n"),
}


@pytest.mark.parametrize("name", MUTATIONS)
def test_the_guard_catches(name):
    with pytest.raises(LostError):
        spoiled(*MUTATIONS[name])


BLOCKS = (
    b"M48\nMETRIC,TZ\nT1C0.3\n%\nT1\nX100Y100\n"
    b"M25\nX200Y300\n; in\nX500\nM01\nM02X50M70\nM02X60Y7\nM08\n"
    b"X900Y900\nG00X50Y60\nM15\nG01X70Y60\nX80Y90\nM16\nG05\nM30\n"
)
BLOCK_MUTATIONS = {
    "lose a copy": (b"M02X60Y7\n", b""),
    "shift a copy": (b"M02X60Y7", b"M02X61Y7"),
    "unturn a copy": (b"M02X50M70", b"M02X50"),
    "lose a hit inside": (b"X500\n", b""),
    "move a hit inside": (b"X500\n", b"X501\n"),
    "a hit leaves the block": (b"X500\nM01", b"M01"),
    "comment inside": (b"; in", b"; on"),
    "bend a path elsewhere": (b"X80Y90", b"X80Y91"),
    "turn a bent path": (b"X50Y60\nM15\nG01X70Y60\nX80Y90", b"X80Y90\nM15\nG01X70Y60\nX50Y60"),
}


@pytest.mark.parametrize("name", BLOCK_MUTATIONS)
def test_the_guard_catches_in_blocks_and_paths(name):
    before, after = BLOCK_MUTATIONS[name]
    assert BLOCKS.count(before) == 1
    with pytest.raises(LostError):
        compare(parse(BLOCKS), parse(BLOCKS.replace(before, after)))


def test_the_guard_lets_a_block_move():
    block = BLOCKS[BLOCKS.index(b"M25") : BLOCKS.index(b"X900")]
    moved = BLOCKS.replace(block, b"").replace(b"X900Y900\n", b"X900Y900\n" + block)
    compare(parse(BLOCKS), parse(moved))
    inside = moved.replace(b"X200Y300\n; in\nX500\n", b"X500Y300\n; in\nX200Y300\n")
    compare(parse(BLOCKS), parse(inside))


def test_the_guard_lets_pass_what_is_the_same_work():
    spoiled(b"X900Y900G85X950Y900", b"X950Y900G85X900Y900")
    spoiled(b"G00X50Y60\nM15\nG01X70Y60", b"G00X70Y60\nM15\nG01X50Y60")
    spoiled(b"X500Y500\nR3X100\n", b"X800Y500\nR3X-100\n")
    spoiled(b"X200\nY300\n", b"X200Y300\nX200Y100\n")
    spoiled(b"; end", b"; fin", text="free")


def test_comments_of_turned_repeats_stay():
    data = (
        b"M48\nMETRIC\nT1C1.\n%\nT1\nX5.Y1. ; at X5\nR4X-1.Y2.;pitch X1.0 Y-2 ; Y3\nX9.Y9.\nM30\n"
    )
    order = Order.of([Turn(1), Turn(0, True)])
    written = reorder(parse(data), {0: order})
    assert b"\nX1.Y9. ; at X5\nR4X1.Y-2.;pitch X1.0 Y-2 ; Y3\nM30\n" in written


class Broken(Writer):
    """A writer with a bug of choice."""

    bug = ""

    def _copied(self, order: Order, slots: np.ndarray) -> bool:
        return self.bug == "copied" or super()._copied(order, slots)

    def unit(self, turn: Turn) -> bytes:
        text = super().unit(turn)
        if self.bug == "drop" and turn.row == 2:
            return b""
        if self.bug == "modal" and turn.row == 2:
            return self.program.document.line(self.rows.first[turn.row])
        if self.bug == "swap" and b"Y300" in text:
            return text.replace(b"X200Y300", b"X300Y200")
        if self.bug == "repeat" and b"R3" in text:
            return text[: text.index(b"R3")]
        if self.bug == "negate" and b"R3" in text:
            return text.replace(b"R3X-100", b"R3X100")
        return text


@pytest.mark.parametrize("bug", ["drop", "modal", "swap", "repeat", "negate", "copied"])
def test_the_guard_catches_a_broken_writer(bug):
    program = parse(SAMPLE)
    order = Order.of([Turn(3, True), Turn(2), Turn(4, True), Turn(0), Turn(1)])
    plan = rewrite.plan(program, {0: order}, 0, len(program.document))
    good = parse(Writer(program).write(plan))
    compare(program, good)
    writer = Broken(program)
    writer.bug = bug
    plan = rewrite.plan(program, {0: order}, 0, len(program.document))
    with pytest.raises((LostError, InputError)):
        compare(program, parse(writer.write(plan)))


def test_the_guard_counts_repeats_and_copies():
    pattern = b"M48\nMETRIC,TZ\nT1C1.\n%\nT1\nM25\nX1Y1\nM01\nM02X5\nM02Y5M80\nM08\nM30\n"
    flat = b"M48\nMETRIC,TZ\nT1C1.\n%\nT1\nX1Y1\nX6Y1\nX4Y6\nM30\n"
    compare(parse(pattern), parse(flat), text="free")
    with pytest.raises(LostError, match="lost hit of T1"):
        compare(parse(pattern), parse(flat.replace(b"X4Y6", b"X4Y5")), text="free")


def test_work_compares_files_of_different_resolution():
    fine = parse(b"M48\nMETRIC\nT1C1.\n%\nT1\nX1.000Y2.5\nM30\n")
    coarse = parse(b"M48\nMETRIC,TZ,0000.00\nT1C1.\n%\nT1\nX100Y250\nM30\n")
    assert np.array_equal(work(fine), work(coarse))
    assert isinstance(fine.rows, Columns) and replace(fine).rows is fine.rows
    assert guard.paths(fine) == guard.paths(coarse)
