"""What a node may be branched on: clusters of nodes, however many tours lead through them."""

from __future__ import annotations

import itertools

import networkx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Ends, Instance, Model, Travel, Workpiece
from tcp.exact.branch_and_cut import branching
from tcp.exact.branch_and_cut import clusters as clusters_file
from tcp.exact.branch_and_cut.branching import Brancher, Decision
from tcp.exact.branch_and_cut.clusters import clusters
from tcp.exact.branch_and_cut.cuts import Cut, Family
from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.branch_and_cut.relaxation import Relaxation
from tcp.exact.branch_and_cut.run import unit_of
from tcp.exact.branch_and_cut.support import Support


def problem_of(points: list[tuple[int, int]], closed: bool = False) -> Problem:
    x, y = np.array(points, np.int64).T
    names = tuple(map(str, range(len(points))))
    piece = Workpiece("points", names, x, y)
    return Problem.of(Instance(piece, Travel(Model.SIMULTANEOUS), Ends(closed=closed)))


def grid(x: int, y: int, pitch: int, side: int = 3) -> list[tuple[int, int]]:
    return [(x + pitch * a, y + pitch * b) for a in range(side) for b in range(side)]


def sets_of(cuts: list[Cut]) -> list[list[int]]:
    return [cut.nodes.tolist() for cut in cuts]


def test_grids_are_clusters_and_what_is_inside_them_is_not():
    problem = problem_of([*grid(0, 0, 10), *grid(100, 0, 10), *grid(1000, 0, 15)])
    assert sets_of(clusters(problem)) == [
        list(range(18, 27)),
        list(range(18)),
        list(range(9)),
        list(range(9, 18)),
    ]


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 12), st.integers(0, 12)), min_size=4, max_size=9))
def test_clusters_are_what_pairs_up_to_some_cost_connect(points):
    problem = problem_of(points)  # so few holes are all neighbours of each other
    real = range(problem.form.real)
    pairs = [(i, j, problem.form.cost(i, j)) for i, j in itertools.combinations(real, 2)]
    expected = set()
    for bound in {cost for _, _, cost in pairs}:
        graph = networkx.Graph((i, j) for i, j, cost in pairs if cost <= bound)
        graph.add_nodes_from(real)
        expected |= {
            tuple(sorted(part))
            for part in networkx.connected_components(graph)
            if 3 <= len(part) <= problem.size - 3 and len(part) < len(real)
        }
    assert {tuple(nodes) for nodes in sets_of(clusters(problem))} == expected


def test_those_that_lie_farthest_apart_are_kept(monkeypatch):
    problem = problem_of([*grid(0, 0, 10), *grid(100, 0, 10), *grid(1000, 0, 15)])
    everything = sets_of(clusters(problem))
    monkeypatch.setattr(clusters_file, "MOST", 2)
    assert sets_of(clusters(problem)) == everything[:2]


def between(problem: Problem, ways: int) -> Support:
    """Two grids of nine nodes, in rows, with so many ways between them."""
    inner = [(i, i + 1) for i in (0, 1, 3, 4, 6, 7)]
    pairs = inner + [(i + 9, j + 9) for i, j in inner] + [(k, k + 9) for k in range(ways)]
    i, j = np.array(pairs).T
    return Support.of(problem.size, i, j, np.ones(len(i)))


@pytest.mark.parametrize("ways", [2, 3, 4])
def test_a_cluster_that_is_entered_three_times_is_undecided(ways):
    problem = problem_of([*grid(0, 0, 10), *grid(100, 0, 10)], closed=True)
    found = branching._undecided(problem, between(problem, ways), Family.of(clusters(problem)), 9)
    assert sets_of(found) == ([list(range(9)), list(range(9, 18))] if ways == 3 else [])


@pytest.mark.parametrize(("gain", "chosen"), [(0.0, True), (5.0, False)])
def test_clusters_are_tried_where_nothing_else_gains(gain, chosen, monkeypatch):
    problem = problem_of([*grid(0, 0, 10), *grid(100, 0, 10)], closed=True)
    brancher = Brancher(Relaxation(problem, problem.neighbours, unit_of(problem)), None)
    other = Decision(1, None, (gain, gain))

    def best(_, pairs, sets, cap):
        known = any(part.nodes.tolist() == list(range(9)) for part in sets)
        return Decision(-1, sets[0], (1.0, 1.0)) if known and not pairs else other

    monkeypatch.setattr(Brancher, "_best", best)
    monkeypatch.setattr(Brancher, "_pairs", lambda *_: [1])
    found = brancher.choose(between(problem, 3), np.arange(18), 100.0)
    assert (found.cut is not None) == chosen
