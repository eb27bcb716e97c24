"""Puts the tools' paths one behind the other: which way round each, and in which order.

Each tool brings a few candidate paths (the shortest one from either end, and
the file's own).  With the order of tools kept, the best choice is a dynamic
programme along the chain; with the order free it runs over subsets of tools.
Above :data:`MOST` tools the chain is an instance of its own: two nodes a tool
that must follow each other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from typing import Any

import numpy as np

from tcp.files.excellon.program import Place
from tcp.instance import Ends, Instance, Rules
from tcp.solve import solve
from tcp.stop import Stop
from tcp.travel import CostRule, Model, Travel
from tcp.workpiece import Workpiece

MOST = 12
"""Most tools for which the order is optimised over subsets."""

LINK_TIME = 3.0
"""Seconds for the order of more tools than that."""


@dataclass(frozen=True)
class Candidate:
    """One way to work a tool selection: cost inside, entry, exit, and what it stands for."""

    cost: int
    entry: Place
    exit: Place
    choice: Any = None


class ToolOrder(StrEnum):
    """In which order tools are worked: the file's, by diameter, or whichever is shortest."""

    KEEP = "keep"
    ASCENDING = "ascending"
    OPTIMISE = "optimise"


Stops = tuple[Place | None, Place | None]
"""Where the machine stands before, and where it goes to afterwards; None is anywhere."""

Link = Callable[[Place | None, Place | None], int]
"""Cost of the move between two places; None is anywhere, at no cost."""


@dataclass(frozen=True)
class Chain:
    """The best chain: total cost, and (part, candidate) in the order they are worked."""

    cost: int
    steps: tuple[tuple[int, int], ...]


def arrange(
    parts: Sequence[Sequence[Candidate]],
    rank: Sequence[Any],
    tool_order: ToolOrder,
    rule: CostRule,
    step: Fraction,
    stops: Stops,
) -> Chain:
    """The best chain for an order of tools.

    Parameters
    ----------
    parts : sequence of candidates
        The ways to work each selection; with two or more of them the second
        and third are one path either way round.
    rank : sequence
        What ``ascending`` sorts by.
    tool_order : ToolOrder
        The order that is wanted.
    rule, step : CostRule, Fraction
        Costs of links.
    stops : pair of places or None
        Start and park position.
    """

    def link(p: Place | None, q: Place | None) -> int:
        if p is None or q is None:
            return 0
        return int(rule.costs(np.array([p[0] - q[0]]), np.array([p[1] - q[1]]))[0])

    kept = in_order(parts, link, *stops)
    if tool_order is ToolOrder.ASCENDING:
        order = sorted(range(len(parts)), key=lambda i: rank[i])
        return _sorted(parts, order, link, stops)
    if len(parts) <= MOST:
        return min(kept, any_order(parts, link, *stops), key=lambda c: c.cost)
    order = _many(parts, step, stops, rule)
    return min(kept, _sorted(parts, order, link, stops), key=lambda c: c.cost)


def _sorted(
    parts: Sequence[Sequence[Candidate]], order: Sequence[int], link: Link, stops: Stops
) -> Chain:
    """The best candidates with the parts in a given order."""
    chain = in_order([parts[i] for i in order], link, *stops)
    return Chain(chain.cost, tuple((order[i], k) for i, k in chain.steps))


def _many(
    parts: Sequence[Sequence[Candidate]], step: Fraction, stops: Stops, rule: CostRule
) -> list[int]:
    """An order of many parts, from the instance whose nodes are their ends."""
    ends = [(c[-1].entry, c[-1].exit) for c in parts]
    places = [place for pair in ends for place in pair]
    owner = [i for i in range(len(parts)) for _ in range(2)]
    start = end = None
    if stops[0] is not None:
        start = len(places)
        places.append(stops[0])
    if stops[1] is not None:
        end = len(places)
        places.append(stops[1])
    x, y = (np.array([p[axis] for p in places], dtype=np.int64) for axis in (0, 1))
    matrix = rule.costs(x[:, None] - x[None, :], y[:, None] - y[None, :])
    piece = Workpiece("tools", tuple(map(str, range(len(places)))), x, y, step, matrix=matrix)
    pairs = tuple((2 * i, 2 * i + 1) for i in range(len(parts)))
    instance = Instance(piece, Travel(Model.EXPLICIT), Ends(start, end), Rules(together=pairs))
    route = solve(instance, "auto", stop=Stop(LINK_TIME)).route
    assert route is not None
    return list(dict.fromkeys(owner[node] for node in route if node < len(owner)))


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
