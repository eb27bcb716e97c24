"""Keyholes at tight cuts: the parts that sets make, who meets whom, and what is seen there."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp.exact.branch_and_cut.cuts import Cut
from tcp.exact.branch_and_cut.keyholes import Meeting
from tcp.exact.branch_and_cut.parts import sights
from tcp.exact.branch_and_cut.support import Support
from tests.branch_and_cut.test_keyholes import keyholes
from tests.branch_and_cut.test_separation import SIZE, assert_holds_for_all_tours, left, mixture


def random_sets(rng: np.random.Generator, size: int, count: int) -> list[np.ndarray]:
    return [rng.choice(size, int(rng.integers(1, size)), False) for _ in range(count)]


def parts_by_hand(sets: list[np.ndarray], size: int) -> list[list[int]]:
    """Nodes with the same membership, without those that are in no set."""
    groups: dict[tuple[bool, ...], list[int]] = {}
    for v in range(size):
        groups.setdefault(tuple(v in part for part in sets), []).append(v)
    groups.pop((False,) * len(sets), None)
    return sorted(groups.values())


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 10**6), count=st.integers(1, 4))
def test_atoms_are_the_parts_that_the_sets_make(seed, count):
    rng = np.random.default_rng(seed)
    sets = random_sets(rng, SIZE, count)
    cut = Cut.weighted(sets, [1] * count, 2)
    expected = parts_by_hand(sets, SIZE)
    support = mixture(SIZE, seed, 3)
    found = list(sights(support, [cut], 0, 2, 16))
    everything = sum(map(len, expected)) == SIZE
    if len(expected) - everything < 1:
        assert not found  # all nodes are one part
        return
    (sight,) = found
    atoms = sorted(sorted(atom.tolist()) for atom in sight.atoms)
    assert len(atoms) == len(expected) - everything  # one part is the rest if no node is left
    assert all(atom in expected for atom in atoms)
    assert_values_between(support, sight.atoms, sight.x)


def assert_values_between(support: Support, atoms, x):
    part = np.full(support.size, len(atoms))
    for k, nodes in enumerate(atoms):
        part[nodes] = k
    expected = np.zeros((len(atoms) + 1, len(atoms) + 1))
    for i, j, value in zip(part[support.i], part[support.j], support.x, strict=True):
        if i != j:
            expected[i, j] += value
            expected[j, i] += value
    assert np.allclose(x, expected)


def test_a_cut_meets_itself_and_those_with_the_greatest_share_of_its_nodes():
    support = mixture(12, 1, 3)
    one, near, far, apart = ([0, 1, 2, 3], [1, 2, 3, 4], [3, 4, 5, 6, 7], [9, 10])
    cuts = [Cut.of([nodes]) for nodes in (one, near, far, apart)]

    def met(partners: int) -> list[list[list[int]]]:
        found = sights(support, cuts, partners, 2, 16)
        return [sorted(atom.tolist() for atom in sight.atoms) for sight in found]

    alone = [[one], [near], [far], [apart]]
    assert met(0) == alone
    first, second = [[0], [1, 2, 3], [4]], [[1, 2], [3, 4], [5, 6, 7]]
    assert met(1) == [*alone, first, second]  # the third shares more with the second
    assert met(2) == [*alone, first, [[0, 1, 2], [3], [4, 5, 6, 7]], second]


@pytest.mark.parametrize(("least", "most"), [(4, 5), (5, 7), (7, 7)])
def test_only_sights_of_as_many_parts_as_wanted_are_shown(least, most):
    rng = np.random.default_rng(3)
    cuts = [Cut.of([part]) for part in random_sets(rng, SIZE, 12)]
    cuts += [Cut.weighted(random_sets(rng, SIZE, 3), [1, 1, 1], 2) for _ in range(12)]
    support = mixture(SIZE, 2, 3)
    sizes = {len(sight.x) for sight in sights(support, cuts, 5, least, most)}
    assert sizes and min(sizes) >= least and max(sizes) <= most
    assert all(len(s.atoms) == len(s.x) - 1 for s in sights(support, cuts, 5, least, most))


def test_without_cuts_nothing_meets():
    assert list(sights(mixture(SIZE, 1, 2), [], 5, 4, 16)) == []


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), parts=st.integers(2, 4))
def test_cuts_where_others_meet_are_violated_and_valid(seed, parts):
    rng = np.random.default_rng(seed)
    support = mixture(SIZE, seed, parts)
    cuts = [Cut.of([part]) for part in random_sets(rng, SIZE, 8)]
    for cut in keyholes().cuts(support, cuts, [Meeting(4, 4, 12)]):
        assert_holds_for_all_tours(cut, SIZE)
        assert left(support, cut) < cut.rhs - 1e-3


def test_what_no_single_cut_shows_two_that_meet_do():
    """Two triangles of half edges joined by three whole ones: no tour looks like that."""
    edges = {(0, 1): 0.5, (1, 2): 0.5, (0, 2): 0.5, (3, 4): 0.5, (4, 5): 0.5, (3, 5): 0.5}
    edges |= {(0, 3): 1.0, (1, 4): 1.0, (2, 5): 1.0}
    i, j = np.array(list(edges)).T
    support = Support.of(6, i, j, np.array(list(edges.values())))
    cuts = [Cut.weighted([[0, 1, 2], [0, 3]], [1, 1], 4), Cut.of([[1, 4]]), Cut.of([[2, 5]])]
    assert keyholes().cuts(support, cuts, [Meeting(0, 4, 12)]) == []
    found = keyholes().cuts(support, cuts, [Meeting(2, 4, 12)])
    assert found
    assert all(left(support, cut) < cut.rhs - 1e-3 for cut in found)
