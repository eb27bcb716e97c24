"""What a keyhole shows of an LP solution: a few atoms, and all the rest as one more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import blake2b

import numpy as np

from tcp.exact.branch_and_cut.proof import Floats
from tcp.jit import allocating
from tcp.travel import Ints


@dataclass(frozen=True, eq=False)
class Sight:
    """A few disjoint sets of nodes and the LP solution between them.

    Parameters
    ----------
    x : float array of shape (k + 1, k + 1)
        Values between the atoms; the last row and column are the rest of the graph.
    atoms : k arrays of nodes
        The atoms without the rest.
    """

    x: Floats
    atoms: Sequence[Ints]

    @property
    def name(self) -> bytes:
        """Tells sights apart; those that look the same share it wherever they are."""
        return blake2b(np.round(self.x, 5).tobytes(), digest_size=16).digest()


@allocating
def between(ptr: Ints, other: Ints, weight: Floats, vertices: Ints, part: Ints) -> Floats:
    """Values between parts of a graph; ``vertices[k]`` is in ``part[k]``, all others in the last.

    The graph's adjacency lists are ``other[ptr[v]:ptr[v+1]]``, with values ``weight``.
    """
    rest = part.max() + 1
    label = np.full(len(ptr) - 1, rest)
    for k in range(len(vertices)):
        label[vertices[k]] = part[k]
    x = np.zeros((rest + 1, rest + 1))
    for k in range(len(vertices)):
        v, a = vertices[k], part[k]
        for e in range(ptr[v], ptr[v + 1]):
            b = label[other[e]]
            if a != b:
                x[a, b] += weight[e]
            if b == rest:
                x[rest, a] += weight[e]
    return x
