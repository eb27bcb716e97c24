"""A route over a panel: paths over one board, linked from copy to copy by dynamic programming.

Every copy can be drilled along the same path.  What differs is where a copy is
entered and left, for that decides how far it is to the next one.  So the board
is solved for a few pairs of ends: any ends, *gates* (a hole at the border and
the hole across that is nearest to it) for a copy that is passed through, and a
gate of one border with one of another for a copy at which the way turns.  For
a serpentine over the copies, the cheapest choice of paths and directions is
then found exactly, copy by copy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np

from tcp.heuristics.panels import Panel, find_panel
from tcp.instance import TourForm
from tcp.nearness import norm
from tcp.stop import Clock, Stop
from tcp.travel import Ints

SHARE = 0.35
"""Share of the effort for the board; the rest polishes the whole panel."""

GATES = 2
"""Pairs of gates between neighbouring copies that are tried."""

ENOUGH = 100
"""Kicks per node of the board after which it is good enough."""

Improve = Callable[[TourForm, list[int] | None, Clock, int | None], list[int]]
"""Searches a form: from a tour or from nothing, under a clock, with so many kicks (None: all)."""


@dataclass(frozen=True)
class Path:
    """A way over the board: its holes in order, and its length in quanta."""

    holes: Ints
    cost: int


def panel_of(form: TourForm) -> Panel | None:
    """The panel that a form's holes are, if rules between them do not stand in the way."""
    holes = form.holes
    bound = any(i < holes and j < holes for i, j in form.forced)
    if form.matrix is not None or form.forbidden or bound or form.virtual < 0:
        return None
    return find_panel(form.x[:holes], form.y[:holes])


def linked_tour(
    form: TourForm, panel: Panel, improve: Improve, clock: Clock, kicks: int | None
) -> list[int]:
    """The best serpentine over a panel's copies, as a tour of ``form``.

    Parameters
    ----------
    form : TourForm
        The whole panel; open, without rules between holes (:func:`panel_of`).
    panel : Panel
        What was found in it.
    improve : callable
        The search.
    clock : Clock
        :data:`SHARE` of its time goes into the board.
    kicks : int or None
        Limit of the whole search; the same share goes into the board.

    Returns
    -------
    list of int
        All nodes of ``form``, once each.
    """
    paths = board_paths(form, panel, improve, clock, kicks)
    options = [*paths, *(Path(p.holes[::-1], p.cost) for p in paths)]
    return min((_tour(form, panel, options, w) for w in ways(panel)), key=form.tour_cost)


def board_paths(
    form: TourForm, panel: Panel, improve: Improve, clock: Clock, kicks: int | None
) -> list[Path]:
    """Short paths over the board: with any ends, from gate to gate, from gate to corner gate."""
    board = board_form(form, panel.holes[0, 0])
    n = board.holes
    across, up = ([], [])
    if panel.step[0]:
        across = gates(board, (panel.step[0], 0))
    if panel.step[1]:
        up = gates(board, (0, panel.step[1]))
    pairs = [(a, b) for b, a in (*across, *up)]
    pairs += [(p, q) for one in across[:1] for other in up[:1] for p in one for q in other]
    pairs = [(a, b) for a, b in dict.fromkeys(pairs) if a != b]
    effort = [0.5, *(0.5 / max(1, len(pairs)) for _ in pairs)]
    paths: list[Path] = []
    for part, ends in zip(effort, [None, *pairs], strict=True):
        if paths and clock.over:  # even to survey a large board takes its time
            break
        wanted = board if ends is None else replace(board, forced=tuple((e, n) for e in ends))
        share = SHARE * part
        time = clock.stop.time
        portion = clock.part(Stop(None if time is None else share * time))
        most = ENOUGH * board.size if kicks is None else int(share * kicks / panel.copies)
        start = [*paths[0].holes.tolist(), n] if paths else None
        tour = improve(wanted, start, portion, most)
        at = tour.index(n)
        holes = np.array(tour[at + 1 :] + tour[:at], np.int64)
        paths.append(Path(holes, wanted.tour_cost(tour)))
    return paths


def board_form(form: TourForm, holes: Ints) -> TourForm:
    """One copy alone, as an open path with any ends."""
    n = holes.size
    x, y = form.x[holes].copy(), form.y[holes].copy()
    return replace(form, x=x, y=y, holes=n, size=n + 1, home=-1, virtual=n, forced=(), forbidden=())


def gates(board: TourForm, step: tuple[int, int]) -> list[tuple[int, int]]:
    """The nearest pairs (hole of a copy, hole of the next copy), no hole twice on a side."""
    from scipy.spatial import cKDTree

    fx, fy, p = norm(board.rule)
    here = np.column_stack([board.x * fx, board.y * fy])
    there = here + np.array([step[0] * fx, step[1] * fy])
    distance, nearest = cKDTree(there).query(here, p=p)
    found: list[tuple[int, int]] = []
    for b in np.argsort(distance, kind="stable").tolist():
        a = int(nearest[b])
        if all(b != other and a != entry for other, entry in found):
            found.append((b, a))
        if len(found) == GATES:
            break
    return found


Way = list[tuple[int, int]]


def ways(panel: Panel) -> Iterator[Way]:
    """Serpentines over the copies' (column, row): by rows and by columns, from every corner."""
    columns, rows = panel.holes.shape[:2]
    seen = set()
    for by_rows, right, top in product((True, False), repeat=3):
        xs = range(columns)[:: -1 if right else 1]
        ys = range(rows)[:: -1 if top else 1]
        outer, inner = (ys, xs) if by_rows else (xs, ys)
        way = []
        for k, o in enumerate(outer):
            line = inner[:: -1 if k % 2 else 1]
            way += [(i, o) if by_rows else (o, i) for i in line]
        if tuple(way) not in seen:
            seen.add(tuple(way))
            yield way


def _tour(form: TourForm, panel: Panel, options: list[Path], way: Way) -> list[int]:
    """The whole tour along a way over the copies; home stands next to the virtual node."""
    chosen = choose(form, panel, options, way)
    holes = [panel.holes[c][options[k].holes] for c, k in zip(way, chosen, strict=True)]
    tour = [int(v) for v in np.concatenate(holes)]
    return [form.virtual, *([form.home] if form.home >= 0 else []), *tour]


def choose(form: TourForm, panel: Panel, options: list[Path], way: Way) -> list[int]:
    """For each copy along a way, which option to take: exact, by dynamic programming.

    ``cost[t]`` is the least cost of a path over the copies so far whose last
    copy takes option t.
    """
    cost = np.array([option.cost for option in options], np.int64)
    entry = np.array([option.holes[0] for option in options])
    leave = np.array([option.holes[-1] for option in options])
    links: dict[tuple[int, int], Ints] = {}
    total, back = cost, []
    for before, copy in pairwise(way):
        move = copy[0] - before[0], copy[1] - before[1]
        if move not in links:
            a, b = panel.holes[before][leave], panel.holes[copy][entry]
            links[move] = form.costs(a[:, None], b[None, :])
        via = total[:, None] + links[move]
        back.append(via.argmin(axis=0))
        total = via.min(axis=0) + cost
    chosen = [int(total.argmin())]
    for step in reversed(back):
        chosen.append(int(step[chosen[-1]]))
    return chosen[::-1]
