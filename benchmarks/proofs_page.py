"""docs/proofs.md from the records of benchmarks/proofs.py."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Record = dict[str, Any]

HEAD = """\
# Proved optima

Written by `python benchmarks/proofs.py`; raw results in `benchmarks/results/proofs.jsonl`. Each
line is a certificate that the independent checker (`tcp check`) verified in the same run. Seconds
are CPU seconds, both threads together, on a two-core machine, from the holes to the checked
certificate, start route included; limits, and seconds beside a gap, are by the clock. One run each,
but WP1 to WP3. Memory is the peak of the proof's own process, libraries included.
"""

CLOSED = """\
## Closed tours, Euclidean distances rounded as TSPLIB does

Concorde's seconds and nodes are those published in 1999, on a machine of that time.

| instance | published optimum | proved here | seconds | nodes | MiB | check | certificate \
| Concorde's seconds | nodes |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|"""

OPEN = """\
## Open paths, free ends

The shortest drilling order itself, for both axes one after the other (Manhattan), both at once
(Chebyshev) and the Euclidean distance rounded to whole units. Published nowhere else to our
knowledge. In brackets: CPU seconds and nodes of the tree. Costs are in quanta of the travel model
(the file's unit, or its last decimal place).

| instance | Manhattan | Chebyshev | Euclidean |
|---|---:|---:|---:|"""

MADE = """\
## Generated instances, open paths

Uniform, clustered and lattice holes of `benchmarks/generated.py`, for the gaps in
[routers.md](routers.md).

| instance | Manhattan | Chebyshev | Euclidean |
|---|---:|---:|---:|"""

BOARDS = """\
## Real boards, every tool, both axes at once

| holes of the tool | tools | proved | largest gap | median seconds | most seconds | most MiB |
|---|---:|---:|---:|---:|---:|---:|"""


def gap(record: Record) -> float:
    """Per cent of the cost between bound and route; 100 where there is no result."""
    if record.get("error") or record["bound"] is None:
        return 100.0
    return 100 * (record["cost"] - record["bound"]) / record["cost"] if record["cost"] else 0.0


def outcome(record: Record | None) -> str:
    """A cell of the open-path table."""
    if record is None:
        return "–"
    if "error" in record:
        return record["error"]
    if record["optimal"]:
        return f"{record['cost']} ({record['cpu_seconds']:.3g} s, {record['nodes']})"
    found, took = f"{record['bound']} … {record['cost']}", record["seconds"]
    return f"{found} ({gap(record):.2g} % at {took:.0f} s)"


def page(
    records: list[Record],
    known: dict[str, dict[str, str]],
    note: str = "",
    missing: list[str] | None = None,
) -> str:
    """The whole page, with a sentence about the machine and the proofs that were not run."""
    sections = ("papers", "closed", "open", "made", "boards")
    by = {name: [r for r in records if r["section"] == name] for name in sections}
    parts = [HEAD, *([note, ""] if note else [])]
    if records:
        parts += ["## What the project set itself", "", *targets(by, known), ""]
        parts += [f"Not run: {', '.join(missing)}.", ""] if missing else []
    if by["papers"]:
        parts += [*papers(by["papers"]), ""]
    if by["closed"]:
        parts += [CLOSED, *closed(by["closed"], known), "", *other_costs(by["closed"], known)]
    if by["open"]:
        parts += [OPEN, *paths(by["open"]), ""]
    if by["made"]:
        parts += [MADE, *paths(by["made"]), ""]
    if by["boards"]:
        parts += [BOARDS, *boards(by["boards"]), "", *unproved(by["boards"]), ""]
    return "\n".join(parts).rstrip() + "\n"


def other_costs(records: list[Record], known: dict[str, dict[str, str]]) -> list[str]:
    """Why a proved optimum may differ from the published one."""
    lines = []
    for r in records:
        pairs = known.get(r["name"], {}).get("rounded otherwise")
        if pairs:
            lines += [
                f"{r['name']}: {pairs} pairs are exactly a half more than a whole apart by their",
                "decimals; doubles put these just below and round them down, exact arithmetic",
                "rounds them up. The published optimum is one of those other costs.",
                "",
            ]
    return lines


