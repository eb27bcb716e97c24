"""Where to look for local cuts: step by step, further while little is found."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field

import numpy as np

from tcp.exact.branch_and_cut import parts, views
from tcp.exact.branch_and_cut.cuts import Cut
from tcp.exact.branch_and_cut.local import cut_at, separated
from tcp.exact.branch_and_cut.proof import Floats
from tcp.exact.branch_and_cut.sights import Sight
from tcp.exact.branch_and_cut.support import Support
from tcp.travel import Ints

FEW, MANY = 10, 250
"""With so many cuts no step is taken that is not asked for; or none at all."""

CHANCE = 0.9
"""Where growth is left to chance, an atom may be preferred by a factor down to 1 - CHANCE."""

MEMORY = 100_000
"""Most sights remembered."""


@dataclass(frozen=True)
class Meeting:
    """Look where tight cuts meet, each with so many others, at ``least`` to ``most`` parts."""

    partners: int
    least: int
    most: int


@dataclass(frozen=True)
class Growing:
    """Look around every atom of every view, at up to ``most`` of them; grow by chance or not."""

    most: int
    chance: bool = False


Step = Meeting | Growing

Shown = tuple[float, Ints, Floats]
"""What :func:`~tcp.exact.branch_and_cut.local.separated` finds."""

LEVELS: tuple[tuple[Step, ...], ...] = (
    (Meeting(4, 4, 12), Growing(10), Growing(12)),
    (
        Meeting(6, 4, 14),
        Meeting(6, 15, 16),
        Meeting(20, 4, 16),
        Growing(12, chance=True),
        Growing(14, chance=True),
    ),
)
"""The steps of a quick search, and of one for the hardest roots."""


@dataclass
class Keyholes:
    """The search for local cuts; remembers what it saw where nothing was violated.

    Parameters
    ----------
    stop : callable
        Asked between keyholes whether to leave.
    threads : Executor
        Look through different keyholes at a time.
    rng : numpy.random.Generator
        Chance in growing.
    """

    stop: Callable[[], bool]
    threads: Executor
    rng: np.random.Generator
    clean: set[bytes] = field(default_factory=set)

    def cuts(
        self, support: Support, tight: Sequence[Cut], steps: Sequence[Step], least: int = 1
    ) -> list[Cut]:
        """Violated cuts that keyholes show, the most violated of each step first.

        Parameters
        ----------
        support : Support
            An LP solution, connected.
        tight : sequence of Cut
            The cuts that hold it where it is.
        steps : sequence of Meeting or Growing
            Where to look, in turn.
        least : int
            So many steps are taken while fewer than :data:`MANY` cuts are found; more while
            fewer than :data:`FEW` are.
        """
        found: dict[bytes, Cut] = {}
        shown: dict[bytes, Shown | None] = {}
        for k, step in enumerate(steps):
            if len(found) >= (MANY if k < least else FEW):
                break
            for cut in self.seen(self._sights(step, support, tight), support.size, shown):
                found.setdefault(cut.key, cut)
        return list(found.values())

    def _sights(self, step: Step, support: Support, tight: Sequence[Cut]) -> Iterator[Sight]:
        if isinstance(step, Meeting):
            yield from parts.sights(support, tight, step.partners, step.least, step.most)
            return
        favour = self._chances if step.chance else np.ones
        for view in views.VIEWS:
            yield from views.sights(support, view, step.most, favour)

    def _chances(self, count: int) -> Floats:
        return 1.0 - CHANCE * self.rng.random(count)

    def seen(
        self, sights: Iterable[Sight], size: int, shown: dict[bytes, Shown | None]
    ) -> list[Cut]:
        """Violated cuts on ``size`` nodes that sights show, most violated first.

        What they show enters ``shown``; what is known there is not looked at again.
        """
        fresh, looks = [], {}
        for sight in sights:
            name = sight.name
            if name in self.clean:
                continue
            fresh.append((name, sight))
            if name not in shown and name not in looks:  # in a thread, while others are made
                looks[name] = self.threads.submit(self._look, sight)
        shown.update((name, look.result()) for name, look in looks.items())
        found: dict[bytes, tuple[float, Cut]] = {}
        for name, sight in fresh:
            seen = shown[name]
            if seen is None:
                continue
            value, sets, weights = seen
            cut = cut_at(sight.atoms, sets, weights, size) if value < 1.0 else None
            if cut is None:
                self.clean.add(name)
            else:
                found[cut.key] = (value, cut)
        if len(self.clean) > MEMORY:
            self.clean.clear()
        return [cut for _, cut in sorted(found.values(), key=lambda item: item[0])]

    def _look(self, sight: Sight) -> Shown | None:
        """What can be seen there; None if there is no time to look."""
        return None if self.stop() else separated(sight.x)
