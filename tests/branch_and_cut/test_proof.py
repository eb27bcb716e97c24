"""The arithmetic of proofs: any multipliers give a bound, and the filter misses no pair."""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Ends, Instance, Model, Rules, Travel, Workpiece
from tcp.exact.branch_and_cut.cuts import Cut
from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.branch_and_cut.proof import (
    Alive,
    Duals,
    Fixings,
    ceiling,
    scale_for,
    survivors,
    verdict,
)

TRAVELS = [
    Travel(),
    Travel(Model.SIMULTANEOUS, vx=Fraction(2)),
    Travel(Model.EUCLIDEAN),
    Travel(Model.TRAPEZOIDAL, ax=Fraction(2), ay=Fraction(3)),
]


def problem_of(seed: int, travel: Travel, rules: Rules | None = None) -> Problem:
    rng = np.random.default_rng(seed)
    piece = Workpiece.from_decimals("r", [(int(a), int(b)) for a, b in rng.integers(0, 30, (7, 2))])
    return Problem.of(Instance(piece, travel, Ends(), rules or Rules()))


def random_duals(problem: Problem, seed: int) -> Duals:
    rng, size = np.random.default_rng(seed), problem.size
    scale = int(rng.integers(1, 50))
    typical = scale * problem.peak
    cuts = []
    for _ in range(4):
        part = rng.choice(size, int(rng.integers(2, size - 1)), replace=False)
        cuts.append((Cut.of([part]), 2, int(rng.integers(1, typical // 4 + 2))))
    return Duals(rng.integers(-typical // 4, typical // 2 + 1, size), tuple(cuts), scale)


def reduced(problem: Problem, duals: Duals, i: int, j: int) -> int:
    rc = duals.scale * problem.form.cost(i, j) - int(duals.pi[i]) - int(duals.pi[j])
    for cut, _, y in duals.cuts:
        rc -= y * sum((i in part) != (j in part) for part in cut.sets)
    return rc


def tours(problem: Problem) -> list[tuple[int, ...]]:
    orders = itertools.permutations(range(1, problem.size))
    found = ((0, *order) for order in orders if order[0] < order[-1])
    banned, wanted = set(problem.form.forbidden), set(problem.form.forced)
    kept = []
    for tour in found:
        used = {tuple(sorted(p)) for p in itertools.pairwise((*tour, 0))}
        if wanted <= used and not banned & used:
            kept.append(tour)
    return kept


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), travel=st.sampled_from(TRAVELS), ruled=st.booleans())
def test_any_multipliers_bound_every_tour(seed, travel, ruled):
    rules = Rules(forbidden=((0, 1), (2, 5)), together=((3, 4),)) if ruled else None
    problem = problem_of(seed, travel, rules)
    duals = random_duals(problem, seed)
    pairs = list(itertools.combinations(range(problem.size), 2))
    truth = duals.constant
    for i, j in pairs:
        key = i * problem.size + j
        rc = reduced(problem, duals, i, j)
        if key in problem.forced:
            truth += rc
        elif key not in problem.forbidden:
            truth += min(rc, 0)
    fixings = Fixings.root(problem)
    everything = verdict(problem, duals, fixings, Alive.everything())
    assert everything.scaled == truth
    keys = np.array(sorted(i * problem.size + j for i, j in pairs))
    listed = verdict(problem, duals, fixings, Alive.of(problem, keys))
    assert listed.scaled == truth
    found = set(zip(everything.i.tolist(), everything.j.tolist(), strict=True))
    negative = {p for p in pairs if reduced(problem, duals, *p) < 0}
    decided = {divmod(int(k), problem.size) for k in (*problem.forced, *problem.forbidden)}
    assert found == negative - decided
    assert list(everything.rc) == sorted(everything.rc)
    best = min(problem.form.tour_cost(t) for t in tours(problem))
    assert duals.scale * best >= truth


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6), travel=st.sampled_from(TRAVELS), more=st.integers(0, 60))
def test_eliminated_pairs_are_in_no_cheap_tour(seed, travel, more):
    problem = problem_of(seed, travel)
    duals = random_duals(problem, seed)
    scaled = verdict(problem, duals, Fixings.root(problem), Alive.everything()).scaled
    every = tours(problem)
    need = min(problem.form.tour_cost(t) for t in every) + more
    found = survivors(problem, duals, scaled, need, Alive.everything(), 10**6)
    assert found is not None
    for tour in every:
        if problem.form.tour_cost(tour) <= need:
            used = problem.keys(np.array(tour), np.roll(np.array(tour), -1))
            assert np.isin(used, found.kept).all()
    pairs = itertools.combinations(range(problem.size), 2)
    below = {i * problem.size + j for i, j in pairs if reduced(problem, duals, i, j) < 0}
    assert set(found.negative.tolist()) == below - set(problem.forbidden.tolist())
    none = survivors(problem, duals, scaled, need, Alive.everything(), 0)
    assert none is None or not len(found.kept)


@pytest.mark.parametrize(
    ("scaled", "scale", "g", "bound"),
    [(20, 2, 1, 10), (21, 2, 1, 11), (21, 2, 5, 15), (-1, 7, 1, 0), (-8, 7, 1, -1), (0, 3, 4, 0)],
)
def test_bounds_are_rounded_up_to_the_granularity(scaled, scale, g, bound):
    assert ceiling(scaled, scale, g) == bound


@given(peak=st.integers(1, 2**50), size=st.integers(3, 10_000))
def test_scales_leave_room(peak, size):
    class Fake:
        pass

    fake = Fake()
    fake.peak, fake.size = peak, size
    scale = scale_for(fake, np.full(size, float(peak)), np.zeros(0))
    assert scale >= 1
    assert scale == 1 or scale * 4 * peak < 2**60
    assert scale <= 2**30
