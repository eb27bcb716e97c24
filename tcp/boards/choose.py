"""From solved stretches to one order of the whole board: each tool's path, and which way round."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise

import numpy as np

from tcp.boards.chain import Candidate, Link, Stops, ToolOrder, arrange, in_order
from tcp.boards.effort import Answer
from tcp.boards.stretch import Stretch
from tcp.boards.trail import Costs, Trail, follow, measure
from tcp.files.excellon import Program
from tcp.files.excellon.document import Ints
from tcp.files.excellon.program import Columns, Place, Repeat
from tcp.files.excellon.rewrite import Order
from tcp.travel import CostRule

PAIRS = 4_000_000
"""Most pairs of places that are looked at to bound the link between two tools."""

Orders = dict[int, Order]


@dataclass(frozen=True)
class Solved:
    """A stretch with the answer to it, without its route, and the order that it stands for."""

    stretch: Stretch
    answer: Answer
    order: Order


@dataclass(frozen=True)
class Choice:
    """What was chosen.

    Parameters
    ----------
    orders : mapping
        New orders of the stretches that change.
    shortest : Costs
        Travel with every path at its shortest.
    sequence : tuple of int
        The selections that do any work, in the order they are to be worked.
    gain : int
        What another order of tools saves against the file's own.
    """

    orders: Orders
    shortest: Costs
    sequence: tuple[int, ...]
    gain: int


def choose(
    program: Program,
    rule: CostRule,
    solved: list[Solved],
    stops: Stops,
    tool_order: ToolOrder = ToolOrder.KEEP,
) -> Choice:
    """The best way to work each selection: the new path, that path reversed, or the old.

    Ties go to the file's own order, then to the new path as the solver gave it.
    """
    parts = part_rows(program)
    mine = {n: [s for s in solved if a <= s.stretch.first < b] for n, (a, b) in parts}
    forth = whole_orders(program, [(s, s.order) for s in solved])
    back = dict(forth)
    for number, rows in parts:
        if _reversible(mine[number], rows):
            only = mine[number][0]
            back[only.stretch.first] = only.stretch.backwards(only.order)
    versions: list[Orders] = [{}, forth, back]
    candidates = _candidates(program, rule, versions)
    ways = [candidates[number] for number, _ in parts]
    kept = in_order(ways, linker(rule), *stops)
    chain = kept
    if tool_order is not ToolOrder.KEEP:
        rank = [_rank(program, number) for number, _ in parts]
        chain = arrange(ways, rank, tool_order, rule, program.step, stops)
    orders: Orders = {}
    for at, k in chain.steps:
        a, b = parts[at][1]
        orders |= {first: order for first, order in versions[k].items() if a <= first < b}
    sequence = tuple(parts[at][0] for at, _ in chain.steps)
    shortest = measure(permuted(program, forth), rule)
    return Choice(orders, shortest, sequence, kept.cost - chain.cost)


def _rank(program: Program, number: int) -> tuple[Fraction, int]:
    """By diameter, then by number."""
    tool = program.tools[program.selections[number].tool]
    return tool.diameter or Fraction(0), tool.number


def part_rows(program: Program) -> list[tuple[int, tuple[int, int]]]:
    """Selections that do any work, by position, with their rows."""
    firsts = [s.first for s in program.selections]
    bounds = [*firsts, len(program.rows)]
    return [(i, (a, bounds[i + 1])) for i, a in enumerate(firsts) if bounds[i + 1] > a]


def _reversible(mine: list[Solved], rows: tuple[int, int]) -> bool:
    """Whether one stretch without fixed ends or directed units is all that a selection does."""
    if len(mine) != 1 or (mine[0].stretch.first, mine[0].stretch.last) != rows:
        return False
    return not mine[0].stretch.directed().any()


def _candidates(
    program: Program, rule: CostRule, versions: list[Orders]
) -> dict[int, list[Candidate]]:
    """For each selection its path in every version of the board."""
    found: dict[int, list[Candidate]] = {}
    for orders in versions:
        version = permuted(program, orders)
        costs, trail = measure(version, rule), follow(version)
        for number, first, last in _spans(trail):
            entry = int(trail.x[first]), int(trail.y[first])
            leave = int(trail.x[last]), int(trail.y[last])
            candidate = Candidate(costs.parts[number], entry, leave)
            found.setdefault(number, []).append(candidate)
    return found


def _spans(trail: Trail) -> list[tuple[int, int, int]]:
    """Selections with their first and last position on the trail."""
    edges = np.flatnonzero(np.diff(trail.part)) + 1
    firsts = [0, *edges.tolist()]
    lasts = [*(edges - 1).tolist(), len(trail.part) - 1]
    return [(int(trail.part[a]), a, b) for a, b in zip(firsts, lasts, strict=True)]


def linker(rule: CostRule) -> Link:
    """Cost of the move between two places; nothing where one of them is open."""

    def link(p: Place | None, q: Place | None) -> int:
        if p is None or q is None:
            return 0
        return int(rule.costs(np.array([p[0] - q[0]]), np.array([p[1] - q[1]]))[0])

    return link


def whole_orders(program: Program, pieces: list[tuple[Solved, Order]]) -> Orders:
    """Orders of whole stretches, where some of their first units are locked."""
    orders: Orders = {}
    given = {s.stretch.first: order for s, order in pieces}
    for a, b in program.stretches():
        inside = next((first for first in given if a <= first < b), None)
        if inside is not None:
            orders[a] = _joined(Order.as_is(a, inside), given[inside])
    return orders


def _joined(one: Order, other: Order) -> Order:
    return Order(
        np.concatenate([one.rows, other.rows]), np.concatenate([one.reverse, other.reverse])
    )


def permuted(program: Program, orders: Mapping[int, Order]) -> Program:
    """The program with stretches re-ordered, as a model: its text is still the old one."""
    if not orders:
        return program
    rows = program.rows
    source = np.arange(len(rows), dtype=np.int32)
    turned = np.zeros(len(rows), dtype=np.bool_)
    for first, order in orders.items():
        source[first : first + len(order)] = order.rows
        turned[first : first + len(order)] = order.reverse

    def pick(one: Ints, other: Ints) -> Ints:
        return np.where(turned, other[source], one[source]) if turned.any() else one[source]

    place = np.empty_like(source)
    place[source] = np.arange(len(rows))
    x, y = pick(rows.x1, rows.x2), pick(rows.y1, rows.y2)
    point = rows.x1 is rows.x2 and rows.y1 is rows.y2
    table = Columns(
        rows.kind[source],
        rows.tool[source],
        x,
        y,
        x if point else pick(rows.x2, rows.x1),
        y if point else pick(rows.y2, rows.y1),
        rows.first[source],
        rows.last[source],
        rows.mark[source],
        rows.stretch,
    )
    repeats = {
        int(place[row]): _turned(found) if turned[place[row]] else found
        for row, found in program.repeats.items()
    }
    routes = {
        int(place[row]): moves[::-1] if turned[place[row]] else moves
        for row, moves in program.routes.items()
    }
    weights = {int(place[row]): count for row, count in program.weights.items()}
    return replace(program, rows=table, repeats=repeats, routes=routes, weights=weights)


def _turned(repeats: tuple[Repeat, ...]) -> tuple[Repeat, ...]:
    return tuple(Repeat(r.count, -r.dx, -r.dy, r.line) for r in reversed(repeats))


def least_links(
    program: Program, rule: CostRule, stops: Stops, tool_order: ToolOrder = ToolOrder.KEEP
) -> int:
    """What the moves between selections, from the start and to the park take at least.

    With the order of tools kept, the nearest places of each and the next; with
    the order free, a shortest spanning tree: any chain is one.
    """
    trail = follow(program)
    numbers = [number for number, _ in part_rows(program)]
    if tool_order is ToolOrder.ASCENDING:
        numbers.sort(key=lambda number: _rank(program, number))
    sets = [(trail.x[trail.part == n], trail.y[trail.part == n]) for n in numbers]
    for point, at in ((stops[0], 0), (stops[1], len(sets) + 1)):
        if point is not None:
            sets.insert(at, (np.array([point[0]]), np.array([point[1]])))
    if tool_order is not ToolOrder.OPTIMISE:
        return sum(nearest(rule, p, q) for p, q in pairwise(sets))
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
