"""Keyholes at tight cuts: two that lie close together split the nodes into a few parts.

What the LP solution violates is mostly found where its tight cuts meet: a comb
and another one that shares a tooth or a handle with it, or a cut with itself
(double-deckers and stars have the parts of combs).  No keyhole grown from a node
has such atoms: they are large, and follow the structure that the cuts have found.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from tcp.exact.branch_and_cut.cuts import Cut, Family, Nodes
from tcp.exact.branch_and_cut.sights import Sight, between
from tcp.exact.branch_and_cut.support import Support
from tcp.jit import allocating
from tcp.travel import Ints

SETS = 62
"""Most sets of two cuts: a bit each."""


def sights(
    support: Support, cuts: Sequence[Cut], partners: int, least: int, most: int
) -> Iterator[Sight]:
    """Sights at the parts of every cut, and of every cut with those that share most nodes with it.

    Parameters
    ----------
    support : Support
        An LP solution.
    cuts : sequence of Cut
        Cuts, tight ones best.
    partners : int
        How many others each cut is joined with.
    least, most : int
        Of how many parts, the rest of the graph included; at most 16.
    """
    if not cuts:
        return
    family = Family.of(cuts)
    first = np.searchsorted(family.owner, np.arange(len(cuts) + 1))
    weight = support.weight
    for a, b in _pairs(cuts, support.size, partners).tolist():
        sets = np.arange(first[a], first[a + 1])
        if b != a:
            sets = np.concatenate((sets, np.arange(first[b], first[b + 1])))
        if len(sets) > SETS:
            continue
        nodes, ends = _split(sets, family.ptr, family.nodes, support.size, most)
        if least <= len(ends) + 1 <= most:
            part = np.repeat(np.arange(len(ends)), np.diff(ends, prepend=0))
            x = between(support.ptr, support.other, weight, nodes, part)
            yield Sight(x, [nodes[a:b] for a, b in pairwise([0, *ends.tolist()])])


def _pairs(cuts: Sequence[Cut], size: int, partners: int) -> Ints:
    """Every cut with itself, and with its partners."""
    count = len(cuts)
    whole = Family.of([Cut.of([np.unique(cut.nodes)]) for cut in cuts])
    near = _partners(whole.nodes, whole.ptr, *whole.membership(size), partners)
    pairs = np.stack((np.repeat(np.arange(count), partners), near.ravel()), axis=1)
    pairs = np.unique(np.sort(pairs[pairs[:, 1] >= 0], axis=1), axis=0)
    alone = np.arange(count)
    return np.concatenate((np.stack((alone, alone), axis=1), pairs))


@allocating
def _partners(node: Nodes, at: Ints, with_node: Ints, cut: Ints, most: int) -> Ints:
    """For every cut up to ``most`` others: the greater the share of common nodes, the earlier.

    Cut c holds ``node[at[c]:at[c+1]]``; ``cut[with_node[v]:with_node[v+1]]`` hold node v.
    Places that stay empty are -1.
    """
    count = len(at) - 1
    partners = np.full((count, most), -1)
    common = np.zeros(count, np.int64)
    near = np.empty(count, np.int64)
    for a in range(count):
        known = 0
        for p in range(at[a], at[a + 1]):
            for q in range(with_node[node[p]], with_node[node[p] + 1]):
                b = cut[q]
                if b == a:
                    continue
                if common[b] == 0:
                    near[known] = b
                    known += 1
                common[b] += 1
        share = np.empty(known)
        for k in range(known):
            b = near[k]
            union = at[a + 1] - at[a] + at[b + 1] - at[b] - common[b]
            share[k] = common[b] / union
            common[b] = 0
        order = np.argsort(-share, kind="mergesort")
        for k in range(min(most, known)):
            partners[a, k] = near[order[k]]
    return partners


@allocating
def _split(sets: Ints, ptr: Ints, nodes: Nodes, size: int, most: int) -> tuple[Ints, Ints]:
    """The parts into which sets split the nodes, one after the other, and where each ends.

    The nodes in no set are left out; if there are none, a part is.  With more than
    ``most`` parts in all the ends are empty.
    """
    code = np.zeros(size, np.int64)
    inside = np.empty(size, np.int64)
    count = 0
    for k in range(len(sets)):
        for p in range(ptr[sets[k]], ptr[sets[k] + 1]):
            v = nodes[p]
            if code[v] == 0:
                inside[count] = v
                count += 1
            code[v] |= 1 << k
    inside = inside[:count]
    inside = inside[np.argsort(code[inside], kind="mergesort")]
    ends = np.empty(most + 1, np.int64)
    parts = 0
    for k in range(1, count + 1):
        if k == count or code[inside[k]] != code[inside[k - 1]]:
            if parts == most:
                return inside, ends[:0]
            ends[parts] = k
            parts += 1
    if count == size:
        parts -= 1
    if parts >= most or parts == 0:
        return inside, ends[:0]
    return inside[: ends[parts - 1]], ends[:parts]
