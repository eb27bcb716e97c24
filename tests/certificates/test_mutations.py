"""Ten thousand seeded mutations: whatever the checker accepts is true."""

from __future__ import annotations

import pytest

from tests.certificates.mutation_run import Tally, bases, kinds, lies, run


@pytest.fixture(scope="module")
def texts():
    return bases(4)


def test_claims_one_granule_too_high_are_refused(texts):
    tally = Tally()
    for text in lies(texts):
        tally.add("lie", text, "ask")
    assert tally.refused["lie"] == tally.tried["lie"] > 40


def test_mutations_are_refused_or_still_true(texts):
    tally = run(10_000, seed=1, texts=texts + lies(texts))
    assert not tally.false, tally.false[0]
    assert sum(tally.tried.values()) == 10_000
    assert set(tally.tried) == set(kinds())
    assert all(tally.refused[kind] > 20 for kind in kinds())
    harmless = ("potential", "claim_without_route", "hole_id, new hash", "coordinate, new hash")
    assert all(tally.accepted[kind] > 20 for kind in harmless)  # it does not refuse everything
