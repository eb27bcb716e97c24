"""A result as plain data, for ``--json``."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from tcp.result import Result, decimal


def result_data(result: Result) -> dict[str, Any]:
    """The result as JSON-ready data; times are exact decimal strings, holes their ids."""
    described = result.instance.describe()
    described["quantum"] = _exact(result.instance.quantum)
    return {
        "instance": described,
        "route": None if result.ids is None else list(result.ids),
        "cost": _exact(result.time),
        "lower_bound": _exact(result.lower_bound),
        "gap": result.gap,
        "status": str(result.status),
        "proof": str(result.proof),
        "solver": result.solver,
        "seed": result.seed,
        "stop_reason": str(result.stopped),
        "runtime_s": round(result.seconds, 6),
        "versions": dict(result.versions),
    }


def _exact(value: Fraction | None) -> str | None:
    return None if value is None else decimal(value)
