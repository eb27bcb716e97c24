"""Findings: what the judge says, like a linter, each with a stable code.

``tcp explain CODE`` prints the page of a code; the pages are in
:mod:`tcp.validate.codes`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any

from tcp.validate.codes import CODES


class Severity(StrEnum):
    """How much a finding weighs: errors fail a run, warnings fail a strict one."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True)
class Location:
    """Where a finding is.

    Parameters
    ----------
    path : str, optional
        The file, as the user named it.
    line : int, optional
        The line in it, from 1.
    claim : str, optional
        Key of the claim.
    positions : tuple of int
        Places in the sequence, from 1.
    """

    path: str | None = None
    line: int | None = None
    claim: str | None = None
    positions: tuple[int, ...] = ()

    def __str__(self) -> str:
        where = self.path or ""
        if self.path and self.line is not None:
            where += f":{self.line}"
        if self.claim:
            where += f" [{self.claim}]" if where else f"[{self.claim}]"
        return where


@dataclass(frozen=True)
class Finding:
    """One statement of the judge.

    Parameters
    ----------
    code : str
        A key of :data:`tcp.validate.codes.CODES`.
    message : str
        What was found, in one sentence.
    location : Location
        Where.
    severity : Severity
        The code's own, unless the circumstances say otherwise.
    data : mapping
        The figures of the message, for programs.
    """

    code: str
    message: str
    location: Location = Location()
    severity: Severity = Severity.NOTE
    data: Mapping[str, Any] = field(default_factory=dict)

    def at(self, location: Location) -> Finding:
        """The same finding at a place, keeping its positions in the sequence."""
        return replace(self, location=replace(location, positions=self.location.positions))


def finding(
    code: str,
    message: str,
    *,
    positions: Iterable[int] = (),
    severity: Severity | None = None,
    **data: Any,
) -> Finding:
    """A finding with its code's severity, or another where the circumstances say so."""
    weight = Severity(CODES[code].severity) if severity is None else severity
    return Finding(code, message, Location(positions=tuple(positions)), weight, data)


def worst(findings: Iterable[Finding]) -> Severity | None:
    """The heaviest severity among ``findings``; None without any."""
    found = {f.severity for f in findings}
    return next((s for s in Severity if s in found), None)
