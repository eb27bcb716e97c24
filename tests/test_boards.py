"""tcp optimize: shorter, never longer, nothing lost, and proved against brute force."""

from __future__ import annotations

import importlib.util
import itertools
import json
import os
import random
import re
import signal
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tcp.boards import chain
from tcp.boards.board import Wishes
from tcp.boards.bound import nearest
from tcp.boards.chain import Candidate, ToolOrder, any_order, in_order, linker
from tcp.boards.effort import Effort, as_it_stands
from tcp.boards.machine import Machine, read_machine
from tcp.boards.optimise import optimise
from tcp.boards.steady import by_place
from tcp.boards.stretch import anchored, free_runs
from tcp.boards.trail import Costs, follow, measure, rule_for
from tcp.cli.main import main
from tcp.errors import InputError, UsageError
from tcp.files import gcode
from tcp.files.excellon import hints, parse, read_program
from tcp.files.excellon.edit import expand
from tcp.files.excellon.guard import LostError, compare
from tcp.report.board import audit
from tcp.result import Status
from tcp.solve import solve
from tcp.travel import Model, Travel

ROOT = Path(__file__).resolve().parents[1]
HEAD = b"M48\nMETRIC,TZ\nT1C.001\nT2C.002\nT3C.003\n%\n"
FAST = Wishes(effort=Effort.FAST, time_limit=0.3)


def program_of(body: str):
    return parse(HEAD + body.encode() + b"M30\n", "board.drl")


def length(places: list[tuple[int, int]]) -> int:
    """Simultaneous travel along places, from the definition."""
    return sum(max(abs(p[0] - q[0]), abs(p[1] - q[1])) for p, q in itertools.pairwise(places))


def shortest(units: list[list[tuple[int, int]]]) -> int:
    """Shortest path over units with two ends, by trying everything."""
    best = None
    for order in itertools.permutations(units):
        for turned in itertools.product([1, -1], repeat=len(units)):
            places = [p for unit, t in zip(order, turned, strict=True) for p in unit[::t]]
            cost = length(places)
            best = cost if best is None else min(best, cost)
    return best or 0


def test_travel_of_a_file_is_that_of_its_positions():
    program = program_of(
        "T1\nX0Y0\nX10Y0\nR2X5\nX40Y3G85X50Y3\nG00X60Y0\nM15\nG01X60Y9\nX70Y9\nM16\nG05\nT2\nX0Y0\n"
    )
    costs = measure(program, rule_for(program, Travel(Model.SIMULTANEOUS)))
    places = [(0, 0), (10, 0), (15, 0), (20, 0), (40, 3), (50, 3), (60, 0), (60, 9), (70, 9)]
    assert costs.parts == (length(places), 0)
    assert costs.links == 70
    stops = measure(
        program,
        rule_for(program, Travel(Model.SIMULTANEOUS)),
        (Fraction(-1, 10), Fraction(0)),
        (Fraction(0), Fraction(1, 5)),
    )
    assert stops.links == 70 + 100 + 200


def test_copies_of_a_pattern_are_followed():
    program = program_of("T1\nM25\nX0Y0\nX10Y0\nM01\nM02X100\nM02X0Y5M80\nM08\nX0Y0\n")
    trail = follow(program)
    assert trail.x.tolist() == [0, 10, 100, 110, 100, 90, 0]
    assert trail.y.tolist() == [0, 0, 0, 0, 5, 5, 0]


UNITS = st.lists(
    st.lists(st.tuples(st.integers(0, 30), st.integers(0, 30)), min_size=1, max_size=2),
    min_size=1,
    max_size=5,
)


def cheapest(tools: list[list[list[tuple[int, int]]]], ends: list[tuple[int, int]]) -> int:
    """Shortest way through all tools in order, links and all, by trying everything."""
    ways = []
    for units in tools:
        ways.append([])
        for order in itertools.permutations(units):
            for turned in itertools.product([1, -1], repeat=len(units)):
                ways[-1].append([p for u, t in zip(order, turned, strict=True) for p in u[::t]])
    return min(length([*ends, *itertools.chain(*way), *ends]) for way in itertools.product(*ways))


def text_of(units: list[list[tuple[int, int]]]) -> str:
    lines = (
        "".join(["X{}Y{}".format(*u[0]), *("G85X{}Y{}".format(*q) for q in u[1:])]) for u in units
    )
    return "\n".join([*lines, ""])


FEW_UNITS = st.lists(
    st.lists(st.tuples(st.integers(0, 30), st.integers(0, 30)), min_size=1, max_size=2),
    min_size=1,
    max_size=3,
)


@settings(max_examples=40, deadline=None)
@given(st.lists(FEW_UNITS, min_size=2, max_size=3), st.booleans(), st.booleans())
def test_paths_and_links_together_equal_brute_force(tools, stops, free):
    """Not each path at its shortest, but the whole file; and the bound says so."""
    body = "".join(f"T{t}\n{text_of(units)}" for t, units in enumerate(tools, 1))
    point, ends = ((Fraction(0), Fraction(0)), [(0, 0)]) if stops else (None, [])
    order = ToolOrder.OPTIMISE if free else ToolOrder.KEEP
    wishes = replace(FAST, start=point, park=point, tool_order=order)
    board = optimise(program_of(body), wishes)
    orders = itertools.permutations(tools) if free else [tools]
    assert board.costs_after.total == min(cheapest(list(one), ends) for one in orders)
    assert board.bound == board.costs_after.total and board.ends_gain >= 0
    for part, units in zip(board.parts, tools, strict=True):
        assert part.proved and part.bound == shortest(units) <= part.after
        assert part.saves >= part.after - part.bound and (part.saves > 0) >= (not part.optimal)
    again = optimise(board.after, wishes)
    assert not again.changed and again.data == board.data


def test_larger_tools_end_where_the_next_one_begins():
    """Two neighbouring grids of 24 holes: their shortest paths end anywhere."""
    rng = np.random.default_rng(8)
    body = "".join(
        f"T{t}\n"
        + "".join(f"X{x + 900 * t}Y{y}\n" for x, y in rng.integers(0, 900, (24, 2)).tolist())
        for t in (1, 2, 3)
    )
    normal = Wishes(time_limit=10)
    for wishes in (FAST, normal):
        board = optimise(program_of(body), wishes)
        assert board.bound < board.costs_after.total and board.ends_gain > 0
        plain = sum(s.answer.cost for p in board.parts for s in p.solved)
        longer = sum(part.after for part in board.parts) - plain
        assert longer > 0 and sum(part.saves for part in board.parts) >= longer
        assert all(part.proved for part in board.parts) or wishes is FAST
        again = optimise(board.after, wishes)
        assert again.costs_after.total <= board.costs_after.total
    assert board.costs_after.total - board.bound <= board.costs_after.links


@settings(max_examples=25, deadline=None)
@given(UNITS, UNITS, st.sampled_from(["keep", "ends"]))
def test_small_boards_are_proved_and_equal_brute_force(first, second, stops):
    def lines(units):
        return "".join(
            "X{}Y{}".format(*u[0]) + ("G85X{}Y{}".format(*u[1]) if len(u) > 1 else "") + "\n"
            for u in units
        )

    program = program_of("T1\n" + lines(first) + "T2\n" + lines(second))
    point = (Fraction(0), Fraction(0)) if stops == "ends" else None
    board = optimise(program, Wishes(effort=Effort.FAST, time_limit=5, start=point, park=point))
    assert board.proved
    assert board.costs_after.total <= board.costs_before.total
    for part, units in zip(board.parts, (first, second), strict=True):
        assert part.bound == shortest(units) <= min(part.after, part.before)
    total = board.costs_after.total
    assert board.bound <= total
    again = optimise(board.after, Wishes(effort=Effort.FAST, start=point, park=point))
    assert again.data == board.data and not again.changed


