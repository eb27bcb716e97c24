"""The linear programme of one search: degree rows, pooled cuts, priced columns.

One HiGHS model lives through the whole search.  Its columns are pairs of
nodes, its first rows the degree equations, the others cuts.  A node of the
tree is entered by setting the bounds of its decisions and restoring a
:class:`Snapshot` of a basis.  Everything here is floating point: nothing in
this file proves anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import highspy
import numpy as np
from numpy.typing import NDArray

from tcp.exact.branch_and_cut.cuts import Cut, Family, columns, rows
from tcp.exact.branch_and_cut.probe import Probe
from tcp.exact.branch_and_cut.problem import Problem
from tcp.exact.branch_and_cut.proof import Duals, Fixings, Floats, rounded
from tcp.travel import Ints

PATIENCE = 5
"""Solves in a row that a cut's slack may be basic before it leaves the LP for the pool."""

BASIC = highspy.HighsBasisStatus.kBasic
LOWER = highspy.HighsBasisStatus.kLower
UPPER = highspy.HighsBasisStatus.kUpper


class Answer(Enum):
    """What the simplex method came back with."""

    OPTIMAL = "optimal"
    INFEASIBLE = "infeasible"
    LIMIT = "limit"
    LOST = "lost"


ANSWERS = {
    highspy.HighsModelStatus.kOptimal: Answer.OPTIMAL,
    highspy.HighsModelStatus.kInfeasible: Answer.INFEASIBLE,
    highspy.HighsModelStatus.kTimeLimit: Answer.LIMIT,
}
"""What the simplex method says; anything else it says when it has lost its way."""

DUAL, PRIMAL = 1, 4
"""HiGHS's numbers of the two simplex methods."""

DEVEX, STEEPEST = 1, 2
"""HiGHS's numbers of two ways to price dual infeasibilities."""

STEEP = 0.01
"""Share of new rows from which steepest edges pay: half the steps, for dear first weights."""

