"""Separation against brute force: every cut is violated, and no tour violates it."""

from __future__ import annotations

import itertools
from concurrent.futures import ThreadPoolExecutor

import networkx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Instance, Workpiece
from tcp.exact.branch_and_cut import pool as pool_file
from tcp.exact.branch_and_cut.combs import comb_cuts
from tcp.exact.branch_and_cut.cuts import Cut, Family, boundary, columns, rows, smaller_side
from tcp.exact.branch_and_cut.handles import blocks, fractional_handles
from tcp.exact.branch_and_cut.inward import MEMORY, STEP, Mean
from tcp.exact.branch_and_cut.pool import Pool, violation
from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.branch_and_cut.subtours import component_cuts, interval_cuts, minimum_cuts
from tcp.exact.branch_and_cut.support import Support

SIZE = 8
THREADS = ThreadPoolExecutor(2)
TOURS = np.array([(0, *p) for p in itertools.permutations(range(1, SIZE)) if p[0] < p[-1]])


def mixture(size: int, seed: int, parts: int) -> Support:
    """The mean of random 2-factors: degrees are 2, and all else may be violated."""
    rng, x = np.random.default_rng(seed), {}
    for _ in range(parts):
        order = rng.permutation(size)
        cut = int(rng.integers(3, size - 2))
        for cycle in (order[:cut], order[cut:]) if rng.random() < 0.8 else (order,):
            for i, j in zip(cycle, np.roll(cycle, -1), strict=True):
                key = (int(min(i, j)), int(max(i, j)))
                x[key] = x.get(key, 0.0) + 1.0 / parts
    i, j = np.array(list(x)).T
    return Support.of(size, i.astype(np.int64), j.astype(np.int64), np.array(list(x.values())))


def half_integral(size: int, seed: int) -> Support:
    """Odd cycles of half edges joined by paths of whole ones: combs are violated."""
    rng = np.random.default_rng(seed)
    nodes = rng.permutation(6 + 3 * (size - 6) // 3)[:size]
    first, second, rest = nodes[:3], nodes[3:6], nodes[6:].tolist()
    x = {}
    for triangle in (first, second):
        for i, j in itertools.combinations(triangle.tolist(), 2):
            x[min(i, j), max(i, j)] = 0.5
    for k in range(3):
        inner = rest[k::3]
        path = [int(first[k]), *inner, int(second[k])]
        for i, j in itertools.pairwise(path):
            x[min(i, j), max(i, j)] = 1.0
    i, j = np.array(list(x)).T
    return Support.of(size, i.astype(np.int64), j.astype(np.int64), np.array(list(x.values())))


def left(support: Support, cut: Cut) -> float:
    total = 0.0
    for part, weight in zip(cut.sets, cut.weights, strict=True):
        inside = np.isin(np.arange(support.size), part)
        total += weight * support.x[inside[support.i] != inside[support.j]].sum()
    return float(total)


def assert_holds_for_all_tours(cut: Cut, size: int) -> None:
    assert size == SIZE
    total = np.zeros(len(TOURS), np.int64)
    for part, weight in zip(cut.sets, cut.weights, strict=True):
        inside = np.isin(TOURS, part)
        total += weight * (inside != np.roll(inside, -1, axis=1)).sum(axis=1)
    assert total.min() >= cut.rhs
    assert total.min() == cut.rhs or not cut.local


def assert_comb(cut: Cut) -> None:
    handle, *teeth = (set(part.tolist()) for part in cut.sets)
    assert len(teeth) >= 3
    assert len(teeth) % 2
    assert all(tooth & handle and tooth - handle for tooth in teeth)
    assert sum(map(len, teeth)) == len(set().union(*teeth))


@settings(max_examples=150, deadline=None)
@given(seed=st.integers(0, 10**6), parts=st.integers(2, 5))
def test_minimum_cuts_agree_with_networkx(seed, parts):
    support = mixture(12, seed, parts)
    graph = networkx.Graph()
    graph.add_nodes_from(range(support.size))
    for i, j, x in zip(support.i.tolist(), support.j.tolist(), support.x.tolist(), strict=True):
        graph.add_edge(i, j, weight=x)
    connected = networkx.is_connected(graph)
    least = networkx.stoer_wagner(graph)[0] if connected else 0.0
    cuts = minimum_cuts(support)
    assert bool(cuts) == (least < 2.0 - 1e-4)
    assert all(left(support, cut) < 2.0 - 1e-5 and len(cut.ends) == 1 for cut in cuts)
    if cuts:
        assert min(left(support, cut) for cut in cuts) >= least - 1e-9
    assert bool(component_cuts(support)) == (not connected)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 10**6), parts=st.integers(2, 4))
