"""A 1-tree bound as a certificate: Kruskal's components are the subtour cuts.

Let the tree's pairs be joined in order of weight w, and let W(S) be the weight at which component
S came into being, W(parent) the one at which it was absorbed.  Then z(S) = W(parent) - W(S) >= 0
is an optimal dual of the spanning tree, and since every tour has degree 2 in each node, the rows
x(E(S)) <= |S| - 1 are the cuts x(d(S)) >= 2 with multiplier z(S) / 2, and potentials

    q_v = p_v + (W(root) - sum of z(S) over the S that hold v) / 2.

Every pair then weighs c - p_i - p_j minus the weight at which Kruskal joins its ends: 0 in the
tree and never less outside it, because the tree is lightest over all pairs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tcp.bounds.one_tree import Bound
from tcp.errors import UsageError
from tcp.files.certificate import Certificate, Duals, Leaf, Pool
from tcp.instance import Instance

LARGEST = 3_000
"""Most nodes: the components' sizes add up to O(n^2)."""


def bound_certificate(
    instance: Instance, bound: Bound, route: Sequence[int] | None = None
) -> Certificate:
    """The certificate of a 1-tree bound.

    Parameters
    ----------
    instance : Instance
        The problem.
    bound : Bound
        What :func:`tcp.bounds.one_tree.one_tree_bound` found for it.
    route : sequence of int, optional
        A route, whose cost becomes the claimed upper bound.

    Raises
    ------
    UsageError
        For more than :data:`LARGEST` nodes.
    """
    small_enough(instance)
    pool, cuts = Pool(), []
    doubled = 2 * bound.potentials
    if len(bound.tree):
        merged = _merges(instance, bound)
        root = merged[-1][1]
        doubled[:] += root
        doubled[bound.special] = 0
        for nodes, born, absorbed in merged[:-1]:
            doubled[nodes] -= absorbed - born
            if absorbed > born:
                cuts.append((pool.cut([nodes]), absorbed - born))
        doubled[bound.special] = _level(instance, bound, root)
    duals = Duals(2 * bound.scale, doubled, tuple(cuts))
    return Certificate.for_instance(
        instance, lower=bound.value, route=route, pool=pool, tree=[Leaf(duals)]
    )


def small_enough(instance: Instance) -> None:
    """See before the work that there can be a certificate of it.

    Raises
    ------
    UsageError
        For more than :data:`LARGEST` nodes.
    """
    if instance.form.size > LARGEST:
        raise UsageError(f"certificates of 1-tree bounds are for up to {LARGEST} nodes")


def _level(instance: Instance, bound: Bound, root: int) -> int:
    """Twice the special node's potential: what its second edge weighs, forced edges aside."""
    form, special = instance.form, bound.special
    others = np.delete(np.arange(form.size), special)
    costs = form.costs(others, np.full_like(others, special))
    weights = 2 * (bound.scale * costs - bound.potentials[others]) - root
    forced = {i + j - special for i, j in form.forced if special in (i, j)}
    free = np.sort(weights[~np.isin(others, list(forced))])
    return int(free[max(0, 1 - len(forced))] if free.size else 0)


def _lightest_inside(instance: Instance, bound: Bound) -> int:
    """The least weight of two nodes that forced pairs join, next to each other or not."""
    form, potentials = instance.form, bound.potentials
    pairs = np.array([pair for pair in form.forced if bound.special not in pair], np.int64)
    i, j = pairs.reshape(-1, 2).T
    joined = coo_array((np.ones(len(i)), (i, j)), shape=(form.size, form.size))
    chain = connected_components(joined, directed=False)[1]
    least = 2**62
    for one in np.unique(chain[i]):
        nodes = np.flatnonzero(chain == one)
        i, j = (nodes[k] for k in np.triu_indices(len(nodes), 1))
        weights = bound.scale * form.costs(i, j) - potentials[i] - potentials[j]
        least = min(least, int(weights.min()))
    return least


def _merges(instance: Instance, bound: Bound) -> list[tuple[list[int], int, int]]:
    """Kruskal's components as (nodes, weight when born, weight when absorbed), the root last.

    Forced pairs are joined first, at the least weight of all: what they weigh more is the price
    of using them, which the checker adds for each forced pair.
    """
    form, potentials = instance.form, bound.potentials
    i, j = bound.tree[:, 0], bound.tree[:, 1]
    weights = bound.scale * form.costs(i, j) - potentials[i] - potentials[j]
    forced = set(form.forced)
    must = np.array([(min(e), max(e)) in forced for e in bound.tree.tolist()])
    weights[must] = min(int(weights.min()), _lightest_inside(instance, bound))
    members = {v: [v] for v in range(form.size)}
    born: dict[int, int] = {}
    owner = list(range(form.size))
    found: list[tuple[list[int], int, int]] = []
    for k in np.lexsort((~must, weights)):
        w, parts = int(weights[k]), (owner[i[k]], owner[j[k]])
        found += [(sorted(members[p]), born[p], w) for p in parts if len(members[p]) > 1]
        small, large = sorted(parts, key=lambda part: len(members[part]))
        for v in members[small]:
            owner[v] = large
        members[large] = members[large] + members.pop(small)
        born[large] = w
    top = owner[i[0]]
    return [*found, (sorted(members[top]), born[top], born[top])]
