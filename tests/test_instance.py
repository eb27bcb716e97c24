"""Workpieces and instances: exact coordinates, tour forms, ends, granularity."""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Ends, Instance, Model, Rules, Travel, Workpiece
from tcp.errors import InputError, UsageError
from tcp.result import decimal
from tcp.solve import solve
from tcp.stop import Stop
from tcp.validate.route import faults
from tcp.workpiece import INCH


def board(*holes: tuple[str, str]) -> Workpiece:
    return Workpiece.from_decimals("board", holes)


SQUARE = board(("0", "0"), ("0", "1"), ("2", "1"), ("2", "0"))


def test_decimals_are_kept_exactly():
    piece = board(("0.1", "0.2"), ("0.3", "1e1"))
    assert piece.hole(0).x == Fraction(1, 10)
    assert piece.hole(1).y == 10
    inch = Workpiece.from_decimals("inch", [("0.1", "1")], unit=INCH)
    assert inch.hole(0).x == Fraction(254, 100)


@pytest.mark.parametrize("bad", ["nan", "inf", "1e308", "x", 0.1, "1" * 70, "1e-40"])
def test_what_is_not_a_length_is_refused(bad):
    with pytest.raises(InputError):
        board((bad, "0"))


def test_huge_grids_are_refused():
    with pytest.raises(InputError, match="check the units"):
        board(("1000000000", "0"), ("0.0000001", "0"))


def test_ids_are_unique_and_there_is_a_hole():
    with pytest.raises(InputError, match="unique"):
        Workpiece.from_decimals("twice", [("0", "0"), ("1", "1")], ids=["a", "a"])
    with pytest.raises(InputError, match="at least one hole"):
        Workpiece.from_decimals("none", [])


def test_coincident_holes_are_reported():
    assert board(("0", "0"), ("1", "0"), ("0.0", "0")).coincident == (("1", "3"),)
    places = ("1", "0", "1", "2", "0", "1", "3")
    assert board(*((x, "5") for x in places)).coincident == (("1", "3", "6"), ("2", "5"))


def path_cost(instance: Instance, order: tuple[int, ...]) -> Fraction:
    """Cost of a route straight from the definition of the ends, sequential travel."""
    ends, piece = instance.ends, instance.workpiece
    places = [(piece.hole(i).x, piece.hole(i).y) for i in order]
    if ends.closed:
        places.append(places[0])
    if ends.outward:
        places.insert(0, ends.home)
    if ends.back:
        places.append(ends.home)
    return sum(
        (abs(p[0] - q[0]) + abs(p[1] - q[1]) for p, q in itertools.pairwise(places)), Fraction(0)
    )


HOME = (Fraction(-1, 3), Fraction(1, 2))
ENDS = [
    Ends(),
    Ends(start=1),
    Ends(end=2),
    Ends(start=0, end=2),
    Ends(closed=True),
    Ends(closed=True, start=2),
    Ends(home=HOME, outward=True),
    Ends(home=HOME, back=True),
    Ends(home=HOME, outward=True, back=True),
    Ends(home=HOME, outward=True, start=1),
    Ends(home=HOME, back=True, start=1, end=3),
    Ends(home=HOME, outward=True, back=True, start=3, end=0),
]


@pytest.mark.parametrize("ends", ENDS, ids=str)
def test_tour_form_and_route_agree(ends):
    instance = Instance(SQUARE, ends=ends)
    form = instance.form
    for order in itertools.permutations(range(4)):
        if faults(instance, order):
            continue
        tour = instance.tour(order)
        edges = {(min(e), max(e)) for e in zip(tour, tour[1:] + tour[:1], strict=True)}
        assert sorted(tour) == list(range(form.size))
        assert set(form.forced) <= edges
        assert instance.cost(order) * instance.quantum == path_cost(instance, order)
        for turned in (tour, tour[::-1], tour[2:] + tour[:2]):
            back = instance.route(turned)
            assert faults(instance, back) == []
            assert instance.cost(back) == instance.cost(order)


