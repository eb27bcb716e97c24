"""HTGA, cuckoo search and firefly: the papers' steps, and what every search must keep."""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Ends, Instance, Model, Rules, Travel, Workpiece
from tcp.errors import UsageError
from tcp.heuristics import cuckoo, firefly, htga
from tcp.heuristics.arrays import orthogonal_array
from tcp.heuristics.orders import length, orders
from tcp.solve import solve
from tcp.stop import Stop, StopReason
from tcp.validate.route import faults

PAPERS = ("htga", "cuckoo", "firefly", "pso", "acs")
HOME = (Fraction(-3), Fraction(1, 2))
ENDS = {
    "free": Ends(),
    "start": Ends(start=1),
    "end": Ends(end=2),
    "both": Ends(start=2, end=0),
    "home out": Ends(home=HOME, outward=True),
    "home back": Ends(home=HOME, back=True),
    "home both": Ends(home=HOME, outward=True, back=True),
    "home, start": Ends(start=1, home=HOME, outward=True, back=True),
    "home, end": Ends(end=1, home=HOME, outward=True, back=True),
    "closed": Ends(closed=True),
    "closed, start": Ends(start=2, closed=True),
}
FEW = {
    "htga": {"np": 20, "gn": 150},
    "cuckoo": {"np": 15, "generations": 150},
    "firefly": {"agents": 12, "iterations": 300, "cooling": 1.0},
    "pso": {"np": 20, "iterations": 150, "variant": "gc", "w": 0.7},
    "acs": {"np": 5, "iterations": 100},
}


def board(seed: int, n: int) -> Workpiece:
    rng = np.random.default_rng(seed)
    places = rng.integers(0, 9, size=(n, 2)).tolist()
    return Workpiece.from_decimals(f"board {n}", [(x, y) for x, y in places])


def best(instance: Instance) -> int:
    """The optimum by looking at every route."""
    routes = itertools.permutations(range(len(instance)))
    return min(instance.cost(r) for r in routes if not faults(instance, r))


# --- orthogonal arrays ------------------------------------------------------

TABLE_I = """\
1 1 1 1 1 1 1
1 1 1 2 2 2 2
1 2 2 1 1 2 2
1 2 2 2 2 1 1
2 1 2 1 2 1 2
2 1 2 2 1 2 1
2 2 1 1 2 2 1
2 2 1 2 1 1 2"""


def test_l8_is_the_papers_table_i():
    printed = np.array([[int(v) - 1 for v in row.split()] for row in TABLE_I.splitlines()])
    assert np.array_equal(orthogonal_array(7), printed)


