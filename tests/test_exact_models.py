"""What the exact models refuse, and the minimum cuts that the subtour model rests on."""

from __future__ import annotations

import itertools

import highspy
import numpy as np
import pulp
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Ends, Instance, Status, Stop, StopReason, Travel, Workpiece, solve
from tcp.errors import UsageError
from tcp.exact.backends import Cbc, Highs, least
from tcp.exact.min_cut import violated_sets
from tcp.models.milp import FORMULATIONS
from tcp.travel import Model


def line(n: int, ends: Ends | None = None, travel: Travel | None = None) -> Instance:
    piece = Workpiece.from_decimals("line", [(k * k % 101, k) for k in range(n)])
    return Instance(piece, travel or Travel(), ends or Ends())


weights = st.lists(st.sampled_from([0, 0, 1, 2, 3, 4]), min_size=21, max_size=21)


@settings(max_examples=300, deadline=None)
@given(weights, st.integers(4, 7))
def test_cuts_are_found_exactly_where_there_are_any(values, size):
    pairs = itertools.combinations(range(size), 2)
    support = {p: v / 2 for p, v in zip(pairs, values, strict=False) if v}
    if not support:
        return

    def left(inside):
        return sum(v for (i, j), v in support.items() if (i in inside) != (j in inside))

    sets = [set(s) for k in range(1, size) for s in itertools.combinations(range(size), k)]
    found = violated_sets(size, support)
    assert all(left(nodes) < 2 and 0 < len(nodes) <= size / 2 for nodes in found)
    assert bool(found) == (min(map(left, sets)) < 2)


def test_held_karp_takes_twenty_holes_and_refuses_forty():
    home = (1, 2)
    for ends in (Ends(), Ends(closed=True), Ends(home=home, back=True, start=3)):
        result = solve(line(20, ends), "held-karp")
        assert result.status is Status.OPTIMAL
        assert result.details["table_bytes"] < 2**32
    with pytest.raises(UsageError, match="20 holes always fit"):
        solve(line(40), "held-karp")


@pytest.mark.parametrize(
    ("solver", "options", "words"),
    [
        ("milp", {"formulation": "dfj"}, "unknown formulation 'dfj'; expected one of subtour"),
        ("milp", {"backend": "cplex"}, "unknown backend 'cplex'; expected one of highs"),
        ("routing", {"metaheuristic": "luck"}, "metaheuristic one of automatic"),
        ("routing", {"metaheuristic": "tabu_search"}, "set a time limit"),
        ("routing", {"first_solution": "none"}, "first_solution is one of"),
        ("cp-sat", {"workers": 0}, "workers of 1 or more"),
        ("positions", {"workers": 10**11}, "up to 1000"),
        ("cp-sat", {"speed": 1}, "no option 'speed'"),
    ],
)
def test_options_that_do_not_exist_are_refused(solver, options, words):
    with pytest.raises(UsageError, match=words):
        solve(line(6), solver, **options)


@pytest.mark.parametrize("solver", ["milp", "cp-sat", "routing"])
def test_models_that_would_be_too_large_are_refused(solver):
    with pytest.raises(UsageError, match=f"{solver} cannot solve line"):
        solve(line(2_500), solver)


def test_costs_too_fine_for_floating_point_are_refused():
    fine = Travel(Model.EUCLIDEAN, quantum=Travel().vx / 10**12)
    with pytest.raises(UsageError, match="larger quantum"):
        solve(line(30, travel=fine), "milp")


@pytest.mark.parametrize("backend", ["scip", "cbc"])
def test_a_missing_backend_is_named(backend, monkeypatch):
    from tcp.exact import backends

    missing = backends.pulp.SCIP_PY if backend == "scip" else backends.pulp.COIN_CMD
    monkeypatch.setattr(missing, "available", lambda self: False)
    with pytest.raises(UsageError, match=f"{backend} is not installed"):
        solve(line(6), "milp", backend=backend)


