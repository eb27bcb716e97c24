"""WP3, the 49-hole workpiece of the literature: engine, certificate, checker and mutations."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

import tcp.validate.certificate as checker
from tcp import Instance, Model, Proof, Status, Travel
from tcp.files import read
from tcp.solve import solve
from tests.certificates.mutation_run import Tally, lies, run

WP3 = Path(__file__).parents[2] / "data" / "wp3.csv"


@pytest.fixture(scope="module", params=[Model.SEQUENTIAL, Model.SIMULTANEOUS], ids=str)
def proved(request, tmp_path_factory):
    """An instance, its optimum and its certificate's path."""
    path = tmp_path_factory.mktemp("wp3") / "wp3.cert.json.gz"
    instance = Instance(read(WP3).workpiece, Travel(request.param))
    result = solve(instance, "branch-and-cut", exact=True, certificate=path)
    assert (result.status, result.proof) == (Status.OPTIMAL, Proof.CERTIFIED)
    return instance, result.cost, path


def test_the_certificate_is_small_and_about_the_file(proved):
    instance, cost, path = proved
    raw = checker.unzip(path)
    assert path.stat().st_size < 20_000 and len(raw) < 20_000
    piece = read(WP3).workpiece
    holes = [(h.id, h.x, h.y) for h in map(piece.hole, range(len(piece)))]
    verdict = checker.check(raw, holes, instance.sha256)
    assert verdict.lower == verdict.upper == cost


def test_mutations_are_refused_or_still_true(proved):
    _, cost, path = proved
    text = gzip.decompress(path.read_bytes()).decode()
    (lie,) = lies([text, text])[1:]
    tally = Tally()
    tally.add("lie", lie, cost)
    assert tally.refused["lie"] == 1
    tally = run(600, seed=3, texts=[text, lie], truth=cost)
    assert not tally.false, tally.false[0][:300]
    assert sum(tally.refused.values()) > 300
