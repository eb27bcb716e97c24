"""A drill file in, the same holes in a shorter order out: solved a tool at a time, chained.

The result is never worse than the input, tool by tool and as a whole: the
file's own order is a candidate everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from tcp.boards.board import Board, Part, Wishes
from tcp.boards.bound import least_chain, loose_bound, path_bound
from tcp.boards.chain import Stops, ToolOrder
from tcp.boards.choose import Choice, Fit, Solved, choose, part_rows
from tcp.boards.directed import FEW, legal, shortest
from tcp.boards.effort import BOUND_SHARE, LIMITS, Answer, Effort, answer, as_it_stands
from tcp.boards.ends import Units, tied, turned
from tcp.boards.stretch import Stretch, anchored, free_runs
from tcp.boards.trail import Costs, follow, measure, on_grid, rule_for
from tcp.boards.versions import by_old_number, by_tool, inside_out, prepared, rewritten
from tcp.errors import UsageError
from tcp.files.drilling import compare
from tcp.files.excellon import Kind, Program
from tcp.files.excellon.blocks import folded
from tcp.files.excellon.guard import LostError
from tcp.files.excellon.program import Pattern, Place
from tcp.files.excellon.rewrite import Order
from tcp.files.excellon.settings import Hints
from tcp.instance import Instance
from tcp.result import Progress, Proof
from tcp.solve import interruptible
from tcp.stop import Clock, Stop
from tcp.travel import CostRule

FIT_LEAST, FIT_SHARE = 0.5, 3.0
"""Seconds for fitting a path to its neighbours: at least, and times what the path took."""

FITS = 4
"""Pairs of places to which the proof engine fits one path: neighbours move when it has moved."""

News = Callable[[str, Instance, Progress], None]
"""Hears how the tools come along: tool, instance, progress.  Observes only."""


def optimise(
    program: Program,
    wishes: Wishes | None = None,
    hints: Hints | None = None,
    news: News | None = None,
) -> Board:
    """Put a board's holes into a shorter order.

    Parameters
    ----------
    program : Program
        The board as read.
    wishes : Wishes, optional
        What to keep and how hard to try.
    hints : Hints, optional
        Those the program was read with, to read the new file back.
    news : callable, optional
        Receives the tool's name, the instance and the solvers' progress.

    Returns
    -------
    Board
        With the new file's bytes, read back and compared hole by hole.

    Raises
    ------
    UsageError
        If the wishes do not fit the board.
    LostError
        If the new file would do other work than the old one.
    """
    clock = Clock(Stop())
    with interruptible(clock):
        return _optimise(program, wishes or Wishes(), hints, news, clock)


def _optimise(
    original: Program, wishes: Wishes, hints: Hints | None, news: News | None, clock: Clock
) -> Board:
    """See :func:`optimise`; the clock has no limit, but Ctrl-C rings it."""
    program, notes = prepared(original, wishes.merge, wishes.expand, wishes.tool_order, hints)
    rule = rule_for(program, wishes.machine.travel, (wishes.start, wishes.park))

    def travel(version: Program) -> Costs:
        return measure(version, rule, wishes.start, wishes.park)

    asked, costs = travel(original), travel(program)
    merged = by_tool(asked, original, program) if wishes.merge else asked
    program = inside_out(program, _solve_inside(program, wishes, news, clock), travel, hints)
    view = folded(program)
    solved = _solve_all(view, wishes, news, clock)
    at = stops(program, wishes)
    fit, rung = _fit(wishes, clock), lambda: clock.interrupted
    choice = choose(view, rule, solved, at, wishes.tool_order, fit, rung)
    after = rewritten(program, view, choice, hints)
    costs_after = travel(after)
    ended = by_old_number(costs_after, choice)
    if costs_after.total > costs.total and wishes.tool_order is not ToolOrder.ASCENDING:
        raise LostError(f"{program.path}: the new order is longer than the old one")
    guard = wishes.text_guard
    if not (wishes.merge or wishes.expand) and choice.sequence == tuple(sorted(choice.sequence)):
        guard = "same"
    compare(original, after, text=guard)
    parts = _parts(view, rule, wishes, merged, ended, choice, solved, clock)
    bounds = {part.number: part.bound or 0 for part in parts}
    least = least_chain(view, rule, at, wishes.tool_order, bounds, choice.small)
    if choice.least is not None:
        least = max(least, choice.least)
    if len(parts) == 1 and at == (None, None):
        parts = (parts[0].sharpened(least),)
    return Board(
        before=original,
        after=after,
        data=after.document.data,
        parts=parts,
        costs_before=asked,
        costs_after=costs_after,
        bound=least,
        rule=rule,
        wishes=wishes,
        notes=(*original.notes, *notes),
        interrupted=clock.interrupted,
        text_guard=guard,
        order_gain=choice.gain,
        ends_gain=choice.ends_gain,
    )


def _solve_inside(
    program: Program, wishes: Wishes, news: News | None, clock: Clock
) -> list[Solved]:
    """Solve what is inside step-and-repeat blocks: every order there is that of all copies."""
    runs = free_runs(program, locked_parts(program, wishes), 0)
    front = rows_in_front(program, wishes)
    blocks = [p for p in program.patterns if p.first >= front]
    inner = [run for run in runs if _inside(run, blocks)]
    return _solve_runs(program, inner, replace(wishes, certificates=None), news, clock)


def _solve_all(program: Program, wishes: Wishes, news: News | None, clock: Clock) -> list[Solved]:
    """Solve every stretch that is not inside a block, in file order."""
    runs = free_runs(program, locked_parts(program, wishes), rows_in_front(program, wishes))
    outer = [run for run in runs if not _inside(run, program.patterns)]
    return _solve_runs(program, outer, wishes, news, clock)


def _inside(run: tuple[int, int], blocks: Iterable[Pattern]) -> bool:
    """Whether a stretch of rows is inside one of these step-and-repeat blocks."""
    return any(block.first <= run[0] < block.last for block in blocks)


def _solve_runs(
    program: Program, runs: list[tuple[int, int]], wishes: Wishes, news: News | None, clock: Clock
) -> list[Solved]:
    """Solve some stretches; after Ctrl-C the rest stays as it is."""
    ends: dict[int, Place] = {}
    solved: list[Solved] = []
    for run in runs:
        stretch = anchored(program, run, runs, ends)
        instance = stretch.instance(wishes.machine.travel)
        if clock.interrupted:
            kept = as_it_stands(instance, stretch.route(stretch.as_is()))
            kept = replace(kept, interrupted=True)
            solved.append(Solved(stretch, kept, stretch.as_is()))
            continue
        as_is = stretch.route(stretch.as_is())
        name = f"T{program.rows.tool[run[0]]}"

        def report(progress: Progress, name: str = name, instance: Instance = instance) -> None:
            if news is not None:
                news(name, instance, progress)

        found = answer(
            instance,
            as_is,
            wishes.effort,
            wishes.time_limit,
            wishes.seed,
            report,
            _certificate(wishes.certificates, program, stretch, solved),
            program.path,
            wishes.panels,
            clock,
        )
        one = _legal(stretch, instance, found)
        # the order says it all; millions of integers of a route would stay in memory
        solved.append(replace(one, answer=replace(one.answer, route=())))
        ends[run[1] - 1] = stretch.end(solved[-1].order)
    return solved


def _legal(stretch: Stretch, instance: Instance, found: Answer) -> Solved:
    """The order that an answer stands for, its directed units the right way round."""
    as_is = stretch.as_is()
    kept = stretch.route(as_is)
    if found.route == kept:
        return Solved(stretch, found, as_is)
    order = legal(stretch, instance, stretch.order(found.route))
    route = stretch.route(order)
    if route == found.route:
        return Solved(stretch, found, order)
    if len(stretch) <= FEW:
        order = shortest(stretch, instance)
        route = stretch.route(order)
        found = replace(found, bound=instance.cost(route), proof=Proof.TRUSTED)
    if instance.cost(route) >= instance.cost(kept):
        order, route = as_is, kept
    cost = instance.cost(route)
    closed = found.bound is not None and found.bound >= cost
    proof, certificate = (found.proof, found.certificate) if closed else (Proof.NONE, None)
    answered = replace(found, route=route, cost=cost, proof=proof, certificate=certificate)
    return Solved(stretch, answered, order)


def _certificate(
    folder: Path | None, program: Program, stretch: Stretch, before: list[Solved]
) -> Path | None:
    """Where a stretch's certificate goes: ``board-T3.cert.json.gz``, ``board-T3-2...``."""
    if folder is None:
        return None
    tool = int(program.rows.tool[stretch.first])
    again = sum(int(program.rows.tool[s.stretch.first]) == tool for s in before)
    more = f"-{again + 1}" if again else ""
    return folder / f"{program.path.stem}-T{tool}{more}.cert.json.gz"


