"""Convergence figures: best so far over iterations, as HTGA 7-12 and cuckoo 4-6."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tcp.errors import UsageError
from tcp.experiments.spec import Experiment
from tcp.experiments.statistics import Summary
from tcp.files.write import write_file
from tcp.travel import Ints

POINTS = 200
"""Places of the iteration axis at which a curve is drawn."""

ENDINGS = (".svg", ".png", ".pdf")
"""What a figure's name may end in."""


def save_convergence(
    experiment: Experiment, summaries: Sequence[Summary | None], path: Path
) -> None:
    """Draw mean and range of the best so far of each column's runs.

    Raises
    ------
    UsageError
        If matplotlib is not installed.
    OutputError
        If the file cannot be written.
    """
    figure, axes = blank()
    drawn = [s for s in summaries if s is not None and any(run.trace for run in s.runs)]
    for number, summary in enumerate(drawn):
        _draw(axes, summary, f"C{number}")
    optima = {s.figure("optimal_time"): s.optimum.cost * s.unit_of_cost for s in drawn}
    for name, cost in optima.items():
        axes.axhline(cost, color="black", linestyle=":", label=f"proved optimum {name}")
    axes.set_xscale("symlog", linthresh=1, linscale=0.3)
    axes.set_xlim(left=0)
    axes.xaxis.set_major_formatter("{x:,.0f}")
    axes.set(xlabel="iteration (0: initial population)", ylabel="total time required")
    axes.set_title(_plain(experiment.title))
    if drawn:
        axes.legend()
    axes.grid(alpha=0.3)
    picture = io.BytesIO()
    figure.savefig(picture, format=path.suffix.lower().removeprefix("."))
    write_file(path, picture.getvalue())


def blank() -> tuple[Any, Any]:
    """An empty figure and its axes.

    Raises
    ------
    UsageError
        If matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ModuleNotFoundError:
        raise UsageError("--plot needs matplotlib; pip install 'tcp-drill[plot]'") from None
    figure = Figure(figsize=(8, 5), layout="constrained")
    return figure, figure.add_subplot()


def _draw(axes: Any, summary: Summary, colour: str) -> None:
    runs = [run for run in summary.runs if run.trace]
    end = max(1, *(run.iterations or 0 for run in runs))
    grid = np.unique(np.geomspace(1, end, POINTS).astype(np.int64))
    grid = np.concatenate([[0], grid])
    curves = np.array([best_so_far(run.trace, grid) for run in runs]) * summary.unit_of_cost
    name = f"mean and range of {len(runs)} runs: {_plain(summary.column.name)}"
    axes.plot(grid, curves.mean(axis=0), color=colour, label=name)
    axes.fill_between(grid, curves.min(axis=0), curves.max(axis=0), color=colour, alpha=0.2)


def _plain(text: str) -> str:
    """A text in which a dollar is a dollar; behind one matplotlib sets a formula."""
    return text.replace("$", r"\$")


def best_so_far(trace: Sequence[Sequence[int]], grid: Ints) -> Ints:
    """The trace's cost at each iteration of ``grid``; before its first entry, the first."""
    at = np.array([entry[0] for entry in trace])
    costs = np.array([entry[1] for entry in trace])
    return costs[np.maximum(np.searchsorted(at, grid, side="right") - 1, 0)]
