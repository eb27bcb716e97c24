"""Violated combs: the best teeth of a handle by dynamic programming, the handle by local search.

Teeth are intervals T of a good tour.  A tooth must cross the handle H, hence
contain a *switch*: a position where the tour enters or leaves H.  Of all
intervals around a switch only the minimal ones matter (no other one inside it
is as light), and these lists do not depend on the handle.  Given H, a
programme over the lists of its switches, with the parity of the number of
teeth as state, finds the least sum of (x(delta(T)) - 3) over odd families of
disjoint teeth; the comb is violated if that sum + x(delta(H)) < 1.  All tooth
sizes compete, so blossoms (teeth of two nodes) are contained.  A short tabu
search then moves single nodes into and out of H.

Nodes are numbered by their tour positions throughout this file.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tcp.exact.branch_and_cut.cuts import Cut, adjacency_lists, smaller_side
from tcp.exact.branch_and_cut.proof import Floats
from tcp.exact.branch_and_cut.support import Support
from tcp.travel import Ints

VIOLATION = 0.02
"""A comb must be violated by this much to be worth a row."""

LONGEST = 40
"""Longest tooth, in nodes."""

LIGHT = 3.0
"""Only intervals with x(delta(T)) below this are teeth: others cannot help but by parity."""

ROW = 12
"""Most minimal intervals kept around one position."""

STEPS = 12
"""Most moves of the search for a better handle."""

PATIENCE = 4
"""Moves without progress after which that search ends."""

Flags = NDArray[np.bool_]


class Teeth(NamedTuple):
    """Minimal light intervals around every position.

    Row s lists ``number[s]`` intervals [first, last] with first < s <= last and
    their weights x(delta(T)) - 3, no one containing another as light.
    """

    number: Ints
    first: Ints
    last: Ints
    weight: Floats


class Graph(NamedTuple):
    """The support graph over tour positions, in adjacency form."""

    ptr: Ints
    other: Ints
    weight: Floats


class Room(NamedTuple):
    """Work space of the programme: candidates in the order of their ends, values, choices."""

    first: Ints
    last: Ints
    weight: Floats
    best: Floats
    chosen: Ints
    used: Ints


def new_room(size: int) -> Room:
    """Work space for handles of a graph of ``size`` nodes."""
    most = size * ROW + 1
    ints = np.zeros(most, np.int64)
    return Room(
        ints,
        ints.copy(),
        np.zeros(most),
        np.zeros((most + 1, 2)),
        np.zeros((most + 1, 2), np.int64),
        np.zeros(1, np.int64),
    )


def positions(tour: Ints) -> Ints:
    """The position of every node."""
    position = np.empty(len(tour), np.int64)
    position[tour] = np.arange(len(tour))
    return position


def by_position(support: Support, tour: Ints) -> Graph:
    """The support graph with nodes numbered along a tour."""
    position = positions(tour)
    ptr, other, edge = adjacency_lists(position[support.i], position[support.j], support.size)
    return Graph(ptr, other, support.x[edge])


def light_intervals(graph: Graph, light: float = LIGHT) -> tuple[Ints, Ints, Floats]:
    """First and last positions and x(delta) - 3 of the intervals with x(delta) < ``light``.

    They have at least two positions and at most :data:`LONGEST`; shorter ones come first.
    """
    ends, first, weight = _light(graph, min(LONGEST, len(graph.ptr) - 3), light)
    last = np.repeat(np.arange(len(ends) - 1), np.diff(ends))
    order = np.argsort(last - first, kind="stable")
    return first[order], last[order], weight[order]


def minimal_teeth(graph: Graph, light: float = LIGHT) -> Teeth:
    """The lists of minimal light intervals under an LP solution."""
    return Teeth(*_minimal(len(graph.ptr) - 1, *light_intervals(graph, light), ROW))


@njit(cache=True)
def _minimal(
    size: int, first: Ints, last: Ints, weight: Floats, row: int
) -> tuple[Ints, Ints, Ints, Floats]:
    count = np.zeros(size, np.int64)
    a, b = np.zeros((size, row), np.int64), np.zeros((size, row), np.int64)
    w = np.zeros((size, row))
    for t in range(len(first)):
        for s in range(first[t] + 1, last[t] + 1):
            known = count[s]
            if known == row:
                continue
            needed = True
            for k in range(known):
                if a[s, k] >= first[t] and b[s, k] <= last[t] and w[s, k] <= weight[t] + 1e-6:
                    needed = False
                    break
            if needed:
                a[s, known], b[s, known], w[s, known] = first[t], last[t], weight[t]
                count[s] = known + 1
    return count, a, b, w


@njit(cache=True)
def _light(graph: Graph, longest: int, light: float) -> tuple[Ints, Ints, Floats]:
    size = len(graph.ptr) - 1
    delta = np.zeros(size)
    start = np.empty(1024, np.int64)
    value = np.empty(1024)
    ends = np.zeros(size + 1, np.int64)
    filled = 0
    for b in range(size):
        low = max(0, b - longest + 1)
        for a in range(low, b + 1):
            delta[a] += 2.0
        for e in range(graph.ptr[b], graph.ptr[b + 1]):
            before = graph.other[e]
            if before < b:
                for a in range(low, before + 1):
                    delta[a] -= 2.0 * graph.weight[e]
        for a in range(b - 1, low - 1, -1):
            if delta[a] < light - 1e-9:
                if filled == len(start):
                    start = np.concatenate((start, np.empty_like(start)))
                    value = np.concatenate((value, np.empty_like(value)))
                start[filled], value[filled] = a, delta[a] - 3.0
                filled += 1
        ends[b + 1] = filled
    return ends, start[:filled], value[:filled]


@njit(cache=True)
def best_teeth(switches: Ints, teeth: Teeth, room: Room) -> float:
    """Least sum of weights of an odd family of disjoint intervals, each around a switch.

    Parameters
    ----------
    switches : int64 array
        Positions p of which exactly one of p - 1 and p is in the handle, ascending.
    teeth : Teeth
        The intervals around every position.
    room : Room
        Work space; :func:`traced` reads the choice from it.
    """
    first, last, weight, best, chosen = room.first, room.last, room.weight, room.best, room.chosen
    used = 0
    for s in switches:
        for k in range(teeth.number[s]):
            a, b, w = teeth.first[s, k], teeth.last[s, k], teeth.weight[s, k]
            at = used
            while at > 0 and last[at - 1] > b:
                first[at], last[at], weight[at] = first[at - 1], last[at - 1], weight[at - 1]
                at -= 1
            first[at], last[at], weight[at] = a, b, w
            used += 1
    best[0, 0], best[0, 1] = 0.0, np.inf
    for t in range(used):
        best[t + 1, 0], best[t + 1, 1] = best[t, 0], best[t, 1]
        chosen[t + 1, 0], chosen[t + 1, 1] = -1, -1
        before = t
        while before > 0 and last[before - 1] >= first[t]:
            before -= 1
        for parity in range(2):
            value = best[before, 1 - parity] + weight[t]
            if value < best[t + 1, parity] - 1e-9:
                best[t + 1, parity] = value
                chosen[t + 1, parity] = before
    room.used[0] = used
    return best[used, 1]


@njit(cache=True)
def traced(room: Room) -> Ints:
    """First and last positions of the teeth that :func:`best_teeth` chose, shape (t, 2)."""
    t, parity = room.used[0], 1
    picked = np.empty((t, 2), np.int64)
    found = 0
    while t > 0:
        before = room.chosen[t, parity]
        if before < 0:
            t -= 1
            continue
        picked[found, 0], picked[found, 1] = room.first[t - 1], room.last[t - 1]
        found += 1
        t = before
        parity = 1 - parity
    return picked[:found]


@njit(cache=True)
def _toggled(switches: Ints, count: int, v: int, size: int, out: Ints) -> int:
    """The switches after position v changes sides; returns their number."""
    filled = 0
    first = v if v > 0 else -1
    second = v + 1 if v + 1 < size else -1
    for k in range(count):
        s = switches[k]
        if first >= 0 and first < s:
            out[filled] = first
            filled += 1
            first = -1
        if first == s:
            first = -1
            continue
        if second >= 0 and second < s:
            out[filled] = second
            filled += 1
            second = -1
        if second == s:
            second = -1
            continue
        out[filled] = s
        filled += 1
    if first >= 0:
        out[filled] = first
        filled += 1
    if second >= 0:
        out[filled] = second
        filled += 1
    return filled


@njit(cache=True)
def _flip_gain(graph: Graph, inside: Flags, v: int) -> float:
    """Change of x(delta(H)) if position v changes sides."""
    held, total = 0.0, 0.0
    for e in range(graph.ptr[v], graph.ptr[v + 1]):
        total += graph.weight[e]
        if inside[graph.other[e]]:
            held += graph.weight[e]
    return 2.0 * held - total if inside[v] else total - 2.0 * held


@njit(cache=True)
def climb(graph: Graph, teeth: Teeth, inside: Flags, steps: int, room: Room) -> tuple[float, Flags]:
    """The most violated handle within a few single moves of ``inside``, and its violation."""
    size = len(inside)
    switches, trial = np.empty(size + 2, np.int64), np.empty(size + 2, np.int64)
    # typed: a literal 0 would compile what takes it a second time
    count: Any = np.int64(0)
    delta, members = 0.0, 0
    for p in range(size):
        members += inside[p]
        if p > 0 and inside[p] != inside[p - 1]:
            switches[count] = p
            count += 1
        if inside[p]:
            for e in range(graph.ptr[p], graph.ptr[p + 1]):
                if not inside[graph.other[e]]:
                    delta += graph.weight[e]
    record = 1.0 - delta - best_teeth(switches[:count], teeth, room)
    kept = inside.copy()
    tabu = np.full(size, -1, np.int64)
    since = 0
    for step in range(steps):
        value = -np.inf
        move: Any = np.int64(-1)
        for p in range(size):
            if not inside[p]:
                continue
            for e in range(graph.ptr[p] - 1, graph.ptr[p + 1]):
                v = p if e < graph.ptr[p] else graph.other[e]
                if (v != p and inside[v]) or tabu[v] >= step:
                    continue
                tabu[v] = step  # each candidate once a step
                change = _flip_gain(graph, inside, v)
                if v == p and change >= 2.0 - 1e-9:
                    continue  # no neighbour outside
                number = members + (1 if v != p else -1)
                if number < 3 or 2 * number > size:
                    continue
                used = _toggled(switches, count, v, size, trial)
                if 1.0 - delta - change + used <= value + 1e-9:
                    continue
                inside[v] = not inside[v]
                found = 1.0 - delta - change - best_teeth(trial[:used], teeth, room)
                inside[v] = not inside[v]
                if found > value + 1e-9:
                    value, move = found, v
        if move < 0:
            break
        delta += _flip_gain(graph, inside, move)
        count = _toggled(switches, count, move, size, trial)
        switches, trial = trial, switches
        inside[move] = not inside[move]
        members += 1 if inside[move] else -1
        tabu[move] = step + PATIENCE + 1
        since += 1
        if value > record + 1e-6:
            record, since = value, 0
            for p in range(size):  # a slice assignment would compile for seconds
                kept[p] = inside[p]
        if since >= PATIENCE:
            break
    return record, kept


def comb_cuts(
    support: Support, tour: Ints, handles: Iterable[Ints], steps: int = STEPS
) -> list[tuple[float, Cut]]:
    """The most violated comb near every handle, with its violation, most violated first."""
    graph = by_position(support, tour)
    teeth, size = minimal_teeth(graph), support.size
    room = new_room(size)
    position = positions(tour)
    found: dict[bytes, tuple[float, Cut]] = {}
    for nodes in handles:
        inside = np.zeros(size, np.bool_)
        inside[position[nodes]] = True
        value, best = climb(graph, teeth, inside, steps, room)
        if value < VIOLATION:
            continue
        switches = np.nonzero(best[1:] != best[:-1])[0] + 1
        best_teeth(switches, teeth, room)
        picked = traced(room)
        if len(picked) < 3:
            continue
        sets = [tour[a : b + 1] for a, b in picked]
        cut = Cut.of([smaller_side(tour[best], size), *sets])
        found[cut.key] = (value, cut)
    return sorted(found.values(), key=lambda item: -item[0])
