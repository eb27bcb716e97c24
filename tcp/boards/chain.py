"""Puts the tools' paths one behind the other: which way round each, and in which order.

Each tool brings a few candidate paths (the shortest one from either end, and
the file's own).  With the order of tools kept, the best choice is a dynamic
programme along the chain; with the order free it runs over subsets of tools,
which is exact up to :data:`MOST` of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from tcp.files.excellon.program import Place

MOST = 12
"""Most tools whose order is optimised exactly."""


@dataclass(frozen=True)
class Candidate:
    """One way to work a tool selection: cost inside, entry, exit, and what it stands for."""

    cost: int
    entry: Place
    exit: Place
    choice: Any = None


Link = Callable[[Place | None, Place | None], int]
"""Cost of the move between two places; None is anywhere, at no cost."""


@dataclass(frozen=True)
class Chain:
    """The best chain: total cost, and (part, candidate) in the order they are worked."""

    cost: int
    steps: tuple[tuple[int, int], ...]


def in_order(
    parts: Sequence[Sequence[Candidate]],
    link: Link,
    start: Place | None = None,
    park: Place | None = None,
) -> Chain:
    """The best candidate of each part, the parts in the order given."""
    table: list[Chain] = []
    for i, candidates in enumerate(parts):
        table = [
            min(
                (
                    Chain(
                        before.cost + link(_exit(parts, before, start), c.entry) + c.cost,
                        (*before.steps, (i, k)),
                    )
                    for before in (table or [Chain(0, ())])
                ),
                key=lambda chain: chain.cost,
            )
            for k, c in enumerate(candidates)
        ]
    return _closed(parts, table, link, start, park)


def any_order(
    parts: Sequence[Sequence[Candidate]],
    link: Link,
    start: Place | None = None,
    park: Place | None = None,
) -> Chain:
    """The best candidate of each part and the best order of parts; at most :data:`MOST` parts."""
    assert len(parts) <= MOST
    ends = [(i, k) for i, candidates in enumerate(parts) for k in range(len(candidates))]
    entry = {e: parts[e[0]][e[1]] for e in ends}
    links = {
        (e, f): link(entry[e].exit, entry[f].entry) for e in ends for f in ends if e[0] != f[0]
    }
    layer = {(1 << e[0], e): Chain(link(start, entry[e].entry) + entry[e].cost, (e,)) for e in ends}
    for _ in range(len(parts) - 1):
        following: dict[tuple[int, tuple[int, int]], Chain] = {}
        for (used, e), chain in layer.items():
            for f in ends:
                if used >> f[0] & 1:
                    continue
                cost = chain.cost + links[e, f] + entry[f].cost
                key = (used | 1 << f[0], f)
                if key not in following or cost < following[key].cost:
                    following[key] = Chain(cost, (*chain.steps, f))
        layer = following
    return _closed(parts, list(layer.values()), link, start, park)


def _exit(parts: Sequence[Sequence[Candidate]], chain: Chain, start: Place | None) -> Place | None:
    if not chain.steps:
        return start
    part, k = chain.steps[-1]
    return parts[part][k].exit


def _closed(
    parts: Sequence[Sequence[Candidate]],
    table: list[Chain],
    link: Link,
    start: Place | None,
    park: Place | None,
) -> Chain:
    """The best chain once the way to the park position is added."""
    if not parts:
        return Chain(link(start, park) if start and park else 0, ())
    ended = [
        Chain(c.cost + (link(_exit(parts, c, start), park) if park else 0), c.steps) for c in table
    ]
    return min(ended, key=lambda chain: chain.cost)
