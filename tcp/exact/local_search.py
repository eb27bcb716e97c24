"""The solver ``local-search``: the route engine, whose best tours the proof engine joins."""

from __future__ import annotations

from functools import partial

import numpy as np

from tcp.heuristics import local_search
from tcp.heuristics.local_search import Join, refusal
from tcp.instance import Instance
from tcp.result import Outcome, Report
from tcp.stop import Clock

__all__ = ["refusal", "run"]

LONG = 10.0
"""Seconds of the time limit from which joining pays for loading the proof engine."""

LARGEST = 50_000
"""Most nodes: larger boards get no populations."""


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
    """Find a short route; see :func:`tcp.heuristics.local_search.run`.  Never proves anything.

    Parameters
    ----------
    workers : int, optional
        Threads; default: two, where this process has so many cores.
    panels : bool
        Recognise copies of one board, solve it once and link the copies.
    join : bool
        With a time limit of :data:`LONG` seconds or more, find the shortest tour over the
        edges of the best ones (:func:`tcp.exact.join.join`).
    """
    limit = clock.stop.time
    able = join and limit is not None and limit >= LONG and instance.form.size <= LARGEST
    return local_search.run(
        instance,
        rng=rng,
        clock=clock,
        report=report,
        workers=workers,
        panels=panels,
        join=_joiner(instance) if able else None,
    )


def _joiner(instance: Instance) -> Join:
    """How the engine joins this instance's tours; only now it is loaded."""
    from tcp.exact.join import join

    return partial(join, instance.form, granularity=instance.granularity)
