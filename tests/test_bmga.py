"""BMGA: operators, substrates, joining, rules, and its optimum against the exact front."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Balance, Ends, Instance, Rules, Stop, StopReason, Workpiece, solve
from tcp.errors import UsageError
from tcp.exact.pareto import front, weighted
from tcp.files import read
from tcp.heuristics import bmga
from tcp.heuristics.orders import part
from tcp.heuristics.substrates import join, substrates
from tcp.validate.route import faults

QUICK = {"np": 10, "epoch": 10, "stall": 3}
HOME = (Fraction(-3), Fraction(1, 2))


def board(seed: int, n: int, size: int = 200) -> Workpiece:
    rng = np.random.default_rng(seed)
    return Workpiece.from_decimals("board", rng.integers(0, size, size=(n, 2)).tolist())


def panel() -> Workpiece:
    """Six copies of a random pattern, far from each other."""
    rng = np.random.default_rng(0)
    pattern = rng.integers(0, 50, size=(40, 2))
    places = [(x + 1000 * i, y + 1000 * j) for i in range(3) for j in range(2) for x, y in pattern]
    return Workpiece.from_decimals("panel", [(int(x), int(y)) for x, y in places])


# --- operators --------------------------------------------------------------


@given(st.integers(0, 10**6), st.integers(2, 12), st.booleans())
@settings(max_examples=60, deadline=None)
def test_crossover_keeps_places_of_one_parent_and_the_sequence_of_the_other(seed, m, uniform):
    rng = np.random.default_rng(seed)
    genes = np.array([rng.permutation(m), rng.permutation(m), np.zeros(m)], dtype=np.int32)
    mask, used = np.zeros(m, dtype=bool), np.zeros(m, dtype=bool)
    bmga._choose(rng, mask, uniform, 4)
    bmga._cross(genes, 0, 1, 2, mask, used)
    child = genes[2]
    assert sorted(child) == list(range(m))
    assert np.array_equal(child[mask], genes[0][mask])
    kept = set(genes[0][mask].tolist())
    assert child[~mask].tolist() == [g for g in genes[1].tolist() if g not in kept]


def test_multi_point_crossover_has_few_stretches():
    rng = np.random.default_rng(1)
    mask = np.zeros(100, dtype=bool)
    for _ in range(20):
        bmga._choose(rng, mask, False, 4)
        assert np.count_nonzero(np.diff(mask)) <= 4


@given(st.integers(0, 10**6), st.integers(4, 12), st.integers(1, 5), st.integers(0, 3))
@settings(max_examples=60, deadline=None)
def test_the_kernels_price_is_travel_windows_and_runs(seed, n, window, run):
    rule = Balance(window, Fraction(3, 4), Fraction(4, 3))
    rules = Rules(balance=rule, axis_run=run or None)
    instance = Instance(board(seed, n, 6), rules=rules)
    problem = part(instance, range(n))
    order = np.random.default_rng(seed).permutation(n).astype(np.int32)
    x, y = (v.astype(float) for v in (instance.workpiece.x, instance.workpiece.y))
    limits = np.array([window, 0.75, float(Fraction(4, 3)), run])
    price = np.array([1000, 10**6])
    value = bmga._value(order, problem.legs, x, y, limits, price)
    assert value % 1000 == instance.cost(order) % 1000
    assert value % 10**6 // 1000 == instance.penalty(order) + instance.cost(order) // 1000
    assert (value >= 10**6) == any("follow one axis" in f for f in faults(instance, order))


def test_first_paths_are_nearest_neighbours():
    problem = part(Instance(board(3, 20)), range(20))
    genes = np.zeros((6, 20), dtype=np.int32)
    bmga._near_paths(np.random.default_rng(0), problem.legs, genes, 6, 1)
    for path in genes:
        assert sorted(path) == list(range(20))
        for k in range(19):
            legs = [problem.legs[path[k], g] for g in path[k + 1 :]]
            assert legs[0] == min(legs)
    bmga._near_paths(np.random.default_rng(0), problem.legs, genes, 6, 3)
    assert all(sorted(path) == list(range(20)) for path in genes)


# --- substrates and joining -------------------------------------------------


def test_a_panel_falls_into_its_boards():
    groups = substrates(Instance(panel()), range(240), 3, 3.0, 200)
    assert [len(g) for g in groups] == [40] * 6
    assert all(len({h // 40 for h in group}) == 1 for group in groups)


@given(st.integers(0, 10**6), st.integers(1, 60), st.integers(2, 20), st.floats(0.1, 5))
@settings(max_examples=40, deadline=None)
def test_substrates_partition_the_holes_and_joins_are_routes(seed, n, most, ratio):
    ends = [Ends(), Ends(start=0), Ends(home=HOME, outward=True), Ends(end=n - 1)][seed % 4]
    instance = Instance(board(seed, n), ends=ends)
    free = [h for h in range(n) if h not in (ends.start, ends.end)] or [0]
    groups = substrates(instance, free, 3, ratio, most)
    assert sorted(h for g in groups for h in g) == free
    assert all(len(g) <= max(most, 3) for g in groups)
    if len(free) == n - (ends.start is not None) - (ends.end is not None):
        assert not faults(instance, join(instance, groups))


def test_joining_goes_on_to_the_nearest_end_and_turns_paths():
    piece = Workpiece.from_decimals("row", [(x, 0) for x in range(6)])
    instance = Instance(piece, ends=Ends(start=0))
    assert join(instance, [(5, 4), (3, 2, 1)]) == (0, 1, 2, 3, 4, 5)
    assert instance.cost(join(Instance(piece), [(5, 4), (3, 2), (0, 1)])) == 5


# --- the search -------------------------------------------------------------


@pytest.mark.parametrize("how", [{}, {"clusters": False}, {"crossover": "points"}])
def test_boards_are_routed_and_get_better(how):
    instance = Instance(panel(), ends=Ends(start=7))
    result = solve(instance, "bmga", **QUICK, **how, weight=0.0)
    assert not faults(instance, result.route)
    assert result.details["substrates"] == (1 if how.get("clusters") is False else 6)
    first = result.trace[0].cost
    assert result.cost <= first


def test_same_seed_same_route():
    runs = [solve(Instance(panel()), "bmga", seed=s, **QUICK) for s in (3, 3, 4)]
    assert runs[0].route == runs[1].route != runs[2].route


def test_rules_of_the_instance_are_kept():
    plain = Instance(board(5, 60, 12))
    before = solve(plain, "bmga", **QUICK)
    rules = Rules(min_jump=Fraction(3), axis_run=2, balance=Balance(6, most=10))
    ruled = Instance(plain.workpiece, rules=rules)
    assert faults(ruled, before.route)
    result = solve(ruled, "bmga", stop=Stop(time=20), np=30, epoch=100, weight=3.0)
    assert result.route is not None and not faults(ruled, result.route)
    everything = tuple((i, j) for i in range(8) for j in range(i))
    nothing = Instance(board(5, 8), rules=Rules(forbidden=everything))
    assert solve(nothing, "bmga", **QUICK).route is None


def test_a_heavy_weight_buys_balance():
    instance = Instance(board(11, 40), rules=Rules(balance=Balance(4)))
    light = solve(instance, "bmga", np=30, epoch=50, weight=0.0)
    heavy = solve(instance, "bmga", np=30, epoch=50, weight=20.0)
    assert heavy.details["unbalanced"] < light.details["unbalanced"]


def test_workpiece_1_is_judged_against_the_proved_front(pytestconfig):
    piece = read(pytestconfig.rootpath / "data" / "wp1.csv").workpiece
    instance = Instance(piece, rules=Rules(balance=Balance(4)))
    points = front(instance)
    result = solve(instance, "bmga", clusters=False, np=100, weight=1.0)
    value = (result.cost, instance.penalty(result.route))
    assert not any((p.cost, p.penalty) != value and p.cost <= value[0] and p.penalty <= value[1]
                   for p in points)  # fmt: skip
    assert weighted(points, 0).cost <= result.cost


def test_limits_are_heard_and_nonsense_is_refused():
    instance = Instance(panel())
    result = solve(instance, "bmga", stop=Stop(time=0.3), stall=10**6, trpi=0.0)
    assert result.stopped is StopReason.TIME and result.seconds < 1.5
    result = solve(instance, "bmga", stall=10**6, trpi=0.0, te=0.2)
    assert result.stopped is StopReason.TIME
    for wrong in ({"np": 1}, {"mr": 2.0}, {"crossover": "x"}, {"te": -1.0}, {"weight": 1e300}):
        with pytest.raises(UsageError, match="bmga"):
            solve(instance, "bmga", **wrong)


@pytest.mark.parametrize("clusters", [True, False])
def test_generations_and_solutions_are_those_made(clusters, monkeypatch):
    made, once = [], bmga._generations
    monkeypatch.setattr(bmga, "_generations", lambda *a: (made.append(a[-1]), once(*a))[1])
    for limit in (0, 7, 25, None):
        made.clear()
        result = solve(
            Instance(panel()), "bmga", **QUICK, clusters=clusters, stop=Stop(iterations=limit)
        )
        found, groups = result.details, 6 if clusters else 1
        assert found["evaluations"] == 10 * (sum(made) + groups)
        if limit is None:
            assert found["iterations"] < sum(made) or not clusters
        else:
            assert found["iterations"] == limit and sum(made) == limit * groups
            assert result.stopped is StopReason.ITERATIONS


def test_an_interrupted_epoch_counts_what_was_made_of_it():
    result = solve(Instance(panel()), "bmga", stop=Stop(time=0.2), epoch=10**6, clusters=False)
    assert result.stopped is StopReason.TIME and 0 < result.details["iterations"] < 10**6


def test_a_single_hole_stands_alone():
    far = [(0, 0), (1, 0), (0, 1), (1, 1), (9000, 9000), (5000, 0), (5001, 0)]
    instance = Instance(Workpiece.from_decimals("far", far))
    result = solve(instance, "bmga", **QUICK, ratio=0.5)
    assert not faults(instance, result.route)
    closed = replace(instance, ends=Ends(closed=True))
    assert not faults(closed, solve(closed, "bmga", **QUICK, ratio=0.5).route)