def test_intervals_are_the_most_violated_ones(seed, parts):
    support = mixture(11, seed, parts)
    tour = np.random.default_rng(seed).permutation(support.size)
    found = {cut.nodes.tobytes() for cut in interval_cuts(support, tour)}
    for b in range(support.size):
        intervals = [tour[a : b + 1] for a in range(b) if b - a + 1 < support.size]
        values = [left(support, Cut.of([part])) for part in intervals]
        best = min(values, default=2.0)
        if best < 2.0 - 1e-4:
            ties = [p for p, v in zip(intervals, values, strict=True) if v < best + 1e-9]
            sides = {Cut.of([smaller_side(p, support.size)]).nodes.tobytes() for p in ties}
            assert sides & found


@settings(max_examples=150, deadline=None)
@given(seed=st.integers(0, 10**6), parts=st.integers(2, 5))
def test_combs_are_violated_and_valid(seed, parts):
    support = mixture(SIZE, seed, parts)
    tour = np.random.default_rng(seed + 1).permutation(SIZE)
    subsets = [np.array(s) for s in itertools.combinations(range(SIZE), 3)][seed % 7 :: 7]
    for by, cut in comb_cuts(support, tour, subsets + fractional_handles(support), THREADS):
        assert_comb(cut)
        assert left(support, cut) == pytest.approx(cut.rhs - by)
        assert_holds_for_all_tours(cut, SIZE)


@pytest.mark.parametrize("size", [9, 12, 15, 18])
def test_the_textbook_comb_is_found(size):
    for seed in range(8):
        support = half_integral(size, seed)
        # a tour along the whole paths, as a good one would be
        tour = np.array(sorted(range(size), key=lambda v: _order(support)[v]))
        found = comb_cuts(support, tour, fractional_handles(support), THREADS)
        assert found
        assert found[0][0] == pytest.approx(1.0)
        assert_comb(found[0][1])


def _order(support: Support) -> dict[int, int]:
    """Positions along the three whole paths, one after the other."""
    whole = networkx.Graph()
    for i, j, x in zip(support.i.tolist(), support.j.tolist(), support.x.tolist(), strict=True):
        if x > 0.9:
            whole.add_edge(i, j)
    order: list[int] = []
    for part in networkx.connected_components(whole):
        path = whole.subgraph(part)
        end = min(v for v in path if path.degree(v) == 1)
        order += list(networkx.dfs_preorder_nodes(path, end))
    return {v: k for k, v in enumerate(order)}


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_blocks_agree_with_networkx(seed):
    rng = np.random.default_rng(seed)
    pairs = np.array(list(itertools.combinations(range(10), 2)))
    pairs = pairs[rng.random(len(pairs)) < 0.25]
    graph = networkx.Graph(pairs.tolist())
    truth = {frozenset(b) for b in networkx.biconnected_components(graph) if len(b) >= 3}
    i, j = pairs[:, 0].copy(), pairs[:, 1].copy()
    assert {frozenset(b.tolist()) for b in blocks(10, i, j)} == truth


def random_cuts(rng: np.random.Generator, size: int, count: int) -> list[Cut]:
    cuts = []
    for _ in range(count):
        parts = int(rng.choice([1, 4, 6]))
        sets = [rng.choice(size, int(rng.integers(2, size - 1)), False) for _ in range(parts)]
        if rng.random() < 0.5:
            cuts.append(Cut.of(sets))
        else:
            cuts.append(Cut.weighted(sets, rng.integers(1, 5, parts).tolist(), 2 * parts))
    return cuts


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_rows_columns_and_boundaries_count_crossings(seed):
    rng, size = np.random.default_rng(seed), 9
    cuts = random_cuts(rng, size, 7)
    i, j = np.array(list(itertools.combinations(range(size), 2))).T.copy()
    truth = np.zeros((len(cuts), len(i)), np.int64)
    for k, cut in enumerate(cuts):
        for part, weight in zip(cut.sets, cut.weights, strict=True):
            truth[k] += weight * (np.isin(i, part) != np.isin(j, part))
    family = Family.of(cuts)
    for by_row, (ptr, index, value) in (
        (True, rows(family, i, j, size)),
        (
            False,
            columns(family.owner, family.weight, family.count, *family.membership(size), i, j),
        ),
    ):
        dense = np.zeros_like(truth if by_row else truth.T)
        for k in range(len(ptr) - 1):
            dense[k, index[ptr[k] : ptr[k + 1]]] = value[ptr[k] : ptr[k + 1]]
        assert np.array_equal(dense if by_row else dense.T, truth)
    support = Support.of(size, i, j, rng.random(len(i)))
    values = boundary(family.ptr, family.nodes, support.ptr, support.other, support.weight, size)
    total = np.bincount(family.owner, values * family.weight, minlength=len(cuts))
    assert total == pytest.approx([left(support, cut) for cut in cuts])


