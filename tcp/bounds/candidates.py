"""Candidate pairs: who lies near whom in the travel model's own norm."""

from __future__ import annotations

import numpy as np

from tcp.instance import TourForm
from tcp.nearness import norm, places
from tcp.travel import Ints


def near_pairs(form: TourForm, nodes: Ints, width: int) -> Ints:
    """Pairs of each node with its ``width`` nearest others.

    Parameters
    ----------
    form : TourForm
        The costs.
    nodes : int64 array of shape (n,)
        Real nodes of the form; pairs are places in this array.
    width : int
        Partners per node, fewer where there are not so many.

    Returns
    -------
    int64 array of shape (m, 2)
        Each pair once, i < j.
    """
    n = nodes.size
    width = min(width, n - 1)
    if width < 1:
        return np.empty((0, 2), dtype=np.int64)
    if form.matrix is not None:
        full = form.matrix[np.ix_(nodes, nodes)]
        near = np.argpartition(full, width, axis=1)[:, : width + 1]
    else:
        from scipy.spatial import cKDTree

        fx, fy, p = norm(form.rule)
        where = places(np.column_stack([form.x[nodes], form.y[nodes]]), fx, fy)
        near = cKDTree(where).query(where, width + 1, p=p)[1]
    i = np.repeat(np.arange(n), near.shape[1])
    j = near.ravel().astype(np.int64)
    return distinct(i, j, n)


def distinct(i: Ints, j: Ints, n: int) -> Ints:
    """The pairs of two different nodes below ``n``, each once, as rows with i < j."""
    keys = np.unique(np.minimum(i, j)[i != j] * n + np.maximum(i, j)[i != j])
    return np.column_stack(np.divmod(keys, n))
