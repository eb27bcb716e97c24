"""The solver ``local-search``: the route engine, whose best tours the proof engine joins."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from tcp.errors import InfeasibleError
from tcp.heuristics.local_search import (
    Join,
    improve,
    linked_tour,
    panel_of,
    respects,
    warm_up,
)
from tcp.instance import Instance, TourForm
from tcp.result import Outcome, Progress, Report
from tcp.stop import Clock, StopReason

LONG = 10.0
"""Seconds of the time limit from which joining pays for loading the proof engine."""

LARGEST = 50_000
"""Most nodes: on larger boards the tours differ in too many places to be joined."""


def refusal(instance: Instance) -> str | None:
    """Why this solver cannot take the instance: it takes every one."""
    return None


def run(
    instance: Instance,
    *,
    rng: np.random.Generator,
    clock: Clock,
    report: Report,
    workers: int | None = None,
    panels: bool = True,
    join: bool = True,
) -> Outcome:
    """Find a short route; see :func:`tcp.heuristics.local_search.improve`.  Never proves anything.

    Parameters
    ----------
    workers : int, optional
        Threads; default: two, where this process has so many cores.
    panels : bool
        Recognise copies of one board: it is solved once, its copies are linked, and the search
        goes on from there.
    join : bool
        With a time limit of :data:`LONG` seconds or more, find the shortest tour over the
        edges of the best ones (:func:`tcp.exact.join.join`).
    """
    form = instance.form
    details: dict[str, Any] = {}

    def search(
        form: TourForm, tour: Sequence[int] | None, clock: Clock, kicks: int | None
    ) -> list[int]:
        return improve(form, tour, rng=rng, clock=clock, kicks=kicks, workers=workers)

    try:
        start = None
        panel = panel_of(form) if panels else None
        if panel is not None:
            with clock.paused():
                warm_up()
            start = linked_tour(form, panel, search, clock, clock.stop.iterations)
            details["panel"] = panel.describe()
            if respects(form, start):
                report(Progress(clock.elapsed, form.tour_cost(start), note="panel"))
        joiner = _joiner(instance, clock) if join else None
        tour = improve(
            form, start, rng=rng, clock=clock, report=report, workers=workers, join=joiner
        )
    except InfeasibleError as reason:
        return Outcome(None, infeasible=True, details={"reason": str(reason)})
    stopped = clock.reason(form.tour_cost(tour)) or StopReason.COMPLETED
    if not respects(form, tour):
        return Outcome(None, stopped=stopped, details=details)
    return Outcome(instance.route(tour), stopped=stopped, details=details)


def _joiner(instance: Instance, clock: Clock) -> Join | None:
    """How the proof engine joins this instance's tours; None where there is no time for it."""
    limit = clock.stop.time
    if limit is None or limit < LONG or instance.form.size > LARGEST:
        return None
    with clock.paused():
        from tcp.exact.join import join  # loads the engine
    return partial(join, instance.form, granularity=instance.granularity)
