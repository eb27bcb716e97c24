"""Duals that miss the LP's value by a hair are brought back; large costs are proved."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import tcp.exact.branch_and_cut.relaxation as relaxation
import tcp.validate.certificate as checker
from tcp import Instance, Model, Proof, Status, Stop, Travel, Workpiece
from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.branch_and_cut.proof import Alive, Fixings, rounded, verdict
from tcp.exact.branch_and_cut.refine import refined
from tcp.exact.branch_and_cut.relaxation import Answer, Relaxation
from tcp.exact.branch_and_cut.run import first_pairs, unit_of
from tcp.exact.branch_and_cut.subtours import component_cuts
from tcp.exact.branch_and_cut.support import Support
from tcp.solve import solve


def scattered(n: int, top: int, seed: int) -> Workpiece:
    x, y = np.random.default_rng(seed).integers(0, top, (2, n))
    return Workpiece(f"scattered {n}", tuple(map(str, range(n))), x, y)


def relaxed(instance: Instance) -> tuple[Relaxation, Problem]:
    """An LP with some subtour cuts, solved and priced."""
    problem = Problem.of(instance)
    lp = Relaxation(problem, first_pairs(problem, np.arange(problem.size)), unit_of(problem))
    root, alive = Fixings.root(problem), Alive.everything()
    while lp.solve() is Answer.OPTIMAL:
        cuts = component_cuts(Support.of(problem.size, lp.i, lp.j, lp.x))
        found = verdict(problem, lp.duals(), root, alive)
        keys = problem.keys(found.i, found.j)
        keys = keys[lp.columns_of(keys) < 0]
        if not cuts and not len(keys):
            return lp, problem
        lp.add_cuts(cuts)
        lp.add_pairs(keys)
    raise AssertionError("an LP without branches has a solution")


@pytest.mark.parametrize("top", [10**4, 10**9, 10**13])
@pytest.mark.parametrize("noise", [1e-7, 1e-4])
def test_noisy_duals_are_refined_to_the_exact_value(top, noise):
    lp, problem = relaxed(Instance(scattered(80, top, 1), Travel(Model.SIMULTANEOUS)))
    rng = np.random.default_rng(2)
    good = lp.duals()
    pi = good.pi / good.scale
    pi = pi + noise * problem.peak * rng.standard_normal(len(pi))
    rows = [(cut, rhs, y / good.scale, False) for cut, rhs, y in good.cuts]
    noisy = rounded(problem, pi, rows, 1.0)
    root, alive = Fixings.root(problem), Alive.everything()

    def value(duals):
        return Fraction(verdict(problem, duals, root, alive).scaled, duals.scale)

    assert value(noisy) < value(good)
    again = refined(lp, noisy)
    assert abs(value(again) - value(good)) < Fraction(1, 100)
    assert value(again) <= lp.objective * (1 + 1e-9)
    assert all(y > 0 for _, _, y in again.cuts) and again.scale >= noisy.scale


def test_duals_of_another_lp_are_left_alone():
    lp, _ = relaxed(Instance(scattered(30, 1000, 3)))
    duals = lp.duals()
    lp.place.clear()
    assert not duals.cuts or refined(lp, duals) is duals


@pytest.mark.parametrize(
    ("travel", "top"),
    [
        (Travel(Model.SIMULTANEOUS), 10**9),
        (Travel(Model.EUCLIDEAN, quantum=Fraction(1, 10**5)), 10**3),
        (Travel(vx=Fraction(3), vy=Fraction(7)), 10**9),
    ],
    ids=["chebyshev", "tiny quantum", "speeds"],
)
def test_costs_of_a_billion_quanta_are_proved(travel, top, tmp_path):
    instance = Instance(scattered(40, top, 5), travel)
    result = solve(instance, "branch-and-cut", exact=True, certificate=tmp_path / "p.json.gz")
    assert (result.status, result.proof) == (Status.OPTIMAL, Proof.CERTIFIED)
    assert result.cost > 10**7


def test_explicit_times_of_any_size_are_proved(tmp_path):
    n = 25
    times = np.random.default_rng(7).integers(10**15, 2 * 10**15, (n, n))
    times = np.tril(times, -1) + np.tril(times, -1).T
    piece = replace(scattered(n, 100, 8), matrix=times)
    instance = Instance(piece, Travel(Model.EXPLICIT))
    result = solve(instance, "branch-and-cut", exact=True, certificate=tmp_path / "p.json")
    assert (result.status, result.proof) == (Status.OPTIMAL, Proof.CERTIFIED)


def test_a_simplex_method_of_few_digits_is_made_up_for(monkeypatch, tmp_path):
    """With an LP whose duals are off in the seventh digit, leaves still close; else none would."""
    honest = Relaxation._read

    def blurred(self, objective):
        honest(self, objective)
        rng = np.random.default_rng(len(self._row_dual))
        self._row_dual = self._row_dual * (1 + 1e-7 * rng.standard_normal(len(self._row_dual)))

    monkeypatch.setattr(relaxation.Relaxation, "_read", blurred)
    instance = Instance(scattered(60, 10**9, 9), Travel(Model.SIMULTANEOUS))
    path = tmp_path / "p.cert.json.gz"
    result = solve(
        instance, "branch-and-cut", exact=True, stop=Stop(iterations=60), certificate=path
    )
    assert result.status is Status.OPTIMAL
    assert checker.check(checker.unzip(path), None, instance.sha256).lower == result.cost
