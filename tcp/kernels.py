"""The cost of a move, compiled: the same formulas as :mod:`tcp.travel`, one pair at a time.

Compiled solvers call :func:`cost_of_move` in their inner loops; a property
test holds it against :meth:`tcp.travel.CostRule.costs`.  Import this module
only where compiled code is needed: it loads numba.
"""

from __future__ import annotations

import math

import numpy as np

from tcp.jit import cached, formula
from tcp.travel import CostRule, Ints

SUM, MAX, NORM, RAMP_SUM, RAMP_MAX = 0, 1, 2, 3, 4


def pack(rule: CostRule) -> Ints:
    """A rule as the flat int64 array ``(kind, up, params...)`` that kernels take."""
    return np.array([int(rule.kind), int(rule.up), *rule.params], dtype=np.int64)


@formula
def divide(value: int, m: int, up: bool) -> int:
    """``value / m`` rounded half up, or up."""
    if m == 1:
        return value
    return (2 * value + (2 * m - 2 if up else m)) // (2 * m)


@formula
def root(value: int, m: int, up: bool) -> int:
    """Root of ``value / m`` rounded half up, or up; integers decide.

    The smallest k >= 0 with (2k + 1)^2 m > 4 value, or with (2k)^2 m >= 4 value.
    """
    half = np.int64(0 if up else 1)
    k = np.int64(math.sqrt(value / m))
    while (2 * k + half) * (2 * k + half) * m < 4 * value + half:
        k += 1
    while k > 0 and (2 * k - 2 + half) * (2 * k - 2 + half) * m >= 4 * value + half:
        k -= 1
    return k


@formula
def ramp(d: int, rule: Ints, at: int, up: bool) -> int:
    """Time of one accelerated axis move; ``at`` is where the axis' parameters begin."""
    if d >= rule[at + 3]:
        return divide(rule[at] * d + rule[at + 1], rule[at + 2], up)
    return root(rule[at + 4] * d, rule[at + 5], up)


@cached(inline="always")  # not inlined, pricing all pairs takes a seventh longer
def cost_of_move(rule: Ints, dx: int, dy: int) -> int:
    """Cost of a move by ``dx``, ``dy`` steps under a packed rule (not MATRIX)."""
    kind, up = rule[0], rule[1] != 0
    dx, dy = abs(dx), abs(dy)
    if kind == NORM:
        return root(rule[2] * dx * dx + rule[3] * dy * dy, rule[4], up)
    if kind <= MAX:  # or SUM
        a, b = rule[2] * dx, rule[3] * dy
        return divide(a + b if kind == SUM else max(a, b), rule[4], up)
    tx, ty = ramp(dx, rule, np.int64(2), up), ramp(dy, rule, np.int64(8), up)
    return tx + ty if kind == RAMP_SUM else max(tx, ty)
