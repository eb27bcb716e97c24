"""The route engine: valid, exact in its books, complete inside its lists, the same every time."""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest

from tcp import Ends, Instance, Model, Rules, Travel, Workpiece
from tcp.heuristics.local_search import improve, respects
from tcp.result import Status
from tcp.solve import solve
from tcp.stop import Clock, Stop

HOME = (Fraction(-3), Fraction(5, 2))
ENDS = [
    Ends(),
    Ends(start=1),
    Ends(end=2),
    Ends(start=0, end=3),
    Ends(closed=True),
    Ends(home=HOME, outward=True),
    Ends(home=HOME, back=True),
    Ends(home=HOME, outward=True, back=True),
    Ends(home=HOME, outward=True, start=1),
    Ends(home=HOME, outward=True, back=True, start=3, end=0),
]
MODELS = [Model.SEQUENTIAL, Model.SIMULTANEOUS, Model.EUCLIDEAN]


def scattered(n: int, seed: int = 0, side: int = 1000) -> Workpiece:
    rng = np.random.default_rng(seed)
    x, y = rng.integers(0, side, (2, n))
    return Workpiece(f"random{n}", tuple(map(str, range(n))), x, y)


def lattice(rows: int, columns: int) -> Workpiece:
    y, x = (v.ravel().astype(np.int64) for v in np.mgrid[:rows, :columns])
    return Workpiece("lattice", tuple(map(str, range(x.size))), x * 10, y * 10)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 7, 8, 9, 11])
@pytest.mark.parametrize("ends", ENDS, ids=str)
def test_every_size_and_kind_of_ends(n, ends):
    if max(ends.start or 0, ends.end or 0) >= n:
        return
    instance = Instance(scattered(n), ends=ends)
    result = solve(instance, "local-search", seed=1)
    assert result.status is Status.FEASIBLE
    if n <= 5:
        best = min(
            instance.cost(order)
            for order in itertools.permutations(range(n))
            if (ends.start in (None, order[0])) and (ends.end in (None, order[-1]))
        )
        assert result.cost == best


@pytest.mark.parametrize("ends", ENDS, ids=str)
@pytest.mark.parametrize("model", MODELS)
def test_small_boards_are_solved_to_optimality(ends, model):
    instance = Instance(scattered(11, seed=5), Travel(model), ends)
    assert solve(instance, "local-search").cost == solve(instance, "held-karp").cost


def test_a_given_tour_is_never_worsened_and_rules_are_kept():
    rules = Rules(forbidden=((0, 1), (2, 3), (4, 5)), together=((6, 70), (8, 90), (9, 8)))
    form = Instance(scattered(100), ends=Ends(start=5), rules=rules).form
    rng, clock = np.random.default_rng(3), Clock(Stop())
    tour = improve(form, None, rng=rng, clock=clock, kicks=50)
    assert respects(form, tour)
    again = improve(form, tour, rng=rng, clock=clock, kicks=50)
    assert respects(form, again)
    assert form.tour_cost(again) <= form.tour_cost(tour)


def test_rules_without_a_route_are_infeasible():
    for together in (((0, 1), (1, 2), (0, 2)), ((0, 1), (0, 2), (0, 3))):
        instance = Instance(scattered(9), rules=Rules(together=together))
        assert solve(instance, "local-search").status is Status.INFEASIBLE
    triangle = Instance(scattered(3), rules=Rules(forbidden=((0, 1), (0, 2))))
    assert solve(triangle, "local-search").status is Status.INFEASIBLE


def test_the_same_seed_gives_the_same_route():
    instance = Instance(scattered(300))
    stop = Stop(iterations=500)
    first, second = (solve(instance, "local-search", stop=stop, seed=7) for _ in range(2))
    assert first.route == second.route
