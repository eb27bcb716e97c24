"""The checker accepts true proofs of every shape, and restates instances exactly as they are."""

from __future__ import annotations

import ast
import dataclasses
import itertools
import math
import shutil
import subprocess
import sys
import tracemalloc
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import tcp.validate.certificate as checker
from tcp import Ends, Instance, Model, Travel, Workpiece
from tcp.files.certificate import (
    Certificate,
    Duals,
    Leaf,
    Pool,
    _runs,
    instance_data,
    to_text,
    write,
)
from tcp.validate.certificate import Failure, Problem, Proof
from tests.certificates.samples import random_instance
from tests.certificates.tiny_prover import brute_force, prove


def checked(proof: Certificate, **given) -> checker.Verdict:
    return checker.check(to_text(proof).encode(), **given)


@pytest.mark.parametrize("seed", range(40))
def test_true_proofs_are_verified(seed):
    rng = np.random.default_rng(seed)
    instance = random_instance(rng)
    keep = rng.choice([0.0, 0.1, 0.5, 1.0])
    proof = prove(instance, seed=seed, fixing=bool(rng.integers(2)), keep=keep)
    verdict = checked(proof)
    best, _ = brute_force(instance)
    assert (verdict.lower, verdict.upper, verdict.sha256) == (best, best, instance.sha256)


@pytest.mark.parametrize("seed", range(100))
def test_instances_are_restated_as_they_are(seed):
    """Costs, forced and forbidden edges, granularity and hash against the package's own."""
    instance = random_instance(np.random.default_rng(seed), most=12)
    form, problem = instance.form, Problem(instance_data(instance))
    nodes = np.arange(form.size)
    restated = problem.between(nodes[:, None], nodes[None, :])
    assert (problem.size, problem.home, problem.virtual) == (form.size, form.home, form.virtual)
    np.testing.assert_array_equal(restated, form.full_matrix())
    assert problem.forced == {problem.key(i, j) for i, j in form.forced}
    assert problem.forbidden == {problem.key(i, j) for i, j in form.forbidden}
    assert problem.peak >= form.full_matrix().max()
    real = form.full_matrix()[: form.real, : form.real]
    assert problem.divisor == max(1, math.gcd(*real.ravel().tolist()))
    assert problem.divisor % instance.granularity == 0


@pytest.mark.parametrize("factor", [1, 2**20, 2**44])
@pytest.mark.parametrize("seed", range(20))
def test_bounds_are_what_the_definition_says(seed, factor):
    """Random duals over random sets, priced by the checker and term by term in Python integers."""
    rng = np.random.default_rng(seed)
    instance = random_instance(rng, most=9)
    problem, form = Problem(instance_data(instance)), instance.form
    size, pool = form.size, Pool()
    for _ in range(8 if size > 2 else 0):
        pool.set(rng.permutation(size)[: rng.integers(1, size)])
    count = len(pool.sets)
    weights = {s: int(rng.integers(-40, 60)) * factor for s in range(count)}
    above = (set(), set(), set(range(count)), set(range(count)))
    pi = [int(v) * factor for v in rng.integers(-300, 500, size)]
    scale = int(rng.integers(0, 9)) * factor * (seed % 3 > 0)
    data = {"scale": scale, "pi": pi}
    data["branches"] = [v for s, y in weights.items() if y for v in (s, y)]
    sets = [_runs(nodes) for nodes in pool.sets]
    bound = (2 if size > 1 else 0) * sum(pi)
    bound += sum(y * (4 if y > 0 else 2) for y in weights.values())
    reduced = {}
    for i, j in itertools.combinations(range(size), 2):
        rc = scale * form.cost(i, j) - pi[i] - pi[j]
        rc -= sum(y for s, y in weights.items() if (i in pool.sets[s]) != (j in pool.sets[s]))
        low, high = int((i, j) in form.forced), 0 if (i, j) in form.forbidden else problem.cap
        bound += min(rc * low, rc * high)
        reduced[problem.key(i, j)] = rc
    proof = checker.Proof(problem, sets, [])
    duals = proof.duals(data, 0, above)
    above = (problem.forbidden, problem.forced, *above[2:])
    found, blocks = proof.price(None, above, duals, reach := 50 * factor)
    assert found == bound
    priced = {int(k): int(rc) for keys, *_, rcs in blocks for k, rc in zip(keys, rcs, strict=True)}
    assert {k: rc for k, rc in reduced.items() if rc <= reach}.items() <= priced.items()
    for goal in (0, bound - 2 * factor, bound - 2, bound - 1, bound, bound + 30 * factor):
        domain, used = proof.fix(None, above, duals, goal)
        slack, left = goal - bound, {int(k) for keys, _ in domain for k in keys}
        kept = {k for k, rc in reduced.items() if rc <= max(slack, -1)} | problem.forced
        assert left == kept - problem.forbidden
        assert set(used) == {k for k in left if -reduced[k] > max(slack, -1)}
        for present in (above[1], above[1] | set(used)):
            below = (above[0], present, *above[2:])
            assert proof.price(domain, below, duals)[0] == bound
    if factor == 2**44 and scale * problem.peak > 2**61:
        assert all(rcs.dtype == object for *_, rcs in blocks)


