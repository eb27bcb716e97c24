"""Panels: recognised exactly or not at all, linked exactly, and worth it."""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Ends, Instance, Model, Rules, Travel, Workpiece
from tcp.boards.board import Wishes
from tcp.boards.effort import Effort
from tcp.boards.optimise import optimise
from tcp.files.drilling import read_drilling
from tcp.heuristics.local_search.linking import (
    Path,
    board_form,
    choose,
    linked_tour,
    panel_of,
    ways,
)
from tcp.heuristics.panels import Panel, find_panel
from tcp.result import Status
from tcp.solve import solve
from tcp.stop import Clock, Stop, StopReason


def board(n: int, seed: int = 0, side: int = 1000) -> tuple[np.ndarray, np.ndarray]:
    return tuple(np.random.default_rng(seed).integers(0, side, (2, n)))


def planted(x, y, columns: int, rows: int, step=(1100, 1200), seed: int = 1):
    """Copies of a board in random order."""
    places = [(i * step[0], j * step[1]) for i in range(columns) for j in range(rows)]
    px = np.concatenate([x + dx for dx, _ in places])
    py = np.concatenate([y + dy for _, dy in places])
    order = np.random.default_rng(seed).permutation(px.size)
    return px[order], py[order]


def piece(x, y) -> Workpiece:
    return Workpiece(
        "panel", tuple(map(str, range(x.size))), x.astype(np.int64), y.astype(np.int64)
    )


def check(panel: Panel, x, y) -> None:
    """Every hole belongs to one copy, and every copy is the first one, moved."""
    columns, rows, _ = panel.holes.shape
    assert sorted(panel.holes.ravel().tolist()) == list(range(x.size))
    first = panel.holes[0, 0]
    for i, j in itertools.product(range(columns), range(rows)):
        copy = panel.holes[i, j]
        assert np.array_equal(x[copy] - x[first], np.full(copy.size, i * panel.step[0]))
        assert np.array_equal(y[copy] - y[first], np.full(copy.size, j * panel.step[1]))


@given(
    holes=st.integers(1, 12),
    columns=st.integers(1, 4),
    rows=st.integers(1, 4),
    seed=st.integers(0, 10**6),
    side=st.sampled_from([3, 1000]),
    step=st.tuples(st.integers(1001, 1500), st.integers(1001, 1500)),
)
@settings(max_examples=150, deadline=None)
def test_planted_panels_are_found(holes, columns, rows, seed, side, step):
    x, y = planted(*board(holes, seed, side), columns, rows, step, seed)
    panel = find_panel(x, y, least=1)
    if columns * rows == 1:
        assert panel is None or holes > 1
        return
    assert panel is not None and panel.copies >= columns * rows
    check(panel, x, y)
    if side == 1000 and holes > 4:
        assert panel.holes.shape == (columns, rows, holes)


@pytest.mark.parametrize(("columns", "rows"), [(1, 5), (5, 1), (2, 2), (3, 4)])
def test_one_hole_off_is_no_panel(columns, rows):
    x, y = planted(*board(40), columns, rows)
    assert find_panel(x, y).holes.shape == (columns, rows, 40)
    for hole in (0, 17, x.size - 1):
        for array in (x, y):
            array[hole] += 1
            assert find_panel(x, y) is None
            array[hole] -= 1
    assert find_panel(x[1:], y[1:]) is None, "a hole is missing"
    assert find_panel(np.append(x, x[0]), np.append(y, y[0])) is None, "a hole is there twice"


def test_duplicates_belong_to_the_board():
    x, y = board(40)
    x, y = np.append(x, x[3]), np.append(y, y[3])
    px, py = planted(x, y, 3, 2)
    check(find_panel(px, py), px, py)


def test_turned_mirrored_irregular_and_overlapping_copies_are_none():
    x, y = board(40)
    turned = np.concatenate([x, 2200 - x]), np.concatenate([y, 1000 - y])
    mirrored = np.concatenate([x, 2200 - x]), np.concatenate([y, y])
    uneven = np.concatenate([x, x + 1100, x + 2201]), np.tile(y, 3)
    skewed = np.concatenate([x, x + 1100]), np.concatenate([y, y + 1])
    into = np.concatenate([x, x + 900]), np.tile(y, 2)
    for holes in (turned, mirrored, uneven, skewed, into, (x, y)):
        assert find_panel(*holes) is None


def test_an_incomplete_panel_is_none():
    x, y = planted(*board(40), 3, 2)
    missing = ~((x > 2200) & (y > 1200))  # the last copy
    assert missing.sum() == 200
    assert find_panel(x[missing], y[missing]) is None


def test_a_lattice_is_columns():
    y, x = (v.ravel() for v in np.mgrid[:40, :50])
    panel = find_panel(x, y)
    assert panel.holes.shape == (50, 1, 40)
    check(panel, x, y)


def test_ways_are_serpentines():
    panel = Panel(np.zeros((4, 3, 1), np.int64), (1, 1))
    found = list(ways(panel))
    assert len(found) == 8
    for way in found:
        assert len(set(way)) == 12
        assert all(abs(a - c) + abs(b - d) == 1 for (a, b), (c, d) in itertools.pairwise(way))
    assert len(list(ways(Panel(np.zeros((4, 1, 1), np.int64), (1, 0))))) == 2


