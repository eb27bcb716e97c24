"""One run of the route engine: survey, start, search, kicks, until the clock says stop."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from tcp.errors import InfeasibleError
from tcp.fleet import threads
from tcp.heuristics.local_search import neighbours, starts
from tcp.heuristics.local_search.alpha import alpha_nearest
from tcp.heuristics.local_search.anneal import Join, Search
from tcp.heuristics.local_search.ground import Ground, Small
from tcp.heuristics.local_search.survey import survey
from tcp.heuristics.local_search.warm import warm_up
from tcp.instance import TourForm
from tcp.result import Report, silent
from tcp.stop import Clock, Stop

TINY = 8
"""Below this many nodes every tour is tried."""

PATIENCE = 100
"""Kicks per node after which a search without a limit stops."""

THREADS = 2
"""Most threads that are used unasked."""

WIDTH, WIDE = 6, 7
"""Candidates of a node: few make fast kicks.  On boards of more than :data:`LARGE` nodes there is
hardly time for kicks, and a descent over more of them comes further."""

LARGE = 150_000

FEWER, MANY, CHOOSING = 5, 20_000, 0.15
"""Candidates by alpha-nearness, most nodes for which there are, and the share of the time limit
that choosing them may take."""


def improve(
    form: TourForm,
    tour: Sequence[int] | None,
    *,
    rng: np.random.Generator,
    clock: Clock,
    report: Report = silent,
    kicks: int | None = None,
    workers: int | None = None,
    join: Join | None = None,
) -> list[int]:
    """A short tour over ``form``, never worse than the one given.

    Parameters
    ----------
    form : TourForm
        What is searched; forced edges are in the answer, forbidden ones only
        where the search found no tour without them (:func:`respects` tells).
    tour : sequence of int, optional
        All nodes in any cyclic order, to start from; default: greedy edges.
    rng : Generator
        The source of all randomness.
    clock : Clock
        Polled 25 times a second.
    report : callable
        Receives the cost of each better tour.
    kicks : int, optional
        How many kicks to try; default: until the clock says stop, and without
        any limit ``PATIENCE * size`` of them.
    workers : int, optional
        Threads to use; what is found with a number of kicks does not depend on it.
        Default: two, where this process has so many cores (:func:`tcp.fleet.threads`).
    join : callable, optional
        Joins the best members of a bred population (:func:`tcp.exact.join.join`).

    Returns
    -------
    list of int
        All nodes, once each.

    Raises
    ------
    InfeasibleError
        If the forced edges alone rule every tour out.
    """
    check_forced(form)
    if form.size < TINY:
        return _best_of_all(form)
    with clock.paused():
        warm_up()
    width = WIDTH if form.size <= LARGE else WIDE
    wide = survey(form, width, late=lambda: clock.over)
    if tour is None and form.size > neighbours.CHUNK and clock.over:  # no time for more
        return [int(v) for v in wide.label[starts.curve(wide)]]
    if tour is None:
        order = starts.greedy(wide)
    else:
        order = starts.with_forced(wide, wide.order(np.asarray(tour, np.int64)))
    ground = _by_alpha(wide, order, form, clock)
    search = Search(ground, order, rng, clock, report, join, wide)
    search.descend()
    limit = clock.stop.iterations if kicks is None else kicks
    if limit is None and clock.stop.time is None:
        limit = PATIENCE * form.size
    search.kick(limit, threads(THREADS) if workers is None else workers)
    return [int(v) for v in ground.label[search.best]]


def _by_alpha(ground: Ground, order: Small, form: TourForm, clock: Clock) -> Ground:
    """The ground with better candidates, where they do not take more than a share of the time."""
    if form.real < TINY or form.size > MANY:
        return ground
    limit = clock.stop.time
    part = clock.part(Stop(None if limit is None else CHOOSING * limit))
    return alpha_nearest(ground, order, form.real, FEWER, late=lambda: part.over)


def respects(form: TourForm, tour: Sequence[int]) -> bool:
    """Whether the tour has every forced edge and no forbidden one."""
    if not form.forced and not form.forbidden:
        return True
    used = {(min(p), max(p)) for p in itertools.pairwise([*tour, tour[0]])}
    return used.issuperset(form.forced) and used.isdisjoint(form.forbidden)


def check_forced(form: TourForm) -> None:
    """Raise InfeasibleError if forced edges branch, close a short cycle or are forbidden."""
    if set(form.forced) & set(form.forbidden):
        raise InfeasibleError("two holes must and must not follow each other")
    near: dict[int, list[int]] = {}
    for a, b in form.forced:
        near.setdefault(a, []).append(b)
        near.setdefault(b, []).append(a)
    if form.size > 2 and any(len(partners) > 2 for partners in near.values()):
        raise InfeasibleError("a hole must follow more than two others")
    seen: set[int] = set()
    for first in sorted(near, key=lambda v: len(near[v])):
        chain, node, cyclic = [], first, False
        while node not in seen:
            seen.add(node)
            chain.append(node)
            onward = [w for w in near[node] if w not in seen]
            cyclic = not onward and len(near[node]) == 2
            node = onward[0] if onward else node
        if cyclic and len(chain) > 2 and first in near[chain[-1]] and len(chain) < form.size:
            raise InfeasibleError("holes that must follow each other form a cycle")


def _best_of_all(form: TourForm) -> list[int]:
    """The best of all tours over a handful of nodes, by trying them."""
    tours = ([0, *rest] for rest in itertools.permutations(range(1, form.size)))
    allowed = [tour for tour in tours if respects(form, tour)]
    if not allowed:
        raise InfeasibleError("the rules leave no route")
    return min(allowed, key=form.tour_cost)
