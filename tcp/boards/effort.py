"""How much work goes into one stretch: which solver, for how long, and what came of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Any

from tcp.boards.steady import solve_by_place
from tcp.instance import Instance
from tcp.result import Proof, Report, Result, silent
from tcp.solve import SMALL, refuses, sharpen, solve
from tcp.stop import Clock, Stop, StopReason


class Effort(StrEnum):
    """What the user is willing to wait for."""

    FAST = "fast"
    NORMAL = "normal"
    PROOF = "proof"


LIMITS = {Effort.FAST: 1.0, Effort.NORMAL: 10.0, Effort.PROOF: 600.0}
"""Seconds a tool, where no ``--time-limit`` is given."""

KICKS = 20
"""Kicks of the local search a node with :attr:`Effort.FAST`, about half a millisecond's worth."""

COUNTED = 2_000
"""Most nodes for which these kicks are all that stops it, unless the user limits the time."""

CHECK_LIMIT = 2.0
"""Seconds a tool where a file is only judged."""

PROVER = "branch-and-cut"
SEEKER = "local-search"
AS_IS = "file order"

LARGE = 1_000
"""Nodes from which on the route is sought first: a proof in time is less likely there."""

LATE = 10_000
"""Nodes from which on the proof engine may have no good bound in time."""

SEEK_SHARE = 0.2
"""Share of the time for the route alone above :data:`LARGE`, half as much again above
:data:`LATE`; the proof engine improves it.
"""

SEEK_MOST = 20.0
"""Most seconds for the route alone, however long the proof may take."""

BOUND_SHARE = 0.2
"""Share of the time for Held and Karp's bound, where the proof engine does not run."""

RESERVE = 0.1
"""The same where the engine runs and may be late."""

GOOD = 0.01
"""Gap up to which Held and Karp's bound is not worth its time: it is seldom closer."""


@dataclass(frozen=True)
class Answer:
    """The best order found for a stretch, and what is known about it; costs in quanta."""

    route: tuple[int, ...]
    cost: int
    bound: int | None
    proof: Proof
    seconds: float
    solver: str
    certificate: Path | None = None
    interrupted: bool = False

    @property
    def optimal(self) -> bool:
        """Whether nothing shorter exists."""
        return self.bound is not None and self.bound >= self.cost


def answer(
    instance: Instance,
    as_is: tuple[int, ...],
    effort: Effort,
    limit: float | None,
    seed: int,
    report: Report = silent,
    certificate: Path | None = None,
    source: Path | None = None,
    panels: bool = True,
    whole: Clock | None = None,
) -> Answer:
    """The best route within the effort, never worse than the file's own order.

    Parameters
    ----------
    instance : Instance
        The stretch.
    as_is : tuple of int
        The file's own order.
    effort : Effort
        ``fast`` only seeks; ``normal`` and ``proof`` also bound and prove.
    limit : float or None
        Seconds; None takes the effort's own.
    seed : int
        Source of all randomness.
    report : callable
        Receives the solvers' news.
    certificate : path, optional
        Where to write the proof, if there is one.
    source : path, optional
        The drill file: the certificate of a private one is private, too.
    panels : bool
        Whether to look for copies of one board.
    whole : Clock, optional
        That of the board, which Ctrl-C rings.

    Unless a certificate is asked for, which lists the holes in the file's order,
    the solvers see the same problem however the file lists them.
    """
    seconds = LIMITS[effort] if limit is None else limit
    facade: Callable[..., Result] = solve if certificate is not None else solve_by_place
    work = partial(facade, instance, seed=seed, report=report)
    proof: dict[str, Any] = {"certificate": certificate, "like": (source,) if source else ()}
    best = as_it_stands(instance, as_is)
    if best.optimal and certificate is None:
        return best
    if instance.form.size <= SMALL:
        return _better(best, work("auto", exact=True, **proof))
    proves = effort is not Effort.FAST and refuses(PROVER, instance) is None
    seeking = _seeking(instance.form.size, effort, limit, proves)
    if seeking is not None:
        best = _better(best, work(SEEKER, stop=seeking, panels=panels))
    if proves and not best.interrupted:
        if seeking is not None:
            proof["start_route"] = best.route
        reserve = RESERVE if instance.form.size > LATE else 0.0
        left = Stop(max((1 - reserve) * seconds - best.seconds, 0.1))
        best = _better(best, work(PROVER, stop=left, **proof))
    if best.bound is not None and best.bound >= (1 - GOOD) * best.cost:
        return best
    clock = (whole or Clock(Stop())).part(Stop(max(seconds - best.seconds, RESERVE * seconds)))
    return _bounded(instance, best, clock)


def _seeking(size: int, effort: Effort, limit: float | None, proves: bool) -> Stop | None:
    """When the local search stops that comes before anything else; None where it is left out."""
    seconds = LIMITS[effort] if limit is None else limit
    if effort is Effort.FAST:
        counted = limit is None and size <= COUNTED
        return Stop(None if counted else (1 - BOUND_SHARE) * seconds, KICKS * size)
    if not proves:
        return Stop((1 - BOUND_SHARE) * seconds)
    share = 1.5 * SEEK_SHARE if size > LATE else SEEK_SHARE
    return Stop(min(share * seconds, SEEK_MOST)) if size > LARGE else None


def _bounded(instance: Instance, best: Answer, clock: Clock) -> Answer:
    """With Held and Karp's bound, where it is the better one."""
    from tcp.bounds.one_tree import one_tree_bound  # loads numba

    if best.interrupted:
        return best
    value = sharpen(instance, one_tree_bound(instance, clock=clock).value) or 0
    bound = max(best.bound or 0, min(value, best.cost))
    proof = Proof.TRUSTED if bound >= best.cost else Proof.NONE
    return replace(best, bound=bound, proof=proof, seconds=best.seconds + clock.elapsed)


def as_it_stands(instance: Instance, route: tuple[int, ...]) -> Answer:
    """The file's own order; one or two holes are optimal in any."""
    cost = instance.cost(route)
    bound = cost if len(route) <= 2 or cost == 0 else None
    proof = Proof.TRUSTED if bound is not None else Proof.NONE
    return Answer(route, cost, bound, proof, 0.0, AS_IS)


def _better(best: Answer, found: Result) -> Answer:
    """The shorter of two routes with the larger of two bounds."""
    bounds = [b for b in (best.bound, found.bound) if b is not None]
    bound = max(bounds) if bounds else None
    seconds = best.seconds + found.seconds
    stopped = found.stopped is StopReason.INTERRUPTED
    shorter = found.route is not None and found.cost is not None and found.cost < best.cost
    if shorter:
        assert found.route is not None and found.cost is not None
        best = replace(best, route=found.route, cost=found.cost, solver=found.solver)
    closed = bound is not None and bound >= best.cost
    return replace(
        best,
        bound=bound,
        proof=_proof(closed, found),
        seconds=seconds,
        certificate=found.certificate if closed else None,
        interrupted=best.interrupted or stopped,
    )


def _proof(closed: bool, found: Result) -> Proof:
    if not closed:
        return Proof.NONE
    return found.proof if found.proof is Proof.CERTIFIED else Proof.TRUSTED
