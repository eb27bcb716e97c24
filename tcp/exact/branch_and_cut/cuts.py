"""What a cut is, and families of cuts flattened for compiled code.

A cut says ``sum over its sets S of weight_S x(delta(S)) >= rhs``.  One set is a
subtour cut (rhs 2).  A comb has a handle and an odd number t >= 3 of disjoint
teeth, each with nodes inside and outside the handle (rhs 3 t + 1; Groetschel
and Padberg 1979 in the form of Applegate, Bixby, Chvatal and Cook 2006, ch. 5).
Any other family is a *local* cut, valid because its sets split the nodes into
so few parts that all tours of the parts can be examined (``local.py``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tcp.jit import kernel
from tcp.travel import Ints

Nodes = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Cut:
    """A valid inequality over sets of nodes.

    Parameters
    ----------
    nodes : int32 array
        The sets one after the other, each ascending; a comb's handle first.
    ends : int64 array
        Where each set ends in ``nodes``.
    weights : int64 array
        The sets' weights, all 1 but for local cuts.
    rhs : int
        The right-hand side.
    local : bool
        Whether it is neither a subtour cut nor a comb.
    """

    nodes: Nodes
    ends: Ints
    weights: Ints
    rhs: int
    local: bool = False
    key: bytes = field(default=b"", repr=False)

    @classmethod
    def of(cls, sets: Sequence[Sequence[int] | Ints]) -> Cut:
        """A cut from its sets: one, or a handle followed by its teeth."""
        parts = [np.sort(np.asarray(s, np.int32)) for s in sets]
        parts[1:] = sorted(parts[1:], key=lambda tooth: int(tooth[0]))
        teeth = len(parts) - 1
        weights = np.ones(len(parts), np.int64)
        return cls._made(parts, weights, 3 * teeth + 1 if teeth else 2, False)

    @classmethod
    def weighted(
        cls, sets: Sequence[Sequence[int] | Ints], weights: Sequence[int], rhs: int
    ) -> Cut:
        """A local cut from its sets, their weights (>= 1) and its right-hand side."""
        parts = [np.sort(np.asarray(s, np.int32)) for s in sets]
        order = sorted(range(len(parts)), key=lambda k: (len(parts[k]), parts[k].tolist()))
        chosen = np.array([weights[k] for k in order], np.int64)
        return cls._made([parts[k] for k in order], chosen, rhs, True)

    @classmethod
    def _made(cls, parts: list[Nodes], weights: Ints, rhs: int, local: bool) -> Cut:
        ends = np.array([len(p) for p in parts], np.int64).cumsum()
        nodes = np.concatenate(parts)
        key = nodes.tobytes() + b":" + ends.tobytes()
        if local:
            key += b":" + weights.tobytes() + rhs.to_bytes(8, "little")
        return cls(nodes, ends, weights, rhs, local, key)

    @property
    def comb(self) -> bool:
        """Whether it has a handle and teeth."""
        return not self.local and len(self.ends) > 1

    @property
    def handle(self) -> Nodes:
        """The first set."""
        return self.nodes[: self.ends[0]]

    @property
    def total(self) -> int:
        """The sum of all weights."""
        return int(self.weights.sum()) if self.local else len(self.ends)

    @property
    def sets(self) -> tuple[Nodes, ...]:
        """The sets, a comb's handle first."""
        ends = self.ends.tolist()
        return tuple(self.nodes[a:b] for a, b in zip([0, *ends[:-1]], ends, strict=True))


def smaller_side(nodes: Sequence[int] | Ints | Nodes, size: int) -> Ints:
    """The set or its complement, whichever is smaller: both have the same boundary."""
    members = np.unique(np.asarray(nodes, np.int64))
    if 2 * len(members) <= size:
        return members
    return np.setdiff1d(np.arange(size), members, assume_unique=True)


@dataclass(frozen=True, eq=False)
class Family:
    """Many cuts as flat arrays: set s holds nodes[ptr[s]:ptr[s+1]].

    It belongs to cut ``owner[s]`` and weighs ``weight[s]`` there.
    """

    owner: Ints
    ptr: Ints
    nodes: Nodes
    weight: Ints
    count: int

    @classmethod
    def of(cls, cuts: Sequence[Cut]) -> Family:
        """Flatten cuts in the given order."""
        count = len(cuts)
        if not count:
            none = np.zeros(0, np.int64)
            return cls(none, np.zeros(1, np.int64), np.zeros(0, np.int32), none, 0)
        nodes = np.concatenate([c.nodes for c in cuts])
        sets, lengths = [c.ends for c in cuts], [len(c.nodes) for c in cuts]
        owner = np.repeat(np.arange(count), [len(ends) for ends in sets])
        before = np.cumsum([0, *lengths[:-1]])
        ptr = np.concatenate(([0], np.concatenate(sets) + before[owner]))
        weight = np.concatenate([c.weights for c in cuts])
        return cls(owner, ptr, nodes, weight, count)

    def followed_by(self, more: Family) -> Family:
        """The cuts of both families."""
        return Family(
            np.concatenate((self.owner, more.owner + self.count)),
            np.concatenate((self.ptr, more.ptr[1:] + self.ptr[-1])),
            np.concatenate((self.nodes, more.nodes)),
            np.concatenate((self.weight, more.weight)),
            self.count + more.count,
        )

    def membership(self, size: int) -> tuple[Ints, Ints]:
        """For each node the ascending list of sets that hold it, as (ptr, sets)."""
        sets = np.repeat(np.arange(len(self.owner)), np.diff(self.ptr))
        order = np.argsort(self.nodes, kind="stable")
        ptr = np.zeros(size + 1, np.int64)
        ptr[1:] = np.cumsum(np.bincount(self.nodes, minlength=size))
        return ptr, sets[order]


