"""One sequence with one claimed time: everything the judge can say about it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcp.files.order import Order, order_of
from tcp.files.printed import Agreement, Printed, parse_printed
from tcp.instance import Instance
from tcp.result import decimal
from tcp.validate.findings import Finding, Location, Severity, finding, worst
from tcp.validate.known import Known
from tcp.validate.readings import fine, readings, slack, swaps
from tcp.validate.sequence import Count, count, sequence_findings, walk

Ints = NDArray[np.int64]

NAMED = 12
"""So many swaps or readings are named; the rest is counted."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """What is true of a route claim.

    Parameters
    ----------
    instance : Instance
        The problem.
    order : Order
        The sequence as read.
    count : Count
        Which holes it drills how often.
    cost : int or None
        Recomputed cost in quanta; for a sequence that is no route, of walking
        it as written.  None if an entry is no hole.
    findings : tuple of Finding
        Reasons, heaviest first as they were found.
    """

    instance: Instance
    order: Order
    count: Count
    cost: int | None
    findings: tuple[Finding, ...]

    @property
    def valid(self) -> bool:
        """Whether the sequence is a route of the instance."""
        return not any(f.code in _BREAKING for f in self.findings)

    @property
    def time(self) -> Fraction | None:
        """The recomputed time."""
        return None if self.cost is None else self.cost * self.instance.quantum

    @property
    def holds(self) -> bool:
        """Whether no finding is an error."""
        return worst(self.findings) is not Severity.ERROR

    def codes(self) -> list[str]:
        """The codes of all findings, in order."""
        return [f.code for f in self.findings]


_BREAKING = {"TCP101", "TCP102", "TCP103", "TCP104", "TCP105", "TCP106"}


def validate(
    instance: Instance,
    route: str | Iterable[str | int] | Ints | Order,
    *,
    claimed: str | int | Printed | None = None,
    known: Known | None = None,
    optimal: bool = False,
    numbering: str = "ids",
    location: Location | None = None,
) -> Verdict:
    """Say, with reasons, what is true of a route and its claimed time.

    Parameters
    ----------
    instance : Instance
        Workpiece, travel model, ends and rules.
    route : str, iterable of labels, int64 array, or Order
        The sequence; text may use separators of any kind.
    claimed : str, int or Printed, optional
        The claimed time, with the digits as printed.
    known : Known, optional
        The certified bound or optimum of the instance.
    optimal : bool
        Whether the claim calls the route optimal: then a faster certified
        route is a warning, else a note.
    numbering : str
        ``ids``, or ``0`` or ``1`` for numbers counted from there.
    location : Location, optional
        Where the claim stands.

    Returns
    -------
    Verdict
        Recomputed time and findings.

    Raises
    ------
    InputError
        If route or claimed time cannot be read at all.

    Examples
    --------
    >>> from tcp import Instance, Workpiece
    >>> piece = Workpiece.from_decimals("three", [("0", "0"), ("1", "0"), ("2", "0")])
    >>> verdict = validate(Instance(piece), "1 2 2", claimed="7")
    >>> for finding in verdict.findings:
    ...     print(finding.code, finding.message)
    TCP101 hole 2 is drilled more than once: at places 2 and 3
    TCP102 hole 3 is never drilled
    TCP201 claimed 7, but the sequence, walked as written, takes 1 (+6)
    TCP304 no certificate bounds three with these moves and ends
    """
    order = order_of(route, instance.workpiece, numbering)
    printed = claimed if claimed is None or isinstance(claimed, Printed) else parse_printed(claimed)
    seen = count(order, len(instance))
    cost = None if order.unknown else walk(instance, order.entries)
    found = sequence_findings(instance, order, seen)
    valid = not any(f.code in _BREAKING for f in found)
    if printed is not None and cost is not None:
        found += _time_findings(instance, order, cost, printed, valid)
    if not valid and any(f.code == "TCP105" for f in found):
        found += _reversed(instance, order)
    found += optimality(instance, cost if valid else None, printed, known, optimal)
    place = location or Location(path=order.path)
    return Verdict(instance, order, seen, cost, tuple(_placed(f, place, order) for f in found))


def _placed(found: Finding, place: Location, order: Order) -> Finding:
    """The finding at its place; in a route file that is the line of the entry."""
    positions = found.location.positions
    line = order.line(positions[-1]) if positions else None
    if line is None:
        return found.at(place)
    return found.at(Location(order.path, line, place.claim))


def _time_findings(
    instance: Instance, order: Order, cost: int, claimed: Printed, valid: bool
) -> list[Finding]:
    time = cost * instance.quantum
    finer, off = fine(instance, len(order))
    exact = time if finer is instance else walk(finer, order.entries) * finer.quantum
    agreement = claimed.agreement(exact, off)
    figures: dict[str, Any] = {"claimed": claimed.text, "recomputed": decimal(time)}
    if agreement.holds:
        return [_agreed(agreement, claimed, time, valid, figures)]
    difference = claimed.value - time
    as_walked = "" if valid else ", walked as written,"
    sign = "+" if difference > 0 else ""
    found = [
        finding(
            "TCP201",
            f"claimed {claimed}, but the sequence{as_walked} takes {decimal(time)} "
            f"({sign}{decimal(difference)})",
            **figures,
            difference=decimal(difference),
        )
    ]
    found += [
        finding(
            "TCP204",
            f"the claim {_verb(reading.agreement)} {decimal(reading.time)}: {reading.name}",
            reading=reading.name,
            time=decimal(reading.time),
        )
        for reading in readings(instance, order.entries, claimed)[:NAMED]
    ]
    return found + (_swap_findings(instance, order, claimed) if valid else [])


def _agreed(
    agreement: Agreement, claimed: Printed, time: Fraction, valid: bool, figures: dict[str, Any]
) -> Finding:
    what = "the recomputed time" if valid else "the time of walking the sequence as written"
    if agreement is Agreement.EXACT:
        return finding("TCP206", f"claimed {claimed} is {what}", **figures)
    if agreement is Agreement.ROUNDED:
        return finding(
            "TCP202", f"claimed {claimed} is {what}, {decimal(time)}, rounded", **figures
        )
    return finding(
        "TCP203",
        f"claimed {claimed} is {what}, {decimal(time)}, cut off after the digits printed "
        "(rounding half up gives one unit more)",
        **figures,
    )


def _verb(agreement: Agreement) -> str:
    return {"exact": "equals", "rounded": "is the rounding of", "cut off": "is the cut-off of"}[
        agreement
    ]


def _swap_findings(instance: Instance, order: Order, claimed: Printed) -> list[Finding]:
    pairs = swaps(instance, order.entries, claimed)
    ids, entries = instance.workpiece.ids, order.entries
    found = [
        finding(
            "TCP205",
            f"with holes {ids[entries[i - 1]]} and {ids[entries[j - 1]]} (places {i} and {j}) "
            "swapped the claim comes true",
            positions=(i, j),
            pair=[i, j],
        )
        for i, j in pairs[:NAMED]
    ]
    if len(pairs) > NAMED:
        more = f"{len(pairs) - NAMED} more swaps make the claim come true"
        found.append(finding("TCP205", more, pairs=[list(p) for p in pairs[NAMED:1000]]))
    return found


def _reversed(instance: Instance, order: Order) -> list[Finding]:
    ends, entries = instance.ends, order.entries
    start_fits = ends.start is None or entries[-1] == ends.start
    end_fits = ends.end is None or entries[0] == ends.end
    if not (start_fits and end_fits):
        return []
    return [finding("TCP204", "reversed, the sequence has the ends asked for", reading="reversed")]


def optimality(
    instance: Instance,
    cost: int | None,
    claimed: Printed | None,
    known: Known | None,
    optimal: bool,
) -> list[Finding]:
    """Findings 301 to 306: a route's cost and a claimed time against what is certified."""
    if known is None:
        text = f"no certificate bounds {instance.name} with these moves and ends"
        return [finding("TCP304", text, sha256=instance.sha256)]
    lower, _ = known.times(instance)
    found = []
    highest = (
        None if claimed is None else claimed.value + claimed.unit + slack(instance, len(instance))
    )
    if claimed is not None and highest is not None and highest <= lower:
        what = "optimum" if known.optimal else "lower bound"
        found.append(
            finding(
                "TCP303",
                f"claimed {claimed} is impossible for any sequence: the {known.word} {what} is "
                f"{decimal(lower)}",
                claimed=claimed.text,
                bound=decimal(lower),
                source=known.source,
            )
        )
    if cost is not None:
        return [*found, _against(instance, cost, known, optimal)]
    if claimed is not None and known.optimal and claimed.agreement(lower).holds:
        text = f"claimed {claimed} is the {known.word} optimum {decimal(lower)}"
        found.append(finding("TCP306", text, optimum=decimal(lower)))
    return found


