"""The versions a board goes through: as read, merged or expanded, re-ordered, tools moved.

Each version is written, read back and compared before the next one is made.
"""

from __future__ import annotations

from tcp.boards.choose import Choice
from tcp.boards.trail import Costs
from tcp.errors import UsageError
from tcp.files.drilling import compare, reordered, reparse
from tcp.files.excellon import Program
from tcp.files.excellon.edit import expand, merge_selections, move_sections
from tcp.files.excellon.settings import Hints
from tcp.files.gcode import GProgram


def prepared(
    program: Program, merge: bool, spread: bool, hints: Hints | None
) -> tuple[Program, tuple[str, ...]]:
    """The board as it is to be solved, and notes: expanded and merged where that is asked for."""
    notes: tuple[str, ...] = ()
    if isinstance(program, GProgram) and (merge or spread):
        raise UsageError(f"{program.path}: G-code is only re-ordered; drop --expand and --merge")
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


def rewritten(program: Program, choice: Choice, hints: Hints | None) -> Program:
    """The board with its stretches, and its tools, in the chosen order."""
    after = program
    if choice.orders:
        after = reparse(reordered(program, choice.orders), program, hints)
        compare(program, after)
    busy = choice.sequence
    if isinstance(program, GProgram) and busy != tuple(sorted(busy)):
        raise UsageError(f"{program.path}: the tools of G-code stay in order; drop --tool-order")
    if busy != tuple(sorted(busy)):
        places = iter(busy)
        idle = set(range(len(program.selections))) - set(busy)
        order = [n if n in idle else next(places) for n in range(len(program.selections))]
        after = reparse(move_sections(after, order), program, hints)
        compare(program, after, text="moved")
    return after


def by_old_number(costs: Costs, choice: Choice) -> Costs:
    """Costs of the rewritten board, its selections counted as before the change."""
    parts = list(costs.parts)
    for old, new in zip(choice.sequence, sorted(choice.sequence), strict=True):
        parts[old] = costs.parts[new]
    return Costs(tuple(parts), costs.links)