@pytest.mark.parametrize("metaheuristic", ["guided_local_search", "simulated_annealing"])
def test_routing_searches_as_it_is_told(metaheuristic):
    instance = line(25)
    result = solve(
        instance,
        "routing",
        stop=Stop(time=0.2),
        metaheuristic=metaheuristic,
        first_solution="savings",
    )
    assert result.details["metaheuristic"] == metaheuristic
    assert result.cost >= solve(instance, "cp-sat").cost


def test_bounds_have_a_margin_and_stay_integers():
    rng = np.random.default_rng(1)
    points = [(int(x), int(y)) for x, y in rng.integers(0, 10**4, (9, 2))]
    instance = Instance(Workpiece.from_decimals("fine", points), Travel(Model.EUCLIDEAN))
    truth = solve(instance, "held-karp").cost
    for formulation in ("subtour", "mtz", "flow"):
        result = solve(instance, "milp", formulation=formulation)
        assert isinstance(result.bound, int) and result.bound <= truth <= result.cost


@pytest.mark.parametrize(
    ("printed", "value"),
    [
        ("1.5000005e+08", 150_000_045),
        ("1.5e+08", 145_000_000),
        ("-2.5e+02", -255),
        ("200", 199.5),
        ("12.000", 11.9995),
        ("+3.25", 3.245),
    ],
)
def test_a_printed_bound_stands_for_the_least_it_may_be(printed, value):
    assert least(printed) == value


def test_a_bound_in_the_log_of_cbc_is_never_above_the_optimum():
    """150000049.2, say, is printed as 1.5000005e+08."""
    solver, told = Cbc(0, 0.5, lambda bound: told.append(bound)), []
    solver.bound = -np.inf
    solver._follow(
        ["Cbc0010I After 0 nodes, 1.5000005e+08 best, best possible 1.5000005e+08 (1 s)"]
    )
    assert told == [150_000_045] and solver.bound == 150_000_045


@pytest.mark.parametrize("solver", ["routing", "cp-sat", "positions", "milp"])
def test_a_time_limit_beyond_all_time_is_none(solver):
    assert solve(line(6), solver, stop=Stop(time=1e300), exact=True).status is Status.OPTIMAL


@pytest.mark.parametrize(("solver", "holes"), [("cp-sat", 450), ("positions", 30)])
def test_a_limit_ends_a_search_whose_model_is_large(solver, holes):
    result = solve(line(holes), solver, stop=Stop(time=0.1))
    assert result.route is not None and result.stopped is StopReason.TIME


@pytest.mark.parametrize("workers", [1, 2])
def test_only_a_single_worker_of_cp_sat_is_given_a_hint(workers, monkeypatch):
    """Several interleaved ones, given a hint and stopped early, may abort the process."""
    from tcp.models.circuit import Circuit

    hinted = []
    monkeypatch.setattr(Circuit, "hint", lambda self, tour: hinted.append(tour))
    piece = Workpiece.from_decimals("p", [(0, 0), (3, 1), (1, 4), (5, 2), (2, 2)])
    assert solve(Instance(piece), "cp-sat", workers=workers).status is Status.OPTIMAL
    assert len(hinted) == (workers == 1)


@pytest.mark.parametrize("relaxed", [False, True])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_highs_gets_the_model_that_pulp_would_give_it(formulation, relaxed):
    model = FORMULATIONS[formulation](line(7, Ends(start=2)).form)
    model.relax(relaxed)
    translator, found = pulp.HiGHS(msg=False), []
    for load in (translator.buildSolverModel, lambda p: Highs._load(p, p.solverModel)):
        translator.createAndConfigureSolver(model.problem)
        load(model.problem)
        lp = model.problem.solverModel.getLp()
        columns, rows = (lp.col_cost_, lp.col_lower_, lp.col_upper_), (lp.row_lower_, lp.row_upper_)
        matrix = (lp.a_matrix_.start_, lp.a_matrix_.index_, lp.a_matrix_.value_)
        whole = [kind for kind in lp.integrality_ if kind == highspy.HighsVarType.kInteger]
        assert bool(whole) is not relaxed
        found.append([list(part) for part in (*columns, *rows, *matrix, whole)])
    assert found[0] == found[1]
