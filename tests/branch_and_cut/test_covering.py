"""The small covering LP against HiGHS: rows a few at a time, and what ends it early."""

from __future__ import annotations

import highspy
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp.exact.branch_and_cut.covering import extended, minimised, opened, solution


def least(cost: np.ndarray, rows: np.ndarray) -> float:
    """The optimum by HiGHS."""
    h = highspy.Highs()
    h.silent()
    columns = np.arange(len(cost), dtype=np.int32)
    h.addVars(len(cost), np.zeros(len(cost)), np.full(len(cost), highspy.kHighsInf))
    h.changeColsCost(len(cost), columns, cost)
    h.addRows(
        len(rows),
        np.ones(len(rows)),
        np.full(len(rows), highspy.kHighsInf),
        rows.size,
        np.arange(len(rows), dtype=np.int32) * len(cost),
        np.tile(columns, len(rows)),
        rows.ravel(),
    )
    h.run()
    assert h.getModelStatus() == highspy.HighsModelStatus.kOptimal
    return h.getInfo().objective_function_value


def example(seed: int, columns: int, batches: int) -> tuple[np.ndarray, list[np.ndarray]]:
    """Costs that tie, and rows of 0, 2 and 4 as those of tours are; each row can be met."""
    rng = np.random.default_rng(seed)
    cost = rng.integers(4, 9, columns) / 2.0
    rows = [2.0 * rng.integers(0, 3, (int(rng.integers(1, 6)), columns)) for _ in range(batches)]
    for batch in rows:
        batch[:, int(rng.integers(columns))] = 2.0
    return cost, rows


@settings(max_examples=150, deadline=None)
@given(seed=st.integers(0, 10**6), columns=st.integers(1, 40), batches=st.integers(1, 8))
def test_every_extension_is_solved_as_by_highs(seed, columns, batches):
    cost, rows = example(seed, columns, batches)
    dictionary, basic, nonbasic = opened(cost), np.zeros(0, np.int64), np.arange(columns)
    before = 0.0
    for count in range(batches):
        dictionary, basic = extended(dictionary, basic, nonbasic, rows[count])
        assert minimised(dictionary, basic, nonbasic, np.inf)
        weights, value = solution(dictionary, basic), dictionary[-1, -1]
        assert (weights >= 0).all()
        assert abs(cost @ weights - value) < 1e-7
        assert (rows[count] @ weights > 1 - 1e-7).all()
        assert before - 1e-9 <= value <= least(cost, np.concatenate(rows[: count + 1])) + 1e-7
        before = value


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), columns=st.integers(2, 40), batches=st.integers(2, 6))
def test_rows_that_were_let_go_come_back_to_the_optimum(seed, columns, batches):
    """As in a keyhole: whatever row is violated is told again, until none is."""
    cost, batches_of_rows = example(seed, columns, batches)
    rows = np.concatenate(batches_of_rows)
    dictionary, basic, nonbasic = opened(cost), np.zeros(0, np.int64), np.arange(columns)
    weights = np.zeros(columns)
    for _ in range(200):
        short = np.nonzero(rows @ weights < 1 - 1e-7)[0]
        if not len(short):
            break
        dictionary, basic = extended(dictionary, basic, nonbasic, rows[short[:3]])
        assert minimised(dictionary, basic, nonbasic, np.inf)
        weights = solution(dictionary, basic)
    assert (rows @ weights > 1 - 1e-6).all()
    assert abs(cost @ weights - least(cost, rows)) < 1e-6


def test_it_ends_where_the_optimum_is_more_than_enough():
    cost, rows = np.array([2.0, 3.0]), np.array([[2.0, 2.0]])
    opened_ = opened(cost), np.zeros(0, np.int64), np.arange(2)
    dictionary, basic = extended(*opened_, rows)
    assert not minimised(dictionary, basic, opened_[2], 0.9)
    dictionary, basic = extended(opened(cost), np.zeros(0, np.int64), np.arange(2), rows)
    assert minimised(dictionary, basic, np.arange(2), 1.1)
    assert dictionary[-1, -1] == 1.0


def test_what_no_weights_cover_has_no_optimum():
    dictionary, basic = extended(
        opened(np.ones(2)), np.zeros(0, np.int64), np.arange(2), np.zeros((1, 2))
    )
    assert not minimised(dictionary, basic, np.arange(2), np.inf)
