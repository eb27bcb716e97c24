"""A sequence against its workpiece: what is drilled twice, never, or does not exist.

Everything is a pass over arrays: ten million entries take seconds.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tcp.files.order import Order
from tcp.instance import Instance, TourForm
from tcp.travel import SAFE
from tcp.validate.findings import Finding, finding
from tcp.validate.route import faults

Ints = NDArray[np.int64]

DETAILS = 100
"""So many findings of one code are spelled out; the rest is counted."""

PLACES = 20
"""So many places of one hole are listed."""


@dataclass(frozen=True, eq=False)
class Count:
    """Which holes a sequence drills how often.

    Parameters
    ----------
    length : int
        Entries of the sequence.
    duplicates, missing : int64 arrays
        Holes drilled more than once, and never.
    surplus : int
        Entries beyond the first of each hole.
    unknown : tuple of str
        Labels that are no hole.
    """

    length: int
    duplicates: Ints
    missing: Ints
    surplus: int
    unknown: tuple[str, ...] = ()
    places: dict[int, list[int]] = field(default_factory=dict, repr=False)

    @property
    def valid(self) -> bool:
        """Whether every hole is drilled exactly once and nothing else."""
        return not (len(self.duplicates) or len(self.missing) or self.unknown)


def count(order: Order, holes: int) -> Count:
    """Count the visits of a sequence; O(entries + holes)."""
    entries = order.entries
    known = entries[entries >= 0]
    visits = np.bincount(known, minlength=holes)
    duplicates = np.flatnonzero(visits > 1)
    shown = [*duplicates[:DETAILS].tolist(), *range(-1, -1 - min(len(order.unknown), DETAILS), -1)]
    return Count(
        length=len(entries),
        duplicates=duplicates,
        missing=np.flatnonzero(visits == 0),
        surplus=int((visits[duplicates] - 1).sum()),
        unknown=order.unknown,
        places=_places(entries, shown),
    )


def _places(entries: Ints, wanted: Sequence[int]) -> dict[int, list[int]]:
    """Where each wanted value stands, counted from 1; the first PLACES of each."""
    places: dict[int, list[int]] = {value: [] for value in wanted}
    open_ones, chunk = list(wanted), 1_000_000
    for start in range(0, len(entries), chunk):
        if not open_ones:
            break
        part = entries[start : start + chunk]
        at = np.flatnonzero(np.isin(part, np.array(open_ones, dtype=np.int64)))
        by_value = at[np.argsort(part[at], kind="stable")]
        values = part[by_value]
        starts = np.flatnonzero(np.diff(values, prepend=values[:1] - 1)).tolist()
        for s, e in itertools.pairwise([*starts, len(values)]):
            found = places[int(values[s])]
            found += (by_value[s : min(e, s + PLACES - len(found))] + start + 1).tolist()
        open_ones = [v for v in open_ones if len(places[v]) < PLACES]
    return places


def sequence_findings(instance: Instance, order: Order, seen: Count) -> list[Finding]:
    """Findings 101 to 108 of a sequence."""
    ids = instance.workpiece.ids
    found = _joined(order) + _duplicates(ids, seen) + _missing(ids, seen) + _unknown(seen)
    if seen.length != len(ids):
        found.append(
            finding(
                "TCP104",
                f"the sequence has {seen.length} entries, the workpiece {len(ids)} holes",
                length=seen.length,
                holes=len(ids),
            )
        )
    if not seen.valid:
        return found + _numbering(order, len(ids))
    if instance.ends.start is None and instance.ends.end is None and not _has_rules(instance):
        return found
    for sentence in faults(instance, order.entries.tolist()):
        end = sentence.startswith("the route")
        found.append(finding("TCP105" if end else "TCP106", sentence))
    return found


def _has_rules(instance: Instance) -> bool:
    rules = instance.rules
    return bool(rules.together or rules.sequential or instance.form.forbidden)


def _joined(order: Order) -> list[Finding]:
    if not order.joined:
        return []
    return [finding("TCP108", "the text has no separators; read one character a hole")]


def _duplicates(ids: Sequence[str], seen: Count) -> list[Finding]:
    found = []
    for hole in seen.duplicates[:DETAILS].tolist():
        at = seen.places[hole]
        more = " and more" if len(at) == PLACES else ""
        found.append(
            finding(
                "TCP101",
                f"hole {ids[hole]} is drilled more than once: at places {_listed(at)}{more}",
                positions=at,
                hole=ids[hole],
            )
        )
    return found + _rest("TCP101", len(seen.duplicates), "holes are drilled more than once")


def _missing(ids: Sequence[str], seen: Count) -> list[Finding]:
    found = [
        finding("TCP102", f"hole {ids[hole]} is never drilled", hole=ids[hole])
        for hole in seen.missing[:DETAILS].tolist()
    ]
    return found + _rest("TCP102", len(seen.missing), "holes are never drilled")


def _unknown(seen: Count) -> list[Finding]:
    found = []
    for k, label in enumerate(seen.unknown[:DETAILS]):
        at = seen.places[-1 - k]
        more = " and more" if len(at) == PLACES else ""
        place = "place" if len(at) == 1 else "places"
        found.append(
            finding(
                "TCP103",
                f"there is no hole {label!r}: at {place} {_listed(at)}{more}",
                positions=at,
                label=label,
            )
        )
    return found + _rest("TCP103", len(seen.unknown), "labels are no holes")


def _rest(code: str, total: int, what: str) -> list[Finding]:
    if total <= DETAILS:
        return []
    return [finding(code, f"{total - DETAILS} more, {total} {what} in all", total=total)]


def _listed(values: Sequence[int]) -> str:
    head = ", ".join(map(str, values[:-1]))
    return f"{head} and {values[-1]}" if head else str(values[-1])


def _numbering(order: Order, holes: int) -> list[Finding]:
    """Whether counting holes from 0 or from 1 would make the sequence a route."""
    found = []
    for base, values in order.as_numbers.items():
        if base == order.numbering or len(values) != holes:
            continue
        inside = bool(((values >= 0) & (values < holes)).all())
        if inside and bool((np.bincount(values, minlength=holes) == 1).all()):
            found.append(
                finding(
                    "TCP107",
                    f"with holes counted from {base} the sequence visits every hole once",
                    numbering=base,
                )
            )
    return found


def walk(instance: Instance, entries: Ints) -> int:
    """Cost of walking ``entries`` (hole indices) with the ends' legs, in quanta.

    Equals :meth:`Instance.cost` for a route; also prices a sequence with
    duplicates the way it is printed.
    """
    form, ends = instance.form, instance.ends
    total = path_cost(form, entries)
    if len(entries) == 0:
        return 0
    first, last = int(entries[0]), int(entries[-1])
    if ends.outward:
        total += form.cost(form.home, first)
    if ends.back:
        total += form.cost(last, form.home)
    if ends.closed and len(entries) > 1:
        total += form.cost(last, first)
    return total


def path_cost(form: TourForm, nodes: Ints) -> int:
    """Cost of moving along ``nodes``, in quanta; no overflow however long they are."""
    total, chunk = 0, 1_000_000
    for k in range(0, max(len(nodes) - 1, 0), chunk):
        part = nodes[k : k + chunk + 1]
        moves = form.costs(part[:-1], part[1:])
        if int(moves.max(initial=0)) * len(moves) < SAFE:
            total += int(moves.sum())
        else:
            total += sum(moves.tolist())
    return total
