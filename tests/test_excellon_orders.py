"""Every order of small documents: whatever the writer carries from unit to unit is right.

Coordinates are few, so that units often end where others begin: a writer that
mistakes one place for another writes a coordinate too few.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator

from hypothesis import given, settings
from hypothesis import strategies as st

from tcp.errors import InputError, UsageError
from tcp.files.excellon import Hints, Mark, Program, edit, parse
from tcp.files.excellon.blocks import folded
from tcp.files.excellon.guard import compare
from tcp.files.excellon.rewrite import Order, Turn, reorder

MOST = 60
"""Orders tried of one document; all of them where there are not more."""

FORGIVING = Hints(unfinished=True)
HEAD = "METRIC\nT1C.5\nT2C.5\n%\n"

digit = st.sampled_from("123")
place = st.one_of(
    st.builds("X{}.Y{}.".format, digit, digit),
    st.builds("X{}.".format, digit),
    st.builds("Y{}.".format, digit),
)
hit = place
repeat = st.builds("{}\nR2X{}.".format, place, digit)
slot = st.builds("{}G85{}".format, place, place)
canned = st.builds("{}G82{}".format, place, place)
lone = st.builds("G00{}\nG05".format, place)
path = st.builds("G00{}\nM15\nG01{}\nM16{}".format, place, place, st.sampled_from(["\nG05", ""]))
work = st.one_of(hit, hit, hit, repeat, slot, canned, lone, path)
mode = st.sampled_from(["G90", "G91", "G05", "T1", "T2", "T0", "G93X0Y0", "; note", "M00"])
block = st.builds(
    "M25\n{}\nM01\n{}\n{}".format,
    st.lists(work, min_size=1, max_size=2).map("\n".join),
    st.lists(
        st.builds("M02{}{}".format, place, st.sampled_from(["", "M70", "M80M90"])),
        min_size=1,
        max_size=2,
    ).map("\n".join),
    st.sampled_from(["M08", "M08", "; open"]),
)
documents = st.lists(
    st.one_of(hit, hit, work, work, block, block, mode), min_size=2, max_size=8
).map(lambda lines: (HEAD + "T1\n" + "\n".join(lines) + "\nM30\n").encode())
unopened = st.builds(
    lambda first, data: data.replace(b"T1\n", first.encode() + b"T1\n", 1),
    st.sampled_from(["", "", "G91\n", "G00X1.Y2.\n", "G00X1.Y2.\nG05\n"]),
    documents,
)


def every_order(program: Program) -> Iterator[dict[int, Order]]:
    """All orders of the stretches, turned or not; so many of them where there are more."""
    rng = random.Random(0)
    choices = []
    for a, b in program.stretches():
        free = [bool(mark & Mark.FREE) for mark in program.rows.mark[a:b].tolist()]
        found: Iterator[list[Turn]] = (
            [Turn(a + i, turned) for i, turned in zip(order, ways, strict=True)]
            for order in itertools.permutations(range(b - a))
            for ways in itertools.product(*([False, True] if free[i] else [False] for i in order))
        )
        some = list(itertools.islice(found, 400))
        rng.shuffle(some)
        choices.append((a, [Order.of(turns) for turns in some]))
    count = 1
    for _, some in choices:
        count *= len(some)
    if count <= MOST:
        for picked in itertools.product(*(some for _, some in choices)):
            yield {a: order for (a, _), order in zip(choices, picked, strict=True)}
        return
    for _ in range(MOST):
        yield {a: rng.choice(some) for a, some in choices}


def check_every_order(data: bytes) -> int:
    """Write every order of a document, as it is and with its blocks folded; how many there were."""
    try:
        program = parse(data, "made.drl", FORGIVING)
    except InputError:
        return 0
    assert reorder(program, {}) == data
    tried = 0
    for view in {id(view): view for view in (program, folded(program))}.values():
        assert reorder(view, {}) == data
        for orders in every_order(view):
            compare(program, parse(reorder(view, orders), "made.drl", FORGIVING))
            tried += 1
    return tried


@settings(max_examples=250, deadline=None)
@given(unopened)
def test_every_order_of_a_small_document_is_the_same_work(data):
    check_every_order(data)


@settings(max_examples=250, deadline=None)
@given(unopened)
def test_sections_moved_merged_or_written_out_are_the_same_work(data):
    try:
        program = parse(data, "made.drl", FORGIVING)
    except InputError:
        return
    written, _ = edit.expand(program)
    compare(program, parse(written, "made.drl", FORGIVING), text="free")
    try:
        number = len(edit.sections(program))
    except UsageError:
        return
    for order in itertools.islice(itertools.permutations(range(number)), 24):
        moved = parse(edit.move_sections(program, order), "made.drl", FORGIVING)
        compare(program, moved, text="moved")
    merged = parse(edit.merge_selections(program), "made.drl", FORGIVING)
    compare(program, merged, text="free")
