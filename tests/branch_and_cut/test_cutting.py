"""The loop at a node: when cutting has stopped to help."""

from __future__ import annotations

import numpy as np

from tcp.exact.branch_and_cut.cutting import WINDOW, Gains, tour_of
from tcp.exact.branch_and_cut.support import Support


def cut(progress: Gains, value: float, rounds: int, gain: float) -> float:
    for _ in range(rounds):
        value += gain
        progress.note(value)
    return value


def test_progress_is_known_after_a_window_of_rounds():
    progress = Gains()
    cut(progress, 100.0, WINDOW, 1.0)
    assert progress.gained is None
    progress.note(200.0)
    assert progress.gained == 200.0 - 101.0


def test_what_pricing_takes_away_is_no_loss_and_what_it_takes_is_not_gained_again():
    progress = Gains()
    value = cut(progress, 100.0, WINDOW + 1, 2.0)
    for loss in (
        50.0,
        0.0,
        7.0,
    ):  # priced again and again, between rounds that gain next to nothing
        value -= loss
        progress.priced = True
        progress.note(value)
        value = cut(progress, value, WINDOW // 2, 0.125)
    assert progress.gained == 0.125 * WINDOW


def test_progress_is_measured_afresh_where_that_is_asked_for():
    progress = Gains()
    cut(progress, 0.0, WINDOW + 1, 1.0)
    progress.clear()
    assert progress.gained is None


def test_whole_numbers_are_a_tour_only_if_they_are_one_cycle():
    ring, onward = np.arange(6), np.array([1, 2, 3, 4, 5, 0])
    one = tour_of(Support.of(6, np.minimum(ring, onward), np.maximum(ring, onward), np.ones(6)))
    assert one is not None and sorted(one.tolist()) == list(range(6))
    i, j = np.array([0, 1, 0, 3, 4, 3]), np.array([1, 2, 2, 4, 5, 5])
    assert tour_of(Support.of(6, i, j, np.ones(6))) is None
