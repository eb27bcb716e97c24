"""Two-level orthogonal arrays L_N(2^(N-1)), N a power of two (the HTGA paper's Table I)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcp.errors import UsageError


def orthogonal_array(factors: int) -> NDArray[np.int8]:
    """The smallest two-level array that holds so many factors.

    Column ``c = 1, 2, ...`` of run ``r`` is the parity of the bits that ``c``
    has in common with ``r`` read backwards: all non-zero linear functions over
    GF(2), in the order that makes the L_8 the paper's Table I, column by column.

    Parameters
    ----------
    factors : int
        Number of parameters, >= 1: L_8 serves up to 7, L_16 up to 15, ...

    Returns
    -------
    int8 array of shape (N, factors)
        Levels 0 and 1 (the paper's 1 and 2), N the smallest power of two above
        ``factors``.

    Raises
    ------
    UsageError
        If there is no factor.
    """
    if factors < 1:
        raise UsageError(f"an orthogonal array needs at least one factor, not {factors}")
    bits = factors.bit_length()
    runs = np.arange(1 << bits)
    columns = np.arange(1, factors + 1)
    levels = np.zeros((1 << bits, factors), dtype=np.int8)
    for bit in range(bits):
        of_run = (runs >> (bits - 1 - bit)) & 1
        of_column = (columns >> bit) & 1
        levels ^= (of_run[:, None] & of_column[None, :]).astype(np.int8)
    return levels
