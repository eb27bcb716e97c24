"""The search tree: nodes that elimination has emptied are closed, and the checker agrees."""

from __future__ import annotations

import numpy as np
import pytest

from tcp.exact.branch_and_cut.branching import Decision
from tcp.exact.branch_and_cut.cutting import Cutter, Incumbent
from tcp.exact.branch_and_cut.evidence import certificate
from tcp.exact.branch_and_cut.keyholes import LEVELS
from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.branch_and_cut.proof import Alive, Fixings
from tcp.exact.branch_and_cut.relaxation import Relaxation
from tcp.exact.branch_and_cut.run import first_pairs, unit_of
from tcp.exact.branch_and_cut.tree import Node, Tree, _depth
from tcp.files.certificate import to_text
from tcp.instance import Instance
from tcp.solve import solve
from tcp.stop import Clock, Stop
from tcp.validate.certificate import Failure, check
from tcp.workpiece import Workpiece


def eliminated() -> tuple[Instance, Tree, int]:
    """A root whose duals eliminate some pairs, still open, and the key of such a pair."""
    x, y = np.random.default_rng(5).integers(0, 1000, (2, 30))
    instance = Instance(Workpiece("piece", tuple(map(str, range(30))), x, y))
    problem = Problem.of(instance)
    best = solve(instance, "branch-and-cut", exact=True).route
    incumbent = Incumbent(problem, np.arange(problem.size))
    incumbent.offer(np.array(instance.tour(best)))
    lp = Relaxation(problem, first_pairs(problem, incumbent.tour), unit_of(problem))
    tree = Tree(Cutter(problem, lp, incumbent, Clock(Stop())))
    root = Fixings.root(problem)
    lp.enter(root, (), None)
    tree.root_duals = tree.cutter.process(root, ()).duals
    assert tree.root_duals is not None
    tree.eliminate()
    alive = tree.cutter.alive.keys
    assert alive is not None
    everything = np.array(problem.keys(*np.triu_indices(problem.size, 1)))
    return instance, tree, int(np.setdiff1d(everything, alive)[0])


def test_a_node_that_must_use_an_eliminated_pair_is_closed_at_once():
    _, tree, dead = eliminated()
    tree.nodes[0].decision = Decision(dead, None, (0.0, 0.0))
    for side in (0, 1):
        tree._open(tree.nodes[0].child(side, None))
    without, within = tree.nodes[1:]
    assert within.closed
    assert within.duals is tree.root_duals
    assert not without.closed
    assert [at for _, _, at in tree.heap] == [0, 1]


def test_waiting_nodes_are_looked_at_when_pairs_are_eliminated():
    _, tree, dead = eliminated()
    tree.cutter.alive = Alive.everything()
    tree.nodes[0].decision = Decision(dead, None, (0.0, 0.0))
    tree._open(tree.nodes[0].child(1, None))
    assert len(tree.heap) == 2
    tree.eliminate()
    assert [at for _, _, at in tree.heap] == [0]


def test_the_checker_closes_it_too_and_only_because_of_the_roots_duals():
    instance, tree, dead = eliminated()
    root = tree.nodes[0]
    root.decision, root.children = Decision(dead, None, (0.0, 0.0)), (1, 2)
    tree.heap = []
    for side in (0, 1):
        tree._open(root.child(side, None))
    tree.nodes[1].duals = tree.root_duals
    cost = tree.cutter.incumbent.cost
    proof = certificate(instance, tree, cost, instance.route(tree.cutter.incumbent.tour))
    assert check(to_text(proof).encode()).lower == cost
    tree.fixes = []
    for known in (True, False):
        tree.nodes[2].duals = tree.root_duals if known else None
        tree.nodes[2].infeasible = not known  # closed without evidence
        proof = certificate(instance, tree, cost, instance.route(tree.cutter.incumbent.tour))
        if known:
            assert check(to_text(proof).encode()).lower == cost
            continue
        with pytest.raises(Failure, match="is not closed"):
            check(to_text(proof).encode())


def planted(problem: Problem, tour: np.ndarray) -> Tree:
    """A tree that knows one tour."""
    incumbent = Incumbent(problem, np.arange(problem.size))
    incumbent.offer(tour)
    lp = Relaxation(problem, first_pairs(problem, tour), unit_of(problem))
    return Tree(Cutter(problem, lp, incumbent, Clock(Stop())))


def test_no_pair_dies_that_an_earlier_proof_may_force():
    """Two proofs close what is left without a pair, and with it: the checker must not see less.

    The first forces the pair only once a better tour is known; by then the second has excluded it.
    """
    x, y = np.random.default_rng(366).integers(0, 30, (2, 11))
    instance = Instance(Workpiece("piece", tuple(map(str, range(11))), x, y))
    problem = Problem.of(instance)
    best = np.array(instance.tour(solve(instance, "held-karp", exact=True).route))
    worse, cost = best.copy(), instance.cost(instance.route(best))
    worse[1:6] = worse[1:6][::-1]
    assert cost == 68 and instance.cost(instance.route(worse)) > cost
    pair = 16
    tree = planted(problem, worse)
    for side, tour in ((0, best), (1, worse)):
        one, decided = planted(problem, tour), Fixings.root(problem).with_pair(pair, side)
        one.cutter.lp.enter(decided, (), None)
        tree.root_duals = one.cutter.process(decided, ()).duals
        tree.eliminate()
    tree.cutter.incumbent.offer(best)
    tree.eliminate()
    assert len(tree.fixes) == 2 and pair in tree.cutter.alive.keys
    tree.run()
    proof = certificate(instance, tree, cost, instance.route(best))
    assert check(to_text(proof).encode()).lower == cost


