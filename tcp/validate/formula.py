"""Formulas as data: ``["divide", ["factorial", 14], 2]``.  Nothing is evaluated as code.

A formula is a number, or a list of an operation and its operands.  Operands
can point to other claims: ``["figure", "table-3-case1", "best_time"]`` is a
printed figure, ``["time", "table-4-wp1-case1"]`` the recomputed time of a
route, ``["optimum", "table-4-wp1-case1"]`` the certified optimum of its
problem.  Everything is computed in exact fractions, within bounds.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from fractions import Fraction
from typing import Any, Protocol

from tcp.errors import InputError
from tcp.files.printed import Printed, parse_printed

Value = Fraction | tuple[int, ...]

MAX_FACTORIAL = 1000
MAX_BITS = 14_000


class Figures(Protocol):
    """Where a formula finds figures of other claims; each raises InputError if there is none."""

    def figure(self, claim: str, key: str) -> Fraction:
        """A printed figure."""

    def time(self, claim: str) -> Fraction:
        """The recomputed time of a route."""

    def optimum(self, claim: str) -> Fraction:
        """The certified optimum of a claim's problem."""


def value(formula: Any, figures: Figures) -> Value:
    """The value of a formula.

    Raises
    ------
    InputError
        For an unknown operation, wrong operands or a result beyond all measure.
    """
    if isinstance(formula, Printed):
        return formula.value
    if isinstance(formula, str):
        return parse_printed(formula).value
    if not isinstance(formula, tuple) or not formula or not isinstance(formula[0], str):
        raise InputError("a formula is a number or [operation, operands...]")
    name, operands = formula[0], formula[1:]
    if name in ("figure", "time", "optimum"):
        return _looked_up(name, operands, figures)
    if name in ("order", "ranks"):
        return _permutation(name, [number(v, figures) for v in operands])
    if name not in _OPERATIONS:
        raise InputError(f"unknown operation {name[:40]!r}; expected {', '.join(OPERATIONS)}")
    least, most, operation = _OPERATIONS[name]
    if not least <= len(operands) <= most:
        raise InputError(f"{name} takes {least} operands or more, not {len(operands)}")
    return _small(operation([number(v, figures) for v in operands]))


def number(formula: Any, figures: Figures) -> Fraction:
    """The value of a formula that must be a number."""
    found = value(formula, figures)
    if not isinstance(found, Fraction):
        raise InputError("a list cannot be an operand")
    return found


def comparison(formula: Any, figures: Figures) -> tuple[bool, Fraction, Fraction]:
    """Whether ``[relation, a, b]`` holds, with both values.

    Raises
    ------
    InputError
        If it is no comparison.
    """
    good = isinstance(formula, tuple) and len(formula) == 3 and formula[0] in _RELATIONS
    if not good:
        raise InputError(f"a comparison is [relation, a, b] with {', '.join(_RELATIONS)}")
    a, b = number(formula[1], figures), number(formula[2], figures)
    return bool(_RELATIONS[formula[0]](a, b)), a, b


def _looked_up(name: str, operands: tuple[Any, ...], figures: Figures) -> Fraction:
    if not all(isinstance(v, str) for v in operands):
        raise InputError(f"{name} takes names of claims")
    if name == "figure" and len(operands) == 2:
        return figures.figure(*operands)
    if name == "time" and len(operands) == 1:
        return figures.time(*operands)
    if name == "optimum" and len(operands) == 1:
        return figures.optimum(*operands)
    raise InputError(f"{name} takes {'a claim and a key' if name == 'figure' else 'one claim'}")


def _permutation(name: str, values: list[Fraction]) -> tuple[int, ...]:
    """``order``: places of the values in ascending order; ``ranks``: rank of each value."""
    order = sorted(range(len(values)), key=lambda i: (values[i], i))
    if name == "order":
        return tuple(i + 1 for i in order)
    ranks = [0] * len(values)
    for rank, i in enumerate(order, 1):
        ranks[i] = rank
    return tuple(ranks)


def _small(result: Fraction) -> Fraction:
    if max(result.numerator.bit_length(), result.denominator.bit_length()) > MAX_BITS:
        raise InputError(f"a formula's result has more than {MAX_BITS} bits")
    return result


def _divide(v: list[Fraction]) -> Fraction:
    if not v[1]:
        raise InputError("a formula divides by zero")
    return v[0] / v[1]


def _power(v: list[Fraction]) -> Fraction:
    base, exponent = v
    if exponent.denominator != 1 or abs(exponent) > MAX_BITS or (not base and exponent < 0):
        raise InputError("power takes a small whole exponent")
    bits = max(base.numerator.bit_length(), base.denominator.bit_length())
    if bits * abs(exponent) > MAX_BITS:
        raise InputError(f"a power has more than {MAX_BITS} bits")
    return Fraction(base**exponent.numerator)


def _factorial(v: list[Fraction]) -> Fraction:
    if v[0].denominator != 1 or not 0 <= v[0] <= MAX_FACTORIAL:
        raise InputError(f"factorial takes a whole number up to {MAX_FACTORIAL}")
    return Fraction(math.factorial(v[0].numerator))


def _product(v: list[Fraction]) -> Fraction:
    result = Fraction(1)
    for factor in v:
        result = _small(result * factor)
    return result


_MANY = 10_000
_OPERATIONS: dict[str, tuple[int, int, Callable[[list[Fraction]], Fraction]]] = {
    "add": (1, _MANY, lambda v: sum(v, Fraction(0))),
    "subtract": (2, 2, lambda v: v[0] - v[1]),
    "multiply": (1, _MANY, _product),
    "divide": (2, 2, _divide),
    "excess": (2, 2, lambda v: _divide([v[0] - v[1], v[1]])),
    "power": (2, 2, _power),
    "factorial": (1, 1, _factorial),
    "least": (1, _MANY, min),
    "most": (1, _MANY, max),
}
OPERATIONS = (*_OPERATIONS, "order", "ranks", "figure", "time", "optimum")
"""Every operation a formula may use."""

_RELATIONS: dict[str, Callable[[Fraction, Fraction], bool]] = {
    "greater": operator.gt,
    "at-least": operator.ge,
    "less": operator.lt,
    "at-most": operator.le,
    "equal": operator.eq,
}
