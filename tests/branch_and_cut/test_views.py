"""Views from near and afar: what becomes an atom, and what only a view from afar shows."""

from __future__ import annotations

import numpy as np

from tcp.exact.branch_and_cut import views
from tcp.exact.branch_and_cut.keyholes import Growing
from tcp.exact.branch_and_cut.support import Support, groups
from tcp.exact.branch_and_cut.views import ONE, VIEWS, Shrunk, View
from tests.branch_and_cut.test_keyholes import keyholes
from tests.branch_and_cut.test_separation import half_integral, left


def support_of(size: int, edges: dict[tuple[int, int], float]) -> Support:
    i, j = np.array(list(edges)).T
    return Support.of(size, i.astype(np.int64), j.astype(np.int64), np.array(list(edges.values())))


LADDER = support_of(
    7,
    {
        (0, 1): 1.0,  # a column
        (2, 3): 1.0,  # another one, tied to the first by halves at both ends
        (0, 2): 0.5,
        (1, 3): 0.5,
        (4, 5): 0.97,  # nearly whole
        (0, 4): 0.5,
        (1, 4): 0.5,
        (4, 6): 0.03,
        (2, 5): 0.5,
        (3, 6): 0.5,
        (5, 6): 0.5,
    },
)


def atoms(view: View) -> list[list[int]]:
    graph = Shrunk.of(LADDER, view)
    members = [nodes.tolist() for nodes in groups(graph.atom)]
    assert len(members) == graph.count
    assert sorted(v for nodes in members for v in nodes) == list(range(LADDER.size))
    return sorted(members)


def test_atoms_are_paths_of_edges_that_are_nearly_whole():
    assert atoms(View(ONE)) == [[0, 1], [2, 3], [4], [5], [6]]
    assert atoms(View(0.95)) == [[0, 1], [2, 3], [4, 5], [6]]


def test_one_end_of_each_path_may_stand_apart():
    assert atoms(View(ONE, ends_apart=True)) == [[0], [1], [2], [3], [4], [5], [6]]


def test_atoms_with_as_much_between_them_as_an_edge_are_paired():
    assert atoms(View(ONE, paired=1)) == [[0, 1, 2, 3], [4, 5], [6]]
    assert atoms(View(ONE, paired=2)) == [[0, 1, 2, 3, 4, 5], [6]]
    assert atoms(View(ONE, paired=9)) == [[0, 1, 2, 3, 4, 5, 6]]


def test_edges_between_atoms_keep_their_weight():
    graph = Shrunk.of(LADDER, View(0.95))
    weight = np.zeros((graph.count, graph.count))
    for a in range(graph.count):
        for e in range(graph.ptr[a], graph.ptr[a + 1]):
            weight[a, graph.other[e]] += graph.weight[e]
    assert (weight == weight.T).all()
    first, second = graph.atom[0], graph.atom[2]
    assert weight[first, second] == 1.0
    assert weight[first].sum() == 2.0


def paths_of(support: Support) -> list[list[int]]:
    """The three paths of whole edges of :func:`half_integral`, ends included."""
    whole = support.x == 1.0
    near: dict[int, list[int]] = {v: [] for v in range(support.size)}
    for i, j in zip(support.i[whole].tolist(), support.j[whole].tolist(), strict=True):
        near[i].append(j)
        near[j].append(i)
    paths: list[list[int]] = []
    for end in (v for v in near if len(near[v]) == 1):
        if any(end in path for path in paths):
            continue
        path = [end]
        while fresh := [v for v in near[path[-1]] if v not in path]:
            path += fresh
        paths.append(path)
    return paths


def test_what_is_hidden_from_near_is_seen_from_afar(monkeypatch):
    """Two odd cycles of halves joined by three long paths, with a little of a tour mixed in."""
    base, share = half_integral(60, seed=1), 0.02
    paths = paths_of(base)
    tour = [v for k in range(0, len(paths[0]), 3) for path in paths for v in path[k : k + 3]]
    edges = {
        (i, j): (1 - share) * x
        for i, j, x in zip(base.i.tolist(), base.j.tolist(), base.x.tolist(), strict=True)
    }
    for a, b in zip(tour, [*tour[1:], tour[0]], strict=True):
        key = (min(a, b), max(a, b))
        edges[key] = edges.get(key, 0.0) + share
    support = support_of(base.size, edges)

    def seen():
        return keyholes().cuts(support, [], [Growing(10)])

    cuts = seen()
    assert cuts
    assert all(left(support, cut) < cut.rhs - 1e-3 for cut in cuts)
    monkeypatch.setattr(views, "VIEWS", VIEWS[:2])
    assert seen() == []
