"""The certificate checker: decides whether a certificate proves what it claims.

It needs the standard library and numpy and nothing of ``tcp`` but :mod:`tcp.validate.restated`
beside it, so that it also runs as ``python tcp/validate/certificate.py FILE [WORKPIECE.csv]``.
``docs/certificate.md`` has the format and the mathematics; each section below checks one part.
Everything is derived again from what the file says about the instance, and only integers decide:
int64 where a bound on all intermediates proves that they fit, Python integers otherwise.

Exit codes: 0 verified, 1 refuted, 2 usage, 3 malformed, 6 unsupported version, 70 internal.
"""

from __future__ import annotations

import contextlib
import csv
import gzip
import itertools
import json
import sys
import zlib
from collections import Counter
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

if __package__:
    from tcp.validate.restated import (
        LIMIT,
        MALFORMED,
        REFUTED,
        UNSUPPORTED,
        Failure,
        Hole,
        Pairs,
        Problem,
        demand,
        fields,
        whole,
        wholes,
    )
else:  # run as a script: the other half lies beside this file
    from restated import *  # type: ignore[import-not-found]  # noqa: F403

VERSION = 1
MAX_BYTES, MAX_LISTS, MAX_NUMBERS = 2**28, 6_000_000, 60_000_000
MOST_PAIRS = 2**24  # a fixing that leaves more pairs than this is not worth listing them
KINDS = {"edge": "children", "set": "children", "fix": "child", "leaf": ""}


class Contradiction(Exception):
    """The branches above a node demand and exclude the same pair: no tour is left below."""


class Verdict(NamedTuple):
    """What has been proved; ``lower`` (None: no route exists) and ``upper`` in quanta."""

    statement: str
    sha256: str
    lower: int | None
    upper: int | None


# --- 1. the file: bounded, whole numbers only, no key twice ---------------------------


def unzip(path: Path) -> bytes:
    """The file's bytes, gzipped or not, never more than one beyond the limit."""
    try:
        with path.open("rb") as stream:
            opener: Any = gzip.open if stream.read(2) == b"\x1f\x8b" else open
        with opener(path, "rb") as stream:
            return bytes(stream.read(MAX_BYTES + 1))
    except (OSError, EOFError, zlib.error) as error:
        raise Failure(f"cannot read {path}: {error}", MALFORMED) from None


def load(raw: bytes) -> dict[str, Any]:
    """The JSON object in ``raw``."""

    def refuse(text: str) -> None:
        demand(False, f"{text[:40]} is not a whole number")

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
        raise Failure(f"no valid JSON: {error!s:.80}", MALFORMED) from None
    ours = type(data) is dict and data.get("format") == "tcp-certificate"
    demand(ours, 'expected a JSON object with "format": "tcp-certificate"')
    version = whole(data.get("version"))
    demand(version == VERSION, f"version {version}; this checker knows {VERSION}", UNSUPPORTED)
    return fields(data, "format version instance claim sets cuts tree", "route")


# --- 2. the route: every hole once, the right ends, the claimed cost ------------------


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


# --- 3. the pool: node sets, subtour cuts and combs -----------------------------------


class Pool:
    """Node sets as runs, and cuts (sets, right-hand side) whose structure is verified."""

    def __init__(self, sets: Any, cuts: Any, size: int):
        demand(type(sets) is list and type(cuts) is list, "sets and cuts are lists")
        self.size, self.sets = size, sets
        for ends in sets:
            wholes(ends, 0, size - 1)
            gaps = [b - a for a, b in itertools.pairwise(ends)]
            ascending = min(gaps[::2], default=0) >= 0 and min(gaps[1::2], default=2) >= 2
            demand(len(ends) % 2 == 0 and ascending, "a set is first, last, first, last, ...")
            nodes = sum(gaps[::2]) + len(ends) // 2
            demand(0 < nodes < size, "a set must hold some nodes but not all", REFUTED)
        self.cuts = [self._structure(wholes(cut, 0, len(sets) - 1)) for cut in cuts]

    def _structure(self, cut: list[int]) -> tuple[list[int], int]:
        """One set S: x(d(S)) >= 2.  Handle and t teeth: the comb inequality, >= 3t + 1."""
        t = len(cut) - 1
        demand(t == 0 or (t >= 3 and t % 2), "a comb needs an odd number of >= 3 teeth", REFUTED)
        if t == 0:
            return cut, 2
        inside = self.members(cut)
        handle, teeth = inside[0], inside[1:]
        demand((teeth.sum(axis=0) <= 1).all(), "two teeth of a comb share a node", REFUTED)
        crosses = (teeth & handle).any(axis=1) & (teeth & ~handle).any(axis=1)
        demand(crosses.all(), "a tooth of a comb does not cross the handle", REFUTED)
        return cut, 3 * t + 1

    def members(self, which: Sequence[int]) -> Any:
        """Boolean matrix (sets, nodes): which nodes each set holds."""
        inside = np.zeros((len(which), self.size), dtype=bool)
        for row, runs in zip(inside, (self.sets[s] for s in which), strict=True):
            for first, last in zip(runs[::2], runs[1::2], strict=True):
                row[first : last + 1] = True
        return inside


