"""The solver ``branch-and-cut``: start route, search, route and certificate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tcp.exact.branch_and_cut.cutting import Cutter, Incumbent
from tcp.exact.branch_and_cut.evidence import certificate, trivial
from tcp.exact.branch_and_cut.primal import LIGHT, Repair, start
from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.branch_and_cut.proof import Duals
from tcp.exact.branch_and_cut.relaxation import Relaxation
from tcp.exact.branch_and_cut.saved import load, replant
from tcp.exact.branch_and_cut.scout import Scout
from tcp.exact.branch_and_cut.tree import Tree
from tcp.files.certifiable import certifiable
from tcp.files.certificate import Certificate, write
from tcp.instance import Instance
from tcp.result import Outcome, Progress, Report
from tcp.stop import Clock, StopReason

SAVE_EVERY = 30.0
"""Seconds between two writings of the state."""

LARGEST = 20_000
"""Most nodes: beyond, a single pricing of all pairs takes seconds."""


def refusal(instance: Instance) -> str | None:
    """Why the engine cannot take an instance, or None."""
    if instance.form.size > LARGEST:
        return f"it takes up to {LARGEST} nodes; tcp bound gives a lower bound for more"
    return None


def run(
    instance: Instance,
    *,
    rng: np.random.Generator,
    clock: Clock,
    report: Report,
    start_route: Sequence[int] | None = None,
    save_state: str | Path | None = None,
    resume: str | Path | None = None,
    like: Sequence[Path] = (),
) -> Outcome:
    """Find a shortest route and prove it; see :func:`tcp.solve.solve`.

    Parameters
    ----------
    start_route : sequence of int, optional
        A route to begin with instead of the local search's.
    save_state : path, optional
        Where to keep an unfinished certificate: written at the start, and every half minute
        between nodes and while the root is being cut.
    resume : path, optional
        Such a file: the proof goes on from there.
    like : sequence of path
        A new state is kept from whom any of these files is kept from.

    Raises
    ------
    InputError
        If the state to resume is unreadable, untrue or about another instance.
    UsageError
        If a state is to be kept of rules that certificates do not know.
    """
    if save_state is not None:
        certifiable(instance)
    with clock.paused():
        state = None if resume is None else load(resume, instance)
    if instance.form.size <= 2:
        return _tiny(instance)
    place = None if save_state is None else Path(save_state)
    engine = _Engine(instance, clock, report, place, like)
    return engine.run(rng, start_route, state, resume)


def _tiny(instance: Instance) -> Outcome:
    """One or two nodes: at most one tour."""
    if instance.form.forbidden:
        return Outcome(route=None, infeasible=True, evidence=trivial(instance, None))
    route = instance.route(range(instance.form.size))
    cost = instance.cost(route)
    return Outcome(route=route, bound=cost, evidence=trivial(instance, route))


@dataclass
class _Engine:
    """One run: wires the parts together and streams the news."""

    instance: Instance
    clock: Clock
    report: Report
    save_state: Path | None = None
    like: Sequence[Path] = ()
    bound: int | None = None
    open_nodes: int = 1
    details: dict[str, object] = field(default_factory=dict)

    def run(
        self,
        rng: np.random.Generator,
        route: Sequence[int] | None,
        state: Certificate | None,
        origin: str | Path | None,
    ) -> Outcome:
        """Search from a route, or from a saved state, until done or stopped."""
        if state is not None and state.route is not None:
            route = state.route
        problem = Problem.of(self.instance)
        given = None if route is None else self.instance.tour(route)
        tour = start(problem, rng, self.clock, given)
        identity = np.arange(problem.size)
        self.incumbent = Incumbent(problem, identity if tour is None else tour)
        self.incumbent.heard = self._heard
        if tour is not None:
            self.incumbent.offer(tour)
        lp = Relaxation(problem, first_pairs(problem, self.incumbent.tour), unit_of(problem))
        cutter = Cutter(problem, lp, self.incumbent, self.clock, rng=rng.spawn(1)[0])
        cutter.improve = Repair(problem, self.incumbent, rng, self.clock)
        cutter.listen = self._proved_here
        self.tree = Tree(cutter, news=self._proved, saved=self._save)
        if state is not None and origin is not None:
            replant(state, self.tree, origin)
        self._due = self.clock.elapsed
        self._save(self.tree)
        scout = Scout(problem, self.incumbent, rng.spawn(1)[0], self.clock)
        if problem.size > LIGHT and self.incumbent.cost is not None:
            cutter.seek, cutter.polish = scout.send, scout.hear
            scout.send()
        try:
            self.tree.run()
        finally:
            scout.recall()
        return self._outcome()

    def _save(self, tree: Tree) -> None:
        """Write the state between two nodes: when it is due, and at the end."""
        bound = self._bound()
        if bound is not None:
            self._write(bound, not tree.heap or tree.stopped)

    def _write(self, bound: int, at_once: bool = False) -> None:
        """Write the state; twice a minute, and never for more than a tenth of the time."""
        now = self.clock.elapsed
        if self.save_state is None or (now < self._due and not at_once):
            return
        state = certificate(self.instance, self.tree, bound, self._route())
        write(state, self.save_state, like=self.like)
        self._due = now + max(SAVE_EVERY, 10 * (self.clock.elapsed - now))

    # -- news --------------------------------------------------------------

    def _heard(self) -> None:
        self._tell("route")

    def _proved_here(self, bound: int, duals: Duals) -> None:
        """A bound at one node: it holds for all only while that node is the root."""
        root = self.tree.nodes[0]
        if root.children:
            return
        if root.duals is None or bound > root.bound:
            root.bound, root.duals = bound, duals
        self._proved(bound, 1)
        cost = self.incumbent.cost
        self._write(root.bound if cost is None else min(root.bound, cost))

    def _proved(self, bound: int, open_nodes: int) -> None:
        self.open_nodes = open_nodes
        cost = self.incumbent.cost
        bound = bound if cost is None else min(bound, cost)
        if self.bound is None or bound > self.bound:
            self.bound = bound
            self._tell("bound")
        else:
            self._tell("")

    def _tell(self, note: str) -> None:
        cost = self.incumbent.cost
        done = len(self.tree.nodes) if hasattr(self, "tree") else 0
        text = f"{note} ({self.open_nodes} open nodes)".strip()
        self.report(Progress(self.clock.elapsed, cost, self.bound, done, text))

    # -- the end -----------------------------------------------------------

    def _route(self) -> tuple[int, ...] | None:
        found = self.incumbent.cost is not None
        return self.instance.route(self.incumbent.tour) if found else None

    def _bound(self) -> int | None:
        """The bound proved so far; None when it is infeasibility that is proved."""
        cost, tree = self.incumbent.cost, self.tree
        if not tree.heap:
            return cost
        bound = max(0, tree.bound or 0)
        return bound if cost is None else min(bound, cost)

    def _reason(self) -> StopReason:
        """Why the search came back; ``completed`` with a gap where numbers were too coarse."""
        if not self.tree.heap or self.tree.stuck:
            return StopReason.COMPLETED
        return self.tree.reason() or StopReason.TIME

    def _outcome(self) -> Outcome:
        tree, cost = self.tree, self.incumbent.cost
        route, bound = self._route(), self._bound()
        infeasible = cost is None and not tree.heap
        lp = tree.cutter.lp
        return Outcome(
            route=route,
            bound=None if infeasible else bound,
            stopped=self._reason(),
            infeasible=infeasible,
            details={
                "nodes": len(tree.nodes),
                "rounds": tree.cutter.rounds,
                **({"gave up": "the LP's numbers are too coarse here"} if tree.stuck else {}),
                "simplex_iterations": lp.iterations,
                "rows": len(lp.cuts),
                "columns": len(lp.keys),
                "alive_pairs": None if tree.cutter.alive.keys is None else len(lp.keys),
            },
            evidence=certificate(self.instance, tree, None if infeasible else bound, route),
        )


def first_pairs(problem: Problem, tour: np.ndarray) -> np.ndarray:
    """Columns to begin with: the tour's pairs, the forced ones, and a few nearest neighbours."""
    found = [problem.keys(tour, np.roll(tour, -1)), problem.forced]
    found.append(problem.neighbours if problem.size < 200 else problem.nearest)
    return np.unique(np.concatenate(found))


def unit_of(problem: Problem) -> float:
    """Quanta to the unit of LP costs: the power of two that puts short pairs near 64 units."""
    i, j = problem.pairs(problem.nearest)
    cost = problem.costs(i, j)
    typical = float(cost[cost > 0].mean()) if (cost > 0).any() else 1.0
    return float(2.0 ** round(np.log2(typical / 64.0)))
