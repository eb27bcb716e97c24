"""The certificate checker: decides whether a certificate proves what it claims.

This one file is all that has to be trusted.  It needs Python and numpy and nothing of ``tcp``: a
copy of it runs anywhere, as ``python certificate.py FILE [SHA256]``.  ``docs/certificate.md`` has
the format and the mathematics.  Everything is derived again from what the file says, and only
integers decide: int64 where a bound on all intermediates proves that they fit, else Python's own.
"""

from __future__ import annotations

import gzip
import hashlib
import json
import math
import sys
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from decimal import ROUND_FLOOR, Context
from fractions import Fraction
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

CODES = {1: "refuted", 2: "usage", 3: "malformed", 6: "unsupported", 70: "internal error"}
REFUTED, USAGE, MALFORMED, UNSUPPORTED, INTERNAL = CODES
LIMIT = 2**61  # every number of a certificate, and every int64 intermediate, stays below
MAX_BYTES, MAX_LISTS, MAX_NUMBERS, MAX_HELD = 2**28, 6_000_000, 60_000_000, 2**31
PARTS, HEAVIEST = 16, 2**20  # of a local cut: most parts, largest weight
BLOCK = 2**18  # pairs handled at a time
TYPES = {
    str: "format name step quantum sha256 start end min_jump model axes rounding vx vy ax ay",
    int: "version lower upper scale set child",
    bool: "outward return closed infeasible",
    dict: "instance travel ends rules claim fix",
    list: "ids x y home matrix forbidden together route sets cuts tree weights branches",
}
TYPE_OF = {field: kind for kind, names in TYPES.items() for field in names.split()}
MODELS = {"sequential": "vx vy", "simultaneous": "vx vy", "explicit": ""}
MODELS |= {"euclidean": "vx vy rounding", "trapezoidal": "vx vy ax ay axes rounding"}
AXES = {"sequential": np.add, "simultaneous": np.maximum}  # what joins the times of both
NODES = {"edge": "edge children", "set": "set children", "fix": "fix child", "leaf": "leaf"}
TRUST = "Trusted: this checker, Python, numpy and the machine"
YOURS = "; and that the workpiece in the file is yours."


class Failure(Exception):
    """The certificate is not accepted; ``code`` (the exit code) says in which way."""

    def __init__(self, message: str, code: int = MALFORMED):
        super().__init__(message)
        self.code, self.word = code, CODES[code]


def demand(holds: Any, message: str, code: int = MALFORMED) -> None:
    """Fail unless the condition holds."""
    if not holds:
        raise Failure(message, code)


def wholes(values: Any, low: int = 1 - LIMIT, high: int = LIMIT - 1, count: int = -1) -> list[int]:
    """A list of (``count``) whole numbers in ``low .. high``."""
    good = type(values) is list and set(map(type, values)) <= {int}
    good = good and (not values or low <= min(values) <= max(values) <= high)
    demand(good and count in (-1, len(values)), f"expected whole numbers in {low} .. {high}")
    return list(values)


def fraction(text: Any, least: int = 1) -> Fraction:
    """A fraction in lowest terms, as text; with a numerator of ``least`` or more."""
    try:
        value = Fraction(text if len(text) < 400 and set(text) <= set("-/0123456789") else "")
    except (ValueError, TypeError, ZeroDivisionError):
        raise Failure(f"{str(text)[:60]!a} is not a fraction as text") from None
    reduced = str(value) == text and value.numerator >= least
    demand(reduced, f"the fraction {text[:60]!a} must be in lowest terms and in range")
    return value


def fields(data: Any, required: str, optional: str = "") -> list[Any]:
    """The fields of an object, each of its type, and None for those that may and do miss."""
    demand(type(data) is dict, f"expected an object with {required or optional}")
    need, known = required.split(), f"{required} {optional}".split()
    wrong = (data.keys() - known) | (set(need) - data.keys())
    demand(not wrong, f"missing or unknown field {min(wrong, default='')[:60]!a}")
    for key, value in data.items():
        kind = TYPE_OF.get(key, type(value))
        demand(type(value) is kind, f"the field {key} must be of type {kind.__name__}")
        wholes([value] if kind is int else [])
    return [data.get(key) for key in known]