# --- 4. dual vectors and the bounds they prove ----------------------------------------


class Branches:
    """What the branches above a node decided, about pairs (by key) and sets (by index)."""

    def __init__(self) -> None:
        self.absent, self.present, self.two, self.four = (Counter[int]() for _ in range(4))


class Duals:
    """Scale, potentials, total weight of each set, and right-hand side of the cuts."""

    def __init__(self, data: Any, before: Any, pool: Pool, above: Branches):
        data = fields(data, "scale pi", "cuts branches")
        self.scale, self.rhs, self.weights = whole(data["scale"], 0), 0, Counter[int]()
        change = wholes(data["pi"])
        demand(len(change) == pool.size, "a dual vector has one potential per node")
        self.pi = before + np.array(change, dtype=np.int64)
        demand(int(abs(self.pi).max()) < LIMIT, "a potential is out of range")
        for k, y in _couples(data.get("cuts", []), len(pool.cuts)):
            demand(y > 0, "a cut has a negative multiplier", REFUTED)
            self._add(*pool.cuts[k], y)
        for s, y in _couples(data.get("branches", []), len(pool.sets)):
            decided = (above.four if y > 0 else above.two)[s]
            demand(decided, "a multiplier needs a set branch that is not above its node", REFUTED)
            self._add([s], 4 if y > 0 else 2, y)

    def _add(self, sets: list[int], rhs: int, y: int) -> None:
        self.rhs += y * rhs
        for s in sets:
            self.weights[s] += y


def _couples(values: Any, count: int) -> Pairs:
    """Index (below ``count``), multiplier (not 0), index, multiplier, ... as pairs."""
    index, y = wholes(values)[::2], wholes(values)[1::2]
    demand(len(index) == len(y) and 0 not in y, "expected index, multiplier (not 0), index, ...")
    return list(zip(wholes(index, 0, count - 1), y, strict=True))


class Domain(NamedTuple):
    """Pairs that tours below a node may use, ascending by key; the others are proved away."""

    keys: Any
    costs: Any
    low: Any


