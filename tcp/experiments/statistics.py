"""What the runs of one column say, in the papers' figures and in honest ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from tcp.experiments.journal import Run
from tcp.experiments.run import Optimum
from tcp.experiments.spec import Column
from tcp.result import decimal
from tcp.solve import defaults

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Summary:
    """The runs of one column.

    Parameters
    ----------
    column : Column
        What was run.
    optimum : Optimum
        The proved optimum.
    runs : tuple of Run
        In the order of their seeds.
    """

    column: Column
    optimum: Optimum
    runs: tuple[Run, ...]

    @property
    def costs(self) -> list[int]:
        """Best costs of the runs that found a route, in quanta."""
        return [run.cost for run in self.runs if run.cost is not None]

    @property
    def optimal(self) -> list[Run]:
        """The runs that reached the optimum."""
        return [run for run in self.runs if run.optimal]

    @property
    def hits(self) -> list[int]:
        """Iterations at which runs first had the optimum, of those that had it and counted."""
        return [run.hit for run in self.optimal if run.hit is not None]

    @property
    def searched(self) -> list[int]:
        """Solutions evaluated until the optimum was hit, of the runs that hit it and counted."""
        return [run.evaluations for run in self.optimal if run.evaluations is not None]

    @property
    def success(self) -> float:
        """Share of the runs that reached the optimum."""
        return len(self.optimal) / len(self.runs)

    @property
    def gaps(self) -> list[float]:
        """(cost - optimum) / optimum of each run."""
        best = self.optimum.cost
        return [(cost - best) / best if best else 0.0 for cost in self.costs]

    @property
    def unit_of_cost(self) -> float:
        """What one quantum is worth in the workpiece's unit."""
        return float(self.column.instance.quantum)

    def unit(self, quanta: float) -> str:
        """A cost in the workpiece's unit, rounded to three decimals."""
        return f"{quanta * self.unit_of_cost:.3f}".rstrip("0").rstrip(".")

    def figure(self, row: str) -> str:
        """The figure of a table row (a key of :data:`tcp.experiments.spec.ROWS`)."""
        if row == "population":
            options = defaults(self.column.solver) | dict(self.column.options)
            return str(options.get("np", options.get("agents", "none")))
        if row == "success":
            return f"{len(self.optimal)} of {len(self.runs)}"
        if row == "optimal_time":
            return decimal(self.optimum.cost * self.column.instance.quantum)
        kind, _, what = row.partition("_")
        values = self._values(what or row)
        if not values:
            return "none"
        if row == "sequence":
            return str(values[0])
        value = (
            _mean(values) if kind == "average" else max(values) if kind == "most" else min(values)
        )
        return self._spell(what or row, value)

    def _values(self, what: str) -> list[Any]:
        if what == "ratio":  # whole numbers: half a factorial may be too large for a float
            orders = math.factorial(len(self.column.instance))
            return [2 * s / orders for s in self.searched]
        best = min(self.costs, default=None)
        figures: dict[str, list[Any]] = {
            "sequence": [run.route for run in self.runs if run.cost == best],
            "iterations": self.hits,
            "last": [run.last for run in self.runs if run.last is not None],
            "searched": self.searched,
            "time": self.costs,
            "error": self.gaps,
            "fitness": self.costs,
            "length": self.costs,
        }
        return figures[what]

    def _spell(self, what: str, value: float) -> str:
        if what in ("time", "fitness", "length"):
            return self.unit(value)
        if what == "error":
            return f"{value:.2%}"
        if what == "ratio":  # the paper's equation (17), in per cent
            return f"{value * 100:.2E}%"
        return f"{value:.1f}".removesuffix(".0")

    def gap_interval(self) -> tuple[float, float | None]:
        """Mean gap to the proved optimum, and half the width of its 95 % confidence interval."""
        return mean_interval(self.gaps)

    @property
    def seconds(self) -> float:
        """Mean wall time of a run."""
        return sum(run.seconds for run in self.runs) / len(self.runs)

    @property
    def cpu(self) -> float:
        """Mean processor time of a run."""
        return sum(run.cpu for run in self.runs) / len(self.runs)

    def success_interval(self) -> tuple[float, float]:
        """Wilson's 95 % confidence interval of the success rate."""
        return wilson(len(self.optimal), len(self.runs))


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)


def mean_interval(values: Sequence[float]) -> tuple[float, float | None]:
    """Mean, and half the width of Student's 95 % interval (None for a single value: unknown)."""
    mean = _mean(values)
    n = len(values)
    if n < 2:
        return mean, None
    from scipy.stats import t

    deviation = math.sqrt(sum((v - mean) ** 2 for v in values) / (n - 1))
    return mean, float(t.ppf((1 + CONFIDENCE) / 2, n - 1)) * deviation / math.sqrt(n)


def wilson(hits: int, runs: int, z: float = 1.959964) -> tuple[float, float]:
    """Wilson's interval for a success rate."""
    p, q = hits / runs, z * z / runs
    middle, half = p + q / 2, z * math.sqrt(p * (1 - p) / runs + q / (4 * runs))
    return max(0.0, (middle - half) / (1 + q)), min(1.0, (middle + half) / (1 + q))


def summarise(
    columns: Sequence[Column], known: dict[str, Optimum], runs: dict[str, Run]
) -> list[Summary | None]:
    """The summary of each column, None for one that is only quoted."""
    seeds = sorted({run.seed for run in runs.values()})
    found: list[Summary | None] = []
    for column in columns:
        keys = [column.key(seed) for seed in seeds] if column.solver else []
        mine = tuple(runs[key] for key in keys if key in runs)
        found.append(Summary(column, known[column.instance.sha256], mine) if mine else None)
    return found
