"""A board's report for people and programs: the table and the JSON object."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from tcp.boards.board import Board, Part
from tcp.report.table import percent
from tcp.result import decimal
from tcp.words import counted, listed


def amount(board: Board, cost: int | None) -> str:
    """A cost in seconds, or in mm at unit speed."""
    if cost is None:
        return "-"
    return f"{float(board.worth(cost)):.{2 if board.wishes.machine.timed else 1}f}"


def three_digits(value: Fraction) -> str:
    """A small difference with three digits, a large one with one decimal."""
    size = math.floor(math.log10(abs(value))) if value else 0
    return f"{float(value):.{max(1, 2 - size)}f}"


def stays(part: Part) -> bool:
    """Whether a tool's holes stay in their order: locked, not understood, or without choice."""
    without_choice = not part.solved and part.holes > 1 and part.before == part.after
    return part.locked or part.unclear or without_choice


def verdict(board: Board, part: Part) -> str:
    """What is known about a tool's order, in a few words."""
    if stays(part):
        return "kept as it was"
    if part.optimal:
        order = "the file's order is" if part.before == part.after else "proved"
        return f"{order} shortest" + (" (certified)" if part.proof == "certified" else "")
    if not part.bound:
        return "no bound"
    unit = board.wishes.machine.unit
    gain = three_digits(board.worth(part.saves))
    saves = f", saves {gain} {unit} between the tools" if part.saves else ""
    if part.proved:
        longer = three_digits(board.worth(part.after - part.bound))
        return f"{longer} {unit} longer than its shortest path{saves}"
    return f"at most {percent((part.after - part.bound) / part.bound)} above the shortest{saves}"


def board_table(board: Board, written: Path | None) -> str:
    """Several lines for a person."""
    unit = board.wishes.machine.unit
    lines = [f"{board.before.path}: {contents(board)}"]
    rows = [("tool", "holes", f"before {unit}", f"after {unit}", f"bound {unit}", "")]
    rows += [
        (
            f"T{part.tool}",
            str(part.holes),
            amount(board, part.before),
            amount(board, part.after),
            amount(board, part.bound),
            verdict(board, part),
        )
        for part in board.parts
    ]
    links = (board.costs_before.links, board.costs_after.links)
    rows.append(("between", "", amount(board, links[0]), amount(board, links[1]), "", ""))
    totals = (board.costs_before.total, board.costs_after.total, board.bound)
    rows.append(("total", str(sum(p.holes for p in board.parts)), *map(_amount(board), totals), ""))
    widths = [max(len(row[i]) for row in rows) for i in range(5)]
    for row in rows:
        cells = [row[0].ljust(widths[0]), *(row[i].rjust(widths[i]) for i in range(1, 5))]
        lines.append("  " + "  ".join(cells) + ("  " + row[5] if row[5] else ""))
    return "\n".join([*lines, *(f"  {line}" for line in conclusions(board, written))])


def _amount(board: Board) -> Any:
    return lambda cost: amount(board, cost)


def contents(board: Board) -> str:
    """What a board consists of, in a few words."""
    program = board.before
    counts = [(program.hits, "hole"), (program.slots, "slot"), (program.routed, "routed path")]
    what = ", ".join(counted(n, name) for n, name in counts if n) or "no holes"
    return f"{what}, {counted(len(program.used), 'tool')}, {board.wishes.machine.travel.model}"


