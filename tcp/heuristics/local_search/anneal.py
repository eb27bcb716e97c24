"""The search as a whole: descent, rounds of kicks that cool down, a merge after each.

Several streams of kicks start from one tour and know nothing of each other
until their tours are merged; threads only decide how many streams run at a
time.  ``best`` is a valid tour at every moment.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from tcp.heuristics.local_search.exchange import Tour, keep, new_tour
from tcp.heuristics.local_search.ground import Ground, Small, length
from tcp.heuristics.local_search.kicks import kick_and_repair
from tcp.heuristics.local_search.merge import merge
from tcp.heuristics.local_search.search import CAP, SIZE, Work, new_work, push, settle
from tcp.result import Progress, Report
from tcp.stop import Clock

REACH = 30
"""Longest stretch of a kick's double bridge."""

HEAT = 0.3
"""Loss put up with when a round begins, in mean edges of the tour."""

SLOW = 50
"""Kicks per node below which cooling from all of :data:`HEAT` would take too long."""

ROUNDS = (0.6, 0.4)
"""Shares of the whole effort; each round cools down to zero and ends with a merge."""

STREAMS = 2
"""Searches that run side by side, whatever the number of workers."""

SLICE = 0.04
"""Seconds between two looks at the clock."""

FAR, NEAR = 50_000, 25_000
"""Most places that one exchange may write, in the descent and after a kick."""


class Stream:
    """A tour under disturbance, and the best it has been."""

    def __init__(self, ground: Ground, order: Small, seed: int):
        self.ground = ground
        self.tour: Tour = new_tour(order)
        self.work: Work = new_work(order.size, ground.near.shape[1], cap=FAR)
        self.random = np.array([seed], np.uint64)
        self.cost = int(length(ground, self.tour.order))
        self.best, self.best_cost = self.tour.kept.copy(), self.cost

    def kick(self, kicks: int, heat: float) -> None:
        """Try some kicks."""
        args = (self.ground, self.tour, self.work, self.random)
        self.cost -= int(kick_and_repair(*args, kicks, REACH, heat))
        self.record()

    def record(self) -> None:
        """Remember the tour if it is the best so far."""
        if self.cost < self.best_cost:
            self.best_cost = self.cost
            self.best[:] = self.tour.kept

    def restart(self, order: Small, cost: int) -> None:
        """Go on from another tour."""
        self.tour = new_tour(order)
        self.cost = cost
        self.record()


class Search:
    """Streams, clock and news; see the module."""

    def __init__(
        self,
        ground: Ground,
        order: Small,
        rng: np.random.Generator,
        clock: Clock,
        report: Report,
    ):
        self.ground, self.clock, self.report = ground, clock, report
        self.seeds = [int(v) for v in rng.integers(1, 2**63, size=STREAMS, dtype=np.uint64)]
        self.streams = [Stream(ground, order, self.seeds[0])]
        self.tried = 0
        self.told = self.cost + 1
        self._tell("start")

    @property
    def best(self) -> Small:
        """The best tour so far, in the ground's numbers."""
        return min(self.streams, key=lambda s: s.best_cost).best

    @property
    def cost(self) -> int:
        """Cost of the best tour."""
        return min(s.best_cost for s in self.streams)

    def descend(self) -> None:
        """Improve until no exchange helps, looking at the nodes in tour order."""
        stream = self.streams[0]
        for v in stream.tour.order:
            push(stream.work, v)
        while stream.work.state[SIZE] and self.clock.reason(self.cost) is None:
            stream.cost -= int(settle(self.ground, stream.tour, stream.work, 2_000))
            keep(stream.tour)
            stream.record()
        self._tell("descent")

    def kick(self, limit: int | None, workers: int) -> None:
        """Try ``limit`` kicks in all, or as many as the clock allows."""
        if self.clock.reason(self.cost) is not None or limit == 0:
            return
        first = self.streams[0]
        self.streams += [Stream(self.ground, first.best, seed) for seed in self.seeds[1:]]
        for stream in self.streams:
            stream.work.state[CAP] = NEAR
        with ThreadPoolExecutor(max(1, min(workers, STREAMS))) as pool:
            heat = HEAT
            begin = 0.0
            for share in ROUNDS:
                self._round(pool, limit, begin, begin + share, heat)
                begin, heat = begin + share, heat / 3
                if self.clock.interrupted:
                    return
                self._merge()

    def _round(
        self, pool: ThreadPoolExecutor, limit: int | None, begin: float, end: float, heat: float
    ) -> None:
        """Kick all streams while the share of effort spent is below ``end``, cooling down."""
        n = self.ground.x.size
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
            jobs = [pool.submit(stream.kick, size, warm) for stream in self.streams]
            for job in jobs:
                job.result()
            self.tried += size * STREAMS
            self._tell("kicks")
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

    def _merge(self) -> None:
        """Merge the streams' best tours; all go on from the result."""
        best = min(self.streams, key=lambda s: s.best_cost)
        child, cost = new_tour(best.best), best.best_cost
        for stream in self.streams:
            if stream is not best:
                cost -= int(merge(self.ground, child, stream.best))
        for stream in self.streams:
            stream.restart(child.kept, cost)
        self._tell("merge")

    def _tell(self, note: str) -> None:
        if self.cost < self.told:
            self.told = self.cost
            self.report(Progress(self.clock.elapsed, self.cost, iteration=self.tried, note=note))
