"""Which single misprinted coordinate would make a claimed time come true?

Candidates change one hole: two digits of a coordinate exchanged, one digit
wrong, x and y exchanged, a coordinate of another hole, or the place that
completes a pattern which the board repeats.  Each candidate's time follows
from the moves at that hole alone.  Data are never changed; what is reported
are suspicions, with the number of candidates tried and of hits to expect by
chance.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from tcp.errors import UsageError
from tcp.files.printed import Agreement, Printed
from tcp.instance import Instance
from tcp.result import decimal
from tcp.travel import CostRule, Model
from tcp.validate.findings import Finding, finding
from tcp.validate.readings import slack, within
from tcp.validate.repairs import Repairs
from tcp.validate.sequence import walk
from tcp.workpiece import Workpiece

Ints = NDArray[np.int64]

MAX_HOLES = 600
"""The number of candidates grows with the square of the number of holes."""

REPAIRS = 10
"""So many smallest repairs of a broken sequence are searched, too."""

NAMED = 20
"""So many candidates are named a sequence."""

_NEAR = 1000
"""Hits by chance are estimated from the candidates within so many printed units."""


@dataclass(frozen=True)
class Candidate:
    """One changed hole; coordinates in steps."""

    hole: int
    x: int
    y: int
    how: str


@dataclass(frozen=True)
class Suspicion:
    """What the search for a misprint found for one sequence.

    Parameters
    ----------
    tried : int
        Number of candidates.
    expected : float
        Hits that chance alone would give, from the density of times near the claim.
    hits : tuple of (Candidate, Fraction, Agreement)
        Candidates that make the claim come true, with the time they give.
    together : tuple of Candidate
        The completions of repeated patterns, one per place.
    together_time : Fraction or None
        Time of the sequence with all of them applied.
    """

    tried: int
    expected: float
    hits: tuple[tuple[Candidate, Fraction, Agreement], ...]
    together: tuple[Candidate, ...]
    together_time: Fraction | None


def suspicion(instance: Instance, entries: Ints, claimed: Printed) -> Suspicion:
    """Search the single misprints that explain a claimed time.

    Parameters
    ----------
    instance : Instance
        The problem with the coordinates as printed.
    entries : int64 array
        Hole indices as walked.
    claimed : Printed
        The claimed time.

    Raises
    ------
    UsageError
        For more than :data:`MAX_HOLES` holes, or an explicit travel matrix.
    """
    piece = instance.workpiece
    if len(piece) > MAX_HOLES or instance.travel.model is Model.EXPLICIT:
        raise UsageError(
            f"{piece.name}: misprints are searched on up to {MAX_HOLES} holes with coordinates"
        )
    places = pattern_places(piece)
    tried = list(dict.fromkeys(candidates(piece, places)))
    costs = _costs(instance, entries, tried)
    off = slack(instance, len(entries))
    close = within(instance, costs, claimed, claimed.unit + off)
    near = within(instance, costs, claimed, _NEAR * claimed.unit).sum()
    times = {k: int(costs[k]) * instance.quantum for k in np.flatnonzero(close).tolist()}
    found = [(tried[k], time, claimed.agreement(time, off)) for k, time in times.items()]
    together = _together(piece, places)
    return Suspicion(
        tried=len(tried),
        expected=1.5 * int(near) / (2 * _NEAR),
        hits=tuple(hit for hit in found if hit[2].holds),
        together=together,
        together_time=_moved_time(instance, entries, together) if together else None,
    )


def candidates(piece: Workpiece, places: list[tuple[int, int]]) -> Iterator[Candidate]:
    """All single misprints that are tried, each changed hole once."""
    xs, ys = sorted(set(piece.x.tolist())), sorted(set(piece.y.tolist()))
    seen: set[tuple[int, int, int]] = set()
    for hole, (x, y) in enumerate(zip(piece.x.tolist(), piece.y.tolist(), strict=True)):
        for nx, ny, how in _changes(x, y, xs, ys, places):
            if (nx, ny) != (x, y) and (hole, nx, ny) not in seen:
                seen.add((hole, nx, ny))
                yield Candidate(hole, nx, ny, how)


def _changes(
    x: int, y: int, xs: list[int], ys: list[int], places: list[tuple[int, int]]
) -> Iterator[tuple[int, int, str]]:
    yield y, x, "x and y exchanged"
    for value, how in _digits(x):
        yield value, y, f"{how} of x"
    for value, how in _digits(y):
        yield x, value, f"{how} of y"
    for px, py in places:
        yield px, py, "the place that completes a repeated pattern"
    for value in xs:
        yield value, y, "x of another hole"
    for value in ys:
        yield x, value, "y of another hole"


def _digits(value: int) -> Iterator[tuple[int, str]]:
    """Numbers of the same length with two digits exchanged, or one digit wrong."""
    digits, sign = str(abs(value)), -1 if value < 0 else 1
    for i in range(len(digits)):
        for j in range(i + 1, len(digits)):
            swapped = list(digits)
            swapped[i], swapped[j] = swapped[j], swapped[i]
            yield sign * int("".join(swapped)), "two digits exchanged"
        for d in "0123456789":
            yield sign * int(digits[:i] + d + digits[i + 1 :]), "one digit wrong"


def pattern_places(piece: Workpiece) -> list[tuple[int, int]]:
    """Free places on the board that two or more of its repeated shifts predict."""
    points = list(zip(piece.x.tolist(), piece.y.tolist(), strict=True))
    taken, (left, low), (right, high) = set(points), _corner(piece, min), _corner(piece, max)
    predicted: Counter[tuple[int, int]] = Counter()
    for dx, dy in _shifts(points):
        for x, y in points:
            for place in ((x + dx, y + dy), (x - dx, y - dy)):
                inside = left <= place[0] <= right and low <= place[1] <= high
                if inside and place not in taken:
                    predicted[place] += 1
    return sorted(place for place, support in predicted.items() if support > 1)


def _shifts(points: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Shifts, up to sign, that map two thirds of all holes onto holes or from holes."""
    number: Counter[tuple[int, int]] = Counter()
    for k, (x, y) in enumerate(points):
        for px, py in points[:k]:
            shift = (x - px, y - py)
            number[max(shift, (-shift[0], -shift[1]))] += 1
    often = [s for s, pairs in number.items() if 3 * pairs >= len(points) and s != (0, 0)]
    taken = set(points)
    return [s for s in often if 3 * _mapped(taken, s) >= 2 * len(points)]


