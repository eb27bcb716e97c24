"""The support graph of an LP solution: its edges with x > 0 in adjacency form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcp.exact.branch_and_cut.cuts import adjacency_lists
from tcp.exact.branch_and_cut.proof import Floats
from tcp.jit import kernel, lean
from tcp.travel import Ints

EPSILON = 1e-7
"""Below this an LP value is zero."""


@dataclass(frozen=True, eq=False)
class Support:
    """Edges of positive value and the neighbours of every node.

    Parameters
    ----------
    size : int
        Number of nodes.
    i, j : int64 arrays
        The edges' ends.
    x : float array
        Their values.
    ptr, other, edge : int64 arrays
        Neighbours of node v are ``other[ptr[v]:ptr[v+1]]``, by ``edge``.
    """

    size: int
    i: Ints
    j: Ints
    x: Floats
    ptr: Ints
    other: Ints
    edge: Ints

    @classmethod
    def of(cls, size: int, i: Ints, j: Ints, x: Floats) -> Support:
        """The support graph of values ``x`` on pairs."""
        on = np.nonzero(x > EPSILON)[0]
        i, j, x = i[on], j[on], x[on]
        ptr, other, edge = adjacency_lists(i, j, size)
        return cls(size, i, j, x, ptr, other, edge)

    @property
    def weight(self) -> Floats:
        """Values along the adjacency lists."""
        return self.x[self.edge]


@kernel
def components(size: int, i: Ints, j: Ints) -> Ints:
    """A label 0, 1, ... for every node: its connected component."""
    root = np.arange(size)
    for k in range(len(i)):
        a, b = find(root, i[k]), find(root, j[k])
        if a != b:
            root[max(a, b)] = min(a, b)
    label = np.full(size, -1, np.int64)
    count = 0
    for v in range(size):
        r = find(root, v)
        if label[r] < 0:
            label[r] = count
            count += 1
        label[v] = label[r]
    return label


@lean
def find(root: Ints, v: int) -> int:
    """Representative in a union-find forest, halving paths on the way."""
    while root[v] != v:
        root[v] = root[root[v]]
        v = root[v]
    return v


def groups(label: Ints, least: int = 1) -> list[Ints]:
    """The nodes of every label, in the labels' order; only groups of at least ``least``."""
    order = np.argsort(label, kind="stable")
    ends = np.cumsum(np.bincount(label))
    starts = np.concatenate(([0], ends[:-1]))
    return [order[starts[k] : ends[k]] for k in np.nonzero(ends - starts >= least)[0]]
