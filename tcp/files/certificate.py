"""Certificates: a proof about an instance, in memory and as canonical JSON.

The format is specified in ``docs/certificate.md``.  What a certificate means,
and whether it proves what it claims, is decided by the independent checker
:mod:`tcp.validate.certificate`, which shares no code with this module.

Nodes are those of the instance's :class:`~tcp.instance.TourForm`: holes, then
home, then the virtual node.  A certificate is built from a :class:`Pool` of
node sets and cuts and a flat list of tree nodes (root first, children by
index), so that trees of any depth need no recursion::

    pool = Pool()
    cut = pool.cut([{0, 1, 2}])                      # subtour: x(d(S)) >= 2
    comb = pool.cut([handle, tooth1, tooth2, tooth3])
    duals = Duals(scale=1000, potentials=pi, cuts=((cut, 500), (comb, 250)))
    proof = Certificate.for_instance(instance, lower=70, route=route, pool=pool,
                                     tree=[Leaf(duals)])
    write(proof, "wp.cert.json.gz")
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from tcp.errors import InputError
from tcp.files.write import write_file
from tcp.instance import Instance
from tcp.travel import Ints, describe

FORMAT = "tcp-certificate"
VERSION = 2
"""The newest version; a certificate without weighted cuts is written as version 1."""

NOWHERE = np.zeros((), dtype=np.int64)
"""What the potentials of the first dual vector are coded against."""


@dataclass(frozen=True, eq=False)
class Duals:
    """Integer dual multipliers: one lower bound on every tour of a subtree.

    Parameters
    ----------
    scale : int
        Weight of the costs, >= 0: the reduced cost of a pair starts from
        ``scale * cost``.  0 makes the vector a Farkas ray, which proves that a
        subtree holds no tour at all.
    potentials : int64 array of shape (form.size,)
        One multiplier per node, of any sign.
    cuts : tuple of (int, int)
        (index of a cut in the pool, multiplier > 0).
    branches : tuple of (int, int)
        (index of a set in the pool, multiplier) for set branches above this
        node: > 0 uses ``x(d(S)) >= 4``, < 0 uses ``x(d(S)) <= 2``.
    """

    scale: int
    potentials: Ints
    cuts: tuple[tuple[int, int], ...] = ()
    branches: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class EdgeBranch:
    """Either the tour avoids the edge ``i``–``j`` (child ``absent``) or uses it."""

    i: int
    j: int
    absent: int
    present: int


@dataclass(frozen=True)
class SetBranch:
    """Either two tour edges leave the set (child ``two``) or at least four (child ``four``)."""

    nodes: int
    two: int
    four: int


@dataclass(frozen=True)
class Fix:
    """Duals whose reduced costs settle pairs for the whole subtree below ``child``."""

    duals: Duals
    child: int


@dataclass(frozen=True)
class Leaf:
    """A closed node: its duals reach the claim; None if its branches contradict each other."""

    duals: Duals | None


Node = EdgeBranch | SetBranch | Fix | Leaf


@dataclass(frozen=True)
class Weighted:
    """A local cut: indices of sets and their weights, each at least 1.

    Its right-hand side is the least that any tour of the parts weighs into
    which the sets split the nodes; it is not written but found again.
    """

    sets: tuple[int, ...]
    weights: tuple[int, ...]


class Pool:
    """Node sets and cuts, each kept once.

    Attributes
    ----------
    sets : list of tuple of int
        Sorted node sets.
    cuts : list of tuple of int, or Weighted
        Indices into ``sets``: one set is a subtour cut, a handle followed by
        an odd number of at least three disjoint teeth is a comb.
    """

    def __init__(self) -> None:
        self.sets: list[tuple[int, ...]] = []
        self.cuts: list[tuple[int, ...] | Weighted] = []
        self._set_at: dict[tuple[int, ...], int] = {}
        self._cut_at: dict[tuple[int, ...] | Weighted, int] = {}

    def set(self, nodes: Iterable[int]) -> int:
        """Index of a node set, entered if it is new."""
        key = tuple(sorted({int(v) for v in nodes}))
        if key not in self._set_at:
            self._set_at[key] = len(self.sets)
            self.sets.append(key)
        return self._set_at[key]

    def cut(self, sets: Iterable[Iterable[int]], weights: Sequence[int] = ()) -> int:
        """Index of the cut over these node sets, entered if it is new; weights make it local."""
        listed = tuple(self.set(nodes) for nodes in sets)
        key = Weighted(listed, tuple(weights)) if weights else listed
        if key not in self._cut_at:
            self._cut_at[key] = len(self.cuts)
            self.cuts.append(key)
        return self._cut_at[key]


@dataclass(frozen=True, eq=False)
class Certificate:
    """A proof, complete with the instance it is about.

    Parameters
    ----------
    instance : mapping
        The instance as plain data; see :func:`instance_data`.
    lower : int or None
        Claimed lower bound on every route, in quanta; None claims that no
        route exists at all.
    upper : int or None
        Claimed cost of ``route``.
    route : tuple of int or None
        Holes in drilling order, by position in the workpiece.
    sets, cuts : tuples
        The pool; see :class:`Pool`.
    tree : tuple of Node
        Preorder: the root first, every child after its parent.
    """

    instance: Mapping[str, Any] = field(repr=False)
    lower: int | None
    upper: int | None
    route: tuple[int, ...] | None = field(repr=False)
    sets: tuple[tuple[int, ...], ...] = field(repr=False)
    cuts: tuple[tuple[int, ...] | Weighted, ...] = field(repr=False)
    tree: tuple[Node, ...] = field(repr=False)

    @classmethod
    def for_instance(
        cls,
        instance: Instance,
        *,
        lower: int | None,
        route: Sequence[int] | None = None,
        pool: Pool | None = None,
        tree: Sequence[Node],
    ) -> Certificate:
        """A certificate about ``instance``.

        Parameters
        ----------
        instance : Instance
            The problem.
        lower : int or None
            Lower bound to claim, in quanta; None claims infeasibility.
        route : sequence of int, optional
            A route; the claimed upper bound is its cost.
        pool : Pool, optional
            Sets and cuts that the duals speak of; unused ones are left out.
        tree : sequence of Node
            Tree nodes in any order, the root first; unreached ones are refused.

        Raises
        ------
        ValueError
            If the nodes do not form one tree.
        """
        used, nodes = _compacted(pool or Pool(), tree)
        return cls(
            instance=instance_data(instance),
            lower=None if lower is None else int(lower),
            upper=None if route is None else instance.cost(route),
            route=None if route is None else tuple(int(v) for v in route),
            sets=tuple(used.sets),
            cuts=tuple(used.cuts),
            tree=nodes,
        )


def children(node: Node) -> tuple[int, ...]:
    """Indices of a tree node's children."""
    match node:
        case EdgeBranch():
            return node.absent, node.present
        case SetBranch():
            return node.two, node.four
        case Fix():
            return (node.child,)
        case Leaf():
            return ()


