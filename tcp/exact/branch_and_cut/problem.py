"""The tour problem as compiled code sees it: nodes, integer costs, fixed pairs, neighbours."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tcp.instance import Instance, TourForm
from tcp.jit import cached
from tcp.kernels import cost_of_move, pack
from tcp.nearness import norm, places
from tcp.travel import Ints, Kind

MATRIX = int(Kind.MATRIX)

NEIGHBOURS = 8
"""Nearest neighbours a node offers as candidate edges; quadrants add up to as many."""

Geometry = tuple[Ints, Ints, Ints, Ints, int]
"""Packed rule, x, y, matrix (0 x 0 where unused), virtual node: what compiled code needs."""


@cached(inline="always")
def edge_cost(geometry: Geometry, i: int, j: int) -> int:
    """Cost of the pair ``i``, ``j`` in quanta."""
    rule, x, y, matrix, virtual = geometry
    if i == virtual or j == virtual:
        return np.int64(0)
    if rule[0] == MATRIX:
        return matrix[i, j]
    return np.int64(cost_of_move(rule, x[i] - x[j], y[i] - y[j]))


@dataclass(frozen=True, eq=False)
class Problem:
    """A tour form ready for the engine.

    Parameters
    ----------
    form : TourForm
        Nodes, costs, forced and forbidden pairs; at least 3 nodes.
    granularity : int
        Divides the cost of every tour.
    """

    form: TourForm
    granularity: int

    @classmethod
    def of(cls, instance: Instance) -> Problem:
        """The problem of an instance."""
        return cls(instance.form, instance.granularity)

    @property
    def size(self) -> int:
        """Number of nodes."""
        return self.form.size

    @cached_property
    def geometry(self) -> Geometry:
        """What :func:`edge_cost` reads."""
        form = self.form
        x, y = np.zeros(form.size, np.int64), np.zeros(form.size, np.int64)
        x[: form.real], y[: form.real] = form.x, form.y
        matrix = np.zeros((0, 0), np.int64) if form.matrix is None else form.matrix
        return pack(form.rule), x, y, np.ascontiguousarray(matrix), form.virtual

    def costs(self, i: Ints, j: Ints) -> Ints:
        """Costs of pairs, in quanta."""
        return self.form.costs(i, j)

    @cached_property
    def peak(self) -> int:
        """An upper bound on the cost of any pair, >= 1."""
        form = self.form
        if form.matrix is not None:
            return max(1, int(form.matrix.max()))
        dx, dy = np.array([np.ptp(form.x)]), np.array([np.ptp(form.y)])
        return max(1, 2 + int(form.rule.costs(dx, dy)[0]))

    @cached_property
    def forced(self) -> Ints:
        """Keys of the pairs every tour uses."""
        return self._keys(self.form.forced)

    @cached_property
    def forbidden(self) -> Ints:
        """Keys of the pairs no tour uses."""
        return self._keys(self.form.forbidden)

    def _keys(self, pairs: tuple[tuple[int, int], ...]) -> Ints:
        array = np.array(pairs, np.int64).reshape(-1, 2)
        return np.unique(self.keys(array[:, 0], array[:, 1]))

    def keys(self, i: Ints, j: Ints) -> Ints:
        """One number a pair: ``min * size + max``."""
        i, j = np.asarray(i, np.int64), np.asarray(j, np.int64)
        return np.minimum(i, j) * self.size + np.maximum(i, j)

    def pairs(self, keys: Ints) -> tuple[Ints, Ints]:
        """The pairs of keys, smaller node first."""
        return keys // self.size, keys % self.size

    @cached_property
    def neighbours(self) -> Ints:
        """Keys of candidate pairs: near neighbours, near ones in each quadrant, virtual edges."""
        form, real = self.form, self.form.real
        k = min(NEIGHBOURS, real - 1)
        found = [self.forced]
        if form.virtual >= 0:
            holes = np.arange(real)
            found.append(self.keys(holes, np.full_like(holes, form.virtual)))
        if k > 0 and form.matrix is not None:
            near = np.argsort(form.matrix, axis=1, kind="stable")[:, : k + 1]
            found.append(self._star(near))
        elif k > 0:
            found += self._near(k)
        keys = np.unique(np.concatenate(found))
        return keys[~np.isin(keys, self.forbidden)]

    @cached_property
    def nearest(self) -> Ints:
        """Keys of the few nearest pairs of every node: columns to begin with."""
        if self.form.matrix is not None or self.form.real < 8:
            return self.neighbours[self.neighbours // self.size < self.form.real]
        keys = np.unique(self._near(5)[0])
        return keys[~np.isin(keys, self.forbidden)]

    def _near(self, k: int) -> list[Ints]:
        from scipy.spatial import cKDTree

        form = self.form
        fx, fy, p = norm(form.rule)
        points = places(np.column_stack((form.x, form.y)), fx, fy)
        tree = cKDTree(points)
        pool = min(5 * k, form.real - 1)
        _, near = tree.query(points, pool + 1, p=p)
        found = [self._star(near[:, : k + 1])]
        delta = points[near] - points[:, None, :]
        quadrant = (delta[..., 0] >= 0) * 2 + (delta[..., 1] >= 0)
        for q in range(4):
            inside = quadrant == q
            chosen = inside & (np.cumsum(inside, axis=1) <= 3)
            rows, columns = np.nonzero(chosen)
            found.append(self._proper(rows, near[rows, columns]))
        return found

    def _star(self, near: Ints) -> Ints:
        rows = np.repeat(np.arange(near.shape[0]), near.shape[1])
        return self._proper(rows, near.ravel())

    def _proper(self, i: Ints, j: Ints) -> Ints:
        keep = i != j
        return self.keys(i[keep], j[keep])