def targets(by: dict[str, list[Record]], known: dict[str, dict[str, str]]) -> list[str]:
    """How many of the proofs asked for there are."""
    lines = ["| target | reached | of |", "|---|---:|---:|"]

    def add(text: str, chosen: list[Record], good: Callable[[Record], bool]) -> None:
        if chosen:
            lines.append(f"| {text} | {sum(map(good, chosen))} | {len(chosen)} |")

    def within(seconds: float) -> Callable[[Record], bool]:
        return lambda r: bool(r["optimal"]) and r["seconds"] <= seconds

    add("WP1–WP3, checked, within 0.5 s in the median", by["papers"], within(0.5))
    ten = [r for r in by["papers"] if r.get("cp_sat")]
    add("WP3 ten times faster than CP-SAT's best", ten, lambda r: ratio(r) >= 10)
    for section, what in (("closed", "closed tours"), ("open", "open paths")):
        for low, high, limit in ((0, 500, 60), (500, 700, 180), (700, 1_000, 900)):
            chosen = [r for r in by[section] if low < r["holes"] <= high]
            add(f"{what} up to {high} nodes within {limit} s", chosen, within(limit))
    other = [r for r in by["closed"] if r["optimal"] and r["name"] in known]
    same = lambda r: str(r["cost"]) == known[r["name"]]["optimum"]  # noqa: E731
    add("proved closed tours equal to the published optimum", other, same)
    both = by["closed"] + by["open"]
    middle = [r for r in both if r["name"] in ("pcb1173", "d1291")]
    given = sorted({r["limit"] / 60 for r in middle}) or [60]
    limits = f"limits of {given[0]:.0f} to {given[-1]:.0f} min were given"
    what = f"pcb1173, d1291: proved or under 0.05 % in 60 min ({limits})"
    add(what, middle, lambda r: gap(r) < 0.05)
    large = [r for r in both if r["name"] in ("pcb3038", "rl5915")]
    add("pcb3038, rl5915: under 0.3 % in 10 min", large, lambda r: gap(r) < 0.3)
    for low, high, limit in ((0, 1_000, 180), (1_000, 2_000, 900)):
        chosen = [r for r in by["boards"] if low < r["holes"] <= high]
        add(f"tools of boards up to {high:,} holes within {limit} s", chosen, within(limit))
    above = [r for r in by["boards"] if r["holes"] > 2_000]
    add("larger tools under 0.1 % in 15 min", above, lambda r: gap(r) < 0.1)
    everything = [r for rows in by.values() for r in rows]
    measured = [r for r in everything if "memory_mib" in r]
    add("memory within 4 GiB", measured, lambda r: r["memory_mib"] <= 4096)
    faster = lambda r: r["check_seconds"] <= r["cpu_seconds"]  # noqa: E731
    add("checked in less time than found", measured, faster)
    return lines


def ratio(record: Record) -> float:
    """How many times faster than CP-SAT's best setting."""
    return min(record["cp_sat"].values(), default=0.0) / record["seconds"]


def papers(records: list[Record]) -> list[str]:
    """Medians on the papers' workpieces."""
    lines = [
        "## The papers' workpieces",
        "",
        "Wall seconds from the holes to the checked certificate: the first proof of a process,",
        "libraries imported, and the median of the others. CP-SAT: the best of its settings,",
        "median of as many runs in the same process.",
        "",
        "| workpiece | case | optimum | first | median | MiB | certificate | CP-SAT's best |",
        "|---|---|---:|---:|---:|---:|---:|---:|",
    ]
    for r in sorted(records, key=lambda r: (r["name"], r["metric"] != "manhattan")):
        if "error" in r:
            lines.append(f"| {r['name']} | {r['metric']} | {r['error']} |")
            continue
        case, best = 1 if r["metric"] == "manhattan" else 2, "–"
        if r.get("cp_sat"):
            setting = min(r["cp_sat"], key=r["cp_sat"].get)
            best = f"{r['cp_sat'][setting]:.3g} s ({setting}), {ratio(r):.3g} times ours"
        lines.append(
            f"| {r['name'].upper()} | {case} | {r['cost']} | {r['first_seconds']:.3g} s "
            f"| {r['seconds']:.3g} s | {r['memory_mib']} | {r['certificate_bytes'] / 1000:.3g} kB "
            f"| {best} |"
        )
    return lines


def closed(records: list[Record], known: dict[str, dict[str, str]]) -> list[str]:
    """Lines of the table of closed tours."""
    lines = []
    for r in sorted(records, key=lambda r: (r["holes"], r["name"])):
        other = known.get(r["name"], {})
        proved = str(r["cost"]) if r["optimal"] else outcome(r)
        mine = ["–"] * 5
        if "error" not in r:
            mine = [
                f"{r['cpu_seconds']:.3g}",
                str(r["nodes"]),
                str(r.get("memory_mib", "–")),
                f"{r['check_seconds']:.2g} s",
                f"{r['certificate_bytes'] / 1000:.3g} kB",
            ]
        theirs = [other.get("concorde99_s") or "–", other.get("concorde99_bbnodes") or "–"]
        cells = [r["name"], other.get("optimum", ""), proved, *mine, *theirs]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def paths(records: list[Record]) -> list[str]:
    """Lines of the table of open paths."""
    at = {(r["name"], r["metric"]): r for r in records}
    lines = []
    for _, name in sorted({(r["holes"], r["name"]) for r in records}):
        cells = [outcome(at.get((name, m))) for m in ("manhattan", "chebyshev", "euclidean")]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return lines


def boards(records: list[Record]) -> list[str]:
    """Lines of the table of tools by size."""
    lines = []
    for low, high in ((0, 100), (100, 400), (400, 1_000), (1_000, 2_000), (2_000, 10_000)):
        mine = [r for r in records if low < r["holes"] <= high]
        if not mine:
            continue
        seconds = sorted(r["cpu_seconds"] for r in mine if "cpu_seconds" in r) or [0.0]
        memory = max((r.get("memory_mib", 0) for r in mine), default=0)
        lines.append(
            f"| {low + 1:,} to {high:,} | {len(mine)} | {sum(r['optimal'] for r in mine)} "
            f"| {max(map(gap, mine)):.2g} % | {seconds[len(seconds) // 2]:.2g} "
            f"| {seconds[-1]:.3g} | {memory} |"
        )
    return lines


def unproved(records: list[Record]) -> list[str]:
    """The tools above 400 holes and those that stayed open, one by one."""
    head = ["| board | tool | holes | result |", "|---|---|---:|---:|"]
    lines = [
        f"| {r['name']} | {r['metric']} | {r['holes']} | {outcome(r)} |"
        for r in sorted(records, key=lambda r: (r["holes"], r["name"]))
        if r["holes"] > 400 or not r["optimal"]
    ]
    return head + lines if lines else []
