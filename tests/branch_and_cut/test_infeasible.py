"""Farkas leaves for real: rules that leave no tour, or none below many branches."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest
from click.testing import CliRunner

import tcp.validate.certificate as checker
from tcp import Ends, Instance, Proof, Rules, Status, Workpiece, solve
from tcp.cli.main import main
from tcp.errors import Exit
from tcp.exact.branch_and_cut import tree
from tests.certificates.mutation_run import Tally, run

Edges = set[tuple[int, int]]


def snark(k: int) -> Edges:
    """The flower snark of 4k nodes, k odd: 3-regular, 3-connected, no Hamiltonian cycle."""
    edges = set()
    for i in range(k):
        j = (i + 1) % k
        edges |= {(4 * i, 4 * i + part) for part in (1, 2, 3)}
        edges |= {(4 * i + 1, 4 * j + 1)}
        swap = j == 0
        edges |= {(4 * i + 2, 4 * j + (3 if swap else 2)), (4 * i + 3, 4 * j + (2 if swap else 3))}
    return {(min(e), max(e)) for e in edges}


def coxeter() -> Edges:
    """The Coxeter graph: 28 triples without a line of the Fano plane, joined where disjoint."""
    lines = [{i, (i + 1) % 7, (i + 3) % 7} for i in range(7)]
    triples = [set(t) for t in itertools.combinations(range(7), 3) if set(t) not in lines]
    pairs = itertools.combinations(range(28), 2)
    return {(i, j) for i, j in pairs if not triples[i] & triples[j]}


def only(edges: Edges, n: int, seed: int, **ends) -> Instance:
    """Random holes of which only the given pairs may follow each other."""
    x, y = np.random.default_rng(seed).integers(0, 50, (2, n))
    forbidden = tuple(p for p in itertools.combinations(range(n), 2) if p not in edges)
    piece = Workpiece("snark", tuple(map(str, range(n))), x, y)
    return Instance(piece, ends=Ends(**ends), rules=Rules(forbidden=forbidden))


def proved(instance: Instance, path) -> tuple[Status, dict]:
    """Solved, certified, and the certificate as plain data."""
    result = solve(instance, "branch-and-cut", exact=True, certificate=path)
    assert result.proof is Proof.CERTIFIED
    return result.status, json.loads(checker.unzip(path))


def rays(data: dict) -> list[dict]:
    """Farkas leaves of a certificate."""
    return [n["leaf"] for n in data["tree"] if n.get("leaf") and n["leaf"]["scale"] == 0]


GRAPHS = {"snark 12": (snark(3), 12), "snark 20": (snark(5), 20), "coxeter": (coxeter(), 28)}


@pytest.mark.parametrize("name", GRAPHS)
def test_graphs_without_a_cycle_are_proved_infeasible_at_depth(name, tmp_path, monkeypatch):
    monkeypatch.setattr(tree, "HARD", 10**6)  # local cuts see through the smallest at once
    edges, n = GRAPHS[name]
    assert len(edges) == 3 * n // 2
    status, data = proved(only(edges, n, 1, closed=True), tmp_path / "no.cert.json")
    assert status is Status.INFEASIBLE
    assert data["claim"] == {"infeasible": True} and "route" not in data
    assert len(rays(data)) > 1 and len(data["tree"]) > 2


def test_local_cuts_see_that_a_small_graph_has_no_cycle(tmp_path, monkeypatch):
    monkeypatch.setattr(tree, "HARD", 1)
    edges, n = GRAPHS["snark 12"]
    status, data = proved(only(edges, n, 1, closed=True), tmp_path / "no.cert.json")
    assert status is Status.INFEASIBLE
    assert len(data["tree"]) == 3
    assert any(type(cut) is dict for cut in data["cuts"])


def test_fixed_ends_that_are_neighbours_ask_for_the_missing_cycle(tmp_path):
    edges, n = GRAPHS["snark 20"]
    first, last = min(edges)
    status, data = proved(only(edges, n, 2, start=first, end=last), tmp_path / "no.cert.json")
    assert status is Status.INFEASIBLE and rays(data)
    apart = next(p for p in itertools.combinations(range(n), 2) if p not in edges)
    status, data = proved(only(edges, n, 2, start=apart[0], end=apart[1]), tmp_path / "p.json")
    assert status is Status.OPTIMAL


def test_infeasible_leaves_below_a_shortest_route(tmp_path):
    """Where routes exist but are rare, some branches hold none: their leaves carry rays."""
    edges, n = GRAPHS["coxeter"]
    others = [p for p in itertools.combinations(range(n), 2) if p not in edges]
    found = 0
    for seed, pair in enumerate(others[:60:12]):  # one more succession: a cycle has to use it
        instance = only(edges | {pair}, n, seed, closed=True)
        status, data = proved(instance, tmp_path / f"{seed}.json")
        assert status is Status.OPTIMAL
        found += len(rays(data))
    assert found


def test_mutated_rays_are_refused_or_still_true(tmp_path):
    edges, n = GRAPHS["snark 12"]
    _, data = proved(only(edges, n, 1, closed=True), tmp_path / "no.json")
    text = json.dumps(data)
    tally = run(400, seed=5, texts=[text], truth=None)
    assert not tally.false, tally.false[0][:300]
    assert sum(tally.refused.values()) > 200
    feasible = only(edges, n, 1)  # the same rays about the open path, which exists
    data["instance"]["ends"], data["instance"]["sha256"] = {}, feasible.sha256
    lie = Tally()
    lie.add("lie", json.dumps(data), 0)
    assert lie.refused["lie"] == 1


def test_rays_that_are_a_unit_short_are_refused(tmp_path):
    """Every ray whose bound a single unit takes away no longer closes its leaf."""
    edges, n = GRAPHS["snark 12"]
    _, data = proved(only(edges, n, 1, closed=True), tmp_path / "no.json")
    for ray in rays(data):
        was, ray["pi"] = ray["pi"], [v - 10**9 for v in ray["pi"]]
        with pytest.raises(checker.Failure, match="misses the claim"):
            checker.check(json.dumps(data).encode())
        ray["pi"] = was
    assert checker.check(json.dumps(data).encode()).lower is None


def test_the_command_line_writes_the_certificate_and_exits_4(tmp_path):
    board, proof = tmp_path / "b.csv", tmp_path / "no.cert.json.gz"
    board.write_text("id,x,y\n" + "".join(f"h{k},{7 * k % 13},{5 * k % 11}\n" for k in range(12)))
    edges = snark(3)
    pairs = [p for p in itertools.combinations(range(12), 2) if p not in edges]
    rules = [t for i, j in pairs for t in ("--forbid", f"h{i},h{j}")]
    command = ["solve", "--exact", "--closed", "--certificate", proof, *rules, board]
    done = CliRunner().invoke(main, list(map(str, command)))
    assert done.exit_code == Exit.INFEASIBLE, done.output
    assert "certified" in done.output
    again = CliRunner().invoke(main, list(map(str, ["check", proof, board, "--closed", *rules])))
    assert again.exit_code == 0 and "No route of" in again.output
    other = CliRunner().invoke(main, list(map(str, ["check", proof, board, *rules])))
    assert other.exit_code == 1 and "another instance" in other.output
