"""The certificate checker: decides whether a certificate proves what it claims.

This one file is all that has to be trusted.  It needs Python and numpy and nothing of ``tcp``: a
copy of it runs anywhere, as ``python certificate.py FILE [SHA256]``.  ``docs/certificate.md`` has
the format and the mathematics; each section below checks one part.  Everything is derived again
from what the file says about the instance, and only integers decide: int64 where a bound on all
intermediates proves that they fit, Python integers otherwise.

Exit codes: 0 verified, 1 refuted, 2 usage, 3 malformed, 6 unsupported version, 70 internal.
"""

from __future__ import annotations

import gzip
import hashlib
import json
import math
import sys
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from decimal import Decimal
from fractions import Fraction
from itertools import chain, islice, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

VERSIONS, REFUTED, MALFORMED, UNSUPPORTED = (1, 2), 1, 3, 6
LIMIT = 2**61  # every number of a certificate, and every int64 intermediate, stays below
MAX_BYTES, MAX_LISTS, MAX_NUMBERS = 2**28, 6_000_000, 60_000_000
PARTS, HEAVIEST = 16, 2**20  # of a local cut: most parts, largest weight
KINDS = {"edge": "children", "set": "children", "fix": "child", "leaf": ""}
BLOCK, MOST_PAIRS = 2**18, 2**24  # pairs handled at a time; most pairs that a fixing lists

Hole = tuple[str, Fraction, Fraction]  # id, and position in mm
Move = Callable[[Any, Any], Any]


class Failure(Exception):
    """The certificate is not accepted; ``code`` (the exit code) says in which way."""

    def __init__(self, message: str, code: int = MALFORMED):
        super().__init__(message)
        self.code = code
        self.word = {REFUTED: "refuted", MALFORMED: "malformed"}.get(code, "unsupported")


# --- plain data, strictly ---
def demand(holds: Any, message: str, code: int = MALFORMED) -> None:
    """Fail unless the condition holds."""
    if not holds:
        raise Failure(message, code)


def fields(data: Any, required: str, optional: str = "") -> dict[str, Any]:
    """An object with exactly the known fields."""
    demand(type(data) is dict, f"expected an object with {required or optional}")
    need, may = set(required.split()), set(optional.split())
    wrong = (need - data.keys()) | (data.keys() - need - may)
    demand(not wrong, f"missing or unknown field {min(wrong, default='')[:60]!a}")
    return dict(data)


def wholes(values: Any, low: int = 1 - LIMIT, high: int = LIMIT - 1, count: int = -1) -> list[int]:
    """A list of (``count``) whole numbers in ``low .. high``."""
    good = type(values) is list and set(map(type, values)) <= {int}
    good = good and (not values or low <= min(values) <= max(values) <= high)
    demand(good and count in (-1, len(values)), f"expected whole numbers in {low} .. {high}")
    return list(values)


def fraction(text: Any, least: int = 1) -> Fraction:
    """A fraction in lowest terms, as text; with a numerator of ``least`` or more."""
    try:
        value = Fraction(text if type(text) is str and len(text) < 400 else "none")
    except (ValueError, ZeroDivisionError):
        raise Failure(f"{str(text)[:60]!a} is not a fraction as text") from None
    good = str(value) == text and value.numerator >= least
    demand(good, f"the fraction {text[:60]!a} must be in lowest terms and in range")
    return value


# --- 1. the file: bounded, whole numbers only, no key twice ---
def unzip(path: Path) -> bytes:
    """The file's bytes, gzipped or not, never more than one beyond the limit."""
    try:
        with path.open("rb") as stream:
            opener: Any = gzip.open if stream.read(2) == b"\x1f\x8b" else open
        with opener(path, "rb") as stream:
            return bytes(stream.read(MAX_BYTES + 1))
    except (OSError, EOFError, zlib.error) as error:
        raise Failure(f"cannot read {path}: {error}") from None


