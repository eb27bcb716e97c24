"""Convergence figures: best so far over iterations, as HTGA 7-12 and cuckoo 4-6."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tcp.errors import UsageError
from tcp.experiments.spec import Experiment
from tcp.experiments.statistics import Summary
from tcp.travel import Ints

POINTS = 200


def save_convergence(
    experiment: Experiment, summaries: Sequence[Summary | None], path: Path
) -> None:
    """Draw mean and range of the best so far of each column's runs.

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
    axes = figure.add_subplot()
    for number, summary in enumerate(s for s in summaries if s is not None):
        _draw(axes, summary, f"C{number}")
    axes.set(
        xscale="symlog", xlabel="iteration (0: initial population)", ylabel="total time required"
    )
    axes.set_title(experiment.title)
    axes.legend()
    axes.grid(alpha=0.3)
    figure.savefig(path)


def _draw(axes: Any, summary: Summary, colour: str) -> None:
    runs = [run for run in summary.runs if run.trace]
    end = max((run.iterations for run in runs), default=1)
    grid = np.unique(np.geomspace(1, max(end, 1), POINTS).astype(np.int64))
    grid = np.concatenate([[0], grid])
    unit = float(summary.column.instance.quantum)
    curves = np.array([best_so_far(run.trace, grid) for run in runs]) * unit
    name = f"{summary.column.name}: mean and range of {len(runs)} runs"
    axes.plot(grid, curves.mean(axis=0), color=colour, label=name)
    axes.fill_between(grid, curves.min(axis=0), curves.max(axis=0), color=colour, alpha=0.2)
    optimum = summary.optimum.cost * unit
    axes.axhline(optimum, color=colour, linestyle=":", label=f"proved optimum {optimum:g}")


def best_so_far(trace: Sequence[Sequence[int]], grid: Ints) -> Ints:
    """The trace's cost at each iteration of ``grid``; before its first entry, the first."""
    at = np.array([entry[0] for entry in trace])
    costs = np.array([entry[1] for entry in trace])
    return costs[np.maximum(np.searchsorted(at, grid, side="right") - 1, 0)]
