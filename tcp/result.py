"""What a solver claims, and what the facade makes of it once it has been checked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from fractions import Fraction
from pathlib import Path
from typing import Any

from tcp.instance import Instance
from tcp.stop import StopReason


class Status(StrEnum):
    """What is known about the instance."""

    OPTIMAL = "optimal"
    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"
    UNKNOWN = "unknown"


class Proof(StrEnum):
    """How far that knowledge can be trusted.

    ``trusted``: a solver says so.  ``certified``: a certificate was written
    and passed the independent checker in this run.
    """

    NONE = "none"
    TRUSTED = "trusted"
    CERTIFIED = "certified"


@dataclass(frozen=True)
class Progress:
    """One line of news from a running solver; costs in quanta."""

    seconds: float
    cost: int | None = None
    bound: int | None = None
    iteration: int = 0
    note: str = ""


Report = Callable[[Progress], None]
"""Callbacks observe only: nothing they do changes the search."""


def silent(_: Progress) -> None:
    """The report that drops all news."""


@dataclass(frozen=True)
class Outcome:
    """What a solver returns; the facade checks it before anybody sees it.

    Parameters
    ----------
    route : tuple of int or None
        Holes in drilling order, None if none was found.
    bound : int or None
        A lower bound on every route's cost in quanta that the solver proves.
    stopped : StopReason
        Why it came back.
    infeasible : bool
        Whether the solver proves that no route exists.
    solver : str
        What really ran, where the solver chose among several.
    details : mapping
        Plain data for the curious: nodes, cuts, parameters, evidence.
    evidence : object
        A certificate in memory, where the solver makes one.
    """

    route: tuple[int, ...] | None
    bound: int | None = None
    stopped: StopReason = StopReason.COMPLETED
    infeasible: bool = False
    solver: str = ""
    details: Mapping[str, Any] = field(default_factory=dict)
    evidence: Any = field(default=None, repr=False)


@dataclass(frozen=True, eq=False)
class Result:
    """A checked answer.

    Parameters
    ----------
    instance : Instance
        The problem.
    route : tuple of int or None
        Holes in drilling order, by position in the workpiece.
    cost, bound : int or None
        Cost of the route, recomputed, and lower bound, in quanta.
    status, proof, stopped
        What is known, how well, and why the solver came back.
    solver, seed, seconds, versions, details
        How the answer came about.
    trace : tuple of Progress
        The improvements in the order they came.
    certificate : path or None
        The file that proves the answer.
    """

    instance: Instance
    route: tuple[int, ...] | None
    cost: int | None
    bound: int | None
    status: Status
    proof: Proof
    stopped: StopReason
    solver: str
    seed: int
    seconds: float
    versions: Mapping[str, str] = field(default_factory=dict)
    details: Mapping[str, Any] = field(default_factory=dict)
    trace: tuple[Progress, ...] = ()
    certificate: Path | None = None

    @property
    def time(self) -> Fraction | None:
        """Travel time of the route, exactly (seconds; mm at unit speed)."""
        return None if self.cost is None else self.cost * self.instance.quantum

    @property
    def lower_bound(self) -> Fraction | None:
        """The bound in the unit of :attr:`time`."""
        return None if self.bound is None else self.bound * self.instance.quantum

    @property
    def gap(self) -> float | None:
        """(cost - bound) / cost, 0 for equal; None where either is missing."""
        if self.cost is None or self.bound is None:
            return None
        return 0.0 if self.cost == self.bound else (self.cost - self.bound) / self.cost

    @property
    def ids(self) -> tuple[str, ...] | None:
        """The route as hole ids."""
        ids = self.instance.workpiece.ids
        return None if self.route is None else tuple(ids[i] for i in self.route)


def decimal(value: Fraction) -> str:
    """A fraction as an exact decimal string, or as ``p/q`` where it has no finite decimals."""
    twos, fives, rest = 0, 0, value.denominator
    while rest % 2 == 0:
        rest, twos = rest // 2, twos + 1
    while rest % 5 == 0:
        rest, fives = rest // 5, fives + 1
    if rest != 1:
        return str(value)
    places = max(twos, fives)
    digits = str(abs(value.numerator) * 10**places // value.denominator).rjust(places + 1, "0")
    sign = "-" if value < 0 else ""
    return sign + (f"{digits[:-places]}.{digits[-places:]}" if places else digits)
