"""An instance: workpiece, travel model, ends and rules, with exact integer costs.

Every solver searches the same object, the instance's :class:`TourForm`: an
open path is a closed tour through one extra *virtual* node that costs nothing
to reach.  A fixed end forces its edge to the virtual node, a home position is
an ordinary node, and ``closed`` drops the virtual node.  Nothing is ever cut
out of a shortest tour: that path need not be shortest.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from tcp.errors import UsageError, demand_exact, demand_whole
from tcp.rules import Rules, unbalanced
from tcp.travel import SAFE, CostRule, Ints, Kind, Model, Travel, describe
from tcp.workpiece import Workpiece

__all__ = ["GCD_LIMIT", "MATRIX_LIMIT", "Ends", "Instance", "Rules", "TourForm"]

MATRIX_LIMIT = 6_000
"""Most nodes for which an n x n matrix is ever built (288 MB)."""

GCD_LIMIT = 3_000
"""Most nodes for which the granularity looks at every pair."""


@dataclass(frozen=True)
class Ends:
    """Where a route begins and ends.

    Parameters
    ----------
    start, end : int, optional
        Hole (by position in the workpiece) that must come first, last.
    home : (Fraction, Fraction), optional
        Home position in mm.
    outward, back : bool
        Whether the move from home to the first hole, and from the last hole
        back home, counts.
    closed : bool
        Return from the last hole to the first.

    Raises
    ------
    UsageError
        For combinations that contradict each other.
    """

    start: int | None = None
    end: int | None = None
    home: tuple[Fraction, Fraction] | None = None
    outward: bool = False
    back: bool = False
    closed: bool = False

    def __post_init__(self) -> None:
        for name in ("start", "end"):
            if getattr(self, name) is not None:
                demand_whole(f"{name} is the position of a hole; it", getattr(self, name))
        if self.home is not None:
            if len(self.home) != 2:
                raise UsageError("a home position has two coordinates")
            for value in self.home:
                demand_exact("a coordinate of home", value)
        if self.closed and (self.end is not None or self.home is not None):
            raise UsageError("a closed route has no end and no home; drop --end and --home")
        if (self.outward or self.back) != (self.home is not None):
            raise UsageError("a home position needs an outward or return leg, and a leg a home")

    def describe(self, ids: Sequence[str]) -> dict[str, Any]:
        """The ends as plain data, holes by id."""
        data: dict[str, Any] = {}
        if self.start is not None:
            data["start"] = ids[self.start]
        if self.end is not None:
            data["end"] = ids[self.end]
        if self.home is not None:
            data["home"] = [str(v) for v in self.home]
            data["outward"], data["return"] = self.outward, self.back
        if self.closed:
            data["closed"] = True
        return data


@dataclass(frozen=True, eq=False)
class TourForm:
    """The instance as a closed tour over ``size`` nodes.

    Nodes ``0 .. holes-1`` are the holes, then comes ``home`` if there is one,
    then the ``virtual`` node if the route is open (-1 where absent).

    Parameters
    ----------
    x, y : int64 arrays
        Coordinates in steps of every node but the virtual one.
    rule : CostRule
        Costs between real nodes.
    matrix : int64 array or None
        Costs between real nodes where the workpiece states them.
    holes, size, home, virtual : int
        Numbers of holes and nodes, and the special nodes.
    forced, forbidden : tuple of (int, int)
        Edges, i < j, that every tour must and must not use.
    """

    x: Ints
    y: Ints
    rule: CostRule
    matrix: Ints | None
    holes: int
    size: int
    home: int
    virtual: int
    forced: tuple[tuple[int, int], ...]
    forbidden: tuple[tuple[int, int], ...]

    @property
    def real(self) -> int:
        """Number of nodes with coordinates: the holes, and home."""
        return self.size - (self.virtual >= 0)

    def costs(self, i: Ints, j: Ints) -> Ints:
        """Costs of the edges ``i[k]``–``j[k]``, in quanta; the virtual node costs 0."""
        i, j = np.asarray(i, np.int64), np.asarray(j, np.int64)
        free = (i == self.virtual) | (j == self.virtual)
        p, q = np.where(free, 0, i), np.where(free, 0, j)
        if self.matrix is not None:
            between = self.matrix[p, q]
        else:
            between = self.rule.costs(self.x[p] - self.x[q], self.y[p] - self.y[q])
        return np.where(free, 0, between)

    def cost(self, i: int, j: int) -> int:
        """Cost of one edge, in quanta."""
        return int(self.costs(np.array([i]), np.array([j]))[0])

    def full_matrix(self) -> Ints:
        """All costs, shape (size, size); refused beyond :data:`MATRIX_LIMIT` nodes."""
        if self.size > MATRIX_LIMIT:
            raise UsageError(f"a cost matrix of {self.size} nodes is beyond {MATRIX_LIMIT}")
        full = np.zeros((self.size, self.size), dtype=np.int64)
        r = self.real
        if self.matrix is not None:
            full[:r, :r] = self.matrix
        else:
            full[:r, :r] = self.rule.costs(
                self.x[:, None] - self.x[None, :], self.y[:, None] - self.y[None, :]
            )
        return full

    def tour_cost(self, tour: Sequence[int] | Ints) -> int:
        """Cost of a cyclic tour over all nodes, in quanta."""
        nodes = np.asarray(tour, dtype=np.int64)
        return int(self.costs(nodes, np.roll(nodes, -1)).sum())


@dataclass(frozen=True, eq=False)
class Instance:
    """A problem to solve: which holes, which machine, which ends, which rules.

    Parameters
    ----------
    workpiece : Workpiece
        The holes.
    travel : Travel
        The travel model; its costs are exact integers in :attr:`quantum`.
    ends : Ends
        Where the route begins and ends.
    rules : Rules
        Forbidden and required successions.

    Raises
    ------
    UsageError
        If travel, ends and workpiece do not fit together.
    """

    workpiece: Workpiece
    travel: Travel = field(default_factory=Travel)
    ends: Ends = field(default_factory=Ends)
    rules: Rules = field(default_factory=Rules)

    def __post_init__(self) -> None:
        n = len(self.workpiece)
        explicit = self.travel.model is Model.EXPLICIT
        if explicit and self.workpiece.matrix is None:
            raise UsageError(f"{self.name} states no travel matrix; choose another travel model")
        if not explicit and self.workpiece.matrix is not None and self.workpiece.nowhere:
            raise UsageError(
                f"{self.name} states travel times and no places; its travel model is explicit"
            )
        if explicit and self.ends.home is not None:
            raise UsageError("a home position has no travel times in an explicit matrix")
        if explicit and self.workpiece.nowhere and self.rules.geometric:
            raise UsageError(
                f"{self.name} states no places; rules about jumps, balance and axis runs need them"
            )
        start, end = self.ends.start, self.ends.end
        if n > 1 and start is not None and start == end:
            raise UsageError("a route of several holes cannot start and end at the same hole")
        pairs = (*self.rules.forbidden, *self.rules.together)
        if any(len(pair) != 2 for pair in pairs):
            raise UsageError("a rule about a pair of holes needs two different holes")
        for hole in [h for h in (start, end) if h is not None] + [h for p in pairs for h in p]:
            demand_whole("a rule names holes by position; it", hole)
            if not 0 <= hole < n:
                raise UsageError(f"hole number {hole} is not in 0..{n - 1}")
        if any(i == j for i, j in pairs):
            raise UsageError("a rule about a pair of holes needs two different holes")

    def __len__(self) -> int:
        return len(self.workpiece)

    @property
    def name(self) -> str:
        """The workpiece's name."""
        return self.workpiece.name

    @cached_property
    def form(self) -> TourForm:
        """The instance as a closed tour over holes, home and virtual node."""
        return _tour_form(self)

    @property
    def rule(self) -> CostRule:
        """The integer cost rule."""
        return self.form.rule

    @property
    def quantum(self) -> Fraction:
        """What one unit of cost is worth (seconds; mm at unit speed)."""
        return self.form.rule.quantum

    @cached_property
    def granularity(self) -> int:
        """A number of quanta that divides every cost: a bound above UB - g proves UB optimal."""
        return _granularity(self.form)

    def tour(self, route: Sequence[int]) -> list[int]:
        """The cyclic tour over all nodes that drills the holes in the order ``route``."""
        form, nodes = self.form, [int(v) for v in route]
        if form.home >= 0:
            nodes = [form.home, *nodes] if self.ends.outward else [*nodes, form.home]
        return [form.virtual, *nodes] if form.virtual >= 0 else nodes

    def route(self, tour: Sequence[int] | Ints) -> tuple[int, ...]:
        """The drilling order of a cyclic tour, turned the way the ends ask for.

        Where both directions serve, the one whose first hole stands earlier in
        the file is taken, so that equal tours give equal routes.
        """
        form, ends = self.form, self.ends
        nodes = [int(v) for v in tour]
        origin = form.virtual if form.virtual >= 0 else form.home
        if origin < 0:
            origin = 0 if ends.start is None else ends.start
        at = nodes.index(origin)
        rest = nodes[at + 1 :] + nodes[:at]
        if origin < form.holes:
            return (origin, *(rest if not rest or rest[0] <= rest[-1] else rest[::-1]))
        if self._turned(rest):
            rest.reverse()
        return tuple(v for v in rest if v < form.holes)

    def _turned(self, path: list[int]) -> bool:
        """Whether an open path of nodes runs against the ends."""
        home, ends = self.form.home, self.ends
        if self.form.virtual >= 0 and home >= 0:
            return path[0 if ends.outward else -1] != home
        if ends.start is not None:
            return path[0] != ends.start
        if ends.end is not None:
            return path[-1] != ends.end
        return path[0] > path[-1]

    def cost(self, route: Sequence[int]) -> int:
        """Cost of a drilling order with everything the ends add, in quanta."""
        return self.form.tour_cost(self.tour(route))

    def penalty(self, route: Sequence[int]) -> int:
        """Unbalanced windows of a drilling order; 0 without a balance rule."""
        if self.rules.balance is None:
            return 0
        holes, piece = np.asarray(route, dtype=np.int64), self.workpiece
        return len(unbalanced(piece.x[holes], piece.y[holes], self.rules.balance))

    def describe(self) -> dict[str, Any]:
        """The instance as plain data: name, holes, travel, ends, rules, quantum, hash."""
        ids = self.workpiece.ids
        data = {
            "name": self.name,
            "holes": len(self),
            "travel": describe(self.travel),
            "ends": self.ends.describe(ids),
            "quantum": str(self.quantum),
        }
        rules = self.rules.describe(ids)
        return data | ({"rules": rules} if rules else {}) | {"sha256": self.sha256}

    @cached_property
    def sha256(self) -> str:
        """Hash of all that defines the problem; equal problems have equal hashes."""
        ids = self.workpiece.ids
        data = {
            "workpiece": self.workpiece.sha256,
            "travel": describe(self.travel),
            "quantum": str(self.quantum),
            "ends": self.ends.describe(ids),
            "rules": self.rules.describe(ids),
        }
        text = json.dumps(data, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()


def _tour_form(instance: Instance) -> TourForm:
    workpiece, ends = instance.workpiece, instance.ends
    holes, home, size = len(workpiece), -1, len(workpiece)
    x, y, step = workpiece.x, workpiece.y, workpiece.step
    if ends.home is not None:
        home, size = size, size + 1
        x, y, step = _with_home(workpiece, ends.home)
    virtual = -1 if ends.closed or (ends.outward and ends.back) else size
    size += virtual >= 0
    reach = (int(x.max()) - int(x.min()), int(y.max()) - int(y.min()))
    matrix = workpiece.matrix if instance.travel.model is Model.EXPLICIT else None
    if matrix is not None and 2 * int(matrix.max(initial=0)) * size >= SAFE:
        raise UsageError(f"{workpiece.name}: the times of the matrix add up beyond 61-bit integers")
    return TourForm(
        x=x,
        y=y,
        rule=instance.travel.rule(step, reach, size),
        matrix=matrix,
        holes=holes,
        size=size,
        home=home,
        virtual=virtual,
        forced=_forced(instance, home, virtual),
        forbidden=_forbidden(instance),
    )


def _with_home(
    workpiece: Workpiece, home: tuple[Fraction, Fraction]
) -> tuple[Ints, Ints, Fraction]:
    """Coordinates of holes and home on the coarsest grid that holds them all."""
    step = workpiece.step
    finer = math.lcm(*((v / step).denominator for v in home))
    hx, hy = (int(v / step * finer) for v in home)
    reach = max(int(np.abs(v).max()) for v in (workpiece.x, workpiece.y))
    if max(abs(hx), abs(hy), max(reach, 1) * finer) > 2**52:
        raise UsageError("the home position lies too far away or has too many decimals")
    return np.append(workpiece.x * finer, hx), np.append(workpiece.y * finer, hy), step / finer


def _forced(instance: Instance, home: int, virtual: int) -> tuple[tuple[int, int], ...]:
    ends = instance.ends
    before = home if ends.outward else virtual
    after = home if ends.back else virtual
    edges = set(instance.rules.together)
    if home >= 0 and virtual >= 0:
        edges.add((home, virtual))
    if ends.start is not None and before >= 0:
        edges.add((ends.start, before))
    if ends.end is not None and after >= 0:
        edges.add((ends.end, after))
    return tuple(sorted({(min(e), max(e)) for e in edges}))


def _forbidden(instance: Instance) -> tuple[tuple[int, int], ...]:
    pairs = {(min(p), max(p)) for p in instance.rules.forbidden}
    rules, piece = instance.rules, instance.workpiece
    if rules.min_jump is not None:
        pairs |= _near_pairs(piece, rules.min_jump)
    if rules.jump_diameters is not None:
        pairs |= _near_by_diameter(piece, rules.jump_diameters)
    return tuple(sorted(pairs))


def _near_pairs(workpiece: Workpiece, distance: Fraction) -> set[tuple[int, int]]:
    """Pairs of holes nearer than ``distance`` mm (strictly), decided in integers."""
    bound = distance / workpiece.step
    cell = max(math.ceil(bound), 1)
    x, y = workpiece.x.tolist(), workpiece.y.tolist()
    cells: dict[tuple[int, int], list[int]] = {}
    near = set()
    for i, (px, py) in enumerate(zip(x, y, strict=True)):
        cx, cy = px // cell, py // cell
        for nx in (cx - 1, cx, cx + 1):
            for ny in (cy - 1, cy, cy + 1):
                for j in cells.get((nx, ny), ()):
                    if (px - x[j]) ** 2 + (py - y[j]) ** 2 < bound * bound:
                        near.add((j, i))
        cells.setdefault((cx, cy), []).append(i)
    return near


def _near_by_diameter(workpiece: Workpiece, times: Fraction) -> set[tuple[int, int]]:
    """Pairs of holes nearer than ``times`` the larger of their diameters, where known."""
    known = workpiece.diameters or (None,) * len(workpiece)
    reach = [times * (d or 0) / workpiece.step for d in known]
    x, y = workpiece.x.tolist(), workpiece.y.tolist()

    def near(i: int, j: int) -> bool:
        return bool((x[i] - x[j]) ** 2 + (y[i] - y[j]) ** 2 < max(reach[i], reach[j]) ** 2)

    farthest = max(reach) * workpiece.step
    return {p for p in _near_pairs(workpiece, farthest) if near(*p)} if farthest else set()


def _granularity(form: TourForm) -> int:
    if form.real == 1:
        return 1
    everyone = np.arange(form.real)
    g = int(np.gcd.reduce(form.costs(np.zeros_like(everyone), everyone)))
    if g <= 1:
        return 1
    least = _lattice_divisor(form)
    if form.real > GCD_LIMIT:
        return math.gcd(g, least)
    for i in range(1, form.real):
        if g == least:
            break
        g = math.gcd(g, int(np.gcd.reduce(form.costs(np.full_like(everyone, i), everyone))))
    return g


def _lattice_divisor(form: TourForm) -> int:
    """A divisor of every cost in O(n): the lattice's spacing, doubled on a checkerboard."""
    if form.rule.kind not in (Kind.SUM, Kind.MAX) or form.rule.params[2] != 1:
        return 1
    a, b, _ = form.rule.params
    dx, dy = form.x - form.x[0], form.y - form.y[0]
    base = math.gcd(a * int(np.gcd.reduce(dx)), b * int(np.gcd.reduce(dy)))
    if form.rule.kind is Kind.SUM and base and not ((a * dx + b * dy) % (2 * base)).any():
        return 2 * base
    return max(base, 1)