RESCUES = ((DUAL, True), (PRIMAL, True), (DUAL, False), (PRIMAL, False))
"""What to try where rounding errors leave no clear answer: from the last basis, from scratch.

HiGHS stops where a step would bring it back to a basis it knows; with its memory cleared the
few steps that are left are taken at once, while from scratch they are tens of thousands.
"""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A basis by name: it survives columns and rows that come and go."""

    basic: Ints
    upper: Ints
    degrees: Ints
    tight: tuple[Cut, ...]


@dataclass(frozen=True)
class SetBranch:
    """A decision x(delta(S)) = 2, or >= 4."""

    cut: Cut
    four: bool

    @property
    def bounds(self) -> tuple[float, float]:
        """Lower and upper bound of the row."""
        return (4.0, highspy.kHighsInf) if self.four else (2.0, 2.0)


class Relaxation:
    """The LP over some pairs and some cuts.

    Parameters
    ----------
    problem : Problem
        Nodes and costs.
    keys : int64 array
        Pairs to begin with.
    unit : float
        Quanta to the unit of LP costs: 1 to 100 units an edge suit the tolerances.
    """

    def __init__(self, problem: Problem, keys: Ints, unit: float):
        self.problem = problem
        self.unit = unit
        self.cuts: list[Cut] = []
        self.place: dict[bytes, int] = {}
        self.keys = np.zeros(0, np.int64)
        self.i = np.zeros(0, np.int64)
        self.j = np.zeros(0, np.int64)
        self.cost = np.zeros(0, np.int64)
        self.x: Floats = np.zeros(0)
        self._age = np.zeros(0, np.int64)
        self._sorted: tuple[Ints, Ints] = (self.keys, self.keys)
        self._fixings = Fixings.root(problem)
        self._branches: dict[bytes, SetBranch] = {}
        self._columns_are_new = False
        self._new_rows = 0
        self.iterations = 0
        self._h = highs()
        size = problem.size
        none = np.zeros(0, np.int32)
        two = np.full(size, 2.0)
        self._h.addRows(size, two, two, 0, np.zeros(size, np.int32), none, np.zeros(0))
        self.objective = 0.0
        self._row_dual: Floats = np.zeros(0)
        self._priced: list[Cut] = []
        self.add_pairs(np.unique(keys))

    # -- columns ---------------------------------------------------------

    def add_pairs(self, keys: Ints) -> None:
        """Enter pairs as columns; those already there are skipped."""
        keys = keys[self.columns_of(keys) < 0]
        if not len(keys):
            return
        i, j = self.problem.pairs(keys)
        cost = self.problem.costs(i, j)
        ptr, row, value = self._new_columns(i, j)
        lower, upper = self._bounds_of(keys)
        count = len(keys)
        self._h.addCols(
            count,
            cost / self.unit,
            lower,
            upper,
            len(row),
            ptr[:-1].astype(np.int32),
            row.astype(np.int32),
            value.astype(np.float64),
        )
        self.keys = np.concatenate((self.keys, keys))
        self.i, self.j = np.concatenate((self.i, i)), np.concatenate((self.j, j))
        self.cost = np.concatenate((self.cost, cost))
        self.x = np.concatenate((self.x, np.zeros(count)))
        self._index()
        self._columns_are_new = True

    def _new_columns(self, i: Ints, j: Ints) -> tuple[Ints, Ints, Ints]:
        size, count = self.problem.size, len(i)
        family = Family.of(self.cuts)
        member_ptr, member = family.membership(size)
        ptr, row, value = columns(
            family.owner, family.weight, family.count, member_ptr, member, i, j
        )
        extra = np.arange(count)
        start = ptr + 2 * np.arange(count + 1)
        rows_ = np.empty(start[-1], np.int64)
        values = np.ones(start[-1], np.int64)
        rows_[start[:-1]], rows_[start[:-1] + 1] = i, j
        target = np.arange(len(row)) + 2 * (np.repeat(extra, np.diff(ptr)) + 1)
        rows_[target], values[target] = row + size, value
        return start, rows_, values

    def _index(self) -> None:
        order = np.argsort(self.keys, kind="stable")
        self._sorted = (self.keys[order], order)

    def columns_of(self, keys: Ints) -> Ints:
        """Column numbers of pairs, -1 for those that are not in the LP."""
        known, order = self._sorted
        if not len(known):
            return np.full(len(keys), -1, np.int64)
        at = np.minimum(np.searchsorted(known, keys), len(known) - 1)
        return np.where(known[at] == keys, order[at], -1)

    def remove_pairs(self, keep: Ints) -> None:
        """Drop all columns that are not among the ascending keys ``keep`` and not basic."""
        basis = self._h.getBasis()
        basic = np.zeros(len(self.keys), bool)
        if basis.valid:
            basic = np.array([s == BASIC for s in basis.col_status])
        dead = ~np.isin(self.keys, keep)
        gone = np.nonzero(dead & ~basic)[0].astype(np.int32)
        if len(gone):
            self._h.deleteCols(len(gone), gone)
            stay = np.ones(len(self.keys), bool)
            stay[gone] = False
            self.keys, self.i, self.j = self.keys[stay], self.i[stay], self.j[stay]
            self.cost, self.x = self.cost[stay], self.x[stay]
            self._index()
        self._set_bounds(np.nonzero(~np.isin(self.keys, keep))[0], 0.0, 0.0)

    # -- rows ------------------------------------------------------------

    def add_cuts(self, cuts: Sequence[Cut]) -> int:
        """Enter cuts as rows; returns how many were new."""
        fresh: dict[bytes, Cut] = {c.key: c for c in cuts if c.key not in self.place}
        if not fresh:
            return 0
        new = list(fresh.values())
        ptr, column, value = rows(Family.of(new), self.i, self.j, self.problem.size)
        bounds = [
            self._branches[c.key].bounds
            if c.key in self._branches
            else (float(c.rhs), highspy.kHighsInf)
            for c in new
        ]
        self._h.addRows(
            len(new),
            np.array([b[0] for b in bounds]),
            np.array([b[1] for b in bounds]),
            len(column),
            ptr[:-1].astype(np.int32),
            column.astype(np.int32),
            value.astype(np.float64),
        )
        for cut in new:
            self.place[cut.key] = len(self.cuts)
            self.cuts.append(cut)
        self._age = np.concatenate((self._age, np.zeros(len(new), np.int64)))
        self._new_rows += len(new)
        return len(new)

    def age(self) -> list[Cut]:
        """Drop the cuts that have been slack for long; returns them for the pool."""
        if not self.cuts:
            return []
        size = self.problem.size
        status = self._h.getBasis().row_status[size:]
        basic = np.array([s == BASIC for s in status])
        self._age = np.where(basic, self._age + 1, 0)
        old = np.nonzero(self._age > PATIENCE)[0]
        old = np.array([k for k in old if self.cuts[k].key not in self._branches], np.int64)
        if len(old) < 10:
            return []
        self._h.deleteRows(len(old), (old + size).astype(np.int32))
        gone = set(old.tolist())
        dropped = [self.cuts[k] for k in gone]
        self.cuts = [c for k, c in enumerate(self.cuts) if k not in gone]
        self.place = {c.key: k for k, c in enumerate(self.cuts)}
        stay = np.ones(len(self._age), bool)
        stay[old] = False
        self._age = self._age[stay]
        self._slack = self._slack[stay]
        return dropped

    # -- where in the tree -----------------------------------------------

    def enter(self, fixings: Fixings, branches: Sequence[SetBranch], alive: Ints | None) -> None:
        """Set the bounds of a node's decisions; pairs outside ``alive`` get 0."""
        self._fixings, self._alive = fixings, alive
        lower, upper = self._bounds_of(self.keys)
        everything = np.arange(len(self.keys), dtype=np.int32)
        self._h.changeColsBounds(len(everything), everything, lower, upper)
        before = self._branches
        self._branches = {b.cut.key: b for b in branches}
        for key in before:
            if key not in self._branches and key in self.place:
                row = self.problem.size + self.place[key]
                self._h.changeRowBounds(row, 2.0, highspy.kHighsInf)
        self.add_cuts([b.cut for b in branches])
        for branch in branches:
            row = self.problem.size + self.place[branch.cut.key]
            self._h.changeRowBounds(row, *branch.bounds)
        inside = self._fixings.inside
        self.add_pairs(inside)

    _alive: Ints | None = None

    def _bounds_of(self, keys: Ints) -> tuple[Floats, Floats]:
        lower = np.isin(keys, self._fixings.inside).astype(np.float64)
        upper = 1.0 - np.isin(keys, self._fixings.outside).astype(np.float64)
        if self._alive is not None:
            upper[~np.isin(keys, self._alive)] = 0.0
        return np.minimum(lower, upper), upper

    def _set_bounds(self, at: Ints, lower: float, upper: float) -> None:
        if len(at):
            low, high = np.full(len(at), lower), np.full(len(at), upper)
            self._h.changeColsBounds(len(at), at.astype(np.int32), low, high)

    def snapshot(self) -> Snapshot:
        """The current basis by name."""
        basis, size = self._h.getBasis(), self.problem.size
        column = np.array([s.value for s in basis.col_status], np.int64)
        row = np.array([s.value for s in basis.row_status], np.int64)
        tight = tuple(c for c, s in zip(self.cuts, row[size:], strict=True) if s != BASIC.value)
        return Snapshot(
            self.keys[column == BASIC.value],
            self.keys[column == UPPER.value],
            np.nonzero(row[:size] == BASIC.value)[0],
            tight,
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Bring back a basis, and the cuts that were tight in it."""
        self.add_cuts(snapshot.tight)
        basis = highspy.HighsBasis()
        status = np.full(len(self.keys), LOWER, dtype=object)
        status[self._present(snapshot.upper)] = UPPER
        status[self._present(snapshot.basic)] = BASIC
        tight = {c.key for c in snapshot.tight}
        degrees = np.full(self.problem.size, LOWER, dtype=object)
        degrees[snapshot.degrees] = BASIC
        basis.col_status = status.tolist()
        basis.row_status = degrees.tolist() + [
            LOWER if c.key in tight else BASIC for c in self.cuts
        ]
        basis.alien = True
        basis.valid = True
        self._h.setBasis(basis)

    def _present(self, keys: Ints) -> Ints:
        at = self.columns_of(keys)
        return at[at >= 0]

    # -- solving ---------------------------------------------------------

    def solve(self, seconds: float = float("inf")) -> Answer:
        """Run the simplex method to the end (or the time limit) and read the solution."""
        h = self._h
        limit = highspy.kHighsInf if seconds == float("inf") else h.getRunTime() + seconds
        h.setOptionValue("time_limit", limit)
        steep = self._new_rows >= STEEP * (self.problem.size + len(self.cuts))
        h.setOptionValue("simplex_dual_edge_weight_strategy", STEEPEST if steep else DEVEX)
        answer = self._run(PRIMAL if self._columns_are_new else DUAL)
        h.setOptionValue("simplex_dual_edge_weight_strategy", DEVEX)
        self._columns_are_new, self._new_rows = False, 0
        for strategy, warm in RESCUES:
            if answer is not Answer.LOST:
                break
            basis = h.getBasis()
            h.clearSolver()
            if warm and basis.valid:
                h.setBasis(basis)
            answer = self._run(strategy)
        if answer is Answer.OPTIMAL:
            self._read(h.getInfo().objective_function_value)
        return answer

    def _run(self, strategy: int) -> Answer:
        """One run from the current basis; lost where rounding errors leave no clear answer."""
        self._h.setOptionValue("simplex_strategy", strategy)
        self._h.run()
        self.iterations += max(0, self._h.getInfo().simplex_iteration_count)
        return ANSWERS.get(self._h.getModelStatus(), Answer.LOST)

    def _read(self, objective: float) -> None:
        solution = self._h.getSolution()
        self.x = np.array(solution.col_value)
        self._row_dual = np.array(solution.row_dual)
        self._priced = list(self.cuts)
        activity = np.array(solution.row_value)[self.problem.size :]
        rhs = np.array([c.rhs for c in self.cuts], np.float64)
        self._slack = activity - rhs
        self.objective = objective * self.unit

    _slack: Floats = np.zeros(0)

    @property
    def slack(self) -> Floats:
        """Slack of every cut in the last solution."""
        return self._slack

    def duals(self) -> Duals:
        """The last solution's duals as integers, whatever rows came or went since."""
        return self._rounded(self._row_dual, self._priced, self.unit)

    def free_columns(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Which columns are basic, and which of all are not fixed at this node."""
        lower, upper = self._bounds_of(self.keys)
        status = self._h.getBasis().col_status
        return np.array([s == BASIC for s in status]), lower < upper

    def corrections(self, costs: Floats, tight: NDArray[np.bool_]) -> Floats | None:
        """Row duals of the same LP under other costs, from the same basis; None if there are none.

        Rows of cuts that are ``tight`` become equations, so that their duals may have any sign.
        """
        h = self._copy(costs)
        h.setBasis(self._h.getBasis())
        h.setOptionValue("primal_feasibility_tolerance", 1e-10)
        h.setOptionValue("dual_feasibility_tolerance", 1e-10)
        for row in np.nonzero(tight)[0].tolist():
            rhs = float(self.rhs_of(self.cuts[row]))
            h.changeRowBounds(self.problem.size + row, rhs, rhs)
        h.run()
        if h.getModelStatus() != highspy.HighsModelStatus.kOptimal:
            return None
        return np.array(h.getSolution().row_dual)

    def _copy(self, costs: Floats) -> highspy.Highs:
        """Another solver with the same rows, columns and bounds."""
        lp, h = self._h.getLp(), highs()
        h.passModel(lp)
        h.changeColsCost(lp.num_col_, np.arange(lp.num_col_, dtype=np.int32), costs)
        return h

    @property
    def solved(self) -> bool:
        """Whether there has been a solution."""
        return len(self._row_dual) > 0

    def _rounded(self, row_dual: Floats, cuts: list[Cut], unit: float) -> Duals:
        size = self.problem.size
        listed: list[tuple[Cut, int, float, bool]] = []
        for k in np.nonzero(row_dual[size:])[0].tolist():
            cut = cuts[k]
            listed.append((cut, self.rhs_of(cut), row_dual[size + k], self.is_equation(cut)))
        return rounded(self.problem, row_dual[:size], listed, unit)

    def rhs_of(self, cut: Cut) -> int:
        """What the cut demands at this node: its own right-hand side, or a branch's 4."""
        branch = self._branches.get(cut.key)
        return 4 if branch is not None and branch.four else cut.rhs

    def is_equation(self, cut: Cut) -> bool:
        """Whether a branch has made the cut an equation: its dual may have any sign."""
        branch = self._branches.get(cut.key)
        return branch is not None and not branch.four

    def row_of(self, cut: Cut) -> int:
        """Row number of a cut that is in the LP."""
        return self.problem.size + self.place[cut.key]

    def probe(self, twin: bool = False) -> Probe:
        """Try decisions from the current basis, in this solver or in a twin."""
        basis = self._h.getBasis()
        h = self._h
        if twin:
            h = self._copy(self.cost / self.unit)
            h.setBasis(basis)
        return Probe(h, basis, self.objective, self.unit)

    # -- infeasibility ---------------------------------------------------

    def ray(self) -> Duals:
        """Multipliers that prove infeasibility, or price in what repairs it.

        Solves the elastic LP: no costs, every row may be missed at a cost of 1
        a unit.  Its duals are a Farkas ray when its optimum is positive.
        """
        count = self.problem.size + len(self.cuts)
        h = self._copy(np.zeros(len(self.keys)))
        ones, free = np.ones(count), np.full(count, highspy.kHighsInf)
        start = np.arange(count, dtype=np.int32)
        for sign in (1.0, -1.0):
            h.addCols(count, ones, np.zeros(count), free, count, start, start, sign * ones)
        h.run()
        return self._rounded(np.array(h.getSolution().row_dual), self.cuts, 0.0)


def highs() -> highspy.Highs:
    """A quiet single-threaded simplex solver with tight tolerances."""
    h = highspy.Highs()
    h.silent()
    for option, value in {
        "presolve": "off",
        "solver": "simplex",
        "threads": 1,
        "simplex_scale_strategy": 0,
        "simplex_dual_edge_weight_strategy": 1,
        "primal_feasibility_tolerance": 1e-9,
        "dual_feasibility_tolerance": 1e-9,
    }.items():
        h.setOptionValue(option, value)
    return h
