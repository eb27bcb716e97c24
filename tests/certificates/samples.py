"""Small random instances of every travel model, kind of ends and rule."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np

from tcp import Ends, Instance, Model, Rules, Travel, Workpiece
from tcp.files.certificate import Certificate, Weighted
from tcp.travel import Rounding

TRAVELS = [
    Travel(),
    Travel(Model.SIMULTANEOUS),
    Travel(vx=Fraction(2), vy=Fraction(3)),
    Travel(Model.SIMULTANEOUS, vx=Fraction(7, 3), quantum=Fraction(1, 4)),
    Travel(quantum=Fraction(3, 2), rounding=Rounding.UP),
    Travel(Model.EUCLIDEAN),
    Travel(Model.EUCLIDEAN, vy=Fraction(2), quantum=Fraction(1), rounding=Rounding.UP),
    Travel(
        Model.TRAPEZOIDAL,
        vx=Fraction(3),
        vy=Fraction(2),
        ax=Fraction(2),
        ay=Fraction(3, 2),
        quantum=Fraction(1, 100),
    ),
    Travel(
        Model.TRAPEZOIDAL,
        ax=Fraction(1, 2),
        ay=Fraction(2),
        axes=Model.SEQUENTIAL,
        quantum=Fraction(1, 8),
        rounding=Rounding.UP,
    ),
    Travel(Model.EXPLICIT),
]


def ends_for(n: int) -> list[Ends]:
    """Every kind of ends that ``n`` holes allow."""
    out, back = (Fraction(1, 2), Fraction(-1, 3)), (Fraction(1, 2), Fraction(3))
    kinds = [
        Ends(),
        Ends(closed=True),
        Ends(closed=True, start=0),
        Ends(start=n - 1),
        Ends(end=0),
        Ends(home=out, outward=True),
        Ends(home=back, back=True),
        Ends(home=back, outward=True, back=True),
    ]
    return kinds + [Ends(start=0, end=n - 1), Ends(home=out, back=True, start=0)] * (n > 1)


def random_instance(rng: np.random.Generator, most: int = 6) -> Instance:
    """An instance of 1 to ``most`` holes on a small grid."""
    n = int(rng.integers(1, most + 1))
    spots = [(str(a), f"{b}.5") for a, b in rng.integers(0, 9, (n, 2)).tolist()]
    piece = Workpiece.from_decimals("random", spots, ids=[f"h{k}" for k in range(n)])
    travel = TRAVELS[rng.integers(len(TRAVELS))]
    kinds = ends_for(n)
    if travel.model is Model.EXPLICIT:
        half = np.triu(rng.integers(0, 30, (n, n)), 1)
        matrix = np.array(half + half.T, dtype=np.int64)
        piece = Workpiece("random", piece.ids, piece.x, piece.y, piece.step, matrix=matrix)
        kinds = [ends for ends in kinds if ends.home is None]
    rules = [Rules(), Rules(), Rules(min_jump=Fraction(int(rng.integers(1, 9)), 2))]
    if n > 2:
        rules += [Rules(forbidden=((0, 1),), together=((2, 1),)), Rules(together=((0, 2),))]
    return Instance(piece, travel, kinds[rng.integers(len(kinds))], rules[rng.integers(len(rules))])


def with_local_cuts(proof: Certificate) -> Certificate:
    """The same proof with every comb as a local cut: all tours of its parts say the same."""
    cuts = (
        Weighted(cut, (1,) * len(cut)) if isinstance(cut, tuple) and len(cut) > 1 else cut
        for cut in proof.cuts
    )
    return replace(proof, cuts=tuple(cuts))