def _mapped(taken: set[tuple[int, int]], shift: tuple[int, int]) -> int:
    """Number of holes that a shift, or its reverse, maps onto a hole."""
    dx, dy = shift
    return sum((x + dx, y + dy) in taken or (x - dx, y - dy) in taken for x, y in taken)


def _corner(piece: Workpiece, extreme: Callable[[list[int]], int]) -> tuple[int, int]:
    return extreme(piece.x.tolist()), extreme(piece.y.tolist())


def _together(piece: Workpiece, places: list[tuple[int, int]]) -> tuple[Candidate, ...]:
    """For each predicted place the hole outside of all patterns that shares a number with it."""
    points = list(zip(piece.x.tolist(), piece.y.tolist(), strict=True))
    taken, shifts = set(points), _shifts(points)
    outside = [
        k
        for k, (x, y) in enumerate(points)
        if not any((x + s * dx, y + s * dy) in taken for dx, dy in shifts for s in (1, -1))
    ]
    moves = []
    for px, py in places:
        fitting = [k for k in outside if {px, py} & set(points[k])]
        if len(fitting) == 1:
            moves.append(Candidate(fitting[0], px, py, "completes a repeated pattern"))
    holes = [m.hole for m in moves]
    return tuple(moves) if len(set(holes)) == len(holes) else ()


def _moved_time(instance: Instance, entries: Ints, moves: tuple[Candidate, ...]) -> Fraction:
    piece = instance.workpiece
    x, y = piece.x.copy(), piece.y.copy()
    for move in moves:
        x[move.hole], y[move.hole] = move.x, move.y
    changed = Workpiece(piece.name, piece.ids, x, y, piece.step)
    other = Instance(changed, instance.travel, instance.ends)
    return walk(other, entries) * other.quantum


