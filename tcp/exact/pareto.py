"""The exact Pareto front of travel time against unbalanced windows (BMGA's two objectives).

For every limit on the penalty, from none down, one exact solve of the position
model finds the least travel under the limit and, among equals, the least
penalty; the next limit is one below it.  The last solve proves that nothing
has less penalty, so the front is complete.  The minimum of any weighted sum
``travel + weight * penalty`` is on it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from tcp.errors import ProofError, UsageError
from tcp.exact.positions import Search, refusal
from tcp.instance import Instance
from tcp.result import silent
from tcp.stop import Clock, Stop


@dataclass(frozen=True)
class Point:
    """A route that nothing beats in both objectives.

    Parameters
    ----------
    cost : int
        Travel in quanta.
    penalty : int
        Unbalanced windows.
    route : tuple of int
        Holes in drilling order.
    """

    cost: int
    penalty: int
    route: tuple[int, ...]


def front(
    instance: Instance,
    *,
    clock: Clock | None = None,
    told: Callable[[Point], None] = lambda point: None,
    seed: int = 0,
) -> tuple[Point, ...]:
    """Every point of the Pareto front, by rising travel, each proved.

    Parameters
    ----------
    instance : Instance
        With a balance rule; its ``most``, if any, caps the penalty.
    clock
        As in every solver.
    told : callable
        Receives each point as soon as it is proved.
    seed : int
        Of CP-SAT.

    Raises
    ------
    UsageError
        Without a balance rule, or for an instance the position model cannot take.
    ProofError
        If the clock stops before the front is complete.
    """
    rule = instance.rules.balance
    if rule is None:
        raise UsageError("a Pareto front needs a balance rule: there is one objective")
    windows = max(0, len(instance) - rule.window)
    why = refusal(instance, windows + 1, 1)
    if why or len(instance) == 1:
        raise UsageError(f"no Pareto front of {instance.name}: {why or 'one hole has no moves'}")
    clock = clock or Clock(Stop())
    points: list[Point] = []
    most = windows if rule.most is None else min(rule.most, windows)
    while most >= 0:
        route = _least(_limited(instance, most), windows, clock, seed)
        if route is None:
            break
        points.append(Point(instance.cost(route), instance.penalty(route), route))
        told(points[-1])
        most = points[-1].penalty - 1
    return tuple(points)


def weighted(points: Sequence[Point], weight: int) -> Point:
    """The proved minimum of ``cost + weight * penalty``, weight in quanta a window, >= 0."""
    if weight < 0:
        raise UsageError(f"the weight of a window must be 0 or more, not {weight}")
    return min(points, key=lambda p: (p.cost + weight * p.penalty, p.cost))


def _limited(instance: Instance, most: int) -> Instance:
    rules = instance.rules
    assert rules.balance is not None
    return replace(instance, rules=replace(rules, balance=replace(rules.balance, most=most)))


def _least(instance: Instance, windows: int, clock: Clock, seed: int) -> tuple[int, ...] | None:
    """The route of least travel and, among those, least penalty; None if there is none."""
    search = Search(instance, clock, silent, scale=windows + 1, weight=1)
    outcome = search.run(seed, 1, 2)
    if outcome.infeasible:
        return None
    if outcome.route is None or outcome.bound != search.cost:
        raise ProofError(f"the Pareto front is not complete: {outcome.stopped}")
    return outcome.route
