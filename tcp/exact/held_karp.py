"""Held and Karp's dynamic programme: exact for two dozen holes, whatever the ends and rules.

M. Held, R. M. Karp: A dynamic programming approach to sequencing problems
(1962).  With a root node taken out, T[S, j] is the cheapest path from the root
through all of S that ends at j in S:

    T[S, j] = min over i in S - j of  T[S - j, i] + c(i, j).

The root is the virtual node of an open route.  A forced edge (j, p) restricts
the moves: a path that stands at j and has not visited p must go to p next,
because j has no other neighbour left.  Whoever has two such partners left has
come the wrong way.  Forbidden edges cost infinitely much.  Integers only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcp.exact.tiny import settle
from tcp.heuristics.start import start_tour
from tcp.instance import Instance, TourForm
from tcp.jit import lean
from tcp.result import Outcome, Progress, Report
from tcp.stop import Clock
from tcp.travel import Ints

Table = NDArray[np.signedinteger]

MEMORY = 13 * 2**28
"""Bytes the table may take (3.25 GiB): 24 nodes besides the root in 64 bits, 25 in 32."""

SLICE = 2**15
"""Subsets computed between two looks at the clock."""


def refusal(instance: Instance) -> str | None:
    """Why the table would not fit into memory, or None if it does."""
    form, others = instance.form, instance.form.size - 1
    if others < 32 and (others << others) * np.dtype(_integers(form)).itemsize <= MEMORY:
        return None
    return (
        f"its table doubles with every hole and {len(instance)} are too many for "
        f"{MEMORY / 2**30:g} GiB; 20 holes always fit"
    )


def run(instance: Instance, *, rng: np.random.Generator, clock: Clock, report: Report) -> Outcome:
    """Fill the table and read the optimum off it; see :func:`tcp.solve.solve`.

    Deterministic.  Stopped early, it returns a heuristic route and the bound 0.
    """
    settled = settle(instance)
    if settled is not None:
        return settled
    form = instance.form
    early = start_tour(form)
    route = None if early is None else instance.route(early)
    report(Progress(clock.elapsed, None if route is None else instance.cost(route), 0))
    programme = _Programme(form)
    for low in range(0, programme.subsets, SLICE):
        stopped = clock.reason(None if route is None else instance.cost(route), 0)
        if stopped is not None:
            return Outcome(route=route, bound=0, stopped=stopped, details=programme.details)
        programme.fill(low, min(low + SLICE, programme.subsets))
    tour = programme.tour()
    if tour is None:
        return Outcome(route=None, infeasible=True, details=programme.details)
    return Outcome(
        route=instance.route(tour), bound=form.tour_cost(tour), details=programme.details
    )


def _integers(form: TourForm) -> type[np.signedinteger]:
    """32-bit integers where no path can reach their infinity, else 64-bit ones."""
    longest = int(form.full_matrix().max()) * form.size
    return np.int32 if longest < _infinity(np.int32) else np.int64


def _infinity(integers: type[np.signedinteger]) -> int:
    """Half the largest integer: the sum of two does not overflow."""
    return int(np.iinfo(integers).max) // 2


class _Programme:
    """The table over all subsets of the nodes besides the root."""

    def __init__(self, form: TourForm):
        integers = _integers(form)
        self.root = form.virtual if form.virtual >= 0 else max(form.home, 0)
        self.nodes = np.array([v for v in range(form.size) if v != self.root])
        self.subsets = 1 << len(self.nodes)
        costs = form.full_matrix()
        self.infinity = _infinity(integers)
        for i, j in form.forbidden:
            costs[i, j] = costs[j, i] = self.infinity
        self.costs = costs[np.ix_(self.nodes, self.nodes)].astype(integers)
        self.to_root = costs[self.root, self.nodes].astype(integers)
        self.table: Table = np.empty((self.subsets, len(self.nodes)), dtype=integers)
        self._force(form)

    def _force(self, form: TourForm) -> None:
        """Forced partners of each node as bit sets, and which nodes may come first and last."""
        position = {int(v): k for k, v in enumerate(self.nodes)}
        self.partners = np.zeros(len(self.nodes), dtype=np.int64)
        at_root = []
        for i, j in form.forced:
            if self.root in (i, j):
                at_root.append(position[j if i == self.root else i])
                continue
            self.partners[position[i]] |= 1 << position[j]
            self.partners[position[j]] |= 1 << position[i]
        # A tour has two directions: with one forced neighbour the root may leave towards it.
        everyone = list(range(len(self.nodes)))
        self.first = at_root[:1] or everyone
        self.last = at_root[1:2] or everyone
        if len(at_root) > 2:
            self.first = []

    @property
    def details(self) -> dict[str, object]:
        """Size of the table, for the curious."""
        return {"table_bytes": self.table.nbytes, "subsets": self.subsets}

    def fill(self, low: int, high: int) -> None:
        """Compute the rows of the subsets ``low <= S < high``."""
        infinity = self.table.dtype.type(self.infinity)
        begin = np.full(len(self.nodes), infinity)
        begin[self.first] = self.to_root[self.first]
        _fill(self.table, self.costs, begin, self.partners, infinity, low, high)

    def tour(self) -> list[int] | None:
        """The cheapest tour, read back from the full set; None if there is none."""
        subset = self.subsets - 1
        total = self.table[subset].astype(np.int64) + self.to_root
        j = min(self.last, key=lambda k: int(total[k]))
        if total[j] >= self.infinity:
            return None
        path = [j]
        while subset != 1 << j:
            i = self._before(subset, j)
            subset ^= 1 << j
            path.append(i)
            j = i
        return [self.root, *(int(self.nodes[k]) for k in path)]

    def _before(self, subset: int, j: int) -> int:
        """The node before ``j`` on the cheapest path through ``subset``."""
        rest, bit = subset ^ (1 << j), 1 << j
        for i in range(len(self.nodes)):
            owed = int(self.partners[i]) & ~rest
            if rest >> i & 1 and owed in (0, bit):
                value = int(self.table[rest, i]) + int(self.costs[i, j])
                if value == self.table[subset, j]:
                    return i
        raise AssertionError("the table does not explain itself")


@lean
def _fill(
    table: Table, costs: Table, begin: Table, partners: Ints, infinity: int, low: int, high: int
) -> None:
    m = len(costs)
    free = not partners.any()
    for subset in range(low, high):
        for j in range(m):
            bit = 1 << j
            table[subset, j] = infinity
            if not subset & bit:
                continue
            rest = subset ^ bit
            if rest == 0:
                table[subset, j] = begin[j]
                continue
            best = infinity
            if free:  # entries outside ``rest`` are infinite, so no test is needed
                for i in range(m):
                    best = min(best, table[rest, i] + costs[j, i])
            else:
                for i in range(m):
                    owed = partners[i] & ~rest
                    if owed == 0 or owed == bit:
                        best = min(best, table[rest, i] + costs[j, i])
            table[subset, j] = best
