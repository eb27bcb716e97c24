"""What else a claimed time could mean: other travel, other ends, other units, another order.

Each reading is a complete alternative: the sequence, the machine and the ends
it supposes, and the time that follows.  Only readings whose time agrees with
the claim, to the digits printed, are reported.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from tcp.errors import UsageError
from tcp.files.printed import Agreement, Printed
from tcp.instance import Ends, Instance
from tcp.result import decimal
from tcp.travel import Kind, Model, Travel
from tcp.validate.sequence import walk
from tcp.workpiece import INCH, Workpiece

Ints = NDArray[np.int64]

SWAP_LIMIT = 2000
"""All pairs of entries are tried up to this length."""

MIRROR_LIMIT = 100_000

FINE = tuple(Fraction(1, 10**places) for places in (12, 10, 8, 6, 5, 4))
"""Quanta by which a time is measured that no quantum defines."""

_ORIGIN = (Fraction(0), Fraction(0))
_UNITS = (("", Fraction(1)), ("inch for mm", INCH), ("mm for inch", 1 / INCH))
_NAMES = {
    Model.SEQUENTIAL: "sequential axes (Case 1)",
    Model.SIMULTANEOUS: "simultaneous axes (Case 2)",
    Model.EUCLIDEAN: "Euclidean distance",
}


@dataclass(frozen=True)
class Reading:
    """An alternative that makes a claim come true.

    Parameters
    ----------
    name : str
        The differences from the claim as stated, in words.
    time : Fraction
        The time it gives.
    agreement : Agreement
        Whether the printed number equals it, or rounds it.
    """

    name: str
    time: Fraction
    agreement: Agreement


def slack(instance: Instance, moves: int) -> Fraction:
    """How far a sum of ``moves`` rounded costs can lie from the exact time.

    Where a file or the user states the quantum, rounded costs are what times are.
    """
    rule = instance.rule
    exact = (rule.kind in (Kind.SUM, Kind.MAX) and rule.params[2] == 1) or rule.kind is Kind.MATRIX
    if exact or instance.travel.quantum is not None:
        return Fraction(0)
    return instance.quantum * (moves + 1) / (1 if rule.up else 2)


def fine(instance: Instance, moves: int) -> tuple[Instance, Fraction]:
    """The instance in the finest quantum that fits, and what it leaves open in so many moves.

    Only the default quantum is ours to refine.
    """
    if slack(instance, moves) == 0:
        return instance, Fraction(0)
    for quantum in FINE:
        try:
            finer = replace(instance, travel=replace(instance.travel, quantum=quantum))
            finer.rule  # noqa: B018  (bound now: it may not fit)
        except UsageError:
            continue
        return finer, quantum * (moves + 1) / (1 if finer.rule.up else 2)
    return instance, slack(instance, moves)


def readings(instance: Instance, entries: Ints, claimed: Printed) -> list[Reading]:
    """Every other reading that gives the claimed time.

    Parameters
    ----------
    instance : Instance
        The problem as stated.
    entries : int64 array
        Hole indices as walked; duplicates are allowed, unknown holes are not.
    claimed : Printed
        The claimed time.
    """
    found: list[Reading] = []
    if len(entries) > 2 * len(instance) + 10:
        return found  # far more entries than holes: no reading makes that a route
    for order_name, order in _orders(instance, entries):
        for machine_name, machine in _machines(instance):
            finer, off = fine(machine, len(order))
            for end_name, time in _times(finer, order):
                for unit_name, unit in _UNITS:
                    parts = (order_name, machine_name, end_name, unit_name)
                    name = ", ".join(part for part in parts if part)
                    if name:
                        _keep(found, name, time * unit, claimed, off * unit)
    return sorted(found, key=lambda r: (r.name.count(","), list(Agreement).index(r.agreement)))


def _keep(found: list[Reading], name: str, time: Fraction, claimed: Printed, off: Fraction) -> None:
    agreement = claimed.agreement(time, off)
    if agreement.holds and claimed.value and name not in {r.name for r in found}:
        found.append(Reading(name, time, agreement))


def _orders(instance: Instance, entries: Ints) -> Iterator[tuple[str, Ints]]:
    yield "", entries
    n = len(instance)
    if len(entries) != n or n < 3 or bool((np.bincount(entries, minlength=n) != 1).any()):
        return
    yield "read as the place of each hole instead of the hole at each place", np.argsort(entries)
    if n <= MIRROR_LIMIT:
        for name, relabel in _mirrors(instance.workpiece):
            yield name, relabel[entries]


def _mirrors(workpiece: Workpiece) -> Iterator[tuple[str, Ints]]:
    """Relabellings that a mirrored or turned board would mean, where the holes are symmetric."""
    x, y = workpiece.x, workpiece.y
    flip_x, flip_y = int(x.min() + x.max()) - x, int(y.min() + y.max()) - y
    for name, px, py in (
        ("board mirrored left to right", flip_x, y),
        ("board mirrored top to bottom", x, flip_y),
        ("board turned by 180 degrees", flip_x, flip_y),
    ):
        at = {p: i for i, p in enumerate(zip(x.tolist(), y.tolist(), strict=True))}
        image = [at.get(p) for p in zip(px.tolist(), py.tolist(), strict=True)]
        if None not in image and image != list(range(len(image))):
            yield name, np.array(image, dtype=np.int64)


def _machines(instance: Instance) -> Iterator[tuple[str, Instance]]:
    """The instance as stated, then with every other travel model and kind of ends."""
    if instance.travel.model is Model.EXPLICIT:
        yield "", instance
        return
    for travel_name, travel in _travels(instance.travel):
        for ends_name, ends in _ends(instance.ends):
            name = ", ".join(n for n in (travel_name, ends_name) if n)
            try:
                machine = Instance(instance.workpiece, travel, ends)
                machine.rule  # noqa: B018  (bound now: some rules do not fit into 62 bits)
            except UsageError:
                continue
            yield name, machine


def _travels(travel: Travel) -> Iterator[tuple[str, Travel]]:
    yield "", travel
    for model, name in _NAMES.items():
        if model is not travel.model:
            yield name, Travel(model, travel.vx, travel.vy)
    if travel.vx != travel.vy:
        yield "speeds of the axes exchanged", replace(travel, vx=travel.vy, vy=travel.vx)


def _ends(ends: Ends) -> Iterator[tuple[str, Ends]]:
    yield "", ends
    if ends.closed or ends.home is not None:
        yield "open path", Ends(start=ends.start, end=ends.end)
    if not ends.closed:
        yield "closed tour", Ends(closed=True)
    home = ends.home or _ORIGIN
    where = f"home at {decimal(home[0])},{decimal(home[1])}"
    for legs, out, back in (
        ("both legs", True, True),
        ("outward leg", True, False),
        ("return leg", False, True),
    ):
        if (out, back) != (ends.outward, ends.back):
            yield f"{where} with {legs}", Ends(home=home, outward=out, back=back)


def _times(instance: Instance, order: Ints) -> Iterator[tuple[str, Fraction]]:
    """Time of walking an order; for a closed tour also less its longest move."""
    cost = walk(instance, order)
    yield "", cost * instance.quantum
    if instance.ends.closed and len(order) > 2:
        longest = int(instance.form.costs(order, np.roll(order, -1)).max())
        yield "less its longest move", (cost - longest) * instance.quantum


def swaps(instance: Instance, entries: Ints, claimed: Printed) -> list[tuple[int, int]]:
    """Pairs of places (from 1) whose entries, swapped, give the claimed time."""
    n = len(entries)
    if not 2 <= n <= SWAP_LIMIT or instance.ends.start is not None or instance.ends.end is not None:
        return []
    form, cost = instance.form, walk(instance, entries)
    tour = np.array(instance.tour(entries.tolist()), dtype=np.int64)
    places = np.flatnonzero(tour < form.holes)
    size, found = len(tour), []
    if size < 3:
        return []
    before, after = np.roll(tour, 1), np.roll(tour, -1)
    stay = form.costs(before, tour) + form.costs(tour, after)
    for i, at in enumerate(places[:-1].tolist()):
        others = places[i + 1 :]
        here, there = np.full(len(others), tour[at]), tour[others]
        new = form.costs(np.full(len(others), before[at]), there)
        new += form.costs(there, np.full(len(others), after[at]))
        new += form.costs(before[others], here) + form.costs(here, after[others])
        delta = new - stay[at] - stay[others]
        touching = ((others - at) % size == 1) | ((at - others) % size == 1)
        delta += np.where(touching, 2 * form.costs(here, there), 0)
        for k in np.flatnonzero(within(instance, cost + delta, claimed, claimed.unit)).tolist():
            if delta[k] and claimed.agreement((cost + int(delta[k])) * instance.quantum).holds:
                found += [(i + 1, i + 2 + k)]
    return found


def within(
    instance: Instance, costs: Ints, claimed: Printed, distance: Fraction
) -> NDArray[np.bool_]:
    """Which whole costs lie at most ``distance`` from a printed time."""
    low = (claimed.value - distance) / instance.quantum
    high = (claimed.value + distance) / instance.quantum
    first = max(-((-low.numerator) // low.denominator), -(2**62))
    last = min(high.numerator // high.denominator, 2**62)
    if first > last:
        return np.zeros(len(costs), dtype=bool)
    return (costs >= first) & (costs <= last)
