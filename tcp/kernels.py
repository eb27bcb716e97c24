"""The cost of a move, compiled: the same formulas as :mod:`tcp.travel`, one pair at a time.

Compiled solvers call :func:`cost_of_move` in their inner loops; a property
test holds it against :meth:`tcp.travel.CostRule.costs`.  Import this module
only where compiled code is needed: it loads numba.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from tcp.travel import CostRule, Ints

SUM, MAX, NORM, RAMP_SUM, RAMP_MAX = 0, 1, 2, 3, 4


def pack(rule: CostRule) -> Ints:
    """A rule as the flat int64 array ``(kind, up, params...)`` that kernels take."""
    return np.array([int(rule.kind), int(rule.up), *rule.params], dtype=np.int64)


@njit(inline="always", cache=True)
def divide(value: int, m: int, up: bool) -> int:
    """``value / m`` rounded half up, or up."""
    if m == 1:
        return value
    return -(-value // m) if up else (2 * value + m) // (2 * m)


@njit(cache=True)
def root(value: int, m: int, up: bool) -> int:
    """Root of ``value / m`` rounded half up, or up; integers decide."""
    k = np.int64(math.sqrt(value / m))
    if up:
        while k * k * m < value:
            k += 1
        while k > 0 and (k - 1) * (k - 1) * m >= value:
            k -= 1
        return k
    while (2 * k + 1) * (2 * k + 1) * m <= 4 * value:
        k += 1
    while k > 0 and (2 * k - 1) * (2 * k - 1) * m > 4 * value:
        k -= 1
    return k


@njit(cache=True)
def ramp(d: int, rule: Ints, at: int, up: bool) -> int:
    """Time of one accelerated axis move; ``at`` is where the axis' parameters begin."""
    if d >= rule[at + 3]:
        return divide(rule[at] * d + rule[at + 1], rule[at + 2], up)
    return root(rule[at + 4] * d, rule[at + 5], up)


@njit(inline="always", cache=True)
def cost_of_move(rule: Ints, dx: int, dy: int) -> int:
    """Cost of a move by ``dx``, ``dy`` steps under a packed rule (not MATRIX)."""
    kind = rule[0]
    up = rule[1] != 0
    dx = abs(dx)
    dy = abs(dy)
    if kind == SUM:
        return divide(rule[2] * dx + rule[3] * dy, rule[4], up)
    if kind == MAX:
        return divide(max(rule[2] * dx, rule[3] * dy), rule[4], up)
    if kind == NORM:
        return root(rule[2] * dx * dx + rule[3] * dy * dy, rule[4], up)
    tx = ramp(dx, rule, 2, up)
    ty = ramp(dy, rule, 8, up)
    return tx + ty if kind == RAMP_SUM else max(tx, ty)
