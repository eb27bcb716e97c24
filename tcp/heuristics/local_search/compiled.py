"""How this package compiles: cached, without the interpreter lock, without reference counts.

A search passes a dozen arrays through small functions.  Counting references to
them takes ten times as long as the work (150 ns instead of 15 ns for the cost
of one edge), and is of no use where arrays are only borrowed from the caller:
``_nrt=False`` turns it off, as numba does in its own helpers.  A function
compiled this way must not allocate and must not hand arrays back to Python.
"""

from __future__ import annotations

from numba import njit

compiled = njit(cache=True, nogil=True, error_model="numpy", _nrt=False)
"""Decorator for functions that borrow arrays."""

inlined = njit(cache=True, nogil=True, error_model="numpy", _nrt=False, inline="always")
"""The same for the smallest ones, copied into their callers."""

allocating = njit(cache=True, nogil=True, error_model="numpy")
"""Decorator for functions that make arrays; not for inner loops."""
