"""The checker against solvers that are broken on purpose.

Each one "proves" a bound one granule above the true optimum by a mistake that real solvers make;
nothing it writes may pass.  The same prover without the mistake passes on the same instances.
"""

from __future__ import annotations

import numpy as np
import pytest

import tcp.validate.certificate as checker
from tcp.files.certificate import Certificate, Duals, Leaf, to_text
from tests.certificates.samples import random_instance
from tests.certificates.tiny_prover import Prover, brute_force


class LosesLeaves(Prover):
    """Forgets some children of its branches, the bug that the checker once found in an engine."""

    def _grow(self, low, high, branches, depth):
        if depth > 0 and self.rng.integers(3):
            self.tree.append(Leaf(None))
            return len(self.tree) - 1
        return super()._grow(low, high, branches, depth)


class Cheater(Prover):
    """Closes the root by whatever means its subclass finds."""

    def certificate(self, route):
        form = self.instance.form
        low, high = np.zeros(len(self.pairs), dtype=np.int64), np.full(len(self.pairs), self.cap)
        low[[self.at[e] for e in form.forced]] = 1
        high[[self.at[e] for e in form.forbidden]] = 0
        self.cheat()
        x, value, duals = self._solve(low, high, self.rows, 0, ray=False)
        if x is None or value <= self.below:
            pytest.skip("this mistake does not reach the false bound here")
        tree = [Leaf(self.bend(duals))]
        return Certificate.for_instance(
            self.instance, lower=self.lower, route=route, pool=self.pool, tree=tree
        )

    def cheat(self) -> None:
        """Spoil the relaxation."""

    def bend(self, duals: Duals) -> Duals:
        """Spoil the duals."""
        return duals


class WrongCosts(Cheater):
    """Costs off by a little, as floats would be."""

    def cheat(self):
        self.costs = self.costs * 1.5 + 2


class PricesNeighboursOnly(Cheater):
    """Leaves the long pairs out of the relaxation and never prices them."""

    def cheat(self):
        far = self.costs > np.median(self.costs)
        self.costs = np.where(far, self.costs * 10 + 100, self.costs)


class OverlappingTeeth(Cheater):
    """Combs whose teeth share nodes, or lie inside the handle."""

    def cheat(self):
        for _ in range(40 if self.size >= 4 else 0):
            nodes = [int(v) for v in self.rng.permutation(self.size)]
            handle, tooth = tuple(sorted(nodes[:2])), tuple(sorted(nodes[1:3]))
            other = tuple(sorted((nodes[0], nodes[3])))
            self.rows.append(((handle, tooth, other, tooth), 10))


class EvenCombs(Cheater):
    """Combs with two teeth and the right-hand side 3t + 1, which no tour need obey."""

    def cheat(self):
        for _ in range(40 if self.size >= 4 else 0):
            a, b, c, d = (int(v) for v in self.rng.permutation(self.size)[:4])
            teeth = tuple(sorted((a, c))), tuple(sorted((b, d)))
            self.rows.append(((tuple(sorted((a, b))), *teeth), 7))


class StrongerSubtours(Cheater):
    """Uses x(d(S)) >= 4 for sets on which nobody branched."""

    def cheat(self):
        single = [k for k, (sets, _) in enumerate(self.rows) if len(sets) == 1]
        for k in self.rng.permutation(single)[:2]:
            self.rows[k] = (self.rows[k][0], 4)

    def bend(self, duals):
        four = {self.pool.cut(sets) for sets, r in self.rows if r == 4}
        branches = tuple((self.pool.cuts[k][0], y) for k, y in duals.cuts if k in four)
        cuts = tuple((k, y) for k, y in duals.cuts if k not in four)
        return Duals(duals.scale, duals.potentials, cuts, branches)


class Boasts(Cheater):
    """Potentials a tenth too large, cuts counted twice."""

    def cheat(self):
        self.below = -1

    def bend(self, duals):
        cuts = tuple((k, 2 * y) for k, y in duals.cuts)
        more = duals.potentials + abs(duals.potentials) // 10 + 1
        return Duals(duals.scale, more, cuts)


LIARS = [
    LosesLeaves,
    WrongCosts,
    PricesNeighboursOnly,
    OverlappingTeeth,
    EvenCombs,
    StrongerSubtours,
    Boasts,
]


@pytest.mark.parametrize("liar", LIARS, ids=lambda c: c.__name__)
def test_no_lie_passes(liar):
    told = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        instance = random_instance(rng)
        best, route = brute_force(instance)
        if best is None or instance.form.size < 5:
            continue
        lie = best + instance.granularity
        try:
            proof = liar(instance, lie, rng, fixing=False).certificate(None)
        except (pytest.skip.Exception, AssertionError, RecursionError):
            continue  # the mistake was not enough to believe the lie
        told += 1
        with pytest.raises(checker.Failure):
            checker.check(to_text(proof).encode())
        honest = Prover(instance, best, np.random.default_rng(seed)).certificate(route)
        assert checker.check(to_text(honest).encode()).lower == best
        if told == 8:
            break
    assert told >= 3


def test_routes_that_are_none_do_not_pass():
    """A path cut out of a shortest tour, a wrong cost, a hole left out, ends ignored."""
    rng = np.random.default_rng(3)
    told = 0
    for _ in range(20):
        instance = random_instance(rng)
        best, route = brute_force(instance)
        if best is None or len(instance) < 4:
            continue
        told += 1
        honest = Prover(instance, best, rng).certificate(route)
        shorter = Prover(instance, best - 1, rng).certificate(route)
        for wrong in (
            {"upper": honest.upper - 1},
            {"upper": honest.upper + 1},
            {"route": route[:-1]},
            {"route": (*route[:-1], route[0])},
            {"route": tuple(v + 1 for v in route)},
            {"route": None},
            {"upper": None},
        ):
            for proof in (honest, shorter):
                fields = {k: getattr(proof, k) for k in proof.__dataclass_fields__}
                with pytest.raises(checker.Failure):
                    checker.check(to_text(Certificate(**(fields | wrong))).encode())
    assert told > 5