def _fit(wishes: Wishes, clock: Clock) -> Fit:
    """Fits paths to their neighbours: quick ones by the proof engine, the others at both ends.

    The engine gets no more time than the path itself needed thrice, and in all no
    more than is left of the tool's time; it fits each path to the same places once, and to
    :data:`FITS` pairs of places at most.
    """
    limit = LIMITS[wishes.effort] if wishes.time_limit is None else wishes.time_limit
    done: dict[int, set[tuple[Place | None, Place | None]]] = {}
    used: dict[int, float] = {}

    def fit(
        solved: Solved, units: Units, order: Order, before: Place | None, after: Place | None
    ) -> Order:
        order, spent = turned(units, order, before, after), solved.answer.seconds
        first = solved.stretch.first
        left = limit - spent - used.get(first, 0.0)
        seconds = min(left, max(FIT_LEAST, FIT_SHARE * spent))
        wanted = wishes.effort is not Effort.FAST and solved.answer.optimal and seconds > 0
        fitted = done.setdefault(first, set())
        if clock.interrupted or not wanted or (before, after) in fitted or len(fitted) == FITS:
            return order
        fitted.add((before, after))
        travel, began = wishes.machine.travel, clock.elapsed
        order = tied(units, order, before, after, travel, seconds, wishes.seed)
        used[first] = used.get(first, 0.0) + clock.elapsed - began
        return order

    return fit