def test_a_stretch_is_the_same_problem_in_any_order():
    """Slots may come turned round as well; holes share places with their ends."""
    rng = np.random.default_rng(3)
    units = [rng.integers(0, 4, (k, 2)).tolist() for k in (1, 2) for _ in range(15)]
    found = set()
    for _ in range(5):
        order = [units[i][:: int(rng.choice([-1, 1]))] for i in rng.permutation(len(units))]
        program = program_of("T1\n" + text_of(order))
        (run,) = free_runs(program, frozenset(), 0)
        instance = anchored(program, run, [run], {}).instance(Travel(Model.SIMULTANEOUS))
        renumbered, old = by_place(instance)
        route = tuple(range(len(old)))
        assert renumbered.cost(route) == instance.cost([int(v) for v in old])
        found.add(renumbered.sha256)
    assert len(found) == 1


HOLES = st.lists(
    st.tuples(st.integers(0, 60), st.integers(0, 60)), min_size=17, max_size=40, unique=True
)


@settings(max_examples=15, deadline=None)
@given(HOLES, HOLES, st.randoms(use_true_random=False))
def test_optimising_twice_gives_the_same_file_and_any_order_one_length(first, second, random):
    """Larger than what is solved exactly: the search counts, and sees places, not the order."""

    def file(*tools):
        lines = ("".join(f"X{x}Y{y}\n" for x, y in holes) for holes in tools)
        return program_of("".join(f"T{t}\n{text}" for t, text in enumerate(lines, 1)))

    fast = Wishes(effort=Effort.FAST)
    once = optimise(file(first, second), fast)
    again = optimise(once.after, fast)
    assert not again.changed and again.data == once.data
    shuffled = [random.sample(holes, len(holes)) for holes in (first, second)]
    other = optimise(file(*shuffled), fast)
    for part, same in zip(once.parts, other.parts, strict=True):
        assert part.solved[0].answer.cost in (same.solved[0].answer.cost, part.before)


def test_reversed_input_gives_an_equally_long_output():
    rng = np.random.default_rng(5)
    holes = [f"X{x}Y{y}\n" for x, y in rng.integers(0, 999, (11, 2))]
    lengths = {
        optimise(program_of("T1\n" + "".join(order)), FAST).costs_after.total
        for order in (holes, holes[::-1], sorted(holes))
    }
    assert len(lengths) == 1


def test_fixed_work_stays_and_ties_the_paths_around_it():
    body = "T1\nX0Y0\nX900Y0\nX100Y0\nG00X500Y0\nM15\nG01X500Y9\nX510Y9\nM16\nG05\nX800Y0\nX520Y9\n"
    board = optimise(program_of(body), FAST)
    assert board.proved
    text = board.data.decode()
    assert text.index("G00X500Y0") > text.index("X900Y0") > text.index("X0Y0\n")
    assert text.index("X520Y9") < text.index("X800Y0")
    assert text.count("\n") == (HEAD.decode() + body + "M30\n").count("\n")


def test_locks():
    body = "T1\nX0Y0\nX900Y0\nX100Y0\nX800Y0\nX200Y0\nT2\nX0Y0\nX9Y9\nX5Y5\n"
    board = optimise(program_of(body), Wishes(effort=Effort.FAST, keep=frozenset({1})))
    assert b"X0Y0\nX900Y0\nX100Y0\nX800Y0\nX200Y0\n" in board.data and board.parts[0].locked
    assert b"X0Y0\nX9Y9\nX5Y5\n" not in board.data
    board = optimise(program_of(body), Wishes(effort=Effort.FAST, keep_first=2))
    assert b"X0Y0\nX900Y0\nX800Y0\n" in board.data
    with pytest.raises(UsageError, match="no tool T9 to keep"):
        optimise(program_of(body), Wishes(keep=frozenset({9})))


BLOCK = "M25\nX0Y0\nX900Y0\nX100Y0\nM01\nM02X2000\nM02X0Y9M80\nM08\n"


def test_blocks_are_ordered_inside_and_move_as_units():
    board = optimise(program_of("T1\nX2000Y0\n" + BLOCK + "X0Y50\nX3000Y50\n"), FAST)
    inside = board.data[board.data.index(b"M25") : board.data.index(b"M08")]
    assert inside in (
        b"M25\nX0Y0\nX100Y0\nX900Y0\nM01\nM02X2000\nM02X0Y9M80\n",
        b"M25\nX900Y0\nX100Y0\nX0Y0\nM01\nM02X2000\nM02X0Y9M80\n",
    )
    assert board.data.index(b"X0Y50") < board.data.index(b"M25")
    assert board.data.index(b"X2000Y0\nX3000Y50") > board.data.index(b"M08")
    assert board.costs_after.total < board.costs_before.total
    assert board.parts[0].bound <= board.parts[0].after
    assert board.after.hits == board.before.hits == 12
    assert not optimise(board.after, FAST).changed


@pytest.mark.parametrize(
    "body",
    [
        f"T1\n{BLOCK.replace('M01', 'M47,stop' + chr(10) + 'M01')}X0Y50\nX3000Y50\n",
        f"T1\n{BLOCK.removesuffix('M08' + chr(10))}{BLOCK}X0Y50\nX3000Y50\n",
        f"T1\nM47,a\n{BLOCK}M47,b\nX3000Y50\n",
    ],
    ids=["a message inside", "no M08", "messages around"],
)
def test_blocks_that_lean_on_their_place_stay(body):
    board = optimise(program_of(body), FAST)
    texts = [p.document.data for p in (board.before, board.after)]
    assert len({t[: t.index(b"M25")] for t in texts}) == 1
    assert len({t[t.index(b"M02X0Y9M80") :].split(b"\n")[1] for t in texts}) == 1


def test_bent_paths_move_in_their_direction():
    def path(*places: tuple[int, int]) -> str:
        (x, y), *rest = places
        moves = "".join(f"G01X{a}Y{b}\n" for a, b in rest)
        return f"G00X{x}Y{y}\nM15\n{moves}M16\nG05\n"

    ways = [
        [(0, 0), (5, 9), (90, 0)],
        [(300, 0), (305, 9), (210, 0)],
        [(100, 0), (150, 9), (200, 0)],
    ]
    board = optimise(program_of("T1\n" + "".join(path(*way) for way in ways)), FAST)
    assert board.proved and board.changed
    best = min(length([p for way in order for p in way]) for order in itertools.permutations(ways))
    assert board.costs_after.total == best
    assert not optimise(board.after, FAST).changed


DIRECTED = st.lists(
    st.tuples(
        st.booleans(), st.lists(st.tuples(*[st.integers(0, 30)] * 2), min_size=3, max_size=3)
    ),
    min_size=2,
    max_size=5,
)