def _against(instance: Instance, cost: int, known: Known, optimal: bool) -> Finding:
    if cost < known.lower and not known.certified:
        lower, _ = known.times(instance)
        what = "optimum" if known.optimal else "lower bound"
        took = decimal(cost * instance.quantum)
        return finding(
            "TCP307",
            f"the stated {what} {decimal(lower)} is wrong: this valid route takes {took}",
            time=took,
            bound=decimal(lower),
        )
    if cost < known.lower:
        raise RuntimeError(
            f"the certificate {known.source} bounds {instance.name} by {known.lower} quanta, but a "
            f"valid route costs {cost}: the certificate or the judge is wrong"
        )
    lower, upper = known.times(instance)
    time = cost * instance.quantum
    if cost == known.lower:
        return finding(
            "TCP301",
            f"{decimal(time)} is optimal: the {known.word} optimum",
            optimum=decimal(lower),
        )
    above = float((time - lower) / lower * 100) if lower else None
    if upper is not None and time > upper:
        what = "optimum" if known.optimal else "best known route"
        base = lower if known.optimal else upper
        percent = float((time - base) / base * 100) if base else None
        return finding(
            "TCP302",
            f"valid, but {decimal(time)} is {_percent(percent)}above the {known.word} {what} "
            f"{decimal(base)}",
            severity=Severity.WARNING if optimal else Severity.NOTE,
            time=decimal(time),
            optimum=decimal(base),
            percent=None if percent is None else round(percent, 6),
        )
    return finding(
        "TCP305",
        f"valid, {_percent(above)}above the {known.word} lower bound {decimal(lower)}",
        time=decimal(time),
        bound=decimal(lower),
        percent=None if above is None else round(above, 6),
    )


def _percent(value: float | None) -> str:
    """The words before "above"; nothing above a bound of 0, of which there is no share."""
    return "" if value is None else f"{value:.3f} % "
