"""A tiny branch-and-bound that proves instances of up to about nine nodes.

It shares no code with the proof engine or the checker: a linear program over *all* subtour
constraints and some random combs, solved by scipy, its duals rounded to integers.  Tests use it to
make certificates of every shape: edge and set branches, fixings, Farkas rays, combs.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linprog

from tcp.files.certificate import (
    Certificate,
    Duals,
    EdgeBranch,
    Fix,
    Leaf,
    Node,
    Pool,
    SetBranch,
)
from tcp.instance import Instance


def brute_force(instance: Instance) -> tuple[int | None, tuple[int, ...] | None]:
    """Optimum and best route by trying every order."""
    from tcp.validate.route import faults

    best: tuple[int, tuple[int, ...]] | None = None
    for order in itertools.permutations(range(len(instance))):
        if best is not None and instance.cost(order) >= best[0]:
            continue
        if not faults(instance, order):
            best = (instance.cost(order), order)
    return best or (None, None)


@dataclass
class Prover:
    """One proof: ``lower`` None proves infeasibility."""

    instance: Instance
    lower: int | None
    rng: np.random.Generator
    combs: int = 30
    fixing: bool = True
    keep: float = 1.0  # share of the cuts known from the start: fewer, more branching
    pool: Pool = field(default_factory=Pool)
    tree: list[Node | None] = field(default_factory=list)

    def __post_init__(self) -> None:
        form = self.instance.form
        self.size = form.size
        self.pairs = list(itertools.combinations(range(self.size), 2))
        self.at = {pair: k for k, pair in enumerate(self.pairs)}
        self.costs = np.array([form.cost(i, j) for i, j in self.pairs], dtype=np.int64)
        self.cap = 2 if self.size == 2 else 1
        self.rows: list[tuple[tuple[tuple[int, ...], ...], int]] = []
        for k in range(2, self.size // 2 + 1):
            self.rows += [((s,), 2) for s in itertools.combinations(range(self.size), k)]
        self.rows += [(comb, 10) for comb in self._combs()]
        chosen = self.rng.random(len(self.rows)) < self.keep
        self.reserve = [row for row, keep in zip(self.rows, chosen, strict=True) if not keep]
        self.rows = [row for row, keep in zip(self.rows, chosen, strict=True) if keep]
        g = self.instance.granularity
        self.below = None if self.lower is None else -(-self.lower // g) * g - g

    def _combs(self) -> list[tuple[tuple[int, ...], ...]]:
        found = []
        for _ in range(self.combs if self.size >= 6 else 0):
            order = [int(v) for v in self.rng.permutation(self.size)]
            handle, outside = order[:3], order[3:6]
            extra = order[6:]
            teeth = [[a, b] for a, b in zip(handle, outside, strict=True)]
            if extra and self.rng.integers(2):
                teeth[0].append(extra[0])
            if len(extra) > 1 and self.rng.integers(2):
                handle.append(extra[1])
            found.append((tuple(sorted(handle)), *(tuple(sorted(t)) for t in teeth)))
        return found

    def crossings(self, sets: tuple[tuple[int, ...], ...]) -> np.ndarray:
        """Coefficient of every pair in the sum of the sets' boundaries."""
        rows = [[(i in s) != (j in s) for i, j in self.pairs] for s in sets]
        return np.array(rows, dtype=float).reshape(len(sets), len(self.pairs)).sum(axis=0)

    def certificate(self, route: tuple[int, ...] | None) -> Certificate:
        """Prove, and write the proof down."""
        form = self.instance.form
        low = np.zeros(len(self.pairs), dtype=np.int64)
        high = np.full(len(self.pairs), self.cap)
        low[[self.at[e] for e in form.forced]] = 1
        high[[self.at[e] for e in form.forbidden]] = 0
        if self.size == 1:
            self.tree.append(Leaf(Duals(1, np.zeros(1, dtype=np.int64))))
        else:
            self._grow(low, high, [], 0)
        return Certificate.for_instance(
            self.instance, lower=self.lower, route=route, pool=self.pool, tree=self.tree
        )

    def _grow(self, low, high, branches, depth) -> int:
        """Prove one node; its index in the tree."""
        at = len(self.tree)
        self.tree.append(None)
        if (low > high).any():
            self.tree[at] = Leaf(None)
            return at
        while True:
            rows = self.rows + [((s,), r) for s, r in branches]
            x, value, duals = self._solve(low, high, rows, len(branches), ray=False)
            missed = None if x is None else self._missed(x)
            if missed is None or (depth < 4 and self.rng.random() > self.keep):
                break
            self.rows.append(missed)
        if x is None:
            _, value, duals = self._solve(low, high, rows, len(branches), ray=True)
            self.tree[at] = Leaf(duals)
            return at
        if (
            self.below is not None
            and value > self.below + 1e-6
            and not (depth == 0 and self.fixing)
        ):
            self.tree[at] = Leaf(duals)
            return at
        if depth == 0 and self.fixing:
            self.fixing = False
            child = self._grow(low, high, branches, 0)
            self.tree[at] = Fix(duals, child)
            return at
        self.tree[at] = self._branch(x, low, high, branches, depth)
        return at

    def _missed(self, x) -> tuple[tuple[tuple[int, ...], ...], int] | None:
        """A cut in reserve that an integral solution violates."""
        if abs(x - np.rint(x)).max(initial=0) > 1e-6:
            return None
        for row in self.reserve:
            if self.crossings(row[0]) @ x < row[1] - 1e-6:
                return row
        return None

    def _branch(self, x, low, high, branches, depth) -> Node:
        inner = [sets[0] for sets, _ in self.rows + self.reserve if len(sets) == 1]
        inner = [
            s
            for s in inner
            if 2.1 < self.crossings((s,)) @ x < 3.9 or (depth < 3 and self.rng.random() < 0.02)
        ]
        if inner and self.rng.integers(3):
            s = inner[int(self.rng.integers(len(inner)))]
            two = self._grow(low, high, [*branches, (s, -2)], depth + 1)
            four = self._grow(low, high, [*branches, (s, 4)], depth + 1)
            return SetBranch(self.pool.set(s), two, four)
        free = np.flatnonzero(low < high)
        assert len(free), "an integral solution that is no tour"
        fractional = abs(x[free] - 0.5)
        best = np.flatnonzero(fractional <= fractional.min() + 1e-6)
        k = int(free[self.rng.choice(best)])
        absent, present = high.copy(), low.copy()
        absent[k], present[k] = 0, 1
        left = self._grow(low, absent, branches, depth + 1)
        return EdgeBranch(*self.pairs[k], left, self._grow(present, high, branches, depth + 1))

    def _solve(self, low, high, rows, extra, *, ray):
        """Primal solution, value and integer duals of the relaxation, or of its phase 1."""
        m, count = len(self.pairs), len(rows)
        equal = np.array([[float(v in p) for p in self.pairs] for v in range(self.size)])
        signs = np.array([1.0 if r > 0 else -1.0 for _, r in rows])
        above = np.array([self.crossings(s) for s, _ in rows]).reshape(count, m) * signs[:, None]
        right = np.array([float(r) for _, r in rows])
        costs, bounds = self.costs.astype(float), list(zip(low, high, strict=True))
        if ray:  # elastic: minimise violations, costs 0
            equal = np.hstack(
                [equal, np.eye(self.size), -np.eye(self.size), np.zeros((self.size, count))]
            )
            above = np.hstack([above, np.zeros((count, 2 * self.size)), np.eye(count)])
            costs = np.concatenate([np.zeros(m), np.ones(2 * self.size + count)])
            bounds += [(0, None)] * (2 * self.size + count)
        answer = linprog(
            costs,
            A_ub=-above if count else None,
            b_ub=-right if count else None,
            A_eq=equal,
            b_eq=np.full(self.size, 2.0),
            bounds=bounds,
        )
        if answer.status == 2:
            return None, None, None
        assert answer.status == 0, answer.message
        weight = 1000
        y = np.rint(-answer.ineqlin.marginals * weight).astype(int) if count else np.zeros(0, int)
        y = np.maximum(y, 0)
        inner = count - extra
        pool = self.pool
        duals = Duals(
            scale=0 if ray else weight,
            potentials=np.rint(answer.eqlin.marginals * weight).astype(np.int64),
            cuts=tuple((pool.cut(rows[k][0]), int(y[k])) for k in range(inner) if y[k]),
            branches=tuple(
                (pool.set(rows[k][0][0]), int(y[k] * signs[k])) for k in range(inner, count) if y[k]
            ),
        )
        return answer.x[:m], answer.fun, duals


def prove(instance: Instance, lower: int | None = 0, seed: int = 0, **options) -> Certificate:
    """A certificate of the optimum (or of infeasibility), or of ``lower`` if it is not 0."""
    best, route = brute_force(instance)
    lower = best if lower == 0 else lower
    return Prover(instance, lower, np.random.default_rng(seed), **options).certificate(route)
