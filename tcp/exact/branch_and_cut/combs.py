"""Violated combs: a short search for the handle, each with its best teeth (``teeth.py``).

The search moves single nodes into and out of the handle, the best move first,
and does not take back what it did a few moves ago (tabu search).  It costs
what the handle's own nodes cost, whatever the size of the board, and handles
do not know of each other: two threads share them.

Nodes are numbered by their tour positions in compiled code.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcp.exact.branch_and_cut.cuts import Cut, smaller_side
from tcp.exact.branch_and_cut.proof import Floats
from tcp.exact.branch_and_cut.support import Support
from tcp.exact.branch_and_cut.teeth import (
    Graph,
    Room,
    Teeth,
    best_teeth,
    by_position,
    minimal_teeth,
    new_room,
    positions,
    traced,
)
from tcp.jit import cached, lean
from tcp.travel import Ints

MOST = 80
"""Most combs that enter the LP at once."""

VIOLATION = 0.02
"""A comb must be violated by this much to be worth a row."""

STEPS = 12
"""Most moves of the search for a better handle."""

MOVING = 100
"""Largest handle that is moved: larger ones take most of the time and yield hardly anything."""

FEW = 50
"""Fewer handles are not worth a second thread."""

PATIENCE = 4
"""Moves without progress after which that search ends."""

Flags = NDArray[np.bool_]


class Found(NamedTuple):
    """The best combs of some handles, in their order, as flat arrays.

    Handle k is ``handles[handle_ptr[k]:handle_ptr[k + 1]]``; its teeth, first
    and last positions, are the rows ``tooth_ptr[k]`` to ``tooth_ptr[k + 1]`` of
    ``teeth`` (none where the comb is not violated enough).
    """

    violation: Floats
    handle_ptr: Ints
    handles: Ints
    tooth_ptr: Ints
    teeth: Ints


class Handle(NamedTuple):
    """Work space: the handle that is being changed.

    ``inside`` tells which positions it holds, ``members`` lists them, in any
    order.  ``now``, ``trial`` and ``best`` are ascending lists of switches.
    A position may move again when ``tabu`` has fallen behind the step.
    """

    inside: Flags
    members: Ints
    moves: Ints
    now: Ints
    trial: Ints
    best: Ints
    tabu: Ints


def new_handle(size: int, steps: int) -> Handle:
    """Work space for handles of ``size`` nodes."""
    room = size + steps + 2
    return Handle(
        inside=np.zeros(size, np.bool_),
        members=np.zeros(room, np.int64),
        moves=np.zeros(steps, np.int64),
        now=np.zeros(room, np.int64),
        trial=np.zeros(room, np.int64),
        best=np.zeros(room, np.int64),
        tabu=np.full(size, -1, np.int64),
    )


def comb_cuts(
    support: Support,
    tour: Ints,
    handles: Sequence[Ints],
    pool: Executor,
    most: int = MOST,
    steps: int = STEPS,
) -> list[tuple[float, Cut]]:
    """The most violated comb near every handle, with its violation, most violated first.

    Parameters
    ----------
    support : Support
        An LP solution.
    tour : int64 array
        All nodes in cyclic order; teeth are intervals of it.
    handles : sequence of int64 arrays
        The nodes of each handle, at least three and at most half of all.
    pool : Executor
        Its threads share the handles; the answer does not depend on it.
    most : int
        Most combs returned.
    steps : int
        Most moves of a handle's search.
    """
    if not handles:
        return []
    graph = by_position(support, tour)
    teeth, position = minimal_teeth(graph), positions(tour)

    def search(part: Sequence[Ints]) -> Found:
        ptr = np.cumsum([0] + [len(nodes) for nodes in part])
        nodes = _sorted(position, ptr, part)
        room, handle = new_room(support.size), new_handle(support.size, steps)
        return Found(*_search(graph, teeth, ptr, nodes, steps, room, handle))

    half = (len(handles) + 1) // 2
    few = len(handles) < FEW
    results = [search(handles)] if few else pool.map(search, (handles[:half], handles[half:]))
    combs = [
        (found.violation[k], found, k)
        for found in results
        for k in np.nonzero(np.diff(found.tooth_ptr) >= 3)[0].tolist()
    ]
    cuts: dict[bytes, tuple[float, Cut]] = {}
    for violation, found, k in sorted(combs, key=lambda comb: -comb[0]):
        cut = _cut(found, k, tour)
        cuts.setdefault(cut.key, (violation, cut))
        if len(cuts) == most:
            break
    return list(cuts.values())


def _sorted(position: Ints, ptr: Ints, handles: Sequence[Ints]) -> Ints:
    """The positions of all handles' nodes, ascending within each."""
    owner = np.repeat(np.arange(len(handles)), np.diff(ptr))
    keys = owner * len(position) + position[np.concatenate(handles)]
    keys.sort()
    return keys - owner * len(position)


def _cut(found: Found, k: int, tour: Ints) -> Cut:
    """The comb of one handle."""
    rows = found.teeth[found.tooth_ptr[k] : found.tooth_ptr[k + 1]].tolist()
    handle = tour[found.handles[found.handle_ptr[k] : found.handle_ptr[k + 1]]]
    return Cut.of([smaller_side(handle, len(tour)), *(tour[a : b + 1] for a, b in rows)])