@pytest.mark.parametrize("ends", ENDS, ids=str)
def test_forced_edges_are_all_that_fixes_the_ends(ends):
    """Every cyclic tour with the forced edges is a valid route, turned the right way."""
    instance = Instance(SQUARE, ends=ends)
    for rest in itertools.permutations(range(1, instance.form.size)):
        tour = [0, *rest]
        edges = {(min(e), max(e)) for e in zip(tour, tour[1:] + tour[:1], strict=True)}
        if set(instance.form.forced) <= edges:
            assert faults(instance, instance.route(tour)) == []


@pytest.mark.parametrize("n", [1, 2])
@pytest.mark.parametrize(
    "ends", [Ends(), Ends(closed=True), Ends(home=HOME, outward=True, back=True)]
)
def test_tiny_workpieces(n, ends):
    instance = Instance(board(*[(str(i), "0") for i in range(n)]), ends=ends)
    order = tuple(range(n))
    assert instance.route(instance.tour(order)) == order
    assert instance.cost(order) * instance.quantum == path_cost(instance, order)


@pytest.mark.parametrize(
    "home", [("0", "1e-25"), ("1e-25", "0"), ("0", "1/4611686018427387904"), ("1e20", "0")]
)
@pytest.mark.parametrize("along", ["x", "y"])
def test_homes_that_no_grid_holds_are_refused(home, along):
    places = [("0", str(4 * k)) if along == "y" else (str(4 * k), "0") for k in range(4)]
    position = (Fraction(home[0]), Fraction(home[1]))
    with pytest.raises(UsageError, match="too many decimals"):
        Instance(board(*places), ends=Ends(home=position, outward=True)).cost(range(4))


@pytest.mark.parametrize("n", [4, 10])
def test_matrices_whose_times_add_up_too_high_are_refused(n):
    names = tuple(map(str, range(n)))
    none = np.zeros(n, np.int64)
    for largest in (2**61, 10**18, 2**61 // n):
        matrix = np.full((n, n), largest, np.int64)
        np.fill_diagonal(matrix, 0)
        piece = Workpiece("large", names, none, none, matrix=matrix)
        with pytest.raises(UsageError, match="61-bit"):
            Instance(piece, Travel(Model.EXPLICIT)).cost(range(n))
    matrix = np.minimum(matrix, 2**61 // (n + 1) - 1)
    piece = Workpiece("fits", names, none, none, matrix=matrix)
    instance = Instance(piece, Travel(Model.EXPLICIT))
    assert instance.cost(range(n)) == (n - 1) * (2**61 // (n + 1) - 1)


def test_contradicting_ends_are_refused():
    for bad in ({"closed": True, "end": 1}, {"outward": True}, {"home": HOME}):
        with pytest.raises(UsageError):
            Ends(**bad)
    with pytest.raises(UsageError, match="same hole"):
        Instance(SQUARE, ends=Ends(start=1, end=1))
    with pytest.raises(UsageError, match="not in"):
        Instance(SQUARE, ends=Ends(start=9))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"start": True}, "start is the position of a hole; it must be a whole number, not True"),
        ({"end": "1"}, "end is the position"),
        ({"home": (0.5, 0.1), "outward": True}, "a coordinate of home must be"),
        ({"home": ("0", "0"), "back": True}, "a coordinate of home must be"),
        ({"home": (0, 0, 0), "back": True}, "two coordinates"),
    ],
)
def test_ends_of_another_type_are_refused(given, words):
    with pytest.raises(UsageError, match=words):
        Ends(**given)


def test_holes_may_be_numpy_s_numbers():
    assert solve(Instance(SQUARE, ends=Ends(start=np.int64(2))), "held-karp").route[0] == 2


@pytest.mark.parametrize("pair", [("1", "2"), (0,), (0, 1, 2), (0, 1.0)])
def test_rules_name_two_holes_by_position(pair):
    with pytest.raises(UsageError, match=r"two different holes|by position"):
        Instance(SQUARE, rules=Rules(forbidden=(pair,)))


