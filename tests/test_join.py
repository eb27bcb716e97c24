"""Joining the edges of several tours: against all there are, and within the search."""

from __future__ import annotations

import itertools
from dataclasses import replace
from fractions import Fraction as F
from importlib import import_module

import numpy as np
import pytest

from tcp import Ends, Instance, Model, Rules, Stop, Travel, Workpiece, solve
from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.join import Core, join
from tcp.heuristics.local_search import improve, respects
from tcp.stop import Clock

KINDS = {
    "open": Ends(),
    "closed": Ends(closed=True),
    "fixed ends": Ends(start=0, end=5),
    "home and back": Ends(home=(F(-3), F(2)), outward=True, back=True),
    "home, then free": Ends(home=(F(-3), F(2)), outward=True),
}


def scattered(n, seed):
    rng = np.random.default_rng(seed)
    x, y = rng.integers(0, 100, (2, n))
    return Workpiece("scattered", tuple(map(str, range(n))), x, y)


def random_tours(form, count, rng, reach):
    """Tours that respect the forced edges, best first: a shortest one, disturbed."""
    best = np.array(improve(form, None, rng=rng, clock=Clock(Stop()), kicks=50), np.int64)
    found = [best]
    while len(found) < count:
        tour = best.copy()
        for _ in range(3):
            at, long = rng.integers(form.size), rng.integers(2, reach)
            tour = np.roll(tour, -at)
            tour[:long] = rng.permutation(tour[:long])
        if respects(form, tour.tolist()):
            found.append(tour)
    return sorted(found, key=form.tour_cost)


def edges(tour):
    return {(min(e), max(e)) for e in itertools.pairwise([*tour, tour[0]])}


def shortest_over(form, allowed, shared):
    """Cost of the shortest tour over some edges that has all the shared ones, by trying all."""
    near = {v: {a + b - v for a, b in allowed if v in (a, b)} for v in range(form.size)}
    best = []

    def extend(path, left):
        if not left:
            if path[0] in near[path[-1]] and shared <= edges(path) and respects(form, path):
                best.append(form.tour_cost(path))
            return
        for v in near[path[-1]] & left:
            extend([*path, v], left - {v})

    extend([0], set(range(1, form.size)))
    return min(best)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_no_tour_over_the_same_edges_with_all_shared_ones_is_shorter(kind, seed):
    travel = (Travel(), Travel(Model.SIMULTANEOUS), Travel(Model.EUCLIDEAN))[seed % 3]
    instance = Instance(scattered(12, seed), travel, KINDS[kind])
    form, rng = instance.form, np.random.default_rng(seed)
    tours = random_tours(form, 4, rng, 6)[1:]
    found = join(form, tours, Clock(Stop()), instance.granularity)
    used = [edges(t.tolist()) for t in tours]
    union, shared = set.union(*used), set.intersection(*used)
    assert sorted(found) == list(range(form.size))
    assert edges(found.tolist()) <= union
    assert respects(form, found.tolist())
    assert form.tour_cost(found) == shortest_over(form, union, shared)


def test_joining_makes_one_of_the_good_parts_of_two():
    instance = Instance(scattered(60, 5), Travel())
    form, rng = instance.form, np.random.default_rng(5)
    good = np.array(improve(form, None, rng=rng, clock=Clock(Stop()), kicks=6_000), np.int64)
    first, second = good.copy(), good.copy()
    first[5:9], second[30:34] = good[5:9][::-1].copy(), good[30:34][::-1].copy()
    first[12:15], second[40:43] = good[[13, 14, 12]], good[[42, 40, 41]]
    worse = sorted([first, second], key=form.tour_cost)
    assert form.tour_cost(worse[0]) > form.tour_cost(good)
    assert form.tour_cost(join(form, worse, Clock(Stop()))) <= form.tour_cost(good)


def test_forbidden_successions_stay_out():
    rules = Rules(forbidden=((0, 1), (2, 3), (4, 5)))
    instance = Instance(scattered(30, 9), Travel(), Ends(), rules)
    form = instance.form
    tours = random_tours(form, 5, np.random.default_rng(1), 8)
    found = join(form, tours, Clock(Stop()))
    assert respects(form, found.tolist())
    assert form.tour_cost(found) <= form.tour_cost(tours[0])


def test_equal_tours_leave_nothing_open():
    instance = Instance(scattered(40, 2), Travel())
    tour = np.random.default_rng(0).permutation(instance.form.size)
    assert join(instance.form, [tour, tour[::-1].copy()], Clock(Stop())) is tour


def test_shared_paths_come_back_in_either_direction():
    form = Instance(scattered(50, 3), Travel()).form
    tours = random_tours(form, 3, np.random.default_rng(3), 7)
    core = Core.of(Problem(form, 1), tours)
    assert 4 <= len(core.at) < form.size
    for tour in (core.start, core.start[::-1], np.roll(core.start, 5)):
        whole = core.expand(tour)
        assert sorted(whole) == list(range(form.size))
        assert edges(whole.tolist()) == edges(tours[0].tolist())


def test_a_matrix_of_costs_can_be_joined():
    rng = np.random.default_rng(4)
    costs = rng.integers(1, 1000, (20, 20))
    costs = costs + costs.T
    np.fill_diagonal(costs, 0)
    piece = replace(scattered(20, 4), matrix=costs)
    instance = Instance(piece, Travel(Model.EXPLICIT))
    tours = random_tours(instance.form, 4, rng, 8)[1:]
    found = join(instance.form, tours, Clock(Stop()))
    assert instance.form.tour_cost(found) <= instance.form.tour_cost(tours[0])


def test_no_time_gives_the_best_tour_back():
    form = Instance(scattered(60, 7), Travel()).form
    tours = random_tours(form, 4, np.random.default_rng(7), 9)
    found = join(form, tours, Clock(Stop(time=0.0)))
    assert form.tour_cost(found) == form.tour_cost(tours[0])


def test_the_search_joins_its_populations_and_takes_what_comes_of_it():
    instance = Instance(scattered(60, 1), Travel())
    form, heard = instance.form, []
    optimum = solve(instance, "branch-and-cut")
    best = np.array(instance.tour(optimum.route), np.int64)

    def known(tours, clock):
        heard.append([form.tour_cost(t) for t in tours])
        return best

    kicks = 9 * form.size
    tour = improve(
        form, None, rng=np.random.default_rng(0), clock=Clock(Stop()), kicks=kicks, join=known
    )
    assert form.tour_cost(tour) == optimum.cost
    assert len(heard) == 1 and heard[0] == sorted(heard[0]) and len(heard[0]) > 1


def test_joining_is_asked_of_the_engine_where_there_is_time(monkeypatch):
    module, asked = import_module("tcp.exact.join"), []
    monkeypatch.setattr(module, "join", lambda *a, **k: asked.append(a) or join(*a, **k))
    instance = Instance(scattered(60, 8), Travel())
    stop = Stop(time=30.0, target=0, iterations=600)
    for wanted in (False, True):
        solve(instance, "local-search", stop=stop, join=wanted)
        assert bool(asked) is wanted
    asked.clear()
    solve(instance, "local-search", stop=Stop(iterations=600))
    assert not asked
