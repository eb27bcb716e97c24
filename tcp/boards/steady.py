"""Solving a stretch so that the answer does not depend on the order in the file.

Solvers break ties, and searches begin, by the numbers of the nodes.  Here the
nodes are numbered by their places, whatever the file's order: a file that has
been optimised is the same problem again, and a solver that stops by counting
finds no other answer.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tcp.instance import Instance, Rules
from tcp.result import Result
from tcp.solve import solve
from tcp.travel import Ints
from tcp.workpiece import Workpiece


def by_place(instance: Instance) -> tuple[Instance, Ints]:
    """The instance with its holes sorted by x, y and the partner's x, y; the old numbers."""
    piece, pairs = instance.workpiece, instance.rules.together
    partner = np.arange(len(piece))
    for i, j in pairs:
        partner[i], partner[j] = j, i
    old = np.lexsort((piece.y[partner], piece.x[partner], piece.y, piece.x))
    new = np.argsort(old)

    def moved(hole: int | None) -> int | None:
        return None if hole is None else int(new[hole])

    together = sorted((int(min(new[i], new[j])), int(max(new[i], new[j]))) for i, j in pairs)
    ends = replace(instance.ends, start=moved(instance.ends.start), end=moved(instance.ends.end))
    names = tuple(str(k + 1) for k in range(len(piece)))
    sorted_piece = Workpiece(piece.name, names, piece.x[old], piece.y[old], piece.step)
    rules = Rules(together=tuple(together))
    return Instance(sorted_piece, instance.travel, ends, rules), old


def solve_by_place(instance: Instance, solver: str, **options: Any) -> Result:
    """:func:`tcp.solve.solve` on the instance of :func:`by_place`, routes renumbered."""
    renumbered, old = by_place(instance)
    new = np.argsort(old)
    if "start_route" in options:
        options["start_route"] = tuple(int(new[hole]) for hole in options["start_route"])
    found = solve(renumbered, solver, **options)
    if found.route is None:
        return found
    return replace(found, route=tuple(int(old[hole]) for hole in found.route))
