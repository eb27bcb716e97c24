"""The certificate in memory and on disk: exact round trips, canonical text, trees of any depth."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tcp import Ends, Instance, Workpiece
from tcp.errors import InputError
from tcp.files.certificate import (
    Certificate,
    Duals,
    EdgeBranch,
    Fix,
    Leaf,
    Pool,
    SetBranch,
    from_text,
    to_text,
    write,
)
from tcp.validate.certificate import unzip

FIVE = Workpiece.from_decimals("five", [("1", "2"), ("3", "1"), ("5", "2"), ("3", "3"), ("1", "4")])


def duals(*potentials: int, scale: int = 10, **rest: tuple[tuple[int, int], ...]) -> Duals:
    return Duals(scale, np.array(potentials, dtype=np.int64), **rest)


def sample() -> Certificate:
    pool = Pool()
    unused = pool.cut([{3, 4}])
    cut = pool.cut([{0, 1, 2}])
    comb = pool.cut([{0, 1, 2}, {0, 3}, {1, 4}, {2, 5}])
    branch = pool.set([1, 2, 4])
    assert pool.cut([(2, 1, 0)]) == cut and unused == 0
    tree = [
        Fix(duals(1, 2, 3, 4, 5, 6, cuts=((comb, 3), (cut, 1))), 5),
        Leaf(duals(0, -2, 3, 4, 5, 6, branches=((branch, -2),))),
        Leaf(None),
        EdgeBranch(0, 1, 4, 2),
        Leaf(duals(9, 9, 9, 9, 9, 9, scale=0, branches=((branch, 7),))),
        SetBranch(branch, 1, 3),
    ]
    return Certificate.for_instance(
        Instance(FIVE), lower=7, route=(0, 1, 2, 3, 4), pool=pool, tree=tree
    )


@pytest.mark.parametrize("name", ["a.cert.json", "a.cert.json.gz"])
def test_what_is_written_is_read(tmp_path, name):
    proof = sample()
    again = from_text(unzip(write(proof, tmp_path / name)).decode())
    assert to_text(again) == to_text(proof)
    assert [p.name for p in tmp_path.iterdir()] == [name]
    assert again.cuts == ((0, 1, 2, 3), (0,)) and len(again.sets) == 5
    assert again.upper == Instance(FIVE).cost((0, 1, 2, 3, 4))


def test_the_tree_is_written_in_preorder_and_potentials_as_differences():
    data = json.loads(to_text(sample()))
    assert [next(iter(node)) for node in data["tree"]] == [
        "fix", "set", "leaf", "edge", "leaf", "leaf",
    ]  # fmt: skip
    assert data["tree"][2]["leaf"]["pi"] == [-1, -4, 0, 0, 0, 0]
    assert data["sets"][0] == [0, 2]


def test_equal_proofs_give_equal_bytes(tmp_path):
    first = write(sample(), tmp_path / "1.json.gz").read_bytes()
    assert write(sample(), tmp_path / "2.json.gz").read_bytes() == first


def test_trees_of_any_depth_need_no_recursion():
    depth = 20_000
    tree = [
        EdgeBranch(0, 1, 2 * k + 1, 2 * k + 2) if node == 0 else Leaf(None)
        for k in range(depth)
        for node in (0, 1)
    ]
    tree.append(Leaf(None))
    proof = Certificate.for_instance(Instance(FIVE), lower=0, tree=tree)
    assert from_text(to_text(proof)).tree == proof.tree


@pytest.mark.parametrize("child", [0, 2, 9, -1])
def test_nodes_that_are_no_tree_are_refused(child):
    tree = [EdgeBranch(0, 1, 1, child), Leaf(None), EdgeBranch(0, 1, 1, 1), Leaf(None)]
    with pytest.raises(ValueError):
        Certificate.for_instance(Instance(FIVE), lower=0, tree=tree)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format":"x"}', "[" * 100_000])
def test_other_texts_are_refused(text):
    with pytest.raises(InputError):
        from_text(text)


def test_ends_and_rules_are_told_by_hole_id():
    instance = Instance(FIVE, ends=Ends(start=2))
    proof = Certificate.for_instance(instance, lower=0, tree=[Leaf(None)])
    assert proof.instance["ends"] == {"start": "3"} and proof.upper is None
    assert proof.instance["sha256"] == instance.sha256
