"""Puts the tools' paths one behind the other: which way to work each, and in which order.

Each tool brings candidate paths with their two ends; a small one a shortest
path between every two ends.  With the order of tools kept, the best choice is
a dynamic programme along the chain; with the order free it runs over subsets
of tools.  Above :data:`MOST` tools the order comes from an instance of its own:
two nodes a tool that must follow each other.
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
from tcp.travel import CostRule, Ints, Model, Travel
from tcp.workpiece import Workpiece

MOST = 12
"""Most tools for which the order is optimised over subsets."""

LINK_TIME = 3.0
"""Most seconds for the order of more tools than that; a proof is seldom as slow."""


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

Link = Callable[[Ints, Ints], Ints]
"""Costs of the moves from each of some places, (n, 2), to each of others, (m, 2): (n, m)."""

FAR = 2**62
"""More than any chain takes."""


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
        The ways to work each selection, the second of them a shortest path.
    rank : sequence
        What ``ascending`` sorts by.
    tool_order : ToolOrder
        The order that is wanted.
    rule, step : CostRule, Fraction
        Costs of links.
    stops : pair of places or None
        Start and park position.
    """
    link = linker(rule)
    kept = in_order(parts, link, *stops)
    if tool_order is ToolOrder.KEEP:
        return kept
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
    ends = [(c[min(1, len(c) - 1)].entry, c[min(1, len(c) - 1)].exit) for c in parts]
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
    route = solve(instance, "auto", stop=Stop(LINK_TIME), exact=True).route
    assert route is not None
    return list(dict.fromkeys(owner[node] for node in route if node < len(owner)))


def linker(rule: CostRule) -> Link:
    """Costs of moves between places, by a rule."""

    def link(p: Ints, q: Ints) -> Ints:
        return rule.costs(np.subtract.outer(p[:, 0], q[:, 0]), np.subtract.outer(p[:, 1], q[:, 1]))

    return link


def in_order(
    parts: Sequence[Sequence[Candidate]],
    link: Link,
    start: Place | None = None,
    park: Place | None = None,
) -> Chain:
    """The best candidate of each part, the parts in the order given."""
    total = np.zeros(1, dtype=np.int64)
    places, before = _at([start]), []
    for candidates in parts:
        reached = total[:, None] + _moves(link, places, _at([c.entry for c in candidates]))
        before.append(reached.argmin(axis=0))
        total = reached.min(axis=0) + np.array([c.cost for c in candidates], dtype=np.int64)
        places = _at([c.exit for c in candidates])
    total = total + _moves(link, places, _at([park]))[:, 0]
    k = int(total.argmin())
    cost, steps = int(total[k]), []
    for i in reversed(range(len(parts))):
        steps.append((i, k))
        k = int(before[i][k])
    return Chain(cost, tuple(reversed(steps)))


def any_order(
    parts: Sequence[Sequence[Candidate]],
    link: Link,
    start: Place | None = None,
    park: Place | None = None,
) -> Chain:
    """The best candidate of each part and the best order of parts; at most :data:`MOST` parts.

    Held and Karp's dynamic programme over subsets of parts and the last exit:
    from there to every entry, and through the next part to its exits.
    """
    assert len(parts) <= MOST
    doors = [_Doors(candidates) for candidates in parts]
    if not doors:
        return in_order(parts, link, start, park)
    entry = np.cumsum([0, *(len(d.entries) for d in doors)])
    leave = np.cumsum([0, *(len(d.exits) for d in doors)])
    exits = np.concatenate([d.exits for d in doors])
    moves = link(exits, np.concatenate([d.entries for d in doors]))
    begin: list[Ints] = [_moves(link, _at([start]), d.entries)[0] for d in doors]
    best = np.full((1 << len(doors), leave[-1]), FAR, dtype=np.int64)

    def arrive(used: int, j: int) -> Ints:
        """Cost up to each entry of part ``j`` once the parts ``used`` are worked."""
        reached: Ints = best[used][:, None] + moves[:, entry[j] : entry[j + 1]]
        return reached.min(axis=0) if used else begin[j]

    for used in range((1 << len(doors)) - 1):
        for j, door in enumerate(doors):
            if not used >> j & 1:
                through = (arrive(used, j)[:, None] + door.cost).min(axis=0)
                best[used | 1 << j, leave[j] : leave[j + 1]] = through
    used = (1 << len(doors)) - 1
    ended = best[used] + _moves(link, exits, _at([park]))[:, 0]
    x, steps = int(ended.argmin()), []
    cost = int(ended[x])
    while used:
        j = int(np.searchsorted(leave, x, side="right")) - 1
        used ^= 1 << j
        e = int((arrive(used, j) + doors[j].cost[:, x - leave[j]]).argmin())
        steps.append((j, int(doors[j].pick[e, x - leave[j]])))
        x = int((best[used] + moves[:, entry[j] + e]).argmin())
    return Chain(cost, tuple(reversed(steps)))


class _Doors:
    """A part by its ends: the cheapest candidate from every entry to every exit."""

    def __init__(self, candidates: Sequence[Candidate]):
        entries = {place: k for k, place in enumerate(dict.fromkeys(c.entry for c in candidates))}
        exits = {place: k for k, place in enumerate(dict.fromkeys(c.exit for c in candidates))}
        self.entries, self.exits = _at([*entries]), _at([*exits])
        self.cost = np.full((len(entries), len(exits)), FAR // 2, dtype=np.int64)
        self.pick = np.zeros((len(entries), len(exits)), dtype=np.int64)
        for k, c in enumerate(candidates):
            at = entries[c.entry], exits[c.exit]
            if c.cost < self.cost[at]:
                self.cost[at], self.pick[at] = c.cost, k


def _at(places: Sequence[Place | None]) -> Ints:
    """Places as rows; none at all for None, which is anywhere."""
    return np.array([p for p in places if p is not None], dtype=np.int64).reshape(-1, 2)


def _moves(link: Link, p: Ints, q: Ints) -> Ints:
    """Costs of moves; nothing from or to a place that may be anywhere."""
    if len(p) and len(q):
        return link(p, q)
    return np.zeros((max(len(p), 1), max(len(q), 1)), dtype=np.int64)
