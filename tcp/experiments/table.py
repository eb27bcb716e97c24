"""Our figures beside the paper's, in the paper's own layout."""

from __future__ import annotations

from collections.abc import Sequence

from tcp.experiments.spec import ROWS, Experiment
from tcp.experiments.statistics import Summary


def paper_table(experiment: Experiment, summaries: Sequence[Summary | None]) -> str:
    """The published table as Markdown, each of its columns as printed and as measured here."""
    head = ["Criteria"]
    for column, summary in zip(experiment.columns, summaries, strict=True):
        head += [f"{column.name}: paper"] * bool(column.published)
        head += [f"{column.name}: ours"] * (summary is not None)
    rows = [head]
    for key in experiment.rows:
        row = [ROWS[key]]
        for column, summary in zip(experiment.columns, summaries, strict=True):
            row += [column.published.get(key, "")] * bool(column.published)
            row += [summary.figure(key)] if summary is not None else []
        rows.append(row)
    return markdown(rows)


def honest_table(summaries: Sequence[Summary | None]) -> str:
    """What the papers leave out: success, gap with its interval, wall time."""
    head = "Column", "Runs", "At the optimum (95 % interval)", "Gap, mean ± 95 %"
    rows = [[*head, "Best", "Mean", "Worst", "Optimum", "Proof", "Seconds a run (CPU)"]]
    for s in summaries:
        if s is None:
            continue
        low, high = s.success_interval()
        costs = [s.figure(f"{k}_time") for k in ("least", "average", "most")]
        rows.append(
            [
                s.column.name,
                str(len(s.runs)),
                f"{s.success:.1%} ({low:.1%} to {high:.1%})",
                _gap(s),
                *costs,
                s.figure("optimal_time"),
                s.optimum.proof,
                f"{s.seconds:.3f} ({s.cpu:.3f})",
            ]
        )
    return markdown(rows)


def _gap(s: Summary) -> str:
    if not s.costs:
        return "none"
    mean, half = s.gap_interval()
    return f"{mean:.2%} ± " + ("-" if half is None else f"{half:.2%}")


def whole_report(experiment: Experiment, summaries: Sequence[Summary | None]) -> str:
    """Title, the paper's table, the honest one, source and notes, as Markdown."""
    runs = sorted({len(s.runs) for s in summaries if s is not None})
    made = ", ".join(map(str, runs)) or "no"
    parts = [
        f"### {experiment.title}",
        paper_table(experiment, summaries),
        f"Ours: {made} runs a column, seeds from {experiment.seed} on.",
        honest_table(summaries),
        f"Source: {experiment.source}" if experiment.source else "",
        experiment.notes.strip(),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def markdown(rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table, aligned; long cells are left as long as they are."""
    cells = [[cell.replace("|", "\\|") for cell in row] for row in rows]
    widths = [min(max(len(row[k]) for row in cells), 60) for k in range(len(cells[0]))]

    def line(row: Sequence[str]) -> str:
        return "| " + " | ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) + " |"

    rule = "|" + "|".join("-" * (w + 2) for w in widths) + "|"
    return "\n".join([line(cells[0]), rule, *(line(row) for row in cells[1:])])