def preorder(tree: Sequence[Node]) -> list[int]:
    """Indices of a flat tree from the root (index 0) on, parents first.

    Raises
    ------
    ValueError
        If a node is missing, reached twice or not reached.
    """
    order: list[int] = []
    stack, reached = [0], {0}
    while stack:
        at = stack.pop()
        order.append(at)
        for child in reversed(children(tree[at])):
            if not 0 <= child < len(tree) or child in reached:
                raise ValueError(f"tree node {at} has no child {child} of its own")
            reached.add(child)
            stack.append(child)
    if len(order) != len(tree):
        raise ValueError(f"{len(tree) - len(order)} tree nodes hang on no parent")
    return order


def instance_data(instance: Instance) -> dict[str, Any]:
    """The instance as a certificate states it: exact integers and fractions as text."""
    piece, ids = instance.workpiece, instance.workpiece.ids
    data: dict[str, Any] = {
        "name": piece.name,
        "step": str(piece.step),
        "ids": list(ids),
        "x": piece.x.tolist(),
        "y": piece.y.tolist(),
        "travel": describe(instance.travel),
        "quantum": str(instance.quantum),
        "ends": instance.ends.describe(ids),
        "rules": instance.rules.describe(ids),
        "sha256": instance.sha256,
    }
    if piece.matrix is not None:
        data["matrix"] = [row[: i + 1].tolist() for i, row in enumerate(piece.matrix)]
    return data


