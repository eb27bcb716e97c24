"""TSPLIB files: the file's own distances, matrices in every symmetric layout, tours out."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Ends, Instance, Model, Travel
from tcp.files import read
from tcp.files.route import route_tour
from tcp.files.tsplib import TRAVELS

POINTS = [("1", "0", "0"), ("2", "1.5", "2"), ("3", "-1e0", "2.25")]


def problem(tmp_path, kind, body, n=3):
    path = tmp_path / "p.tsp"
    head = f"NAME : three\nTYPE : TSP\nDIMENSION : {n}\nEDGE_WEIGHT_TYPE : {kind}\n"
    path.write_text(head + body + "EOF\n")
    return path


def points_file(tmp_path, kind, points=POINTS):
    rows = "".join(f" {' '.join(row)}\n" for row in points)
    return problem(tmp_path, kind, f"NODE_COORD_SECTION\n{rows}", len(points))


def nint(value: float) -> int:
    return int(value + 0.5)


OFFICIAL = {  # TSPLIB 95, section 2
    "EUC_2D": lambda dx, dy: nint(math.sqrt(dx * dx + dy * dy)),
    "CEIL_2D": lambda dx, dy: math.ceil(math.sqrt(dx * dx + dy * dy)),
    "MAN_2D": lambda dx, dy: nint(abs(dx) + abs(dy)),
    "MAX_2D": lambda dx, dy: max(nint(abs(dx)), nint(abs(dy))),
}


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(sorted(OFFICIAL)),
    st.lists(st.tuples(*[st.integers(-4000, 4000)] * 2), min_size=2, max_size=6),
)
def test_distances_are_the_official_ones(tmp_path_factory, kind, quarters):
    """Coordinates in quarters are exact as floats, so the official formulas are exact too."""
    rows = [(str(i + 1), f"{x / 4}", f"{y / 4}") for i, (x, y) in enumerate(quarters)]
    found = read(points_file(tmp_path_factory.mktemp("tsp"), kind, rows))
    assert found.travel == TRAVELS[kind]
    costs = Instance(found.workpiece, found.travel, Ends(closed=True)).form.full_matrix()
    for i, (xi, yi) in enumerate(quarters):
        for j, (xj, yj) in enumerate(quarters):
            assert costs[i, j] == OFFICIAL[kind]((xi - xj) / 4, (yi - yj) / 4), (kind, i, j)


def test_points_are_kept_exactly(tmp_path):
    found = read(points_file(tmp_path, "EUC_2D"))
    assert found.workpiece.name == "three"
    assert found.workpiece.ids == ("1", "2", "3")
    assert found.workpiece.hole(2).y == Fraction(9, 4)


MATRIX = np.array([[0, 1, 2, 3], [1, 0, 4, 5], [2, 4, 0, 6], [3, 5, 6, 0]])
LAYOUTS = {
    "FULL_MATRIX": "0 1 2 3\n1 0 4 5\n2 4 0 6\n3 5 6 0\n",
    "UPPER_ROW": "1 2 3\n4 5\n6\n",
    "LOWER_ROW": "1\n2 4\n3 5 6\n",
    "UPPER_DIAG_ROW": "0 1 2 3 0 4 5 0 6 0\n",
    "LOWER_DIAG_ROW": "0\n1 0\n2 4 0\n3 5 6 0\n",
    "UPPER_COL": "1\n2 4\n3 5 6\n",
    "LOWER_COL": "1 2 3\n4 5\n6\n",
    "UPPER_DIAG_COL": "0\n1 0\n2 4 0\n3 5 6 0\n",
    "LOWER_DIAG_COL": "0 1 2 3\n0 4 5\n0 6\n0\n",
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_matrices_in_every_symmetric_layout(tmp_path, layout):
    body = f"EDGE_WEIGHT_FORMAT: {layout}\nEDGE_WEIGHT_SECTION\n{LAYOUTS[layout]}"
    found = read(problem(tmp_path, "EXPLICIT", body, 4))
    assert found.travel == Travel(Model.EXPLICIT)
    assert np.array_equal(found.workpiece.matrix, MATRIX)
    assert Instance(found.workpiece, found.travel).cost((0, 1, 2, 3)) == 1 + 4 + 6


def test_a_matrix_may_carry_coordinates_for_display(tmp_path):
    body = (
        "EDGE_WEIGHT_FORMAT: UPPER_ROW\nDISPLAY_DATA_TYPE: TWOD_DISPLAY\n"
        "EDGE_WEIGHT_SECTION\n1 2\n3\nDISPLAY_DATA_SECTION\n1 5 6\n2 7 8\n3 9 9\n"
    )
    piece = read(problem(tmp_path, "EXPLICIT", body)).workpiece
    assert piece.hole(1).x == 7 and piece.matrix[0, 2] == 2


def test_tours_are_written_as_tsplib_has_them(tmp_path):
    piece = read(points_file(tmp_path, "EUC_2D")).workpiece
    assert route_tour(piece, (2, 0, 1), ["open path\nof three"]).splitlines() == [
        "NAME : three.tour",
        "COMMENT : open path of three",
        "TYPE : TOUR",
        "DIMENSION : 3",
        "TOUR_SECTION",
        "3",
        "1",
        "2",
        "-1",
        "EOF",
    ]


def test_published_tours_have_their_published_length(corpus):
    """The optimal tours that come with TSPLIB, measured with our distances."""
    for name, length in (("berlin52", 7542), ("eil51", 426), ("st70", 675), ("a280", 2579)):
        found = read(corpus / "tsplib" / f"{name}.tsp")
        words = (corpus / "tsplib" / f"{name}.opt.tour").read_text().split()
        tour = [int(w) - 1 for w in words[words.index("TOUR_SECTION") + 1 :] if w.isdigit()]
        instance = Instance(found.workpiece, found.travel, Ends(closed=True))
        assert instance.cost(tour) == length, name