@cached(nogil=True)
def _search(
    graph: Graph,
    teeth: Teeth,
    ptr: Ints,
    nodes: Ints,
    steps: int,
    room: Room,
    handle: Handle,
) -> tuple[Floats, Ints, Ints, Ints, Ints]:
    """Climb from every handle; see :class:`Found`."""
    count = len(ptr) - 1
    violation = np.zeros(count)
    handle_ptr, tooth_ptr = np.zeros(count + 1, np.int64), np.zeros(count + 1, np.int64)
    handles = np.empty(len(nodes) + steps * count, np.int64)
    chosen = np.empty((2 * len(handles) + count, 2), np.int64)
    filled, rows = 0, 0
    stride = steps + PATIENCE + 2  # steps count on from handle to handle: ``tabu`` stays behind
    for k in range(count):
        held = ptr[k + 1] - ptr[k]
        for m in range(held):
            handle.members[m] = nodes[ptr[k] + m]
            handle.inside[nodes[ptr[k] + m]] = True
        most = steps if held <= MOVING else 0
        value, switches, moved, kept = climb(graph, teeth, handle, held, most, k * stride, room)
        violation[k] = value
        if value >= VIOLATION:
            best_teeth(handle.best[:switches], teeth, room)
            picked = traced(room)
            for t in range(len(picked)):
                chosen[rows, 0], chosen[rows, 1] = picked[t, 0], picked[t, 1]
                rows += 1
        for m in range(moved - 1, kept - 1, -1):  # back to the best
            handle.inside[handle.moves[m]] = not handle.inside[handle.moves[m]]
        for m in range(held + moved):  # read it, and leave no trace
            v = nodes[ptr[k] + m] if m < held else handle.moves[m - held]
            if handle.inside[v]:
                handle.inside[v] = False
                handles[filled] = v
                filled += 1
        handle_ptr[k + 1], tooth_ptr[k + 1] = filled, rows
    return violation, handle_ptr, handles[:filled], tooth_ptr, chosen[:rows]


@lean
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


@lean
def _flip_gain(graph: Graph, inside: Flags, v: int) -> float:
    """Change of x(delta(H)) if position v changes sides."""
    held, total = 0.0, 0.0
    for e in range(graph.ptr[v], graph.ptr[v + 1]):
        total += graph.weight[e]
        if inside[graph.other[e]]:
            held += graph.weight[e]
    return 2.0 * held - total if inside[v] else total - 2.0 * held


@lean
def _begin(graph: Graph, handle: Handle, held: int) -> tuple[float, int]:
    """x(delta(H)) of the handle as it stands, and the number of its switches, listed in ``now``."""
    delta, count = 0.0, np.int64(0)
    for m in range(held):
        p = handle.members[m]
        if p > 0 and not handle.inside[p - 1]:
            handle.now[count] = p
            count += 1
        if p + 1 < len(handle.inside) and not handle.inside[p + 1]:
            handle.now[count] = p + 1
            count += 1
        for e in range(graph.ptr[p], graph.ptr[p + 1]):
            if not handle.inside[graph.other[e]]:
                delta += graph.weight[e]
    return delta, count


@lean
def _best_move(
    graph: Graph,
    teeth: Teeth,
    handle: Handle,
    held: int,
    count: int,
    slack: float,
    step: int,
    room: Room,
) -> tuple[float, int]:
    """The single move that leaves the most violated comb: its violation, and which (-1: none)."""
    inside, tabu, size = handle.inside, handle.tabu, len(handle.inside)
    value = -np.inf
    move: Any = np.int64(-1)
    for m in range(held):
        p = handle.members[m]
        for e in range(graph.ptr[p] - 1, graph.ptr[p + 1]):
            v = p if e < graph.ptr[p] else graph.other[e]
            if (v != p and inside[v]) or tabu[v] >= step:
                continue
            tabu[v] = step  # each candidate once a step
            change = _flip_gain(graph, inside, v)
            if v == p and change >= 2.0 - 1e-9:
                continue  # no neighbour outside
            number = held + (1 if v != p else -1)
            if number < 3 or 2 * number > size:
                continue
            used = _toggled(handle.now, count, v, size, handle.trial)
            if slack - change + used <= value + 1e-9:
                continue
            inside[v] = not inside[v]
            found = slack - change - best_teeth(handle.trial[:used], teeth, room)
            inside[v] = not inside[v]
            if found > value + 1e-9:
                value, move = found, v
    return value, move


@lean
def climb(
    graph: Graph, teeth: Teeth, handle: Handle, held: int, steps: int, start: int, room: Room
) -> tuple[float, int, int, int]:
    """Move single nodes, the best first, and remember when the comb was most violated.

    Returns its violation, its number of switches (in ``best``), the number of
    moves made (in ``moves``), and how many of them lead to it.
    """
    size = len(handle.inside)
    delta, count = _begin(graph, handle, held)
    record = 1.0 - delta - best_teeth(handle.now[:count], teeth, room)
    kept, switches, moved = 0, count, 0
    for k in range(count):
        handle.best[k] = handle.now[k]
    while moved < steps and moved - kept < PATIENCE:
        step = start + moved
        value, move = _best_move(graph, teeth, handle, held, count, 1.0 - delta, step, room)
        if move < 0:
            break
        delta += _flip_gain(graph, handle.inside, move)
        count = _toggled(handle.now, count, move, size, handle.trial)
        for k in range(count):
            handle.now[k] = handle.trial[k]
        handle.inside[move] = not handle.inside[move]
        held = _listed(handle.members, held, move, handle.inside[move])
        handle.tabu[move] = step + PATIENCE + 1
        handle.moves[moved] = move
        moved += 1
        if value > record + 1e-6:
            record, kept, switches = value, moved, count
            for k in range(count):
                handle.best[k] = handle.now[k]
    return record, switches, moved, kept


@lean
def _listed(members: Ints, held: int, v: int, joins: bool) -> int:
    """Enter v in the list of members or strike it off; returns their number."""
    if joins:
        members[held] = v
        return held + 1
    for m in range(held):
        if members[m] == v:
            members[m] = members[held - 1]
            break
    return held - 1
