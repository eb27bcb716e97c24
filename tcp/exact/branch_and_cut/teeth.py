"""The best teeth of a comb's handle, by dynamic programming over light intervals of a tour.

Teeth are intervals T of a good tour.  A tooth must cross the handle H, hence
contain a *switch*: a position where the tour enters or leaves H.  Of all
intervals around a switch only the minimal ones matter (no other one inside it
is as light), and these lists do not depend on the handle.  Given H, a
programme over the lists of its switches, with the parity of the number of
teeth as state, finds the least sum of (x(delta(T)) - 3) over odd families of
disjoint teeth; the comb is violated if that sum + x(delta(H)) < 1.  All tooth
sizes compete, so blossoms (teeth of two nodes) are contained.

Nodes are numbered by their tour positions throughout this file.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcp.exact.branch_and_cut.cuts import adjacency_lists
from tcp.exact.branch_and_cut.proof import Floats
from tcp.exact.branch_and_cut.support import Support
from tcp.jit import kernel, lean
from tcp.travel import Ints

LONGEST = 40
"""Longest tooth, in nodes."""

LIGHT = 3.0
"""Only intervals with x(delta(T)) below this are teeth: others cannot help but by parity."""

ROW = 12
"""Most minimal intervals kept around one position."""


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


@kernel
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


@kernel
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


@lean
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


@kernel
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
