"""Process rules: which successions of holes and of moves a route may have.

Rules about *pairs* of holes (forbidden, together, minimum jump) are edges of
the tour form, which every solver knows.  Rules about *successive moves* (axis
balance, runs along one axis; H.-C. Yang et al., "Drill-path optimization with
time limit and thermal protection", the BMGA paper) hold along a drilling
sequence; solvers that do not know them refuse the instance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from tcp.errors import UsageError
from tcp.travel import Ints


@dataclass(frozen=True)
class Balance:
    """Axis balance over windows of successive moves (the paper's equations 3 and 4).

    A window of ``window`` successive moves between holes is balanced if
    ``low * sum|dy| <= sum|dx| <= high * sum|dy|``; every other one costs the
    route one unit of penalty.  Reading chosen: equation (4) prints sums of
    coordinates, the text speaks of "the movement along the two axes between w
    consecutive holes"; w counts moves, one more than that many holes have; only full
    windows count, so a route of fewer moves than ``window`` has no penalty.

    Parameters
    ----------
    window : int
        w, moves a window, >= 1.
    low, high : Fraction
        R_min and R_max, 0 <= low <= high.
    most : int, optional
        Most unbalanced windows a route may have; None counts them only.

    Raises
    ------
    UsageError
        For values out of range.
    """

    window: int = 10
    low: Fraction = Fraction(1, 2)
    high: Fraction = Fraction(2)
    most: int | None = None

    def __post_init__(self) -> None:
        if self.window < 1:
            raise UsageError(f"a balance window needs at least one move, not {self.window}")
        if not 0 <= self.low <= self.high:
            raise UsageError(f"balance needs 0 <= low <= high, not {self.low} and {self.high}")
        if self.most is not None and self.most < 0:
            raise UsageError(f"at most {self.most} unbalanced windows is less than none")

    def limits(self) -> tuple[int, int, int, int]:
        """``(a, b, c, d)``: balanced means ``a * sum|dy| <= b * sum|dx|`` and ``c .. <= d ..``.

        In full: ``a |dy| <= b |dx|`` and ``c |dx| <= d |dy|``, all whole.
        """
        low, high = self.low, self.high
        return low.numerator, low.denominator, high.denominator, high.numerator

    def describe(self) -> dict[str, Any]:
        """The rule as plain data."""
        data = {"window": self.window, "low": str(self.low), "high": str(self.high)}
        return data | ({} if self.most is None else {"most": self.most})


@dataclass(frozen=True)
class Rules:
    """Process rules that every solver has to respect.

    Parameters
    ----------
    forbidden : tuple of (int, int)
        Pairs of holes that must not follow each other, in either direction.
    together : tuple of (int, int)
        Pairs of holes that must follow each other (the two ends of a slot).
    min_jump : Fraction, optional
        Smallest Euclidean distance in mm between successive holes (the BMGA
        paper's D_m); nearer pairs are forbidden successions.
    jump_diameters : Fraction, optional
        The same as a multiple (the paper's k) of the larger of the two holes'
        diameters; pairs without a diameter are free.
    balance : Balance, optional
        Axis balance over windows of successive moves.
    axis_run : int, optional
        Most successive moves along one and the same axis, >= 1.
    """

    forbidden: tuple[tuple[int, int], ...] = ()
    together: tuple[tuple[int, int], ...] = ()
    min_jump: Fraction | None = None
    jump_diameters: Fraction | None = None
    balance: Balance | None = None
    axis_run: int | None = None

    def __post_init__(self) -> None:
        if min(self.min_jump or 0, self.jump_diameters or 0) < 0:
            raise UsageError("a minimum jump may not be negative")
        if self.axis_run is not None and self.axis_run < 1:
            raise UsageError(f"a run along one axis may not be limited to {self.axis_run} moves")

    @property
    def sequential(self) -> bool:
        """Whether some rule forbids routes for their successive moves."""
        limited = self.balance is not None and self.balance.most is not None
        return limited or self.axis_run is not None

    @property
    def geometric(self) -> bool:
        """Whether some rule asks where the holes are."""
        rules = (self.min_jump, self.jump_diameters, self.balance, self.axis_run)
        return any(rule is not None for rule in rules)

    def describe(self, ids: Sequence[str]) -> dict[str, Any]:
        """The rules as plain data, holes by id."""
        data: dict[str, Any] = {}
        if self.forbidden:
            data["forbidden"] = [[ids[i], ids[j]] for i, j in self.forbidden]
        if self.together:
            data["together"] = [[ids[i], ids[j]] for i, j in self.together]
        if self.min_jump is not None:
            data["min_jump"] = str(self.min_jump)
        if self.jump_diameters is not None:
            data["jump_diameters"] = str(self.jump_diameters)
        if self.balance is not None:
            data["balance"] = self.balance.describe()
        if self.axis_run is not None:
            data["axis_run"] = self.axis_run
        return data


def unbalanced(x: Ints, y: Ints, balance: Balance) -> Ints:
    """First moves of the unbalanced windows of a route through ``(x[k], y[k])``, from 0."""
    w = balance.window
    sums = []
    for values in (x, y):
        total = np.concatenate([[0], np.cumsum(np.abs(np.diff(values)))])
        sums.append(total[w:] - total[:-w] if len(total) > w else total[:0])
    across, along = (s.astype(object) for s in sums)
    a, b, c, d = balance.limits()
    wrong = (a * along > b * across) | (c * across > d * along)
    return np.flatnonzero(wrong.astype(bool))


def long_runs(x: Ints, y: Ints, most: int) -> list[tuple[int, int]]:
    """Runs of more than ``most`` successive moves along one axis, as (first move, length)."""
    dx, dy = np.diff(x) != 0, np.diff(y) != 0
    axis = np.where(dx & ~dy, 1, np.where(dy & ~dx, 2, 0))
    runs, start = [], 0
    for k in range(1, len(axis) + 1):
        if k == len(axis) or axis[k] != axis[start]:
            if axis[start] and k - start > most:
                runs.append((start, k - start))
            start = k
    return runs
