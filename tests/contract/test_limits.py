"""Stops are obeyed and cost nothing: the best route so far and a valid bound come back."""

from __future__ import annotations

import os
import signal
import subprocess

import numpy as np
import pytest

from tcp import Ends, Instance, Rules, Status, Stop, StopReason, Workpiece, solve
from tcp.solve import SOLVERS
from tcp.validate.route import faults

MARGIN = 1.5
"""Seconds past its limit that a solver may take to build its model and to come back."""


def random_board(n: int, seed: int = 5) -> Instance:
    points = np.random.default_rng(seed).integers(0, 1000, (n, 2))
    return Instance(Workpiece.from_decimals(f"random{n}", [(int(x), int(y)) for x, y in points]))


def hard(variant) -> Instance:
    """More than the solver can do in a second."""
    name, options = variant
    compact = options.get("formulation") in ("mtz", "flow")
    small = {"held-karp": 22, "positions": 22}  # neither takes a hundred holes
    return random_board(18 if compact else small.get(name, 120))


def check(result, instance):
    assert result.status in (Status.OPTIMAL, Status.FEASIBLE)
    assert faults(instance, result.route) == []
    if SOLVERS[result.solver].exact:
        assert 0 <= result.bound <= result.cost


def test_a_time_limit_is_respected(variant):
    name, options = variant
    solve(random_board(6), name, **options)  # imports and compiles
    instance = hard(variant)
    result = solve(instance, name, stop=Stop(time=0.3), **options)
    check(result, instance)
    assert result.seconds < 0.3 + MARGIN
    assert result.stopped is StopReason.TIME or result.seconds < 0.3 or not SOLVERS[name].exact


def test_no_time_at_all_still_gives_a_valid_answer(prover):
    name, options = prover
    instance = random_board(15)
    check(solve(instance, name, stop=Stop(time=0), **options), instance)


def test_ctrl_c_returns_the_best_so_far(prover):
    name, options = prover
    solve(random_board(6), name, **options)
    instance = hard(prover)
    before = signal.signal(signal.SIGINT, lambda *_: None)  # if it comes when all is over
    sender = subprocess.Popen(["sh", "-c", f"sleep 0.4; kill -INT {os.getpid()}"])
    try:
        result = solve(instance, name, stop=Stop(time=30), **options)
    finally:
        sender.wait()
        signal.signal(signal.SIGINT, before)
    check(result, instance)
    assert result.seconds < 0.4 + 2 * MARGIN
    assert result.stopped is StopReason.INTERRUPTED or result.status is Status.OPTIMAL


def test_the_same_seed_gives_the_same_route(variant):
    name, options = variant
    instance = random_board(14)
    first, second = (solve(instance, name, seed=3, **options) for _ in range(2))
    assert (first.route, first.bound) == (second.route, second.bound)


@pytest.mark.parametrize("gap", [0.05, 0.5])
def test_a_gap_that_is_good_enough_ends_the_search(prover, gap):
    name, options = prover
    instance = random_board(14)
    result = solve(instance, name, stop=Stop(gap=gap), **options)
    check(result, instance)
    assert result.gap <= gap


def test_news_only_improves_and_agrees_with_the_result(prover):
    name, options = prover
    news = []
    result = solve(random_board(14), name, report=news.append, **options)
    costs = [n.cost for n in result.trace if n.cost is not None]
    bounds = [n.bound for n in result.trace if n.bound is not None]
    assert costs and costs == sorted(costs, reverse=True) and costs[-1] >= result.cost
    assert bounds == sorted(bounds) and (not bounds or bounds[-1] <= result.bound)
    assert set(result.trace) <= set(news)


def test_rules_hold_on_larger_boards(prover):
    name, options = prover
    rules = Rules(together=((0, 7), (3, 4)), forbidden=((1, 2), (5, 6)))
    ends = Ends(start=2, closed=False)
    instance = Instance(random_board(13).workpiece, ends=ends, rules=rules)
    result = solve(instance, name, **options)
    assert result.status is Status.OPTIMAL
    assert result.cost == solve(instance, "held-karp").cost
