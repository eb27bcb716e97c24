"""The search as a whole: a descent, then populations if there is time for them, or kicks alone.

Where there is time for a few tours of a kick or more a node, many of them
are raised from different starts and bred (``population.py``): what a tour does
well is thereby found anywhere on the board, even where an open path ends.
Large boards get kicks alone, in streams that cool down and merge.

``best`` is a valid tour at every moment.  Threads only decide how many tours
are worked on at a time; what becomes of them does not depend on that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from functools import partial

import numpy as np

from tcp.heuristics.local_search.ground import Ground, Small, length
from tcp.heuristics.local_search.population import Population
from tcp.heuristics.local_search.starts import greedy
from tcp.heuristics.local_search.stream import Stream
from tcp.result import Progress, Report
from tcp.stop import Clock, Stop
from tcp.travel import Ints

HEAT = 0.3
"""Loss put up with when a round of kicks alone begins, in mean edges of the tour."""

SLOW = 50
"""Kicks per node below which cooling from all of :data:`HEAT` would take too long."""

ROUNDS = (0.6, 0.4)
"""Shares of the effort where there are kicks alone; each cools down to zero and ends in a merge."""

STREAMS = 2
"""Searches that run side by side where there are kicks alone, whatever the number of workers."""

YOUNG, RIPE = 0.5, 5
"""Least and most kicks per node that make a member of a population."""

FEW, MANY = 8, 300
"""Least and most members of a population."""

ROOM = 8_000_000
"""Most nodes of all members together."""

RAISING = 0.75
"""Share of the time left that goes into raising a population; the rest is for breeding."""

GREED = 0.3
"""Share of the better AB-cycles of two parents that a child takes where kicks are counted."""

PROBE = 300
"""Kicks that tell how fast the machine is."""

SLICE, GULP = 0.04, 1_000
"""Seconds, and most kicks of a member, between two looks at the clock."""

JOINED = 10
"""Most members of a bred population that are joined."""

JOINING = 0.1
"""Share of the time limit that joining may take."""

Join = Callable[[Sequence[Ints], Clock], Ints]
"""Makes one tour of several, the best of them first, by an exact method; never a longer one."""


class Search:
    """Tours, clock and news; see the module.

    New tours start from greedy edges of ``wide``, whose candidates may be others than those of
    ``ground``: the more various the starts, the more a population has to breed from.
    """

    def __init__(
        self,
        ground: Ground,
        order: Small,
        rng: np.random.Generator,
        clock: Clock,
        report: Report,
        join: Join | None = None,
        wide: Ground | None = None,
    ):
        self.wide = wide or ground
        self.ground, self.rng, self.clock, self.report = ground, rng, clock, report
        self.join = join
        self.first = Stream(ground, order, self._seeds(1)[0])
        self.tried = 0
        self.best, self.cost = self.first.best, self.first.cost
        self._tell("start")

    def descend(self) -> None:
        """Improve until no exchange helps, looking at the nodes in tour order."""
        self.first.descend(self.clock)
        self._offer(self.first.best, self.first.best_cost, "descent")

    def kick(self, limit: int | None, workers: int) -> None:
        """Try ``limit`` kicks in all, or as many as the clock allows."""
        if self.clock.reason(self.cost) is not None or limit == 0:
            return
        n = self.ground.size
        most = min(MANY, ROOM // n)
        with ThreadPoolExecutor(max(1, workers)) as pool:
            affordable = self._affordable(limit, workers)
            count = min(most, int(affordable / (YOUNG * n)))
            if count < FEW:
                self._anneal(pool, limit)
                return
            kicks = affordable // count
            while limit is None and self.clock.reason(self.cost) is None:
                self._populate(pool, most, min(kicks, RIPE * n), None)
            if limit is not None:
                self._populate(pool, count, kicks, GREED)

    def _affordable(self, limit: int | None, workers: int) -> int:
        """How many kicks there will be."""
        if limit is not None:
            return limit
        began = self.clock.elapsed
        self.first.kick(PROBE, 0.0)
        took = max(self.clock.elapsed - began, 1e-6)
        return int(min(self.clock.remaining / took * PROBE * min(workers, STREAMS), 1e12))

    def _populate(self, pool: Executor, count: int, kicks: int, greed: float | None) -> None:
        """Raise a population and breed it: the best tour and ``count - 1`` new ones.

        Fewer, where :data:`RAISING` of the time left does not suffice for all.
        """
        clock = self.clock
        until = clock.elapsed + RAISING * clock.remaining

        def grow(seed: int) -> Stream | None:
            return self._raise(seed, kicks, until)

        members = [(self.best.copy(), self.cost)]
        for stream in pool.map(grow, self._seeds(count - 1)):
            if stream is not None:
                members.append((stream.best, stream.best_cost))
                self.tried += kicks
                self._offer(*members[-1], "member")
        population = Population(self.ground, members, greed)
        population.breed(self.rng, pool, clock, partial(self._offer, note="bred"))
        if self.join is not None and clock.reason(self.cost) is None:
            self._join(population, self.join)

    def _join(self, population: Population, join: Join) -> None:
        """Offer a tour over the edges of the best members."""
        label, limit = self.ground.label, self.clock.stop.time
        ranked = np.argsort(population.costs, kind="stable")[:JOINED]
        clock = self.clock.part(Stop(None if limit is None else JOINING * limit))
        order = self.ground.order(join([label[population.orders[m]] for m in ranked], clock))
        self._offer(order, int(length(self.ground.costs, order)), "joined")

    def _raise(self, seed: int, kicks: int, until: float) -> Stream | None:
        """A tour from a start of its own; None if it is too late for one."""
        clock = self.clock
        if clock.elapsed >= until or clock.interrupted:
            return None
        stream = Stream(self.ground, greedy(self.wide, np.random.default_rng(seed)), seed)
        stream.descend(clock)
        while kicks > 0 and clock.elapsed < until and clock.reason(stream.cost) is None:
            stream.kick(min(kicks, GULP), 0.0)
            kicks -= GULP
        return stream

    def _anneal(self, pool: Executor, limit: int | None) -> None:
        """Kicks alone: rounds of streams that start from the best tour, cool down and merge."""
        seeds = self._seeds(STREAMS)
        streams = [Stream(self.ground, self.best, seed) for seed in seeds]
        begin, heat = 0.0, HEAT
        for share in ROUNDS:
            self._round(pool, streams, limit, begin, begin + share, heat)
            begin, heat = begin + share, heat / 3
            if self.clock.interrupted:
                return
            merged = Population(self.ground, [(s.best, s.best_cost) for s in streams], greed=1.0)
            merged.breed(self.rng, pool, self.clock, partial(self._offer, note="merge"))
            for stream in streams:
                stream.restart(self.best, self.cost)

    def _round(
        self,
        pool: Executor,
        streams: list[Stream],
        limit: int | None,
        begin: float,
        end: float,
        heat: float,
    ) -> None:
        """Kick all streams while the share of effort spent is below ``end``, cooling down."""
        n = self.ground.size
        mean = self.cost / n
        size = 10
        while (done := self._done(limit)) < end:
            expected = self.tried / max(done, 1e-3) if limit is None else limit
            left = max(0.0, 1 - (done - begin) / (end - begin) * 1.05)
            warm = heat * min(1.0, expected / n / SLOW) * mean * left
            if limit is not None:  # exactly as many as asked for, in slices of fixed size
                quota = max(1, round((end * limit - self.tried) / STREAMS))
                size = min(quota, max(1, limit // 100), 500)
            before = self.clock.elapsed
            list(pool.map(lambda s, *a: s.kick(*a), streams, [size] * STREAMS, [warm] * STREAMS))
            self.tried += size * STREAMS
            for stream in streams:
                self._offer(stream.best, stream.best_cost, "kicks")
            if self.clock.reason(self.cost) is not None:
                return
            if limit is None:
                took = self.clock.elapsed - before
                size = max(1, int(size * min(2.0, SLICE / max(took, 1e-6))))

    def _done(self, limit: int | None) -> float:
        """Share of the effort spent."""
        time = self.clock.stop.time
        by_kicks = 0.0 if limit is None else self.tried / limit
        by_time = 0.0 if time is None else self.clock.elapsed / max(time, 1e-9)
        return max(by_kicks, by_time)

    def _seeds(self, count: int) -> Ints:
        return self.rng.integers(1, 2**63, count)

    def _offer(self, order: Small, cost: int, note: str) -> None:
        """Remember a tour that is better than all before."""
        if cost < self.cost:
            self.best, self.cost = order.copy(), cost
            self._tell(note)

    def _tell(self, note: str) -> None:
        self.report(Progress(self.clock.elapsed, self.cost, iteration=self.tried, note=note))