# --- 1. the file: bounded, no key twice ---
def unzip(path: Path) -> bytes:
    """The file's bytes, gzipped or not, never more than one beyond the limit."""
    try:
        with path.open("rb") as stream:
            opener: Any = gzip.open if stream.read(2) == b"\x1f\x8b" else open
        with opener(path, "rb") as stream:
            return bytes(stream.read(MAX_BYTES + 1))
    except (OSError, EOFError, zlib.error) as error:
        raise Failure(f"cannot read {path}: {getattr(error, 'strerror', 0) or error}") from None


def load(raw: bytes) -> dict[str, Any]:
    """The JSON object in ``raw``."""

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        demand(len(dict(pairs)) == len(pairs), "an object has the same key twice")
        return dict(pairs)

    demand(len(raw) <= MAX_BYTES, f"a certificate has at most {MAX_BYTES} bytes")
    lists = raw.count(b"[") + raw.count(b"{")
    demand(lists <= MAX_LISTS and raw.count(b",") <= MAX_NUMBERS, "too many lists or numbers")
    try:
        data = json.loads(raw.decode(), object_pairs_hook=unique)
    except (ValueError, RecursionError) as error:
        raise Failure(f"no valid JSON: {error!s:.80}") from None
    demand(type(data) is dict and data.get("format") == "tcp-certificate", "not a tcp-certificate")
    (version,) = wholes([data.get("version")])
    demand(version in (1, 2), f"version {version}; this checker knows 1 and 2", UNSUPPORTED)
    fields(data, "format version instance claim sets cuts tree", "route")
    demand(version > 1 or dict not in map(type, data["cuts"]), "version 1 has no local cuts")
    return dict(data)


