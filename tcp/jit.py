"""How kernels are compiled: cached on disk, and never stale.

numba keeps what it compiled beside the source and compiles again when the *file* of a kernel
changes; functions and constants that a kernel took from other files are baked into it and stay
what they were.  Here the cache also asks whether any file with kernels has changed: a constant
that is edited, or an update of the package, reaches every kernel.  For that a kernel may use
only names of files that import this module (a test reads them all).

Kernels take plain arrays.  What makes compiling long: a literal argument (``f(x, 0)``), for
which numba compiles the callee anew; whole-array statements (``a[:] = b``), which bring numpy's
checks and their messages; ``np.sort``, ``np.zeros`` and ``np.arange``; a large kernel that is
``inlined`` in many; and nesting, for a kernel is optimised again in every kernel above it.
Import this module only where compiled code is needed: it loads numba.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit


def digest_of_kernels(package: Path) -> bytes:
    """SHA-256 of every Python file below ``package`` that imports this module, and of this one."""
    digest = hashlib.sha256()
    for path in sorted(package.rglob("[!.]*.py")):  # an editor's locks begin with a dot
        text = path.read_bytes()
        if b"from tcp.jit import" in text:
            digest.update(str(path.relative_to(package)).encode() + b"\0" + text + b"\0")
    return digest.digest()


SOURCES = digest_of_kernels(Path(__file__).parent)


def cached(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """``numba.njit`` with these options and a cache on disk that is stamped with all kernels.

    Where no folder for the cache can be written, the kernel is compiled in every process.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        try:
            dispatcher = njit(cache=True, **options)(function)
        except RuntimeError:  # numba found no place for the cache
            return njit(**options)(function)
        if dispatcher is not function:  # as it is where numba is switched off
            file = dispatcher._cache._cache_file
            file._source_stamp = (file._source_stamp, SOURCES)
        return dispatcher

    return decorate


def on_disk(kernel: Any) -> bool:
    """Whether the cache holds what a kernel compiles to; True where a kernel has no cache."""
    file = getattr(getattr(kernel, "_cache", None), "_cache_file", None)
    return file is None or bool(file._load_index())


kernel = cached()
"""Decorator of a kernel whose errors Python shall see."""

lean = cached(_nrt=False)
"""The same for kernels that make no arrays.

numba counts references to every array that a call or a tuple hands on, by atomic operations,
which cost more than the few sums of an inner loop.
A lean kernel counts none: what called it holds the arrays.  numba refuses to compile one that
makes an array; none may return one.
"""

formula = cached(_nrt=False, error_model="numpy", no_cfunc_wrapper=True)
"""A lean kernel with numpy's error model, without which every division could raise."""

allocating = cached(nogil=True, error_model="numpy", no_cfunc_wrapper=True)
"""A kernel without the interpreter lock, for threads, that makes arrays."""

compiled = cached(_nrt=False, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
"""A lean kernel without the interpreter lock."""

inner = cached(
    _nrt=False, nogil=True, error_model="numpy", no_cfunc_wrapper=True, no_cpython_wrapper=True
)
"""The same for kernels that only other kernels call.

They have no entry for Python, which saves a tenth of the time to compile: calling one from there
ends the process.
"""

inlined = cached(
    _nrt=False, nogil=True, error_model="numpy", no_cfunc_wrapper=True, forceinline=True
)
"""The same for the smallest and most called ones, which LLVM must copy into their callers."""