@settings(max_examples=25, deadline=None)
@given(DIRECTED)
def test_directed_units_never_make_a_board_longer_or_a_bound_false(units):
    body = "T1\n"
    for bent, ((x, y), (a, b), (c, d)) in units:
        bend = f"G01X{a}Y{b}\n" if bent else ""
        body += f"G00X{x}Y{y}\nM15\n{bend}G01X{c}Y{d}\nM16\nG05\n"
    board = optimise(program_of(body), FAST)
    best = min(
        length([p for places in picks for p in places])
        for order in itertools.permutations(units)
        for picks in itertools.product(
            *([way] if bent else [way[::2], way[::-2]] for bent, way in order)
        )
    )
    assert board.parts[0].bound <= best <= board.costs_after.total <= board.costs_before.total
    assert not board.proved or board.costs_after.total == best


def test_nothing_better_keeps_the_file():
    program = program_of("T1\nX0Y0\nX10Y0\nX20Y0\nT2\nX30Y0\nX40Y0\n")
    board = optimise(program, FAST)
    assert not board.changed and board.proved and board.data == program.document.data


def test_every_small_board_of_the_corpus(corpus, unstated):
    """Quick effort: never longer, same work, and the text around the holes is untouched."""
    for name in (
        "kicad-x2-Flashpads-PTH.drl",
        "diptrace-panel.drl",
        "siemens2-ThruHoleNonPlated.ncd",
    ):
        known = hints(**unstated.get(name, {}))
        program = read_program(corpus / "boards" / name, known)
        board = optimise(program, Wishes(effort=Effort.FAST, time_limit=0.3), known)
        assert board.costs_after.total < board.costs_before.total
        compare(program, board.after)


TOOLS = "T1\nX0Y0\nX10Y0\n; far\nT2\nX900Y0\nX890Y0\nT3\nX20Y0\nX30Y0\nT0\n"


def test_tools_change_places_when_asked():
    program = program_of(TOOLS)
    kept = optimise(program, FAST)
    best = optimise(program, replace(FAST, tool_order=ToolOrder.OPTIMISE))
    assert kept.costs_after.links == 880 + 870 and kept.order_gain == 0
    assert best.order_gain == kept.costs_after.total - best.costs_after.total == 880
    assert best.bound <= best.costs_after.total == 900
    text = best.data.decode()
    assert text.startswith(HEAD.decode()) and text.endswith("M30\n")
    assert sorted(text.splitlines()) == sorted(program.document.data.decode().splitlines())
    assert text.index("; far") == text.index("T2\n") - len("; far\n")
    by_size = optimise(best.after, replace(FAST, tool_order=ToolOrder.ASCENDING))
    assert [s.tool for s in by_size.after.selections] == [1, 2, 3]
    assert [p.tool for p in best.parts] == [1, 2, 3]


def test_many_tools_change_places_too():
    head = "M48\nMETRIC,TZ\n" + "".join(f"T{t}C.001\n" for t in range(1, 17)) + "%\n"
    places = np.random.default_rng(2).permutation(16) * 100
    body = "".join(f"T{t + 1}\nX{x}Y0\nX{x + 50}Y0\n" for t, x in enumerate(places.tolist()))
    program = parse((head + body + "M30\n").encode(), "board.drl")
    board = optimise(program, replace(FAST, tool_order=ToolOrder.OPTIMISE))
    assert board.costs_after.total == 1550 and board.bound == 1550


def test_the_order_of_very_many_tools_is_proved_and_does_not_wait_for_a_limit(monkeypatch):
    found = []
    monkeypatch.setattr(chain, "LINK_TIME", 60.0)
    monkeypatch.setattr(chain, "solve", lambda *a, **k: found.append(solve(*a, **k)) or found[-1])
    places = np.random.default_rng(3).permutation(30).tolist()
    parts = [[Candidate(1, (100 * p, 0), (100 * p + 50, 0))] for p in places]
    rule = Travel(Model.SIMULTANEOUS).rule(Fraction(1), (3000, 1), 100)
    order = chain._many(parts, Fraction(1), (None, (4000, 0)), rule)
    assert [places[i] for i in order] == list(range(30))
    assert found[0].status is Status.OPTIMAL


def test_tools_stay_where_a_line_between_them_matters():
    for line in ("M00", "F100", "G93X0Y0", "M47,turn the board"):
        program = program_of(TOOLS.replace("; far", line))
        with pytest.raises(UsageError, match=":10: tools cannot change places"):
            optimise(program, replace(FAST, tool_order=ToolOrder.OPTIMISE))
        assert optimise(program, FAST).costs_after.links == 880 + 870


def test_tools_stay_where_one_has_its_feed_from_another():
    program = program_of("T1F200S65\nX0Y0\nT2S30\nX50Y0\nT1F200S65\nX10Y0\n")
    for wish in ({"merge": True}, {"tool_order": ToolOrder.OPTIMISE}):
        with pytest.raises(
            UsageError, match=":9: tools cannot change places: this line states no F"
        ):
            optimise(program, replace(FAST, **wish))


def test_selections_that_say_other_things_are_not_merged():
    body = "T1F200S65\nX0Y0\nT2F150S5\nX50Y0\n{}\nX10Y0\nX90Y0\n"
    for line in ("T1F100S65", "T1F200S30 ; again", "T1F200S65C.001"):
        with pytest.raises(UsageError, match=r":11: tools cannot change places: T1 has .* line 7"):
            optimise(program_of(body.format(line)), replace(FAST, merge=True))
    for first, again in (("T1F200S65", "T1 F200 S65 ; again"), ("T1C.001F200S65", "T1F200S65")):
        program = program_of(body.replace("T1F200S65", first).format(again))
        board = optimise(program, replace(FAST, merge=True))
        assert [s.tool for s in board.after.selections] == [1, 2]


def test_selections_of_one_tool_are_merged_when_asked():
    body = "T1\nX0Y0\nX100Y0\nT2\nX50Y0\nT1\nX10Y0\nX90Y0\nX20Y0G85X30Y0\n"
    program = program_of(body)
    board = optimise(program, replace(FAST, merge=True))
    assert [s.tool for s in board.after.selections] == [1, 2]
    compare(program, board.after, text="free")
    assert board.costs_after.total == 100 + 50
    costs = board.costs_before  # the report's column adds up to the file as it was read
    assert sum(part.before for part in board.parts) + costs.links == costs.total
    assert optimise(program, FAST).costs_after.total > 150


def test_repeats_move_as_units_or_are_expanded():
    body = "T1\nX0Y0\nR2X100\nX50Y0\nX150Y0\n"
    unit = optimise(program_of(body), FAST)
    assert b"R2X" in unit.data and unit.proved
    assert unit.costs_after.total == 50 + 200 + 50
    spread = optimise(program_of(body), replace(FAST, expand=True))
    assert b"R2" not in spread.data and spread.costs_after.total == 200 == spread.bound


def test_what_is_expanded_keeps_its_comments():
    row = "X0Y0 ; start\n; between\nR3X50 ; the row\n"
    block = "M25 ; block\nX0Y90G85X10Y90 ; a slot\nX5Y9\nR1X5;two\nM01 ; end\nM02X50\nM08;done\n"
    data, notes = expand(program_of(f"T1\n{row}{block}"))
    assert notes == ()
    lines = [line for line in data.decode().splitlines() if ";" in line]
    assert [line[line.index(";") :] for line in lines] == [
        "; start", "; between", "; the row", "; block", "; end", ";done", "; a slot", ";two"
    ]  # fmt: skip
    compare(program_of(f"T1\n{row}{block}"), parse(data, "board.drl"), text="free")


