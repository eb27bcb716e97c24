"""What a tool's path takes at least, given what stays in place."""

from __future__ import annotations

import numpy as np

from tcp.boards.choose import Solved
from tcp.boards.trail import Trail
from tcp.bounds.one_tree import one_tree_bound
from tcp.files.excellon import Program
from tcp.instance import Instance
from tcp.solve import sharpen
from tcp.stop import Clock, Stop
from tcp.travel import CostRule, Travel
from tcp.workpiece import Workpiece


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
    program: Program, trail: Trail, number: int, travel: Travel, rule: CostRule, seconds: float
) -> int:
    """A bound on any path through all places of a selection, whatever must stay where.

    Parameters
    ----------
    program, trail : Program, Trail
        The board, and every position of its machine.
    number : int
        The selection.
    travel, rule : Travel, CostRule
        The travel model, and the board's costs.
    seconds : float
        Time for Held and Karp's ascent.
    """
    places = np.unique(np.stack([trail.x, trail.y])[:, trail.part == number], axis=1)
    if places.shape[1] < 3:
        return 0
    names = tuple(map(str, range(places.shape[1])))
    x, y = (np.ascontiguousarray(axis) for axis in places)
    instance = Instance(Workpiece("places", names, x, y, program.step), travel)
    found = one_tree_bound(instance, clock=Clock(Stop(seconds))).value
    worth = (sharpen(instance, found) or 0) * instance.quantum
    return int(worth / rule.quantum)
