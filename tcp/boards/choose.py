"""From solved stretches to one order of the whole board: which path each tool takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction

import numpy as np

from tcp.boards.chain import MOST, Candidate, Chain, Stops, ToolOrder, arrange, in_order, linker
from tcp.boards.effort import Answer
from tcp.boards.ends import TABLES, Units, all_ends, few, joined, table, turned
from tcp.boards.stretch import Stretch
from tcp.boards.trail import Costs, follow, measure
from tcp.files.excellon import Mark, Program
from tcp.files.excellon.document import Ints
from tcp.files.excellon.program import Columns, Place, Repeat
from tcp.files.excellon.rewrite import Order
from tcp.travel import CostRule

ROUNDS = 100
"""Most times that the paths of larger tools are fitted to their neighbours; a few settle it."""

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
    ends_gain : int
        What is saved by paths whose ends were chosen with the next tool in view.
    saves : mapping
        What is saved between the tools by each path that is longer than need be.
    least : int or None
        The chain's cost, where no order of the file's units can have a lower one.
    small : mapping
        Every path that may be best, of the selections for which all of them are known.
    """

    orders: Orders
    shortest: Costs
    sequence: tuple[int, ...]
    gain: int
    ends_gain: int = 0
    saves: Mapping[int, int] = field(default_factory=dict)
    least: int | None = None
    small: Mapping[int, list[Candidate]] = field(default_factory=dict)


Fit = Callable[[Solved, Units, Order, Place | None, Place | None], Order]
"""Fits a path to the places that the machine comes from and goes to."""


def fit(
    solved: Solved, units: Units, order: Order, before: Place | None, after: Place | None
) -> Order:
    """Reverse its beginning and its end where that helps."""
    return turned(units, order, before, after)


def choose(
    program: Program,
    rule: CostRule,
    solved: list[Solved],
    stops: Stops,
    tool_order: ToolOrder = ToolOrder.KEEP,
    fit: Fit = fit,
    interrupted: Callable[[], bool] = lambda: False,
) -> Choice:
    """The best way to work each selection, its path and the ways between the tools together.

    Candidates are the file's own order, the new path and that path reversed; a
    small tool's shortest path between every two ends; and paths of larger tools
    that are fitted to the places where their neighbours end and begin.  The file's
    own order has no part in the fitting, so that this does not depend on it.  Ties go
    to the file's own order, then to the new path as the solver gave it.

    Where a block in which tools change is repeated, the moves from copy to copy are
    missing in a chain's cost.  They are the same in all chains, as the insides of
    blocks have no part in the choice, so the best one is still the best.
    """
    parts = part_rows(program)
    mine = [[s for s in solved if a <= s.stretch.first < b] for _, (a, b) in parts]
    forth = whole_orders(program, [(s, s.order) for s in solved])
    plain = _candidates(program, rule, forth, mine)
    units = {
        at: Units.of(mine[at][0].stretch, rule, plain[at][0].cost)
        for at, (_, rows) in enumerate(parts)
        if _alone(mine[at], rows) and not any(s.answer.interrupted for s in solved)
    }
    small = _small(units, interrupted)
    small |= {at: plain[at][:1] for at, (_, rows) in enumerate(parts) if _settled(program, *rows)}
    ways = [[*small.get(at, found[1:])] for at, found in enumerate(plain)]
    rank = [rank_of(program, number) for number, _ in parts]

    def best(ways: list[list[Candidate]]) -> Chain:
        return arrange(ways, rank, tool_order, rule, program.step, stops)

    large = {at: (mine[at][0], u) for at, u in units.items() if at not in small}
    _fitted(ways, large, best, stops, fit)
    ways = [[*found[:1], *more] for found, more in zip(plain, ways, strict=True)]
    as_it_is = best([found[:1] for found in plain])
    chain = min(as_it_is, best(ways), key=lambda chain: chain.cost)
    orders: Orders = {}
    for at, k in chain.steps:
        orders |= ways[at][k].choice()
    everything = len(small) == len(follow(program).spans()) and (
        tool_order is not ToolOrder.OPTIMISE or len(parts) <= MOST
    )
    return Choice(
        orders,
        measure(permuted(program, forth), rule),
        tuple(parts[at][0] for at, _ in chain.steps),
        in_order(ways, linker(rule), *stops).cost - chain.cost,
        best(plain).cost - chain.cost,
        {parts[at][0]: saved for at, saved in _detours(ways, chain, rule, stops).items()},
        chain.cost if everything else None,
        {parts[at][0]: found for at, found in small.items()},
    )


def _small(
    units: Mapping[int, Units], interrupted: Callable[[], bool]
) -> dict[int, list[Candidate]]:
    """Every path that may be best of parts of a few units, until Ctrl-C or memory says stop."""
    small, room = {}, TABLES
    for at, one in units.items():
        if few(one.stretch) and table(one.stretch) <= room and not interrupted():
            small[at] = all_ends(one)
            room -= table(one.stretch)
    return small