def test_bounds_without_route_and_weaker_bounds_are_verified():
    piece = Workpiece.from_decimals("line", [("0", "0"), ("4", "0"), ("10", "0"), ("16", "0")])
    instance = Instance(piece)
    proof = prove(instance, lower=14)
    verdict = checked(proof)
    assert verdict.lower == 14 and verdict.upper == 16 and "at least 14 s" in verdict.statement
    trivial = Certificate.for_instance(
        instance, lower=0, tree=[Leaf(Duals(1, np.zeros(5, dtype=np.int64)))]
    )
    assert checked(trivial).upper is None


def test_the_granularity_rounds_bounds_up():
    """All costs are multiples of 4: a bound of 2 proves 4; a bound of 0 does not prove 1."""
    instance = Instance(Workpiece.from_decimals("pair", [("0", "0"), ("4", "0")]))

    def proof(lower: int, *pi: int) -> Certificate:
        leaf = Leaf(Duals(1, np.array(pi, dtype=np.int64)))
        return Certificate.for_instance(instance, lower=lower, tree=[leaf])

    for lower in (1, 4):
        assert checked(proof(lower, 1, 1, -1)).lower == lower
        with pytest.raises(Failure, match="misses the claim"):
            checked(proof(lower, 0, 0, 0))
    with pytest.raises(Failure, match="misses the claim"):
        checked(proof(5, 2, 2, -2))


def test_the_user_s_own_file_binds():
    piece = Workpiece.from_decimals("own", [("0", "0"), ("1.5", "0"), ("3", "1")])
    proof = prove(Instance(piece))
    holes = [(h.id, h.x, h.y) for h in map(piece.hole, range(3))]
    assert checked(proof, holes=holes, sha256=Instance(piece).sha256)
    moved = [*holes[:2], ("3", Fraction(3), Fraction(10001, 10000))]
    renamed = [*holes[:2], ("4", Fraction(3), Fraction(1))]
    for other in (moved, renamed, holes[:2], holes[::-1], []):
        with pytest.raises(Failure, match="another workpiece"):
            checked(proof, holes=other)
    for other in (Instance(piece, ends=Ends(start=0)), Instance(piece, Travel(vx=Fraction(2)))):
        with pytest.raises(Failure, match="another instance"):
            checked(proof, sha256=other.sha256)


def test_a_matrix_that_the_user_did_not_give_does_not_bind():
    piece = Workpiece.from_decimals("own", [("0", "0"), ("1.5", "0"), ("3", "1")])
    holes = [(h.id, h.x, h.y) for h in map(piece.hole, range(3))]
    zeros = dataclasses.replace(piece, matrix=np.zeros((3, 3), np.int64))
    instance = Instance(zeros, Travel(Model.EXPLICIT))
    proof = prove(instance)
    assert checked(proof).lower == 0
    assert checked(proof, holes=holes, sha256=instance.sha256)
    with pytest.raises(Failure, match="times are not yours"):
        checked(proof, holes=holes)


def test_seconds_are_never_rounded_above_what_is_proved():
    problem = Problem(instance_data(Instance(row_of(3))))
    problem.quantum = Fraction(1, 3)
    assert " 0.6666666666666666666666666666 s (2 quanta" in problem.statement(2, None)
    problem.quantum = Fraction(12345678901234567890123456789999)
    assert " 1.234567890123456789012345678E+31 s (1 quanta" in problem.statement(1, None)


