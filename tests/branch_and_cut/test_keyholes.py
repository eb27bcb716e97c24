"""The search for local cuts: what it remembers, when it goes on, and when it stops."""

from __future__ import annotations

import numpy as np
import pytest

from tcp.exact.branch_and_cut.cuts import Cut
from tcp.exact.branch_and_cut.keyholes import FEW, LEVELS, MANY, Growing, Keyholes, Meeting
from tcp.exact.branch_and_cut.local import PARTS
from tcp.exact.branch_and_cut.support import Support
from tests.branch_and_cut.test_separation import SIZE, THREADS, TOURS, half_integral


def keyholes(stopped: bool = False, seed: int = 0) -> Keyholes:
    return Keyholes(lambda: stopped, THREADS, np.random.default_rng(seed))


def mean_of_tours(seed: int, parts: int) -> Support:
    """A point of the tours' convex hull: it satisfies every valid inequality."""
    x = np.zeros((SIZE, SIZE))
    for tour in TOURS[np.random.default_rng(seed).choice(len(TOURS), parts, False)]:
        following = np.roll(tour, -1)
        np.add.at(x, (np.minimum(tour, following), np.maximum(tour, following)), 1.0 / parts)
    i, j = np.nonzero(x)
    return Support.of(SIZE, i, j, x[i, j])


def test_sights_without_violation_are_not_looked_at_again(monkeypatch):
    support, looking = mean_of_tours(5, 4), keyholes()
    assert looking.cuts(support, [], [Growing(6)]) == []
    assert looking.clean
    monkeypatch.setattr(looking, "_look", lambda sight: pytest.fail("looked at again"))
    assert looking.cuts(support, [], [Growing(6)]) == []


def test_a_stop_ends_the_search_and_nothing_is_called_clean():
    looking = keyholes(stopped=True)
    assert looking.cuts(half_integral(12, 1), [], [Growing(10)]) == []
    assert not looking.clean


@pytest.mark.parametrize(
    ("found", "least", "steps"),
    [(FEW, 1, 1), (FEW - 1, 1, 2), (FEW, 2, 2), (MANY, 2, 1), (MANY // 2, 3, 2), (0, 2, 3)],
)
def test_further_steps_are_taken_while_few_cuts_are_found(monkeypatch, found, least, steps):
    taken = []

    def seen(sights, size, shown):
        taken.append(list(sights))
        first = len(taken) * found
        return [Cut.of([[0, k + 1]]) for k in range(first, first + found)]

    looking = keyholes()
    monkeypatch.setattr(looking, "seen", seen)
    growing = [Growing(6), Growing(8), Growing(10)]
    cuts = looking.cuts(half_integral(12, 1), [], growing[: max(least + 1, steps)], least)
    assert len(taken) == steps and len(cuts) == steps * found


def test_a_later_step_looks_nowhere_twice_and_counts_no_cut_again(monkeypatch):
    looking, looks = keyholes(), []
    real = looking._look
    monkeypatch.setattr(looking, "_look", lambda sight: looks.append(sight.name) or real(sight))
    support = half_integral(24, 1)
    once = looking.cuts(support, [], [Growing(10)])
    assert once
    looking.clean.clear()
    looks.clear()
    again = looking.cuts(support, [], [Growing(10), Growing(10), Growing(10)], 3)
    assert [cut.key for cut in again] == [cut.key for cut in once]
    assert len(looks) == len(set(looks))


def test_chance_shows_other_sights_and_the_same_for_the_same_seed():
    support = half_integral(60, seed=1)

    def names(looking: Keyholes, step: Growing) -> list[bytes]:
        return [sight.name for sight in looking._sights(step, support, [])]

    plain, chance = Growing(10), Growing(10, chance=True)
    assert names(keyholes(seed=1), plain) == names(keyholes(seed=2), plain)
    assert names(keyholes(seed=1), chance) == names(keyholes(seed=1), chance)
    assert set(names(keyholes(seed=1), chance)) - set(names(keyholes(seed=2), chance))


def test_all_steps_keep_to_the_parts_that_certificates_know():
    steps = [step for level in LEVELS for step in level]
    assert all(4 <= step.most <= PARTS for step in steps)
    assert all(step.least <= step.most for step in steps if isinstance(step, Meeting))
