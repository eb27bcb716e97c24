"""How this package compiles: cached, without the interpreter lock.

Kernels take plain arrays.  Named tuples of arrays are unpacked at the call: a
compiled function that is not inlined would pass hundreds of scalars for them.
"""

from __future__ import annotations

from numba import njit

compiled = njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
"""Decorator of every kernel here."""

inlined = njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True, forceinline=True)
"""The same for the smallest and most called ones, which LLVM must copy into their callers."""
