"""Trying a decision: a few dual simplex iterations from the basis at hand, and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import highspy


@dataclass(frozen=True)
class Try:
    """A decision to try: a column at 0 or 1, or a row at 2 or at least 4."""

    place: int
    row: bool


@dataclass
class Probe:
    """A solver that stands at a basis, and returns to it after every try.

    Parameters
    ----------
    h : Highs
        The solver, its LP solved to the basis.
    basis : HighsBasis
        Where every try starts.
    value : float
        The objective there, in quanta.
    unit : float
        Quanta to the unit of the LP's costs.
    """

    h: highspy.Highs
    basis: highspy.HighsBasis
    value: float
    unit: float
    iterations: int = 0

    def gains(self, tries: Sequence[Try], iterations: int) -> list[tuple[float, float]]:
        """What the objective gains on either side of each decision; inf where nothing is left."""
        self.h.setOptionValue("simplex_strategy", 1)
        self.h.setOptionValue("simplex_iteration_limit", iterations)
        found = [self._row(t.place) if t.row else self._column(t.place) for t in tries]
        self.h.setOptionValue("simplex_iteration_limit", 2**31 - 1)
        return found

    def _column(self, at: int) -> tuple[float, float]:
        gains = []
        for fixed in (0.0, 1.0):
            self.h.changeColBounds(at, fixed, fixed)
            gains.append(self._gain())
            self.h.changeColBounds(at, 0.0, 1.0)
            self.h.setBasis(self.basis)
        return gains[0], gains[1]

    def _row(self, at: int) -> tuple[float, float]:
        gains = []
        for bounds in ((2.0, 2.0), (4.0, highspy.kHighsInf)):
            self.h.changeRowBounds(at, *bounds)
            gains.append(self._gain())
            self.h.changeRowBounds(at, 2.0, highspy.kHighsInf)
            self.h.setBasis(self.basis)
        return gains[0], gains[1]

    def _gain(self) -> float:
        self.h.run()
        info = self.h.getInfo()
        self.iterations += max(0, info.simplex_iteration_count)
        if self.h.getModelStatus() == highspy.HighsModelStatus.kInfeasible:
            return float("inf")
        return float(info.objective_function_value * self.unit - self.value)
