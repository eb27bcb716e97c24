"""The live line: incumbent, bound, gap and elapsed time while a solver runs."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

from rich.console import Console
from rich.live import Live
from rich.text import Text

from tcp.instance import Instance
from tcp.report.table import percent
from tcp.result import Progress, Report


class LiveLine:
    """The latest news as one line; rendered by rich a few times a second."""

    def __init__(self, instance: Instance):
        self._instance = instance
        self._started = time.monotonic()
        self._cost: int | None = None
        self._bound: int | None = None
        self._note = ""

    def __call__(self, news: Progress) -> None:
        """Take in one piece of news."""
        if news.cost is not None:
            self._cost = news.cost if self._cost is None else min(self._cost, news.cost)
        if news.bound is not None:
            self._bound = news.bound if self._bound is None else max(self._bound, news.bound)
        self._note = news.note

    def text(self) -> str:
        """The line as it stands now."""
        gap = None
        if self._cost is not None and self._bound is not None:
            gap = (self._cost - self._bound) / self._cost if self._cost else 0.0
        parts = [
            f"{self._instance.name}: best {self._shown(self._cost)}",
            f"bound {self._shown(self._bound)}",
            f"gap {percent(gap)}",
            f"{time.monotonic() - self._started:.1f} s",
        ]
        return "  ".join([*parts, self._note] if self._note else parts)

    def _shown(self, cost: int | None) -> str:
        return "-" if cost is None else f"{float(cost * self._instance.quantum):.10g}"

    def __rich__(self) -> Text:
        return Text(self.text(), no_wrap=True, overflow="ellipsis")


@contextmanager
def live_line(instance: Instance) -> Iterator[Report]:
    """A report that shows a line on stderr's terminal and removes it at the end."""
    line = LiveLine(instance)
    with Live(line, console=Console(stderr=True), refresh_per_second=8, transient=True):
        yield line


@contextmanager
def live_board() -> Iterator[Callable[[str, Instance, Progress], None]]:
    """As :func:`live_line`, for a board whose tools are solved one after the other."""
    with ExitStack() as stack:
        current: dict[int, LiveLine] = {}
        live = stack.enter_context(
            Live(console=Console(stderr=True), refresh_per_second=8, transient=True)
        )

        def news(_: str, instance: Instance, progress: Progress) -> None:
            if id(instance) not in current:
                current.clear()
                current[id(instance)] = LiveLine(instance)
                live.update(current[id(instance)])
            current[id(instance)](progress)

        yield news