# --- 2. the instance: holes, ends, rules, and the hash of it all ---
class Problem:
    """The instance as a closed tour over ``size`` nodes: holes, home, virtual node.

    ``forced`` and ``forbidden`` hold the keys of pairs that every tour must and must not use;
    ``cap`` is how often a tour can use a pair (of only two nodes: there and back).
    """

    def __init__(self, data: Any):
        fields(data, "name step ids x y travel quantum ends rules sha256", "matrix")
        self.data, ids, step = data, data["ids"], fraction(data["step"])
        demand({*map(type, ids)} == {str} and len({*ids}) == len(ids), "ids must differ, as texts")
        self.n, self.index = len(ids), {name: i for i, name in enumerate(ids)}
        x, y = (wholes(data[axis], -(2**52), 2**52, self.n) for axis in "xy")
        self.holes = [(h, p * step, q * step) for h, p, q in zip(ids, x, y, strict=True)]
        *rules, jump = fields(data["rules"], "", "together forbidden min_jump")
        together, apart = ([self._holes(p, 2) for p in pairs or []] for pairs in rules)
        near = math.ceil((fraction("0" if jump is None else jump, 0) / step) ** 2)
        pairs = combinations(range(self.n if near else 0), 2)
        apart += [[i, j] for i, j in pairs if (x[i] - x[j]) ** 2 + (y[i] - y[j]) ** 2 < near]
        legs, *ends = fields(data["ends"], "", "home start end outward return closed")
        home, (self.outward, back, closed) = [fraction(v, -LIMIT) for v in legs or []], ends[2:]
        self.start, self.end = (-1 if e is None else self._holes([e], 1)[0] for e in ends[:2])
        demand(len(home) == (2 if self.outward or back else 0), "home needs a leg, a leg a home")
        demand(not (closed and (home or self.end >= 0)), "a closed route has no end, no home")
        demand(not self.start == self.end >= 0 or self.n == 1, "start and end are the same hole")
        if home:  # a node like the others, on a step fine enough for it
            finer = math.lcm(*((v / step).denominator for v in home))
            step, axes = step / finer, zip((x, y), home, strict=True)
            x, y = ([v * finer for v in axis] + [int(at / step)] for axis, at in axes)
        self.home = self.n if home else -1
        self.virtual = -1 if closed or (self.outward and back) else len(x)
        self.size = len(x) + (self.virtual >= 0)
        self.cap = 2 if self.size == 2 else 1
        first, last = (self.home if leg else self.virtual for leg in (self.outward, back))
        edges = [(self.home, self.virtual), (self.start, first), (self.end, last), *together]
        self.forced = {self.key(i, j) for i, j in edges if min(i, j) >= 0}
        self.forbidden = {self.key(i, j) for i, j in apart}
        self._costs(x, y, step)
        demand(data["sha256"] == self._hash(), "the instance has another hash", REFUTED)

    def key(self, i: int, j: int) -> int:
        """One number for a pair of nodes."""
        return min(i, j) * self.size + max(i, j)

    def _holes(self, names: Any, count: int) -> list[int]:
        """Positions of ``count`` different holes."""
        good = type(names) is list and {*map(type, names)} <= {str} and len(names) == count
        demand(good and len(self.index.keys() & names) == count, "an end or rule names no holes")
        return [self.index[name] for name in names]

    def _hash(self) -> str:
        data, at = self.data, zip(self.index, self.data["x"], self.data["y"], strict=True)
        lines = [f"tcp-workpiece-1\nstep {data['step']}\n"]
        lines += [f"{len(name)}:{name} {x} {y}\n" for name, x, y in at]
        piece = hashlib.sha256("".join(lines).encode(errors="surrogatepass"))
        if "matrix" in data:
            piece.update(b"matrix\n" + self.matrix[: self.n, : self.n].astype("<i8").tobytes())
        what = {key: data[key] for key in ("travel", "quantum", "ends", "rules")}
        what["workpiece"] = piece.hexdigest()
        text = json.dumps(what, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    # --- 3. costs: exact integers from the definition of the travel model ---
    def _costs(self, x: list[int], y: list[int], step: Fraction) -> None:
        """Costs are at most ``peak``, multiples of ``divisor``; numpy's ``kind`` holds them."""
        data, travel = self.data, self.data["travel"]
        self.model, rounding = str(travel.get("model"))[:60], travel.get("rounding", "nearest")
        demand(self.model in MODELS, f"unknown travel model {self.model!a}")
        fields(travel, f"model {MODELS[self.model]}", "rounding" * (self.model in AXES))
        axes = travel.get("axes", self.model if self.model in AXES else "sequential")
        demand(axes in AXES and rounding in ("nearest", "up"), "unknown axes or rounding")
        self.up, self.join, self.quantum = rounding == "up", AXES[axes], fraction(data["quantum"])
        v, a = ([fraction(travel.get(k + axis, "1")) for axis in "xy"] for k in "va")
        p, q = self.pace = [step / self.quantum / w for w in v]  # quanta for a step
        self.rise = [step / w / self.quantum**2 for w in a]
        whole = p.denominator == q.denominator == math.gcd(p.numerator, q.numerator) == 1
        good = "rounding" in travel or (self.quantum == 1 if self.model == "explicit" else whole)
        demand(good, "exact travel has another quantum")
        demand(len(data.get("matrix", data["ids"])) == self.n, "the matrix has a row per hole")
        rows = [wholes(row, 0, count=i + 1) for i, row in enumerate(data.get("matrix", []))]
        self.matrix = np.zeros((self.size, self.size if rows else 0), dtype=np.int64)
        for i, row in enumerate(rows):
            self.matrix[i, : i + 1] = self.matrix[: i + 1, i] = row
        listed = self.matrix.size > 0 > self.home
        demand(listed or self.model != "explicit", "explicit travel has a matrix and no home")
        self.fits = max(map(abs, x + y))  # or more: `time` sees to it with the longest move
        longest = [np.array([max(v) - min(v)], dtype=object) for v in (x, y)]
        self.peak = int((self.matrix if self.model == "explicit" else self.move(*longest)).max())
        self.kind: Any = np.int64 if self.fits < LIMIT else object
        self.x, self.y = (np.array(v + v[: self.virtual >= 0], dtype=self.kind) for v in (x, y))
        self.divisor = math.gcd(*(int(np.gcd.reduce(c, initial=0)) for _, c in self.blocks())) or 1

    def move(self, dx: Any, dy: Any) -> Any:
        """Costs of moves by dx, dy >= 0."""
        p, q = self.pace
        if self.model == "euclidean":
            return self.time(p * p, dx * dx, q * q, dy * dy, root=True)
        if self.model == "trapezoidal":
            return self.join(self.ramp(dx, p, self.rise[0]), self.ramp(dy, q, self.rise[1]))
        return self.time(p, dx, q, dy, self.join)

    def ramp(self, d: Any, pace: Fraction, rise: Fraction) -> Any:
        """Speed up, cruise, brake: d/v + v/a from d = v^2/a on, before that 2 sqrt(d/a)."""
        cruise = min(math.ceil(rise / pace**2), int(d.max(initial=0)) + 1)
        short = self.time(4 * rise, np.minimum(d, cruise), Fraction(0), 0, root=True)
        return np.where(d >= cruise, self.time(pace, d, rise / pace, 1), short)

    def time(self, p: Any, u: Any, q: Any, w: Any, join: Any = np.add, root: bool = False) -> Any:
        """``join(p u, q w)``, or its root, rounded up or half up."""
        m = math.lcm(p.denominator, q.denominator)
        value = join(int(p * m) * u, int(q * m) * w)
        if value.dtype == object:
            self.fits = max(self.fits, 8 * (int(value.max(initial=0) + p * m + q * m) + m + 1))
        if not root:
            return -(-value // m) if self.up else (2 * value + m) // (2 * m)
        n = -(-value // m) if self.up else 4 * value // m
        k = np.frompyfunc(math.isqrt, 1, 1)(n).astype(n.dtype)
        return k + (k * k < n) if self.up else (k + 1) // 2

    def between(self, i: Any, j: Any) -> Any:
        """Costs of the pairs ``i[k]``-``j[k]``; 0 at the virtual node, wherever its x and y are."""
        if self.model == "explicit":
            return self.matrix[i, j]
        costs = self.move(abs(self.x[i] - self.x[j]), abs(self.y[i] - self.y[j]))
        return np.where((i == self.virtual) | (j == self.virtual), 0, costs)

    def blocks(self) -> Iterator[tuple[Any, Any]]:
        """Keys, ascending, and costs of all pairs, some at a time."""
        rows = BLOCK // self.size + 1
        for first in range(0, self.size, rows):
            keys = np.arange(first * self.size, min(first + rows, self.size) * self.size)
            i, j = np.divmod(keys, self.size)
            yield keys[i < j], self.between(i[i < j], j[i < j])

    def check_route(self, route: Any, upper: int) -> None:
        """Section ``route``: every hole once, the right ends, the claimed cost."""
        nodes = wholes(route, 0)
        demand(sorted(nodes) == [*range(self.n)], "it does not drill every hole once", REFUTED)
        demand(self.start in (-1, nodes[0]) and self.end in (-1, nodes[-1]), "wrong ends", REFUTED)
        others = (self.virtual, self.home) if self.outward else (self.home, self.virtual)
        nodes += [node for node in others if node >= 0]
        after = nodes[1:] + nodes[:1]
        used = {self.key(i, j) for i, j in zip(nodes, after, strict=True)}
        demand(self.forced <= used and not self.forbidden & used, "it breaks a rule", REFUTED)
        cost = sum(map(int, self.between(np.array(nodes), np.array(after))))
        demand(cost == upper, f"the route costs {cost}, not {upper}", REFUTED)

    def statement(self, lower: int | None, upper: int | None) -> str:
        """What has been proved, in one sentence."""
        settings = {**self.data["travel"], **self.data["ends"], **self.data["rules"]}
        how = ", ".join(f"{key} {value!a}" for key, value in settings.items())
        shape = "open path" if self.virtual >= 0 else "closed tour"
        who, q = f"{self.data['name']!a} ({shape}, {self.n} holes; {how})", self.quantum
        if lower is None:
            return f"No route of {who} satisfies its ends and rules."
        seconds = Context(rounding=ROUND_FLOOR).divide(lower * q.numerator, q.denominator)
        low = f"{seconds} s ({lower} quanta of {q} s)"
        if lower == upper:
            return f"The route given for {who} takes {low}, and no route takes less."
        rest = "" if upper is None else f", and the route given takes {upper} quanta"
        return f"Every route of {who} takes at least {low}{rest}."


class Proof:
    """Node sets, as rows of ``inside``, cuts, and what dual vectors over them prove.

    A cut is the weights of its sets and the least sum of weight times crossings that they have.
    A dual vector is scale, potentials, right-hand side, and weights of sets.  ``above`` is decided
    over a tree node: pairs absent, present, sets crossed twice, 4 times or more.  Its domain is the
    pairs not proved away: blocks of ascending keys, and costs.
    """

    # --- 4. node sets and cuts ---
    def __init__(self, problem: Problem, sets: list[Any], cuts: list[Any]):
        self.problem, self.size = problem, problem.size
        demand(len(sets) * self.size < MAX_HELD, "too many sets for so many nodes")
        self.inside = np.zeros((len(sets), self.size), dtype=bool)
        for runs, row in zip(sets, self.inside, strict=True):
            for first, last in zip(wholes(runs, 0, self.size - 1)[::2], runs[1::2], strict=False):
                row[first : last + 1] = True
            ends = np.flatnonzero(np.diff(row, prepend=False, append=False))
            found = (ends - np.arange(len(ends)) % 2).tolist()
            demand(found == runs, "a set is first, last, first, last, ... of its runs")
            demand(0 < row.sum() < self.size, "a set must hold some nodes but not all", REFUTED)
        self.cuts = [self._local(cut) if type(cut) is dict else self._comb(cut) for cut in cuts]

    def _comb(self, cut: Any) -> tuple[dict[int, int], int]:
        """One set S: x(d(S)) >= 2.  Handle and t teeth: the comb inequality, >= 3t + 1."""
        t = len(wholes(cut, 0, len(self.inside) - 1)) - 1
        demand(t == 0 or (t >= 3 and t % 2), "a comb needs an odd number of >= 3 teeth", REFUTED)
        handle, teeth = self.inside[cut[0]], self.inside[cut[1 : self.size]]  # more share nodes
        demand((teeth.sum(axis=0) <= 1).all(), "two teeth of a comb share a node", REFUTED)
        crossed = (teeth & handle).any(axis=1) & (teeth & ~handle).any(axis=1)
        demand(crossed.all(), "a tooth of a comb does not cross the handle", REFUTED)
        return dict.fromkeys(cut, 1), 3 * t + 1 if t else 2

    def _local(self, cut: Any) -> tuple[dict[int, int], int]:
        """Weights on sets make a metric in which a part, nodes in the same sets, has no extent.

        A tour, shortened to one visit of each part, weighs no more: the least is the length of a
        shortest tour of the parts (Held and Karp 1962).
        """
        sets, weights = fields(cut, "sets weights")
        wholes(weights, 1, HEAVIEST, len(wholes(sets, 0, len(self.inside) - 1)))
        demand(0 < len(set(sets)) == len(sets) <= PARTS**2, "a local cut has different sets")
        parts = np.unique(self.inside[sets], axis=1).T.astype(np.int64)
        demand(len(parts) <= PARTS, f"a local cut's sets make more than {PARTS} parts", REFUTED)
        lengths, last = abs(parts[:, None] - parts) @ np.array(weights), len(parts) - 1
        best = np.full((1 << last, last), LIMIT)  # by parts visited, and the last of them
        best[1 << np.arange(last), np.arange(last)] = lengths[last, :last]
        visited = np.arange(1, 1 << last)
        for k in [*range(last)] * (last - 1):  # every round gets the sets of one part more right
            before = visited[visited >> k & 1 == 0]
            best[before | 1 << k, k] = (best[before] + lengths[:last, k]).min(axis=1)
        return dict(zip(sets, weights, strict=True)), int((best[-1] + lengths[:last, last]).min())

    # --- 5. the bounds that dual vectors prove ---
    def duals(self, data: Any, before: Any, above: Any) -> tuple[int, Any, int, dict[int, int]]:
        """A dual vector; ``before`` holds the potentials of the previous one."""
        scale, change, *given = fields(data, "scale pi", "cuts branches")
        pi = before + np.array(wholes(change, count=self.size), dtype=np.int64)
        demand(scale >= 0 and int(abs(pi).max()) < LIMIT, "a scale or potential is out of range")
        rhs, weights = 0, Counter[int]()
        for of_cuts, values in zip((True, False), given, strict=True):
            values = wholes(values or [])
            demand(len(values) % 2 == 0 and 0 not in values[1::2], "expected index, factor")
            for k, y in zip(values[::2], values[1::2], strict=True):
                if of_cuts:
                    demand(0 <= k < len(self.cuts), f"there is no cut {k}")
                    demand(y > 0, "a cut has a negative multiplier", REFUTED)
                    sets, least = self.cuts[k]
                else:
                    demand(k in above[3 if y > 0 else 2], "no such branch is above", REFUTED)
                    sets, least = {k: 1}, 4 if y > 0 else 2
                rhs += y * least
                weights.update({s: y * w for s, w in sets.items()})
        return scale, pi, rhs, {s: w for s, w in weights.items() if w}

    def price(self, domain: Any, above: Any, duals: Any, reach: int = -1) -> tuple[Any, list[Any]]:
        """The bound (inf: no tour is below); keys, costs, most uses, rc of pairs with rc <= reach.

        Reduced costs rc = scale c - P_i - P_j + (terms >= 0), P_i being i's potential plus the
        positive weights of its sets: pairs beyond reach without the last terms stay unpriced.
        """
        (scale, pi, rhs, weights), problem = duals, self.problem
        weight: Any = [*weights.values(), 0]
        most = int(abs(pi).max()) + sum(map(abs, weight)) + abs(reach)
        kind = problem.kind if scale * (problem.peak + 1) + 4 * most < LIMIT else object
        pi, weight = pi.astype(kind), np.array(weight, kind)
        inside = np.vstack([self.inside[list(weights)], np.zeros(self.size, bool)])
        inside ^= inside.sum(axis=1, keepdims=True) * 2 > self.size  # same boundary, smaller side
        held, sets = np.nonzero(inside.T)
        place = np.arange(len(held)) - np.searchsorted(held, held)
        of = np.full((self.size, place.max(initial=0) + 1), len(weights))  # of the empty last row
        of[held, place] = sets  # node by node, the sets that hold it
        level, outer = (pi + w[of].sum(axis=1) for w in (np.maximum(weight, 0), weight))
        absent, present = (np.array(sorted(keys), dtype=np.int64) for keys in above[:2])
        degree, seen, found = 2 if self.size > 1 else 0, 0, []  # a single node's tour has no edges
        bound = rhs + degree * int(pi.sum(dtype=object))
        for keys, costs in domain or problem.blocks():
            i, j = np.divmod(keys, self.size)
            near = scale * costs.astype(kind) - level[i] - level[j] <= reach
            near |= np.isin(keys, present)
            keys, costs, i, j = (values[near] for values in (keys, costs, i, j))
            low, high = np.isin(keys, present) * 1, ~np.isin(keys, absent) * problem.cap
            rc = scale * costs.astype(kind) - outer[i] - outer[j]
            for sets in of.T:  # a set that holds both is not crossed
                rc += 2 * inside[sets[i], j] * weight[sets[i]]
            bound += int(np.minimum(low * rc, high * rc).sum(dtype=object))
            seen += int(low.sum()) - int((low > high).sum())
            found.append((keys, costs, high, rc))
        return bound if seen == len(present) else math.inf, found

    def fix(self, domain: Any, above: Any, duals: Any, goal: int) -> tuple[Any, list[int]]:
        """The domain of the tours with scale * cost <= ``goal``; pairs that all of them use."""
        slack = goal - self.price(domain, above, duals)[0]
        kept, used = [], []
        for keys, costs, high, rc in self.price(domain, above, duals, max(slack, -1))[1]:
            keep = (high > 0) & ((rc < 0) | (rc <= slack) | np.isin(keys, [*above[1]]))
            kept.append((keys[keep], costs[keep]))
            used += keys[(high > 0) & (rc < 0) & (-rc > slack)].tolist()
        return kept, used

    def check_tree(self, tree: list[Any], lower: int | None) -> None:
        """Section ``tree``: its branches cover every tour, and every leaf is closed."""
        g, pi, seen = self.problem.divisor, np.zeros(self.size, dtype=np.int64), 0
        below = 0 if lower is None else -(-lower // g) * g - g  # the next cost under the claim
        root = (((), 0, self.problem.forbidden), 1, self.problem.forced)  # (its parent's, decision)
        stack: list[Any] = [(0, None, root)]
        while stack:
            at, domain, path = stack.pop()
            demand(at == seen < len(tree), f"the preorder expects tree node {seen}, not {at}")
            node, seen = tree[at], seen + 1
            kind = next((k for k in NODES if type(node) is dict and k in node), "leaf")
            fields(node, NODES[kind])
            if "children" in node:
                a, b = wholes(node["children"], 0, count=2)
                if kind == "set":
                    table, what = 2, wholes([node["set"]], 0, len(self.inside) - 1)
                else:
                    i, j = wholes(node["edge"], 0, self.size - 1, 2)
                    demand(i != j, "an edge joins two different nodes")
                    table, what = 0, [self.problem.key(i, j)]
                stack += [(b, domain, (path, table + 1, what)), (a, domain, (path, table, what))]
                continue
            link, above = path, tuple(set[int]() for _ in range(4))
            while link:
                link, table, what = link
                above[table].update(what)
            given = node[kind]  # None closes a leaf only if its branches contradict each other
            duals = (0, 0 * pi, 0, {}) if given is None else self.duals(given, pi, above)
            pi, goal = pi if given is None else duals[1], duals[0] * below
            usable = lower is not None or duals[0] == 0
            if kind == "leaf":
                bound = self.price(domain, above, duals)[0]
                closed = bound > goal if usable else bound == math.inf
                demand(closed, f"leaf {at} is not closed: it misses the claim", REFUTED)
            else:
                fixed = self.fix(domain, above, duals, goal) if usable else (domain, ())
                stack.append((node["child"], fixed[0], (path, 1, fixed[1])))
        demand(seen == len(tree), f"tree nodes from {seen} on hang on no parent")


# --- 6. the verdict ---
class Verdict(NamedTuple):
    """What has been proved; ``lower`` (None: no route exists) and ``upper`` in quanta."""

    statement: str
    sha256: str
    lower: int | None
    upper: int | None


def check(raw: bytes, holes: list[Any] | None = None, sha256: str | None = None) -> Verdict:
    """Check a certificate's bytes; raises a :class:`Failure` unless it proves its claim.

    ``holes`` (id, x, y in mm) and ``sha256`` say which workpiece and instance it must be about.
    """
    data = load(raw)
    problem, stated = Problem(data["instance"]), data["instance"]["sha256"]
    demand(holes in (None, problem.holes), "it is about another workpiece", REFUTED)
    demand(sha256 in (None, stated), "it is about another instance", REFUTED)
    demand(sha256 or not holes or not problem.matrix.size, "its times are not yours", REFUTED)
    lower, upper, none = fields(data["claim"], "", "lower upper infeasible")
    demand(none is (lower is None or None), "a claim is a lower bound or infeasible: true")
    demand((upper is None) == ("route" not in data), "route and upper come together")
    if upper is not None:
        demand(lower is not None and lower <= upper, "the route contradicts the claim", REFUTED)
        problem.check_route(data["route"], upper)
    Proof(problem, data["sets"], data["cuts"]).check_tree(data["tree"], lower)
    return Verdict(problem.statement(lower, upper), stated, lower, upper)


def main(arguments: Sequence[str]) -> int:
    """``python certificate.py FILE [SHA256]``."""
    try:
        good = len(arguments) in (1, 2) and arguments[0][:1] != "-"
        demand(good, "python certificate.py FILE [SHA256]", USAGE)
        verdict = check(unzip(Path(arguments[0])), None, *arguments[1:])
    except Exception as error:
        said = error if isinstance(error, Failure) else Failure(f"{error!r:.200}", INTERNAL)
        print(f"{said.word}: {said}", file=sys.stderr)
        return said.code
    print(f"verified: {verdict.statement}\nsha256 {verdict.sha256}")
    print(TRUST + ("." if arguments[1:] else YOURS))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
