"""What a tool's path, and the whole file, takes at least, given what stays in place."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from tcp.boards.chain import Candidate, Stops, ToolOrder, linker
from tcp.boards.choose import Solved, part_rows, rank_of
from tcp.boards.trail import Trail, follow
from tcp.files.excellon import Program
from tcp.files.excellon.document import Ints
from tcp.files.excellon.program import Place
from tcp.instance import Instance
from tcp.solve import sharpen
from tcp.stop import Clock, Stop
from tcp.travel import CostRule, Travel
from tcp.workpiece import Workpiece

PAIRS = 4_000_000
"""Most pairs of places that are looked at to bound the link between two tools."""


def path_bound(
    program: Program, rows: tuple[int, int], mine: tuple[Solved, ...], shortest: int
) -> int | None:
    """The bound that the answers to a selection's stretches give; None where they give none.

    With all stretches in their new order the path takes ``shortest``, and each
    stretch could be shorter by no more than its gap.  A pattern that is
    repeated, and a stretch next to another one, have no bound of their own.
    """
    if any(p.first < rows[1] and rows[0] < p.last for p in program.patterns):
        return None
    if any(rows[0] <= block < rows[1] for block in program.weights):
        return None
    if any(s.stretch.chained or s.answer.bound is None for s in mine):
        return None
    slack = sum(s.answer.cost - (s.answer.bound or 0) for s in mine)
    return max(0, shortest - slack)


def loose_bound(
    program: Program,
    trail: Trail,
    number: int,
    costs: tuple[Travel, CostRule],
    clock: Clock,
    seconds: float,
) -> int:
    """A bound on the paths of a selection that has no other: the sum over its spans.

    For each the larger of two: all places in any order; and, where no pattern is
    repeated, the stretches one behind the other, each in any order, with the
    shortest moves from one to the next.

    Parameters
    ----------
    program, trail : Program, Trail
        The board, and every position of its machine.
    number : int
        The selection.
    costs : (Travel, CostRule)
        The travel model, and the board's costs.
    clock, seconds : Clock, float
        Held and Karp's ascents take so much of the clock's time; Ctrl-C ends them.
    """
    share = seconds / int((trail.part == number).sum())
    return sum(
        _span_bound(program, trail, slice(a, b + 1), costs, clock, share * (b + 1 - a))
        for part, a, b in trail.spans()
        if part == number
    )


def _span_bound(
    program: Program,
    trail: Trail,
    span: slice,
    costs: tuple[Travel, CostRule],
    clock: Clock,
    seconds: float,
) -> int:
    """A bound on the path through one span of a selection; see :func:`loose_bound`."""
    rule, rows = costs[1], trail.row[span]

    def any_order(places: Ints, seconds: float) -> int:
        return _any_order(program, places, costs, clock.part(Stop(seconds)))

    places = np.stack([trail.x[span], trail.y[span]])
    edges = np.flatnonzero(np.diff(program.rows.stretch[rows])) + 1
    first, last = int(rows.min()), int(rows.max())
    repeated = any(p.first <= last and first < p.last for p in program.patterns)
    if repeated or not len(edges):
        return any_order(places, seconds)
    whole = any_order(places, seconds / 2)
    pieces = np.split(places, edges, axis=1)
    share = seconds / 2 / places.shape[1]
    inside = sum(any_order(p, share * p.shape[1]) for p in pieces)
    links = sum(nearest(rule, (p[0], p[1]), (q[0], q[1])) for p, q in pairwise(pieces))
    return max(whole, inside + links)


def _any_order(program: Program, places: Ints, costs: tuple[Travel, CostRule], clock: Clock) -> int:
    """A bound on any path through some places, given as two rows of coordinates."""
    from tcp.bounds.one_tree import one_tree_bound  # loads numba

    travel, rule = costs
    x, y = (np.ascontiguousarray(axis) for axis in np.unique(places, axis=1))
    if len(x) < 3:
        return int(rule.costs(np.diff(x), np.diff(y)).sum())
    names = tuple(map(str, range(len(x))))
    instance = Instance(Workpiece("places", names, x, y, program.step), travel)
    found = one_tree_bound(instance, clock=clock).value
    worth = (sharpen(instance, found) or 0) * instance.quantum
    return int(worth / rule.quantum)


def least_chain(
    program: Program,
    rule: CostRule,
    stops: Stops,
    tool_order: ToolOrder,
    bounds: Mapping[int, int],
    small: Mapping[int, list[Candidate]],
) -> int:
    """What any chain of the selections takes at least, links included.

    Parameters
    ----------
    program, rule, stops : Program, CostRule, Stops
        The board, its costs, start and park position.
    tool_order : ToolOrder
        Where tools may change places, paths and links are bounded one by one.
    bounds : mapping
        What the paths of each selection take at least, whatever their ends.
    small : mapping
        All paths of a selection that may be best, by its number; others may
        begin and end at any of their places.
    """
    if tool_order is ToolOrder.OPTIMISE:
        return sum(bounds.values()) + least_links(program, rule, stops)
    trail, link = follow(program), linker(rule)
    spans, left = trail.spans(), dict(bounds)
    times = Counter(number for number, _, _ in spans)
    # tools whose spans alternate are in a repeated block, and change no places
    if tool_order is ToolOrder.ASCENDING and len(times) == len(spans):
        spans.sort(key=lambda span: rank_of(program, span[0]))

    def places(*found: Place | None) -> Ints:
        return np.array([p for p in found if p is not None], dtype=np.int64).reshape(-1, 2)

    at, cost = places(stops[0]), np.zeros(1, dtype=np.int64)
    for number, first, last in spans:
        ways = small.get(number, []) if times[number] == 1 else []
        if ways and len(at) * len(ways) <= PAIRS:
            moves = link(at, places(*(w.entry for w in ways))) if len(at) else 0
            cost = (cost[:, None] + moves).min(axis=0) + np.array([w.cost for w in ways])
            at = places(*(w.exit for w in ways))
            continue
        part = slice(first, last + 1)
        there = np.unique(np.stack([trail.x[part], trail.y[part]]), axis=1).T
        cost = np.array([_onward(rule, at, cost, there) + left.pop(number, 0)])
        at = there
    return _onward(rule, at, cost, places(stops[1]))


def _onward(rule: CostRule, at: Ints, cost: Ints, there: Ints) -> int:
    """The least cost of being at one of some places and moving to one of others; 0 to none."""
    if not len(at) or not len(there):
        return int(cost.min())
    if len(cost) == 1 or len(at) * len(there) > PAIRS:
        return int(cost.min()) + nearest(rule, (at[:, 0], at[:, 1]), (there[:, 0], there[:, 1]))
    reached: Ints = cost[:, None] + linker(rule)(at, there)
    return int(reached.min())


def least_links(program: Program, rule: CostRule, stops: Stops) -> int:
    """What the moves between selections, from the start and to the park take at least.

    With the order of tools free: a shortest spanning tree, for any chain has one.
    """
    trail = follow(program)
    numbers = [number for number, _ in part_rows(program)]
    sets = [(trail.x[trail.part == n], trail.y[trail.part == n]) for n in numbers]
    sets += [(np.array([p[0]]), np.array([p[1]])) for p in stops if p is not None]
    far = [[nearest(rule, p, q) for q in sets] for p in sets]
    total, outside = 0, {i: far[0][i] for i in range(1, len(sets))}
    while outside:
        best = min(outside, key=lambda i: outside[i])
        total += outside.pop(best)
        outside = {i: min(d, far[best][i]) for i, d in outside.items()}
    return total


def nearest(rule: CostRule, p: tuple[Ints, Ints], q: tuple[Ints, Ints]) -> int:
    """A lower bound on the cost of a move from one set of places to another; exact if small."""
    if len(p[0]) * len(q[0]) > PAIRS:
        gaps = [
            np.array([max(0, int(a.min() - b.max()), int(b.min() - a.max()))])
            for a, b in zip(p, q, strict=True)
        ]
        return int(rule.costs(*gaps)[0])
    return int(
        rule.costs(
            np.subtract.outer(p[0], q[0]).ravel(), np.subtract.outer(p[1], q[1]).ravel()
        ).min()
    )
