"""What is certified about a problem, as data: a lower bound, and perhaps the optimum."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

from tcp.instance import Instance


@dataclass(frozen=True)
class Known:
    """Certified knowledge about an instance.

    Parameters
    ----------
    lower : int
        No route costs less, in quanta.
    upper : int or None
        A route of this cost is known, in quanta.
    source : str
        Where the certificate is.
    route : tuple of int or None
        Holes of that route, by position in the workpiece.
    certified : bool
        Whether a certificate was checked, or somebody merely states it.
    """

    lower: int
    upper: int | None = None
    source: str = ""
    route: tuple[int, ...] | None = None
    certified: bool = True

    @property
    def optimal(self) -> bool:
        """Whether lower bound and known route meet."""
        return self.lower == self.upper

    @property
    def word(self) -> str:
        """How to speak of it: certified, or stated."""
        return "certified" if self.certified else "stated"

    def times(self, instance: Instance) -> tuple[Fraction, Fraction | None]:
        """Lower and upper bound in the unit of the instance's times."""
        upper = None if self.upper is None else self.upper * instance.quantum
        return self.lower * instance.quantum, upper


class Knowledge(Protocol):
    """Where certified bounds come from: a folder of certificates, or plain data."""

    def known(self, instance: Instance) -> Known | None:
        """What is certified about ``instance``; None if nothing is."""


@dataclass(frozen=True)
class Table:
    """Knowledge as a mapping from instance hashes."""

    entries: Mapping[str, Known]

    def known(self, instance: Instance) -> Known | None:
        """The entry under the instance's hash."""
        return self.entries.get(instance.sha256)


NOTHING = Table({})
"""Knows nothing."""