def test_a_matrix_has_zeros_on_its_diagonal():
    with pytest.raises(InputError, match="from a hole to itself"):
        Workpiece("one", ("a",), np.zeros(1, int), np.zeros(1, int), matrix=np.array([[5]]))


@pytest.mark.parametrize("name", ["diameters", "tools"])
def test_there_are_as_many_diameters_and_tools_as_holes(name):
    with pytest.raises(InputError, match=f"expected 2 {name} or none"):
        Workpiece.from_decimals("two", [("0", "0"), ("1", "0")], **{name: [None]})


@pytest.mark.parametrize(
    ("given", "words"),
    [({"stop": 5}, "stop must be a Stop"), ({"seed": 1.5}, "the seed must be a whole number")],
)
def test_calls_of_another_type_are_refused(given, words):
    with pytest.raises(UsageError, match=words):
        solve(Instance(SQUARE), **given)
    with pytest.raises(UsageError, match="time limit must be a number, 0 or more, not '5'"):
        Stop(time="5")


@settings(max_examples=100, deadline=None)
@given(
    st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), min_size=2, max_size=8),
    st.sampled_from([Model.SEQUENTIAL, Model.SIMULTANEOUS, Model.EUCLIDEAN]),
    st.integers(1, 6),
)
def test_granularity_divides_every_cost(points, model, stretch):
    piece = board(*[(str(x * stretch), str(y * stretch)) for x, y in points])
    instance = Instance(piece, Travel(model))
    costs = instance.form.full_matrix()
    g = instance.granularity
    assert g >= 1 and not (costs % g).any()
    from tcp.instance import _lattice_divisor

    assert not (costs % _lattice_divisor(instance.form)).any()


def test_a_checkerboard_has_even_costs():
    piece = board(("0", "0"), ("1", "1"), ("2", "0"), ("3", "1"))
    assert Instance(piece).granularity == 2


def test_minimum_jump_forbids_near_pairs():
    instance = Instance(SQUARE, rules=Rules(min_jump=Fraction(3, 2)))
    assert instance.form.forbidden == ((0, 1), (2, 3))
    assert faults(instance, (0, 1, 2, 3)) == [
        "holes 1 and 2 must not follow each other",
        "holes 3 and 4 must not follow each other",
    ]
    together = Instance(SQUARE, rules=Rules(together=((3, 0),)))
    assert faults(together, (0, 1, 2, 3)) == ["holes 1 and 4 must follow each other"]


def test_a_matrix_speaks_for_itself():
    matrix = np.array([[0, 7, 3], [7, 0, 5], [3, 5, 0]], dtype=np.int64)
    zeros = np.zeros(3, dtype=np.int64)
    piece = Workpiece("m", ("a", "b", "c"), zeros, zeros.copy(), matrix=matrix)
    instance = Instance(piece, Travel(Model.EXPLICIT))
    assert instance.cost((0, 2, 1)) == 8
    with pytest.raises(UsageError, match="no travel matrix"):
        Instance(SQUARE, Travel(Model.EXPLICIT))


def test_hashes_name_the_problem():
    a, b = Instance(SQUARE), Instance(board(("0", "0"), ("0", "1.0"), ("2", "1"), ("2", "0")))
    assert a.sha256 == b.sha256
    others = [Instance(SQUARE, Travel(vx=Fraction(2))), Instance(SQUARE, ends=Ends(start=1))]
    assert len({a.sha256, *(o.sha256 for o in others)}) == 3


@given(st.decimals(-(10**6), 10**6, allow_nan=False, places=6))
def test_decimal_strings_are_exact(value):
    assert Fraction(decimal(Fraction(value))) == Fraction(value)


def test_fractions_without_finite_decimals_stay_fractions():
    assert decimal(Fraction(1, 3)) == "1/3"
    assert decimal(Fraction(-5, 4)) == "-1.25"
