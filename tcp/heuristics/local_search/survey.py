"""From a tour form to the ground: renumbering, forced and forbidden edges, candidate lists."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tcp.heuristics.local_search.ground import (
    HOW,
    MATRIX,
    MAX,
    OTHERWISE,
    ROOT,
    RULED,
    SUM,
    VIRTUAL,
    Ground,
    Small,
)
from tcp.heuristics.local_search.neighbours import hilbert_order, near_nodes
from tcp.heuristics.local_search.search import DEEPEST
from tcp.instance import TourForm
from tcp.kernels import pack
from tcp.nearness import norm
from tcp.travel import Ints, Kind


def survey(form: TourForm, width: int = 10, late: Callable[[], bool] = lambda: False) -> Ground:
    """Prepare ``form``: renumber its nodes, list the ``width`` best neighbours of each.

    Where it gets ``late`` on the way, the lists stay empty.

    O(n log n) time and O(n) memory (an explicit matrix is copied).
    """
    bare = bare_ground(form)
    near, dist = near_nodes(bare, form.real, width, late)
    dist[form.real :] = 0  # the virtual node's candidates vary
    return bare._replace(near=near, dist=dist)


def bare_ground(form: TourForm) -> Ground:
    """The renumbered nodes of ``form`` without candidates."""
    n, real = form.size, form.real
    order = hilbert_order(form)
    label = np.append(order, np.arange(real, n))
    number = np.empty(n, np.int64)
    number[label] = np.arange(n)
    rule, xy, factors = _costs(form, order)
    return Ground(
        rule=rule,
        xy=xy,
        pairs=_pairs(form, number),
        near=np.zeros((n, 0), np.int32),
        dist=np.zeros((n, 0), np.int64),
        mates=_mates(number, form.forced, n),
        label=label,
        scales=factors,
    )


def _costs(form: TourForm, order: Ints) -> tuple[Ints, Ints, tuple[float, float, float]]:
    """Rule and coordinates (or matrix) as :class:`Ground` has them, and the norm's scales."""
    rule = np.zeros(RULED + 1, np.int64)
    rule[VIRTUAL], rule[RULED] = form.virtual, bool(form.forced or form.forbidden)
    rule[HOW], rule[MATRIX] = OTHERWISE, form.matrix is not None
    if form.matrix is not None:
        return rule, np.ascontiguousarray(form.matrix[np.ix_(order, order)]), (1.0, 1.0, 1.0)
    packed, factors = pack(form.rule), norm(form.rule)
    rule[: packed.size] = packed
    xy = np.zeros((form.size, 2), np.int64)
    xy[: form.real, 0], xy[: form.real, 1] = form.x[order], form.y[order]
    if rule[RULED]:
        return rule, xy, factors
    if form.rule.kind is Kind.NORM:
        rule[HOW] = ROOT
    elif form.rule.kind in (Kind.SUM, Kind.MAX) and form.rule.params[2] == 1:
        rule[HOW] = SUM if form.rule.kind is Kind.SUM else MAX
        xy *= np.array(form.rule.params[:2], np.int64)
        factors = (1.0, 1.0, factors[2])
    return rule, xy, factors


def _mates(number: Ints, forced: tuple[tuple[int, int], ...], n: int) -> Small:
    mates = np.full((n, 2), -1, np.int32)
    for a, b in forced:
        for v, w in ((number[a], number[b]), (number[b], number[a])):
            mates[v, 0 if mates[v, 0] < 0 else 1] = w
    return mates


def _pairs(form: TourForm, number: Ints) -> Ints:
    """The ruled pairs and what they cost extra, as :func:`ground.ruled` looks them up."""
    n = form.size
    worth = _worth(form) if form.forced or form.forbidden else 0
    rows = [np.array([[n, worth * len(form.forced)]], np.int64)]
    for edges, extra in ((form.forced, -worth), (form.forbidden, worth)):
        if edges:
            both = number[np.array(edges, np.int64)]
            keys = np.concatenate([both @ [n, 1], both @ [1, n]])
            rows.append(np.column_stack([keys, np.full(keys.size, extra)]))
    table = np.concatenate(rows)
    return table[np.append(0, 1 + np.argsort(table[1:, 0]))]


def _worth(form: TourForm) -> int:
    """More than any exchange of :data:`DEEPEST` edges can gain, in whole numbers of 63 bits."""
    if form.matrix is not None:
        peak = int(form.matrix.max())
    else:
        dx, dy = (np.array([v.max() - v.min()]) for v in (form.x, form.y))
        peak = int(form.rule.costs(dx, dy)[0])
    worth = (DEEPEST + 1) * (peak + 1)
    return worth if (worth + peak) * form.size < 2**62 else peak + 1