@pytest.mark.parametrize("factors", [1, 2, 3, 7, 8, 9, 15, 16, 49, 63, 64, 200])
def test_arrays_are_orthogonal(factors):
    array = orthogonal_array(factors)
    runs = len(array)
    assert runs > factors >= runs // 2 and runs & (runs - 1) == 0
    signs = 2 * array.astype(int) - 1
    assert np.array_equal(signs.T @ signs, runs * np.eye(factors, dtype=int))
    assert (array.sum(axis=0) == runs // 2).all()


def test_an_array_needs_a_factor():
    with pytest.raises(UsageError):
        orthogonal_array(0)


# --- orders: every kind of ends as one matrix -------------------------------


@pytest.mark.parametrize("ends", ENDS.values(), ids=ENDS)
@pytest.mark.parametrize("model", [Model.SEQUENTIAL, Model.SIMULTANEOUS, Model.EUCLIDEAN])
def test_orders_cost_what_the_instance_says(ends, model):
    instance = Instance(board(5, 6), Travel(model, vx=Fraction(2)), ends)
    problem = orders(instance)
    rng = np.random.default_rng(0)
    for _ in range(20):
        order = rng.permutation(len(problem))
        route = problem.route(order)
        assert not faults(instance, route)
        assert length(order, problem.legs) + problem.fixed == instance.cost(route)


@given(st.integers(0, 10**6), st.integers(4, 7), st.data())
@settings(max_examples=40, deadline=None)
def test_broken_rules_cost_more_than_any_route(seed, n, data):
    pair = st.tuples(st.integers(0, n - 1), st.integers(0, n - 1)).filter(lambda p: p[0] != p[1])
    rules = Rules(
        forbidden=tuple(data.draw(st.lists(pair, max_size=4))),
        together=tuple(data.draw(st.lists(pair, max_size=2))),
    )
    ends = data.draw(st.sampled_from(list(ENDS.values())))
    instance = Instance(board(seed, n), ends=ends, rules=rules)
    problem = orders(instance)
    for order in itertools.permutations(range(len(problem))):
        cost = length(np.array(order), problem.legs)
        route = problem.route(np.array(order))
        broken = any("follow" in fault for fault in faults(instance, route))
        assert problem.allowed(cost) == (not broken)
        if not broken:
            assert cost + problem.fixed == instance.cost(route)


# --- what every search keeps ------------------------------------------------


@pytest.mark.parametrize("solver", PAPERS)
@pytest.mark.parametrize("ends", ENDS.values(), ids=ENDS)
def test_small_boards_are_solved_with_every_kind_of_ends(solver, ends):
    instance = Instance(board(8, 6), ends=ends)
    result = solve(instance, solver, **FEW[solver])
    assert result.cost == best(instance)


@pytest.mark.parametrize("solver", PAPERS)
@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_tiny_boards_are_solved(solver, n):
    instance = Instance(board(n, n))
    result = solve(instance, solver, **FEW[solver])
    assert result.cost == best(instance)


@pytest.mark.parametrize("solver", PAPERS)
def test_rules_about_pairs_are_kept(solver):
    plain = Instance(board(3, 7))
    route = solve(plain, solver, **FEW[solver]).route
    ruled = Instance(plain.workpiece, rules=Rules(forbidden=(route[:2], route[2:4])))
    result = solve(ruled, solver, **FEW[solver])
    assert not faults(ruled, result.route)
    together = Instance(plain.workpiece, rules=Rules(together=((route[0], route[3]),)))
    assert not faults(together, solve(together, solver, **FEW[solver]).route)


@pytest.mark.parametrize("solver", PAPERS)
def test_no_route_is_returned_that_breaks_a_rule(solver):
    everything = tuple(itertools.combinations(range(5), 2))
    instance = Instance(board(1, 5), rules=Rules(forbidden=everything))
    result = solve(instance, solver, **FEW[solver])
    assert result.route is None and not result.trace


@pytest.mark.parametrize("solver", PAPERS)
def test_same_seed_same_trajectory_and_observers_change_nothing(solver):
    instance = Instance(board(4, 12))
    seen = []
    runs = [solve(instance, solver, seed=7, **FEW[solver]) for _ in range(2)]
    runs.append(solve(instance, solver, seed=7, report=seen.append, **FEW[solver]))
    paths = [[(p.iteration, p.cost) for p in run.trace] for run in runs]
    assert paths[0] == paths[1] == paths[2] == [(p.iteration, p.cost) for p in seen]
    assert len({run.route for run in runs}) == 1
    other = solve(instance, solver, seed=8, **FEW[solver])
    assert [(p.iteration, p.cost) for p in other.trace] != paths[0]


@pytest.mark.parametrize("solver", PAPERS)
def test_the_trace_falls_and_ends_at_the_answer(solver):
    result = solve(Instance(board(4, 12)), solver, **FEW[solver])
    costs = [p.cost for p in result.trace]
    assert costs == sorted(set(costs), reverse=True) and costs[-1] == result.cost
    assert result.trace[0].iteration == 0


@pytest.mark.parametrize(
    ("solver", "endless"),
    [
        ("htga", {"gn": 10**9}),
        ("cuckoo", {"generations": 10**9}),
        ("firefly", {"iterations": 10**9}),
    ],
)
def test_limits_are_heard(solver, endless):
    instance = Instance(board(4, 30))
    result = solve(instance, solver, stop=Stop(iterations=25), **endless)
    assert result.stopped is StopReason.ITERATIONS and result.details["iterations"] == 25
    result = solve(instance, solver, stop=Stop(time=0.3), **endless)
    assert result.stopped is StopReason.TIME and result.seconds < 0.8
    goal = result.trace[len(result.trace) // 2].cost
    again = solve(instance, solver, stop=Stop(target=goal), **endless)
    assert again.stopped is StopReason.TARGET and again.cost <= goal
    assert again.details["iterations"] == again.trace[-1].iteration


@pytest.mark.parametrize(
    ("solver", "wrong"),
    [
        ("htga", {"np": 3}),
        ("htga", {"cr": 1.5}),
        ("htga", {"crossover": "x"}),
        ("cuckoo", {"pa": -0.1}),
        ("cuckoo", {"beta": 2.0}),
        ("cuckoo", {"fitness": "x"}),
        ("firefly", {"agents": 1}),
        ("firefly", {"gamma": -1.0}),
        ("pso", {"variant": "x"}),
        ("pso", {"w_end": -0.1}),
        ("acs", {"rho": 1.0}),
        ("acs", {"np": 10**12}),
    ],
)
def test_parameters_out_of_range_are_refused(solver, wrong):
    with pytest.raises(UsageError, match=solver):
        solve(Instance(board(4, 8)), solver, **wrong)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf"), 10**400])
def test_numbers_that_are_none_are_refused(value):
    for solver, option in (("firefly", "gamma"), ("firefly", "width"), ("pso", "w_end")):
        with pytest.raises(UsageError, match=f"{solver}: {option} is a finite number"):
            solve(Instance(board(4, 8)), solver, **{option: value})


@pytest.mark.parametrize(
    ("solver", "option"),
    [("htga", "np"), ("htga", "taguchi"), ("firefly", "agents"), ("pso", "np"), ("cuckoo", "np")],
)
def test_populations_beyond_the_memory_are_one_sentence(solver, option):
    with pytest.raises(UsageError, match=f"{solver} needs more memory than there is"):
        solve(Instance(board(4, 8)), solver, **{option: 10**12})


def test_boards_beyond_the_matrix_are_refused():
    with pytest.raises(UsageError, match="up to 2000 holes"):
        solve(Instance(board(1, 2001)), "htga")


# --- HTGA: single steps -----------------------------------------------------


def test_mutation_takes_the_best_of_the_six_arrangements():
    problem = orders(Instance(board(2, 9)))
    rng = np.random.default_rng(1)
    for _ in range(200):
        before = rng.permutation(9).astype(np.int32)
        after = before.copy()
        gain = htga._mutate(rng, after, problem.legs)
        assert length(after, problem.legs) - length(before, problem.legs) == gain <= 0
        places = np.flatnonzero(after != before)
        assert len(places) <= 3 and sorted(after) == list(range(9))
        if len(places) == 3:
            six = [before.copy() for _ in range(6)]
            for order, genes in zip(six, itertools.permutations(before[places]), strict=True):
                order[places] = genes
            assert length(after, problem.legs) == min(length(o, problem.legs) for o in six)


@pytest.mark.parametrize("crossover", htga.CROSSOVERS)
def test_crossover_takes_four_genes_of_one_parent_and_the_others_sequence(crossover):
    problem = orders(Instance(board(2, 10)))
    rng = np.random.default_rng(3)
    times, stamp = np.zeros(3, dtype=np.int64), np.zeros(10, dtype=np.int64)
    starts = set()
    for _ in range(100):
        genes = np.array([rng.permutation(10), rng.permutation(10), np.zeros(10)], dtype=np.int32)
        kind = htga.CROSSOVERS.index(crossover)
        htga._cross(rng, problem.legs, genes, times, 0, 1, 2, stamp, kind)
        child, taken = genes[2].tolist(), set(np.flatnonzero(stamp).tolist())
        assert sorted(child) == list(range(10)) and len(taken) == 4
        assert times[2] == length(genes[2], problem.legs)
        assert [g for g in child if g not in taken] == [g for g in genes[1] if g not in taken]
        at = [k for k in range(10) if genes[0, k] in taken]
        assert {child[k] for k in (at if crossover == "places" else range(4))} == taken
        if crossover == "places":
            assert all(child[k] == genes[0, k] for k in at)
        if crossover == "stretch":
            assert at == list(range(at[0], at[0] + 4))
            assert child[:4] == genes[0, at].tolist()
            starts.add(at[0])
    assert crossover != "stretch" or starts == set(range(7))


def test_uncrossed_pairs_pass_on_only_if_they_are_to():
    """Without crossing, mutation alone improves the parents, or nothing does."""
    instance = Instance(board(3, 12))
    setting = {"np": 10, "gn": 60, "cr": 0.0, "mr": 0.5, "taguchi": 0}
    assert len(solve(instance, "htga", **setting).trace) > 1
    assert len(solve(instance, "htga", uncrossed=False, **setting).trace) == 1


def test_taguchi_repairs_every_mix_and_returns_the_best():
    problem = orders(Instance(board(2, 9)))
    rng = np.random.default_rng(5)
    array = orthogonal_array(9)
    for _ in range(50):
        genes = np.array([rng.permutation(9), rng.permutation(9), np.zeros(9)], dtype=np.int32)
        stamp = np.zeros(9, dtype=np.int64)
        cost = htga._taguchi(array, problem.legs, genes, 0, 1, 2, stamp)
        assert sorted(genes[2]) == list(range(9))
        assert cost == length(genes[2], problem.legs)
        assert cost <= length(genes[0], problem.legs)  # run 1 of the array is Level 1 itself


@pytest.mark.parametrize("distinct", [True, False])
def test_elimination_keeps_the_best(distinct):
    rng = np.random.default_rng(2)
    genes = np.array([rng.permutation(6) for _ in range(12)], dtype=np.int32)
    genes[8:] = genes[:4]
    times = (genes @ np.arange(6)).astype(np.int64)
    slots = np.arange(12)
    htga._eliminate(genes, times, slots, 12, distinct)
    assert sorted(slots) == list(range(12))
    kept = [tuple(genes[s]) for s in slots[:8]]
    assert times[slots[:8]].tolist() == sorted(times[slots[:8]].tolist())
    if distinct:
        assert len(set(kept)) == 8
    else:
        assert times[slots[:8]].tolist() == sorted(times.tolist())[:8]


# --- cuckoo search ----------------------------------------------------------


def all_sequences(n: int) -> np.ndarray:
    return np.array(list(itertools.permutations(range(n))))


@given(st.integers(0, 10**6), st.integers(4, 6), st.sampled_from(["sequential", "simultaneous"]))
@settings(max_examples=25, deadline=None)
def test_the_minimum_of_pseudocode_3_is_the_open_optimum(seed, n, model):
    problem = orders(Instance(board(seed, n), Travel(Model(model))))
    cut = [cuckoo._fitness(s, problem.legs, True) for s in all_sequences(n)]
    free = [cuckoo._fitness(s, problem.legs, False) for s in all_sequences(n)]
    assert min(cut) == min(free)
    assert all(c <= f for c, f in zip(cut, free, strict=True))
    # every rotation of an optimal route decodes to the optimum: n times as many (ties may add)
    assert cut.count(min(cut)) >= free.count(min(free))


def test_rotations_share_the_fitness_of_pseudocode_3_and_the_route_is_cut_there():
    instance = Instance(board(9, 8))
    problem = orders(instance)
    rng = np.random.default_rng(0)
    for _ in range(50):
        sequence = rng.permutation(8)
        cost = cuckoo._fitness(sequence, problem.legs, True)
        rotations = [np.roll(sequence, k) for k in range(8)]
        assert {cuckoo._fitness(r, problem.legs, True) for r in rotations} == {cost}
        assert min(length(r, problem.legs) for r in rotations) == cost
        assert length(cuckoo._behind_longest(sequence, problem.legs), problem.legs) == cost


def test_lamarckian_property_of_section_3_3_1():
    first = np.array([0.44, 0.21, -0.23, -0.01, 0.91])
    second = np.array([0.08, 0.21, -0.03, 0.14, -0.66])
    relabelled = np.sort(first)[second.argsort().argsort()]
    assert relabelled.tolist() == [0.21, 0.91, -0.01, 0.44, -0.23]


def test_decoding_of_section_3_3_1_and_laying_eggs():
    problem = orders(Instance(board(9, 5)))
    egg = np.array([0.34, -0.09, 0.88, -0.66, 0.91])
    assert (egg.argsort() + 1).tolist() == [4, 2, 1, 3, 5]
    rng = np.random.default_rng(0)
    nests = cuckoo._nests(rng, problem, 6, True)
    keys, sequences, ordered, ranks, costs = nests
    assert np.abs(keys).max() < 1
    for _ in range(200):
        nest, egg = int(rng.integers(6)), rng.uniform(-1, 1, 5)
        old = costs[nest]
        cuckoo._lay(egg, nest, *nests, np.zeros(5, dtype=np.int64), problem.legs, True)
        fresh = cuckoo._fitness(egg.argsort(), problem.legs, True)
        assert costs[nest] == min(old, fresh)
        assert np.array_equal(sequences[nest], keys[nest].argsort())
        assert np.array_equal(ordered[nest], np.sort(keys[nest]))
        assert np.array_equal(ranks[nest], sequences[nest].argsort())


def test_mantegna_sigma_is_the_known_value():
    assert cuckoo.mantegna_sigma(1.5) == pytest.approx(0.696575, abs=1e-6)


# --- particle swarm ---------------------------------------------------------


def test_the_route_of_a_thrown_particle_counts_too():
    few = {"np": 10, "iterations": 50, "w": 0.0, "c1": 0.0, "c2": 1.42}  # all fall to the leader
    counts = {}
    for variant in ("basic", "gc"):
        result = solve(Instance(board(4, 8)), "pso", variant=variant, **few)
        counts[variant] = result.details["evaluations"] - 10 * (result.details["iterations"] + 1)
    assert counts["basic"] == 0 < counts["gc"]


# --- firefly ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "corrected"),
    [([1.23, 0.7, -7.89], [3, 2, 1]), ([3, 2.91, 0.1, 89.2, -9.1], [4, 3, 2, 5, 1])],
)
def test_rank_correction_gives_the_papers_examples(value, corrected):
    m = len(value)
    agent, place = np.arange(m), np.arange(m)
    firefly._correct(agent, np.array(value, dtype=float), place, np.zeros(m, dtype=np.int64))
    assert (agent + 1).tolist() == corrected
    assert np.array_equal(place, agent.argsort())


@pytest.mark.parametrize("m", [firefly.FEW, firefly.FEW + 1])
def test_rank_correction_sorts_any_number_stably(m):
    rng = np.random.default_rng(m)
    place, agent = rng.permutation(m), np.zeros(m, dtype=np.int64)
    value = rng.integers(0, 40, m) / 8  # many ties, which keep the order there was
    wanted = place[np.argsort(value[place], kind="stable")]
    firefly._correct(agent, value, place, np.zeros(m, dtype=np.int64))
    assert np.array_equal(place, wanted) and np.array_equal(agent, wanted.argsort())


PRINTED = {"width": 1.0, "cooling": 1.0, "beta_min": 0.0}


@pytest.mark.parametrize("toward", [True, False])
def test_the_algorithm_as_printed_cannot_move(toward):
    instance = Instance(board(4, 14))
    still = solve(instance, "firefly", agents=10, iterations=200, toward=toward, **PRINTED)
    assert [p.iteration for p in still.trace] == [0]
    for change in ({}, {"cooling": 1.0}, {**PRINTED, "width": 2.0}, {**PRINTED, "beta_min": 0.2}):
        moving = solve(instance, "firefly", agents=10, iterations=200, **change)
        assert moving.cost < still.cost


def test_noise_cools_by_the_iteration_of_all_iterations():
    """A run cut short is the beginning of the whole one."""
    instance = Instance(board(4, 14))
    whole = solve(instance, "firefly", agents=10, iterations=300)
    short = solve(instance, "firefly", agents=10, iterations=300, stop=Stop(iterations=100))
    known = [(p.iteration, p.cost) for p in whole.trace if p.iteration <= 100]
    assert [(p.iteration, p.cost) for p in short.trace] == known
