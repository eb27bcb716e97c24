"""From a tour form to the ground: renumbering, forced and forbidden edges, candidate lists."""

from __future__ import annotations

import numpy as np

from tcp.heuristics.local_search.ground import GENERAL, MATRIX, MAX, SUM, Ground, Small
from tcp.heuristics.local_search.neighbours import hilbert_order, near_nodes, scales
from tcp.instance import TourForm
from tcp.kernels import pack
from tcp.travel import Ints, Kind


def survey(form: TourForm, width: int = 10) -> Ground:
    """Prepare ``form``: renumber its nodes, list the ``width`` best neighbours of each.

    O(n log n) time and O(n) memory (an explicit matrix is copied).
    """
    n, real = form.size, form.real
    order = hilbert_order(form)
    label = np.append(order, np.arange(real, n))
    number = np.empty(n, np.int64)
    number[label] = np.arange(n)
    matrix = np.zeros((1, 1), np.int64)
    if form.matrix is not None:
        matrix = np.ascontiguousarray(form.matrix[np.ix_(order, order)])
    x, y = np.zeros(n, np.int64), np.zeros(n, np.int64)
    x[:real], y[:real] = form.x[order], form.y[order]
    factors = scales(form.rule) if form.matrix is None else (1.0, 1.0, 1.0)
    kind = GENERAL if form.matrix is None else MATRIX
    if form.rule.kind in (Kind.SUM, Kind.MAX) and form.rule.params[2] == 1:
        kind = SUM if form.rule.kind is Kind.SUM else MAX
        x, y = x * form.rule.params[0], y * form.rule.params[1]
        factors = (1.0, 1.0, factors[2])
    ban_from, ban = _partners(number, form.forbidden, n)
    bare = Ground(
        x=x,
        y=y,
        form=kind,
        rule=pack(form.rule),
        matrix=matrix,
        virtual=int(form.virtual),
        penalty=_penalty(form),
        near=np.zeros((n, 0), np.int32),
        dist=np.zeros((n, 0), np.int64),
        mates=_mates(number, form.forced, n),
        ban_from=ban_from,
        ban=ban,
        label=label,
        scales=factors,
    )
    near, dist = near_nodes(bare, real, width)
    return bare._replace(near=near, dist=dist)


def _mates(number: Ints, forced: tuple[tuple[int, int], ...], n: int) -> Small:
    mates = np.full((n, 2), -1, np.int32)
    for a, b in forced:
        for v, w in ((number[a], number[b]), (number[b], number[a])):
            mates[v, 0 if mates[v, 0] < 0 else 1] = w
    return mates


def _partners(number: Ints, pairs: tuple[tuple[int, int], ...], n: int) -> tuple[Ints, Small]:
    if not pairs:
        return np.zeros(n + 1, np.int64), np.zeros(0, np.int32)
    both = number[np.array(pairs, np.int64)]
    both = np.concatenate([both, both[:, ::-1]])
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    starts = np.searchsorted(both[:, 0], np.arange(n + 1))
    return starts.astype(np.int64), both[:, 1].astype(np.int32)


def _penalty(form: TourForm) -> int:
    """More than any edge costs, and small enough that sums stay whole in 63 bits."""
    if not form.forbidden:
        return 0
    if form.matrix is not None:
        peak = int(form.matrix.max())
    else:
        dx, dy = (np.array([v.max() - v.min()]) for v in (form.x, form.y))
        peak = int(form.rule.costs(dx, dy)[0])
    return (2 if 3 * (peak + 1) * form.size < 2**62 else 1) * peak + 1