def audit(board: Board) -> str:
    """How much of a file's travel is needed, in a sentence; both ends of it are proved."""
    before, after, bound = board.costs_before.total, board.costs_after.total, board.bound
    least, most = factor(before, after), factor(before, bound)
    given = provided(board)
    if not before or before == bound:
        return f"this file travels no more than what is needed (proved){given}"
    if not bound:
        least = hundredths(100 * before // after)
        return f"this file travels at least {least} times what is needed{given}; no bound is known"
    if least == most:
        return f"this file travels {least} times what is needed (proved){given}"
    unit = board.wishes.machine.unit
    least, most = hundredths(100 * before // after), hundredths(-(-100 * before // bound))
    return (
        f"this file travels {least} to {most} times what is needed{given}: {amount(board, after)} "
        f"{unit} are enough, less than {amount(board, bound)} {unit} are proved impossible"
    )


def provided(board: Board) -> str:
    """Which tools a statement about the whole file takes as they are."""
    kept = [f"T{part.tool}" for part in board.parts if stays(part)]
    return f", with {listed(kept)} as {'it is' if len(kept) == 1 else 'they are'}" if kept else ""


def conclusions(board: Board, written: Path | None) -> list[str]:
    """What it comes down to, in sentences."""
    before, after = board.costs_before.total, board.costs_after.total
    unit = board.wishes.machine.unit
    found = []
    if board.interrupted:
        found.append("interrupted: what was not looked at keeps the file's order")
    if board.wishes.check:
        return [*found, audit(board)]
    if after > before:  # only where the user asked for another order of tools
        more = amount(board, after - before)
        found.append(
            f"the new file travels {more} {unit} more: the order of tools asked for costs that"
        )
    elif before == after and all(stays(part) for part in board.parts):
        found.append("nothing may change places; the file's own order is kept")
    elif before == board.bound:
        found.append(f"the file's own order is the shortest (proved){provided(board)}; it is kept")
    elif before == after:
        found.append("no better order was found; the file's own order is kept")
    else:
        found.append(
            f"the file travels {factor(before, after)} times what the new order needs"
            f" and {factor(before, board.bound)} times the lower bound"
        )
    if board.ends_gain:
        gain = amount(board, board.ends_gain)
        found.append(f"paths that end where the next tool begins save {gain} {unit} of that")
    if board.order_gain:
        found.append(f"the order of tools saves {amount(board, board.order_gain)} {unit} of that")
    machine = board.wishes.machine
    if machine.timed and after <= before:
        found.append(f"{float(board.worth(before - after)):.1f} s saved a board")
    if machine.drill or machine.tool_change:
        found.append(
            f"{float(job_time(board, after)):.1f} s a board with drilling and tool changes"
        )
    if written is not None:
        found.append(f"written to {written}")
    return found


def factor(cost: int, base: int) -> str:
    """How many times ``base`` is in ``cost``."""
    return f"{cost / base:.2f}" if base else "-"


def hundredths(number: int) -> str:
    """So many hundredths: for figures that are proved and must not be rounded to the nearest."""
    return f"{number // 100}.{number % 100:02}"


def job_time(board: Board, travel: int) -> Fraction:
    """Seconds of a whole job: travel, drilling and tool changes."""
    holes = sum(part.holes for part in board.parts)
    return board.worth(travel) + board.wishes.machine.work(holes, len(board.parts))


def board_data(board: Board, written: Path | None) -> dict[str, Any]:
    """The report as plain data; travel as exact decimals or fractions in seconds (mm)."""

    def worth(cost: int | None) -> str | None:
        return None if cost is None else decimal(board.worth(cost))

    return {
        "file": str(board.before.path),
        "written": None if written is None else str(written),
        "holes": board.before.hits,
        "slots": board.before.slots,
        "routed": board.before.routed,
        "unit": board.wishes.machine.unit,
        "travel": str(board.wishes.machine.travel.model),
        "before": worth(board.costs_before.total),
        "after": worth(board.costs_after.total),
        "lower_bound": worth(board.bound),
        "links_before": worth(board.costs_before.links),
        "links_after": worth(board.costs_after.links),
        "tool_order": str(board.wishes.tool_order),
        "tool_order_gain": worth(board.order_gain),
        "ends_gain": worth(board.ends_gain),
        "proved": board.proved,
        "changed": board.changed,
        "interrupted": board.interrupted,
        "effort": str(board.wishes.effort),
        "seed": board.wishes.seed,
        "tools": [
            {
                "tool": f"T{part.tool}",
                "holes": part.holes,
                "before": worth(part.before),
                "after": worth(part.after),
                "lower_bound": worth(part.bound),
                "saves_between": worth(part.saves),
                "optimal": part.optimal,
                "proved": part.proved,
                "proof": str(part.proof),
                "locked": part.locked,
                "understood": not part.unclear,
                "seconds": round(part.seconds, 3),
                "certificates": [
                    str(s.answer.certificate) for s in part.solved if s.answer.certificate
                ],
            }
            for part in board.parts
        ],
        "notes": list(board.notes),
    }


def summary_table(boards: Sequence[Board]) -> str:
    """One line a board, and their sum."""
    rows: list[tuple[str, int, list[Fraction]]] = [
        (
            board.before.path.name,
            sum(part.holes for part in board.parts),
            [
                board.worth(cost)
                for cost in (board.costs_before.total, board.costs_after.total, board.bound)
            ],
        )
        for board in boards
    ]
    sums = [sum((row[2][i] for row in rows), start=Fraction(0)) for i in range(3)]
    rows.append((f"{len(boards)} boards", sum(row[1] for row in rows), sums))
    width = max(len(row[0]) for row in rows)
    unit = boards[0].wishes.machine.unit
    head = f"{'board':<{width}}  {'holes':>6}  {'before ' + unit:>12}  {'after ' + unit:>12}"
    lines = [f"{head}  {'bound ' + unit:>12}"]
    for name, holes, costs in rows:
        numbers = "  ".join(f"{float(cost):>12.1f}" for cost in costs)
        lines.append(f"{name:<{width}}  {holes:>6}  {numbers}")
    return "\n".join(lines)
