"""A long proof on disk: an unfinished certificate is all it takes to go on.

The state that ``--save-state`` writes is an ordinary certificate of the bound
proved so far.  ``--resume`` has it verified by the independent checker, then
rebuilds the tree from it: every leaf's bound is computed anew from its duals.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tcp.errors import InputError
from tcp.exact.branch_and_cut.branching import Decision
from tcp.exact.branch_and_cut.cuts import Cut
from tcp.exact.branch_and_cut.local import cut_of
from tcp.exact.branch_and_cut.proof import Duals, Fixings, ceiling, verdict
from tcp.exact.branch_and_cut.relaxation import SetBranch
from tcp.exact.branch_and_cut.tree import Node, Tree
from tcp.files import certificate as files
from tcp.instance import Instance
from tcp.validate import certificate as checker


def load(path: str | Path, instance: Instance) -> files.Certificate:
    """Read a saved state and make sure that it is true, and about this instance.

    Raises
    ------
    InputError
        If the file is no certificate, proves nothing, or is about another instance.
    """
    try:
        raw = checker.unzip(Path(path))
        verdict = checker.check(raw, None, instance.sha256)
    except checker.Failure as failure:
        raise InputError(f"this state cannot be resumed ({failure})", path) from None
    if verdict.lower is None:
        raise InputError("this certificate is finished: it proves that no route exists", path)
    return files.from_text(raw.decode(), path)


def replant(state: files.Certificate, tree: Tree, path: str | Path) -> None:
    """Replace a fresh tree by the saved one; the incumbent must have been offered already.

    Raises
    ------
    InputError
        If the certificate has a shape that this engine does not write.
    """
    try:
        size = tree.cutter.problem.size
        tree.cutter.pool.add(_cut(state, k, size) for k in range(len(state.cuts)))
        at = 0
        while isinstance(node := state.tree[at], files.Fix):
            tree.root_duals = _duals(state, node.duals, size)
            tree.eliminate()
            at = node.child
        tree.nodes.clear()
        tree.heap.clear()
        _grow(state, tree, at)
        if tree.bound is not None:
            tree.nodes[0].bound = tree.bound  # what is open now is the gap to measure by
    except (IndexError, ValueError, TypeError, OverflowError) as error:
        raise InputError(f"this state cannot be resumed ({error})", path) from None


def _grow(state: files.Certificate, tree: Tree, root: int) -> None:
    first = Node(Fixings.root(tree.cutter.problem), (), 0, None)
    tree.nodes.append(first)
    waiting = [(root, 0)]
    while waiting:
        at, k = waiting.pop()
        saved, node = state.tree[at], tree.nodes[k]
        if isinstance(saved, files.Leaf):
            _leaf(state, tree, saved, k)
            continue
        if isinstance(saved, files.Fix):
            raise ValueError("it fixes pairs below the root")
        node.decision, sides = _decision(state, tree, saved)
        node.children = (len(tree.nodes), len(tree.nodes) + 1)
        for side in (0, 1):
            waiting.append((sides[side], len(tree.nodes)))
            tree.nodes.append(node.child(side, None))


def _decision(
    state: files.Certificate, tree: Tree, saved: files.Node
) -> tuple[Decision, tuple[int, int]]:
    size = tree.cutter.problem.size
    if isinstance(saved, files.EdgeBranch):
        i, j = sorted((saved.i, saved.j))
        if not 0 <= i < j < size:
            raise ValueError(f"there is no pair {i}, {j}")
        return Decision(i * size + j, None, (0.0, 0.0)), (saved.absent, saved.present)
    assert isinstance(saved, files.SetBranch)
    cut = Cut.of([np.array(state.sets[saved.nodes], np.int64)])
    return Decision(-1, cut, (0.0, 0.0)), (saved.two, saved.four)


def _leaf(state: files.Certificate, tree: Tree, saved: files.Leaf, k: int) -> None:
    """Close a leaf if its duals do, else open it again."""
    node, cutter = tree.nodes[k], tree.cutter
    if saved.duals is not None and not node.fixings.contradict:
        duals = _duals(state, saved.duals, cutter.problem.size)
        _respect(duals, node.branches)
        found = verdict(cutter.problem, duals, node.fixings, cutter.alive)
        if duals.scale:
            node.duals = duals
            node.bound = ceiling(found.scaled, duals.scale, cutter.problem.granularity)
        elif found.scaled > 0:
            node.duals, node.closed, node.infeasible = duals, True, True
            return
    tree.admit(k)


def _respect(duals: Duals, branches: tuple[SetBranch, ...]) -> None:
    """Refuse multipliers of set branches that are not above the leaf."""
    made = {(b.cut.key, b.four) for b in branches}
    for cut, rhs, y in duals.cuts:
        if (y < 0 or rhs == 4) and (cut.key, rhs == 4) not in made:
            raise ValueError("a leaf speaks of a set branch that is not above it")


def _cut(state: files.Certificate, k: int, size: int) -> Cut:
    cut = state.cuts[k]
    if isinstance(cut, files.Weighted):
        sets = [np.array(state.sets[s], np.int64) for s in cut.sets]
        return cut_of(sets, cut.weights, size)
    return Cut.of([np.array(state.sets[s], np.int64) for s in cut])


def _duals(state: files.Certificate, duals: files.Duals, size: int) -> Duals:
    cuts = []
    for k, y in duals.cuts:
        cut = _cut(state, k, size)
        cuts.append((cut, cut.rhs, int(y)))
    for s, y in duals.branches:
        cuts.append((Cut.of([np.array(state.sets[s], np.int64)]), 4 if y > 0 else 2, int(y)))
    return Duals(np.asarray(duals.potentials, np.int64), tuple(cuts), int(duals.scale))