def opened(gap: int, closed: float) -> Tree:
    """A tree whose root left ``gap``, and whose only open node has closed a part of that."""
    _, tree, _ = eliminated()
    cost = tree.cutter.incumbent.cost
    tree.nodes[0].bound = cost - gap
    tree.heap = []
    tree._open(Node(Fixings.root(tree.cutter.problem), (), cost - gap + round(gap * closed), None))
    return tree


@pytest.mark.parametrize(
    ("nodes", "closed", "hard"),
    [
        (8, 0.0, True),
        (8, 0.4, True),
        (8, 0.6, False),
        (12, 0.0, False),  # asked at 8 nodes and its doubles
        (16, 0.6, True),
        (16, 0.8, False),
    ],
)
def test_a_tree_that_closes_its_gap_quickly_goes_without_local_cuts(nodes, closed, hard):
    tree = opened(1000, closed)
    tree.processed = nodes
    assert tree._hard() is hard


@pytest.mark.parametrize(
    ("gains", "hard"),
    [
        ((100.0, 100.0), False),
        ((50.0, 100.0), True),
        ((np.inf, 10.0), False),  # no more than the gap can be gained
        ((np.inf, 1.0), True),
        ((0.0, 500.0), True),
        ((-1e-9, 500.0), True),
    ],
)
def test_a_root_whose_branch_gains_little_of_its_gap_is_hard_at_once(gains, hard):
    tree = opened(1000, 0.0)
    tree.forecast = _depth(1000, Decision(1, None, gains))
    for tree.processed in (1, 2):
        assert tree._hard() is (hard and tree.processed == 1)
    tree.processed, tree.deepened = 1, len(LEVELS)
    assert not tree._hard()


def test_a_gap_that_is_good_enough_is_not_worth_another_look_at_the_root(monkeypatch):
    x, y = np.random.default_rng(3).integers(0, 1000, (2, 150))
    instance = Instance(Workpiece("piece", tuple(map(str, range(150))), x, y))
    monkeypatch.setattr("tcp.exact.branch_and_cut.tree.DEEP", 0.0)
    looks, real = [], Tree._deepen
    monkeypatch.setattr(Tree, "_deepen", lambda tree: looks.append(tree.processed) or real(tree))
    for gap in (0.5, 0.0):
        result = solve(instance, "branch-and-cut", exact=True, stop=Stop(gap=gap))
        assert (1 in looks) is (gap == 0.0)
        assert result.bound >= (1 - gap) * result.cost


def test_the_roots_branch_makes_the_forecast(monkeypatch):
    x, y = np.random.default_rng(3).integers(0, 1000, (2, 150))
    instance = Instance(Workpiece("piece", tuple(map(str, range(150))), x, y))
    deepened, real = [], Tree._deepen
    monkeypatch.setattr(Tree, "_deepen", lambda tree: deepened.append(tree.processed) or real(tree))
    costs = []
    for deep in (0.0, 1e9):
        monkeypatch.setattr("tcp.exact.branch_and_cut.tree.DEEP", deep)
        costs.append(solve(instance, "branch-and-cut", exact=True).cost)
        assert (1 in deepened) is (deep == 0.0)
        deepened.clear()
    assert costs[0] == costs[1]


@pytest.mark.parametrize(
    ("nodes", "closed", "hard"),
    [(8, 0.0, False), (32, 0.4, True), (32, 0.6, False), (64, 0.6, True), (64, 0.8, False)],
)
def test_a_tree_below_local_cuts_has_longer_to_close_its_gap(nodes, closed, hard):
    tree = opened(1000, closed)
    tree.processed = 100
    tree._deeper()
    tree.processed += nodes
    assert tree._hard() is hard


def test_a_tree_below_local_cuts_that_closes_little_gets_more_of_them():
    tree = opened(1000, 0.4)
    tree.processed = 100
    taken = [tree._deeper()]
    while len(taken) < len(LEVELS):
        assert not tree._hard() and tree._keyholes(5) == ()
        tree.processed += 32
        assert tree._hard()
        taken.append(tree._deeper())
    assert tuple(taken) == LEVELS
    tree.processed += 32
    assert not tree._hard()
    assert tree._keyholes(5) == LEVELS[0]


@pytest.mark.parametrize("seconds", [None, 0.0])
def test_routes_are_sought_beside_another_look_at_the_root(seconds):
    x, y = np.random.default_rng(5).integers(0, 1000, (2, 30))
    instance = Instance(Workpiece("piece", tuple(map(str, range(30))), x, y))
    tree, heard = planted(Problem.of(instance), np.arange(31)), []
    tree.cutter.clock = Clock(Stop(time=seconds))
    tree.cutter.seek = lambda: heard.append(("sought", tree.nodes[0].bound))
    tree.cutter.polish = lambda: heard.append(("found", tree.nodes[0].bound))
    tree._deepen()
    found = [("found", 0)] if seconds is None else []  # nothing is waited for when time is out
    assert heard == [("sought", 0), *found]


def test_what_the_root_proves_at_another_look_holds_for_all_nodes():
    x, y = np.random.default_rng(5).integers(0, 1000, (2, 30))
    instance = Instance(Workpiece("piece", tuple(map(str, range(30))), x, y))
    tree = planted(Problem.of(instance), np.arange(31))
    tree.heap = [(0, 0, 0)]
    tree._deepen()
    proved = tree.nodes[0].bound
    assert proved > 0
    assert tree.heap == [(proved, 0, 0)]
    tree.run()
    best = tree.cutter.incumbent.tour
    cost = tree.cutter.incumbent.cost
    assert proved <= cost == solve(instance, "branch-and-cut", exact=True).cost
    proof = certificate(instance, tree, cost, instance.route(best))
    assert check(to_text(proof).encode()).lower == cost