def test_patterns_are_expanded_when_asked():
    body = "T1\nM25\nX0Y0\n; inside\nX100Y0\nM01\nM02X50\nM02X1000Y5M80\nM08\nX7Y7\n"
    program = program_of(body)
    board = optimise(program, replace(FAST, expand=True))
    assert board.after.patterns == () and b"; inside" in board.data and board.proved
    compare(program, board.after, text="free")
    assert board.after.hits == 7
    stubborn = program_of(body.replace("; inside", "M47,stop"))
    kept = optimise(stubborn, replace(FAST, expand=True))
    assert kept.after.patterns and "line 8: the pattern is not expanded" in kept.notes[-1]


# -- the chain of tools --------------------------------------------------------------------

PARTS = st.lists(
    st.lists(
        st.builds(
            Candidate,
            st.integers(0, 20),
            st.tuples(st.integers(0, 30), st.integers(0, 30)),
            st.tuples(st.integers(0, 30), st.integers(0, 30)),
        ),
        min_size=1,
        max_size=3,
    ),
    min_size=1,
    max_size=4,
)


@settings(max_examples=60, deadline=None)
@given(PARTS, st.booleans())
def test_chains_equal_brute_force(parts, stops):
    def link(p, q):
        return 0 if p is None or q is None else max(abs(p[0] - q[0]), abs(p[1] - q[1]))

    start, park = ((0, 0), (9, 9)) if stops else (None, None)

    def cost(order, picks):
        chosen = [parts[i][k] for i, k in zip(order, picks, strict=True)]
        at, total = start, 0
        for c in chosen:
            total, at = total + link(at, c.entry) + c.cost, c.exit
        return total + link(at, park)

    numbers = range(len(parts))

    def best(orders):
        return min(
            cost(order, picks)
            for order in orders
            for picks in itertools.product(*(range(len(parts[i])) for i in order))
        )

    def links(p, q):
        return np.array([[link(a, b) for b in q.tolist()] for a in p.tolist()], dtype=np.int64)

    kept = in_order(parts, links, start, park)
    assert kept.cost == best([tuple(numbers)])
    assert [i for i, _ in kept.steps] == list(numbers)
    free = any_order(parts, links, start, park)
    assert free.cost == best(itertools.permutations(numbers)) <= kept.cost
    assert cost(*zip(*free.steps, strict=True)) == free.cost


def test_links_are_bounded_from_below():
    rule = Travel(Model.SIMULTANEOUS).rule(Fraction(1), (100, 100), 10)
    rng = np.random.default_rng(0)
    p, q = rng.integers(0, 50, (2, 30)), rng.integers(40, 90, (2, 20))
    least = linker(rule)(p.T, q.T).min()
    assert nearest(rule, (p[0], p[1]), (q[0], q[1])) == least
    wide = (np.repeat(p[0], 2000), np.repeat(p[1], 2000)), (np.tile(q[0], 90), np.tile(q[1], 90))
    assert nearest(rule, *wide) <= least


# -- machines ------------------------------------------------------------------------------


@pytest.mark.parametrize("path", sorted((ROOT / "data" / "machines").glob("*.toml")), ids=str)
def test_the_machines_of_the_manual(path):
    machine = read_machine(path)
    assert machine.timed and machine.unit == "s" and machine.name
    board = optimise(
        program_of("T1\nX0Y0\nX9000Y0\nX100Y0\n"), Wishes(machine=machine, effort=Effort.FAST)
    )
    assert board.changed and board.proved


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("name = ", "not TOML"),
        ("name = " + "[" * 3000, "nested more than 20 deep"),
        ("speed = 3", "unknown key 'speed'"),
        ("travel = 3", "must be a table"),
        ("[travel]\nvz = 3", "unknown key 'vz'"),
        ("[travel]\nvx = -3", "greater than 0"),
        ("[travel]\nvx = 'fast'", "not a number"),
        ("[travel]\nmodel = 'warp'", "unknown travel model"),
        ("[travel]\nmodel = 'trapezoidal'", "needs the accelerations"),
        ("tool_change = -1", "0 or more, not -1"),
        ("tool_change = 5", "give the speeds"),
        ("[travel]\nvx = 400", "vx and vy belong together"),
        ("[travel]\nvx = 4\nvy = 4\nax = 1\nay = 1", "not for simultaneous"),
        ("[travel]\nmodel = 'trapezoidal'\nax = 1\nay = 1", "needs the speeds"),
        ("drill = inf", "drill = 'inf' is not a number"),
        ("tool_change = 'x'", "tool_change = 'x' is not a number"),
        ("[travel]\nvx = true", "vx = True is not a number"),
        ("name = 3", "name = 3 is not a text"),
        ("[travel]\nrounding = 'up2'", "unknown rounding 'up2'; expected nearest or up"),
        (
            "[travel]\nmodel = 'trapezoidal'\nvx = 1\nvy = 1\nax = -3\nay = 1",
            "ax must be greater than 0",
        ),
    ],
)
def test_bad_machines(tmp_path, text, said):
    path = tmp_path / "machine.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        read_machine(path)


# -- the command ---------------------------------------------------------------------------

BODY = "T1\nX0Y0\nX900Y0\nX100Y0\nX800Y0\nX200Y0\nT2\nX0Y0\nX9Y9\nX5Y5\n"


@pytest.fixture
def board(tmp_path: Path) -> Path:
    path = tmp_path / "board.drl"
    path.write_bytes(HEAD + BODY.encode() + b"M30\n")
    return path


def run(*words: object):
    return CliRunner().invoke(main, ["optimize", *map(str, words)])


def test_a_board_is_written_beside_its_input(board):
    before = board.read_bytes()
    done = run(board)
    assert done.exit_code == 0, done.stderr
    assert board.read_bytes() == before
    written = board.with_name("board-optimized.drl")
    compare(parse(before), read_program(written))
    assert "proved shortest" in done.stdout and str(written) in done.stdout
    written.write_bytes(b"mine")
    done = run(board)
    assert done.exit_code == 7 and "--force" in done.stderr and written.read_bytes() == b"mine"
    assert run(board, "--force").exit_code == 0 and written.read_bytes() != b"mine"


def test_in_place_keeps_a_backup(board):
    before = board.read_bytes()
    assert run(board, "--in-place").exit_code == 0
    assert board.read_bytes() != before
    assert board.with_name("board.drl.bak").read_bytes() == before
    done = run(board, "--in-place")
    assert done.exit_code == 0 and "kept" in done.stdout
    board.write_bytes(before.replace(b"X900", b"X901"))
    done = run(board, "--in-place")
    assert done.exit_code == 7 and "holds another board" in done.stderr
    assert run(board, "--out", board, "--force").exit_code == 2
    assert run(board, "--in-place", "--out", "x").exit_code == 2


def test_in_place_keeps_what_was_saved_meanwhile(board, monkeypatch):
    newer = board.read_bytes().replace(b"X900", b"X901")

    def slowly(*args: object):
        found = optimise(*args)
        board.write_bytes(newer)
        return found

    monkeypatch.setattr("tcp.cli.optimize.optimise", slowly)
    done = run(board, "--in-place")
    assert done.exit_code == 7 and "has changed meanwhile" in done.stderr
    assert board.read_bytes() == newer and not board.with_name("board.drl.bak").exists()