class Proof:
    """One instance, its pool, and the branches above the tree node in hand."""

    def __init__(self, problem: Problem, pool: Pool):
        self.problem, self.pool, self.above = problem, pool, Branches()

    def open_pairs(self, domain: Domain | None, near: Any = None) -> tuple[Any, ...]:
        """Keys, costs, least and most uses of the pairs that are ``near`` or must be used."""
        size, cap, costs_of = self.problem.size, self.problem.cap, self.problem.costs
        must = np.array(sorted(self.above.present), dtype=np.int64)
        if domain is None:  # nothing is fixed yet: all pairs
            must = np.union1d(must, _array(self.problem.forced))
            found = [must]
            for i, j, costs in costs_of.blocks() if near else ():
                p, q = np.nonzero(near(costs, i, j))
                p, q = i[p, 0], j[0, q]
                found.append((p * size + q)[p < q])
            keys = np.unique(np.concatenate(found))
            costs, low = costs_of.between(*np.divmod(keys, size)), np.isin(keys, must) * 1
            high = np.where(np.isin(keys, _array(self.problem.forbidden)), 0, cap)
        else:
            keys, costs, low = domain
            at = np.searchsorted(keys, must)
            if len(must) and (at[-1] == len(keys) or (keys[at] != must).any()):
                raise Contradiction
            low = low.copy()
            low[at] = 1
            chosen = low > 0
            chosen |= near(costs, *np.divmod(keys, size)) if near else False
            keys, costs, low = keys[chosen], costs[chosen], low[chosen]
            high = np.full(len(keys), cap)
        high[np.isin(keys, _array(self.above.absent))] = 0
        if (low > high).any():
            raise Contradiction
        return keys, costs, low, high

    def price(self, domain: Domain | None, duals: Duals, reach: int = -1) -> tuple[Any, ...]:
        """The lower bound; keys, costs, uses, reduced costs rc of all pairs with rc <= ``reach``.

        rc = scale c - P_i - P_j + (terms >= 0), P_i being i's potential plus the positive
        weights of the sets that hold i: pairs beyond reach without the last terms stay unpriced.
        """
        size, scale, costs_of = self.problem.size, duals.scale, self.problem.costs
        sets = [s for s, w in duals.weights.items() if w]
        weights = [duals.weights[s] for s in sets]
        inside = self.pool.members(sets)
        inside ^= inside.sum(axis=1, keepdims=True) * 2 > size  # same boundary, smaller side
        most = int(abs(duals.pi).max()) + sum(map(abs, weights)) + abs(reach)
        small = costs_of.small and scale * (costs_of.peak + 1) + 4 * most < LIMIT
        kind: Any = np.int64 if small else object
        pi, weight = duals.pi.astype(kind), np.array(weights, dtype=kind)
        level = pi + np.maximum(weight, 0) @ inside if sets else pi

        def near(costs: Any, i: Any, j: Any) -> Any:
            return scale * costs.astype(kind, copy=False) - level[i] - level[j] <= reach

        keys, costs, low, high = self.open_pairs(domain, near)
        i, j = np.divmod(keys, size)
        rc = scale * costs.astype(kind) - pi[i] - pi[j]
        height = max(1, 2**22 // (len(keys) + 1))
        for top in range(0, len(sets), height):
            some = slice(top, top + height)
            rc = rc - weight[some] @ (inside[some][:, i] ^ inside[some][:, j])
        degree = 2 if size > 1 else 0  # the tour of a single node has no edges
        bound = degree * _sum(pi) + duals.rhs + _sum(np.where(rc < 0, high * rc, low * rc))
        return bound, keys, costs, low, high, rc

    def fix(self, domain: Domain | None, duals: Duals, goal: int) -> Domain | None:
        """The domain without the pairs that no tour with scale * cost <= ``goal`` uses."""
        slack, reach = goal - 2 * _sum(duals.pi) - duals.rhs, -2
        while max(slack, -1) > reach:  # the first slack is a guess
            reach = max(slack, -1) + max(slack, 0) // 8 + duals.scale
            bound, keys, costs, low, high, rc = self.price(domain, duals, reach)
            slack = goal - bound
        keep = (high > 0) & ((low > 0) | (rc < 0) | (rc <= slack))
        low = np.where((rc <= 0) & (-rc > slack), 1, low)
        return domain if keep.sum() > MOST_PAIRS else Domain(keys[keep], costs[keep], low[keep])


def _array(keys: Any) -> Any:
    return np.fromiter(keys, np.int64, len(keys))


def _sum(values: Any) -> int:
    """Exact sum; int64 in two halves that cannot overflow."""
    if values.dtype == object:
        return sum(map(int, values))
    return (int((values >> 31).sum()) << 31) + int((values & (2**31 - 1)).sum())


# --- 5. the tree: its branches cover every tour, and every leaf is closed -------------


def check_tree(problem: Problem, pool: Pool, tree: Any, lower: int | None) -> None:
    """Section ``tree``: nodes in preorder, walked without recursion."""
    demand(type(tree) is list and all(type(node) is dict for node in tree), "the tree is a list")
    g = problem.costs.divisor()
    below = None if lower is None else -(-lower // g) * g - g  # the next cost under the claim
    proof, pi, seen = Proof(problem, pool), np.zeros(problem.size, dtype=np.int64), 0
    stack: list[tuple[int, Domain | None, Any]] = [(0, None, None)]
    while stack:
        at, domain, step = stack.pop()
        if step is not None:  # enter a branch, or (at -1) leave it
            table, entry = step
            table[entry] += 1 if at >= 0 else -1
            if not table[entry]:
                del table[entry]
            if at < 0:
                continue
            stack.append((-1, None, step))
        demand(at == seen < len(tree), f"the preorder expects tree node {seen}, not {at}")
        node, seen = tree[at], seen + 1
        kind = next((k for k in KINDS if k in node), "leaf")
        fields(node, f"{kind} {KINDS[kind]}")
        if kind in ("edge", "set"):
            steps, ends = _branch(proof, kind, node[kind]), wholes(node["children"], 0)
            demand(len(ends) == 2, "a branch has two children")
            stack += [(ends[1], domain, steps[1]), (ends[0], domain, steps[0])]
            continue
        duals = None
        if kind == "fix" or node[kind] is not None:
            duals = Duals(node[kind], pi, pool, proof.above)
            pi = duals.pi
        with contextlib.suppress(Contradiction):  # else no tour is left below this node
            domain = _closed(proof, at, kind, domain, duals, below)
        if kind == "fix":
            stack.append((whole(node["child"], 0), domain, None))
    demand(seen == len(tree), f"tree nodes from {seen} on hang on no parent")


def _closed(
    proof: Proof, at: int, kind: str, domain: Domain | None, duals: Duals | None, below: int | None
) -> Domain | None:
    """Close a leaf, or narrow the domain by a fixing: tours may cost ``below`` (None: any cost)."""
    useless = duals is None or (below is None and duals.scale > 0)
    if duals is not None and not useless:
        goal = duals.scale * (below or 0)
        if kind == "fix":
            return proof.fix(domain, duals, goal)
        useless = proof.price(domain, duals)[0] <= goal
    elif kind == "leaf":
        proof.open_pairs(domain)  # to see whether the branches contradict each other
    demand(not useless or kind == "fix", f"leaf {at} is not closed: it misses the claim", REFUTED)
    return domain


def _branch(proof: Proof, kind: str, what: Any) -> Any:
    """The two decisions of a branch: the table that each goes to, and its entry there."""
    if kind == "set":
        s = whole(what, 0, len(proof.pool.sets) - 1)
        return (proof.above.two, s), (proof.above.four, s)
    good = len(wholes(what, 0, proof.problem.size - 1)) == 2 and what[0] != what[1]
    demand(good, "an edge joins two different nodes")
    key = proof.problem.key(*what)
    return (proof.above.absent, key), (proof.above.present, key)


# --- 6. the statement -----------------------------------------------------------------


def check(raw: bytes, holes: Sequence[Hole] | None = None, sha256: str | None = None) -> Verdict:
    """Check a certificate's bytes; raises a :class:`Failure` unless it proves its claim.

    ``holes`` (id, x, y in mm) and ``sha256`` say which workpiece and instance it must be about.
    """
    data = load(raw)
    problem, claim = Problem(data["instance"]), fields(data["claim"], "", "lower upper infeasible")
    known, stated = holes is None or tuple(holes) == problem.holes(), problem.data["sha256"]
    demand(known, "it is about another workpiece than the one given", REFUTED)
    known = sha256 in (None, stated)
    demand(known, "it is about another instance: other holes, travel, ends or rules", REFUTED)
    lower, upper = (whole(claim[k]) if k in claim else None for k in ("lower", "upper"))
    none = claim.get("infeasible")
    good = none is True if lower is None else none is None
    demand(good, "a claim is either a lower bound or infeasible: true")
    demand((upper is None) == ("route" not in data), "route and upper come together")
    if upper is not None:
        good = lower is not None and lower <= upper
        demand(good, "the route given contradicts the claimed lower bound", REFUTED)
        check_route(problem, data["route"], upper)
    pool = Pool(data["sets"], data["cuts"], problem.size)
    check_tree(problem, pool, data["tree"], lower)
    return Verdict(statement(problem, lower, upper), stated, lower, upper)


def statement(problem: Problem, lower: int | None, upper: int | None) -> str:
    """What has been proved, in one sentence."""
    data, quantum = problem.data, problem.quantum
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


def read_csv(path: Path) -> list[Hole]:
    """Holes of a plain CSV file: id,x,y or x,y in mm, with or without a header line."""
    try:
        lines = [t for t in path.read_text("utf-8-sig").splitlines() if t.strip()]
        rows = list(csv.reader(t for t in lines if t.lstrip()[0] != "#"))
        names = [cell.strip().lower().removesuffix("_mm") for cell in rows[0]]
        header = "x" in names and "y" in names
        names = names if header else ["id", "x", "y"][-len(names) :]
        x, y, named = names.index("x"), names.index("y"), names[0] not in "xy"
        return [
            (
                row[0].strip() if named else str(k),
                Fraction(Decimal(row[x])),
                Fraction(Decimal(row[y])),
            )
            for k, row in enumerate(rows[header:], 1)
        ]
    except (OSError, ValueError, IndexError, ArithmeticError, csv.Error) as error:
        what = f"{type(error).__name__}: {error!s:.80}"
        raise Failure(f"cannot read {path} as id,x,y in mm ({what})", MALFORMED) from None


def main(arguments: Sequence[str]) -> int:
    """``python certificate.py FILE [WORKPIECE.csv]``."""
    if len(arguments) not in (1, 2) or arguments[0].startswith("-"):
        print("usage: python certificate.py FILE [WORKPIECE.csv]", file=sys.stderr)
        return 2
    try:
        holes = read_csv(Path(arguments[1])) if len(arguments) == 2 else None
        verdict = check(unzip(Path(arguments[0])), holes)
    except Failure as failure:
        print(f"{failure.word}: {failure}", file=sys.stderr)
        return failure.code
    except Exception as error:
        print(f"internal error: {type(error).__name__}: {error}", file=sys.stderr)
        return 70
    print(f"verified: {verdict.statement}\nsha256 {verdict.sha256}\n{trust(bool(holes))}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