def load(raw: bytes) -> dict[str, Any]:
    """The JSON object in ``raw``."""

    def refuse(text: str) -> None:
        raise Failure(f"{text[:40]} is not a whole number")

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        demand(len(dict(pairs)) == len(pairs), "an object has the same key twice")
        return dict(pairs)

    demand(len(raw) <= MAX_BYTES, f"a certificate has at most {MAX_BYTES} bytes")
    lists = raw.count(b"[") + raw.count(b"{")
    demand(lists <= MAX_LISTS and raw.count(b",") <= MAX_NUMBERS, "too many lists or numbers")
    hooks: Any = {"parse_float": refuse, "parse_constant": refuse, "object_pairs_hook": unique}
    try:
        data = json.loads(raw.decode(), **hooks)
    except (ValueError, RecursionError) as error:
        raise Failure(f"no valid JSON: {error!s:.80}") from None
    ours = type(data) is dict and data.get("format") == "tcp-certificate"
    demand(ours, 'expected a JSON object with "format": "tcp-certificate"')
    (version,) = wholes([data.get("version")])
    known = version in VERSIONS
    demand(known, f"version {version}; this checker knows {VERSIONS[-1]} and before", UNSUPPORTED)
    return fields(data, "format version instance claim sets cuts tree", "route")