def _fitted(
    ways: list[list[Candidate]],
    large: Mapping[int, tuple[Solved, Units]],
    best: Callable[[list[list[Candidate]]], Chain],
    stops: Stops,
    fit: Fit,
) -> None:
    """Add paths of large parts that fit the best chain, and the one after that, and so on."""
    chain = best(ways)
    for _ in range(ROUNDS):
        for at, order, before, after in _between(ways, chain, stops):
            if at in large and not large[at][1].stretch.directed().any():
                solved, units = large[at]
                order = order or units.stretch.as_is()
                ways[at] += units.both_ways(fit(solved, units, order, before, after))
        again = best(ways)
        if again.cost >= chain.cost:
            return
        chain = again


def _between(
    ways: list[list[Candidate]], chain: Chain, stops: Stops
) -> list[tuple[int, Order | None, Place | None, Place | None]]:
    """Each part of a chain with its order (None: the file's), and the places around it."""
    picked = [ways[at][k] for at, k in chain.steps]
    before = [stops[0], *(c.exit for c in picked[:-1])]
    after = [*(c.entry for c in picked[1:]), stops[1]]
    return [
        (at, next(iter(c.choice().values()), None), p, q)
        for (at, _), c, p, q in zip(chain.steps, picked, before, after, strict=True)
    ]


def _detours(
    ways: list[list[Candidate]], chain: Chain, rule: CostRule, stops: Stops
) -> dict[int, int]:
    """What each path that is longer than its part's shortest saves between the parts.

    It is compared with the best chain in the same order of parts in which that
    part alone must take a shortest path.
    """
    found = {}
    for place, (at, k) in enumerate(chain.steps):
        least = min(c.cost for c in ways[at])
        longer = ways[at][k].cost - least
        if longer:
            others = [ways[i] for i, _ in chain.steps]
            others[place] = [c for c in ways[at] if c.cost == least]
            found[at] = in_order(others, linker(rule), *stops).cost - chain.cost + longer
    return found


def rank_of(program: Program, number: int) -> tuple[Fraction, int]:
    """By diameter, then by number."""
    tool = program.tools[program.selections[number].tool]
    return tool.diameter or Fraction(0), tool.number


def part_rows(program: Program) -> list[tuple[int, tuple[int, int]]]:
    """Selections that do any work, by position, with their rows."""
    firsts = [s.first for s in program.selections]
    bounds = [*firsts, len(program.rows)]
    return [(i, (a, bounds[i + 1])) for i, a in enumerate(firsts) if bounds[i + 1] > a]


def _settled(program: Program, a: int, b: int) -> bool:
    """Whether there is nothing but one unit that can be worked in one way only."""
    rows = program.rows
    slot = rows.x1[a] != rows.x2[a] or rows.y1[a] != rows.y2[a]
    free = slot and bool(rows.mark[a] & Mark.FREE)
    return b - a == 1 and a not in program.weights and not free


def _alone(mine: list[Solved], rows: tuple[int, int]) -> bool:
    """Whether one stretch without fixed ends is all that a selection does."""
    return len(mine) == 1 and (mine[0].stretch.first, mine[0].stretch.last) == rows


def _candidates(
    program: Program, rule: CostRule, forth: Orders, mine: list[list[Solved]]
) -> list[list[Candidate]]:
    """For each selection the file's path, the new one, and the new one backwards if it may be."""
    back, parts, none = dict(forth), part_rows(program), Orders()
    for solved, (_, rows) in zip(mine, parts, strict=True):
        if _alone(solved, rows) and not solved[0].stretch.directed().any():
            only = solved[0]
            back[only.stretch.first] = only.stretch.backwards(only.order)
    found: dict[int, list[Candidate]] = {number: [] for number, _ in parts}
    for orders in (none, forth, back):
        version = permuted(program, orders)
        costs, trail = measure(version, rule), follow(version)
        spans = trail.spans()
        firsts = {number: first for number, first, _ in reversed(spans)}
        lasts = {number: last for number, _, last in spans}
        for number, (a, b) in parts:
            first, last = firsts[number], lasts[number]
            own = {at: order for at, order in orders.items() if a <= at < b}
            entry = int(trail.x[first]), int(trail.y[first])
            leave = int(trail.x[last]), int(trail.y[last])
            found[number].append(Candidate(costs.parts[number], entry, leave, own.copy))
    return list(found.values())


def whole_orders(program: Program, pieces: list[tuple[Solved, Order]]) -> Orders:
    """Orders of whole stretches, where some of their first units are locked."""
    orders: Orders = {}
    given = {s.stretch.first: order for s, order in pieces}
    for a, b in program.stretches():
        inside = next((first for first in given if a <= first < b), None)
        if inside is not None:
            orders[a] = joined(Order.as_is(a, inside), given[inside])
    return orders


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
