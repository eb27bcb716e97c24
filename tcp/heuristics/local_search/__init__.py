"""The route engine: Lin-Kernighan chains, iterated with local kicks, from 10 holes to a million.

O(n) memory, whole-number costs, every kind of ends: see :func:`improve`, which
the exact solvers and the board optimiser call as well.
"""

from tcp.heuristics.local_search.anneal import Join
from tcp.heuristics.local_search.linking import linked_tour, panel_of
from tcp.heuristics.local_search.run import improve, respects
from tcp.heuristics.local_search.warm import warm_up

__all__ = ["Join", "improve", "linked_tour", "panel_of", "respects", "warm_up"]
