"""Instances of at most three nodes: there is one cyclic tour, so it is the answer.

Undirected models need four nodes: on fewer, a tour uses an edge twice or has
no choice.  Every exact solver asks here first.
"""

from __future__ import annotations

from tcp.instance import Instance
from tcp.result import Outcome

NODES = 3


def settle(instance: Instance) -> Outcome | None:
    """The proved outcome of an instance with up to three nodes, None for larger ones.

    All pairs of different nodes are used by the only tour there is, so forced
    edges hold by themselves and any forbidden one leaves no route.
    """
    form = instance.form
    if form.size > NODES:
        return None
    if form.forbidden:
        return Outcome(route=None, infeasible=True)
    route = instance.route(range(form.size))
    return Outcome(route=route, bound=instance.cost(route))
