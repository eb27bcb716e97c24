"""A search for better routes that goes on beside the root's linear programmes."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from tcp.exact.branch_and_cut.cutting import Incumbent
from tcp.exact.branch_and_cut.problem import Problem
from tcp.fleet import threads
from tcp.heuristics.local_search import improve
from tcp.stop import Clock, Stop

PART = 20
"""Kicks are this part of the nodes' square: about what fits beside the root's linear
programmes, whose time grows as fast; to wait for more of them costs more than a better route saves.
"""

MOST_KICKS = 300_000
"""Most kicks, however large the instance; each time that more are asked for, four times as many."""


@dataclass
class Scout:
    """Searches on from the incumbent, in a thread of its own if there is a core for it.

    What it finds is offered when it is asked for, never before: so the proof
    depends neither on how fast the thread was nor on there being one.
    """

    problem: Problem
    incumbent: Incumbent
    rng: np.random.Generator
    clock: Clock
    most: int = MOST_KICKS
    _search: Callable[[], list[int]] | None = None
    _found: Future[list[int]] | None = None
    _thread: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(1))

    def __post_init__(self) -> None:
        self.clock = self.clock.part(Stop())  # to recall the scout does not end the proof

    def send(self) -> None:
        """Begin, at once or when it is first asked for."""
        self._search = partial(
            improve,
            self.problem.form,
            self.incumbent.tour.tolist(),
            rng=self.rng,
            clock=self.clock,
            kicks=min(self.problem.size**2 // PART, self.most),
            workers=1,
        )
        self.most *= 4
        if threads(2) > 1:
            self._found = self._thread.submit(self._search)

    def hear(self) -> None:
        """Wait until it is done, and offer what it found."""
        if self._search is not None:
            tour = self._search() if self._found is None else self._found.result()
            self.incumbent.offer(np.array(tour, np.int64))
            self._search = self._found = None

    def recall(self) -> None:
        """Stop it at once, and offer what it has."""
        self.clock.interrupt()
        if self._found is not None:
            self.hear()
        self._thread.shutdown()