@given(seed=st.integers(0, 10**6), model=st.sampled_from([Model.SEQUENTIAL, Model.SIMULTANEOUS]))
@settings(max_examples=25, deadline=None)
def test_links_are_chosen_exactly(seed, model):
    rng = np.random.default_rng(seed)
    x, y = planted(*board(4, seed), 2, 2)
    panel = find_panel(x, y, least=4)
    form = Instance(piece(x, y), Travel(model)).form
    small = board_form(form, panel.holes[0, 0])
    options = []
    for _ in range(3):
        order = rng.permutation(4)
        options.append(Path(order, small.tour_cost([*order, 4])))
    for way in ways(panel):
        chosen = choose(form, panel, options, way)

        def cost(picked, way=way):
            tour = [panel.holes[c][options[k].holes] for c, k in zip(way, picked, strict=True)]
            return form.tour_cost([*np.concatenate(tour), form.virtual])

        assert cost(chosen) == min(map(cost, itertools.product(range(3), repeat=4)))


ENDS = [
    Ends(),
    Ends(start=7),
    Ends(start=7, end=100),
    Ends(closed=True),
    Ends(home=(Fraction(-5), Fraction(0)), outward=True),
    Ends(home=(Fraction(-5), Fraction(0)), outward=True, back=True),
]


@pytest.mark.parametrize("ends", ENDS, ids=str)
def test_routes_over_panels_are_routes(ends):
    instance = Instance(piece(*planted(*board(35), 2, 2)), ends=ends)
    stop = Stop(iterations=400)
    result = solve(instance, "local-search", stop=stop, seed=3)
    assert result.status is Status.FEASIBLE
    closed = ends.closed or (ends.outward and ends.back)
    assert result.details.get("panel") == (None if closed else "2 x 2 boards of 35 holes")
    assert solve(instance, "local-search", stop=stop, seed=3, workers=1).route == result.route
    plain = solve(instance, "local-search", stop=stop, seed=3, panels=False)
    assert plain.status is Status.FEASIBLE and "panel" not in plain.details


def test_a_panel_costs_its_boards_and_their_links():
    """Boards far apart: the best order is board by board, and the links are the gaps."""
    x, y = board(30, side=300)
    px, py = planted(x, y, 3, 1, step=(5000, 1))
    result = solve(Instance(piece(px, py)), "local-search", stop=Stop(iterations=3000))
    order = np.asarray(result.route) * 0 + np.array([px[h] // 5000 for h in result.route])
    assert (np.diff(order) != 0).sum() == 2


def test_without_time_the_board_is_searched_once():
    form = Instance(piece(*planted(*board(40), 2, 2))).form
    clock, searched = Clock(Stop()), []

    def improve(form, tour, clock, kicks):
        searched.append(form)
        return [*range(form.size)]

    linked_tour(form, panel_of(form), improve, clock, None)
    assert len(searched) > 1
    clock.interrupt()
    searched.clear()
    tour = linked_tour(form, panel_of(form), improve, clock, None)
    assert len(searched) == 1 and sorted(tour) == list(range(form.size))


def test_rules_between_holes_stand_in_the_way():
    x, y = planted(*board(40), 2, 2)
    plain = Instance(piece(x, y))
    assert panel_of(plain.form) is not None
    assert panel_of(Instance(piece(x, y), rules=Rules(forbidden=((0, 1),))).form) is None
    assert panel_of(Instance(piece(x, y), rules=Rules(together=((0, 1),))).form) is None


def test_part_of_a_clock():
    now = [0.0]
    whole = Clock(Stop(time=10), lambda: now[0])
    now[0] = 7.0
    part = whole.part(Stop(time=5, iterations=4))
    assert part.stop == Stop(time=3, iterations=4)
    assert part.reason(iterations=4) is StopReason.ITERATIONS
    now[0] = 10.0
    assert part.reason() is StopReason.TIME
    unlimited = Clock(Stop()).part(Stop())
    assert unlimited.reason() is None
    whole.interrupt()
    assert part.reason() is StopReason.INTERRUPTED and not unlimited.interrupted


def test_optimize_knows_panels_and_can_do_without(tmp_path):
    x, y = planted(*board(35), 3, 2)
    holes = "".join(f"X{a}Y{b}\n" for a, b in zip(x.tolist(), y.tolist(), strict=True))
    path = tmp_path / "panel.drl"
    path.write_text(f"M48\nMETRIC,TZ\nT1C.001\n%\nT1\n{holes}M30\n")
    news: list[str] = []
    program = read_drilling(path)
    for panels in (True, False):
        wishes = Wishes(effort=Effort.FAST, time_limit=0.3, panels=panels)
        board_ = optimise(program, wishes, news=lambda t, i, p: news.append(p.note))
        assert board_.costs_after.total < board_.costs_before.total
        assert ("panel" in news) == panels
        news.clear()
