"""A search for better routes that goes on beside the first node's linear programmes."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from tcp.exact.branch_and_cut.cutting import Incumbent
from tcp.exact.branch_and_cut.problem import Problem
from tcp.heuristics.local_search import improve
from tcp.stop import Clock, Stop

KICKS = 120
"""Kicks per node: a better route saves branches."""

MOST_KICKS = 300_000
"""Most kicks, however large the instance."""


@dataclass
class Scout:
    """Searches on from the incumbent, in a thread of its own.

    What it finds is offered when it is asked for, never before: so the proof
    does not depend on how fast the thread was.
    """

    problem: Problem
    incumbent: Incumbent
    rng: np.random.Generator
    clock: Clock
    _found: Future[list[int]] | None = None
    _thread: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(1))

    def send(self) -> None:
        """Begin."""
        self.clock = self.clock.part(Stop())
        kicks = min(KICKS * self.problem.size, MOST_KICKS)
        self._found = self._thread.submit(
            improve,
            self.problem.form,
            self.incumbent.tour.tolist(),
            rng=self.rng,
            clock=self.clock,
            kicks=kicks,
            workers=1,
        )

    def hear(self) -> None:
        """Wait until it is done, and offer what it found."""
        if self._found is not None:
            self.incumbent.offer(np.array(self._found.result(), np.int64))
            self._found = None

    def recall(self) -> None:
        """Stop it at once, and offer what it has."""
        self.clock.interrupt()
        self.hear()
        self._thread.shutdown()
