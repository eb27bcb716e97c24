"""The versions a board goes through: as read, merged or expanded, re-ordered, tools moved.

Each version is written, read back and compared before the next one is made.
"""

from __future__ import annotations

from collections.abc import Callable

from tcp.boards.chain import ToolOrder
from tcp.boards.choose import Choice, Solved, permuted
from tcp.boards.trail import Costs
from tcp.errors import UsageError
from tcp.files.drilling import compare, reordered, reparse
from tcp.files.excellon import Program
from tcp.files.excellon.edit import expand, merge_selections, move_sections
from tcp.files.excellon.rewrite import Order
from tcp.files.excellon.settings import Hints
from tcp.files.gcode import GProgram


def prepared(
    program: Program, merge: bool, spread: bool, tool_order: ToolOrder, hints: Hints | None
) -> tuple[Program, tuple[str, ...]]:
    """The board as it is to be solved, and notes: expanded and merged where that is asked for."""
    notes: tuple[str, ...] = ()
    moved = tool_order is not ToolOrder.KEEP
    if isinstance(program, GProgram) and (merge or spread or moved):
        raise UsageError(
            f"{program.path}: in G-code only holes of one tool change places; drop --expand, "
            f"--merge-tool-selections and --tool-order"
        )
    if spread:
        data, notes = expand(program)
        expanded = reparse(data, program, hints)
        compare(program, expanded, text="free")
        program = expanded
    if merge:
        merged = reparse(merge_selections(program), program, hints)
        compare(program, merged, text="free")
        program = merged
    return program, notes


def inside_out(
    program: Program,
    solved: list[Solved],
    travel: Callable[[Program], Costs],
    hints: Hints | None,
) -> Program:
    """The board with the insides of its step-and-repeat blocks in a new order.

    A shorter way through a block may make the way from one copy to the next
    longer, or that from the start or to the park position, so each new order,
    and its reverse, counts by the ``travel`` of the whole board.
    """
    orders: dict[int, Order] = {}
    least = travel(program).total
    for one in solved:
        ways = [one.order]
        if not one.stretch.directed().any():
            ways.append(one.stretch.backwards(one.order))
        for way in ways:
            total = travel(permuted(program, orders | {one.stretch.first: way})).total
            if total < least:
                least, orders[one.stretch.first] = total, way
    if not orders:
        return program
    after = reparse(reordered(program, orders), program, hints)
    compare(program, after)
    return after


def rewritten(program: Program, view: Program, choice: Choice, hints: Hints | None) -> Program:
    """The board with its stretches, and its tools, in the chosen order.

    ``view`` is the program with its blocks folded: what the choice is about.
    """
    after = program
    if choice.orders:
        after = reparse(reordered(view, choice.orders), program, hints)
        compare(program, after)
    busy = choice.sequence
    if busy != tuple(sorted(busy)):
        places = iter(busy)
        idle = set(range(len(program.selections))) - set(busy)
        order = [n if n in idle else next(places) for n in range(len(program.selections))]
        after = reparse(move_sections(after, order), program, hints)
        compare(program, after, text="moved")
    return after


def by_tool(costs: Costs, program: Program, merged: Program) -> Costs:
    """Costs of a program, those of a tool's selections together where it is selected first."""
    sums: dict[int, int] = {}
    for selection, cost in zip(program.selections, costs.parts, strict=True):
        sums[selection.tool] = sums.get(selection.tool, 0) + cost
    return Costs(tuple(sums.pop(s.tool, 0) for s in merged.selections), costs.links)


def by_old_number(costs: Costs, choice: Choice) -> Costs:
    """Costs of the rewritten board, its selections counted as before the change."""
    parts = list(costs.parts)
    for old, new in zip(choice.sequence, sorted(choice.sequence), strict=True):
        parts[old] = costs.parts[new]
    return Costs(tuple(parts), costs.links)
