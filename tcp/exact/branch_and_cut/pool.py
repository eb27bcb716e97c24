"""Cuts that left the LP, kept to be found again cheaply."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from tcp.exact.branch_and_cut.cuts import Cut, Family, boundary
from tcp.exact.branch_and_cut.support import Support

CAPACITY = 12_000
"""Most cuts kept; the oldest go first."""


class Pool:
    """A bounded store of valid cuts, each once."""

    def __init__(self) -> None:
        self._cuts: dict[bytes, Cut] = {}
        self._family: Family | None = None
        self._listed: list[Cut] = []
        self._rhs = np.zeros(0, np.int64)

    def __len__(self) -> int:
        return len(self._cuts)

    def __iter__(self) -> Iterator[Cut]:
        return iter(self._cuts.values())

    def add(self, cuts: Iterable[Cut]) -> None:
        """Keep cuts; those already there become young again."""
        for cut in cuts:
            self._cuts.pop(cut.key, None)
            self._cuts[cut.key] = cut
            self._family = None
        for key in list(self._cuts)[: max(0, len(self._cuts) - CAPACITY)]:
            del self._cuts[key]

    def violated(self, support: Support, by: float, limit: int) -> list[Cut]:
        """Up to ``limit`` cuts violated by at least ``by``, most violated first."""
        if not self._cuts:
            return []
        if self._family is None:
            self._listed = list(self._cuts.values())
            self._family = Family.of(self._listed)
            self._rhs = np.array([c.rhs for c in self._listed])
        family = self._family
        value = boundary(
            family.ptr, family.nodes, support.ptr, support.other, support.weight, support.size
        )
        total = np.bincount(family.owner, value * family.weight, minlength=family.count)
        missing = self._rhs - total
        order = np.argsort(-missing, kind="stable")[:limit]
        return [self._listed[k] for k in order if missing[k] >= by]
