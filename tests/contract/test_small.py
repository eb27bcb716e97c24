"""Every solver x travel model x kind of ends against brute force, up to seven holes."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import HealthCheck, given, reject, settings
from hypothesis import strategies as st

from tcp import Ends, Instance, Model, Rules, Travel, Workpiece, solve
from tcp.errors import UsageError
from tcp.solve import SOLVERS

HOME = (Fraction(-7, 3), Fraction(1, 2))
HALF = Fraction(1, 2)

TRAVELS = [
    Travel(),
    Travel(Model.SIMULTANEOUS, vx=Fraction(3), vy=Fraction(2)),
    Travel(Model.EUCLIDEAN),
    Travel(Model.TRAPEZOIDAL, vx=Fraction(2), ax=HALF, ay=Fraction(3)),
    Travel(Model.TRAPEZOIDAL, ax=HALF, ay=HALF, axes=Model.SEQUENTIAL),
    Travel(Model.EXPLICIT),
]
ENDS = {
    "free": Ends(),
    "start": Ends(start=1),
    "end": Ends(end=2),
    "both": Ends(start=0, end=2),
    "closed": Ends(closed=True),
    "closed-start": Ends(closed=True, start=2),
    "outward": Ends(home=HOME, outward=True),
    "back": Ends(home=HOME, back=True),
    "round": Ends(home=HOME, outward=True, back=True),
    "outward-start": Ends(home=HOME, outward=True, start=1),
    "outward-end": Ends(home=HOME, outward=True, end=1),
    "back-both": Ends(home=HOME, back=True, start=1, end=0),
    "round-both": Ends(home=HOME, outward=True, back=True, start=2, end=0),
}
BOARDS = {
    "lattice": [(0, 0), (10, 0), (0, 10), (10, 10), (20, 0), (20, 10), (10, 20)],
    "line": [(5, 0), (1, 0), (4, 0), (-2, 0), (9, 0)],
    "decimals": [(-1, 25), (3, -4), (14, 14), (3, -4), (1, 9), (77, 31)],
    "three": [(0, 0), (31, -7), (8, 8)],
}


def workpiece(points: list[tuple[int, int]], step: Fraction = Fraction(1, 10)) -> Workpiece:
    """Holes on a grid of ``step`` mm, with a travel matrix that no coordinates explain."""
    n = len(points)
    x, y = (np.array([p[k] for p in points], dtype=np.int64) for k in (0, 1))
    noise = np.arange(n)[:, None] * np.arange(n)[None, :] * 5 % 7
    matrix = (np.abs(x[:, None] - x[None, :]) + noise).astype(np.int64)
    np.fill_diagonal(matrix, 0)
    ids = tuple(str(i + 1) for i in range(n))
    x[-1] += int(not x.any() and not y.any())  # times without places are explicit, or refused
    return Workpiece("board", ids, x, y, step, matrix=matrix)


def name(travel: Travel) -> str:
    tail = f"-{travel.axes}" if travel.model is Model.TRAPEZOIDAL else ""
    return f"{travel.model}{tail}"


@pytest.mark.parametrize("ends", ENDS.values(), ids=ENDS)
@pytest.mark.parametrize("travel", TRAVELS, ids=name)
def test_every_travel_model_and_kind_of_ends(variant, travel, ends, optimum, holds):
    if travel.model is Model.EXPLICIT and ends.home is not None:
        with pytest.raises(UsageError, match="no travel times"):
            Instance(workpiece(BOARDS["three"]), travel, ends)
        return
    turn = (TRAVELS.index(travel) + list(ENDS.values()).index(ends)) % 2
    for points in list(BOARDS.values())[turn::2]:  # every board, in half of the combinations
        instance = Instance(workpiece(points), travel, ends)
        holds(instance, variant, optimum(instance))


@pytest.mark.parametrize("n", [1, 2])
def test_one_and_two_holes(variant, n, optimum, holds):
    piece = workpiece([(3, 4), (-5, 6)][:n])
    for ends in (
        Ends(),
        Ends(closed=True),
        Ends(start=n - 1),
        Ends(end=n - 1),
        Ends(start=0, end=n - 1),
        Ends(home=HOME, outward=True),
        Ends(home=HOME, back=True, start=0),
        Ends(home=HOME, outward=True, back=True),
    ):
        instance = Instance(piece, Travel(), ends)
        holds(instance, variant, optimum(instance))
    if n == 2:
        for ends in (Ends(), Ends(closed=True), Ends(home=HOME, outward=True)):
            holds(Instance(piece, ends=ends, rules=Rules(forbidden=((0, 1),))), variant, None)


RULES = {
    "forbidden": Rules(forbidden=((0, 1), (0, 2), (5, 3))),
    "together": Rules(together=((0, 5), (6, 3))),
    "chain": Rules(together=((0, 5), (5, 3), (3, 1))),
    "both": Rules(together=((4, 6),), forbidden=((4, 5), (6, 2))),
    "jump": Rules(min_jump=Fraction(11, 10)),
    "too many together": Rules(together=((0, 1), (0, 2), (0, 3))),
    "a circle together": Rules(together=((0, 1), (1, 2), (2, 0))),
    "contradiction": Rules(together=((2, 5),), forbidden=((5, 2),)),
    "cut off": Rules(forbidden=tuple((2, i) for i in range(7) if i != 2)),
    "two halves": Rules(forbidden=tuple((i, j) for i in range(3) for j in range(3, 7))),
}


@pytest.mark.parametrize("rules", RULES.values(), ids=RULES)
@pytest.mark.parametrize("kind", ["free", "both", "closed", "outward", "round-both"])
def test_rules_are_respected_or_infeasible(variant, kind, rules, optimum, holds):
    instance = Instance(workpiece(BOARDS["lattice"]), Travel(), ENDS[kind], rules)
    holds(instance, variant, optimum(instance))


small = st.integers(-6, 6)
SHAPES = {
    "lattice": st.tuples(st.integers(0, 2), st.integers(0, 2)),
    "line": st.tuples(small, st.just(3)),
    "anywhere": st.tuples(st.integers(-9999, 9999), st.integers(-9999, 9999)),
    "corners": st.tuples(st.sampled_from([-1, 1]), st.sampled_from([-1, 1])),
}
speeds = st.fractions(Fraction(1, 3), 5, max_denominator=4)


@st.composite
def instances(draw: st.DrawFn) -> Instance:
    shape = SHAPES[draw(st.sampled_from(sorted(SHAPES)))]
    points = draw(st.lists(shape, min_size=1, max_size=7))
    n = len(points)
    hole = st.integers(0, n - 1)
    step = draw(st.sampled_from([Fraction(1), Fraction(1, 1000), Fraction(254, 10_000)]))
    travel = Travel(
        draw(st.sampled_from([m for m in Model if m is not Model.EXPLICIT])),
        vx=draw(speeds),
        vy=draw(speeds),
        ax=draw(speeds),
        ay=draw(speeds),
        quantum=draw(st.sampled_from([None, Fraction(1, 100)])),
    )
    start, end = draw(st.one_of(st.none(), hole)), draw(st.one_of(st.none(), hole))
    if start == end:
        end = None
    closed, outward, back = draw(st.booleans()), draw(st.booleans()), draw(st.booleans())
    if closed:
        ends = Ends(start=start, closed=True)
    else:
        home = HOME if outward or back else None
        ends = Ends(start, end, home, outward, back)
    pairs = st.lists(st.tuples(hole, hole).filter(lambda p: p[0] != p[1]), max_size=3 * (n > 1))
    rules = Rules(tuple(draw(pairs)), tuple(draw(pairs)) if draw(st.booleans()) else ())
    instance = Instance(workpiece(points, step), travel, ends, rules)
    try:
        assert instance.form.size >= n
    except UsageError:  # these numbers need more than 62 bits
        reject()
    return instance


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(instance=instances())
def test_whatever_hypothesis_invents(variant, optimum, holds, instance):
    holds(instance, variant, optimum(instance))


@settings(max_examples=60, deadline=None)
@given(instance=instances())
def test_auto_proves_small_workpieces_and_says_how(optimum, instance):
    result = solve(instance, exact=True)
    assert result.cost == optimum(instance)
    assert result.solver in SOLVERS
    assert result.details["auto"].startswith(result.solver)