@pytest.mark.parametrize("between", [False, True])
def test_the_pool_returns_what_is_violated(between):
    support = mixture(12, 3, 1)
    cuts = random_cuts(np.random.default_rng(1), 12, 38) + component_cuts(support)
    pool = Pool()
    pool.add(cuts[:20])
    if between:  # what is flattened then stays so
        pool.violated(support, 0.05, 1000)
    pool.add(cuts[20:])
    pool.add(cuts[:3])
    assert len(pool) == len({c.key for c in cuts})
    truth = {c.key for c in cuts if left(support, c) <= c.rhs - 0.05}
    found = pool.violated(support, 0.05, 1000)
    assert truth
    assert {c.key for c in found} == truth
    assert found[0].rhs - left(support, found[0]) == max(c.rhs - left(support, c) for c in cuts)


def test_a_full_pool_lets_the_oldest_go(monkeypatch):
    monkeypatch.setattr(pool_file, "CAPACITY", 10)
    monkeypatch.setattr(pool_file, "LEAVE", 3)
    support = mixture(12, 3, 1)
    cuts = [Cut.of([[0, k]]) for k in range(1, 12)]
    pool = Pool()
    pool.add(cuts[:10])
    pool.violated(support, 0.05, 1000)
    pool.add(cuts[:2])  # young again
    pool.add(cuts[10:])
    kept = {c.key for c in (*cuts[:2], *cuts[6:])}
    assert {c.key for c in pool} == kept
    found = {c.key for c in pool.violated(support, -100.0, 1000)}
    assert found == kept


def test_the_inward_point_lies_between_the_solution_and_those_before_it():
    x, y = np.random.default_rng(0).integers(0, 99, (2, SIZE))
    problem = Problem.of(Instance(Workpiece("p", tuple(map(str, range(SIZE))), x, y)))
    mean, (a, b) = Mean(), (np.roll(np.arange(problem.size), k) for k in (1, 2))
    keys = np.concatenate([problem.keys(np.arange(problem.size), other) for other in (a, b)])
    near, far = np.arange(len(keys)) < problem.size, np.arange(len(keys)) >= problem.size
    assert mean.inward(problem, keys[near], np.ones(problem.size)) is None
    back = keys[::-1]  # the order of the pairs does not matter; now only the far ones are used
    point = mean.inward(problem, back, far[::-1].astype(float))
    assert point is not None
    away = 1.0 - MEMORY  # what the mean has taken in of the second solution
    found = dict(zip(problem.keys(point.i, point.j).tolist(), point.x.tolist(), strict=True))
    for key in keys[far]:
        assert found[key] == pytest.approx(STEP + (1.0 - STEP) * away)
    for key in keys[near]:
        assert found[key] == pytest.approx((1.0 - STEP) * (1.0 - away))
    degree = np.bincount(np.concatenate([point.i, point.j]), np.tile(point.x, 2))
    assert degree == pytest.approx(np.full(problem.size, 2.0))
    for _ in range(30):  # what has left the LP is forgotten
        point = mean.inward(problem, keys[far], np.ones(problem.size))
    assert point is not None
    assert set(problem.keys(point.i, point.j).tolist()) == set(keys[far].tolist())


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32))
def test_a_cut_is_violated_by_what_its_sets_lack(seed):
    support = mixture(SIZE, seed, 3)
    tour = np.arange(SIZE)
    cuts = [*component_cuts(support), *interval_cuts(support, tour), *minimum_cuts(support)]
    cuts.append(Cut.of([[1, 2]]))
    rhs = np.array([cut.rhs for cut in cuts])
    for cut, by in zip(cuts, violation(Family.of(cuts), rhs, support), strict=True):
        assert by == pytest.approx(cut.rhs - left(support, cut))
