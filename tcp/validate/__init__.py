"""The judge: what is true of a route, a claim or a certificate.  Imports no solver.

Three names: :func:`validate` judges one route and its claimed time,
:func:`audit` whole claims files, :func:`repair` mends a sequence.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tcp.validate.auditing import audit
    from tcp.validate.claim import validate
    from tcp.validate.repairs import repair

__all__ = ["audit", "repair", "validate"]

_HOME = {
    "audit": "tcp.validate.auditing",
    "repair": "tcp.validate.repairs",
    "validate": "tcp.validate.claim",
}


def __getattr__(name: str) -> Any:
    """The three names, imported when they are used: solving needs none of them."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOME[name]), name)