@kernel
def boundary(
    ptr: Ints, nodes: Nodes, adjacency: Ints, other: Ints, weight: NDArray[np.float64], size: int
) -> NDArray[np.float64]:
    """x(delta(S)) of every set, on a graph in adjacency form."""
    count = len(ptr) - 1
    value = np.zeros(count)
    mark = np.full(size, -1, np.int64)
    for s in range(count):
        for k in range(ptr[s], ptr[s + 1]):
            mark[nodes[k]] = s
        total = 0.0
        for k in range(ptr[s], ptr[s + 1]):
            v = nodes[k]
            for e in range(adjacency[v], adjacency[v + 1]):
                if mark[other[e]] != s:
                    total += weight[e]
        value[s] = total
    return value


def rows(family: Family, i: Ints, j: Ints, size: int) -> tuple[Ints, Ints, Ints]:
    """The cuts' coefficients on the columns ``i[k]``-``j[k]`` as CSR (ptr, column, value)."""
    adjacency, other, column = adjacency_lists(i, j, size)
    return _rows(
        family.owner,
        family.ptr,
        family.nodes,
        family.weight,
        family.count,
        adjacency,
        other,
        column,
        len(i),
        size,
    )


@kernel
def adjacency_lists(i: Ints, j: Ints, size: int) -> tuple[Ints, Ints, Ints]:
    """Neighbours of every node: (ptr, neighbour, index of the edge)."""
    ptr = np.zeros(size + 1, np.int64)
    for k in range(len(i)):
        ptr[i[k] + 1] += 1
        ptr[j[k] + 1] += 1
    for v in range(size):
        ptr[v + 1] += ptr[v]
    fill = ptr[:-1].copy()
    other = np.empty(2 * len(i), np.int64)
    edge = np.empty(2 * len(i), np.int64)
    for k in range(len(i)):
        p, q = i[k], j[k]
        other[fill[p]], edge[fill[p]] = q, k
        fill[p] += 1
        other[fill[q]], edge[fill[q]] = p, k
        fill[q] += 1
    return ptr, other, edge


@kernel
def _rows(
    owner: Ints,
    ptr: Ints,
    nodes: Nodes,
    weight: Ints,
    count: int,
    adjacency: Ints,
    other: Ints,
    column: Ints,
    columns: int,
    size: int,
) -> tuple[Ints, Ints, Ints]:
    coefficient = np.zeros(columns, np.int64)
    mark = np.full(size, -1, np.int64)
    touched = np.empty(columns, np.int64)
    start = np.zeros(count + 1, np.int64)
    capacity = 1024
    out_column = np.empty(capacity, np.int64)
    out_value = np.empty(capacity, np.int64)
    filled, s = 0, 0
    for c in range(count):
        used = 0
        while s < len(owner) and owner[s] == c:
            for k in range(ptr[s], ptr[s + 1]):
                mark[nodes[k]] = s
            for k in range(ptr[s], ptr[s + 1]):
                v = nodes[k]
                for e in range(adjacency[v], adjacency[v + 1]):
                    if mark[other[e]] != s:
                        if coefficient[column[e]] == 0:
                            touched[used] = column[e]
                            used += 1
                        coefficient[column[e]] += weight[s]
            s += 1
        while filled + used > capacity:
            capacity *= 2
            out_column = np.concatenate((out_column, np.empty_like(out_column)))
            out_value = np.concatenate((out_value, np.empty_like(out_value)))
        for t in range(used):
            out_column[filled] = touched[t]
            out_value[filled] = coefficient[touched[t]]
            coefficient[touched[t]] = 0
            filled += 1
        start[c + 1] = filled
    return start, out_column[:filled], out_value[:filled]


@kernel
def columns(
    owner: Ints, weight: Ints, count: int, member_ptr: Ints, member: Ints, i: Ints, j: Ints
) -> tuple[Ints, Ints, Ints]:
    """The columns of new pairs in existing rows as CSC (ptr, row, value); rows 0..count-1."""
    coefficient = np.zeros(count, np.int64)
    touched = np.empty(count, np.int64)
    start = np.zeros(len(i) + 1, np.int64)
    capacity = 1024
    out_row = np.empty(capacity, np.int64)
    out_value = np.empty(capacity, np.int64)
    filled = 0
    for k in range(len(i)):
        a, a_end = member_ptr[i[k]], member_ptr[i[k] + 1]
        b, b_end = member_ptr[j[k]], member_ptr[j[k] + 1]
        used = 0
        while a < a_end or b < b_end:
            if b == b_end or (a < a_end and member[a] < member[b]):
                s = member[a]
                a += 1
            elif a == a_end or member[b] < member[a]:
                s = member[b]
                b += 1
            else:
                a += 1
                b += 1
                continue
            row = owner[s]
            if coefficient[row] == 0:
                touched[used] = row
                used += 1
            coefficient[row] += weight[s]
        while filled + used > capacity:
            capacity *= 2
            out_row = np.concatenate((out_row, np.empty_like(out_row)))
            out_value = np.concatenate((out_value, np.empty_like(out_value)))
        for t in range(used):
            out_row[filled] = touched[t]
            out_value[filled] = coefficient[touched[t]]
            coefficient[touched[t]] = 0
            filled += 1
        start[k + 1] = filled
    return start, out_row[:filled], out_value[:filled]