def test_after_ctrl_c_no_other_board_is_begun_though_the_first_cannot_be_written(
    board, tmp_path, monkeypatch
):
    other = tmp_path / "second.drl"
    other.write_bytes(board.read_bytes())

    def in_the_way(program, *args: object):
        program.path.with_name(f"{program.path.stem}-optimized.drl").write_text("mine")
        return replace(optimise(program, *args), interrupted=True)

    monkeypatch.setattr("tcp.cli.optimize.optimise", in_the_way)
    done = run(board, other)
    assert done.exit_code == 130 and "1 of 2 files are done" in done.stderr


def test_blocks_that_are_not_expanded_are_told_once(board):
    board.write_bytes(HEAD + b"T1\nM25\nX0Y0\nM47,stop\nM01\nM02X50\nM08\nM30\n")
    for words in ((), ("--json",), ("--jobs", 2)):
        done = run("--dry-run", "--expand", *words, board)
        assert done.exit_code == 0
        assert done.stderr.count("note: line 8: the pattern is not expanded, because") == 1


def test_check_and_dry_run_write_nothing(board):
    done = run(board, "--check")
    # 0.9 + 0.8 + 0.7 + 0.6 and 0.2 between and 0.009 + 0.004; 0.9 and 0.0 and 0.009 do
    assert done.exit_code == 1
    assert "this file travels 3.53 times what is needed (proved)" in done.stdout
    assert run(board, "--dry-run").exit_code == 0
    assert list(board.parent.iterdir()) == [board]
    run(board)
    done = run(board.with_name("board-optimized.drl"), "--check")
    assert done.exit_code == 0 and "no more than what is needed (proved)" in done.stdout


def test_exact_says_what_is_not_proved_and_writes_nothing(board, monkeypatch):
    monkeypatch.setattr(
        "tcp.boards.optimise.answer", lambda instance, as_is, *_: as_it_stands(instance, as_is)
    )
    holes = np.random.default_rng(1).integers(0, 999, (30, 2)).tolist()
    lines = "".join(f"X{x}Y{y}\n" for x, y in holes)
    board.write_bytes(HEAD + f"T1\nX0Y0\nX9Y0\nT2\n{lines}M30\n".encode())
    done = run(board, "--exact")
    assert done.exit_code == 5 and list(board.parent.iterdir()) == [board]
    assert "board.drl: no proof for T2; " in done.stderr


def test_what_is_not_understood_is_not_called_shortest(board):
    program = board.with_name("program.ngc")
    program.write_text("G21 G90\nT1 M6\nG81 X1 Y1 Z-1 R1\nX9\nG2 X5 Y5 I1\nG81 X3\nM30\n")
    done = run(program, "--check")
    assert "kept as it was" in done.stdout and "with T1 as it is; no bound is known" in done.stdout


def test_tools_by_diameter_may_cost_travel_and_that_is_said(board):
    board.write_bytes(HEAD + b"T1\nX0Y0\nT3\nX100Y0\nT2\nX200Y0\nM30\n")
    done = run(board, "--tool-order", "ascending")
    assert done.exit_code == 0, done.stderr
    assert "more: the order of tools asked for costs that" in done.stdout


def test_the_only_tool_has_the_bound_of_the_board():
    hits = "".join(f"X{x}Y50\n" for x in (7, 5000, 9))
    board = optimise(program_of(f"T1\n{BLOCK}{hits}"), FAST)
    (part,) = board.parts
    assert part.bound == board.bound == board.costs_after.total and part.proved


def test_check_tells_both_ends_where_there_is_a_gap(board):
    holes = np.random.default_rng(1).integers(0, 999, (30, 2)).tolist()
    lines = "".join(f"X{x}Y{y}\n" for x, y in holes)
    board.write_bytes(HEAD + f"T1\n{lines}M30\n".encode())
    done = run(board, "--check", "--start", "0.45,0.5")
    assert done.exit_code == 1
    found = re.search(r"travels ([\d.]+) to ([\d.]+) times what is needed: ([\d.]+)", done.stdout)
    assert found and 1 < float(found[1]) < float(found[2])


@pytest.mark.parametrize(
    ("bound", "said"), [(995, "2.39 to 2.42 times"), (0, "at least 2.39 times")]
)
def test_what_is_proved_is_not_rounded_to_what_is_not(bound, said):
    found = optimise(program_of("T1\nX0Y0\nX9Y0\n"), FAST)
    found = replace(found, costs_before=Costs((2399,), 0), costs_after=Costs((1000,), 0))
    assert said in audit(replace(found, bound=bound))


def test_copies_of_a_private_board_are_private(board):
    board.chmod(0o600)
    for option, copy in (("--force", "board-optimized.drl"), ("--in-place", "board.drl.bak")):
        assert run(board, option).exit_code == 0
        assert board.with_name(copy).stat().st_mode & 0o777 == 0o600
    assert board.stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize(("option", "suffix"), [("--report", "html"), ("--plot", "svg")])
def test_what_shows_a_private_board_is_private(board, option, suffix):
    board.chmod(0o600)
    picture = board.with_suffix(f".{suffix}")
    assert run(board, "--dry-run", "--effort", "fast", option, picture).exit_code == 0
    assert picture.stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize("jobs", [1, 2])
def test_proofs_and_hashes_of_a_private_board_are_private(board, tmp_path, jobs):
    board.chmod(0o600)
    open_to_all = tmp_path / "open.drl"
    open_to_all.write_bytes(board.read_bytes())
    open_to_all.chmod(0o644)
    proofs, hashes = tmp_path / "proofs", tmp_path / "hashes.json"
    wishes = ["--dry-run", "--jobs", jobs, "--certificates", proofs, "--manifest", hashes]
    assert run(board, open_to_all, *wishes).exit_code == 0
    modes = {path.name[:4]: path.stat().st_mode & 0o777 for path in proofs.iterdir()}
    assert modes["boar"] == hashes.stat().st_mode & 0o777 == 0o600
    assert modes["open"] == open_to_all.stat().st_mode & 0o777


@pytest.mark.parametrize("name", ["a.csv", "a.tsp", "a.kicad_pcb", "a.DXF"])
def test_what_only_solve_reads_is_said_to_be_so(tmp_path, name):
    (tmp_path / name).write_text("x,y\n1,2\n")
    done = run(tmp_path / name)
    said = f"tcp solve reads {Path(name).suffix}, tcp optimize Excellon and G-code"
    assert done.exit_code == 3 and said in done.stderr


def test_outputs_without_a_place_are_refused_before_any_work(board, tmp_path, monkeypatch):
    monkeypatch.setattr("tcp.cli.optimize.optimise", None)
    other = tmp_path / "other"
    other.mkdir()
    (other / "board.drl").write_bytes(board.read_bytes())
    out = tmp_path / "out"
    out.mkdir()
    done = run(board, other / "board.drl", "--out", out)
    assert done.exit_code == 2 and "would be written twice" in done.stderr
    for words in (
        ["--report", tmp_path / "none" / "a.html"],
        ["--plot", tmp_path / "none" / "a.svg"],
        ["--manifest", tmp_path / "none" / "a.json"],
        ["--out", tmp_path / "none" / "a.drl"],
        ["--out", f"{tmp_path}/none/"],
    ):
        done = run(board, *words)
        assert done.exit_code == 7 and "there is no folder" in done.stderr
        assert done.stderr.count("\n") == 1
    for words in (["--plot", tmp_path / "a.pdf"], ["--report", tmp_path / "a.txt"]):
        assert run(board, *words).exit_code == 2
    board.with_name("board-optimized.drl").write_text("something else")
    done = run(board)
    assert done.exit_code == 7 and "exists already" in done.stderr


