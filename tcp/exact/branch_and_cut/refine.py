"""Duals to the last quantum where the LP's floats miss a bound by a hair.

A leaf whose LP value equals the incumbent, costs of 10^9 quanta, a tiny quantum: the simplex
method's duals are right to some 1e-9 of its unit, which is many quanta.  Their exact residual, the
reduced costs in integers over a finer scale, is a linear programme of the same shape: solved with
the residual magnified to the size of ordinary costs, its duals are the correction (iterative
refinement: Gleixner, Steffy, Wolter 2016, dual part).  Each round gains as many digits as the
first solution had.
"""

from __future__ import annotations

import numpy as np

from tcp.exact.branch_and_cut.cuts import Cut
from tcp.exact.branch_and_cut.proof import Duals, scale_for
from tcp.exact.branch_and_cut.relaxation import Relaxation
from tcp.travel import Ints

ROUNDS = 5
"""Most corrections."""

QUIET = 2
"""A residual of so many scaled quanta is the rounding of the multipliers themselves."""

CLIP = 1e6
"""Largest residual, in units of the noise, that the correction looks at: it is not in the basis."""


def refined(lp: Relaxation, duals: Duals) -> Duals:
    """Duals that fit the LP's basis better; the given ones where nothing can be gained.

    Parameters
    ----------
    lp : Relaxation
        Solved to optimality; its basis is the one to fit.
    duals : Duals
        Of this LP, with a scale > 0.

    Returns
    -------
    Duals
        At the finest scale that their size allows.  Like any multipliers they prove what
        :func:`~tcp.exact.branch_and_cut.proof.verdict` finds, no more.
    """
    used = {cut.key: y for cut, _, y in duals.cuts}
    if any(key not in lp.place for key in used):
        return duals
    y = np.array([used.get(cut.key, 0) for cut in lp.cuts], np.int64)
    sets = np.array([cut.total for cut in lp.cuts], np.int64)
    finest = scale_for(
        lp.problem, duals.pi / duals.scale, np.abs(y) * sets.astype(float) / duals.scale
    )
    factor = max(1, finest // (2 * duals.scale))  # half: the corrected ones may be a little larger
    pi, y, scale = duals.pi * factor, y * factor, duals.scale * factor
    free_sign = np.array([lp.is_equation(cut) for cut in lp.cuts], bool)
    for _ in range(ROUNDS):
        duals = _duals(lp, pi, y, scale)
        residual = duals.prices(lp.problem).of(lp.i, lp.j, lp.cost)
        noise = _noise(lp, residual)
        if noise <= QUIET:
            break
        costs = np.clip(residual / noise, -CLIP, CLIP)
        change = lp.corrections(costs, (y != 0) | free_sign)
        if change is None:
            break
        step = np.rint(change * noise).astype(np.int64)
        pi = pi + step[: len(pi)]
        y = y + step[len(pi) :]
        y = np.where(free_sign, y, np.maximum(y, 0))
    return duals


def _noise(lp: Relaxation, residual: Ints) -> int:
    """The largest reduced cost that should be zero, or of the other sign."""
    basic, free = lp.free_columns()
    wrong = np.where(lp.x > 0.5, residual, -residual)
    wrong = np.where(basic, np.abs(residual), wrong)
    return int(wrong[free].max(initial=0))


def _duals(lp: Relaxation, pi: Ints, y: Ints, scale: int) -> Duals:
    cuts: list[tuple[Cut, int, int]] = []
    for cut, weight in zip(lp.cuts, y.tolist(), strict=True):
        if weight:
            cuts.append((cut, lp.rhs_of(cut), weight))
    return Duals(pi, tuple(cuts), scale)
