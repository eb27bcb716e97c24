"""When to stop: an immutable wish, and the clock that watches over it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import StrEnum
from fractions import Fraction
from threading import Event
from typing import Any

from tcp.errors import UsageError


class StopReason(StrEnum):
    """Why a solver came back."""

    COMPLETED = "completed"
    TIME = "time limit"
    ITERATIONS = "iteration limit"
    GAP = "gap reached"
    TARGET = "target reached"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True)
class Stop:
    """Conditions under which a solver may return early; whichever holds first.

    Parameters
    ----------
    time : float, optional
        Seconds of wall time, >= 0.
    iterations : int, optional
        Iterations in the solver's own sense, >= 0.
    gap : float, optional
        Relative gap (cost - bound) / cost that is good enough, >= 0.
    target : int or Fraction, optional
        Cost in quanta that is good enough.
    """

    time: float | None = None
    iterations: int | None = None
    gap: float | None = None
    target: int | Fraction | None = None

    def __post_init__(self) -> None:
        for name in ("time", "iterations", "gap"):
            value = getattr(self, name)
            if value is not None and not (isinstance(value, int | float | Fraction) and value >= 0):
                raise UsageError(f"the {name} limit must be a number, 0 or more, not {value!r}")


class Clock:
    """A running stop: started by the facade, polled by the solver.

    ``interrupt`` asks for the best so far (Ctrl-C does); polling after that
    answers :attr:`StopReason.INTERRUPTED`.
    """

    def __init__(self, stop: Stop, now: Callable[[], float] = time.monotonic):
        self.stop = stop
        self._now = now
        self._started = now()
        self._pauses = 0
        self._paused_at = self._started
        self._bell = Event()
        self._whole: Clock | None = None

    @property
    def interrupted(self) -> bool:
        """Whether the solver was asked to return what it has."""
        whole = self._whole
        return self._bell.is_set() or (whole is not None and whole.interrupted)

    def interrupt(self) -> None:
        """Ask the solver to return what it has."""
        self._bell.set()

    @property
    def over(self) -> bool:
        """Whether no time is left: used up, or interrupted."""
        return self.interrupted or self.remaining == 0

    def part(self, stop: Stop) -> Clock:
        """A clock for a part of the work: interrupted with the whole, stopped by a wish of its own.

        Its time does not run beyond the whole's; interrupting it does not interrupt the whole.
        """
        left = None if self.stop.time is None else self.remaining
        times = [t for t in (stop.time, left) if t is not None]
        clock = Clock(replace(stop, time=min(times, default=None)), self._now)
        clock._whole = self
        return clock

    def pause(self) -> None:
        """Stand still until as many calls of :meth:`resume`."""
        if not self._pauses:
            self._paused_at = self._now()
        self._pauses += 1

    def resume(self) -> None:
        """Run on after a :meth:`pause`."""
        self._pauses -= 1
        if not self._pauses:
            self._started += self._now() - self._paused_at

    @contextmanager
    def paused(self) -> Iterator[None]:
        """What happens inside does not count: loading and compiling."""
        self.pause()
        try:
            yield
        finally:
            self.resume()

    @property
    def elapsed(self) -> float:
        """Seconds since the start, without pauses."""
        return (self._paused_at if self._pauses else self._now()) - self._started

    @property
    def remaining(self) -> float:
        """Seconds left; infinite without a time limit, never negative."""
        if self.stop.time is None:
            return float("inf")
        return max(0.0, self.stop.time - self.elapsed)

    def reason(
        self, cost: int | None = None, bound: int | None = None, iterations: int = 0
    ) -> StopReason | None:
        """The condition that holds now, or None to go on."""
        stop = self.stop
        if self.interrupted:
            return StopReason.INTERRUPTED
        if stop.time is not None and self.elapsed >= stop.time:
            return StopReason.TIME
        if stop.iterations is not None and iterations >= stop.iterations:
            return StopReason.ITERATIONS
        if cost is None:
            return None
        if stop.target is not None and cost <= stop.target:
            return StopReason.TARGET
        if stop.gap is not None and bound is not None and cost - bound <= stop.gap * cost:
            return StopReason.GAP
        return None


@contextmanager
def compiling_is_free(clock: Clock, told: Callable[[], None] = lambda: None) -> Iterator[None]:
    """The clock stands still whenever numba compiles: that happens once a machine.

    ``told`` hears of it, for it may take minutes.  Costs nothing where numba is not loaded.
    """
    if "numba" not in sys.modules:
        yield
        return
    from numba.core import event

    class Pause(event.Listener):  # type: ignore[misc]
        def on_start(self, event: Any) -> None:
            clock.pause()
            told()

        def on_end(self, event: Any) -> None:
            clock.resume()

    with event.install_listener("numba:compile", Pause()):
        yield
