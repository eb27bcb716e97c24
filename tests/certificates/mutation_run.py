"""Run mutations against the checker and judge every acceptance; used by CI and by a benchmark."""

from __future__ import annotations

import contextlib
import json
from collections import Counter
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

import tcp.validate.certificate as checker
from tcp.files.certificate import to_text
from tests.certificates.mutations import Inapplicable, instance_of, kinds, mutate, optimum
from tests.certificates.samples import random_instance, with_local_cuts
from tests.certificates.tiny_prover import prove

Truths = int | None | Literal["ask"]


@dataclass
class Tally:
    """What happened to the mutations, by kind."""

    tried: Counter[str] = field(default_factory=Counter)
    refused: Counter[str] = field(default_factory=Counter)
    accepted: Counter[str] = field(default_factory=Counter)
    false: list[str] = field(default_factory=list)

    def add(self, kind: str, text: str, truth: Truths) -> None:
        """Check one mutated text; ``truth`` is the optimum, or "ask" to find it."""
        self.tried[kind] += 1
        try:
            verdict = checker.check(text.encode(errors="surrogatepass"))
        except checker.Failure:
            self.refused[kind] += 1
            return
        self.accepted[kind] += 1
        best = optimum(instance_of(json.loads(text)["instance"])) if truth == "ask" else truth
        low, high = verdict.lower, verdict.upper
        true = best is None if low is None else best is None or low <= best
        if not true or (high is not None and (best is None or high < best)):
            self.false.append(f"{kind}: claims {low} .. {high}, the optimum is {best}\n{text}")


SHAPES = ("EdgeBranch", "SetBranch", "Fix", "comb", "infeasible", "branch multiplier")


def bases(count: int, seed: int = 0) -> list[str]:
    """True certificates to mutate: ``count`` for each shape, and as many of any shape."""
    texts: list[str] = []
    shapes: Counter[str] = Counter()
    while any(shapes[s] < count for s in SHAPES) or len(texts) < 2 * count * len(SHAPES):
        seed += 1
        rng = np.random.default_rng(seed)
        instance = random_instance(rng, most=5 if seed % 3 else 6)
        keep = rng.choice([0.0, 0.3, 1.0])
        proof = prove(instance, seed=seed, fixing=bool(rng.integers(2)), keep=keep)
        vectors = [node.duals for node in proof.tree if getattr(node, "duals", None)]
        shape = {type(node).__name__ for node in proof.tree}
        shape |= {"comb"} if any(len(cut) > 1 for cut in proof.cuts) else set()
        shape |= {"branch multiplier"} if any(d.branches for d in vectors) else set()
        shape |= {"infeasible"} if proof.lower is None else set()
        if any(shapes[s] < count for s in shape if s in SHAPES) or seed % 4 == 0:
            shapes.update(shape)
            texts.append(to_text(proof))
            if "comb" in shape:
                texts.append(to_text(with_local_cuts(proof)))
    return texts


def lies(texts: list[str]) -> list[str]:
    """The certificates with their claims one granule too high (or infeasible, which is worse)."""
    found = []
    for text in texts:
        data = json.loads(text)
        if "lower" not in data["claim"]:
            continue
        g = instance_of(data["instance"]).granularity
        data["claim"] = {"lower": data["claim"]["lower"] + g}
        if len(found) % 5 == 0:
            data["claim"] = {"infeasible": True}
        data.pop("route", None)
        found.append(json.dumps(data))
    return found


def run(total: int, seed: int, texts: list[str], truth: Truths = "ask") -> Tally:
    """``total`` mutations of the given certificates, spread evenly over all kinds.

    Where a ``truth`` is given, only mutations that leave the instance as it is.
    """
    rng, tally = np.random.default_rng(seed), Tally()
    names = [name for name in kinds() if truth == "ask" or "new hash" not in name]
    k = 0
    while sum(tally.tried.values()) < total and k < 100 * total:
        kind, k = names[k % len(names)], k + 1
        for at in rng.permutation(len(texts)).tolist():
            try:
                changed = mutate(texts[at], kind, rng)
            except Inapplicable:
                continue
            if rng.integers(4) == 0:  # now and then two at once, where the first left a file
                with contextlib.suppress(Exception):
                    changed = mutate(changed, names[int(rng.integers(len(names)))], rng)
            tally.add(kind, changed, truth)
            break
    return tally
