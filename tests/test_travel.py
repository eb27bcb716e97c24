"""Travel costs: integer rules against exact rational arithmetic, compiled against vectorised."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tcp.errors import UsageError
from tcp.kernels import cost_of_move, pack
from tcp.travel import Model, Rounding, Travel, parse_model

speeds = st.fractions(Fraction(1, 7), 9, max_denominator=7)
quanta = st.sampled_from([None, Fraction(1), Fraction(1, 1000), Fraction(1, 3)])
steps = st.sampled_from([Fraction(1), Fraction(1, 1000), Fraction(254, 100_000)])
distances = st.integers(-20_000, 20_000)


def travel_of(*, model: Model, rounding: Rounding, quantum: Fraction | None, **rest) -> Travel:
    """Exact costs are not rounded."""
    exact = quantum is None and model in (Model.SEQUENTIAL, Model.SIMULTANEOUS)
    way = Rounding.NEAREST if exact else rounding
    return Travel(model, quantum=quantum, rounding=way, **rest)


def travels() -> st.SearchStrategy[Travel]:
    return st.builds(
        travel_of,
        model=st.sampled_from([m for m in Model if m is not Model.EXPLICIT]),
        vx=speeds,
        vy=speeds,
        ax=speeds,
        ay=speeds,
        axes=st.sampled_from([Model.SEQUENTIAL, Model.SIMULTANEOUS]),
        quantum=quanta,
        rounding=st.sampled_from(Rounding),
    )


def rounded_root(value: Fraction, up: bool) -> int:
    """Root of a rational, rounded, by integer square roots alone."""
    k = math.isqrt(math.floor(value))
    if up:
        return k if k * k == value else k + 1
    return k + 1 if (2 * k + 1) ** 2 <= 4 * value else k


def rounded(value: Fraction, up: bool) -> int:
    return math.ceil(value) if up else math.floor(value + Fraction(1, 2))


def oracle(travel: Travel, step: Fraction, quantum: Fraction, dx: int, dy: int) -> int:
    """The definition, in fractions."""
    up = travel.rounding is Rounding.UP
    tx, ty = abs(dx) * step / travel.vx, abs(dy) * step / travel.vy
    if travel.model is Model.SEQUENTIAL:
        return rounded((tx + ty) / quantum, up)
    if travel.model is Model.SIMULTANEOUS:
        return rounded(max(tx, ty) / quantum, up)
    if travel.model is Model.EUCLIDEAN:
        return rounded_root((tx**2 + ty**2) / quantum**2, up)
    assert travel.ax is not None and travel.ay is not None
    times = []
    for d, v, a in ((dx, travel.vx, travel.ax), (dy, travel.vy, travel.ay)):
        length = abs(d) * step
        if length >= v * v / a:
            times.append(rounded((length / v + v / a) / quantum, up))
        else:
            times.append(rounded_root(4 * length / a / quantum**2, up))
    return sum(times) if travel.axes is Model.SEQUENTIAL else max(times)


@settings(max_examples=300, deadline=None)
@given(travels(), steps, st.lists(st.tuples(distances, distances), min_size=1, max_size=5))
def test_costs_follow_the_definition(travel, step, moves):
    try:
        rule = travel.rule(step, (20_000, 20_000), 50)
    except UsageError:
        assume(False)
    dx, dy = (np.array(v, np.int64) for v in zip(*moves, strict=True))
    expected = [oracle(travel, step, rule.quantum, x, y) for x, y in moves]
    assert rule.costs(dx, dy).tolist() == expected
    packed = pack(rule)
    assert [cost_of_move(packed, x, y) for x, y in moves] == expected


def test_an_axis_at_rest_costs_nothing():
    travel = Travel(Model.TRAPEZOIDAL, ax=Fraction(1), ay=Fraction(1))
    rule = travel.rule(Fraction(1), (10, 10), 5)
    assert rule.costs(np.array([0]), np.array([0])).tolist() == [0]


def test_linear_models_are_exact_in_the_largest_common_unit():
    rule = Travel(vx=Fraction(2), vy=Fraction(3)).rule(Fraction(1, 10), (100, 100), 10)
    assert rule.quantum == Fraction(1, 60)
    assert rule.costs(np.array([1]), np.array([1])).tolist() == [3 + 2]


@pytest.mark.parametrize("name", ["vx", "vy", "ax", "quantum"])
@pytest.mark.parametrize("value", [0, -1])
def test_speeds_and_quanta_are_positive(name, value):
    with pytest.raises(UsageError, match=f"{name} must be greater than 0"):
        Travel(**{name: Fraction(value)})


def test_trapezoidal_needs_accelerations():
    with pytest.raises(UsageError, match="accelerations"):
        Travel(Model.TRAPEZOIDAL)


@pytest.mark.parametrize(
    "given",
    [
        {"vx": Fraction(2)},
        {"vy": Fraction(1, 2)},
        {"ax": Fraction(1)},
        {"quantum": Fraction(5)},
        {"rounding": Rounding.UP},
    ],
)
def test_explicit_times_have_no_speeds_and_are_not_rounded(given):
    with pytest.raises(UsageError, match="the file's own times"):
        Travel(Model.EXPLICIT, **given)


@pytest.mark.parametrize("model", [Model.SEQUENTIAL, Model.SIMULTANEOUS])
def test_exact_costs_are_not_rounded_up(model):
    with pytest.raises(UsageError, match=f"{model} travel is exact: rounding up needs a quantum"):
        Travel(model, rounding=Rounding.UP)
    assert Travel(model, rounding=Rounding.UP, quantum=Fraction(1)).rounding is Rounding.UP


def test_costs_beyond_62_bits_are_refused():
    travel = Travel(Model.EUCLIDEAN, quantum=Fraction(1, 10**9))
    with pytest.raises(UsageError, match="larger quantum"):
        travel.rule(Fraction(1), (10**6, 10**6), 10)
    with pytest.raises(UsageError, match="smaller quantum"):
        Travel(quantum=Fraction(10**30)).rule(Fraction(1), (10**6, 10**6), 10)


@pytest.mark.parametrize("quantum", [None, 1000, Fraction(1, 10**7)])
def test_where_no_quantum_helps_none_is_advised(quantum):
    travel = Travel(Model.EUCLIDEAN, quantum=quantum)
    with pytest.raises(UsageError, match="take fewer decimals in coordinates and speeds"):
        travel.rule(Fraction(1, 10**12), (7 * 10**12, 3 * 10**12), 3)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"vx": 2.5}, "vx must be a whole number or a Fraction, not 2.5"),
        ({"vy": "2"}, "vy must be"),
        ({"vx": None}, "vx must be"),
        ({"vy": True}, "vy must be"),
        ({"quantum": 0.1}, "quantum must be"),
        ({"model": "fast"}, "unknown travel model 'fast'; expected one of sequential, "),
    ],
)
def test_what_is_not_exact_is_no_travel(given, words):
    with pytest.raises(UsageError, match=words):
        Travel(**given)


@pytest.mark.parametrize("model", [m for m in Model if m is not Model.EXPLICIT])
@pytest.mark.parametrize("reach", [(0, 0), (0, 9)])
def test_an_axis_at_rest_must_have_parameters_that_fit(model, reach):
    travel = Travel(
        model, vx=Fraction(1, 10**20), ax=Fraction(1), ay=Fraction(1), quantum=Fraction(1)
    )
    with pytest.raises(UsageError, match="exceeds 62-bit integers; take fewer decimals"):
        travel.rule(Fraction(1), reach, 10)


def test_models_have_the_papers_names():
    assert parse_model("case1") is Model.SEQUENTIAL
    assert parse_model("Case2") is Model.SIMULTANEOUS
    with pytest.raises(UsageError, match="unknown travel model 'walk'"):
        parse_model("walk")


def test_large_boards_drawn_in_inches_have_euclidean_lengths():
    """What must fit 62 bits is the sum of the costs, not of the squares behind them."""
    step = Fraction(127, 500_000)  # 10^-5 inch
    rule = Travel(Model.EUCLIDEAN).rule(step, (400_000, 300_000), 5_000)
    assert rule.costs(np.array([300_000]), np.array([400_000])).tolist() == [127_000]
    with pytest.raises(UsageError, match="larger quantum"):
        Travel(Model.SEQUENTIAL).rule(Fraction(1, 1000), (2**40, 2**40), 2**21)
