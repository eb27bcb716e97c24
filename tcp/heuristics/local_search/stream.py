"""One tour under disturbance."""

from __future__ import annotations

from typing import Any

import numpy as np

from tcp.heuristics.local_search.exchange import Tour, new_tour
from tcp.heuristics.local_search.ground import Ground, Small, length
from tcp.heuristics.local_search.kicks import kick_and_repair
from tcp.heuristics.local_search.search import CAP, FIRM, SIZE, Work, new_work, push_all, settle
from tcp.stop import Clock

REACH, SHORT = 50, 30
"""Longest stretch of a kick's double bridge, and on boards of more than :data:`LARGE` nodes,
where there is time for few kicks a node: short stretches are repaired sooner."""

LARGE = 3_000

FAR, NEAR = 50_000, 25_000
"""Most places that one exchange may write, in the descent and after a kick."""

LOOKS = 2_000
"""Nodes looked at in a descent between two looks at the clock."""


class Stream:
    """A tour under disturbance, and the best it has been."""

    def __init__(self, ground: Ground, order: Small, seed: int):
        self.ground = ground
        self.tour: Tour = new_tour(order)
        self.work: Work = new_work(order.size, ground.near.shape[1], cap=FAR)
        self.random = np.array([seed], np.uint64)
        self.reach = REACH if order.size <= LARGE else SHORT
        self.cost = int(length(ground.costs, self.tour.order))
        self.best, self.best_cost = self.tour.order.copy(), self.cost

    @property
    def _state(self) -> tuple[Any, ...]:
        """The arrays that every kernel takes."""
        return (self.ground.costs, self.ground.near, self.ground.dist, *self.tour, *self.work)

    def descend(self, clock: Clock) -> None:
        """Improve until no exchange helps, looking at the nodes in tour order."""
        work = self.work
        work.state[CAP], work.state[FIRM] = FAR, 1
        push_all(work.queue, work.queued, work.state, self.tour.order)
        while work.state[SIZE] and clock.reason(self.cost) is None:
            self.cost -= int(settle(*self._state, LOOKS))
        work.state[CAP], work.state[FIRM] = NEAR, 0
        self.record()

    def kick(self, kicks: int, heat: float) -> None:
        """Try some kicks."""
        self.cost -= int(kick_and_repair(*self._state, self.random, kicks, self.reach, heat))
        self.record()

    def record(self) -> None:
        """Remember the tour if it is the best so far."""
        if self.cost < self.best_cost:
            self.best_cost = self.cost
            self.best[:] = self.tour.order

    def restart(self, order: Small, cost: int) -> None:
        """Go on from another tour."""
        self.tour = new_tour(order)
        self.cost = cost
        self.record()
