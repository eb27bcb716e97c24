"""The workpiece: its holes, exactly as printed.

A coordinate is a decimal number, and 0.1 is not a binary float.  A workpiece
therefore stores whole numbers of *steps*: hole ``i`` lies at ``x[i] * step``,
``y[i] * step`` millimetres, where ``step`` is an exact fraction (0.001 mm, or
25.4/10000 mm for inches with four decimals).  Two ``int64`` arrays hold a
million holes in 16 MB, and every later computation starts from integers.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from decimal import Context, Decimal, InvalidOperation
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcp.errors import InputError
from tcp.words import shown

Ints = NDArray[np.int64]

MAX_STEPS = 2**52
"""Largest coordinate, in steps: beyond it even a difference could not be squared safely."""

MAX_DIGITS = 60
"""More digits than this, or a magnitude beyond 10^30, is not a coordinate."""

_EXACT = Context(prec=2 * MAX_DIGITS)

INCH = Fraction(254, 10)
"""Millimetres to the inch."""


@dataclass(frozen=True)
class Hole:
    """One hole, as a view on a row of a :class:`Workpiece` (lengths in mm)."""

    id: str
    x: Fraction
    y: Fraction
    diameter: Fraction | None = None
    tool: str | None = None


@dataclass(frozen=True, eq=False)
class Workpiece:
    """Holes on an integer grid.

    Parameters
    ----------
    name : str
        Shown in tables; usually the file's stem.
    ids : tuple of str
        One name per hole, all different; the order is the file's order.
    x, y : int64 arrays of shape (n,)
        Coordinates in steps.
    step : Fraction
        Millimetres per step, > 0.
    diameters : tuple of (Fraction or None), optional
        Millimetres; empty when unknown.
    tools : tuple of (str or None), optional
        Tool names; empty when unknown.
    matrix : int64 array of shape (n, n), optional
        Travel times given explicitly (TSPLIB ``EXPLICIT``); coordinates are
        then only for display.

    Raises
    ------
    InputError
        If there are no holes, ids repeat, lengths disagree, or the matrix is not symmetric with
        zeros from each hole to itself.
    """

    name: str
    ids: tuple[str, ...]
    x: Ints
    y: Ints
    step: Fraction = Fraction(1)
    diameters: tuple[Fraction | None, ...] = ()
    tools: tuple[str | None, ...] = ()
    matrix: Ints | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        n = len(self.ids)
        if n == 0:
            raise InputError(f"{self.name}: a workpiece needs at least one hole")
        if len(set(self.ids)) != n:
            raise InputError(f"{self.name}: hole ids must be unique")
        if self.step <= 0:
            raise InputError(f"{self.name}: the step must be positive")
        for array in (self.x, self.y):
            if array.shape != (n,) or array.dtype != np.int64:
                raise InputError(f"{self.name}: coordinates must be {n} whole numbers of steps")
            if int(np.abs(array).max()) > MAX_STEPS:
                raise InputError(f"{self.name}: a coordinate exceeds {MAX_STEPS} steps")
            array.setflags(write=False)
        for name in ("diameters", "tools"):
            if len(getattr(self, name)) not in (0, n):
                raise InputError(f"{self.name}: expected {n} {name} or none")
        if self.matrix is not None:
            self._check_matrix(n)

    def _check_matrix(self, n: int) -> None:
        assert self.matrix is not None
        if self.matrix.shape != (n, n) or self.matrix.dtype != np.int64:
            raise InputError(f"{self.name}: the travel matrix must be {n} x {n} whole numbers")
        if not np.array_equal(self.matrix, self.matrix.T):
            raise InputError(f"{self.name}: the travel matrix is not symmetric")
        if int(self.matrix.min()) < 0:
            raise InputError(f"{self.name}: the travel matrix has a negative entry")
        if self.matrix.diagonal().any():
            raise InputError(f"{self.name}: the travel matrix has an entry from a hole to itself")
        self.matrix.setflags(write=False)

    @property
    def nowhere(self) -> bool:
        """Whether no hole has a place of its own: several, all at the origin."""
        return len(self) > 1 and not self.x.any() and not self.y.any()

    @classmethod
    def from_decimals(
        cls,
        name: str,
        coordinates: Iterable[tuple[Decimal | str | int, Decimal | str | int]],
        ids: Sequence[str] | None = None,
        *,
        unit: Fraction = Fraction(1),
        diameters: Sequence[Fraction | None] = (),
        tools: Sequence[str | None] = (),
    ) -> Workpiece:
        """Build a workpiece from decimal numbers.

        Parameters
        ----------
        name : str
            The workpiece's name.
        coordinates : iterable of (x, y)
            Decimals, digit strings or ints; floats are refused.
        ids : sequence of str, optional
            Default ``"1" ... "n"``.
        unit : Fraction
            Millimetres per unit of the coordinates: 1, or :data:`INCH`.
        diameters, tools : sequences, optional
            As in the class.

        Raises
        ------
        InputError
            For numbers that are not finite or need more than 2^52 steps.
        """
        pairs = [(exact_decimal(x), exact_decimal(y)) for x, y in coordinates]
        decimals = max((-_exponent(v) for pair in pairs for v in pair), default=0)
        decimals = max(decimals, 0)
        x = _steps([p[0] for p in pairs], decimals, name)
        y = _steps([p[1] for p in pairs], decimals, name)
        names = tuple(ids) if ids is not None else tuple(str(i + 1) for i in range(len(pairs)))
        step = unit / 10**decimals
        return cls(name, names, x, y, step, tuple(diameters), tuple(tools))

    def __len__(self) -> int:
        return len(self.ids)

    def hole(self, i: int) -> Hole:
        """Hole number ``i`` (from 0) in millimetres."""
        return Hole(
            self.ids[i],
            int(self.x[i]) * self.step,
            int(self.y[i]) * self.step,
            self.diameters[i] if self.diameters else None,
            self.tools[i] if self.tools else None,
        )

    @cached_property
    def index(self) -> dict[str, int]:
        """From hole id to position in the file."""
        return {name: i for i, name in enumerate(self.ids)}

    @cached_property
    def coincident(self) -> tuple[tuple[str, ...], ...]:
        """Groups of two or more holes at one place; legal, travel 0, worth reporting."""
        order = np.lexsort((self.y, self.x))
        same = (np.diff(self.x[order]) == 0) & (np.diff(self.y[order]) == 0)
        groups: list[list[int]] = []
        for k in np.flatnonzero(same).tolist():
            first, second = order[k : k + 2].tolist()
            if groups and groups[-1][-1] == first:
                groups[-1].append(second)
            else:
                groups.append([first, second])
        return tuple(tuple(self.ids[i] for i in group) for group in sorted(groups))

    @cached_property
    def sha256(self) -> str:
        """Hash of what matters for travel: ids and exact coordinates, in file order."""
        digest = hashlib.sha256(f"tcp-workpiece-1\nstep {self.step}\n".encode())
        for name, x, y in zip(self.ids, self.x.tolist(), self.y.tolist(), strict=True):
            digest.update(f"{len(name)}:{name} {x} {y}\n".encode())
        if self.matrix is not None:
            digest.update(b"matrix\n" + np.ascontiguousarray(self.matrix, "<i8").tobytes())
        return digest.hexdigest()


def exact_decimal(value: Decimal | str | int) -> Decimal:
    """A finite decimal, exactly; floats are refused because they are not what was printed.

    Raises
    ------
    InputError
        If ``value`` is a float, not a number, not finite or beyond all measure.
    """
    if isinstance(value, float):
        raise InputError(f"{value!r} is a binary float; pass the digits as text or Decimal")
    try:
        number = Decimal(value)
    except InvalidOperation:
        raise InputError(f"{shown(str(value))} is not a number") from None
    if not number.is_finite():
        raise InputError(f"{shown(str(value))} is not a finite number")
    if len(number.as_tuple().digits) > MAX_DIGITS or (number and abs(number.adjusted()) > 30):
        raise InputError(
            f"{shown(str(value))} is beyond any workpiece; expected a length in mm or inch"
        )
    return number


def _exponent(value: Decimal) -> int:
    """Exponent of the last significant digit: 12.50 has -1, 300 has 0."""
    if not value:
        return 0
    exponent = value.normalize(_EXACT).as_tuple().exponent
    assert isinstance(exponent, int)
    return min(exponent, 0)


def _steps(values: list[Decimal], decimals: int, name: str) -> Ints:
    steps = [int(value.scaleb(decimals, _EXACT)) for value in values]
    if steps and max(map(abs, steps)) > MAX_STEPS:
        digits = f"{decimals} decimals" if decimals else "whole numbers"
        raise InputError(
            f"{name}: coordinates up to {max(map(abs, values))} with {digits} need more than "
            f"2^52 steps; round the coordinates or check the units"
        )
    return np.array(steps, dtype=np.int64)