# --- short texts that ask for much ------------------------------------------------------


def row_of(n: int) -> Workpiece:
    """Holes a millimetre apart, in a row."""
    return Workpiece.from_decimals("row", [(str(k), "0") for k in range(n)])


@pytest.fixture
def little_memory():
    """Fail if the test takes more than 50 MB at any moment."""
    tracemalloc.start()
    yield
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6


def test_teeth_that_repeat_take_little_memory(little_memory):
    problem = Problem(instance_data(Instance(row_of(400))))
    with pytest.raises(Failure, match="share a node"):
        Proof(problem, [[0, 1]], [[0] * 300_002])


def test_sets_within_sets_take_little_memory(little_memory):
    problem = Problem(instance_data(Instance(row_of(300))))
    proof = Proof(problem, [[0, k % 148 + 1] for k in range(450)], [[k] for k in range(450)])
    ones = [v for k in range(450) for v in (k, 1)]
    nothing = tuple(set() for _ in range(4))
    duals = proof.duals({"scale": 1, "pi": [0] * proof.size, "cuts": ones}, 0, nothing)
    low = {v: sum(v <= k % 148 + 1 for k in range(450)) for v in range(proof.size)}
    high = sum(
        min(0, (abs(i - j) if proof.size - 1 not in (i, j) else 0) - abs(low[i] - low[j]))
        for i, j in itertools.combinations(range(proof.size), 2)
    )
    assert proof.price(None, nothing, duals)[0] == 900 + high


def test_a_matrix_without_entries_takes_little_memory(little_memory):
    data = instance_data(Instance(row_of(5_000)))
    with pytest.raises(Failure, match="whole numbers"):
        Problem(data | {"matrix": [[]] * 5_000})


# --- on its own: only numpy importable -------------------------------------------------


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """Run the checker where nothing but the standard library and numpy can be imported."""
    room = tmp_path_factory.mktemp("alone")
    shutil.copy(checker.__file__, room)
    site = room / "site"
    site.mkdir()
    numpy = Path(np.__file__).parent
    for part in (numpy, numpy.parent / "numpy.libs"):
        if part.exists():
            (site / part.name).symlink_to(part)
    start = (
        f"import sys, runpy, importlib.util as util; sys.path[:0] = {[str(site), str(room)]};"
        "assert not any(map(util.find_spec, ['tcp', 'scipy', 'click'])); sys.argv = sys.argv[1:];"
        "runpy.run_path(sys.argv[0], run_name='__main__')"
    )

    def run(*arguments) -> subprocess.CompletedProcess:
        command = [sys.executable, "-I", "-S", "-c", start, str(room / "certificate.py")]
        return subprocess.run([*command, *map(str, arguments)], capture_output=True, text=True)

    return run


def test_it_runs_on_its_own(alone, tmp_path):
    piece = Workpiece.from_decimals("own", [("0", "0"), ("1.5", "0"), ("3", "1")])
    file = write(prove(Instance(piece)), tmp_path / "own.cert.json.gz")
    own = Instance(piece).sha256
    for arguments in ((file,), (file, own)):
        found = alone(*arguments)
        assert found.returncode == 0, found.stderr
        assert found.stdout.startswith("verified: The route given for 'own' (open path, 3 holes; ")
        assert "takes 4 s" in found.stdout and own in found.stdout
        assert ("is yours" in found.stdout) == (len(arguments) == 1)
    cases = [
        ((file, Instance(piece, ends=Ends(start=0)).sha256), 1, "another instance"),
        ((tmp_path / "none.json",), 3, "none.json: No such file or directory\n"),
        ((), 2, "usage"),
        (("--help",), 2, "usage"),
    ]
    for arguments, code, words in cases:
        found = alone(*arguments)
        assert (found.returncode, found.stdout) == (code, "") and words in found.stderr
        assert "Traceback" not in found.stderr


def test_the_checker_stays_small_and_alone():
    """One file of less than 500 lines, importing the standard library and numpy only."""
    text = Path(checker.__file__).read_text()
    assert len(text.splitlines()) < 500
    tree = ast.parse(text)
    allowed = sys.stdlib_module_names | {"numpy"}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            assert {alias.name.split(".")[0] for alias in node.names} <= allowed
        if isinstance(node, ast.ImportFrom):
            assert node.module.split(".")[0] in allowed
