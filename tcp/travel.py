"""Travel models: how long the machine takes from one hole to the next, in whole quanta.

A :class:`Travel` is what a user asks for (model, speeds, quantum).  Bound to a
workpiece's step and extent it becomes a :class:`CostRule`: a handful of
integers from which the cost of any move follows in integer arithmetic alone.
The rule promises that no intermediate result leaves 62 bits; a workpiece for
which it cannot promise that is refused.

With |dx|, |dy| in steps and integers ``a``, ``b``, ``m``, ``u``:

========  ==================================  ===========================================
kind      cost of a move                      used for
========  ==================================  ===========================================
SUM       round((a |dx| + b |dy|) / m)        ``sequential``: axes one after the other
MAX       round(max(a |dx|, b |dy|) / m)      ``simultaneous``: both axes at once
NORM      round(sqrt((a dx^2 + b dy^2) / m))  ``euclidean``
RAMP_SUM  T_x(|dx|) + T_y(|dy|)               ``trapezoidal``, sequential axes
RAMP_MAX  max(T_x(|dx|), T_y(|dy|))           ``trapezoidal``, simultaneous axes
MATRIX    matrix[i, j]                        ``explicit``: times given by the file
========  ==================================  ===========================================

``T(d) = round((l d + k) / m)`` from ``d >= d0`` on (the axis reaches its
speed), else ``round(sqrt(s d / r))``.  Rounding is half up, or up (CEIL_2D).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import IntEnum, StrEnum
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcp.errors import UsageError, demand_exact

Ints = NDArray[np.int64]

SAFE = 2**62
"""Every intermediate of a cost stays below this."""

WORTH_TRYING = range(-12, 31)
"""Powers of ten that may be advised as quanta."""


class Model(StrEnum):
    """The travel models by the name users type."""

    SEQUENTIAL = "sequential"
    SIMULTANEOUS = "simultaneous"
    EUCLIDEAN = "euclidean"
    TRAPEZOIDAL = "trapezoidal"
    EXPLICIT = "explicit"


ALIASES = {
    "case1": Model.SEQUENTIAL,
    "case2": Model.SIMULTANEOUS,
    "manhattan": Model.SEQUENTIAL,
    "chebyshev": Model.SIMULTANEOUS,
}


class Rounding(StrEnum):
    """How an irrational or coarse cost becomes whole."""

    NEAREST = "nearest"
    UP = "up"


class Kind(IntEnum):
    """The integer formulas of the module's table."""

    SUM = 0
    MAX = 1
    NORM = 2
    RAMP_SUM = 3
    RAMP_MAX = 4
    MATRIX = 5


@dataclass(frozen=True)
class CostRule:
    """Integer parameters from which every cost follows; see the module's table.

    Parameters
    ----------
    kind : Kind
        The formula.
    params : tuple of int
        ``(a, b, m)`` for SUM, MAX and NORM; ``(l, k, m, d0, s, r)`` of x and
        then of y for the RAMP kinds; empty for MATRIX.
    up : bool
        Round up instead of half up.
    quantum : Fraction
        What one unit of cost is worth, in seconds (millimetres at unit speed).
    """

    kind: Kind
    params: tuple[int, ...]
    quantum: Fraction
    up: bool = False

    def costs(self, dx: Ints, dy: Ints) -> Ints:
        """Costs of moves by ``dx``, ``dy`` steps (int64 arrays of one shape), in quanta."""
        dx, dy = np.abs(dx), np.abs(dy)
        if self.kind is Kind.SUM:
            a, b, m = self.params
            return _divide(a * dx + b * dy, m, self.up)
        if self.kind is Kind.MAX:
            a, b, m = self.params
            return _divide(np.maximum(a * dx, b * dy), m, self.up)
        if self.kind is Kind.NORM:
            a, b, m = self.params
            return _root(a * dx * dx + b * dy * dy, m, self.up)
        if self.kind is Kind.MATRIX:
            raise UsageError("an explicit travel matrix has no coordinates to measure")
        tx, ty = _ramp(dx, self.params[:6], self.up), _ramp(dy, self.params[6:], self.up)
        return tx + ty if self.kind is Kind.RAMP_SUM else np.maximum(tx, ty)


