"""An audit as plain text: a verdict table, then a page per claim."""

from __future__ import annotations

from collections import Counter

from tcp.result import decimal
from tcp.validate.auditing import Audit, Entry
from tcp.validate.repairs import MOST, Repair, Repairs
from tcp.words import plain

REPAIRS_SHOWN = 10
"""So many smallest repairs are shown; JSON has them all."""

_HEAD = ("verdict", "claim", "claimed", "recomputed", "certified", "codes")
QUIET = {"TCP206", "TCP304", "TCP409", "TCP505", "TCP607", "TCP609", "TCP703"}
"""Codes that confirm or say nothing: not named in the verdict table."""


def row(entry: Entry) -> tuple[str, ...]:
    """The line of a claim in the verdict table."""
    facts = entry.facts
    certified = facts.get("Certified optimum", facts.get("Stated optimum", ""))
    if not certified and "Certified lower bound" in facts:
        certified = f">= {facts['Certified lower bound']}"
    codes = list(dict.fromkeys(f.code for f in entry.findings if f.code not in QUIET))
    return (
        entry.verdict,
        entry.key,
        facts.get("Claimed", ""),
        facts.get("Recomputed", ""),
        certified,
        " ".join(codes),
    )


def summary(audit: Audit) -> str:
    """How many claims hold, in one sentence."""
    count = Counter(entry.verdict for entry in audit.entries)
    parts = [f"{count[v]} {v}" for v in ("refuted", "doubtful", "holds") if count[v]]
    number = len(audit.entries)
    return f"{number} claim{'s' * (number != 1)}: {', '.join(parts) or 'nothing to judge'}"


def text_page(audit: Audit, details: str) -> str:
    """The whole audit as text."""
    parts = [] if len(audit.entries) == 1 and not audit.sources else [_table(audit)]
    parts += [
        _detail(entry)
        for entry in audit.entries
        if details == "all" or (details == "failing" and entry.verdict != "holds")
    ]
    return "\n\n".join([*parts, summary(audit)]) + "\n"


def _table(audit: Audit) -> str:
    rows = [_HEAD, *(tuple(plain(c) for c in row(e)) for e in audit.entries)]
    widths = [max(len(r[k]) for r in rows) for k in range(len(_HEAD))]
    lines = ["  ".join(c.ljust(w) for c, w in zip(r, widths, strict=True)).rstrip() for r in rows]
    return "\n".join([lines[0], "-" * max(map(len, lines)), *lines[1:]])


def _detail(entry: Entry) -> str:
    lines = [f"{entry.key}: {entry.verdict}"]
    if entry.title:
        lines.append(f"  {entry.title}")
    lines += [f"  {label}: {shown}" for label, shown in entry.facts.items()]
    for found in entry.findings:
        where = f"{found.location.path}:{found.location.line}: " if found.location.line else ""
        lines.append(f"  {where}{found.code} {found.severity}: {found.message}")
    if entry.repairs is not None:
        lines += [f"  {line}" for line in repair_lines(entry.repairs)]
    return "\n".join(plain(line) for line in lines)


def repair_lines(repairs: Repairs) -> list[str]:
    """What mends a sequence, in lines."""
    ways = "way" if repairs.total == 1 else "ways"
    changed = "1 change" if repairs.changes == 1 else f"{repairs.changes} changes"
    total = str(repairs.total) if repairs.total < 10**9 else f"{float(repairs.total):.3g}"
    total += " or more" if repairs.total == MOST else ""
    listed = "only the first were" if repairs.smallest else "none is"
    looked = "" if repairs.complete else f", of which {listed} listed"
    lines = [f"smallest repairs: {total} {ways} with {changed}{looked}"]
    lines += [f"  {_described(repairs, one)}" for one in repairs.smallest[:REPAIRS_SHOWN]]
    if len(repairs.smallest) > REPAIRS_SHOWN:
        lines.append(f"  and {len(repairs.smallest) - REPAIRS_SHOWN} more")
    if repairs.refusal is not None:
        return [*lines, f"cheapest route that keeps the rest of the order: {repairs.refusal}"]
    if repairs.best is None:
        return [*lines, "no route keeps the rest of the order within the ends and rules"]
    ids = repairs.instance.workpiece.ids
    return [
        *lines,
        "cheapest route that keeps the rest of the order (exact, dynamic programme):",
        f"  {_described(repairs, repairs.best)}",
        f"  {' '.join(ids[h] for h in repairs.best.route[:200])}",
    ]


def _described(repairs: Repairs, one: Repair) -> str:
    above = repairs.above(one)
    gap = "" if above is None else f", {above:.3f} % above the certified bound"
    return f"{decimal(repairs.time(one))}{gap}: {'; '.join(one.edits) or 'as it is'}"
