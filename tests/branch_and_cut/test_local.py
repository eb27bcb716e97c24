"""Local cuts against all tours: valid, tight, violated, and nothing missed in a full view."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp.exact.branch_and_cut.keyholes import Growing
from tcp.exact.branch_and_cut.local import PARTS, UNIT, cut_of, shortest_tour
from tcp.exact.branch_and_cut.support import Support
from tests.branch_and_cut.test_keyholes import keyholes, mean_of_tours
from tests.branch_and_cut.test_separation import (
    SIZE,
    assert_holds_for_all_tours,
    half_integral,
    left,
    mixture,
)


def cuts_of(support: Support, most: int = 10):
    return keyholes().cuts(support, [], [Growing(most)])


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_the_right_hand_side_is_the_least_of_all_tours(seed):
    rng = np.random.default_rng(seed)
    parts = int(rng.integers(2, 7))
    sets = [rng.choice(SIZE, int(rng.integers(1, SIZE)), False) for _ in range(parts)]
    cut = cut_of(sets, rng.integers(1, 6, parts).tolist(), SIZE)
    assert cut.local
    assert_holds_for_all_tours(cut, SIZE)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10**6), size=st.integers(2, 7))
def test_shortest_tours_agree_with_trying_all(seed, size):
    lengths = np.random.default_rng(seed).integers(0, 50, (size, size)).astype(np.int32)
    lengths = lengths + lengths.T
    tour, length = shortest_tour(lengths)
    assert sorted(tour.tolist()) == list(range(size))
    assert lengths[tour, np.roll(tour, -1)].sum() == length
    tried = (np.array([0, *p]) for p in itertools.permutations(range(1, size)))
    assert length == min(lengths[t, np.roll(t, -1)].sum() for t in tried)


@pytest.mark.parametrize("size", [2, 3, 8, 15, PARTS])
@pytest.mark.parametrize("top", [5, UNIT // 2])
def test_shortest_tours_along_a_line_go_there_and_back(size, top):
    place = np.random.default_rng(size).integers(0, top + 1, size)
    lengths = np.abs(place[:, None] - place).astype(np.int32)
    tour, length = shortest_tour(lengths)
    assert sorted(tour.tolist()) == list(range(size))
    assert length == lengths[tour, np.roll(tour, -1)].sum() == 2 * np.ptp(place)


@settings(max_examples=150, deadline=None)
@given(seed=st.integers(0, 10**6), parts=st.integers(2, 5))
def test_local_cuts_are_violated_and_valid(seed, parts):
    support = mixture(SIZE, seed, parts)
    for cut in cuts_of(support):
        assert_holds_for_all_tours(cut, SIZE)
        assert left(support, cut) < cut.rhs - 1e-3


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), parts=st.integers(1, 4))
def test_a_mixture_of_tours_violates_nothing(seed, parts):
    assert cuts_of(mean_of_tours(seed, parts)) == []


@pytest.mark.parametrize("size", [9, 12, 15, 18])
def test_what_a_comb_sees_a_keyhole_sees(size):
    """Two triangles of half edges joined by three paths: no tour looks like that."""
    support = half_integral(size, seed=size)
    cuts = cuts_of(support)
    assert cuts
    assert all(left(support, cut) < cut.rhs - 1e-3 for cut in cuts)


def test_more_parts_than_certificates_know_are_refused():
    sets = [np.array([2 * k, 2 * k + 1]) for k in range(PARTS)]
    with pytest.raises(ValueError, match="at most"):
        cut_of(sets, [1] * PARTS, 2 * PARTS + 1)


def test_weights_are_taken_as_long_as_tours_of_them_fit():
    sets, most = [np.array([0, 1]), np.array([2, 3])], (1 << 30) // PARTS
    for weight in (1, most // 2):
        assert cut_of(sets, [weight] * 2, 9).rhs == 4 * weight
    for weights in ([most, 1], [1 << 40, 1], [1 << 80, 1]):
        with pytest.raises(ValueError, match="weights"):
            cut_of(sets, weights, 9)