def _divide(value: Ints, m: int, up: bool) -> Ints:
    if m == 1:
        return value
    return -(-value // m) if up else (2 * value + m) // (2 * m)


def _root(value: Ints, m: int, up: bool) -> Ints:
    """Root of ``value / m``, rounded; floats only guess, integers decide."""
    k = np.sqrt(value / m).astype(np.int64)
    if up:  # smallest k with k^2 m >= value
        for _ in range(2):
            k = np.where(k * k * m < value, k + 1, k)
        return np.where((k > 0) & ((k - 1) * (k - 1) * m >= value), k - 1, k)
    for _ in range(2):  # largest k with (2k - 1)^2 m <= 4 value
        k = np.where((2 * k + 1) * (2 * k + 1) * m <= 4 * value, k + 1, k)
    return np.where((k > 0) & ((2 * k - 1) * (2 * k - 1) * m > 4 * value), k - 1, k)


def _ramp(d: Ints, params: tuple[int, ...], up: bool) -> Ints:
    speed, offset, m, full_from, s, r = params
    short = np.minimum(d, full_from)
    return np.where(d >= full_from, _divide(speed * d + offset, m, up), _root(s * short, r, up))


@dataclass(frozen=True)
class Travel:
    """A travel model with its speeds, as a user states it.

    Parameters
    ----------
    model : Model
        ``sequential`` t = |dx|/vx + |dy|/vy (the papers' Case 1),
        ``simultaneous`` t = max(|dx|/vx, |dy|/vy) (Case 2),
        ``euclidean`` t = sqrt((dx/vx)^2 + (dy/vy)^2), ``trapezoidal`` (each
        axis accelerates, cruises, brakes), ``explicit``.
    vx, vy : Fraction
        Axis speeds in mm/s, > 0.
    ax, ay : Fraction, optional
        Axis accelerations in mm/s^2, > 0; required by ``trapezoidal``.
    axes : Model
        For ``trapezoidal``: axes ``sequential`` or ``simultaneous``.
    quantum : Fraction, optional
        The unit costs are rounded to.  Default: exact for ``sequential`` and
        ``simultaneous``, 0.001 for ``euclidean`` and 1e-6 for ``trapezoidal``.
    rounding : Rounding
        Half up, or up.

    Raises
    ------
    UsageError
        For speeds, accelerations or quanta that are not positive, or any with ``explicit``;
        for rounding up where costs are exact.
    """

    model: Model = Model.SEQUENTIAL
    vx: Fraction = Fraction(1)
    vy: Fraction = Fraction(1)
    ax: Fraction | None = None
    ay: Fraction | None = None
    axes: Model = Model.SIMULTANEOUS
    quantum: Fraction | None = None
    rounding: Rounding = Rounding.NEAREST

    def __post_init__(self) -> None:
        for name in ("vx", "vy", "ax", "ay", "quantum"):
            value = getattr(self, name)
            if value is None and name not in ("vx", "vy"):
                continue
            demand_exact(name, value)
            if value <= 0:
                raise UsageError(f"{name} must be greater than 0, not {value}")
        if self.model not in list(Model):
            raise UsageError(
                f"unknown travel model {self.model!r}; expected one of {', '.join(Model)}"
            )
        if self.model is Model.TRAPEZOIDAL and (self.ax is None or self.ay is None):
            raise UsageError("trapezoidal travel needs the accelerations ax and ay")
        if self.axes not in (Model.SEQUENTIAL, Model.SIMULTANEOUS):
            raise UsageError(f"axes move sequential or simultaneous, not {self.axes}")
        given = self.vx != 1 or self.vy != 1 or self.ax or self.ay or self.quantum
        if self.model is Model.EXPLICIT and (given or self.rounding is not Rounding.NEAREST):
            raise UsageError("explicit travel is the file's own times: no speeds, no rounding")
        if self.exact and self.rounding is Rounding.UP:
            raise UsageError(f"{self.model} travel is exact: rounding up needs a quantum")

    @property
    def exact(self) -> bool:
        """Whether costs are the true times, not times rounded to a quantum."""
        linear = self.model in (Model.SEQUENTIAL, Model.SIMULTANEOUS, Model.EXPLICIT)
        return linear and self.quantum is None

    def rule(self, step: Fraction, reach: tuple[int, int], moves: int) -> CostRule:
        """The integer rule for coordinates in ``step`` mm.

        Parameters
        ----------
        step : Fraction
            Millimetres per step.
        reach : (int, int)
            Largest |dx| and |dy| in steps.
        moves : int
            Largest number of moves in a route: the sum must fit as well.

        Raises
        ------
        UsageError
            If integers of 62 bits cannot hold the costs.
        """
        reach = (max(reach[0], 1), max(reach[1], 1))  # the factors of an axis at rest must fit, too
        rule, fits = self._bound(step, reach, moves)
        if not fits:
            raise UsageError(
                f"{self.model} travel over {float(max(reach) * step):g} mm in quanta of "
                f"{float(rule.quantum):g} exceeds 62-bit integers; "
                f"{self._way_out(rule.quantum, step, reach, moves)}"
            )
        return rule

    def _bound(self, step: Fraction, reach: tuple[int, int], moves: int) -> tuple[CostRule, bool]:
        """The rule, and whether integers of 62 bits hold all costs and what leads to them."""
        rule, peak = _BINDERS[self.model](self, step, reach)
        return rule, peak * 4 < SAFE and _longest(rule, reach) * max(moves, 1) < SAFE

    def _way_out(
        self, quantum: Fraction, step: Fraction, reach: tuple[int, int], moves: int
    ) -> str:
        """What to do about costs that do not fit."""
        for power in WORTH_TRYING:
            other = Fraction(10) ** power
            if replace(self, quantum=other)._bound(step, reach, moves)[1]:
                return f"choose a {'larger' if other > quantum else 'smaller'} quantum"
        return "take fewer decimals in coordinates and speeds"


def _longest(rule: CostRule, reach: tuple[int, int]) -> int:
    """Cost of the longest move, for formulas whose intermediates are known to fit."""
    if rule.kind is Kind.MATRIX:
        return 0
    return int(rule.costs(np.array(reach[:1]), np.array(reach[1:]))[0])


def _linear(travel: Travel, step: Fraction, reach: tuple[int, int]) -> tuple[CostRule, int]:
    px, py = step / travel.vx, step / travel.vy
    if travel.quantum is None:
        quantum = _gcd(px, py)
        a, b, m = int(px / quantum), int(py / quantum), 1
    else:
        quantum = travel.quantum
        a, b, m = _common(px / quantum, py / quantum)
    kind = Kind.SUM if travel.model is Model.SEQUENTIAL else Kind.MAX
    peak = 2 * (a * reach[0] + b * reach[1]) + m
    return CostRule(kind, (a, b, m), quantum, travel.rounding is Rounding.UP), peak


def _norm(travel: Travel, step: Fraction, reach: tuple[int, int]) -> tuple[CostRule, int]:
    quantum = travel.quantum or Fraction(1, 1000)
    a, b, m = _common((step / travel.vx / quantum) ** 2, (step / travel.vy / quantum) ** 2)
    peak = _root_peak(a * reach[0] ** 2 + b * reach[1] ** 2, m)
    return CostRule(Kind.NORM, (a, b, m), quantum, travel.rounding is Rounding.UP), peak


def _trapezoid(travel: Travel, step: Fraction, reach: tuple[int, int]) -> tuple[CostRule, int]:
    quantum = travel.quantum or Fraction(1, 10**6)
    assert travel.ax is not None and travel.ay is not None
    x, peak_x = _axis(travel.vx, travel.ax, step, quantum, reach[0])
    y, peak_y = _axis(travel.vy, travel.ay, step, quantum, reach[1])
    kind = Kind.RAMP_SUM if travel.axes is Model.SEQUENTIAL else Kind.RAMP_MAX
    return CostRule(kind, x + y, quantum, travel.rounding is Rounding.UP), peak_x + peak_y


def _axis(
    v: Fraction, a: Fraction, step: Fraction, quantum: Fraction, reach: int
) -> tuple[tuple[int, ...], int]:
    """Parameters of T(d) = d/v + v/a for d >= v^2/a, else 2 sqrt(d/a)."""
    speed, offset, m = _common(step / v / quantum, v / a / quantum)
    full_from = math.ceil(v * v / a / step)
    s, r = (4 * step / a / quantum**2).as_integer_ratio()
    full_from = min(full_from, reach + 1)
    peak = max(2 * (speed * reach + offset) + m, _root_peak(s * full_from, r))
    return (speed, offset, m, full_from, s, r), peak


def _explicit(travel: Travel, step: Fraction, reach: tuple[int, int]) -> tuple[CostRule, int]:
    return CostRule(Kind.MATRIX, (), Fraction(1)), 0


_Binder = Callable[[Travel, Fraction, tuple[int, int]], tuple[CostRule, int]]
_BINDERS: dict[Model, _Binder] = {
    Model.SEQUENTIAL: _linear,
    Model.SIMULTANEOUS: _linear,
    Model.EUCLIDEAN: _norm,
    Model.TRAPEZOIDAL: _trapezoid,
    Model.EXPLICIT: _explicit,
}


def _root_peak(value: int, m: int) -> int:
    """Largest intermediate of :func:`_root` for radicands up to ``value``."""
    k = math.isqrt(value // m) + 3
    return max(4 * value, (2 * k + 1) ** 2 * m)


def _gcd(p: Fraction, q: Fraction) -> Fraction:
    """Largest unit of which both are whole multiples."""
    return Fraction(math.gcd(p.numerator * q.denominator, q.numerator * p.denominator)) / (
        p.denominator * q.denominator
    )


def _common(p: Fraction, q: Fraction) -> tuple[int, int, int]:
    """Integers (a, b, m) with p = a/m, q = b/m, m smallest."""
    m = math.lcm(p.denominator, q.denominator)
    return int(p * m), int(q * m), m


def parse_model(name: str) -> Model:
    """The model a user means by ``name``: a model's name or an alias such as ``case1``.

    Raises
    ------
    UsageError
        If no model has that name.
    """
    key = name.strip().lower()
    if key in ALIASES:
        return ALIASES[key]
    try:
        return Model(key)
    except ValueError:
        known = ", ".join([*Model, *ALIASES])
        raise UsageError(f"unknown travel model {name!r}; expected one of {known}") from None


def describe(travel: Travel) -> dict[str, Any]:
    """The travel model as plain data, for hashes, JSON and certificates."""
    data: dict[str, Any] = {"model": str(travel.model)}
    if travel.model is not Model.EXPLICIT:
        data |= {"vx": str(travel.vx), "vy": str(travel.vy)}
    if travel.model is Model.TRAPEZOIDAL:
        data |= {"ax": str(travel.ax), "ay": str(travel.ay), "axes": str(travel.axes)}
    if not travel.exact:
        data["rounding"] = str(travel.rounding)
    return data
