"""Statistics that contradict themselves: what a table's own figures rule out."""

from __future__ import annotations

from fractions import Fraction

from tcp.errors import InputError
from tcp.files.claims import Claim
from tcp.files.printed import Printed
from tcp.instance import Instance
from tcp.result import decimal
from tcp.validate.claim import optimality
from tcp.validate.findings import Finding, Severity, finding, worst
from tcp.validate.formula import Figures, number
from tcp.validate.known import Known

_SAMPLES = ("time", "iterations", "solutions", "ratio")
_WHICH = ("least", "average", "most")


def statistics_findings(
    claim: Claim, instance: Instance | None, known: Known | None, figures: Figures
) -> list[Finding]:
    """Findings 303 to 306 and 401 to 410 of one column of a table."""
    found = _negative(claim)
    for sample in _SAMPLES:
        found += _order(claim, sample) + _mean(claim, sample)
    found += _best(claim) + _percentages(claim) + _limit(claim) + _search(claim, figures)
    if worst(found) is not Severity.ERROR:
        found.append(finding("TCP409", "the figures do not contradict each other"))
    return found + (_against(claim, instance, known) if instance is not None else [])


def _negative(claim: Claim) -> list[Finding]:
    names = ["best_time", *(f"{which}_{sample}" for sample in _SAMPLES for which in _WHICH)]
    below = {name: claim.number(name) for name in names}
    return [
        finding("TCP410", f"the {name.replace('_', ' ')} is negative, {printed}")
        for name, printed in below.items()
        if printed is not None and printed.value < 0
    ]


def _order(claim: Claim, sample: str) -> list[Finding]:
    """Least <= average <= most, beyond what rounding could explain."""
    least, average, most = (claim.number(f"{w}_{sample}") for w in _WHICH)
    found = []
    for low, high, code, words in (
        (least, average, "TCP401", ("least", "average")),
        (average, most, "TCP402", ("average", "most")),
        (least, most, "TCP403", ("least", "most")),
    ):
        if low is not None and high is not None and _certainly_above(low, high):
            text = f"the {words[0]} {sample}, {low}, lies above the {words[1]} {sample}, {high}"
            found.append(finding(code, text, low=low.text, high=high.text))
    return found


def _certainly_above(a: Printed, b: Printed) -> bool:
    return a.value - a.unit / 2 >= b.value + b.unit / 2


def _mean(claim: Claim, sample: str) -> list[Finding]:
    """Whether ``runs`` values with this least and most can have this average."""
    least, average, most = (claim.number(f"{w}_{sample}") for w in _WHICH)
    runs = claim.values.get("runs")
    if least is None or average is None or most is None or not runs or average.value > most.value:
        return []
    if least.value > average.value:
        return []
    room = (least.unit + most.unit) / 2 + average.unit / 2
    low = least.value + (most.value - least.value) / runs - room
    high = most.value - (most.value - least.value) / runs + room
    if not low <= average.value <= high:
        text = (
            f"with {runs} runs between {least} and {most} the average {sample} lies between "
            f"{decimal(_cut(low))} and {decimal(_cut(high))}, not at {average}"
        )
        if runs == 1:
            text = f"of 1 run the {sample} cannot be {least}, {average} and {most}"
        return [finding("TCP407", text)]
    if sample in ("iterations", "solutions") and not _whole_mean(average, runs):
        text = f"the average {sample}, {average}, is no mean of {runs} whole numbers"
        return [finding("TCP407", text)]
    return []


def _cut(value: Fraction) -> Fraction:
    return Fraction(round(value * 1000), 1000)


def _whole_mean(average: Printed, runs: int) -> bool:
    """Whether a whole number over ``runs`` can be printed like this."""
    low, high = (average.value - average.unit / 2) * runs, (average.value + average.unit) * runs
    return -(-low.numerator // low.denominator) < high


def _best(claim: Claim) -> list[Finding]:
    best, least = claim.number("best_time"), claim.number("least_time")
    if best is None or least is None or _agree(best, least):
        return []
    text = f"the best time, {best}, is not the least time, {least}"
    return [finding("TCP404", text, best=best.text, least=least.text)]


def _agree(a: Printed, b: Printed) -> bool:
    """Whether two printed figures can stand for the same thing."""
    return a.agreement(b.value).holds or b.agreement(a.value).holds


def _percentages(claim: Claim) -> list[Finding]:
    found, best = [], claim.number("best_time")
    for which in _WHICH:
        error, time = claim.number(f"{which}_error"), claim.number(f"{which}_time")
        if error is None or time is None or best is None or not best.value:
            continue
        exact = (time.value - best.value) / best.value
        room = (time.unit + best.unit * abs(time.value / best.value)) / 2 / abs(best.value)
        if not error.agreement(exact, room).holds:
            text = f"({time} - {best}) / {best} is {float(exact):.4%}, not {error}"
            found.append(finding("TCP405", text, printed=error.text, exact=f"{float(exact):.6%}"))
    return found


def _limit(claim: Claim) -> list[Finding]:
    limit, found = claim.values.get("generations"), []
    for which in _WHICH:
        count = claim.number(f"{which}_iterations")
        if limit is not None and count is not None and count.value > limit:
            text = f"the {which} iteration count, {count}, exceeds the limit of {limit} generations"
            found.append(finding("TCP406", text, count=count.text, limit=limit))
    return found


def _search(claim: Claim, figures: Figures) -> list[Finding]:
    """Solutions searched = iterations x solutions an iteration; search ratio = that / space."""
    found, each = [], claim.values.get("solutions_per_iteration")
    space = claim.values.get("solution_space")
    for which in _WHICH:
        count, solutions, ratio = (
            claim.number(f"{which}_{s}") for s in ("iterations", "solutions", "ratio")
        )
        if each is not None and count is not None and solutions is not None:
            exact = count.value * each
            if not solutions.agreement(exact).holds:
                text = (
                    f"{count} iterations of {each} solutions are {decimal(exact)}, not {solutions}"
                )
                found.append(finding("TCP408", text, exact=decimal(exact)))
        if space is not None and solutions is not None and ratio is not None:
            size = number(space, figures)
            if not size:
                raise InputError("a solution_space of 0 has no share")
            exact = solutions.value / size
            if not ratio.agreement(exact).holds:
                shown = f"{float(exact * 100):.4g}%"
                text = f"the {which} search ratio is {shown}, not {ratio}"
                found.append(finding("TCP408", text, exact=shown))
    return found


def _against(claim: Claim, instance: Instance, known: Known | None) -> list[Finding]:
    best = claim.number("best_time")
    found = [] if best is None else optimality(instance, None, best, known, True)
    for which in _WHICH:
        time = claim.number(f"{which}_time")
        if time is not None and known is not None:
            more = optimality(instance, None, time, known, True)
            found += [f for f in more if f.code == "TCP303"]
    return found
