"""Start tours: complete, lawful, locally optimal, the same every time, and uncompiled."""

from __future__ import annotations

import subprocess
import sys
from itertools import combinations, pairwise

import numpy as np
import pytest

from tcp import Ends, Instance, Rules, Workpiece
from tcp.heuristics.start import SMALL, start_tour


def board(n, seed=0, **how):
    points = np.random.default_rng(seed).integers(0, 50, (n, 2)).tolist()
    return Instance(Workpiece.from_decimals(f"board{n}", points), **how)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 8, 30, SMALL + 20])
@pytest.mark.parametrize("closed", [False, True])
def test_every_node_once_and_the_rules_kept(n, closed):
    rules = Rules(together=((0, 5), (5, 2)), forbidden=((1, 3), (4, 6))) if n > 7 else Rules()
    form = board(n, ends=Ends(start=0, closed=closed), rules=rules).form
    tour = start_tour(form)
    assert sorted(tour) == list(range(form.size))
    used = {(min(p), max(p)) for p in pairwise([*tour, tour[0]])}
    if form.size > 3:
        assert used >= set(form.forced) and not used & set(form.forbidden)
    assert tour == start_tour(form)


def test_no_tour_is_claimed_where_there_is_none():
    everyone = Rules(forbidden=tuple((0, i) for i in range(1, 9)))
    assert start_tour(board(9, rules=everyone).form) is None
    assert start_tour(board(SMALL + 1, rules=Rules(together=((0, 1), (1, 2), (2, 0)))).form) is None


@pytest.mark.parametrize("seed", range(6))
def test_no_exchange_of_two_edges_and_no_carried_hole_is_better(seed):
    form = board(12, seed).form
    tour = start_tour(form)
    cost = form.tour_cost(tour)
    for i, j in combinations(range(form.size + 1), 2):
        assert form.tour_cost([*tour[:i], *tour[i:j][::-1], *tour[j:]]) >= cost
        moved = [*tour[:i], *tour[i + 1 :]]
        assert form.tour_cost([*moved[:j], *tour[i : i + 1], *moved[j:]]) >= cost


@pytest.mark.parametrize("solver", ["cp-sat", "milp"])
def test_small_workpieces_load_no_compiler(solver):
    program = (
        "import sys, tcp; points = [(i * i % 7, i) for i in range(30)];"
        "w = tcp.Workpiece.from_decimals('w', points);"
        f"r = tcp.solve(tcp.Instance(w), {solver!r}, exact=True);"
        "assert r.status == 'optimal' and 'numba' not in sys.modules, r.solver"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=120)
