"""Tours that breed until none of them has a better child."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from functools import partial

import numpy as np

from tcp.heuristics.local_search.crossover import ab_cycles, census, mate
from tcp.heuristics.local_search.ground import Ground, Small
from tcp.stop import Clock

HASTE = 5.0
"""This over the generations that there is time for is the share of the better cycles to take."""

STALE = 3
"""Generations without a better child after which a population has nothing more to give."""


class Population:
    """Tours over one ground, with their costs; a generation replaces them by their children.

    ``greed`` is the share of what one parent does better that a child takes.  None: as little
    as there is time for, as one cycle a child makes the best tours in the most generations.
    """

    def __init__(
        self, ground: Ground, tours: Sequence[tuple[Small, int]], greed: float | None
    ) -> None:
        self.ground, self.greed = ground, greed
        self.orders = np.array([order for order, _ in tours])
        self.costs = [cost for _, cost in tours]
        self._places = np.empty_like(self.orders)
        for order, pos in zip(self.orders, self._places, strict=True):
            pos[order] = np.arange(order.size, dtype=np.int32)
        self._spare = np.empty_like(self.orders), np.empty_like(self.orders)

    @property
    def best(self) -> tuple[Small, int]:
        """The shortest tour and its cost."""
        m = int(np.argmin(self.costs))
        return self.orders[m], self.costs[m]

    def breed(
        self,
        rng: np.random.Generator,
        pool: Executor,
        clock: Clock,
        news: Callable[[Small, int], None],
    ) -> None:
        """Breed generations until the clock says stop or nothing comes of it any more.

        In each, all tours stand in a ring in random order; every one is
        crossed with the next and replaced by the best child, if that is
        better.  ``news`` receives each generation's best tour and cost.
        """
        members, stale, took = len(self.costs), 0, 0.0
        while stale < STALE and clock.reason(self.best[1]) is None:
            began, greed = clock.elapsed, self._greed(clock, took)
            counts = census(self.orders)
            ring = rng.permutation(members)
            seeds = rng.integers(1, 2**63, members, dtype=np.uint64)

            cross = partial(self._cross, counts=counts, greed=greed, clock=clock)

            gains = list(pool.map(cross, ring, np.roll(ring, -1), seeds))
            for a, gain in zip(ring, gains, strict=True):
                self.costs[a] -= gain
            children = self._spare
            self._spare = self.orders, self._places
            self.orders, self._places = children
            stale = 0 if any(gains) else stale + 1
            took = clock.elapsed - began
            news(*self.best)

    def _greed(self, clock: Clock, took: float) -> float:
        """The share to take in a generation, when the one before it took so many seconds."""
        if self.greed is not None:
            return self.greed
        return min(1.0, HASTE * took / max(clock.remaining, 1e-9))

    def _cross(
        self, a: int, b: int, seed: int, *, counts: Small, greed: float, clock: Clock
    ) -> int:
        """Write the best child of a with b, near a; returns its gain."""
        child, places = self._spare[0][a], self._spare[1][a]
        child[:], places[:] = self.orders[a], self._places[a]
        if clock.interrupted or clock.remaining == 0:
            return 0
        tour, other = (self.orders[a], self._places[a]), (self.orders[b], self._places[b])
        cycles = ab_cycles(*tour, *other, np.array([seed], np.uint64))
        costs, near = self.ground.costs, self.ground.near
        gain = mate(costs, near, *tour, *cycles, child, counts, len(self.costs), greed)
        if gain:
            places[child] = np.arange(child.size, dtype=np.int32)
        return int(gain)
