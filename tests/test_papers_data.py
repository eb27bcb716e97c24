"""The papers' workpieces: what the papers themselves print about them holds for our data."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from tcp import Instance, Model, Travel, Workpiece
from tcp.files import read

DATA = Path(__file__).resolve().parents[1] / "data"


def piece(name: str) -> Workpiece:
    return read(DATA / f"{name}.csv").workpiece


def times(name: str, model: Model) -> np.ndarray:
    instance = Instance(piece(name), Travel(model))
    n = len(instance)
    return instance.form.full_matrix()[:n, :n] * float(instance.quantum)


CASE_1 = [[0, 3, 4, 3, 2], [3, 0, 3, 2, 5], [4, 3, 0, 3, 6], [3, 2, 3, 0, 3], [2, 5, 6, 3, 0]]
CASE_2 = [[0, 2, 4, 2, 2], [2, 0, 2, 2, 3], [4, 2, 0, 2, 4], [2, 2, 2, 0, 3], [2, 3, 4, 2, 0]]


def test_the_cuckoo_papers_evaluation_matrices():
    """Section 3.3.2, row by row as the paper lists them.

    The printed matrix for Case 2 is not symmetric: between holes 4 and 5, at (3, 3) and
    (1, 4), it has 3 one way and 2 the other; max(2, 1) is 2.
    """
    assert times("five", Model.SEQUENTIAL).tolist() == CASE_1
    printed = np.array(CASE_2)
    differs = np.argwhere(times("five", Model.SIMULTANEOUS) != printed).tolist()
    assert differs == [[3, 4]] and printed[3, 4] == 3 and printed[4, 3] == 2


@pytest.mark.parametrize(
    ("name", "route", "time"),
    [
        ("wp2", "1 5 6 9 12 11 10 14 13 8 7 4 3 2", 280),
        ("fa14", "2 3 4 7 8 13 14 10 11 12 9 6 5 1", 280),
        ("fa14", "1 5 6 9 12 11 10 14 13 8 7 4 3 2", 280),
    ],
)
def test_published_routes_have_their_published_time(name, route, time):
    instance = Instance(piece(name))
    order = [instance.workpiece.index[hole] for hole in route.split()]
    assert instance.cost(order) * instance.quantum == time


def test_fa14_is_wp2_turned_over_and_rounded():
    ours, theirs = piece("wp2"), piece("fa14")
    for i in range(14):
        a, b = ours.hole(i), theirs.hole(i)
        assert abs(a.x - b.x) <= Fraction(1, 100) and abs(70 - a.y - b.y) <= Fraction(1, 100)


def test_wp3_keeps_its_suspected_misprints_as_printed():
    """Board patterns repeat at a distance; holes 14, 26 and 46 break them (see data/wp3.csv)."""
    wp3 = piece("wp3")

    def at(number: int) -> tuple[Fraction, Fraction]:
        hole = wp3.hole(number - 1)
        return hole.x, hole.y

    broken = []
    for first, second in ((1, 13), (7, 19)):
        dx, dy = (b - a for a, b in zip(at(first), at(second), strict=True))
        for k in range(6):
            x, y = at(first + k)
            if at(second + k) != (x + dx, y + dy):
                broken.append(second + k)
    assert broken == [14]
    assert at(26) == (Fraction("273.248"), at(25)[1]) and at(39)[1] == at(26)[0]
    assert at(46) == (Fraction("342.455"), at(45)[1]) and at(36)[1] == at(46)[0]
