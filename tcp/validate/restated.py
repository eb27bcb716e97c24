"""An instance, restated from a certificate's text alone: first half of the certificate checker.

Shares no code with the rest of ``tcp`` and needs only numpy: the formulas of the travel models,
the ends and the rules are written down here a second time, from their definitions.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np

REFUTED, MALFORMED, UNSUPPORTED = 1, 3, 6
LIMIT = 2**61  # every number of a certificate, and every int64 intermediate, stays below
BLOCK = 2**18  # pairs priced at a time

Hole = tuple[str, Fraction, Fraction]
Pairs = list[tuple[int, int]]
Move = Callable[[Any, Any], Any]


class Failure(Exception):
    """The certificate is not accepted; ``code`` (the exit code) says in which way."""

    def __init__(self, message: str, code: int):
        super().__init__(message)
        self.code = code
        self.word = {REFUTED: "refuted", MALFORMED: "malformed"}.get(code, "unsupported")


# --- plain data, strictly -------------------------------------------------------------


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


def whole(value: Any, low: int = 1 - LIMIT, high: int = LIMIT - 1) -> int:
    """A whole number in ``low .. high``."""
    demand(type(value) is int and low <= value <= high, f"expected a whole number {low} .. {high}")
    return int(value)


def wholes(values: Any, low: int = 1 - LIMIT, high: int = LIMIT - 1) -> list[int]:
    """A list of whole numbers in ``low .. high``."""
    good = type(values) is list and set(map(type, values)) <= {int}
    good = good and (not values or low <= min(values) <= max(values) <= high)
    demand(good, f"expected a list of whole numbers {low} .. {high}")
    return list(values)


def fraction(text: Any, *, positive: bool = True) -> Fraction:
    """A fraction in lowest terms, as text."""
    try:
        value = Fraction(text if type(text) is str and len(text) < 400 else "none")
    except (ValueError, ZeroDivisionError):
        raise Failure(f"{str(text)[:60]!a} is not a fraction as text", MALFORMED) from None
    good = str(value) == text and (value > 0 or not positive)
    demand(good, f"the fraction {text[:60]!a} must be in lowest terms and in range")
    return value


# --- holes, ends, rules, and the hash of it all ---------------------------------------


class Problem:
    """The instance as a closed tour over ``size`` nodes: holes, home, virtual node.

    ``forced`` and ``forbidden`` hold the keys of pairs that every tour must and must not use;
    ``cap`` is how often a tour can use a pair (of only two nodes: there and back).
    """

    def __init__(self, data: Any):
        known = "name step ids x y travel quantum ends rules sha256"
        self.data = data = fields(data, known, "matrix")
        ids, step = data["ids"], fraction(data["step"])
        demand(type(ids) is list and set(map(type, ids)) == {str}, "the hole ids must be texts")
        x, y = (wholes(data[axis], -(2**52), 2**52) for axis in "xy")
        self.n, self.index = len(ids), {name: i for i, name in enumerate(ids)}
        good = len(self.index) == len(x) == len(y) == self.n and type(data["name"]) is str
        demand(good, "ids must be unique, and x and y have one number per hole")
        self.quantum, matrix = fraction(data["quantum"]), self._matrix()
        together, forbidden = self._rules(x, y, step)
        self.start, self.end, home, self.out, back, closed = self._ends()
        self.home = self.n if home else -1
        if home:
            at = [v / step for v in home]
            finer = math.lcm(*(v.denominator for v in at))
            x, y = ([v * finer for v in axis] for axis in (x, y))
            x, y, step = [*x, int(at[0] * finer)], [*y, int(at[1] * finer)], step / finer
        self.virtual = -1 if closed or (self.out and back) else len(x)
        self.size = len(x) + (self.virtual >= 0)
        self.cap = 2 if self.size == 2 else 1
        first, last = (self.home if leg else self.virtual for leg in (self.out, back))
        edges = [(self.home, self.virtual), (self.start, first), (self.end, last), *together]
        self.forced = {self.key(i, j) for i, j in edges if min(i, j) >= 0}
        self.forbidden = {self.key(i, j) for i, j in forbidden}
        self.costs = Costs(x, y, matrix, self.virtual, step, self.quantum, data["travel"])
        exact = self.costs.exact or (data["travel"]["model"] == "explicit" and self.quantum == 1)
        demand("rounding" in data["travel"] or exact, "exact travel times have another quantum")
        demand(data["sha256"] == self._hash(matrix), "the instance has another hash", REFUTED)

    def key(self, i: int, j: int) -> int:
        """One number for a pair of nodes."""
        return min(i, j) * self.size + max(i, j)

    def holes(self) -> tuple[Hole, ...]:
        """Id and position in mm of every hole."""
        step, at = Fraction(self.data["step"]), zip(self.data["x"], self.data["y"], strict=True)
        return tuple((h, x * step, y * step) for h, (x, y) in zip(self.index, at, strict=True))

    def _matrix(self) -> Any:
        if "matrix" not in self.data:
            return None
        rows, matrix = self.data["matrix"], np.zeros((self.n, self.n), dtype=np.int64)
        demand(type(rows) is list and len(rows) == self.n, "the matrix has one row per hole")
        for i, row in enumerate(rows):
            demand(len(wholes(row, 0)) == i + 1, "row i of the matrix has i + 1 entries")
            matrix[i, : i + 1] = matrix[: i + 1, i] = row
        return matrix

    def _hash(self, matrix: Any) -> str:
        data = self.data
        lines = [f"tcp-workpiece-1\nstep {data['step']}\n"]
        for name, x, y in zip(data["ids"], data["x"], data["y"], strict=True):
            lines.append(f"{len(name)}:{name} {x} {y}\n")
        piece = hashlib.sha256("".join(lines).encode(errors="surrogatepass"))
        piece.update(b"" if matrix is None else b"matrix\n" + matrix.astype("<i8").tobytes())
        what = {key: data[key] for key in ("travel", "quantum", "ends", "rules")}
        what["workpiece"] = piece.hexdigest()
        text = json.dumps(what, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    def _hole(self, name: Any) -> int:
        demand(type(name) is str and name in self.index, f"there is no hole {str(name)[:60]!a}")
        return self.index[name]

    def _ends(self) -> tuple[int, int, list[Fraction], bool, bool, bool]:
        ends = fields(self.data["ends"], "", "start end home outward return closed")
        start, end = (self._hole(ends[k]) if k in ends else -1 for k in ("start", "end"))
        out, back, closed = (ends.get(key, False) for key in ("outward", "return", "closed"))
        demand({type(out), type(back), type(closed)} == {bool}, "legs are true or false")
        place = ends.get("home", [])
        demand(type(place) is list and len(place) in (0, 2), "a home position is [x, y]")
        home = [fraction(v, positive=False) for v in place]
        demand(bool(home) == (out or back), "a home needs a leg that counts, and a leg a home")
        demand(not closed or (not home and end < 0), "a closed route has no end and no home")
        demand(start != end or start < 0 or self.n == 1, "start and end are the same hole")
        return start, end, home, out, back, closed

    def _rules(self, x: list[int], y: list[int], step: Fraction) -> tuple[Pairs, Pairs]:
        rules = fields(self.data["rules"], "", "forbidden together min_jump")
        found: dict[str, Pairs] = {}
        for rule in ("together", "forbidden"):
            pairs = rules.get(rule, [])
            good = type(pairs) is list and all(type(p) is list and len(p) == 2 for p in pairs)
            demand(good, f"{rule} is a list of pairs of holes")
            found[rule] = [(self._hole(p), self._hole(q)) for p, q in pairs]
            demand(all(i != j for i, j in found[rule]), f"{rule} pairs a hole with itself")
        near = fraction(rules.get("min_jump", "0"), positive=False) / step
        order = sorted(range(self.n), key=x.__getitem__) if near > 0 else []
        for at, i in enumerate(order):
            for j in order[at + 1 :]:
                if x[j] - x[i] >= near:
                    break
                if (x[j] - x[i]) ** 2 + (y[j] - y[i]) ** 2 < near * near:
                    found["forbidden"].append((i, j))
        return found["together"], found["forbidden"]


# --- costs: exact integers from the definition of the travel model --------------------


class Costs:
    """Integer cost of every pair of nodes, at most ``peak``; where ``small``, int64 suffices.

    ``exact`` tells whether sequential or simultaneous travel has just the quantum in which all
    its costs are whole.
    """

    def __init__(
        self,
        x: Any,
        y: Any,
        matrix: Any,
        virtual: int,
        step: Fraction,
        quantum: Fraction,
        travel: Any,
    ):
        self.virtual, self.size, self.exact = virtual, len(x) + (virtual >= 0), False
        self.step, self.quantum = step, quantum
        self.reach = (max(x) - min(x), max(y) - min(y))
        self.fits = max(map(abs, x + y))  # bounds every intermediate; grows with the formula
        self.move = self._formula(travel)
        self.matrix = matrix if travel["model"] == "explicit" else None
        demand(travel["model"] != "explicit" or matrix is not None, "there is no travel matrix")
        self.small = self.fits < LIMIT
        # the virtual node borrows the first hole's place; `between` sets its costs to 0
        kind = np.int64 if self.small else object
        self.x, self.y = (np.array(v + v[: virtual >= 0], dtype=kind) for v in (x, y))
        farthest = self.move(*(np.array([v], dtype=object) for v in self.reach))
        self.peak = int((farthest if self.matrix is None else self.matrix).max())

    def between(self, i: Any, j: Any) -> Any:
        """Costs of the pairs ``i[k]``–``j[k]``; broadcasts."""
        if self.matrix is None:
            costs = self.move(abs(self.x[i] - self.x[j]), abs(self.y[i] - self.y[j]))
        else:
            last = len(self.matrix) - 1
            costs = self.matrix[np.minimum(i, last), np.minimum(j, last)]
        return np.where((i == self.virtual) | (j == self.virtual), 0, costs)

    def blocks(self) -> Iterator[tuple[Any, Any, Any]]:
        """All pairs i <= j (and some i > j): a column of nodes i, a row of nodes j, costs."""
        first = 0
        while first < self.size:
            last = min(self.size, first + max(1, BLOCK // (self.size - first)))
            i, j = np.arange(first, last)[:, None], np.arange(first, self.size)[None, :]
            yield i, j, self.between(i, j)
            first = last

    def divisor(self) -> int:
        """Greatest common divisor of all costs, 1 if they are all 0."""
        g = 0
        for _, _, costs in self.blocks():
            rest = costs % g if g else costs
            g = math.gcd(g, int(np.gcd.reduce(rest, axis=None))) if rest.any() else g
            if g == 1:
                break
        return max(g, 1)

    def _formula(self, travel: Any) -> Move:
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
            return np.maximum  # of two distances of 0: not used
        v = [fraction(travel[k]) for k in ("vx", "vy")]
        if model == "trapezoidal":
            demand(travel["axes"] in list(joins), "the axes are sequential or simultaneous")
            axes = zip(v, ("ax", "ay"), self.reach, strict=True)
            tx, ty = (self._ramp(w, fraction(travel[k]), up, far) for w, k, far in axes)
            join = joins[travel["axes"]]
            return lambda dx, dy: join(tx(dx), ty(dy))
        power = 2 if model == "euclidean" else 1
        a, b, m = _common(*((self.step / self.quantum / w) ** power for w in v))
        far = a * self.reach[0] ** power + b * self.reach[1] ** power
        self.fits += 4 * far + a + b + 2 * m
        if model == "euclidean":
            return lambda dx, dy: _root(a * dx * dx + b * dy * dy, m, up)
        self.exact = m == 1 and math.gcd(a, b) == 1
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
    if up:
        least = -(-value // m)
        return np.where(least > 0, _isqrt(np.maximum(least - 1, 0)) + 1, 0)
    return (_isqrt(4 * value if m == 1 else 4 * value // m) + 1) // 2


def _isqrt(n: Any) -> Any:
    """Floor of the square root; the float is a guess that is off by one at most."""
    if n.dtype == object:
        return np.frompyfunc(math.isqrt, 1, 1)(n)
    k = np.sqrt(n).astype(np.int64)
    k -= k * k > n
    return k + ((k + 1) * (k + 1) <= n)
