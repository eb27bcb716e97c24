"""Instances that benchmarks make themselves: uniform, clustered and lattice."""

from __future__ import annotations

import numpy as np

from tcp import Workpiece

MADE = {"lattice900": 900, "uniform1000": 1_000, "clustered1000": 1_000, "uniform10000": 10_000}
"""Names and holes."""


def generated(name: str) -> Workpiece:
    """``uniform1000``, ``clustered1000`` or ``lattice900``, seed 0."""
    kind = name.rstrip("0123456789")
    n, rng = int(name[len(kind) :]), np.random.default_rng(0)
    side = 40 * int(1_000 * n**0.5 / 31)
    if kind == "lattice":
        edge = round(n**0.5)
        y, x = (v.ravel().astype(np.int64) * 100 for v in np.mgrid[:edge, :edge])
    elif kind == "clustered":
        centres = rng.integers(0, side, (2, n // 50))
        x, y = (centres[:, np.arange(n) % (n // 50)] + rng.normal(0, 500, (2, n))).astype(np.int64)
    else:
        x, y = rng.integers(0, side, (2, n))
    return Workpiece(name, tuple(map(str, range(x.size))), x, y)