def test_more_locked_holes_than_there_are_keep_the_file(board):
    done = run(board, "--keep-first", 999, "--dry-run")
    assert done.exit_code == 0 and done.stdout.count("kept as it was") == 2


def test_tools_beyond_the_proof_engine_are_sought_and_bounded(monkeypatch):
    monkeypatch.setattr("tcp.exact.branch_and_cut.run.LARGEST", 20)
    rng = np.random.default_rng(3)
    holes = "".join(f"X{x}Y{y}\n" for x, y in rng.integers(0, 999, (40, 2)))
    board = optimise(program_of("T1\n" + holes), Wishes(time_limit=1))
    part = board.parts[0]
    assert part.solved[0].answer.solver == "local-search"
    assert 0 < part.bound <= part.after < part.before


def test_what_ctrl_c_leaves_alone_is_not_called_proved(monkeypatch):
    import tcp.boards.optimise as module

    def interrupted(instance, as_is, *_: object):
        signal.raise_signal(signal.SIGINT)
        return replace(as_it_stands(instance, as_is), interrupted=True)

    monkeypatch.setattr(module, "answer", interrupted)
    board = optimise(program_of(BODY), FAST)
    assert board.interrupted and not board.proved
    assert all(part.bound <= part.after and not part.proved for part in board.parts)


def test_a_block_inside_out_counts_the_way_from_the_start():
    """Reversed it is shorter, but then it begins far from where the machine stands."""
    program = program_of("T1\nM25\nX0Y0\nX5000Y0\nM01\nM02X-100\nM08\n")
    free = optimise(program, FAST)
    assert free.costs_after.total < free.costs_before.total
    point = Fraction(0), Fraction(0)
    for wishes in (replace(FAST, start=point), replace(FAST, start=point, park=point)):
        board = optimise(program, wishes)
        assert board.costs_after.total <= board.costs_before.total


def test_tables_of_small_tools_keep_within_memory(monkeypatch):
    rng = np.random.default_rng(3)
    body = "".join(
        f"T{t}\n" + "".join(f"X{x}Y{y}\n" for x, y in rng.integers(0, 999, (9, 2)))
        for t in range(1, 4)
    )
    whole = optimise(program_of(body), FAST)
    assert whole.proved and len(whole.parts) == 3
    for room in (2 * (9 * 9 << 9), 0):
        monkeypatch.setattr("tcp.boards.choose.TABLES", room)
        board = optimise(program_of(body), FAST)
        assert whole.costs_after.total <= board.costs_after.total <= board.costs_before.total
        assert board.bound <= whole.costs_after.total


def test_ctrl_c_ends_the_tables(monkeypatch):
    """What was found stays; nothing is looked for any more."""
    import tcp.boards.choose as module

    tables = []

    def rung(units):
        tables.append(units)
        signal.raise_signal(signal.SIGINT)
        return all_ends(units)

    all_ends = module.all_ends
    monkeypatch.setattr(module, "all_ends", rung)
    body = "".join(f"T{t}\nX0Y{t}\nX9Y{t}\nX5Y{t}\nX3Y{t}\n" for t in (1, 2, 3))
    board = optimise(program_of(body), FAST)
    assert board.interrupted and len(tables) == 1


def test_ctrl_c_ends_the_bounds(monkeypatch):
    import tcp.bounds.one_tree as module

    clocks = []

    def rung(instance, clock):
        if not clocks:
            signal.raise_signal(signal.SIGINT)
        clocks.append(clock)
        return one_tree_bound(instance, clock=clock)

    one_tree_bound = module.one_tree_bound
    monkeypatch.setattr(module, "one_tree_bound", rung)
    lines = [f"G0 X{x} Y{x * x % 97}\nG1 Z-{1 + x // 9} F9\nG0 Z5\n" for x in range(18)]
    text = f"G21 G90\nT1 M6\nG0 Z5\n{''.join(lines)}M2\n"
    board = optimise(gcode.parse(text.encode(), "board.ngc"), FAST)
    assert board.interrupted and clocks and all(clock.interrupted for clock in clocks)


@pytest.mark.parametrize("where", ["measure", "_fit", "choose", "least_chain"])
def test_ctrl_c_counts_wherever_the_work_is(where, monkeypatch):
    import tcp.boards.optimise as module

    original = getattr(module, where)

    def rung(*given: object):
        signal.raise_signal(signal.SIGINT)
        monkeypatch.setattr(module, where, original)
        return original(*given)

    monkeypatch.setattr(module, where, rung)
    board = optimise(program_of(BODY), FAST)
    assert board.interrupted and board.costs_after.total <= board.costs_before.total


def test_a_second_ctrl_c_ends_it(monkeypatch):
    import tcp.boards.optimise as module

    def rung(*_: object):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(module, "choose", rung)
    with pytest.raises(KeyboardInterrupt):
        optimise(program_of(BODY), FAST)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_paths_are_not_fitted_to_their_neighbours_after_ctrl_c(monkeypatch):
    import tcp.boards.optimise as module

    calls = []

    def tied(units, order, *_: object):
        calls.append(order)
        signal.raise_signal(signal.SIGINT)
        return order

    rng = np.random.default_rng(5)
    holes = [
        f"T{t}\n" + "".join(f"X{x}Y{y}\n" for x, y in rng.integers(0, 999, (20, 2))) for t in (1, 2)
    ]
    monkeypatch.setattr(module, "tied", tied)
    board = optimise(program_of("".join(holes)), Wishes())
    assert len(calls) == 1 and board.interrupted


def test_json_and_manifest(board, tmp_path):
    done = run(board, "--json", "--manifest", tmp_path / "manifest.json")
    data = json.loads(done.stdout)
    assert data["proved"] and data["holes"] == 8 and Fraction(data["after"]) < 2
    rows = json.loads((tmp_path / "manifest.json").read_text())["boards"]
    assert rows[0]["output"] == data["written"] and len(rows[0]["input_sha256"]) == 64


def test_folders_and_patterns(board, tmp_path):
    (tmp_path / "second.txt").write_bytes(board.read_bytes())
    (tmp_path / "notes.txt").write_text("nothing to drill\n")
    out = tmp_path / "out"
    out.mkdir()
    done = run(tmp_path, "--out", out)
    assert done.exit_code == 0 and "2 boards" in done.stdout
    assert sorted(p.name for p in out.iterdir()) == ["board.drl", "second.txt"]
    more = tmp_path / "more"
    more.mkdir()
    (more / "plated.cnc").write_bytes(board.read_bytes())
    (more / "slots.rou").write_bytes(board.read_bytes())
    (more / "program.nc").write_text("G21\nG81 X1 Y2 Z-1 R1\nX9\nX3\nG80\nM30\n")
    (more / "readme.nc").write_text("not a program\n")
    done = run(more, "--dry-run")
    assert done.exit_code == 0 and "3 boards" in done.stdout
    assert run(tmp_path / "*.drl", "--out", out, "--force").exit_code == 0
    assert run(tmp_path / "*.xyz").exit_code == 3
    for _ in range(2):  # what the first run wrote is no board of the second
        assert run(more / "*.cnc", "--force").exit_code == 0
    assert not list(more.glob("*-optimized-optimized.cnc"))
    (more / "panel-optimized-2.drl").write_bytes(board.read_bytes())  # not what tcp writes
    assert "panel-optimized-2.drl" in run(more, "--dry-run").stdout
    assert run(board, tmp_path / "second.txt", "--out", tmp_path / "one.drl").exit_code == 2
    (out / "empty").mkdir()
    assert run(out / "empty").exit_code == 3


