"""Results for people: a small table for one, one line each for several."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from fractions import Fraction

from tcp.instance import Instance
from tcp.result import Proof, Result, Status, decimal
from tcp.words import counted, plain

WIDTH = 92
SHOWN = 300
"""Longest route that is printed whole."""


def summary(result: Result) -> str:
    """One result as a small table: route, time, bound, gap, proof, solver, seconds."""
    time, bound = result.time, result.lower_bound
    rows = [
        ("route", _route(result)),
        ("time", "none found" if time is None else duration(time, result.instance)),
        ("lower bound", "none" if bound is None else duration(bound, result.instance)),
        ("gap", percent(result.gap)),
        ("proof", proof(result)),
        ("solver", _solver(result)),
        ("panel", str(result.details.get("panel", ""))),
        ("certificate", "" if result.certificate is None else str(result.certificate)),
        ("seconds", f"{result.seconds:.2f}"),
    ]
    rows = [(label, text) for label, text in rows if text]
    width = max(len(label) for label, _ in rows)
    lines = [plain(f"{result.instance.name}: {describe(result.instance)}")]
    for label, text in rows:
        indent = " " * (width + 4)
        start = f"  {label:<{width}}  "
        lines += textwrap.wrap(
            plain(text),
            WIDTH,
            initial_indent=start,
            subsequent_indent=indent,
            break_long_words=False,  # ids and paths stay whole
            break_on_hyphens=False,
        )
    return "\n".join(lines)


def describe(instance: Instance) -> str:
    """Holes, travel and ends of an instance in a few words."""
    n, travel = len(instance), instance.travel
    speeds = "" if travel.vx == travel.vy == 1 else f" (vx {travel.vx}, vy {travel.vy})"
    return f"{counted(n, 'hole')}, {travel.model} travel{speeds}, {describe_ends(instance)}"


def describe_ends(instance: Instance) -> str:
    """The ends in a few words."""
    ends, ids = instance.ends, instance.workpiece.ids
    parts = []
    if ends.closed:
        parts.append("closed")
    if ends.start is not None:
        parts.append(f"from hole {ids[ends.start]}")
    if ends.end is not None:
        parts.append(f"to hole {ids[ends.end]}")
    if ends.home is not None:
        x, y = map(decimal, ends.home)
        legs = {(True, True): "from and back to", (True, False): "from", (False, True): "back to"}
        parts.append(f"{legs[ends.outward, ends.back]} home ({x}, {y})")
    return ", ".join(parts) or "free ends"


def duration(value: Fraction, instance: Instance) -> str:
    """A travel time as people read it; exact where it has at most nine digits."""
    text = decimal(value)
    if "/" in text:
        text = f"{float(value):.9g} (exactly {text})"
    return text


def percent(gap: float | None) -> str:
    """A gap in percent, rounded up: it is what a route may be above the shortest at most."""
    if gap is None:
        return "unknown"
    if gap == 0:
        return "0 %"
    if abs(gap) < 1e-6:
        return "under 0.0001 %"
    digits = 2 if abs(gap) >= 1e-4 else 4
    up = math.ceil(gap * 10 ** (digits + 2) - 1e-6)  # less the double's own error
    return f"{up / 10**digits:.{digits}f} %"


def proof(result: Result) -> str:
    """Status and proof in a few words."""
    if result.status is Status.INFEASIBLE:
        return f"infeasible, {result.proof}"
    if result.proof is Proof.NONE:
        return "none"
    if result.status is not Status.OPTIMAL:
        return f"lower bound {result.proof}, not that the route is shortest"
    return f"optimal, {result.proof}"


def _solver(result: Result) -> str:
    """Solver, how auto came to it, seed and stop reason."""
    _, _, why = str(result.details.get("auto", "")).partition(": ")
    parts = [f"auto: {why}"] if why else []
    return f"{result.solver} ({'; '.join([*parts, f'seed {result.seed}', result.stopped])})"


def _route(result: Result) -> str:
    ids = result.ids
    if ids is None:
        return "none found"
    if len(ids) <= SHOWN:
        return " ".join(ids)
    return f"{' '.join(ids[:20])} ... {' '.join(ids[-20:])} (--out writes all {len(ids)})"


def columns(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Rows under a header, columns aligned; what looks like a number goes to the right."""
    widths = [max(len(str(row[i])) for row in [header, *rows]) for i in range(len(header))]
    right = [
        all(row[i][:1].isdigit() or row[i] in ("-", "") for row in rows) for i in range(len(header))
    ]

    def line(row: Sequence[str]) -> str:
        cells = (
            t.rjust(w) if r else t.ljust(w) for t, w, r in zip(row, widths, right, strict=True)
        )
        return "  ".join(cells).rstrip()

    return "\n".join([line(header), "  ".join("-" * w for w in widths), *map(line, rows)])
