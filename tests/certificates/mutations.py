"""Certificates changed by the smallest amount, and the truth to hold the checker's verdict against.

A mutation changes one field of a certificate's JSON (or its text).  Changes of the instance come in
two kinds: with the old hash, which the checker must notice, and with the right new hash, so that
the mutated proof reaches the arithmetic.  Whatever the checker accepts must be true: for small
instances the truth is found by trying every order of the instance that the *mutated* file states.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np

from tcp import Ends, Instance, Model, Rules, Travel, Workpiece
from tcp.errors import TcpError
from tcp.travel import Rounding
from tcp.validate.certificate import Failure

Data = dict[str, Any]
Rng = np.random.Generator


class Inapplicable(Exception):
    """The certificate has no field of this kind."""


# --- the truth -------------------------------------------------------------------------


def instance_of(data: Data) -> Instance:
    """The instance that a certificate states, built by the package itself."""
    ids = data["ids"]
    at = {name: k for k, name in enumerate(ids)}
    x, y = (np.array(data[axis], dtype=np.int64) for axis in "xy")
    matrix = None
    if "matrix" in data:
        matrix = np.zeros((len(ids), len(ids)), dtype=np.int64)
        for i, row in enumerate(data["matrix"]):
            matrix[i, : i + 1] = matrix[: i + 1, i] = row
    piece = Workpiece(data["name"], tuple(ids), x, y, Fraction(data["step"]), matrix=matrix)
    said = dict(data["travel"])
    model, rounding = Model(said.pop("model")), said.pop("rounding", None)
    axes = {"axes": Model(said.pop("axes"))} if "axes" in said else {}
    quantum = None if rounding is None else Fraction(data["quantum"])
    speeds = {key: Fraction(value) for key, value in said.items()}
    travel = Travel(
        model, **speeds, **axes, quantum=quantum, rounding=Rounding(rounding or "nearest")
    )
    e, r = data["ends"], data["rules"]
    ends = Ends(
        start=at[e["start"]] if "start" in e else None,
        end=at[e["end"]] if "end" in e else None,
        home=(Fraction(e["home"][0]), Fraction(e["home"][1])) if "home" in e else None,
        outward=e.get("outward", False),
        back=e.get("return", False),
        closed=e.get("closed", False),
    )
    rules = Rules(
        forbidden=tuple((at[p], at[q]) for p, q in r.get("forbidden", [])),
        together=tuple((at[p], at[q]) for p, q in r.get("together", [])),
        min_jump=Fraction(r["min_jump"]) if "min_jump" in r else None,
    )
    return Instance(piece, travel, ends, rules)


def optimum(instance: Instance) -> int | None:
    """The cheapest of all tours with the forced and without the forbidden edges."""
    form = instance.form
    rest = np.array(list(itertools.permutations(range(1, form.size))), dtype=np.int64)
    tours = np.hstack([np.zeros((len(rest), 1), dtype=np.int64), rest.reshape(len(rest), -1)])
    after = np.roll(tours, -1, axis=1)
    keys = np.minimum(tours, after) * form.size + np.maximum(tours, after)
    good = np.ones(len(tours), dtype=bool)
    for i, j in form.forced:
        good &= (keys == i * form.size + j).any(axis=1)
    for i, j in form.forbidden:
        good &= (keys != i * form.size + j).all(axis=1)
    costs = form.full_matrix()[tours, after].sum(axis=1)[good]
    return int(costs.min()) if len(costs) else None


def rehash(data: Data) -> None:
    """Give a changed instance its right hash, and the quantum that exact travel derives."""
    try:
        instance = instance_of(data["instance"])
        data["instance"]["quantum"] = str(instance.quantum)
        data["instance"]["sha256"] = instance.sha256
    except (TcpError, Failure, ValueError, KeyError, TypeError, OverflowError):
        pass  # no instance at all: the checker has to find out


# --- the mutations ---------------------------------------------------------------------


def pick(rng: Rng, items: list[Any]) -> Any:
    """One of ``items``."""
    if not items:
        raise Inapplicable
    return items[int(rng.integers(len(items)))]


def bump(rng: Rng, values: list[int], amount: int = 1, start: int = 0, step: int = 1) -> None:
    """Change one number of a list by ``amount``, up or down."""
    at = pick(rng, list(range(start, len(values), step)))
    values[at] += amount if rng.integers(2) else -amount


def duals(data: Data, key: str = "pi") -> list[Data]:
    """All dual vectors that have the field."""
    found = [node.get("leaf") or node.get("fix") for node in data["tree"]]
    return [d for d in found if d and key in d]


def potential(data: Data, rng: Rng) -> None:
    bump(rng, pick(rng, duals(data))["pi"])


def cut_multiplier(data: Data, rng: Rng) -> None:
    bump(rng, pick(rng, duals(data, "cuts"))["cuts"], start=1, step=2)


def branch_multiplier(data: Data, rng: Rng) -> None:
    bump(rng, pick(rng, duals(data, "branches"))["branches"], start=1, step=2)


def negative_multiplier(data: Data, rng: Rng) -> None:
    field = pick(rng, ["cuts", "branches"])
    values = pick(rng, duals(data, field))[field]
    at = pick(rng, list(range(1, len(values), 2)))
    values[at] = -values[at]


def other_cut(data: Data, rng: Rng) -> None:
    bump(rng, pick(rng, duals(data, "cuts"))["cuts"], step=2)


def other_set(data: Data, rng: Rng) -> None:
    bump(rng, pick(rng, duals(data, "branches"))["branches"], step=2)


def scale(data: Data, rng: Rng) -> None:
    d = pick(rng, duals(data))
    d["scale"] += int(pick(rng, [-1, 1, 1000, -d["scale"]]))


def set_by_a_hole(data: Data, rng: Rng) -> None:
    bump(rng, pick(rng, data["sets"]))


def set_without_a_run(data: Data, rng: Rng) -> None:
    runs = pick(rng, data["sets"])
    at = 2 * int(rng.integers(len(runs) // 2))
    del runs[at : at + 2]


def templates(data: Data, several: bool) -> list[list[int]]:
    """The combs, or the subtour cuts."""
    listed = [cut for cut in data["cuts"] if type(cut) is list]
    return [cut for cut in listed if (len(cut) > 1) == several]


def local(data: Data) -> list[Data]:
    return [cut for cut in data["cuts"] if type(cut) is dict]


def tooth(data: Data, rng: Rng) -> None:
    comb = pick(rng, templates(data, several=True))
    comb[int(rng.integers(len(comb)))] = int(rng.integers(len(data["sets"])))


def teeth_count(data: Data, rng: Rng) -> None:
    comb = pick(rng, templates(data, several=True))
    at = int(rng.integers(len(comb)))
    comb[at : at + 1] = [] if rng.integers(2) else [comb[at], comb[at]]


def handle_and_tooth(data: Data, rng: Rng) -> None:
    comb = pick(rng, templates(data, several=True))
    comb[0], comb[1] = comb[1], comb[0]


def subtour_to_comb(data: Data, rng: Rng) -> None:
    some = rng.integers(len(data["sets"]) or 1, size=3).tolist()
    pick(rng, templates(data, several=False)).extend(some)


def local_weight(data: Data, rng: Rng) -> None:
    bump(rng, pick(rng, local(data))["weights"])


def local_set(data: Data, rng: Rng) -> None:
    bump(rng, pick(rng, local(data))["sets"])


def local_with_fewer_sets(data: Data, rng: Rng) -> None:
    cut = pick(rng, local(data))
    at = int(rng.integers(len(cut["sets"])))
    for field in ("sets", "weights") if rng.integers(8) else ("weights",):
        del cut[field][at]


def local_in_version_1(data: Data, rng: Rng) -> None:
    pick(rng, local(data))
    data["version"] = 1


def branch_edge(data: Data, rng: Rng) -> None:
    bump(rng, pick(rng, [n for n in data["tree"] if "edge" in n])["edge"])


def branch_set(data: Data, rng: Rng) -> None:
    node = pick(rng, [n for n in data["tree"] if "set" in n])
    node["set"] += 1 if rng.integers(2) else -1


def branch_kind(data: Data, rng: Rng) -> None:
    node = pick(rng, [n for n in data["tree"] if "children" in n])
    if "edge" in node:
        node["set"] = int(rng.integers(len(data["sets"]) or 1))
        del node["edge"]
    else:
        node["edge"] = [0, 1]
        del node["set"]


def swapped_children(data: Data, rng: Rng) -> None:
    pick(rng, [n for n in data["tree"] if "children" in n])["children"].reverse()


def child_index(data: Data, rng: Rng) -> None:
    bump(rng, pick(rng, [n for n in data["tree"] if "children" in n])["children"])


def swapped_subtrees(data: Data, rng: Rng) -> None:
    """The two children change places, indices and differences kept right."""
    tree = absolute(data)
    at = pick(rng, [k for k, n in enumerate(tree) if "children" in n])
    tree[at]["children"].reverse()
    data["tree"] = relative(tree)


def dropped_leaf(data: Data, rng: Rng) -> None:
    """One side of a branch is forgotten, as if the branch had not been there."""
    tree = absolute(data)
    at = pick(rng, [k for k, n in enumerate(tree) if "children" in n])
    kept = tree[pick(rng, tree[at]["children"])]
    tree[at] = kept
    data["tree"] = relative(tree)


def removed_node(data: Data, rng: Rng) -> None:
    del data["tree"][int(rng.integers(len(data["tree"])))]


def duplicated_node(data: Data, rng: Rng) -> None:
    at = int(rng.integers(len(data["tree"])))
    data["tree"].insert(at, json.loads(json.dumps(data["tree"][at])))


def shared_child(data: Data, rng: Rng) -> None:
    node = pick(rng, [n for n in data["tree"] if "children" in n])
    node["children"][1] = node["children"][0]


def loop(data: Data, rng: Rng) -> None:
    node = pick(rng, [n for n in data["tree"] if "children" in n or "child" in n])
    if "child" in node:
        node["child"] = 0
    else:
        node["children"][int(rng.integers(2))] = 0


def leaf_without_duals(data: Data, rng: Rng) -> None:
    pick(rng, [n for n in data["tree"] if "leaf" in n])["leaf"] = None


def fix_and_leaf(data: Data, rng: Rng) -> None:
    node = pick(rng, [n for n in data["tree"] if "fix" in n])
    node["leaf"] = node.pop("fix")
    del node["child"]
    data["tree"] = data["tree"][: data["tree"].index(node) + 1]


def claim_by_one(data: Data, rng: Rng) -> None:
    field = pick(rng, [f for f in ("lower", "upper") if f in data["claim"]])
    data["claim"][field] += 1 if rng.integers(2) else -1


def claim_by_g(data: Data, rng: Rng) -> None:
    if "lower" not in data["claim"]:
        raise Inapplicable
    data["claim"]["lower"] += instance_of(data["instance"]).granularity
    data["claim"].pop("upper", None)
    data.pop("route", None)


def claim_infeasible(data: Data, rng: Rng) -> None:
    if "lower" not in data["claim"]:
        data["claim"] = {"lower": 10**6}
        return
    data["claim"] = {"infeasible": True}
    data.pop("route", None)


def claim_without_route(data: Data, rng: Rng) -> None:
    data["claim"].pop("upper", None)
    if rng.integers(2):
        data.pop("route", None)


def route(data: Data, rng: Rng) -> None:
    order = data.get("route")
    if not order or len(order) < 2:
        raise Inapplicable
    i, j = rng.choice(len(order), 2, replace=False)
    choice = int(rng.integers(5))
    if choice == 0:
        order[i], order[j] = order[j], order[i]
    elif choice == 1:
        order[i] = order[j]
    elif choice == 2:
        order.reverse()
    elif choice == 3:
        order.pop(i)
    else:
        order[i] += 1 if rng.integers(2) else -1


def coordinate(data: Data, rng: Rng) -> None:
    bump(rng, data["instance"][pick(rng, ["x", "y"])])


def hole_id(data: Data, rng: Rng) -> None:
    ids = data["instance"]["ids"]
    ids[int(rng.integers(len(ids)))] += "'"


def hole_order(data: Data, rng: Rng) -> None:
    for key in ("ids", "x", "y"):
        data["instance"][key].reverse()


def matrix_entry(data: Data, rng: Rng) -> None:
    bump(rng, pick(rng, data["instance"].get("matrix", [])))


def travel(data: Data, rng: Rng) -> None:
    said = data["instance"]["travel"]
    key = pick(rng, sorted(said))
    if key == "model":
        said[key] = pick(rng, ["sequential", "simultaneous"])
    elif key in ("axes", "rounding"):
        other = {"nearest": "up", "up": "nearest", "sequential": "simultaneous"}
        said[key] = other.get(said[key], "sequential")
    else:
        said[key] = str(Fraction(said[key]) + Fraction(1, int(rng.integers(1, 9))))


def grid(data: Data, rng: Rng) -> None:
    key = pick(rng, ["step", "quantum"])
    value = Fraction(data["instance"][key]) + Fraction(1, int(rng.integers(1, 9)))
    data["instance"][key] = str(value)


def ends(data: Data, rng: Rng) -> None:
    said, ids = data["instance"]["ends"], data["instance"]["ids"]
    choice = int(rng.integers(6))
    if choice == 0:
        said["closed"] = not said.pop("closed", False)
    elif choice in (1, 2):
        said[("start", "end")[choice - 1]] = pick(rng, ids)
    elif choice == 3:
        said.pop(pick(rng, sorted(said)))
    elif choice == 4:
        said["outward"] = not said.get("outward", False)
    else:
        home = said.get("home") or pick(rng, [])
        home[0] = str(Fraction(home[0]) + Fraction(1, 7))


def rules(data: Data, rng: Rng) -> None:
    said, ids = data["instance"]["rules"], data["instance"]["ids"]
    if said and rng.integers(2):
        said.pop(pick(rng, sorted(said)))
        return
    pair = rng.choice(len(ids), 2).tolist()
    said.setdefault(pick(rng, ["forbidden", "together"]), []).append([ids[k] for k in pair])


def sha(data: Data, rng: Rng) -> None:
    text = data["instance"]["sha256"]
    at = int(rng.integers(len(text)))
    data["instance"]["sha256"] = text[:at] + ("0" if text[at] != "0" else "1") + text[at + 1 :]


def version(data: Data, rng: Rng) -> None:
    data["version"] = pick(rng, [0, 2, "1", 1.0, True, None, 10**30])


def places(value: Any, found: list[tuple[Any, Any]]) -> list[tuple[Any, Any]]:
    """(container, key) of every value in a JSON tree."""
    items = value.items() if type(value) is dict else enumerate(value)
    for key, inner in items:
        found.append((value, key))
        if type(inner) in (dict, list):
            places(inner, found)
    return found


def any_number(data: Data, rng: Rng) -> None:
    at = pick(rng, [(c, k) for c, k in places(data, []) if type(c[k]) is int])
    at[0][at[1]] += 1 if rng.integers(2) else -1


def huge_number(data: Data, rng: Rng) -> None:
    container, key = pick(rng, [(c, k) for c, k in places(data, []) if type(c[k]) is int])
    container[key] = pick(
        rng, [2**61, 2**61 - 1, -(2**61) + 1, 2**63, -(2**63), 2**64 + 1, 10**400]
    )


def wrong_type(data: Data, rng: Rng) -> None:
    container, key = pick(rng, places(data, []))
    odd = [None, True, 0.5, float("nan"), float("inf"), "1", "", [], {}, [[0]], 1.0]
    container[key] = pick(rng, odd)


def lost_key(data: Data, rng: Rng) -> None:
    container, key = pick(rng, [(c, k) for c, k in places(data, []) if type(c) is dict])
    del container[key]


def new_key(data: Data, rng: Rng) -> None:
    container, _ = pick(rng, [(c, k) for c, k in places(data, []) if type(c) is dict])
    container["note"] = 1


ON_INSTANCE = [coordinate, hole_id, hole_order, matrix_entry, travel, grid, ends, rules]
ON_PROOF = [
    potential, cut_multiplier, branch_multiplier, negative_multiplier, other_cut, other_set, scale,
    set_by_a_hole, set_without_a_run, tooth, teeth_count, handle_and_tooth, subtour_to_comb,
    local_weight, local_set, local_with_fewer_sets, local_in_version_1,
    branch_edge, branch_set, branch_kind, swapped_children, child_index, swapped_subtrees,
    dropped_leaf, removed_node, duplicated_node, shared_child, loop, leaf_without_duals,
    fix_and_leaf, claim_by_one, claim_by_g, claim_infeasible, claim_without_route, route, sha,
    version, any_number, huge_number, wrong_type, lost_key, new_key,
]  # fmt: skip


def digit(text: str, rng: Rng) -> str:
    at = pick(rng, [k for k, c in enumerate(text) if c.isdigit()])
    return text[:at] + str((int(text[at]) + 1) % 10) + text[at + 1 :]


def cut_off(text: str, rng: Rng) -> str:
    return text[: int(rng.integers(len(text) - 1))]


def any_character(text: str, rng: Rng) -> str:
    at = int(rng.integers(len(text)))
    return text[:at] + pick(rng, list('{}[],:"-.e0 ')) + text[at + 1 :]


def key_twice(text: str, rng: Rng) -> str:
    key = pick(rng, ["claim", "format", "sets"])
    return text.replace(
        f'"{key}"', f'"{key}": {json.loads(text)[key]!r}, "{key}"'.replace("'", '"'), 1
    )


ON_TEXT: list[Callable[[str, Rng], str]] = [digit, cut_off, any_character, key_twice]


def kinds() -> list[str]:
    """Names of all mutations; those of the instance come with the old and with the new hash."""
    old = [f.__name__ for f in ON_INSTANCE]
    return [f.__name__ for f in ON_PROOF + ON_TEXT] + old + [f"{name}, new hash" for name in old]


def mutate(text: str, kind: str, rng: Rng) -> str:
    """The certificate after one mutation; raises Inapplicable where there is nothing to change."""
    name, _, new_hash = kind.partition(", ")
    change = globals()[name]
    if change in ON_TEXT:
        return change(text, rng)
    data = json.loads(text)
    change(data, rng)
    if new_hash:
        rehash(data)
    return json.dumps(data)


# --- trees with absolute potentials, for mutations that move nodes ---------------------


def absolute(data: Data) -> list[Data]:
    """The tree with each potential written out."""
    before: list[int] = []
    for vector in duals(data):
        vector["pi"] = [
            a + b for a, b in zip(vector["pi"], before or [0] * len(vector["pi"]), strict=True)
        ]
        before = vector["pi"]
    return data["tree"]


def relative(tree: list[Data]) -> list[Data]:
    """The reachable nodes in preorder, indices and differences as the format wants them."""
    order, stack = [], [(0, None, None)]
    while stack:
        at, parent, slot = stack.pop()
        if len(order) > 4 * len(tree):
            raise Inapplicable  # an earlier mutation has made a loop
        node = json.loads(json.dumps(tree[at]))
        if parent is not None:
            container, key = (parent, "child") if slot is None else (parent["children"], slot)
            container[key] = len(order)
        order.append(node)
        if "children" in node:
            stack += [(node["children"][1], node, 1), (node["children"][0], node, 0)]
        elif "child" in node:
            stack.append((node["child"], node, None))
    before: list[int] = []
    for vector in duals({"tree": order}):
        now = vector["pi"]
        vector["pi"] = [a - b for a, b in zip(now, before or [0] * len(now), strict=True)]
        before = now
    return order