def test_bad_files_do_not_stop_the_others(board, tmp_path):
    bad = tmp_path / "bad.drl"
    bad.write_bytes(HEAD + b"T7\nX1Y1\nM30\n")
    (tmp_path / "empty").mkdir()
    done = run(bad, board, tmp_path / "none.drl", tmp_path / "empty", tmp_path / "*.none")
    assert done.exit_code == 3
    assert done.stderr.count("\n") == 4 and "T7 is not defined" in done.stderr
    assert "holds no drill file" in done.stderr and "matches no drill file" in done.stderr
    assert board.with_name("board-optimized.drl").exists()


def test_a_folder_that_hides_its_files_is_one_sentence(board, monkeypatch):
    def denied(path: Path, *_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "is_dir", denied)
    done = run(board)
    assert (
        done.exit_code == 3 and done.stderr == f"tcp: {board}: cannot be read: permission denied\n"
    )


@pytest.mark.parametrize("words", [[], ["--in-place"], ["--dry-run", "--manifest"]])
def test_a_folder_that_cannot_be_written_to_ends_the_call_before_any_work(
    board, words, monkeypatch
):
    monkeypatch.setattr("tcp.cli.optimize.optimise", None)
    monkeypatch.setattr(os, "access", lambda path, mode: not mode & os.W_OK)
    more = [board.with_name("m.json")] if "--manifest" in words else []
    done = run(board, *words, *more)
    assert done.exit_code == 7 and "cannot be written to" in done.stderr


@pytest.mark.parametrize(
    "words",
    [
        ["--time-limit", "0"],
        ["--time-limit", "nan"],
        ["--seed", "-1"],
        ["--home", "0,0", "--start", "1,1"],
        ["--keep", "T9"],
        ["--keep", "x"],
        ["--keep", "²"],
        ["--start", "1"],
        ["--start", "1e25,0"],
        ["--travel", "warp"],
        ["--travel", "trapezoidal"],
        ["--format", "24"],
        ["--effort", "some"],
        ["--exact", "--effort", "fast"],
        ["--certificates", "proofs", "--effort", "fast"],
        ["--check", "--in-place"],
        ["--check", "--out", "x.drl"],
        ["--check", "--force"],
        ["--in-place", "--out", "x.drl"],
        ["--keep-first", "1", "--tool-order", "ascending"],
        ["--keep-first", "1", "--merge-tool-selections"],
        ["--vx", "5"],
        ["--ax", "5", "--ay", "5"],
        ["--travel", "trapezoidal", "--ax", "5", "--ay", "5"],
    ],
)
def test_usage_errors_are_one_sentence(board, words):
    done = run(board, *words)
    assert done.exit_code == 2, done.output
    assert done.stderr.count("\n") == 1 and "Traceback" not in done.stderr
    assert list(board.parent.iterdir()) == [board]


def test_a_folder_without_permission_keeps_the_original(board, monkeypatch):
    def denied(**_: object) -> None:
        raise PermissionError(13, "Permission denied")

    before = board.read_bytes()
    monkeypatch.setattr("tempfile.mkstemp", denied)
    done = run(board, "--in-place")
    assert done.exit_code == 7 and "permission denied" in done.stderr
    assert board.read_bytes() == before and list(board.parent.iterdir()) == [board]


def test_a_full_disk_keeps_the_original(board, monkeypatch):
    before = board.read_bytes()

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    done = run(board, "--in-place")
    assert done.exit_code == 7 and "no space left" in done.stderr
    assert board.read_bytes() == before and list(board.parent.iterdir()) == [board]


def test_a_lost_hole_leaves_nothing_behind(board, monkeypatch):
    import tcp.boards.deliver as deliver

    def lost(*_: object, **__: object) -> None:
        raise LostError("lost one")

    monkeypatch.setattr(deliver, "compare", lost)
    done = run(board)
    assert done.exit_code == 70 and "lost one" in done.stderr
    assert list(board.parent.iterdir()) == [board]


def test_every_proved_tool_gets_a_certificate_that_checks(board, tmp_path):
    done = run(board, "--certificates", tmp_path / "proofs", "--json")
    data = json.loads(done.stdout)
    assert [tool["proof"] for tool in data["tools"]] == ["certified", "certified"]
    written = [path for tool in data["tools"] for path in tool["certificates"]]
    assert [Path(path).name for path in written] == [
        "board-T1.cert.json.gz",
        "board-T2.cert.json.gz",
    ]
    for path in written:
        assert CliRunner().invoke(main, ["check", path]).exit_code == 0


def test_machine_options_reach_the_board(board, tmp_path):
    profile = ROOT / "data" / "machines" / "ball-screw-drill.toml"
    done = run(board, "--machine", profile, "--home", "0,0", "--json", "--dry-run")
    data = json.loads(done.stdout)
    assert data["unit"] == "s" and data["travel"] == "simultaneous"
    done = run(board, "--vx", "10", "--vy", "20", "--dry-run")
    assert " s saved a board" in done.stdout and "with drilling" not in done.stdout
    done = run(board, "--machine", profile, "--dry-run")
    assert " s a board with drilling and tool changes" in done.stdout
    assert Machine().unit == "mm"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
def test_a_device_without_room_is_one_sentence(board):
    done = run(board, "--out", "/dev/full", "--force")
    assert done.exit_code == 7 and "no space left" in done.stderr and done.stderr.count("\n") == 1


def test_the_benchmark_page_is_printed_from_its_rows():
    spec = importlib.util.spec_from_file_location("bench", ROOT / "benchmarks" / "boards.py")
    bench = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(bench)
    row = {"board": "kicad-a.drl", "tool": 1, "limit": 10.0, "quantum": "1/100", "seconds": 0.5}
    row |= {"load": 0.1, "cores": 2, "versions": {"python": "3.11"}}
    costs = dict(zip(bench.WAYS, (1000, 150, 110, 120, 100), strict=True))
    rows = [
        row | {"holes": 40, "costs": costs, "bound": 100, "optimal": True},
        row | {"tool": 2, "holes": 900, "costs": costs, "bound": 99, "optimal": False},
    ]
    page = bench.table(rows)
    for said in (
        "| kicad-a.drl | 940 | 2 | 1 | 20.0 | 3.0 | 2.2 | 2.4 | 2.0 | 2.0 | 0.50 % |",
        "up to 400 holes: 1 of 1 proved",
        "up to 500 holes: 1 of 1 proved within 5 s",
        "above 400: 0 of 1 proved; largest gap 1.00 %",
        "Best peer: nn+2opt, 10.0 % above ours",
        "KiCad's files travel 10.0 times",
        "| kicad-a.drl | T2 | 900 | 1.00 | 0.99 | 1.00 % | 0.5 |",
    ):
        assert said in page