def to_text(proof: Certificate) -> str:
    """Canonical JSON: the same certificate always gives the same text."""
    bounds = {"lower": proof.lower, "upper": proof.upper}
    claim = {key: bound for key, bound in bounds.items() if bound is not None}
    data: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION if any(isinstance(c, Weighted) for c in proof.cuts) else 1,
        "instance": dict(proof.instance),
        "claim": claim if proof.lower is not None else {**claim, "infeasible": True},
    }
    if proof.route is not None:
        data["route"] = list(proof.route)
    data |= {"sets": [*map(_runs, proof.sets)], "cuts": [*map(_cut_data, proof.cuts)]}
    before, rows = NOWHERE, list[str]()
    for node in proof.tree:
        row, before = _node_data(node, before)
        rows.append(_compact(row))
    head = ",\n".join(f'"{key}":{_compact(value)}' for key, value in data.items())
    return "{" + head + ',\n"tree":[\n' + ",\n".join(rows) + "\n]}\n"


def from_text(text: str, path: str | Path | None = None) -> Certificate:
    """The certificate that :func:`to_text` wrote; structure only, nothing is proved here.

    Raises
    ------
    InputError
        If the text is no certificate of a version up to this one.
    """
    try:
        data = json.loads(text)
        if data["format"] != FORMAT or data["version"] not in range(1, VERSION + 1):
            raise InputError(f"not a {FORMAT} of version 1 to {VERSION}", path)
        size = len(data["instance"]["ids"]) + 2
        before = NOWHERE
        tree: list[Node] = []
        for row in data["tree"]:
            node, before = _node_from(row, before)
            tree.append(node)
        route = data.get("route")
        return Certificate(
            instance=data["instance"],
            lower=data["claim"].get("lower"),
            upper=data["claim"].get("upper"),
            route=None if route is None else tuple(route),
            sets=tuple(_nodes(runs, size) for runs in data["sets"]),
            cuts=tuple(_cut_from(cut) for cut in data["cuts"]),
            tree=tuple(tree),
        )
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as e:
        raise InputError(f"malformed certificate ({type(e).__name__}: {e})", path) from None


def write(
    certificate: Certificate,
    path: str | Path,
    check: Callable[[bytes], None] | None = None,
    like: Sequence[Path] = (),
) -> Path:
    """Write a certificate, gzipped if the name ends in ``.gz``; the file appears whole or not.

    Parameters
    ----------
    certificate : Certificate
        The proof.
    path : path
        The file to write.
    check : callable, optional
        Sees the JSON text as it was read back, and may raise: then no file appears.
    like : sequence of path
        A new file is kept from whom any of these is kept from.

    Raises
    ------
    OutputError
        If the file cannot be written; what stood there before is untouched.
    """
    path = Path(path)
    data = to_text(certificate).encode()
    if path.suffix != ".gz":
        write_file(path, data, check, like)
        return path

    def unzipped(written: bytes) -> None:
        if check is not None:
            check(gzip.decompress(written))

    write_file(path, gzip.compress(data, mtime=0), unzipped, like)
    return path


def _cut_data(cut: tuple[int, ...] | Weighted) -> Any:
    if isinstance(cut, Weighted):
        return {"sets": list(cut.sets), "weights": list(cut.weights)}
    return list(cut)


def _cut_from(data: Any) -> tuple[int, ...] | Weighted:
    if isinstance(data, dict):
        return Weighted(tuple(data["sets"]), tuple(data["weights"]))
    return tuple(data)


