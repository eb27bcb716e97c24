"""Who lies near whom in the travel model's own norm: places for a k-d tree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcp.travel import CostRule, Ints, Kind

PILE = 50
"""Most holes at one place that a k-d tree copes with: it looks at all of them."""


def norm(rule: CostRule) -> tuple[float, float, float]:
    """Factors for x and y and the exponent p with which the p-norm ranks like the rule.

    Exact but for accelerated axes, where the ranking of short moves is used:
    their time is the root of the scaled distance.
    """
    kind, params = rule.kind, [float(v) for v in rule.params]
    if kind is Kind.NORM:
        fx, fy, p = params[0] ** 0.5, params[1] ** 0.5, 2.0
    elif kind in (Kind.SUM, Kind.MAX):
        fx, fy, p = params[0], params[1], 1.0 if kind is Kind.SUM else np.inf
    else:
        fx, fy = params[4] / params[5], params[10] / params[11]
        p = 1.0 if kind is Kind.RAMP_SUM else np.inf
    top = max(fx, fy)
    return fx / top, fy / top, p


def places(xy: Ints, fx: float, fy: float) -> NDArray[np.float64]:
    """Scaled coordinates, shape (n, 2), or (n, 3) where many holes lie at one place.

    There the third coordinate tells them apart: it is less than any step, so that only
    holes of one place are ranked by it.
    """
    height = _heights(xy)
    where = np.empty((height.size, 2 if height.max(initial=0) < PILE else 3))
    where[:, :2] = xy * (fx, fy)
    where[:, 2:] = height[:, None] * (min(fx, fy) / (2 * height.size))
    return where


def _heights(xy: Ints) -> Ints:
    """How many holes lie at the same place before each."""
    order = np.lexsort((xy[:, 1], xy[:, 0]))
    new = np.append(True, (np.diff(xy[order], axis=0) != 0).any(axis=1))
    height = np.empty(order.size, np.int64)
    height[order] = np.arange(order.size) - np.maximum.accumulate(np.arange(order.size) * new)
    return height
