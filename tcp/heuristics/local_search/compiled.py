"""How this package compiles: cached, without the interpreter lock.

Kernels take plain arrays; only the three that tell costs travel as one tuple, which
costs nothing.  Tours and work space as tuples compile as fast, but make the search 4
to 8 % slower: a function that is not inlined is passed all their scalars.

What makes compiling long: a literal argument (``f(x, 0)``), for which numba compiles
the callee anew; whole-array statements (``a[:] = b``), which bring numpy's checks and
their messages; ``np.sort``; and nesting, for a kernel is optimised again in every
kernel above it.
"""

from __future__ import annotations

from numba import njit

compiled = njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
"""Decorator of every kernel that Python calls."""

inner = njit(
    cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True, no_cpython_wrapper=True
)
"""The same for kernels that only other kernels call.

They have no entry for Python, which saves a tenth of the time to compile: calling one from there
ends the process.
"""

inlined = njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True, forceinline=True)
"""The same for the smallest and most called ones, which LLVM must copy into their callers."""
