"""Equal optima from every exact model on the papers' boards, and TSPLIB's published values."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from tcp import Ends, Instance, Model, Status, Travel, solve
from tcp.files import read

DATA = Path(__file__).resolve().parents[2] / "data"
BOTH = (Model.SEQUENTIAL, Model.SIMULTANEOUS)

OPTIMA = {
    ("wp1", Model.SEQUENTIAL): "322.5",
    ("wp1", Model.SIMULTANEOUS): "235.25",
    ("wp2", Model.SEQUENTIAL): "280",
    ("wp2", Model.SIMULTANEOUS): "220.04",  # the paper prints 220 for this very route
    ("fa14", Model.SEQUENTIAL): "280",
}
WP3 = {Model.SEQUENTIAL: "1482.604", Model.SIMULTANEOUS: "1127.248"}


def board(name: str, model: Model) -> Instance:
    return Instance(read(DATA / f"{name}.csv").workpiece, Travel(model))


@pytest.mark.parametrize(("name", "model"), OPTIMA, ids=lambda v: str(v))
def test_every_exact_model_finds_the_same_optimum(prover, name, model):
    solver, options = prover
    result = solve(board(name, model), solver, **options)
    assert result.status is Status.OPTIMAL
    assert result.time == Fraction(OPTIMA[name, model])


@pytest.mark.parametrize("model", BOTH)
@pytest.mark.parametrize(
    ("solver", "options"),
    [
        ("cp-sat", {}),
        ("routing", {"exact": True}),
        ("milp", {}),
        ("milp", {"backend": "cbc"}),
    ],
    ids=lambda v: str(v),
)
def test_wp3(solver, options, model):
    result = solve(board("wp3", model), solver, **options)
    assert result.status is Status.OPTIMAL
    assert result.time == Fraction(WP3[model])


@pytest.mark.parametrize("solver", ["cp-sat", "milp"])
@pytest.mark.parametrize(("name", "published"), [("eil51", 426), ("berlin52", 7542), ("st70", 675)])
def test_published_closed_tours(corpus, solver, name, published):
    reading = read(corpus / "tsplib" / f"{name}.tsp")
    instance = Instance(reading.workpiece, reading.travel, Ends(closed=True))
    result = solve(instance, solver)
    assert result.status is Status.OPTIMAL
    assert result.cost == published
