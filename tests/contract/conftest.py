"""What every solver is measured against: an oracle that shares nothing with any of them."""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from tcp import Instance, Status, solve
from tcp.errors import UsageError
from tcp.solve import SOLVERS
from tcp.validate.route import faults

OPTIONS: dict[str, list[dict[str, Any]]] = {
    "routing": [{}, {"exact": True}],
    "htga": [{"np": 10, "gn": 30}],
    "cuckoo": [{"np": 10, "generations": 30}],
    "firefly": [{"agents": 5, "iterations": 30}],
    "milp": [
        {"formulation": "subtour"},
        {"formulation": "mtz"},
        {"formulation": "flow"},
        {"formulation": "subtour", "backend": "cbc"},
        {"formulation": "subtour", "backend": "scip"},
    ],
    "bmga": [{"np": 10, "epoch": 10, "stall": 2}],
    "pso": [{"np": 10, "iterations": 30}],
    "acs": [{"np": 5, "iterations": 20}],
}
"""Options worth a contract of their own; a solver that is not named here runs with its defaults."""


def proves_with(name: str, options: Mapping[str, Any]) -> bool:
    """Whether a solver, run with these options, promises a proof."""
    asked = inspect.signature(import_module(SOLVERS[name].module).run).parameters.get("exact")
    return SOLVERS[name].exact and bool(options.get("exact", asked is None or asked.default))


def variants(exact: bool | None = None) -> list[Any]:
    """Every registered solver with each of its options, as pytest parameters."""
    found = []
    for name in SOLVERS:
        for options in OPTIONS.get(name, [{}]):
            if exact is None or exact == proves_with(name, options):
                label = "-".join([name, *(f"{k}={v}" for k, v in options.items())])
                found.append(pytest.param((name, options), id=label))
    return found


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """``variant`` runs over all solvers, ``prover`` over the exact ones."""
    if "variant" in metafunc.fixturenames:
        metafunc.parametrize("variant", variants())
    if "prover" in metafunc.fixturenames:
        metafunc.parametrize("prover", variants(exact=True))


@cache
def _orders(n: int) -> np.ndarray:
    return np.array(list(itertools.permutations(range(n))), dtype=np.int64)


def _optimum(instance: Instance) -> int | None:
    """Cost of the best route by looking at all of them, None if there is none.

    Ends and rules are read off their definition, not off the tour form: only
    the cost of a single move is shared, and that has tests of its own.
    """
    n, ends, form = len(instance), instance.ends, instance.form
    orders = _orders(n)
    everyone = np.arange(form.real)
    move = form.costs(everyone[:, None], everyone[None, :])
    first, last = orders[:, 0], orders[:, -1]
    total = move[orders[:, :-1], orders[:, 1:]].sum(axis=1)
    total = (
        total + ends.outward * move[n % form.real, first] + ends.back * move[last, n % form.real]
    )
    pairs = np.stack([orders[:, :-1], orders[:, 1:]], axis=2)
    if ends.closed:
        total = total + move[last, first]
        pairs = np.concatenate([pairs, np.stack([last, first], axis=1)[:, None]], axis=1)
    allowed = np.ones(len(orders), dtype=bool)
    if ends.start is not None:
        allowed &= first == ends.start
    if ends.end is not None:
        allowed &= last == ends.end
    for rule, wanted in ((instance.rules.together, True), (form.forbidden, False)):
        for i, j in rule:
            used = ((pairs == (i, j)).all(axis=2) | (pairs == (j, i)).all(axis=2)).any(axis=1)
            allowed &= used == wanted
    return int(total[allowed].min()) if allowed.any() else None


@pytest.fixture(scope="session")
def optimum() -> Callable[[Instance], int | None]:
    """The brute-force oracle, for up to seven holes."""
    return _optimum


@pytest.fixture(scope="session")
def holds() -> Callable[..., None]:
    """Solve, and compare what the solver says with the truth."""

    def check(instance: Instance, variant: tuple[str, dict[str, Any]], truth: int | None) -> None:
        name, options = variant
        if import_module(SOLVERS[name].module).refusal(instance):
            with pytest.raises(UsageError, match=name):
                solve(instance, name, **options)
            return
        result = solve(instance, name, **options)
        proves = proves_with(name, options)
        if truth is None:
            assert result.route is None
            assert result.status in ((Status.INFEASIBLE,) if proves else ALL_BUT_PROVED)
            return
        assert result.status is not Status.INFEASIBLE
        assert result.bound is None or result.bound <= truth
        if proves:
            assert (result.status, result.cost) == (Status.OPTIMAL, truth)
        elif result.route is not None:
            assert faults(instance, result.route) == []
            assert result.cost >= truth

    return check


ALL_BUT_PROVED = (Status.INFEASIBLE, Status.UNKNOWN)
