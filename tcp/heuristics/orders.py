"""What the papers' heuristics search: orders of the free holes, priced by one small matrix.

A fixed start, a fixed end, a home position, a closed route: each of them only
says what the first and the last free hole are joined to.  An :class:`Orders`
holds that as one matrix of ``m + 1`` rows, the ``m`` free holes and a *depot*
that stands for whatever comes before the first and after the last of them:
``legs[m, j]`` is the leg into ``j`` as the first hole, ``legs[i, m]`` the leg
out of ``i`` as the last.  For the papers' open path with free ends both are 0.

Rules about pairs become prices: a forbidden succession, and a required one
that is missing, costs :attr:`Orders.penalty`, which is more than any route, so
an order below the penalty keeps every rule.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tcp.instance import Instance
from tcp.jit import lean
from tcp.result import Outcome, Progress, Report
from tcp.stop import Clock, StopReason
from tcp.travel import SAFE, Ints
from tcp.validate.route import faults

LIMIT = 2_000
"""Most holes the permutation heuristics take: their cost matrix and populations are dense."""

TRIVIAL = 3
"""Up to so many free holes every order is looked at: there is nothing to search."""


@dataclass(frozen=True, eq=False)
class Orders:
    """The orders of an instance's free holes and what they cost.

    Parameters
    ----------
    before, after : tuple of int
        Holes that stand first and last by the instance's ends.
    free : tuple of int
        The other holes; an order is a permutation of ``0 .. m-1`` into it.
    legs : int64 array of shape (m + 1, m + 1)
        Costs in quanta between free holes; row and column ``m`` are the depot.
    fixed : int
        What every route costs besides: add it to an order's cost.
    penalty : int
        Price of breaking a rule about a pair; 0 where there are no such rules.
    """

    before: tuple[int, ...]
    after: tuple[int, ...]
    free: tuple[int, ...]
    legs: Ints
    fixed: int
    penalty: int

    def __len__(self) -> int:
        return len(self.free)

    @property
    def open(self) -> bool:
        """Whether both ends are free, as in the papers."""
        m = len(self)
        return (
            not self.before and not self.after and not (self.legs[m].any() or self.legs[:, m].any())
        )

    def route(self, order: Ints) -> tuple[int, ...]:
        """The whole route of an order of the free holes."""
        return (*self.before, *(self.free[int(k)] for k in order), *self.after)

    def allowed(self, cost: int) -> bool:
        """Whether an order of this cost keeps the rules about pairs."""
        return self.penalty == 0 or cost + self.fixed < self.penalty


def refusal(instance: Instance) -> str | None:
    """Why a permutation heuristic cannot take the instance, or None."""
    form = instance.form
    if len(instance) > LIMIT:
        return f"it searches workpieces of up to {LIMIT} holes, this one has {len(instance)}"
    if instance.rules.together or form.forbidden:
        worst = (_highest(instance) * form.size + 1) * (form.size + 1)
        if worst >= SAFE:
            return "its penalties for broken rules would exceed 62-bit integers"
    return None


def orders(instance: Instance) -> Orders:
    """The orders of the instance's free holes."""
    form, ends = instance.form, instance.ends
    full, penalty = _priced(instance)
    before: tuple[int, ...] = ()
    after: tuple[int, ...] = ()
    if ends.closed:
        source = sink = ends.start or 0
        before = (source,)
        fixed = 0
    else:
        start, end = ends.start, ends.end
        source = start if start is not None else form.home if ends.outward else form.virtual
        sink = end if end is not None else form.home if ends.back else form.virtual
        before = () if start is None else (start,)
        after = () if end is None or end == start else (end,)
        fixed = int(full[form.home, start]) if ends.outward and start is not None else 0
        fixed += int(full[end, form.home]) if ends.back and end is not None else 0
    free = tuple(h for h in range(len(instance)) if h not in (*before, *after))
    m = len(free)
    legs = np.zeros((m + 1, m + 1), dtype=np.int64)
    legs[:m, :m] = full[np.ix_(free, free)]
    legs[m, :m], legs[:m, m] = full[source, list(free)], full[list(free), sink]
    return Orders(before, after, free, legs, fixed + penalty * _required(instance), penalty)


def part(instance: Instance, holes: Sequence[int]) -> Orders:
    """The orders of some of the holes as an open sub-path with free ends, rules included."""
    m, index = len(holes), np.array(holes, dtype=np.int64)
    legs = np.zeros((m + 1, m + 1), dtype=np.int64)
    legs[:m, :m] = instance.form.costs(index[:, None], index[None, :])
    place = {hole: k for k, hole in enumerate(holes)}
    inside = [
        {(min(p), max(p)) for p in pairs if p[0] in place and p[1] in place}
        for pairs in (instance.form.forbidden, instance.rules.together)
    ]
    forbidden, together = inside
    penalty = int(legs.max()) * (m + 1) + 1 if forbidden or together else 0
    for price, pairs in ((penalty, forbidden), (-penalty, together - forbidden)):
        for i, j in pairs:
            legs[place[i], place[j]] += price
            legs[place[j], place[i]] += price
    return Orders((), (), tuple(holes), legs, penalty * len(together), penalty)


