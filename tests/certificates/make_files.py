"""Write the files in ``correct/``, ``incorrect/`` and ``malformed/``.

Run as ``python -m tests.certificates.make_files``.

Each wrong file is a correct one with one field changed; its name says which.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np

from tcp import Ends, Instance, Model, Rules, Travel, Workpiece
from tcp.files.certificate import Certificate, Duals, Leaf, to_text
from tests.certificates.mutations import Data, absolute, relative
from tests.certificates.samples import random_instance, with_local_cuts
from tests.certificates.tiny_prover import prove

FOLDER = Path(__file__).parent
FIVE = Workpiece.from_decimals("five", [("1", "2"), ("3", "1"), ("5", "2"), ("3", "3"), ("1", "4")])


def five() -> Certificate:
    """The worked example of docs/certificate.md."""
    pi = np.array([2, 1, 2, 1, 2, -2], dtype=np.int64)
    return Certificate.for_instance(
        Instance(FIVE), lower=10, route=(4, 0, 1, 3, 2), tree=[Leaf(Duals(1, pi))]
    )


def found(wanted: Callable[[Certificate], bool], most: int = 6) -> Certificate:
    """The first random proof of the shape wanted."""
    for seed in range(2_000):
        rng = np.random.default_rng(seed)
        proof = prove(random_instance(rng, most), seed=seed, keep=0.3, fixing=bool(seed % 2))
        if wanted(proof):
            return proof
    raise LookupError("no such proof")


def kinds_in(proof: Certificate) -> set[str]:
    return {type(node).__name__ for node in proof.tree}


def correct() -> dict[str, Certificate]:
    """Proofs of every shape, by file name."""
    home = (Fraction(1, 2), Fraction(-1, 3))
    ramp = Travel(Model.TRAPEZOIDAL, Fraction(3), Fraction(2), Fraction(2), Fraction(3, 2))
    near = Rules(min_jump=Fraction(3, 2))
    vectors = lambda p: [n.duals for n in p.tree if getattr(n, "duals", None)]  # noqa: E731
    return {
        "five": five(),
        "five-euclidean": prove(Instance(FIVE, Travel(Model.EUCLIDEAN))),
        "five-trapezoidal-home": prove(Instance(FIVE, ramp, Ends(home=home, outward=True))),
        "five-closed": prove(Instance(FIVE, Travel(Model.SIMULTANEOUS), Ends(closed=True))),
        "five-start-end-rules": prove(Instance(FIVE, ends=Ends(start=1, end=2), rules=near)),
        "five-bound": prove(Instance(FIVE), lower=9),
        "one-hole": prove(Instance(Workpiece.from_decimals("one", [("1", "1")]))),
        "matrix": found(lambda p: "matrix" in p.instance and len(p.instance["ids"]) > 3),
        "edge-branch": found(lambda p: "EdgeBranch" in kinds_in(p)),
        "set-branch": found(lambda p: any(d.branches for d in vectors(p))),
        "fix": found(lambda p: {"Fix", "EdgeBranch"} <= kinds_in(p)),
        "comb": found(lambda p: any(len(cut) > 1 for cut in p.cuts)),
        "local": with_local_cuts(found(lambda p: any(len(cut) > 1 for cut in p.cuts))),
        "infeasible": found(lambda p: p.lower is None and len(p.instance["ids"]) > 2),
    }


def put(*path: str | int, value: object) -> Callable[[Data], None]:
    """Set one field."""

    def change(data: Data) -> None:
        *way, last = path
        for key in way:
            data = data[key]
        data[last] = value

    return change


def drop(*path: str | int) -> Callable[[Data], None]:
    """Remove one field."""

    def change(data: Data) -> None:
        *way, last = path
        for key in way:
            data = data[key]
        del data[last]

    return change


def lost_leaf(data: Data) -> None:
    tree = absolute(data)
    at = next(k for k, n in enumerate(tree) if "children" in n)
    tree[at] = tree[tree[at]["children"][1]]
    data["tree"] = relative(tree)


def branch(data: Data) -> Data:
    return next(node for node in data["tree"] if "children" in node)


def half_seconds(data: Data) -> None:
    data["instance"] |= {"travel": {"model": "explicit", "rounding": "up"}, "quantum": "1/2"}


def no_potentials(data: Data) -> None:
    leaf = data["tree"][-1]["leaf"]
    leaf["pi"] = [0] * len(leaf["pi"])


def boast(data: Data) -> None:
    data["claim"] = {"lower": 11}
    del data["route"]


def comb_of(data: Data) -> list[int]:
    return next(cut for cut in data["cuts"] if len(cut) > 1)


def combed(change: Callable[[list[int], Data], None]) -> Callable[[Data], None]:
    return lambda data: change(comb_of(data), data)


def local_of(data: Data) -> Data:
    return next(cut for cut in data["cuts"] if type(cut) is dict)


def set_twice(data: Data) -> None:
    sets = local_of(data)["sets"]
    sets[0] = sets[1]


def tooth_lost(data: Data) -> None:
    for field in ("sets", "weights"):
        local_of(data)[field].pop()


def negative_cut(data: Data) -> None:
    vector = next(n["leaf"] for n in data["tree"] if n.get("leaf") and "cuts" in n["leaf"])
    vector["cuts"][1] *= -1


def branch_from_nowhere(data: Data) -> None:
    data["sets"] = [[0, 1]]
    data["tree"][0]["leaf"]["branches"] = [0, 1]


def without_hash(key: str, value: object) -> Callable[[Data], None]:
    return put("instance", key, value=value)


INCORRECT: dict[str, tuple[str, Callable[[Data], None]]] = {
    "dual-lower-by-one": ("five", put("tree", 0, "leaf", "pi", 0, value=1)),
    "virtual-potential": ("five", put("tree", 0, "leaf", "pi", 5, value=-1)),
    "scale-up": ("five", put("tree", 0, "leaf", "scale", value=2)),
    "claim-above-optimum": ("five", boast),
    "lower-above-route": ("five", put("claim", "lower", value=11)),
    "upper-by-one": ("five", put("claim", "upper", value=11)),
    "infeasible-but-not": (
        "five",
        lambda d: (put("claim", value={"infeasible": True})(d), d.pop("route")),
    ),
    "route-hole-twice": ("five", put("route", 0, value=2)),
    "route-other-end": ("five-start-end-rules", lambda d: d["route"].reverse()),
    "coordinate": ("five", put("instance", "x", 0, value=2)),
    "step": ("five-euclidean", without_hash("step", "2")),
    "travel": ("five", put("instance", "travel", "model", value="simultaneous")),
    "ends": ("five", put("instance", "ends", "start", value="1")),
    "rules": ("five", put("instance", "rules", "forbidden", value=[["1", "2"]])),
    "hole-id": ("five", put("instance", "ids", 0, value="one")),
    "sha": ("five", without_hash("sha256", "0" * 64)),
    "matrix-entry": ("matrix", put("instance", "matrix", 1, 0, value=999)),
    "leaf-without-duals": ("five", put("tree", 0, "leaf", value=None)),
    "lost-leaf": ("edge-branch", lost_leaf),
    "negative-multiplier": ("set-branch", negative_cut),
    "branch-from-nowhere": ("five", branch_from_nowhere),
    "comb-two-teeth": ("comb", combed(lambda cut, d: cut.pop())),
    "comb-tooth-twice": ("comb", combed(lambda cut, d: cut.__setitem__(1, cut[2]))),
    "comb-handle-as-tooth": ("comb", combed(lambda cut, d: cut.__setitem__(1, cut[0]))),
    "local-without-a-tooth": ("local", tooth_lost),
    "set-of-all": ("comb", lambda d: d["sets"].append([0, len(d["instance"]["ids"])])),
    "farkas-too-weak": ("infeasible", no_potentials),
}  # fmt: skip

MALFORMED: dict[str, tuple[str, Callable[[Data], None]]] = {
    "no-format": ("five", drop("format")),
    "no-instance": ("five", drop("instance")),
    "no-tree": ("five", drop("tree")),
    "empty-tree": ("five", put("tree", value=[])),
    "unknown-field": ("five", put("comment", value="hello")),
    "float-dual": ("five", put("tree", 0, "leaf", "pi", 0, value=2.0)),
    "nan-dual": ("five", put("tree", 0, "leaf", "pi", 0, value=float("nan"))),
    "boolean-dual": ("five", put("tree", 0, "leaf", "pi", 0, value=True)),
    "text-dual": ("five", put("tree", 0, "leaf", "pi", 0, value="2")),
    "huge-dual": ("five", put("tree", 0, "leaf", "pi", 0, value=2**61)),
    "huge-scale": ("five", put("tree", 0, "leaf", "scale", value=10**30)),
    "negative-scale": ("five", put("tree", 0, "leaf", "scale", value=-1)),
    "too-few-duals": ("five", drop("tree", 0, "leaf", "pi", 5)),
    "cut-that-is-not-there": ("five", put("tree", 0, "leaf", "cuts", value=[0, 1])),
    "no-claim": ("five", put("claim", value={})),
    "two-claims": ("five", put("claim", "infeasible", value=True)),
    "route-without-upper": ("five", drop("claim", "upper")),
    "upper-without-route": ("five", drop("route")),
    "no-holes": ("five", lambda d: [put("instance", k, value=[])(d) for k in ("ids", "x", "y")]),
    "ids-twice": ("five", put("instance", "ids", 0, value="2")),
    "too-few-coordinates": ("five", drop("instance", "x", 0)),
    "coordinate-2-to-60": ("five", put("instance", "x", 0, value=2**60)),
    "speed-zero": ("five", put("instance", "travel", "vx", value="0")),
    "speed-as-number": ("five", put("instance", "travel", "vx", value=1)),
    "matrix-in-half-seconds": ("matrix", half_seconds),
    "step-with-exponent": ("five", put("instance", "step", value="1e5000")),
    "step-with-endless-exponent": ("five", put("instance", "step", value="1e99999999")),
    "step-as-list": ("five", put("instance", "step", value=["1"])),
    "step-not-reduced": ("five", put("instance", "step", value="2/2")),
    "node-of-two-kinds": ("five", put("tree", 0, "fix", value=None)),
    "swapped-children": ("edge-branch", lambda d: branch(d)["children"].reverse()),
    "shared-child": ("edge-branch", lambda d: branch(d)["children"].__setitem__(1, 1)),
    "loop": ("edge-branch", lambda d: branch(d)["children"].__setitem__(0, 0)),
    "dropped-leaf": ("edge-branch", lambda d: d["tree"].pop()),
    "duplicated-leaf": ("edge-branch", lambda d: d["tree"].append(d["tree"][-1])),
    "edge-to-itself": ("edge-branch", lambda d: branch(d).update(edge=[1, 1])),
    "local-in-version-1": ("local", put("version", value=1)),
    "local-weight-zero": ("local", lambda d: local_of(d)["weights"].__setitem__(0, 0)),
    "local-weight-missing": ("local", lambda d: local_of(d)["weights"].pop()),
    "local-set-twice": ("local", set_twice),
    "local-with-rhs": ("local", lambda d: local_of(d).update(rhs=100)),
    "set-not-ascending": ("comb", put("sets", 0, value=[2, 1])),
    "set-with-node-99": ("comb", put("sets", 0, value=[0, 99])),
}  # fmt: skip


def main() -> None:
    """Write all files."""
    good = {name: to_text(proof) for name, proof in correct().items()}
    for folder, changes in (("incorrect", INCORRECT), ("malformed", MALFORMED)):
        (FOLDER / folder).mkdir(exist_ok=True)
        for name, (base, change) in changes.items():
            data = json.loads(good[base])
            change(data)
            (FOLDER / folder / f"{name}.json").write_text(json.dumps(data) + "\n")
    (FOLDER / "correct").mkdir(exist_ok=True)
    for name, text in good.items():
        (FOLDER / "correct" / f"{name}.json").write_text(text)
    five_text = good["five"]
    (FOLDER / "malformed" / "not-json.json").write_text("Verified.\n")
    (FOLDER / "malformed" / "cut-off.json").write_text(five_text[:-20])
    twice = five_text.replace('"claim":', '"claim":{"lower":3},"claim":')
    (FOLDER / "malformed" / "claim-twice.json").write_text(twice)


if __name__ == "__main__":
    main()
