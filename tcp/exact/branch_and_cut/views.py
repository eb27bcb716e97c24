"""Views of an LP solution from near and from afar: its nodes shrunk to atoms.

A keyhole shows a dozen atoms.  Atoms of whole edges (x = 1) lose nothing, and
show little of a solution that is nearly whole in many places: x = 0.99 here
and 0.01 there.  Larger atoms, of edges nearly whole, show more of it, and a cut
found over any atoms holds for all tours.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from tcp.exact.branch_and_cut.cuts import adjacency_lists
from tcp.exact.branch_and_cut.proof import Floats
from tcp.exact.branch_and_cut.sights import Sight, between
from tcp.exact.branch_and_cut.support import Support, components, groups
from tcp.jit import allocating
from tcp.travel import Ints

Favour = Callable[[int], Floats]


@dataclass(frozen=True)
class View:
    """How nodes are made atoms: from near, where little fits a keyhole, or from afar.

    Nodes joined by edges with x above ``joined`` are one atom; ``ends_apart`` cuts
    one end off each such path.  Then, ``paired`` times, atoms with x above
    :data:`TIED` between them become one, each with at most one other.
    """

    joined: float
    ends_apart: bool = False
    paired: int = 0


ONE = 1.0 - 1e-6
"""Edges with x above this are whole."""

TIED = 0.9
"""x between two atoms that become one in a view from afar."""

VIEWS = (
    *(View(joined, apart) for joined in (ONE, 0.95, 0.8) for apart in (False, True)),
    *(View(ONE, apart, 3) for apart in (False, True)),
)
"""All are looked at: where a dozen atoms of whole edges show nothing, a dozen larger ones do."""


@dataclass(frozen=True, eq=False)
class Shrunk:
    """The support graph over atoms: which atom holds a node, and edges between atoms."""

    atom: Ints
    count: int
    ptr: Ints
    other: Ints
    weight: Floats

    @classmethod
    def of(cls, support: Support, view: View) -> Shrunk:
        """The support graph with each atom shrunk to a point."""
        atom = _atoms(support, view)
        p, q = atom[support.i], atom[support.j]
        between = p != q
        count = int(atom.max()) + 1
        ptr, other, edge = adjacency_lists(p[between], q[between], count)
        return cls(atom, count, ptr, other, support.x[between][edge])


def _atoms(support: Support, view: View) -> Ints:
    """For each node the atom that holds it."""
    joined = support.x > view.joined
    i, j = support.i[joined], support.j[joined]
    atom = components(support.size, i, j)
    if view.ends_apart:
        degree = np.bincount(np.concatenate((i, j)), minlength=support.size)
        ends = np.nonzero(degree == 1)[0]
        _, first = np.unique(atom[ends], return_index=True)
        atom[ends[first]] = atom.max() + 1 + np.arange(len(first))
    for _ in range(view.paired):
        first, second = _pairs(support, atom)
        atom = components(int(atom.max()) + 1, first, second)[atom]
    return atom


def _pairs(support: Support, atom: Ints) -> tuple[Ints, Ints]:
    """Disjoint pairs of atoms with x above TIED between them, the most tied first."""
    p, q = atom[support.i], atom[support.j]
    count, between = int(atom.max()) + 1, p != q
    keys = np.minimum(p, q)[between] * count + np.maximum(p, q)[between]
    keys, place = np.unique(keys, return_inverse=True)
    tie = np.bincount(place, support.x[between])
    tied = np.nonzero(tie > TIED)[0]
    taken: set[int] = set()
    pairs = []
    for key in keys[tied[np.argsort(-tie[tied], kind="stable")]].tolist():
        pair = divmod(key, count)
        if taken.isdisjoint(pair):
            taken.update(pair)
            pairs.append(pair)
    first, second = np.array(pairs, np.int64).reshape(-1, 2).T
    return first, second


def sights(support: Support, view: View, most: int, favour: Favour = np.ones) -> Iterator[Sight]:
    """Sights of up to ``most`` atoms, the rest of the graph included.

    Parameters
    ----------
    support : Support
        An LP solution, connected.
    view : View
        What is an atom.
    most : int
        Atoms of a keyhole, 4 to 16.
    favour : callable
        Makes a factor for each of so many atoms, by which it is preferred in growing;
        without it all are alike.
    """
    graph = Shrunk.of(support, view)
    members = groups(graph.atom)
    for chunk in _keyholes(graph, most, favour(graph.count)):
        x = between(graph.ptr, graph.other, graph.weight, chunk, np.arange(len(chunk)))
        yield Sight(x, [members[v] for v in chunk])


def _keyholes(graph: Shrunk, most: int, favour: Floats) -> Iterator[Ints]:
    """Different sets of atoms, one grown around every atom with fractional edges."""
    seen = set()
    for seed in range(graph.count):
        near = graph.weight[graph.ptr[seed] : graph.ptr[seed + 1]]
        if (np.abs(near - 1.0) < 1e-6).all():
            continue
        chunk = _grown(
            graph.ptr, graph.other, graph.weight, favour, seed, min(most, graph.count) - 1
        )
        key = np.sort(chunk).tobytes()
        if len(chunk) >= 3 and key not in seen:
            seen.add(key)
            yield chunk


@allocating
def _grown(ptr: Ints, other: Ints, weight: Floats, favour: Floats, seed: int, size: int) -> Ints:
    """Up to ``size`` atoms: always the one that most weight ties to those before it."""
    chunk = np.empty(size, np.int64)
    near = np.empty(len(other) + 1, np.int64)
    pull = np.zeros(len(other) + 1)
    near[0] = seed
    known, count = 1, 0
    while count < size:
        best = -1
        for k in range(known):
            if near[k] >= 0 and (best < 0 or pull[k] > pull[best] + 1e-9):
                best = k
        if best < 0:
            break
        v = near[best]
        near[best] = -1
        chunk[count] = v
        count += 1
        for e in range(ptr[v], ptr[v + 1]):
            u = other[e]
            inside = False
            for k in range(count):
                inside = inside or chunk[k] == u
            if inside:
                continue
            at = 0
            while at < known and near[at] != u:
                at += 1
            if at == known:
                near[at], pull[at] = u, 0.0
                known += 1
            pull[at] += weight[e] * favour[u]
    return chunk[:count]
