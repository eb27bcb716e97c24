"""What needs no search: instances of three nodes, and rules that contradict each other.

Undirected models need four nodes: on fewer, a tour uses an edge twice or has
no choice.  Every exact solver asks here first.
"""

from __future__ import annotations

from collections.abc import Iterable

from tcp.instance import Instance, TourForm
from tcp.result import Outcome

NODES = 3


def settle(instance: Instance) -> Outcome | None:
    """The proved outcome of an instance that needs no search, None for all others.

    On three nodes all pairs are used by the only tour there is, so forced
    edges hold by themselves and any forbidden one leaves no route.
    """
    form = instance.form
    contradiction = impossible(form)
    if contradiction is not None:
        return Outcome(route=None, infeasible=True, details={"because": contradiction})
    if form.size > NODES:
        return None
    route = instance.route(range(form.size))
    return Outcome(route=route, bound=instance.cost(route))


def impossible(form: TourForm) -> str | None:
    """Why the forced and forbidden edges alone leave no tour, or None if they may leave one."""
    if form.size <= NODES:
        return "a forbidden pair cannot be avoided" if form.forbidden else None
    if set(form.forced) & set(form.forbidden):
        return "a pair is both forced and forbidden"
    if any(d > 2 for d in _degrees(form.forced).values()):
        return "a node is forced to have more than two neighbours"
    if any(d > form.size - 3 for d in _degrees(form.forbidden).values()):
        return "a node has fewer than two neighbours left"
    if _closes_early(form):
        return "forced pairs close a circle that leaves nodes out"
    return None


def _degrees(edges: Iterable[tuple[int, int]]) -> dict[int, int]:
    degrees: dict[int, int] = {}
    for edge in edges:
        for node in edge:
            degrees[node] = degrees.get(node, 0) + 1
    return degrees


def _closes_early(form: TourForm) -> bool:
    """Whether forced edges, at most two a node, form a circle that is not a whole tour."""
    leader = list(range(form.size))

    def find(node: int) -> int:
        while leader[node] != node:
            leader[node] = leader[leader[node]]
            node = leader[node]
        return node

    for i, j in form.forced:
        a, b = find(i), find(j)
        if a == b:
            return len(form.forced) < form.size
        leader[a] = b
    return False