# --- 2. the instance: holes, ends, rules, and the hash of it all ---
class Problem:
    """The instance as a closed tour over ``size`` nodes: holes, home, virtual node.

    ``forced`` and ``forbidden`` hold the keys of pairs that every tour must and must not use;
    ``cap`` is how often a tour can use a pair (of only two nodes: there and back).
    """

    def __init__(self, data: Any):
        self.data = fields(data, "name step ids x y travel quantum ends rules sha256", "matrix")
        ids, step = data["ids"], fraction(data["step"])
        demand(type(ids) is list and set(map(type, ids)) == {str}, "the hole ids must be texts")
        self.n = n = len(ids)
        self.index = {name: i for i, name in enumerate(ids)}
        good = len(self.index) == n and type(data["name"]) is str
        demand(good, "the name must be a text and the hole ids unique")
        x, y = (wholes(data[axis], -(2**52), 2**52, n) for axis in "xy")
        self.holes = [(h, p * step, q * step) for h, p, q in zip(ids, x, y, strict=True)]
        together, forbidden = self._rules()
        home = self._ends()
        self.home = n if home else -1
        if home:  # a node like the others, on a step fine enough for it
            finer = math.lcm(*((v / step).denominator for v in home))
            step /= finer
            x = [*(v * finer for v in x), int(home[0] / step)]
            y = [*(v * finer for v in y), int(home[1] / step)]
        self.virtual = -1 if self.closed or (self.out and self.back) else len(x)
        self.size = len(x) + (self.virtual >= 0)
        self.cap = 2 if self.size == 2 else 1
        first, last = (self.home if leg else self.virtual for leg in (self.out, self.back))
        edges = [(self.home, self.virtual), (self.start, first), (self.end, last), *together]
        self.forced = {self.key(i, j) for i, j in edges if min(i, j) >= 0}
        self.forbidden = {self.key(i, j) for i, j in forbidden}
        self.costs = Costs(self.data, x, y, step, self.virtual)
        demand(data["sha256"] == self._hash(), "the instance has another hash", REFUTED)

    def key(self, i: int, j: int) -> int:
        """One number for a pair of nodes."""
        return min(i, j) * self.size + max(i, j)

    def _hole(self, name: Any) -> int:
        demand(type(name) is str and name in self.index, f"there is no hole {str(name)[:60]!a}")
        return self.index[name]

    def _ends(self) -> list[Fraction]:
        """The home position, [] if there is none; notes the other ends."""
        ends = fields(self.data["ends"], "", "start end home outward return closed")
        self.start, self.end = (self._hole(ends[k]) if k in ends else -1 for k in ("start", "end"))
        legs = [ends.get(key, False) for key in ("outward", "return", "closed")]
        demand(set(map(type, legs)) == {bool}, "legs are true or false")
        self.out, self.back, self.closed = legs
        home = ends.get("home", [])
        demand(type(home) is list and len(home) in (0, 2), "a home position is [x, y]")
        demand(bool(home) == (self.out or self.back), "a home needs a leg, and a leg a home")
        demand(not (self.closed and (home or self.end >= 0)), "a closed route has no end, no home")
        same = self.start == self.end >= 0 and self.n > 1
        demand(not same, "start and end are the same hole")
        return [fraction(v, -LIMIT) for v in home]

    def _rules(self) -> list[list[tuple[int, int]]]:
        """Pairs of holes that must, and that must not, follow each other."""
        rules, found = fields(self.data["rules"], "", "forbidden together min_jump"), []
        for pairs in (rules.get("together", []), rules.get("forbidden", [])):
            good = type(pairs) is list and all(type(p) is list and len(p) == 2 for p in pairs)
            demand(good, "a rule is a list of pairs of holes")
            found.append([(self._hole(p), self._hole(q)) for p, q in pairs])
            demand(all(i != j for i, j in found[-1]), "a rule pairs a hole with itself")
        near = fraction(rules.get("min_jump", "0"), 0)
        order = sorted((x, y, self.index[name]) for name, x, y in self.holes if near > 0)
        for at, (x, y, i) in enumerate(order, 1):
            for u, v, j in islice(order, at, None):
                if u - x >= near:
                    break
                if (u - x) ** 2 + (v - y) ** 2 < near * near:
                    found[1].append((i, j))
        return found

    def _hash(self) -> str:
        data, at = self.data, zip(self.index, self.data["x"], self.data["y"], strict=True)
        lines = [f"tcp-workpiece-1\nstep {data['step']}\n"]
        lines += [f"{len(name)}:{name} {x} {y}\n" for name, x, y in at]
        piece = hashlib.sha256("".join(lines).encode(errors="surrogatepass"))
        if "matrix" in data:
            piece.update(b"matrix\n" + self.costs.matrix.astype("<i8").tobytes())
        what = {key: data[key] for key in ("travel", "quantum", "ends", "rules")}
        what["workpiece"] = piece.hexdigest()
        text = json.dumps(what, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()


# --- 3. costs: exact integers from the definition of the travel model ---
class Costs:
    """Integer cost of every pair of nodes, at most ``peak``; where ``small``, int64 suffices."""

    def __init__(self, data: Any, x: list[int], y: list[int], step: Fraction, virtual: int):
        self.virtual, self.size = virtual, len(x) + (virtual >= 0)
        self.matrix: Any = None
        self.step, self.quantum = step, fraction(data["quantum"])
        if "matrix" in data:
            self.matrix = self._matrix(data["matrix"], len(data["ids"]))
        self.reach = (max(x) - min(x), max(y) - min(y))
        self.exact = self.quantum == 1  # of a matrix; formulas find out by themselves
        self.fits = max(map(abs, x + y))  # bounds every intermediate; grows with the formula
        self.move = self._formula(data["travel"])
        demand(self.exact or "rounding" in data["travel"], "exact travel has another quantum")
        self.small = self.fits < LIMIT
        # the virtual node borrows the first hole's place; `between` sets its costs to 0
        kind = np.int64 if self.small else object
        self.x, self.y = (np.array(v + v[: virtual >= 0], dtype=kind) for v in (x, y))
        farthest = [np.array([v], dtype=object) for v in self.reach]
        self.peak = int((self.move(*farthest) if self.move else self.matrix).max())

    def _matrix(self, rows: Any, n: int) -> Any:
        demand(type(rows) is list and len(rows) == n, "the matrix has one row per hole")
        matrix = np.zeros((n, n), dtype=np.int64)
        for i, row in enumerate(rows):
            matrix[i, : i + 1] = matrix[: i + 1, i] = wholes(row, 0, count=i + 1)
        return matrix

    def between(self, i: Any, j: Any) -> Any:
        """Costs of the pairs ``i[k]``–``j[k]``; broadcasts."""
        if self.move:
            costs = self.move(abs(self.x[i] - self.x[j]), abs(self.y[i] - self.y[j]))
        else:
            last = len(self.matrix) - 1
            costs = self.matrix[np.minimum(i, last), np.minimum(j, last)]
        return np.where((i == self.virtual) | (j == self.virtual), 0, costs)

    def blocks(self) -> Iterator[tuple[Any, Any]]:
        """Keys, ascending, and costs of all pairs, some at a time."""
        first = 0
        while first < self.size:
            last = min(self.size, first + max(1, BLOCK // (self.size - first)))
            i, j = np.arange(first, last)[:, None], np.arange(first, self.size)
            yield (i * self.size + j)[i < j], self.between(i, j)[i < j]
            first = last

    def divisor(self) -> int:
        """Greatest common divisor of all costs, 1 if they are all 0."""
        g = 0
        for _, costs in self.blocks():
            g = int(np.gcd.reduce(costs[costs % g > 0] if g else costs, initial=g))
        return max(g, 1)

    def _formula(self, travel: Any) -> Move | None:
        """Cost of a move by dx, dy >= 0; None where a matrix says it."""
        speeds = {"sequential": "vx vy", "simultaneous": "vx vy", "explicit": ""}
        speeds |= {"euclidean": "vx vy rounding", "trapezoidal": "vx vy ax ay axes rounding"}
        model = str(travel.get("model")) if type(travel) is dict else ""
        demand(model in speeds, f"unknown travel model {model[:60]!a}")
        fields(travel, "model " + speeds[model], "rounding")
        up, joins = (
            travel.get("rounding") == "up",
            {"sequential": np.add, "simultaneous": np.maximum},
        )
        demand(up or travel.get("rounding", "nearest") == "nearest", "rounding is nearest or up")
        if model == "explicit":
            demand(self.matrix is not None, "there is no travel matrix")
            return None
        v = [fraction(travel[k]) for k in ("vx", "vy")]
        if model == "trapezoidal":
            demand(travel["axes"] in list(joins), "the axes are sequential or simultaneous")
            axes = zip(v, ("ax", "ay"), self.reach, strict=True)
            tx, ty = (self._ramp(w, fraction(travel[k]), up, far) for w, k, far in axes)
            return lambda dx, dy: joins[travel["axes"]](tx(dx), ty(dy))
        power = 2 if model == "euclidean" else 1
        a, b, m = _common(*((self.step / self.quantum / w) ** power for w in v))
        far = a * self.reach[0] ** power + b * self.reach[1] ** power
        self.fits += 4 * far + a + b + 2 * m
        self.exact = power == m == math.gcd(a, b) == 1  # the largest quantum in which all is whole
        if model == "euclidean":
            return lambda dx, dy: _root(a * dx * dx + b * dy * dy, m, up)
        return lambda dx, dy: _ratio(joins[model](a * dx, b * dy), m, up)

    def _ramp(self, v: Fraction, a: Fraction, up: bool, reach: int) -> Callable[[Any], Any]:
        """Speed up, cruise, brake: d/v + v/a from d = v^2/a on, before that 2 sqrt(d/a)."""
        slope, offset, m = _common(self.step / v / self.quantum, v / a / self.quantum)
        s, r = (4 * self.step / a / self.quantum**2).as_integer_ratio()
        cruise = min(math.ceil(v * v / a / self.step), reach + 1)
        self.fits += 2 * (slope * reach + offset) + slope + 4 * s * (cruise + 1) + 2 * m + r

        def time(d: Any) -> Any:
            short = _root(s * np.minimum(d, cruise), r, up)
            return np.where(d >= cruise, _ratio(slope * d + offset, m, up), short)

        return time


def _common(p: Fraction, q: Fraction) -> tuple[int, int, int]:
    m = math.lcm(p.denominator, q.denominator)
    return int(p * m), int(q * m), m


def _ratio(value: Any, m: int, up: bool) -> Any:
    """``value / m`` rounded up, or half up."""
    return value if m == 1 else -(-value // m) if up else (2 * value + m) // (2 * m)


def _root(value: Any, m: int, up: bool) -> Any:
    """The root of ``value / m`` rounded up, or half up."""
    n = -(-value // m) if up else 4 * value // m
    if n.dtype == object:
        k = np.frompyfunc(math.isqrt, 1, 1)(n)
    else:  # the float is a guess that is off by one at most
        k = np.sqrt(n).astype(np.int64)
        k -= k * k > n
        k += (k + 1) * (k + 1) <= n
    return k + (k * k < n) if up else (k + 1) // 2


# --- 4. the route: every hole once, the right ends, the claimed cost ---
def check_route(problem: Problem, route: Any, upper: int) -> None:
    """Section ``route``."""
    nodes, n = wholes(route, 0), problem.n
    demand(sorted(nodes) == list(range(n)), "the route does not drill every hole once", REFUTED)
    good = problem.start in (-1, nodes[0]) and problem.end in (-1, nodes[-1])
    demand(good, "the route does not start or end where it must", REFUTED)
    if problem.home >= 0:
        nodes.insert(0 if problem.out else n, problem.home)
    nodes = [problem.virtual, *nodes] if problem.virtual >= 0 else nodes
    after = nodes[1:] + nodes[:1]
    used = {problem.key(i, j) for i, j in zip(nodes, after, strict=True)}
    good = problem.forced <= used and not problem.forbidden & used
    demand(good, "the route breaks a rule about successive holes", REFUTED)
    cost = sum(map(int, problem.costs.between(np.array(nodes), np.array(after))))
    demand(cost == upper, f"the route costs {cost}, not {upper}", REFUTED)


# --- 5. the pool: node sets, subtour cuts and combs, and dual vectors over them ---
class Duals(NamedTuple):
    """Scale, potentials, right-hand side of the cuts, total weight of each set."""

    scale: int
    pi: Any
    rhs: int
    weights: dict[int, int]


def least_tour(lengths: Any) -> int:
    """The length of a shortest closed tour of a few parts (Held and Karp 1962)."""
    last = len(lengths) - 1
    best = np.full((1 << last, last), LIMIT, dtype=np.int64)  # by parts visited, and the last one
    best[1 << np.arange(last), np.arange(last)] = lengths[last, :last]
    visited = np.arange(1 << last)
    number = sum(visited >> k & 1 for k in range(last))
    for count in range(1, last):
        for k in range(last):
            before = visited[(number == count) & (visited >> k & 1 == 0)]
            best[before | 1 << k, k] = (best[before] + lengths[:last, k]).min(axis=1)
    return int((best[-1] + lengths[:last, last]).min())


class Pool:
    """Node sets as runs, and cuts (weight of each set, right-hand side) that are verified."""

    def __init__(self, sets: Any, cuts: Any, size: int, version: int):
        demand(type(sets) is list and type(cuts) is list, "sets and cuts are lists")
        self.size, self.sets = size, sets
        for ends in sets:
            wholes(ends, 0, size - 1)
            gaps = [b - a for a, b in pairwise(ends)]
            ascending = min(gaps[::2], default=0) >= 0 and min(gaps[1::2], default=2) >= 2
            demand(len(ends) % 2 == 0 and ascending, "a set is first, last, first, last, ...")
            nodes = sum(gaps[::2]) + len(ends) // 2
            demand(0 < nodes < size, "a set must hold some nodes but not all", REFUTED)
        self.least: dict[bytes, int] = {}  # what the local cuts' tours weigh, by pattern
        self.cuts = [
            self._local(cut) if type(cut) is dict and version > 1 else self._template(cut)
            for cut in cuts
        ]

    def _local(self, cut: Any) -> tuple[dict[int, int], int]:
        """Weighted sets: at least the least weight of a tour of the parts they make of the nodes.

        Weights on sets make a metric in which a part has no extent: a tour of all nodes,
        shortened to one visit of each part, weighs no more.
        """
        cut = fields(cut, "sets weights")
        sets = wholes(cut["sets"], 0, len(self.sets) - 1)
        weights = np.array(wholes(cut["weights"], 1, HEAVIEST), dtype=np.int64)
        good = 0 < len(sets) == len(weights) <= PARTS**2 and len(set(sets)) == len(sets)
        demand(good, "a local cut has different sets and a weight for each")
        parts = np.unique(self.members(sets), axis=1).T.astype(np.int64)
        demand(len(parts) <= PARTS, f"a local cut's sets make more than {PARTS} parts", REFUTED)
        pattern = parts.tobytes() + weights.tobytes()
        if pattern not in self.least:
            self.least[pattern] = least_tour(abs(parts[:, None] - parts) @ weights)
        return dict(zip(sets, weights.tolist(), strict=True)), self.least[pattern]

    def _template(self, cut: Any) -> tuple[dict[int, int], int]:
        """One set S: x(d(S)) >= 2.  Handle and t teeth: the comb inequality, >= 3t + 1."""
        t = len(wholes(cut, 0, len(self.sets) - 1)) - 1
        demand(t == 0 or (t >= 3 and t % 2), "a comb needs an odd number of >= 3 teeth", REFUTED)
        if t:
            handle, *teeth = self.members(cut)
            demand((np.sum(teeth, axis=0) <= 1).all(), "two teeth of a comb share a node", REFUTED)
            crossed = all((tooth & handle).any() and (tooth & ~handle).any() for tooth in teeth)
            demand(crossed, "a tooth of a comb does not cross the handle", REFUTED)
        return dict.fromkeys(cut, 1), 3 * t + 1 if t else 2

    def members(self, which: Sequence[int]) -> Any:
        """Boolean matrix (sets, nodes): which nodes each set holds."""
        runs = [self.sets[s] for s in which]
        row = np.repeat(np.arange(len(runs)), [len(r) // 2 for r in runs])
        ends = np.array([*chain(*runs)], dtype=np.int64)
        step = np.zeros((len(runs), self.size + 1), dtype=np.int8)
        step[row, ends[::2]], step[row, ends[1::2] + 1] = 1, -1
        return np.cumsum(step[:, :-1], axis=1, dtype=np.int8).astype(bool)

    def duals(self, data: Any, before: Any, above: Any) -> Duals:
        """A dual vector; ``before`` holds the potentials of the previous one."""
        data, rhs, weights = fields(data, "scale pi", "cuts branches"), 0, Counter[int]()
        (scale,) = wholes([data["scale"]], 0)
        pi = before + np.array(wholes(data["pi"], count=self.size), dtype=np.int64)
        demand(int(abs(pi).max()) < LIMIT, "a potential is out of range")
        for field, table in (("cuts", self.cuts), ("branches", self.sets)):
            values = wholes(data.get(field, []))
            paired = len(values) % 2 == 0 and 0 not in values[1::2]
            demand(paired, "expected index, multiplier (not 0), index, multiplier, ...")
            for k, y in zip(wholes(values[::2], 0, len(table) - 1), values[1::2], strict=True):
                if field == "cuts":
                    demand(y > 0, "a cut has a negative multiplier", REFUTED)
                    sets, side = self.cuts[k]
                else:
                    good = k in above[3 if y > 0 else 2]
                    demand(good, "a multiplier needs a set branch above its node", REFUTED)
                    sets, side = {k: 1}, 4 if y > 0 else 2
                rhs += y * side
                weights.update({s: y * w for s, w in sets.items()})
        return Duals(scale, pi, rhs, {s: w for s, w in weights.items() if w})


# --- 6. the bounds that dual vectors prove ---
class Domain(NamedTuple):
    """Pairs that tours below a node may use, ascending by key; the others are proved away."""

    keys: Any
    costs: Any
    low: Any


class Proof:
    """One instance and its pool: what dual vectors prove about it."""

    def __init__(self, problem: Problem, pool: Pool):
        self.problem, self.pool, self.costs = problem, pool, problem.costs

    def price(
        self, domain: Domain | None, above: Any, duals: Duals, reach: int = -1
    ) -> tuple[Any, ...]:
        """The lower bound; keys, costs, uses, reduced costs rc of all pairs with rc <= ``reach``.

        rc = scale c - P_i - P_j + (terms >= 0), P_i being i's potential plus the positive
        weights of the sets that hold i: pairs beyond reach without the last terms stay unpriced.
        The bound is infinite, and nothing else returned, where the branches contradict each other.
        """
        size, scale, weights = self.problem.size, duals.scale, list(duals.weights.values())
        inside = self.pool.members(list(duals.weights))
        inside ^= inside.sum(axis=1, keepdims=True) * 2 > size  # same boundary, smaller side
        most = int(abs(duals.pi).max()) + sum(map(abs, weights)) + abs(reach)
        small = self.costs.small and scale * (self.costs.peak + 1) + 4 * most < LIMIT
        kind: Any = np.int64 if small else object
        weight, level, outer = np.array(weights, kind), duals.pi.astype(kind), duals.pi.astype(kind)
        held, sets = np.nonzero(inside.T)  # node by node, the sets that hold it
        np.add.at(level, held, np.maximum(weight, 0)[sets])
        np.add.at(outer, held, weight[sets])
        absent, present = (np.array(sorted(s), dtype=np.int64) for s in above[:2])
        parts, missing = [], len(present)
        for keys, costs, low, high in self._pairs(domain):
            i, j = np.divmod(keys, size)
            near = scale * costs.astype(kind, copy=False) - level[i] - level[j] <= reach
            low[used := _places(keys, present)] = 1
            high[_places(keys, absent)] = 0
            missing -= len(used)
            part = [values[near | (low > 0)] for values in (keys, costs, low, high, i, j)]
            parts.append([*part, scale * part[1].astype(kind) - outer[part[4]] - outer[part[5]]])
        keys, costs, low, high, i, j, rc = (
            np.concatenate(part) for part in zip(*parts, strict=True)
        )
        if missing or (low > high).any():
            return (math.inf,)
        first = np.searchsorted(held, np.arange(size + 1))
        height = max(1, 2**22 // max(1, int(np.diff(first).max())))
        for top in range(0, len(keys), height):  # a set that holds both ends is not crossed
            p, q = i[top : top + height], j[top : top + height]
            count = first[p + 1] - first[p]
            pair = np.repeat(np.arange(len(p)), count)
            s = sets[np.arange(len(pair)) + np.repeat(first[p] - np.cumsum(count) + count, count)]
            both = inside[s, q[pair]]
            np.add.at(rc, top + pair[both], 2 * weight[s[both]])
        degree = 2 if size > 1 else 0  # the tour of a single node has no edges
        total = np.where(rc < 0, high * rc, low * rc).sum(dtype=object)  # of Python integers
        bound = degree * int(duals.pi.sum(dtype=object)) + duals.rhs + int(total)
        return bound, keys, costs, low, high, rc

    def _pairs(self, domain: Domain | None) -> Iterator[tuple[Any, Any, Any, Any]]:
        """Keys, ascending, costs, least and most uses of the pairs of a domain, block by block."""
        cap, rules = self.problem.cap, (self.problem.forced, self.problem.forbidden)
        forced, forbidden = (np.array(sorted(s), dtype=np.int64) for s in rules)
        for keys, costs in self.costs.blocks() if domain is None else ():
            low, high = np.zeros(len(keys), np.int64), np.full(len(keys), cap)
            low[_places(keys, forced)], high[_places(keys, forbidden)] = 1, 0
            yield keys, costs, low, high
        if domain is not None:
            yield *domain[:2], domain.low.copy(), np.full(len(domain.keys), cap)

    def fix(self, domain: Domain | None, above: Any, duals: Duals, goal: int) -> Domain | None:
        """The domain without the pairs that no tour with scale * cost <= ``goal`` uses."""
        slack = goal - self.price(domain, above, duals)[0]
        if slack == -math.inf:
            return domain
        _, keys, costs, low, high, rc = self.price(domain, above, duals, max(slack, -1))
        keep = (high > 0) & ((low > 0) | (rc < 0) | (rc <= slack))
        low = np.where((rc <= 0) & (-rc > slack), 1, low)
        return domain if keep.sum() > MOST_PAIRS else Domain(keys[keep], costs[keep], low[keep])


def _places(keys: Any, some: Any) -> Any:
    """Where those of ``some`` that are among the ascending ``keys`` stand there."""
    at = np.searchsorted(keys, some)
    return at[np.append(keys, -1)[at] == some]


# --- 7. the tree: its branches cover every tour, and every leaf is closed ---
def check_tree(problem: Problem, pool: Pool, tree: Any, lower: int | None) -> None:
    """Section ``tree``: nodes in preorder, walked without recursion."""
    demand(type(tree) is list and all(type(node) is dict for node in tree), "the tree is a list")
    g, size, seen = problem.costs.divisor(), problem.size, 0
    below = 0 if lower is None else -(-lower // g) * g - g  # the next cost under the claim
    proof, pi = Proof(problem, pool), np.zeros(size, dtype=np.int64)
    nothing = Duals(0, pi, 0, {})  # closes a leaf only if its branches contradict each other
    stack: list[tuple[int, Domain | None, Any]] = [(0, None, ())]
    while stack:
        at, domain, path = stack.pop()
        demand(at == seen < len(tree), f"the preorder expects tree node {seen}, not {at}")
        node, seen = tree[at], seen + 1
        kind = next((k for k in KINDS if k in node), "leaf")
        fields(node, f"{kind} {KINDS[kind]}")
        if kind in ("edge", "set"):
            if kind == "edge":
                i, j = wholes(node["edge"], 0, size - 1, 2)
                demand(i != j, "an edge joins two different nodes")
                table, what = 0, problem.key(i, j)
            else:
                table, (what,) = 2, wholes([node["set"]], 0, len(pool.sets) - 1)
            a, b = wholes(node["children"], 0, count=2)
            stack.append((b, domain, (path, table + 1, what)))
            stack.append((a, domain, (path, table, what)))
            continue
        above, duals = _above(path), nothing
        if kind == "fix" or node[kind] is not None:
            duals = pool.duals(node[kind], pi, above)
            pi = duals.pi
        usable = lower is not None or duals.scale == 0
        if kind == "leaf":
            bound = proof.price(domain, above, duals)[0]
            closed = bound > duals.scale * below if usable else bound == math.inf
            demand(closed, f"leaf {at} is not closed: it misses the claim", REFUTED)
        else:
            domain = proof.fix(domain, above, duals, duals.scale * below) if usable else domain
            stack.append((*wholes([node["child"]], 0), domain, path))
    demand(seen == len(tree), f"tree nodes from {seen} on hang on no parent")


def _above(path: Any) -> tuple[set[int], ...]:
    """Decisions on a path: pairs absent, pairs present, sets crossed twice, >= 4 times."""
    found: tuple[set[int], ...] = (set(), set(), set(), set())
    while path:
        path, table, what = path
        found[table].add(what)
    return found


# --- 8. the statement ---
class Verdict(NamedTuple):
    """What has been proved; ``lower`` (None: no route exists) and ``upper`` in quanta."""

    statement: str
    sha256: str
    lower: int | None
    upper: int | None


def check(raw: bytes, holes: Sequence[Hole] | None = None, sha256: str | None = None) -> Verdict:
    """Check a certificate's bytes; raises a :class:`Failure` unless it proves its claim.

    ``holes`` (id, x, y in mm) and ``sha256`` say which workpiece and instance it must be about.
    """
    data = load(raw)
    problem, claim = Problem(data["instance"]), fields(data["claim"], "", "lower upper infeasible")
    known, stated = holes is None or list(holes) == problem.holes, problem.data["sha256"]
    demand(known, "it is about another workpiece than the one given", REFUTED)
    known = sha256 in (None, stated)
    demand(known, "it is about another instance: other holes, travel, ends or rules", REFUTED)
    lower, upper = (wholes([claim[k]])[0] if k in claim else None for k in ("lower", "upper"))
    none = claim.get("infeasible")
    good = none is True if lower is None else none is None
    demand(good, "a claim is either a lower bound or infeasible: true")
    demand((upper is None) == ("route" not in data), "route and upper come together")
    if upper is not None:
        good = lower is not None and lower <= upper
        demand(good, "the route given contradicts the claimed lower bound", REFUTED)
        check_route(problem, data["route"], upper)
    pool = Pool(data["sets"], data["cuts"], problem.size, data["version"])
    check_tree(problem, pool, data["tree"], lower)
    return Verdict(statement(problem, lower, upper), stated, lower, upper)


def statement(problem: Problem, lower: int | None, upper: int | None) -> str:
    """What has been proved, in one sentence."""
    data, quantum = problem.data, problem.costs.quantum
    settings = {**data["travel"], **data["ends"], **data["rules"]}
    how = ", ".join(f"{key} {value!a}" for key, value in settings.items())
    shape = "open path" if problem.virtual >= 0 else "closed tour"
    who = f"{data['name']!a} ({shape}, {problem.n} holes; {how})"
    if lower is None:
        return f"No route of {who} satisfies its ends and rules."
    low = f"{Decimal(lower * quantum.numerator) / quantum.denominator} s"
    low += f" ({lower} quanta of {quantum} s)"
    if lower == upper:
        return f"The route given for {who} takes {low}, and no route takes less."
    rest = "" if upper is None else f", and the route given takes {upper} quanta"
    return f"Every route of {who} takes at least {low}{rest}."


def trust(bound: bool) -> str:
    """What a verdict still rests on; ``bound``: the user's own workpiece was compared."""
    what = "Trusted: this checker, Python, numpy and the machine"
    return what + ("." if bound else "; and that the workpiece in the file is yours.")


def main(arguments: Sequence[str]) -> int:
    """``python certificate.py FILE [SHA256]``."""
    if len(arguments) not in (1, 2) or arguments[0].startswith("-"):
        print("usage: python certificate.py FILE [SHA256]", file=sys.stderr)
        return 2
    try:
        verdict = check(unzip(Path(arguments[0])), None, *arguments[1:])
    except Failure as failure:
        print(f"{failure.word}: {failure}", file=sys.stderr)
        return failure.code
    except Exception as error:
        print(f"internal error: {type(error).__name__}: {error}", file=sys.stderr)
        return 70
    print(f"verified: {verdict.statement}\nsha256 {verdict.sha256}\n{trust(len(arguments) == 2)}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
