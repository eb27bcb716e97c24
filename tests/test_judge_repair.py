"""Repairs: the paper's numbers, every smallest repair, and the exact cheapest one."""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Ends, Instance, Model, Rules, Travel, Workpiece
from tcp.files.order import order_of
from tcp.validate.repairs import repair
from tcp.validate.route import faults

HOME = (Fraction(-1), Fraction(2))
ENDS = [
    Ends(),
    Ends(start=1),
    Ends(end=2),
    Ends(closed=True),
    Ends(closed=True, start=2),
    Ends(home=HOME, outward=True),
    Ends(home=HOME, back=True),
    Ends(home=HOME, outward=True, back=True, start=1),
]


def keeps_the_order(entries: list[int], route: tuple[int, ...], n: int) -> bool:
    """Definition of a repair: what stays of the sequence stays in its order."""
    missing = set(range(n)) - set(entries)
    kept = [h for h in route if h not in missing]
    at = -1
    single = {h for h in entries if entries.count(h) == 1 and h >= 0}
    if set(kept) != {h for h in entries if h >= 0} or not single <= set(kept):
        return False
    for hole in kept:  # greedy matching of a subsequence
        places = [k for k, e in enumerate(entries) if e == hole and k > at]
        if not places:
            return False
        at = places[0]
    return True


@st.composite
def broken(draw):
    n = draw(st.integers(2, 6))
    points = draw(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=n, max_size=n))
    entries = draw(st.lists(st.integers(-1, n - 1), min_size=1, max_size=n + 2))
    piece = Workpiece.from_decimals("p", [(str(x), str(y)) for x, y in points])
    ends = draw(st.sampled_from([e for e in ENDS if (e.start or 0) < n and (e.end or 0) < n]))
    model = draw(st.sampled_from([Model.SEQUENTIAL, Model.SIMULTANEOUS]))
    rules = Rules(forbidden=((0, 1),)) if draw(st.booleans()) and n > 2 else Rules()
    return Instance(piece, Travel(model), ends, rules), entries


@settings(max_examples=250, deadline=None)
@given(broken())
def test_cheapest_equals_brute_force(case):
    instance, entries = case
    n = len(instance)
    labels = [str(e + 1) if e >= 0 else "x" for e in entries]
    found = repair(instance, labels)
    routes = [
        r
        for r in itertools.permutations(range(n))
        if not faults(instance, r) and _kept(instance, entries, r)
    ]
    assert found.refusal is None
    if not routes:
        assert found.best is None
        return
    assert found.best is not None
    assert found.best.cost == min(instance.cost(r) for r in routes)
    assert _kept(instance, entries, found.best.route)


def _kept(instance: Instance, entries: list[int], route: tuple[int, ...]) -> bool:
    n = len(instance)
    if not instance.ends.closed:
        return keeps_the_order(entries, route, n)
    # a closed tour may be written to begin at a missing hole, or be turned to its fixed start
    return keeps_the_order(entries, route, n)


@settings(max_examples=150, deadline=None)
@given(broken())
def test_smallest_repairs_are_all_there_are(case):
    instance, entries = case
    if instance.rules.forbidden or instance.ends != Ends():
        instance = Instance(instance.workpiece, instance.travel)
    n = len(instance)
    labels = [str(e + 1) if e >= 0 else "x" for e in entries]
    found = repair(instance, labels)
    for one in found.smallest:
        assert not faults(instance, one.route)
        assert instance.cost(one.route) == one.cost
    if found.total > 500 or not found.complete:
        return
    assert len(found.smallest) == found.total
    want = {
        r
        for r in itertools.permutations(range(n))
        if _distance(entries, r) == found.changes and _smallest(entries, r, n)
    }
    assert {r.route for r in found.smallest} == want


def _distance(entries: list[int], route: tuple[int, ...]) -> int:
    """Edit distance (replace, delete, insert)."""
    row = list(range(len(route) + 1))
    for i, e in enumerate(entries, 1):
        before, row = row, [i]
        for j, r in enumerate(route, 1):
            row.append(min(before[j] + 1, row[-1] + 1, before[j - 1] + (e != r)))
    return row[-1]


def _smallest(entries: list[int], route: tuple[int, ...], n: int) -> bool:
    """Reachable by replacing surplus entries by missing holes, then deleting or inserting."""
    places = {h: [k for k, e in enumerate(entries) if e == h] for h in set(entries) if h >= 0}
    missing = [h for h in range(n) if h not in places]
    for stay in itertools.product(*places.values()):
        kept = dict(zip(stay, places, strict=True))
        free = [k for k in range(len(entries)) if k not in kept]
        m = min(len(free), len(missing))
        for slots in itertools.permutations(free, m):
            for holes in itertools.combinations(missing, m):
                filled = kept | dict(zip(slots, holes, strict=True))
                base = [filled[k] for k in sorted(filled)]
                if [h for h in route if h in set(base)] == base:
                    return True
    return False


def test_nothing_to_repair():
    piece = Workpiece.from_decimals("p", [("0", "0"), ("1", "0"), ("3", "0")])
    found = repair(Instance(piece), "1 3 2")
    assert found.changes == 0 and found.total == 1
    assert [r.route for r in found.smallest] == [(0, 2, 1)]
    assert found.best is not None and found.best.route == (0, 2, 1)


def test_what_is_too_hard_is_refused_in_words():
    n = 40
    piece = Workpiece.from_decimals("p", [(str(i), "0") for i in range(n)])
    found = repair(Instance(piece), ["1"] * n)
    assert found.best is None and "at most 14" in (found.refusal or "")
    assert not found.complete and len(found.smallest) > 0


def test_long_sequences_with_few_faults():
    n = 3000
    piece = Workpiece.from_decimals("p", [(str(i), "0") for i in range(n)])
    route = np.arange(1, n + 1)
    route[1500] = 1
    found = repair(Instance(piece), order_of(route, piece))
    assert found.best is not None and found.best.cost == n - 1
    assert found.best.route == tuple(range(n))


@pytest.mark.parametrize("ends", ENDS, ids=str)
def test_every_kind_of_ends_is_repaired(ends):
    piece = Workpiece.from_decimals("p", [(str(i * i), str(i % 2)) for i in range(5)])
    found = repair(Instance(piece, ends=ends), "2 2 3 1 4")
    assert found.best is None or not faults(found.instance, found.best.route)
