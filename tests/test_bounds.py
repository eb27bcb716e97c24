"""Held-Karp bounds: never above the optimum, exact in their arithmetic, certified."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from fractions import Fraction

import networkx as nx
import numpy as np
import pytest
from click.testing import CliRunner

import tcp.validate.certificate as checker
from tcp import Ends, Instance, Model, Rules, Stop, Travel, Workpiece
from tcp.bounds.candidates import near_pairs
from tcp.bounds.evidence import bound_certificate
from tcp.bounds.one_tree import ROUNDS, one_tree_bound
from tcp.bounds.spanning import boruvka, cells, prim
from tcp.cli.main import main
from tcp.errors import UsageError
from tcp.exact.branch_and_cut.problem import Problem
from tcp.files import read
from tcp.files.certificate import to_text
from tcp.kernels import pack
from tcp.stop import Clock
from tests.certificates.mutations import optimum
from tests.certificates.samples import TRAVELS, random_instance


@pytest.mark.parametrize("seed", range(80))
def test_bounds_hold_and_their_certificates_are_verified(seed):
    instance = random_instance(np.random.default_rng(seed), most=8 if seed % 8 == 0 else 6)
    bound = one_tree_bound(instance, iterations=64, width=int(2 + seed % 4))
    best = optimum(instance)
    assert best is None or bound.value <= best
    assert bound.value % instance.granularity == 0
    verdict = checker.check(to_text(bound_certificate(instance, bound)).encode())
    assert verdict.lower == bound.value


def test_chains_of_pairs_that_must_be_adjacent_have_certificates():
    """Two holes that a chain joins may be nearer to each other than any pair of the tree."""
    rng, checked = np.random.default_rng(0), 0
    for trial in range(60):
        n = int(rng.integers(5, 9))
        x, y = rng.integers(0, 90, (2, n))
        a, b, c, d = (int(v) for v in rng.permutation(n)[:4])
        together = [((a, b), (b, c)), ((a, b), (b, c), (c, d)), ((a, b), (c, d))][trial % 3]
        piece = Workpiece("chains", tuple(map(str, range(n))), x, y)
        instance = Instance(piece, rules=Rules(together=together))
        bound = one_tree_bound(instance, iterations=60)
        best = optimum(instance)
        assert best is not None and bound.value <= best
        verdict = checker.check(to_text(bound_certificate(instance, bound)).encode())
        assert verdict.lower == bound.value
        checked += 1
    assert checked == 60


def test_bounds_are_often_the_optimum():
    """On small boards the subtour bound has hardly a gap; so must ours."""
    rng = np.random.default_rng(5)
    tight = 0
    for _ in range(40):
        instance = random_instance(rng)
        tight += one_tree_bound(instance, iterations=200).value == (optimum(instance) or 0)
    assert tight >= 34


@pytest.mark.parametrize("ends", [Ends(), Ends(closed=True), Ends(start=0)], ids=str)
@pytest.mark.parametrize("n", [1, 2, 3])
def test_tiny_workpieces(n, ends):
    spots = [("0", "0"), ("3", "1"), ("1", "5")][:n]
    instance = Instance(Workpiece.from_decimals("tiny", spots), ends=ends)
    bound = one_tree_bound(instance)
    assert bound.value == optimum(instance)
    assert checker.check(to_text(bound_certificate(instance, bound)).encode()).lower == bound.value


@pytest.mark.parametrize("travel", TRAVELS[:-1], ids=lambda t: f"{t.model}")
@pytest.mark.parametrize("seed", range(3))
def test_spanning_trees_are_lightest_over_all_pairs(travel, seed):
    """Against networkx on the complete graph, with potentials that reach far, ties and bans."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 60))
    x, y = rng.integers(0, 15, (2, n)) * 7
    piece = Workpiece("grid", tuple(map(str, range(n))), x, y)
    form = Instance(piece, travel).form
    full = 4 * form.full_matrix()[:n, :n]
    value = rng.integers(-40, 40, n) * int(rng.integers(0, 30))
    weights = full - value[:, None] - value[None, :]
    bans = {tuple(sorted(rng.choice(n, 2, replace=False).tolist())) for _ in range(n // 3)}
    forced = {(0, 1), (1, n - 1)} - bans if n > 3 else set()
    graph = nx.Graph()
    low = int(weights.min()) - 1
    for i in range(n):
        for j in range(i):
            if (j, i) not in bans:
                graph.add_edge(i, j, weight=low if (j, i) in forced else int(weights[i, j]))
    keys = np.array(sorted(i * n + j for i, j in bans), dtype=np.int64)
    must = np.array(sorted(forced), dtype=np.int64).reshape(-1, 2)
    tree = boruvka(pack(form.rule), 4, x, y, value, must, keys, *cells(x, y))
    found = nx.Graph(tree.tolist())
    assert forced <= {tuple(sorted(e)) for e in tree.tolist()}
    assert not bans & {tuple(sorted(e)) for e in tree.tolist()}
    best = nx.minimum_spanning_edges(graph, data=False)
    if nx.is_connected(graph):
        assert len(tree) == n - 1 and nx.is_connected(found)
        assert weights[tree[:, 0], tree[:, 1]].sum() == sum(weights[i, j] for i, j in best)
    if not bans:
        again = prim(weights, must)
        assert weights[again[:, 0], again[:, 1]].sum() == weights[tree[:, 0], tree[:, 1]].sum()


def test_compiling_is_not_counted(tmp_path):
    """With an empty cache four seconds are enough for a hundred holes; compiling takes longer."""
    program = """if True:
        import numpy as np
        from tcp import Instance, Workpiece
        from tcp.bounds.one_tree import one_tree_bound
        from tcp.stop import Clock, Stop
        x, y = np.random.default_rng(1).integers(0, 10**4, (2, 100))
        instance = Instance(Workpiece("random", tuple(map(str, range(100))), x, y))
        found = one_tree_bound(instance, clock=Clock(Stop(time=4)))
        assert found.iterations > 10, found.iterations
    """
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True)


@pytest.mark.parametrize("travel", TRAVELS[:4], ids=str)
def test_holes_at_one_place_are_partners_of_each_other_in_turn(travel):
    """A tree that cannot tell them apart looks at all of them for each, and finds the same few."""
    pile = 300
    x, y = np.random.default_rng(2).integers(0, 1000, (2, 100))
    x, y = np.append(x, np.full(pile, x[0])), np.append(y, np.full(pile, y[0]))
    instance = Instance(Workpiece("pile", tuple(map(str, range(x.size))), x, y), travel)
    problem = Problem.of(instance)
    one_tree = near_pairs(instance.form, np.arange(x.size), 5)
    for found in (one_tree, np.column_stack(problem.pairs(problem.nearest))):
        partners = np.bincount(found[(found >= 100).all(axis=1)].ravel(), minlength=x.size)[100:]
        assert partners.min() >= 3 and partners.max() <= 12


def test_two_candidates_a_node_cannot_make_a_bound_too_high():
    """Clusters: candidate trees overestimate wildly here, the exact trees must not."""
    rng = np.random.default_rng(0)
    spots = [(a + int(p), b + int(q)) for a, b in ((0, 0), (900, 0), (0, 800), (900, 850))
             for p, q in rng.integers(0, 20, (12, 2))]  # fmt: skip
    piece = Workpiece.from_decimals("clusters", spots)
    instance = Instance(piece, Travel(Model.SIMULTANEOUS))
    coarse = one_tree_bound(instance, iterations=200, width=2)
    fine = one_tree_bound(instance, iterations=2_000, width=40)
    assert coarse.value <= fine.value + instance.granularity
    for bound in (coarse, fine):
        proof = bound_certificate(instance, bound)
        assert checker.check(to_text(proof).encode()).lower == bound.value


def test_same_call_same_bound_and_limits_are_obeyed():
    rng = np.random.default_rng(1)
    x, y = rng.integers(0, 10_000, (2, 3_000))
    instance = Instance(Workpiece("many", tuple(map(str, range(3_000))), x, y))
    news = []
    first = one_tree_bound(instance, iterations=40, report=news.append)
    assert first.exact == one_tree_bound(instance, iterations=40).exact
    assert [p.bound for p in news] == sorted(p.bound for p in news)
    assert first.iterations == 40 and len(news) == ROUNDS
    stopped = one_tree_bound(instance, clock=Clock(Stop(time=0)))
    assert 0 < stopped.value < first.value
    with pytest.raises(UsageError, match="up to 3000 nodes"):
        bound_certificate(instance, first)


def test_extreme_coordinates_stay_exact():
    """Costs of 2^50 leave room for a coarse scale only."""
    far = 2**50
    piece = Workpiece.from_decimals("far", [("0", "0"), (far, "1"), ("5", far), (far, far), (9, 9)])
    instance = Instance(piece)
    bound = one_tree_bound(instance, iterations=100)
    assert bound.scale < 1024 and 0 < bound.value <= optimum(instance)
    assert checker.check(to_text(bound_certificate(instance, bound)).encode()).lower == bound.value


@pytest.mark.parametrize(
    ("name", "held_karp"), [("berlin52", 7542), ("eil51", 422.5), ("kroA100", 20936.5)]
)
def test_published_held_karp_bounds_are_reached(corpus, name, held_karp):
    """The subtour bounds of TSPLIB's closed tours (D. S. Johnson, L. A. McGeoch, E. E. Rothberg,
    "Asymptotic experimental analysis for the Held-Karp traveling salesman bound", SODA 1996)."""
    reading = read(corpus / "tsplib" / f"{name}.tsp")
    instance = Instance(reading.workpiece, reading.travel, Ends(closed=True))
    bound = one_tree_bound(instance)
    assert 0.9995 * held_karp <= bound.exact / bound.scale <= held_karp + 1e-9


# --- tcp bound -------------------------------------------------------------------------


def run(*arguments) -> tuple[int, str]:
    found = CliRunner().invoke(main, ["bound", *map(str, arguments)])
    return found.exit_code, found.output


@pytest.fixture
def five(tmp_path):
    path = tmp_path / "five.csv"
    path.write_text("id,x,y\n1,1,2\n2,3,1\n3,5,2\n4,3,3\n5,1,4\n")
    return path


def test_tcp_bound_prints_a_bound_and_writes_its_certificate(five, tmp_path):
    code, text = run(five)
    assert code == 0 and "at least 10 s" in text
    proof = tmp_path / "five.cert.json.gz"
    code, text = run(five, "--json", "--certificate", proof)
    data = json.loads(text)
    assert code == 0 and data["bound"] == "10" and data["method"] == "one-tree"
    verdict = checker.check(checker.unzip(proof))
    assert verdict.lower == 10 and verdict.sha256 == data["instance"]["sha256"]


def test_tcp_bound_by_linear_programming(five, tmp_path):
    proof = tmp_path / "five.cert.json"
    code, text = run(five, "--method", "lp", "--travel", "case2", "--json", "--certificate", proof)
    data = json.loads(text)
    instance = Instance(read(five).workpiece, Travel(Model.SIMULTANEOUS))
    assert code == 0 and Fraction(data["bound"]) == optimum(instance) * instance.quantum
    assert checker.check(checker.unzip(proof)).lower == optimum(instance)


def test_tcp_bound_refuses_nonsense(five, tmp_path):
    assert run(five, "--iterations", "0")[0] == 2
    assert run(five, "--seed", "-1")[0] == 2
    assert run(five, "--method", "magic")[0] == 2
    assert run(tmp_path / "none.csv")[0] == 3
    code, text = run(five, "--start", "9")
    assert code == 2 and "no hole '9'" in text
    assert run(five, five, "--certificate", tmp_path / "one.json")[0] == 2
    code, text = run(five, "--method", "lp", "--iterations", "9")
    assert code == 2 and "--iterations counts the trees of one-tree" in text


def test_tcp_bound_says_that_there_is_no_route(tmp_path):
    """Four holes that only nearer ones could follow: the lp proves it, and its certificate too."""
    board, proof = tmp_path / "b.csv", tmp_path / "b.json"
    board.write_text("id,x,y\n1,0,0\n2,1,0\n3,0,1\n4,1,1\n")
    code, text = run(board, "--method", "lp", "--min-jump", "2", "--certificate", proof)
    assert code == 4 and "no route satisfies its ends and rules (proved)" in text
    assert checker.check(checker.unzip(proof)).lower is None


def test_tcp_bound_refuses_too_large_a_certificate_before_any_work(five, tmp_path, monkeypatch):
    monkeypatch.setattr("tcp.bounds.evidence.LARGEST", 5)
    monkeypatch.setattr("tcp.bounds.one_tree.one_tree_bound", None)
    code, text = run(five, "--certificate", tmp_path / "five.json")
    assert code == 2 and "certificates of 1-tree bounds are for up to 5 nodes" in text


@pytest.mark.parametrize(
    ("name", "code", "complaint"),
    [
        ("five.csv", 2, "ends in .json or .json.gz"),
        ("five.json", 2, "is an input and would be overwritten"),
        ("none/five.json", 7, "there is no folder"),
    ],
)
def test_tcp_bound_looks_at_its_certificate_before_any_work(
    five, tmp_path, name, code, complaint, monkeypatch
):
    monkeypatch.setattr("tcp.cli.bound.bounded", None)
    text = five.read_text()
    (tmp_path / "five.json").write_text(text)  # whatever its name, CSV inside
    answer = run(tmp_path / "five.json", "--certificate", tmp_path / name)
    assert answer[0] == code and complaint in answer[1]
    assert five.read_text() == (tmp_path / "five.json").read_text() == text


def test_rules_that_disconnect_still_leave_a_bound():
    piece = Workpiece.from_decimals("apart", [("0", "0"), ("5", "0"), ("9", "0"), ("0", "7")])
    every = tuple((i, j) for i in range(4) for j in range(i))
    instance = Instance(piece, rules=Rules(forbidden=every))
    assert one_tree_bound(instance, iterations=50).value >= 0