def _costs(instance: Instance, entries: Ints, tried: list[Candidate]) -> Ints:
    """Cost of the sequence for each candidate: the moves at the changed hole are priced anew."""
    form = instance.form
    tour = np.array(instance.tour(entries.tolist()), dtype=np.int64)
    p, q = tour, np.roll(tour, -1)
    before, real = form.costs(p, q), (p != form.virtual) & (q != form.virtual)
    total = int(before.sum())
    scale = _scale(instance)
    x, y = form.x, form.y
    rule = _rule(instance, tried, scale)
    costs = np.empty(len(tried), dtype=np.int64)
    by_hole: dict[int, list[int]] = {}
    for k, candidate in enumerate(tried):
        by_hole.setdefault(candidate.hole, []).append(k)
    for hole, which in by_hole.items():
        touching = np.flatnonzero(((p == hole) ^ (q == hole)) & real)
        others = np.where(p[touching] == hole, q[touching], p[touching])
        nx = np.array([tried[k].x * scale for k in which], dtype=np.int64)
        ny = np.array([tried[k].y * scale for k in which], dtype=np.int64)
        new = rule.costs(nx[:, None] - x[others][None, :], ny[:, None] - y[others][None, :])
        costs[which] = total - int(before[touching].sum()) + new.sum(axis=1)
    return costs


def _scale(instance: Instance) -> int:
    """Form steps in a workpiece step: more than 1 where the home position is finer."""
    piece, form = instance.workpiece, instance.form
    k = int(np.argmax(np.abs(piece.x) + np.abs(piece.y)))
    if piece.x[k]:
        return int(form.x[k] // piece.x[k])
    return int(form.y[k] // piece.y[k]) if piece.y[k] else 1


def _rule(instance: Instance, tried: list[Candidate], scale: int) -> CostRule:
    """The cost rule, re-derived for the reach of the changed coordinates."""
    form = instance.form
    reach = []
    for values, changed in ((form.x, [c.x for c in tried]), (form.y, [c.y for c in tried])):
        spread = [int(values.min()), int(values.max()), *(v * scale for v in changed)]
        reach.append(max(spread) - min(spread))
    step = instance.workpiece.step / scale
    return instance.travel.rule(step, (reach[0], reach[1]), form.size)


def described(piece: Workpiece, candidate: Candidate) -> str:
    """A candidate in words: hole, from where to where, and how."""
    hole, step = piece.hole(candidate.hole), piece.step
    return (
        f"hole {hole.id} at ({decimal(candidate.x * step)},{decimal(candidate.y * step)}) instead "
        f"of ({decimal(hole.x)},{decimal(hole.y)}): {candidate.how}"
    )


def suspicions(
    instance: Instance, entries: Ints, claimed: Printed, repairs: Repairs | None
) -> tuple[dict[str, str], list[Finding]]:
    """Facts and findings 704 for a sequence as written and for each of its smallest repairs."""
    orders = [("as written", entries)]
    if repairs is not None:
        orders += [
            (f"repaired ({'; '.join(r.edits)})", np.array(r.route, dtype=np.int64))
            for r in repairs.smallest[:REPAIRS]
        ]
    facts: dict[str, str] = {}
    found: list[Finding] = []
    for name, order in orders:
        seen = suspicion(instance, order, claimed)
        facts[f"Misprints tried, {name}"] = (
            f"{seen.tried} candidates, {len(seen.hits)} fit; chance alone would fit about "
            f"{seen.expected:.2g}"
        )
        if seen.together_time is not None:
            holes = ", ".join(instance.workpiece.ids[c.hole] for c in seen.together)
            facts[f"Patterns completed together (holes {holes}), {name}"] = decimal(
                seen.together_time
            )
        found += [
            finding(
                "TCP704",
                f"{name}, the claim comes true with {described(instance.workpiece, candidate)}",
                hole=instance.workpiece.ids[candidate.hole],
                time=decimal(time),
            )
            for candidate, time, _ in seen.hits[:NAMED]
        ]
    return facts, found
