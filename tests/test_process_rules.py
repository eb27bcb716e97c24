"""Axis balance, axis runs and jumps: their meaning, the judge, the exact models, the front."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Balance, Ends, Instance, Model, Rules, Status, Travel, Workpiece, solve
from tcp.cli.main import main
from tcp.errors import Exit, UsageError
from tcp.exact.pareto import front, weighted
from tcp.files import read
from tcp.rules import long_runs, unbalanced
from tcp.validate.route import faults

HALF = Fraction(1, 2)


def board(seed: int, n: int, size: int = 5) -> Workpiece:
    rng = np.random.default_rng(seed)
    return Workpiece.from_decimals("board", rng.integers(0, size, size=(n, 2)).tolist())


def penalty_by_hand(instance: Instance, route: tuple[int, ...]) -> int:
    """The rule as its docstring says it, one window at a time, in fractions."""
    rule, piece = instance.rules.balance, instance.workpiece
    places = [(piece.hole(h).x, piece.hole(h).y) for h in route]
    moves = [(abs(a - c), abs(b - d)) for (a, b), (c, d) in itertools.pairwise(places)]
    count = 0
    for first in range(len(moves) - rule.window + 1):
        dx, dy = map(sum, zip(*moves[first : first + rule.window], strict=True))
        count += not rule.low * dy <= dx <= rule.high * dy
    return count


def runs_by_hand(instance: Instance, route: tuple[int, ...]) -> int:
    """Longest run of moves along one axis."""
    piece, longest, run, before = instance.workpiece, 0, 0, ""
    for i, j in itertools.pairwise(route):
        dx, dy = piece.x[i] != piece.x[j], piece.y[i] != piece.y[j]
        axis = "x" if dx and not dy else "y" if dy and not dx else ""
        run = run + 1 if axis and axis == before else int(bool(axis))
        longest, before = max(longest, run), axis
    return longest


@given(st.integers(0, 10**6), st.integers(1, 9), st.integers(1, 4), st.booleans())
@settings(max_examples=100, deadline=None)
def test_penalty_and_runs_are_what_the_rules_say(seed, n, window, narrow):
    rule = Balance(window, Fraction(3, 4) if narrow else HALF, Fraction(4, 3))
    instance = Instance(board(seed, n), rules=Rules(balance=rule))
    route = tuple(np.random.default_rng(seed).permutation(n).tolist())
    assert instance.penalty(route) == penalty_by_hand(instance, route)
    x, y = instance.workpiece.x[list(route)], instance.workpiece.y[list(route)]
    longest = runs_by_hand(instance, route)
    for most in range(1, 5):
        assert bool(long_runs(x, y, most)) == (longest > most)


def test_windows_are_named_by_their_first_move():
    x, y = np.array([0, 4, 8, 8, 8]), np.array([0, 0, 0, 4, 8])
    assert unbalanced(x, y, Balance(2)).tolist() == [0, 2]
    assert unbalanced(x, y, Balance(4)).tolist() == []
    assert unbalanced(x, y, Balance(9)).tolist() == []
    assert long_runs(x, y, 1) == [(0, 2), (2, 2)]


@pytest.mark.parametrize(
    "make",
    [
        lambda: Balance(0),
        lambda: Balance(low=Fraction(3)),
        lambda: Balance(low=Fraction(-1)),
        lambda: Balance(most=-1),
        lambda: Rules(axis_run=0),
    ],
)
def test_rules_that_make_no_sense_are_refused(make):
    with pytest.raises(UsageError):
        make()


def test_the_judge_sees_the_rules():
    piece = Workpiece.from_decimals("row", [(x, 0) for x in range(6)])
    instance = Instance(piece, rules=Rules(axis_run=4, balance=Balance(5, most=0)))
    found = faults(instance, range(6))
    assert len(found) == 2
    assert "5 successive moves from hole 1 on follow one axis, more than 4" in found[0]
    assert "1 windows of 5 moves are unbalanced, more than 0" in found[1]
    assert not faults(Instance(piece, rules=Rules(axis_run=5)), range(6))


def test_jumps_in_diameters_forbid_near_pairs():
    piece = Workpiece.from_decimals(
        "dense",
        [("0", "0"), ("1", "0"), ("2", "0"), ("9", "0")],
        diameters=[Fraction(1, 10), Fraction(3, 10), None, Fraction(1, 10)],
    )
    instance = Instance(piece, rules=Rules(jump_diameters=Fraction(5)))
    assert instance.form.forbidden == ((0, 1), (1, 2))
    assert Instance(piece, rules=Rules(jump_diameters=Fraction(3))).form.forbidden == ()
    bare = Instance(board(1, 5), rules=Rules(jump_diameters=Fraction(5)))
    assert bare.form.forbidden == ()


def test_hashes_change_only_with_rules_that_are_there():
    plain = Instance(board(1, 5))
    assert Instance(board(1, 5), rules=Rules()).sha256 == plain.sha256
    kinds = [Rules(axis_run=3), Rules(balance=Balance()), Rules(balance=Balance(most=1))]
    kinds.append(Rules(jump_diameters=Fraction(2)))
    hashes = {Instance(board(1, 5), rules=rules).sha256 for rules in kinds}
    assert len(hashes | {plain.sha256}) == 5


@pytest.mark.parametrize(
    "rules",
    [
        Rules(min_jump=Fraction(1)),
        Rules(jump_diameters=Fraction(2)),
        Rules(balance=Balance()),
        Rules(axis_run=3),
    ],
)
def test_rules_about_places_need_places(rules):
    matrix = np.ones((3, 3), dtype=np.int64) - np.eye(3, dtype=np.int64)
    nowhere = Workpiece.from_decimals("matrix", [(0, 0)] * 3)
    with pytest.raises(UsageError, match="matrix states no places"):
        Instance(replace(nowhere, matrix=matrix), Travel(Model.EXPLICIT), rules=rules)
    placed = Workpiece.from_decimals("placed", [(0, 0), (1, 0), (1, 2)])
    Instance(replace(placed, matrix=matrix), Travel(Model.EXPLICIT), rules=rules)


def test_solvers_that_do_not_know_rules_about_moves_refuse():
    instance = Instance(board(3, 6), rules=Rules(axis_run=2))
    for name in ("held-karp", "cp-sat", "htga", "cuckoo"):
        with pytest.raises(UsageError, match="axis run, balance"):
            solve(instance, name)
    result = solve(instance, exact=True)
    assert result.solver == "positions"


def test_auto_seeks_a_route_with_rules_about_moves_on_boards_too_large_for_a_proof():
    instance = Instance(board(2, 40, 30), rules=Rules(axis_run=3))
    result = solve(instance)
    assert result.solver == "bmga" and not faults(instance, result.route)
    assert "last resort" in result.details["auto"]
    assert "refused by branch-and-cut, cp-sat, held-karp: it does" in result.details["auto"]
    for proof in ({"exact": True}, {"certificate": "wp.json"}):
        with pytest.raises(UsageError, match="no solver takes board"):
            solve(instance, **proof)


def test_counting_without_a_limit_needs_no_special_solver():
    instance = Instance(board(3, 7), rules=Rules(balance=Balance(3)))
    result = solve(instance, "held-karp")
    assert result.details["unbalanced"] == penalty_by_hand(instance, result.route)


def best(instance: Instance) -> int | None:
    routes = itertools.permutations(range(len(instance)))
    return min((instance.cost(r) for r in routes if not faults(instance, r)), default=None)


ENDS = [
    Ends(),
    Ends(start=1),
    Ends(start=0, end=2),
    Ends(closed=True),
    Ends(home=(Fraction(-1), HALF), outward=True),
    Ends(home=(Fraction(-1), HALF), outward=True, back=True, end=1),
]


@pytest.mark.parametrize("seed", range(12))
def test_the_position_model_is_exact_with_rules_about_moves(seed):
    rng = np.random.default_rng(seed)
    rules = Rules(
        axis_run=int(rng.integers(1, 4)) if seed % 2 else None,
        balance=Balance(int(rng.integers(1, 4)), most=int(rng.integers(0, 4))),
    )
    instance = Instance(board(seed, 6, 4), ends=ENDS[seed % len(ENDS)], rules=rules)
    truth, result = best(instance), solve(instance, exact=True)
    assert result.cost == truth
    assert result.status is (Status.INFEASIBLE if truth is None else Status.OPTIMAL)


def test_a_balance_rule_is_solved_or_refused_whatever_its_numbers():
    piece = board(5, 5)
    free = Instance(piece, rules=Rules(balance=Balance(2, most=10**30)))
    assert solve(free, "positions").cost == best(free)
    for low, high in ((Fraction(0), Fraction(10**25)), (Fraction(1, 10**25), Fraction(10**9))):
        instance = Instance(piece, rules=Rules(balance=Balance(2, low, high, most=0)))
        with pytest.raises(UsageError, match="too many digits"):
            solve(instance, exact=True)
    rules = Rules(forbidden=((0, 1),), balance=Balance(1, most=0))
    alone = Instance(board(1, 2), rules=rules)
    assert solve(alone, "positions").status is Status.INFEASIBLE


def test_auto_and_the_front_pass_on_costs_too_fine_for_a_double():
    far = [(0, 0), (10**15, 1), (3 * 10**15, 10**15)]
    rules = Rules(balance=Balance(1, most=1))
    instance = Instance(Workpiece.from_decimals("far", far), rules=rules)
    with pytest.raises(UsageError, match="refused by positions: its bounds are exact"):
        solve(instance, exact=True)
    with pytest.raises(UsageError, match="its bounds are exact"):
        front(instance)


def wide_board(seed: int) -> Instance:
    """Six holes far apart on a fine grid, ratios of many digits: large coefficients."""
    rng = np.random.default_rng(seed)
    points = rng.integers(0, 10 ** rng.integers(5, 9), (6, 2)).tolist()
    low, high = (
        Fraction(int(rng.integers(*span)), 10**4) for span in ((3000, 9000), (11000, 30000))
    )
    rule = Balance(2, low, high, most=int(rng.integers(2)))
    return Instance(Workpiece.from_decimals("wide", points), rules=Rules(balance=rule))


@pytest.mark.parametrize("seed", [*range(10), 14, 16, 20, 22, 36])
def test_the_position_model_is_exact_on_wide_boards(seed):
    """OR-Tools 9.15 adds up coefficients in 32 bits when it presolves (its issue 5293)."""
    instance = wide_board(seed)
    truth, result = best(instance), solve(instance, "positions")
    assert result.cost == truth
    assert result.status is (Status.INFEASIBLE if truth is None else Status.OPTIMAL)


def test_a_shorter_route_that_presolve_lost():
    lines = ["156.025 972.022", "990.745 413.435", "460.846 643.531"]
    lines += ["470.254 191.650", "656.595 918.527", "772.503 926.801"]
    piece = Workpiece.from_decimals("lost", [tuple(line.split()) for line in lines])
    rule = Balance(2, Fraction("0.56"), Fraction("2.27"), most=1)
    instance = Instance(piece, rules=Rules(balance=rule))
    assert solve(instance, exact=True).cost == best(instance) == 2_613_420
    assert [(p.cost, p.penalty) for p in front(instance)] == front_by_hand(instance)


def front_by_hand(instance: Instance) -> list[tuple[int, int]]:
    """All non-dominated (cost, penalty) pairs by looking at every route."""
    routes = itertools.permutations(range(len(instance)))
    allowed = (r for r in routes if not faults(instance, r))
    pairs = {(instance.cost(r), penalty_by_hand(instance, r)) for r in allowed}
    return sorted(
        p for p in pairs if not any(q != p and q[0] <= p[0] and q[1] <= p[1] for q in pairs)
    )


@pytest.mark.parametrize("seed", range(6))
def test_the_front_is_that_of_all_routes(seed):
    rule = Balance(2, Fraction(2, 3), Fraction(3, 2))
    instance = Instance(board(seed, 6, 9), ends=ENDS[seed], rules=Rules(balance=rule))
    points, truth = front(instance), front_by_hand(instance)
    assert [(p.cost, p.penalty) for p in points] == truth
    for weight in (0, 1, 3, 10, 1000):
        least = min(cost + weight * penalty for cost, penalty in truth)
        point = weighted(points, weight)
        assert point.cost + weight * point.penalty == least


def test_a_limit_caps_the_front_and_nonsense_is_refused():
    rule = Balance(2, Fraction(2, 3), Fraction(3, 2))
    instance = Instance(board(2, 6, 9), rules=Rules(balance=rule))
    points = front(instance)
    assert len(points) > 1
    most = points[-1].penalty
    capped = replace(instance, rules=Rules(balance=replace(rule, most=most)))
    assert [(p.cost, p.penalty) for p in front(capped)] == [(points[-1].cost, most)]
    with pytest.raises(UsageError, match="balance rule"):
        front(Instance(board(2, 6)))
    with pytest.raises(UsageError, match="0 or more"):
        weighted(points, -1)


def test_the_front_of_workpiece_1_is_proved(pytestconfig):
    piece = read(pytestconfig.rootpath / "data" / "wp1.csv").workpiece
    points = front(Instance(piece, rules=Rules(balance=Balance(4))))
    assert points[0].cost == solve(Instance(piece), "held-karp").cost
    costs, penalties = [p.cost for p in points], [p.penalty for p in points]
    assert costs == sorted(set(costs)) and penalties == sorted(set(penalties), reverse=True)


def test_the_command_prints_the_front(tmp_path):
    path = tmp_path / "board.csv"
    path.write_text("id,x,y\n" + "\n".join(f"h{k},{k * k % 7},{3 * k % 5}" for k in range(6)))
    words = ["pareto", str(path), "--balance", "2,2/3,1.5"]
    plain = CliRunner().invoke(main, [*words, "--weight", "1000"])
    assert plain.exit_code == 0, plain.output
    assert "proved point(s)" in plain.output and "<- least weighted sum" in plain.output
    data = json.loads(CliRunner().invoke(main, [*words, "--json"]).output)
    times = [Fraction(p["time"]) for p in data["front"]]
    assert times == sorted(times) and len(data["front"][0]["route"]) == 6
    for wrong in ("2,2", "x,1,2", "2,1,2,x", "2,2,1"):
        assert CliRunner().invoke(main, ["pareto", str(path), "--balance", wrong]).exit_code == 2


def test_a_front_without_any_route_ends_in_4(tmp_path):
    path = tmp_path / "row.csv"
    path.write_text("x,y\n0,0\n1,0\n2,0\n3,0\n")
    done = CliRunner().invoke(main, ["pareto", str(path), "--axis-run", "2"])
    assert done.exit_code == Exit.INFEASIBLE and "no route keeps the rules" in done.output


def test_solve_takes_the_rules_from_the_command_line(tmp_path):
    path = tmp_path / "row.csv"
    path.write_text("x,y\n0,0\n1,0\n2,0\n3,0\n4,1\n")
    words = ["solve", str(path), "--axis-run", "2", "--balance", "3,0,9,9", "--exact", "--json"]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
    data = json.loads(done.output)
    assert data["solver"] == "positions" and data["proof"] == "trusted"
    assert CliRunner().invoke(main, [*words, "--solver", "cp-sat"]).exit_code == 2


def test_what_options_say_of_holes_has_to_be_in_the_file(tmp_path):
    path = tmp_path / "four.csv"
    path.write_text("id,x,y\na,0,0\nb,1,0\nc,2,0\nd,3,1\n")
    done = CliRunner().invoke(main, ["info", str(path), "--jump-diameters", "2"])
    assert done.exit_code == 2 and "four states no diameters" in done.output
    done = CliRunner().invoke(main, ["info", str(path), "--start", "e"])
    assert done.exit_code == 2 and "has no hole 'e'; its ids are a, b, c ... d\n" in done.output
