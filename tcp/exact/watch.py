"""What a solver that runs in another thread is asked while it runs: is there news, is it time?"""

from __future__ import annotations

from tcp.result import Progress, Report
from tcp.stop import Clock, StopReason


class Watch:
    """Passes on what is new about a solve, and tells when to stop it.

    Parameters
    ----------
    clock : Clock
        When to stop.
    report : callable
        Hears of better routes and bounds, each once.
    """

    def __init__(self, clock: Clock, report: Report):
        self.clock, self.report = clock, report
        self.told: tuple[int | None, int] | None = None

    def look(self, cost: int | None, bound: int) -> StopReason | None:
        """Report a cost and a bound unless they are those of the last time; why to stop, if so."""
        if (cost, bound) != self.told:
            self.told = (cost, bound)
            self.report(Progress(self.clock.elapsed, cost, bound))
        return self.clock.reason(cost, bound)