def _highest(instance: Instance) -> int:
    return int(instance.form.full_matrix().max())


def _required(instance: Instance) -> int:
    return len({(min(p), max(p)) for p in instance.rules.together})


def _priced(instance: Instance) -> tuple[Ints, int]:
    """The tour form's matrix with rules about pairs as prices, and the price."""
    full = instance.form.full_matrix()
    together = {(min(p), max(p)) for p in instance.rules.together}
    if not together and not instance.form.forbidden:
        return full, 0
    penalty = int(full.max()) * len(full) + 1
    forbidden = set(instance.form.forbidden)
    for price, pairs in ((penalty, forbidden), (-penalty, together - forbidden)):
        for i, j in pairs:
            full[i, j] += price
            full[j, i] += price
    return full, penalty


@lean
def length(order: Ints, legs: Ints) -> int:
    """Cost of an order: from the depot through all holes and back to it."""
    m = len(order)
    total = legs[m, order[0]] + legs[order[m - 1], m]
    for k in range(m - 1):
        total += legs[order[k], order[k + 1]]
    return total


@lean
def below(rng: np.random.Generator, n: int) -> int:
    """A random number of 0 .. n-1 (n far below 2^53; compiles and runs faster than integers)."""
    return int(rng.random() * n)


@lean
def shuffle(rng: np.random.Generator, order: Ints) -> None:
    """A uniformly random order, in place (Fisher-Yates)."""
    for k in range(len(order) - 1, 0, -1):
        j = below(rng, k + 1)
        order[k], order[j] = order[j], order[k]


Advance = Callable[[int], tuple[int, int]]
"""``advance(steps)``: up to ``steps`` more iterations, but none beyond an improvement.

Returns how many were made, and the cost of the best order so far.
"""

CHUNK = 0.05
"""Seconds of compiled work between two looks at the clock."""


def search(
    instance: Instance,
    problem: Orders,
    iterations: int,
    clock: Clock,
    report: Report,
    start: int,
    advance: Advance,
) -> tuple[StopReason, int]:
    """Run a compiled search in chunks, so that time limits, Ctrl-C and targets are heard.

    The chunks never change the trajectory: the state lives in ``advance``.

    Parameters
    ----------
    instance, problem : Instance, Orders
        What is solved.
    iterations : int
        The algorithm's own limit (the papers' GN, MaxGeneration, t).
    clock, report
        As in every solver.
    start : int
        Cost of the best of the initial population: iteration 0 of the trace.
    advance : callable
        See :data:`Advance`.

    Returns
    -------
    (StopReason, int)
        Why it stopped, and how many iterations were made.
    """

    def tell(cost: int, iteration: int) -> int | None:
        if not problem.allowed(cost):
            return None
        report(Progress(clock.elapsed, cost + problem.fixed, None, iteration))
        return cost + problem.fixed

    limit = iterations if clock.stop.iterations is None else clock.stop.iterations
    limit = min(limit, iterations)
    best, cost, done, chunk = tell(start, 0), start, 0, 1
    while done < limit:
        reason = clock.reason(best, None, done)
        if reason is not None:
            return reason, done
        began = clock.elapsed
        made, now = advance(min(chunk, limit - done))
        done += made
        if now < cost:
            cost, told = now, tell(now, done)
            best = best if told is None else told
        if made == chunk:  # a first call may compile: never shrink
            fast = clock.elapsed - began < CHUNK / 2
            chunk = min(chunk * 2, 4096) if fast else chunk
    reason = clock.reason(best, None, done)
    return reason or StopReason.COMPLETED, done


def enumerate_all(instance: Instance, problem: Orders) -> Outcome:
    """The best of all orders, for the :data:`TRIVIAL` few free holes that need no search."""
    routes = [
        problem.route(np.array(order, dtype=np.int64))
        for order in itertools.permutations(range(len(problem)))
    ]
    found = [(instance.cost(route), route) for route in routes if not faults(instance, route)]
    details = {"iterations": 0, "evaluations": len(routes)}
    return Outcome(min(found)[1] if found else None, details=details)


def answer(
    problem: Orders, order: Ints, cost: int, stopped: StopReason, **details: object
) -> Outcome:
    """The outcome of a search: its route if that keeps the rules, and how much was searched."""
    route = problem.route(order) if problem.allowed(cost) else None
    return Outcome(route, stopped=stopped, details=details)
