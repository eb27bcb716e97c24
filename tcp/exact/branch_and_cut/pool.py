"""Cuts that left the LP, kept to be found again cheaply."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from tcp.exact.branch_and_cut.cuts import Cut, Family, boundary
from tcp.exact.branch_and_cut.proof import Floats
from tcp.exact.branch_and_cut.support import Support
from tcp.travel import Ints

CAPACITY = 12_000
"""Most cuts kept; the oldest go first."""

LEAVE = 1_000
"""As many go at once, so that the others need not be flattened anew each time."""


class Pool:
    """A bounded store of valid cuts, each once."""

    def __init__(self) -> None:
        self._cuts: dict[bytes, Cut] = {}
        self._listed: list[Cut] = []
        self._family = Family.of(())
        self._rhs = np.zeros(0, np.int64)

    def __len__(self) -> int:
        return len(self._cuts)

    def __iter__(self) -> Iterator[Cut]:
        return iter(self._cuts.values())

    def add(self, cuts: Iterable[Cut]) -> None:
        """Keep cuts; those already there become young again."""
        for cut in cuts:
            if self._cuts.pop(cut.key, None) is None:
                self._listed.append(cut)
            self._cuts[cut.key] = cut
        if len(self._cuts) > CAPACITY:
            for key in list(self._cuts)[: len(self._cuts) - CAPACITY + LEAVE]:
                del self._cuts[key]
            self._listed = list(self._cuts.values())
            self._family, self._rhs = Family.of(()), np.zeros(0, np.int64)

    def violated(self, support: Support, by: float, limit: int) -> list[Cut]:
        """Up to ``limit`` cuts violated by at least ``by``, most violated first."""
        if not self._cuts:
            return []
        if self._family.count < len(self._listed):
            fresh = self._listed[self._family.count :]
            self._family = self._family.followed_by(Family.of(fresh))
            self._rhs = np.concatenate((self._rhs, [cut.rhs for cut in fresh]))
        missing = violation(self._family, self._rhs, support)
        order = np.argsort(-missing, kind="stable")[:limit]
        return [self._listed[k] for k in order if missing[k] >= by]


def violation(family: Family, rhs: Ints, support: Support) -> Floats:
    """By how much an LP solution violates each cut of a family; negative where it does not."""
    value = boundary(
        family.ptr, family.nodes, support.ptr, support.other, support.weight, support.size
    )
    weight: Floats = value * family.weight
    return rhs - np.bincount(family.owner, weight, minlength=family.count)