@settings(max_examples=40, deadline=None)
@given(
    st.lists(
        st.lists(st.tuples(st.integers(0, 40), st.integers(0, 40)), min_size=1, max_size=3),
        min_size=2,
        max_size=3,
    )
)
def test_stretches_one_behind_the_other_are_bounded_from_below(groups):
    """Holes of one tool at several depths: the groups stay in order, each is free inside."""
    lines = [
        f"G0 X{x} Y{y}\nG1 Z-{depth + 1} F9\nG0 Z5\n"
        for depth, group in enumerate(groups)
        for x, y in group
    ]
    text = f"G21 G90\nT1 M6\nG0 Z5\n{''.join(lines)}M2\n"
    board = optimise(gcode.parse(text.encode(), "board.ngc"), FAST)
    orders = itertools.product(*(itertools.permutations(group) for group in groups))
    least = min(length([place for group in order for place in group]) for order in orders)
    worth = board.rule.quantum
    assert board.bound * worth <= least <= board.costs_after.total * worth
    assert board.parts[0].bound == board.bound


ORIGIN = Fraction(0), Fraction(0)
HIT = st.tuples(st.integers(0, 40), st.integers(0, 40))
SIDE, INSIDE = (st.lists(HIT, min_size=1, max_size=most) for most in (2, 3))


@settings(max_examples=40, deadline=None)
@given(
    st.tuples(SIDE, INSIDE, INSIDE, SIDE),
    st.lists(st.tuples(st.integers(-60, 60), st.integers(0, 60)), min_size=1, max_size=3),
)
@example(
    ([(0, 9)], [(0, 0)], [(0, 1)], [(60, 8)]), [(20, 0)] * 3
)  # one path through T1 alone is longer than all there is
@example(([(0, 0)], [(0, 0), (5, 0), (1, 0)], [(0, 1), (4, 1), (2, 1)], [(40, 1)]), [(20, 0)] * 2)
@example(([(4, 4)], [(9, 9), (0, 0)], [(9, 8), (1, 0)], [(5, 5)]), [(2, 0)] * 3)
def test_tools_that_alternate_in_a_repeated_block_are_bounded_from_below(groups, shifts):
    """Holes keep their tool and their side of the block; all copies have one order."""

    def text(groups):
        before, first, second, behind = (
            "".join(f"X{x}Y{y}\n" for x, y in group) for group in groups
        )
        copies = "".join(f"M02X{x}Y{y}\n" for x, y in shifts)
        return f"T1\n{before}M25\n{first}T2\n{second}M01\n{copies}M08\n{behind}"

    program = program_of(text(groups))
    board = optimise(program, replace(FAST, start=ORIGIN))
    every = itertools.product(*(itertools.permutations(group) for group in groups))
    costs = [measure(program_of(text(order)), board.rule, ORIGIN) for order in every]
    assert board.bound <= min(c.total for c in costs) <= board.costs_after.total
    assert board.costs_after.total <= board.costs_before.total
    for number, part in enumerate(board.parts):
        least = min(c.parts[number] for c in costs)
        assert part.bound <= least and (not part.optimal or part.after == least)


@pytest.mark.parametrize("seed", [6, 48, 77])
def test_fitting_paths_to_each_other_is_done_with_in_one_run(seed):
    """Boards on which a second run found ends that fit the next tool better."""
    rng = random.Random(seed)
    tools = [
        [(rng.randrange(14), rng.randrange(14)) for _ in range(rng.choice((2, 3, 4, 18, 20)))]
        for _ in range(3)
    ]

    def board(tools: list[list[tuple[int, int]]]):
        lines = [
            f"T{tool}\n" + "".join(f"X{x}Y{y}\n" for x, y in holes)
            for tool, holes in enumerate(tools, start=1)
        ]
        return optimise(program_of("".join(lines)))

    first = board(tools)
    assert first.proved and optimise(first.after).data == first.data
    assert board([holes[::-1] for holes in tools]).costs_after == first.costs_after


def shell(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """A command line as a shell runs it, with ``tcp`` for the program."""
    text = command.replace("tcp ", f"{sys.executable} -m tcp ")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        ["bash", "-c", text],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        errors="replace",
    )


@pytest.fixture
def drill(tmp_path):
    path = tmp_path / "b.drl"
    path.write_bytes(HEAD + BODY.encode() + b"M30\n")
    return path


@pytest.mark.parametrize(
    "command",
    [
        "tcp optimize --effort fast --json --dry-run --manifest /dev/stdout b.drl",
        "tcp optimize --effort fast --force --out /dev/stdout b.drl",
        "tcp optimize --effort fast --out /dev/stdout b.drl",
    ],
)
def test_output_goes_on_behind_what_stands_in_a_redirected_file(command, drill, tmp_path):
    (tmp_path / "log").write_text("precious\n")
    done = shell(f"{command} >> log", tmp_path)
    text = (tmp_path / "log").read_text()
    assert done.returncode == 0, done.stderr
    assert text.startswith("precious\n") and text.count("\n") > 3
    assert ("tcp-manifest-1" in text and "lower_bound" in text) or "M30" in text


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("tcp info b.drl > /dev/full", 7),
        (f"tcp optimize --effort fast --out {'x' * 300} b.drl", 7),
        ("tcp optimize --effort fast --dry-run b.drl >&-", 0),
        ("tcp optimize --effort fast /dev/stdin < <(cat b.drl)", 2),
        ("mkdir m; tcp optimize --effort proof --dry-run --manifest m b.drl", 7),
        ("mkdir b.drl.bak; tcp optimize --effort proof --in-place b.drl", 7),
        ("echo old > b.drl.bak; tcp optimize --effort fast --in-place b.drl", 7),
        ("mkdir c; cp b.drl c; tcp optimize --dry-run --certificates d b.drl c/b.drl", 2),
    ],
)
def test_what_cannot_be_written_is_one_sentence(command, code, drill, tmp_path):
    done = shell(command, tmp_path)
    assert done.returncode == code, done.stderr
    assert "internal" not in done.stderr and "Traceback" not in done.stderr


def test_the_oldest_backup_stays_when_a_better_order_is_found(drill, tmp_path):
    before = drill.read_bytes()
    lines = before.split(b"\n")
    at = [k for k, line in enumerate(lines) if line.startswith(b"X")]
    other = list(lines)
    other[at[0]], other[at[1]] = lines[at[1]], lines[at[0]]
    (tmp_path / "b.drl.bak").write_bytes(b"\n".join(other))
    done = shell("tcp optimize --effort fast --in-place b.drl", tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "b.drl.bak").read_bytes() == b"\n".join(other)


def test_a_reader_that_leaves_is_no_finding(drill, tmp_path):
    command = "tcp optimize --effort fast --dry-run b.drl b.drl b.drl; echo $? > code"
    done = shell(f"({command}) | true; cat code", tmp_path)
    assert done.stdout == "7\n" and "nobody reads" in done.stderr


def test_patterns_work_in_folders_too(drill, tmp_path):
    (tmp_path / "fab one").mkdir()
    drill.rename(tmp_path / "fab one" / "b.drl")
    done = shell("tcp optimize --effort fast --dry-run 'fab*/b*.drl'", tmp_path)
    assert done.returncode == 0, done.stderr


def test_an_older_backup_stays_if_forced(drill, tmp_path):
    before = drill.read_bytes()
    (tmp_path / "b.drl.bak").write_text("the first version")
    done = shell("tcp optimize --effort fast --in-place --force b.drl", tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "b.drl.bak").read_text() == "the first version"
    assert drill.read_bytes() != before


def test_a_name_that_is_no_text_is_drawn(drill, tmp_path):
    drill.rename(tmp_path / os.fsdecode(b"l\xe9.drl"))
    done = shell(
        "tcp optimize --effort fast --dry-run --report a.html --plot a.svg l*.drl", tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.html").exists() and (tmp_path / "a.svg").exists()
