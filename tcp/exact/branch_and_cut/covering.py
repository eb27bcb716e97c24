"""Covering: the least of c w with A w >= 1 and w >= 0, its rows told a few at a time.

The dual simplex method on a dense dictionary, every basic variable as a sum of
the nonbasic ones.  It is for hundreds of columns and a few dozen rows: what a
keyhole needs, where a general solver spends its time on preparing to solve.
Values are floats and prove nothing.

A dictionary has one row for each basic variable and one, the last, for the
objective; its columns are the nonbasic variables, and the last the constants.
``basic`` and ``nonbasic`` name the variables: a column of A by its number, the
surplus of a row by -1.
"""

from __future__ import annotations

import numpy as np

from tcp.exact.branch_and_cut.proof import Floats
from tcp.jit import allocating
from tcp.travel import Ints

TINY = 1e-9
"""Values up to this are zero."""

PIVOTS = 2_000
"""Most pivots after rows were added."""


@allocating
def opened(cost: Floats) -> Floats:
    """The dictionary without rows: all columns are nonbasic."""
    dictionary = np.zeros((1, len(cost) + 1))
    for j in range(len(cost)):
        dictionary[0, j] = cost[j]
    return dictionary


@allocating
def extended(dictionary: Floats, basic: Ints, nonbasic: Ints, fresh: Floats) -> tuple[Floats, Ints]:
    """The dictionary and its basic variables with the rows ``fresh`` of A more.

    Rows that are not tight are left out: they come back if they are needed.
    """
    width, old = dictionary.shape[1], len(basic)
    tight = 0
    for k in range(old):
        if basic[k] >= 0 or dictionary[k, width - 1] <= TINY:
            tight += 1
    size = tight + len(fresh)
    longer = np.zeros((size + 1, width))
    names, row_of = np.empty(size, np.int64), np.empty(width, np.int64)
    for k in range(size):
        names[k] = -1
    for v in range(width):
        row_of[v] = -1
    at = 0
    for k in range(old + 1):
        if k == old or basic[k] >= 0 or dictionary[k, width - 1] <= TINY:
            to = size if k == old else at
            for j in range(width):
                longer[to, j] = dictionary[k, j]
            if k < old:
                names[at] = basic[k]
                if basic[k] >= 0:
                    row_of[basic[k]] = at
                at += 1
    for f in range(len(fresh)):
        k = tight + f
        longer[k, width - 1] = -1.0
        for j in range(width - 1):
            if nonbasic[j] >= 0:
                longer[k, j] += fresh[f, nonbasic[j]]
        for v in range(width - 1):
            share = fresh[f, v]
            if row_of[v] >= 0 and share != 0.0:
                for j in range(width):
                    longer[k, j] += share * longer[row_of[v], j]
    return longer, names


@allocating
def minimised(dictionary: Floats, basic: Ints, nonbasic: Ints, enough: float) -> bool:
    """Pivot in place to the optimum; False where it is more than ``enough``, or not found."""
    rows, last = len(basic), dictionary.shape[1] - 1
    for _ in range(PIVOTS):
        if dictionary[rows, last] > enough:
            return False
        leaving, worst = -1, -TINY
        for k in range(rows):
            if dictionary[k, last] < worst:
                leaving, worst = k, dictionary[k, last]
        if leaving < 0:
            return True
        entering, least = -1, np.inf
        for j in range(last):
            step = dictionary[leaving, j]
            if step > TINY:
                ratio = dictionary[rows, j] / step
                tie = entering >= 0 and abs(ratio - least) <= TINY
                if (tie and step > dictionary[leaving, entering]) or ratio < least - TINY:
                    entering, least = j, min(ratio, least)
        if entering < 0:
            return False
        _pivot(dictionary, leaving, entering)
        basic[leaving], nonbasic[entering] = nonbasic[entering], basic[leaving]
    return False


@allocating
def _pivot(dictionary: Floats, leaving: int, entering: int) -> None:
    """Exchange a basic and a nonbasic variable."""
    rows, width = dictionary.shape
    inverse = 1.0 / dictionary[leaving, entering]
    for j in range(width):
        dictionary[leaving, j] *= -inverse
    dictionary[leaving, entering] = inverse
    for k in range(rows):
        share = dictionary[k, entering]
        if k != leaving and share != 0.0:
            dictionary[k, entering] = 0.0
            for j in range(width):
                dictionary[k, j] += share * dictionary[leaving, j]


@allocating
def solution(dictionary: Floats, basic: Ints) -> Floats:
    """The value of every column of A."""
    last = dictionary.shape[1] - 1
    value = np.zeros(last)
    for k in range(len(basic)):
        if basic[k] >= 0 and dictionary[k, last] > TINY:
            value[basic[k]] = dictionary[k, last]
    return value