def locked_parts(program: Program, wishes: Wishes) -> frozenset[int]:
    """Selections whose order stays.

    Raises
    ------
    UsageError
        If the file has no such tool.
    """
    unknown = wishes.keep - set(program.used)
    if unknown:
        names = ", ".join(f"T{t}" for t in program.used)
        raise UsageError(f"{program.path} has no tool T{min(unknown)} to keep; it uses {names}")
    return frozenset(i for i, s in enumerate(program.selections) if s.tool in wishes.keep)


def rows_in_front(program: Program, wishes: Wishes) -> int:
    """How many rows the units take that stay in front; a rapid to nowhere is no unit."""
    units = np.flatnonzero(program.rows.kind != Kind.PASS)[: wishes.keep_first]
    return int(units[-1]) + 1 if len(units) else 0


def stops(program: Program, wishes: Wishes) -> Stops:
    """Start and park position on the file's grid."""
    start = None if wishes.start is None else on_grid(program, wishes.start)
    return start, None if wishes.park is None else on_grid(program, wishes.park)


def _parts(
    program: Program,
    rule: CostRule,
    wishes: Wishes,
    before: Costs,
    after: Costs,
    choice: Choice,
    solved: list[Solved],
    clock: Clock,
) -> tuple[Part, ...]:
    """What became of each selection that does any work."""
    locked, times, trail = locked_parts(program, wishes), program.times(), follow(program)
    seconds = BOUND_SHARE * (wishes.time_limit or LIMITS[wishes.effort])
    if clock.interrupted:
        clock, seconds = Clock(Stop()), 0.1
    front = rows_in_front(program, wishes)
    found = []
    for number, (a, b) in part_rows(program):
        mine = tuple(s for s in solved if a <= s.stretch.first < b)
        kept, unclear = number in locked or b <= front, number in program.unclear
        bound = path_bound(program, (a, b), mine, choice.shortest.parts[number])
        closed = bound is not None and all(s.answer.optimal for s in mine)
        if number in program.uncounted:
            bound = None
        elif bound is None:
            bound = loose_bound(
                program, trail, number, (wishes.machine.travel, rule), clock, seconds
            )
            closed = bound >= after.parts[number]
        found.append(
            Part(
                number=number,
                tool=program.selections[number].tool,
                holes=int(times[a:b].sum()),
                before=before.parts[number],
                after=after.parts[number],
                bound=bound,
                proof=_weakest(mine) if closed and not (kept or unclear) else Proof.NONE,
                solved=mine,
                locked=kept,
                unclear=unclear,
                proved=number in locked or (closed and not unclear),
                saves=choice.saves.get(number, 0),
            )
        )
    return tuple(found)


def _weakest(mine: tuple[Solved, ...]) -> Proof:
    """Certified if every stretch is."""
    certified = mine and all(s.answer.proof is Proof.CERTIFIED for s in mine)
    return Proof.CERTIFIED if certified else Proof.TRUSTED
