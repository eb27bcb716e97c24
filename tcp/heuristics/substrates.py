"""Substrates of a motherboard: clusters of holes, and the shortest lines that join their paths."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from tcp.instance import Instance
from tcp.travel import Ints

STARTS = 16
"""Ends of sub-paths from which joining is tried where the route may start anywhere."""


def substrates(
    instance: Instance, holes: Sequence[int], knn: int, ratio: float, most: int
) -> list[tuple[int, ...]]:
    """Cluster holes by K nearest neighbours and the nearest distance ratio.

    Parameters
    ----------
    instance : Instance
        Holes that must be drilled together stay together.
    holes : sequence of int
        The holes to cluster.
    knn : int
        Neighbours of a hole.
    ratio : float
        Neighbours within so many mean neighbour distances are joined.
    most : int
        Larger clusters are halved across their longer side.

    Returns
    -------
    list of tuple of int
        Clusters that partition the holes.
    """
    if len(holes) <= max(knn, 2):
        return [tuple(holes)]
    from scipy.spatial import KDTree

    index = np.array(holes, dtype=np.int64)
    piece = instance.workpiece
    places = np.stack([piece.x[index], piece.y[index]], axis=1)
    distance, near = KDTree(places).query(places, k=min(knn + 1, len(holes)))
    reach = ratio * float(distance[:, 1:].mean())
    one, k = np.nonzero(distance[:, 1:] <= reach)
    pairs = list(zip(one.tolist(), near[one, k + 1].tolist(), strict=True))
    place = {hole: k for k, hole in enumerate(holes)}
    slots = [(place[i], place[j]) for i, j in instance.rules.together if i in place and j in place]
    groups: list[Ints] = []
    for group in _components(len(holes), pairs + slots):
        groups += _halved(places, group, most) if not slots else [group]
    return [tuple(index[group].tolist()) for group in groups]


def _components(n: int, pairs: Iterable[tuple[int, int]]) -> list[Ints]:
    """Connected components by union-find, in the order of their first member."""
    parent = list(range(n))

    def root(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for i, j in pairs:
        a, b = root(i), root(j)
        parent[max(a, b)] = min(a, b)
    members: dict[int, list[int]] = defaultdict(list)
    for i in range(n):
        members[root(i)].append(i)
    return [np.array(group, dtype=np.int64) for group in members.values()]


def _halved(places: Ints, group: Ints, most: int) -> list[Ints]:
    """Halves across the longer side, until no part has more than ``most`` members."""
    if len(group) <= most:
        return [group]
    extent = np.ptp(places[group], axis=0)
    order = group[np.argsort(places[group, int(extent.argmax())], kind="stable")]
    middle = len(order) // 2
    return _halved(places, order[:middle], most) + _halved(places, order[middle:], most)


def join(instance: Instance, paths: Sequence[Sequence[int]]) -> tuple[int, ...]:
    """Step 7 of BMGA: join sub-paths by shortest lines, always on to the nearest end.

    From the given start or home; where there is none, from several ends of
    sub-paths, and the cheapest of the results is taken.
    """
    ends, form = instance.ends, instance.form
    before = () if ends.start is None else (ends.start,)
    after = () if ends.end is None or ends.end == ends.start else (ends.end,)
    outer = np.array([(p[0], p[-1]) for p in paths], dtype=np.int64)
    if ends.start is not None or ends.outward:
        first = ends.start if ends.start is not None else form.home
        return (*before, *_chain(instance, paths, outer, first, None), *after)
    tried = np.unique(np.linspace(0, 2 * len(paths) - 1, min(STARTS, 2 * len(paths))).astype(int))
    routes = [(*_chain(instance, paths, outer, -1, divmod(t, 2)), *after) for t in tried.tolist()]
    return min(routes, key=instance.cost)


def _chain(
    instance: Instance,
    paths: Sequence[Sequence[int]],
    outer: Ints,
    here: int,
    first: tuple[int, int] | None,
) -> list[int]:
    """All sub-paths one behind the other, from node ``here`` or from one end of one of them."""
    form, left, route = instance.form, np.ones(len(paths), dtype=bool), []
    banned = set(form.forbidden)
    while left.any():
        if first is None:
            number, end = _nearest(instance, outer, left, here, banned)
        else:
            number, end = first
            first = None
        path = list(paths[number])
        route += path if end == 0 else path[::-1]
        left[number] = False
        here = route[-1]
    return route


def _nearest(
    instance: Instance, outer: Ints, left: np.ndarray, here: int, banned: set[tuple[int, int]]
) -> tuple[int, int]:
    """Number and side of the nearest end that is left; a forbidden line only if all are."""
    numbers = np.flatnonzero(left)
    candidates = outer[numbers].ravel()
    costs = instance.form.costs(np.full(len(candidates), here), candidates)
    ranked = np.argsort(costs, kind="stable").tolist()
    for at in ranked:
        hole = int(candidates[at])
        if (min(here, hole), max(here, hole)) not in banned:
            return int(numbers[at // 2]), at % 2
    return int(numbers[ranked[0] // 2]), ranked[0] % 2