def _compacted(pool: Pool, tree: Sequence[Node]) -> tuple[Pool, tuple[Node, ...]]:
    """The tree in preorder, and the part of the pool that it speaks of, in order of appearance."""
    used, order = Pool(), preorder(tree)
    place = {old: new for new, old in enumerate(order)}

    def cut(k: int) -> int:
        match pool.cuts[k]:
            case Weighted(sets, weights):
                return used.cut((pool.sets[s] for s in sets), weights)
            case sets:
                return used.cut(pool.sets[s] for s in sets)

    def fresh(duals: Duals) -> Duals:
        cuts = [(cut(k), int(y)) for k, y in duals.cuts]
        branches = [(used.set(pool.sets[s]), int(y)) for s, y in duals.branches]
        return replace(duals, cuts=tuple(sorted(cuts)), branches=tuple(sorted(branches)))

    def moved(node: Node) -> Node:
        match node:
            case EdgeBranch(i, j, absent, present):
                return EdgeBranch(i, j, place[absent], place[present])
            case SetBranch(nodes, two, four):
                return SetBranch(used.set(pool.sets[nodes]), place[two], place[four])
            case Fix(duals, child):
                return Fix(fresh(duals), place[child])
            case Leaf(duals):
                return Leaf(None if duals is None else fresh(duals))

    return used, tuple(moved(tree[old]) for old in order)


def _compact(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


def _runs(nodes: Sequence[int]) -> list[int]:
    """Sorted nodes as first, last, first, last, ... of their runs."""
    runs: list[int] = []
    for node in nodes:
        if runs and runs[-1] == node - 1:
            runs[-1] = node
        else:
            runs += [node, node]
    return runs


def _nodes(runs: Sequence[int], limit: int) -> tuple[int, ...]:
    if runs and not 0 <= min(runs) <= max(runs) < limit:
        raise ValueError(f"a set names node {max(runs)}")
    pairs = zip(runs[::2], runs[1::2], strict=True)
    return tuple(v for first, last in pairs for v in range(first, last + 1))


def _node_data(node: Node, before: Ints) -> tuple[dict[str, Any], Ints]:
    """A tree node as JSON, and the potentials that the next vector is coded against."""
    match node:
        case EdgeBranch():
            return {"edge": [node.i, node.j], "children": [node.absent, node.present]}, before
        case SetBranch():
            return {"set": node.nodes, "children": [node.two, node.four]}, before
        case Leaf(None):
            return {"leaf": None}, before
        case Leaf(Duals() as duals):
            return {"leaf": _duals_data(duals, before)}, duals.potentials
        case Fix(duals, child):
            return {"fix": _duals_data(duals, before), "child": child}, duals.potentials
    raise TypeError(f"no tree node: {node!r}")


def _duals_data(duals: Duals, before: Ints) -> dict[str, Any]:
    change = np.asarray(duals.potentials, dtype=np.int64) - before
    data: dict[str, Any] = {"scale": int(duals.scale), "pi": change.tolist()}
    for name, pairs in (("cuts", duals.cuts), ("branches", duals.branches)):
        if pairs:
            data[name] = [int(v) for pair in pairs for v in pair]
    return data


def _node_from(row: Mapping[str, Any], before: Ints) -> tuple[Node, Ints]:
    """The tree node that :func:`_node_data` wrote."""
    if "edge" in row:
        return EdgeBranch(*row["edge"], *row["children"]), before
    if "set" in row:
        return SetBranch(row["set"], *row["children"]), before
    if "fix" not in row and row["leaf"] is None:
        return Leaf(None), before
    duals = _duals_from(row["fix"] if "fix" in row else row["leaf"], before)
    return (Fix(duals, row["child"]) if "fix" in row else Leaf(duals)), duals.potentials


def _duals_from(data: Mapping[str, Any], before: Ints) -> Duals:
    cuts, branches = (
        tuple(zip(values[::2], values[1::2], strict=True))
        for values in (data.get("cuts", []), data.get("branches", []))
    )
    return Duals(data["scale"], np.array(data["pi"], dtype=np.int64) + before, cuts, branches)
