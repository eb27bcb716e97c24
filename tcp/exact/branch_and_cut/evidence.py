"""The search tree as a certificate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tcp.exact.branch_and_cut.proof import Duals
from tcp.exact.branch_and_cut.tree import Node, Tree
from tcp.files import certificate as files
from tcp.instance import Instance


def certificate(
    instance: Instance, tree: Tree, lower: int | None, route: Sequence[int] | None
) -> files.Certificate:
    """What a search has proved so far, as a certificate.

    Parameters
    ----------
    instance : Instance
        The problem.
    tree : Tree
        The search, finished or not; an open node is a leaf with its best duals.
    lower : int or None
        The bound to claim, at most that of every leaf; None claims infeasibility.
    route : sequence of int or None
        The best route, whose cost is the claimed upper bound.
    """
    pool = files.Pool()
    written: list[files.Node | None] = []
    if lower is not None:
        for at, duals in enumerate(tree.fixes):
            written.append(files.Fix(_duals(pool, duals), at + 1))
    place = {k: len(written) + k for k in range(len(tree.nodes))}
    written += [None] * len(tree.nodes)
    for k, node in enumerate(tree.nodes):
        if node.children:
            assert node.decision is not None
            first, second = (place[c] for c in node.children)
            if node.decision.cut is None:
                i, j = divmod(node.decision.key, tree.cutter.problem.size)
                written[place[k]] = files.EdgeBranch(i, j, first, second)
            else:
                nodes = pool.set(node.decision.cut.nodes.tolist())
                written[place[k]] = files.SetBranch(nodes, first, second)
        else:
            written[place[k]] = files.Leaf(_leaf(pool, node, tree.cutter.problem.size))
    return files.Certificate.for_instance(
        instance, lower=lower, route=route, pool=pool, tree=[w for w in written if w is not None]
    )


def _leaf(pool: files.Pool, node: Node, size: int) -> files.Duals | None:
    """A node's evidence: its duals, a contradiction (None), or that costs are not negative."""
    if node.duals is not None:
        return _duals(pool, node.duals)
    return None if node.infeasible else files.Duals(1, np.zeros(size, np.int64))


def trivial(instance: Instance, route: Sequence[int] | None) -> files.Certificate:
    """The certificate of an instance of one or two nodes, where at most one tour exists.

    Without a route the only pair is forbidden: the degree of node 0 cannot be 2.
    """
    form = instance.form
    potentials = np.zeros(form.size, np.int64)
    if route is None:
        potentials[0], scale, lower = 1, 0, None
    else:
        cost = instance.cost(route)
        scale, lower = 1, cost
        potentials[0] = cost // 2
    leaf = files.Leaf(files.Duals(scale, potentials))
    return files.Certificate.for_instance(instance, lower=lower, route=route, tree=[leaf])


def _duals(pool: files.Pool, duals: Duals) -> files.Duals:
    cuts, branches = [], []
    for cut, rhs, y in duals.cuts:
        if y < 0 or rhs != cut.rhs:
            branches.append((pool.set(cut.nodes.tolist()), y))
        else:
            weights = tuple(cut.weights.tolist()) if cut.local else ()
            cuts.append((pool.cut([s.tolist() for s in cut.sets], weights), y))
    return files.Duals(max(duals.scale, 0), duals.pi, tuple(cuts), tuple(branches))
