"""The search: best bound first, diving from there, until every node is closed.

Nodes live in one list, so that the finished tree is the certificate's tree.
The process is deterministic: time only decides where it stops.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import reduce

import numpy as np

from tcp.exact.branch_and_cut.branching import Brancher, Decision
from tcp.exact.branch_and_cut.cutting import Cutter, NodeResult
from tcp.exact.branch_and_cut.keyholes import LEVELS, Step
from tcp.exact.branch_and_cut.proof import Alive, Duals, Fixings, survivors, verdict
from tcp.exact.branch_and_cut.relaxation import SetBranch, Snapshot
from tcp.exact.branch_and_cut.support import Support
from tcp.stop import StopReason
from tcp.travel import Ints

FEW = 60
"""Eliminated instances keep at most this many pairs a node; otherwise none is eliminated."""


LARGE = 1_000
"""Nodes above which the root gets local cuts at once, and the last of them with patience."""

HARD, HARDER = 8, 32
"""Nodes, and their doubles, at which a tree is asked whether its root needs local cuts, or more."""

DEEP = 12.0
"""A tree that seems to become deeper than this is hard from its root on."""


@dataclass(eq=False)
class Node:
    """A node of the search tree.

    ``duals`` prove ``bound`` (they may be the parent's).  A node with a
    ``decision`` has two children: x = 0 and 1, or x(delta(S)) = 2 and >= 4.
    """

    fixings: Fixings
    branches: tuple[SetBranch, ...]
    bound: int
    duals: Duals | None
    depth: int = 0
    snapshot: Snapshot | None = None
    closed: bool = False
    infeasible: bool = False
    decision: Decision | None = None
    children: tuple[int, ...] = ()

    def child(self, side: int, snapshot: Snapshot | None) -> Node:
        """The child on one side of the decision; it starts from this node's bound."""
        assert self.decision is not None
        fixings, branches = self.fixings, self.branches
        cut = self.decision.cut
        if cut is None:
            fixings = fixings.with_pair(self.decision.key, side)
        else:
            others = tuple(b for b in branches if b.cut.key != cut.key)
            branches = (*others, SetBranch(cut, bool(side)))
        return Node(fixings, branches, self.bound, self.duals, self.depth + 1, snapshot)


@dataclass
class Tree:
    """The search over one problem.

    Parameters
    ----------
    cutter : Cutter
        Processes single nodes.
    news : callable
        Told the global bound and the number of open nodes.
    saved : callable
        Called between nodes; may write a snapshot of the search.
    """

    cutter: Cutter
    news: Callable[[int, int], None] = lambda bound, open_nodes: None
    saved: Callable[[Tree], None] = lambda tree: None
    nodes: list[Node] = field(default_factory=list)
    fixes: list[Duals] = field(default_factory=list)
    negative: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    heap: list[tuple[int, int, int]] = field(default_factory=list)
    root_duals: Duals | None = None
    stopped: bool = False
    processed: int = 0
    stuck: bool = False
    deepened: int = 0
    deepened_at: int = 0
    forecast: float = 0.0

    def __post_init__(self) -> None:
        self.brancher = Brancher(self.cutter.lp, self.cutter.threads)
        if not self.nodes:
            self._open(Node(Fixings.root(self.cutter.problem), (), 0, None))

    @property
    def bound(self) -> int | None:
        """The least bound of an open node; None when all are closed."""
        return min((self.nodes[k].bound for _, _, k in self.heap), default=None)

    def run(self) -> None:
        """Search until all nodes are closed or the clock says stop."""
        following: int | None = None
        while self.heap and not self.stopped:
            following = self._step(following)
            self.processed += 1
            self._heed()
            if self.heap and not self.stopped and self._hard():
                self._deepen()
                following = None
                self._heed()
            self.saved(self)

    def _heed(self) -> None:
        """Stop if a condition to stop holds while there is work left."""
        self.stopped = self.stopped or (bool(self.heap) and self.reason() is not None)

    def reason(self) -> StopReason | None:
        """Which of the stop's conditions holds; iterations are the nodes processed."""
        cutter = self.cutter
        return cutter.clock.reason(cutter.incumbent.cost, self.bound, self.processed)

    # -- one node ------------------------------------------------------------

    def _step(self, following: int | None) -> int | None:
        """Process one node; returns the child to dive into."""
        self._prune()
        at = self._take(following)
        if at is None:
            return None
        node, cutter = self.nodes[at], self.cutter
        keys = cutter.alive.keys
        cutter.lp.enter(node.fixings, node.branches, keys)
        if node.snapshot is not None and following is None:
            cutter.lp.restore(node.snapshot)
        before = cutter.incumbent.cost
        result = cutter.process(node.fixings, node.branches, self._keyholes(at))
        self._record(node, result)
        if at == 0 and result.duals is not None and not result.infeasible:
            self.root_duals = result.duals
            if not node.closed and not result.stopped:
                cutter.polish()
        news = at == 0 or cutter.incumbent.cost != before
        if news and (self.heap or not node.closed):
            self.eliminate()
        if result.stopped:
            self.stopped, self.stuck = True, result.stuck
            heapq.heappush(self.heap, (node.bound, node.depth, at))
            return None
        if node.closed:
            self._report()
            return None
        return self._branch(at)

    def _keyholes(self, at: int) -> Sequence[Step]:
        """Which local cuts a node gets: none, but at a large root and where all else failed."""
        if at == 0 and self.cutter.problem.size > LARGE and not self.deepened:
            return self._deeper()
        return LEVELS[0] if self.deepened == len(LEVELS) else ()

    def _deeper(self) -> Sequence[Step]:
        """The keyholes for the next look at the root."""
        self.deepened += 1
        self.deepened_at = self.processed
        return LEVELS[self.deepened - 1]

    def _hard(self) -> bool:
        """Whether more of the root's gap is open than a tree of so many nodes should leave.

        Half of it may be after :data:`HARD` nodes, a quarter after twice as many, and so on;
        below local cuts after :data:`HARDER` nodes.  At the root its first branch tells.
        """
        if self.deepened >= len(LEVELS):
            return False
        if self.processed == 1 and self.forecast > DEEP:
            return True
        nodes, first = self.processed - self.deepened_at, HARDER if self.deepened else HARD
        if nodes not in (first << k for k in range(30)):
            return False
        cost, bound, root = self.cutter.incumbent.cost, self.bound, self.nodes[0].bound
        if cost is None or bound is None:
            return True
        return (cost - bound) * 2 * nodes > (cost - root) * first

    def _deepen(self) -> None:
        """Look at the root again, now with more local cuts; what it proves holds for every node."""
        cutter = self.cutter
        root = Fixings.root(cutter.problem)
        cutter.seek()
        cutter.lp.enter(root, (), cutter.alive.keys)
        patient = cutter.problem.size > LARGE and self.deepened == len(LEVELS) - 1
        result = cutter.process(root, (), self._deeper(), patient)
        self.stopped, self.stuck = result.stopped, result.stuck
        if not self.stopped:
            cutter.polish()
        if result.infeasible:
            self._close_all(result.duals)
        if result.duals is None or result.bound is None:
            return
        self.root_duals = result.duals
        self.nodes[0].bound, self.nodes[0].duals = result.bound, result.duals
        snapshot = cutter.lp.snapshot()
        for _, _, at in self.heap:
            node = self.nodes[at]
            node.snapshot = snapshot
            if result.bound > node.bound:
                node.duals, node.bound = result.duals, result.bound
        self.heap = [(self.nodes[at].bound, depth, at) for _, depth, at in self.heap]
        heapq.heapify(self.heap)
        self.eliminate()
        self._report()

    def _close_all(self, ray: Duals | None) -> None:
        """Close every open node: multipliers of the root prove that there is no tour."""
        for _, _, at in self.heap:
            node = self.nodes[at]
            node.duals, node.closed, node.infeasible = ray, True, True
        self.heap = []

    def _take(self, following: int | None) -> int | None:
        if not self.heap:
            return None
        if following is not None:
            for position, (_, _, k) in enumerate(self.heap):
                if k == following:
                    self.heap[position] = self.heap[-1]
                    self.heap.pop()
                    heapq.heapify(self.heap)
                    return k
        return heapq.heappop(self.heap)[2]

    def _record(self, node: Node, result: NodeResult) -> None:
        node.closed, node.infeasible = result.closed, result.infeasible
        if result.infeasible or (
            result.duals is not None
            and result.bound is not None
            and (node.duals is None or result.bound > node.bound or result.closed)
        ):
            node.duals = result.duals
            node.bound = node.bound if result.bound is None else max(node.bound, result.bound)

    def _prune(self) -> None:
        """Close open nodes whose known bound reaches a better incumbent."""
        cost = self.cutter.incumbent.cost
        if cost is None:
            return
        keep = []
        for entry in self.heap:
            node = self.nodes[entry[2]]
            if node.bound >= cost and node.duals is not None:
                node.closed = True
            else:
                keep.append(entry)
        if len(keep) < len(self.heap):
            self.heap = keep
            heapq.heapify(self.heap)

    # -- branching -------------------------------------------------------------

    def _branch(self, at: int) -> int | None:
        node, cutter = self.nodes[at], self.cutter
        lp = cutter.lp
        support = Support.of(cutter.problem.size, lp.i, lp.j, lp.x)
        cost = cutter.incumbent.cost
        cutoff = lp.objective * 1.01 + 1 if cost is None else float(cost)
        decision = self.brancher.choose(support, cutter.incumbent.tour, cutoff)
        if decision is None:
            self.stopped = self.stuck = True
            heapq.heappush(self.heap, (node.bound, node.depth, at))
            return None
        if at == 0:
            self.forecast = _depth(cutoff - node.bound, decision)
        snapshot = lp.snapshot()
        node.decision = decision
        first = len(self.nodes)
        node.children = (first, first + 1)
        for side in (0, 1):
            self._open(node.child(side, snapshot))
        node.snapshot = None
        self._report()
        return first + int(decision.gains[1] < decision.gains[0])

    def _open(self, node: Node) -> None:
        self.nodes.append(node)
        self.admit(len(self.nodes) - 1)

    def admit(self, at: int) -> None:
        """Queue a node, unless its decisions contradict each other or what is eliminated."""
        node = self.nodes[at]
        if node.fixings.contradict:
            node.closed = node.infeasible = True
            node.duals = None
            return
        if self._demands_the_dead(node):
            # gone for the checker, too: any duals close a leaf that demands what is gone
            node.closed, node.duals = True, self.root_duals
            return
        heapq.heappush(self.heap, (node.bound, node.depth, at))

    def _demands_the_dead(self, node: Node) -> bool:
        """Whether a pair that the node's tours must use is in no better tour at all."""
        alive = self.cutter.alive.keys
        return alive is not None and not np.isin(node.fixings.inside, alive).all()

    def _report(self) -> None:
        bound = self.bound
        if bound is None:
            bound = self.cutter.incumbent.cost
        if bound is not None:
            self.news(bound, len(self.heap))

    # -- elimination -------------------------------------------------------------

    def eliminate(self) -> None:
        """Drop all pairs that the root's duals exclude from every better tour."""
        cutter, duals = self.cutter, self.root_duals
        cost = cutter.incumbent.cost
        if duals is None or cost is None:
            return
        problem = cutter.problem
        scaled = verdict(problem, duals, Fixings.root(problem), cutter.alive).scaled
        need = cost - problem.granularity
        found = survivors(problem, duals, scaled, need, cutter.alive, FEW * problem.size)
        if found is None:
            return
        keys = reduce(np.union1d, (found.kept, problem.forced, self.negative))
        self.negative = np.union1d(self.negative, found.negative)
        if cutter.alive.keys is not None and len(keys) == len(cutter.alive.keys):
            return
        if not any(duals is d for d in self.fixes):
            self.fixes.append(duals)
        cutter.alive = Alive.of(problem, keys)
        cutter.lp.remove_pairs(keys)
        waiting, self.heap = self.heap, []
        for _, _, at in waiting:
            self.admit(at)


def _depth(gap: float, decision: Decision) -> float:
    """How deep a tree becomes if every branch gains what this one does."""
    down, up = (min(max(gain, 0.0), gap) for gain in decision.gains)
    return gap / math.sqrt(down * up) if down * up > 0.0 else math.inf
