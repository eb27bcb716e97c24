"""The solvers behind PuLP: HiGHS, CBC and SCIP, asked for what they really know.

PuLP calls a run that hit its limit *Optimal* and keeps no dual bound.  Here a
backend says how its run ended, hands the solution's values to the problem's
variables, and tells the dual bound as the solver itself states it.  All runs
are silent and stop within a fraction of a second when told to.
"""

from __future__ import annotations

import math
import re
import shutil
import signal
import subprocess
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from decimal import Decimal
from enum import StrEnum
from pathlib import Path
from typing import Any

import highspy
import numpy as np
import pulp

from tcp.errors import TcpError, UsageError
from tcp.exact.native import attend
from tcp.stop import StopReason


class End(StrEnum):
    """How a run ended."""

    OPTIMAL = "optimal"
    INFEASIBLE = "infeasible"
    STOPPED = "stopped"


Watch = Callable[[], StopReason | None]

TIGHT = 1e-9
"""Feasibility tolerances; the defaults would blur costs of many digits."""


@dataclass(frozen=True)
class Answer:
    """What a run has shown.

    Parameters
    ----------
    end : End
        Whether it came to its end.
    bound : float
        Dual bound on the objective; -infinity if unknown.
    solved : bool
        Whether the problem's variables hold a feasible solution.
    stopped : StopReason or None
        Why the run was stopped, where we did it.
    """

    end: End
    bound: float
    solved: bool
    stopped: StopReason | None = None


class BackendError(TcpError):
    """A backend failed in a way that no input should cause."""


class Backend(ABC):
    """A solver for PuLP problems.

    Parameters
    ----------
    seed : int
        Seed of the solver's own randomness.
    gap : float
        Absolute difference of incumbent and bound at which a run may end.
    bounds : callable
        Receives dual bounds of a mixed-integer run as they rise.
    """

    def __init__(self, seed: int, gap: float, bounds: Callable[[float], None]):
        self.seed, self.gap, self.bounds = seed, gap, bounds

    @abstractmethod
    def solve(
        self, problem: pulp.LpProblem, start: bool, watch: Watch, seconds: float = math.inf
    ) -> Answer:
        """Solve; with ``start``, the variables' values are a solution to begin with.

        ``watch`` is asked all the time whether to stop; ``seconds`` go to the
        solver as well, which heeds its own limit in places where it is deaf.
        """


def _ends(ranges: Iterable[tuple[float | None, float | None]]) -> tuple[Any, Any]:
    """Lower and upper ends as arrays, infinite where they are None."""
    low, high = np.array([*ranges], float).T
    return np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)


class Highs(Backend):
    """HiGHS in this process; its callbacks carry bounds out and the wish to stop in."""

    def solve(
        self, problem: pulp.LpProblem, start: bool, watch: Watch, seconds: float = math.inf
    ) -> Answer:
        """As in the base class; linear programmes without a start."""
        translator = pulp.HiGHS(
            msg=False,
            timeLimit=None if seconds == math.inf else seconds,
            gapRel=0.0,
            gapAbs=self.gap,
            random_seed=self.seed % 2**31,
            mip_feasibility_tolerance=TIGHT,
            primal_feasibility_tolerance=TIGHT,
            dual_feasibility_tolerance=TIGHT,
        )
        translator.createAndConfigureSolver(problem)
        solver = problem.solverModel
        self._load(problem, solver)
        if start:
            first = highspy.HighsSolution()
            first.col_value = [float(v.varValue) for v in problem.variables()]
            solver.setSolution(first)
        cancelled = self._listen(solver)
        _, stopped = attend(solver.run, watch, lambda: cancelled.append(True))
        solver.setCallback(None, None)
        return self._answer(problem, solver, stopped)

    @staticmethod
    def _load(problem: pulp.LpProblem, solver: Any) -> None:
        """Hand over all columns and all rows at once: PuLP's one by one take quadratic time."""
        columns, rows = problem.variables(), problem.constraints()
        cost = [problem.objective.get(v, 0.0) for v in columns]
        low, high = _ends((v.lowBound, v.upBound) for v in columns)
        nothing = np.zeros(0, np.int32)
        none = np.zeros(len(columns), np.int32), nothing, np.zeros(0)
        solver.addCols(len(columns), np.array(cost, float), low, high, 0, *none)
        whole = np.array([k for k, v in enumerate(columns) if v.cat == pulp.LpInteger], np.int32)
        kind = np.full(len(whole), int(highspy.HighsVarType.kInteger), np.uint8)
        solver.changeColsIntegrality(len(whole), whole, kind)
        place = {v: k for k, v in enumerate(columns)}
        starts = np.cumsum([0, *map(len, rows)], dtype=np.int32)
        index = np.array([place[v] for row in rows for v in row], np.int32)
        value = np.array([a for row in rows for a in row.values()], float)
        low, high = _ends((row.getLb(), row.getUb()) for row in rows)
        solver.addRows(len(rows), low, high, len(index), starts[:-1], index, value)

    def _listen(self, solver: Any) -> list[bool]:
        """Let HiGHS look now and then whether the returned list is still empty."""
        cancelled: list[bool] = []
        kinds = highspy.cb.HighsCallbackType

        def called(kind: Any, message: str, seen: Any, told: Any, data: Any) -> None:
            if kind == kinds.kCallbackMipInterrupt:
                self.bounds(seen.mip_dual_bound)
            if cancelled:
                told.user_interrupt = True

        solver.setCallback(called, None)
        solver.startCallback(kinds.kCallbackMipInterrupt)
        solver.startCallback(kinds.kCallbackSimplexInterrupt)
        return cancelled

    @staticmethod
    def _answer(problem: pulp.LpProblem, solver: Any, stopped: StopReason | None) -> Answer:
        states, status, info = highspy.HighsModelStatus, solver.getModelStatus(), solver.getInfo()
        if status in (states.kInfeasible, states.kUnboundedOrInfeasible):  # all is bounded here
            return Answer(End.INFEASIBLE, math.inf, False)
        variables, values = problem.variables(), list(solver.getSolution().col_value)
        feasible = int(highspy.SolutionStatus.kSolutionStatusFeasible)
        solved = info.primal_solution_status == feasible and len(values) == len(variables)
        if solved:
            for variable, value in zip(variables, values, strict=True):
                variable.varValue = value
        ended = status == states.kOptimal
        if problem.isMIP():
            bound = info.mip_dual_bound
        else:
            bound = info.objective_function_value if ended else -math.inf
        return Answer(End.OPTIMAL if ended else End.STOPPED, bound, solved, stopped)


class Scip(Backend):
    """SCIP in this process, through pyscipopt."""

    def solve(
        self, problem: pulp.LpProblem, start: bool, watch: Watch, seconds: float = math.inf
    ) -> Answer:
        """As in the base class."""
        translator = pulp.SCIP_PY(msg=False, gapRel=0.0, gapAbs=self.gap, warmStart=start)
        translator.buildSolverModel(problem)
        solver = problem.solverModel
        solver.setParam("randomization/randomseedshift", self.seed % 2**31)
        solver.setParam("numerics/feastol", TIGHT)
        solver.setParam("limits/time", min(seconds, 1e20))
        solver.setParam("misc/catchctrlc", False)

        def interrupt() -> None:
            with suppress(Exception):  # SCIP refuses while its search begins; it is asked again
                solver.interruptSolve()

        _, stopped = attend(solver.optimizeNogil, watch, interrupt)
        status = solver.getStatus()
        if status in ("infeasible", "inforunbd"):
            return Answer(End.INFEASIBLE, math.inf, False)
        solved = solver.getNSols() > 0
        if solved:
            best = solver.getBestSol()
            for variable in problem.variables():
                variable.varValue = best[variable.solverVar]
        end = End.OPTIMAL if status in ("optimal", "gaplimit") else End.STOPPED
        return Answer(end, solver.getDualbound(), solved, stopped)


class Cbc(Backend):
    """The CBC program that PuLP brings along, as a process of its own whose log is read."""

    BOUND = re.compile(r"best possible:? ([-+.\deE]+)|Lower bound: +([-+.\deE]+)")
    """How the log states a dual bound."""

    PATIENCE = 10
    """How often CBC is asked to stop (20 times a second) before it is killed."""

    def solve(
        self, problem: pulp.LpProblem, start: bool, watch: Watch, seconds: float = math.inf
    ) -> Answer:
        """As in the base class."""
        self.bound = -math.inf
        with tempfile.TemporaryDirectory(prefix="tcp-cbc-") as folder:
            model, first, found = (str(Path(folder) / f"tour.{k}") for k in ("mps", "mst", "sol"))
            reader = pulp.COIN_CMD(path=_cbc(), msg=False)
            variables, names, rows, _ = problem.writeMPS(model, rename=1)
            command = [reader.path, model, *self._options(), "-solve", "-solution", found]
            if start:
                reader.writesol(first, problem, variables, names, rows)
                command[2:2] = ["-mips", first]
            stopped = self._run(command, watch)
            if not Path(found).exists():
                if stopped is None:
                    raise BackendError("cbc ended without an answer")
                return Answer(End.STOPPED, self.bound, False, stopped)
            values = reader.readsol_MPS(found, problem, variables, names, rows)[1]
            with Path(found).open() as lines:
                headline = lines.readline()
        return self._answer(problem, headline, values, stopped)

    def _options(self) -> list[str]:
        seed = str(self.seed % 2**31)
        limits = ["-ratio", "0", "-allow", str(self.gap)]
        seeds = ["-randomSeed", seed, "-randomCbcSeed", seed]
        return [*limits, *seeds, "-primalTolerance", str(TIGHT), "-dualTolerance", str(TIGHT)]

    def _run(self, command: list[str], watch: Watch) -> StopReason | None:
        """Run CBC and follow its log; asked to stop, it may still write its solution."""
        with subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,  # Ctrl-C is for us
        ) as process:
            asked: list[bool] = []

            def cancel() -> None:
                asked.append(True)
                process.send_signal(signal.SIGINT if len(asked) < self.PATIENCE else signal.SIGKILL)

            return attend(lambda: self._follow(process.stdout), watch, cancel)[1]

    def _follow(self, log: Any) -> None:
        for line in log:
            for pair in self.BOUND.findall(line):
                value = least(pair[0] or pair[1])
                if abs(value) < 1e30:
                    self.bound = max(self.bound, value)
                    self.bounds(value)

    def _answer(
        self,
        problem: pulp.LpProblem,
        headline: str,
        values: dict[str, float],
        stopped: StopReason | None,
    ) -> Answer:
        """What the first line of the solution file says."""
        if headline.startswith(("Infeasible", "Integer infeasible")):
            return Answer(End.INFEASIBLE, math.inf, False)
        solved = "no integer solution" not in headline
        for variable in problem.variables():
            variable.varValue = values[variable.name]
        if not headline.startswith("Optimal"):
            return Answer(End.STOPPED, self.bound, solved, stopped)
        objective = float(headline.split()[-1])
        return Answer(End.OPTIMAL, objective - self.gap * problem.isMIP(), solved, stopped)


def least(printed: str) -> float:
    """The least that a printed number may stand for: half a unit of its last digit below it.

    CBC prints 8 significant digits, so that 1.5000005e+08 may be 150000045.
    """
    value = Decimal(printed)
    return float(value - Decimal(5).scaleb(int(value.as_tuple().exponent) - 1))


def _cbc() -> str:
    """The CBC on the user's path, else the one that comes with PuLP."""
    return shutil.which("cbc") or pulp.PULP_CBC_CMD.pulp_cbc_path


BACKENDS: dict[str, type[Backend]] = {"highs": Highs, "cbc": Cbc, "scip": Scip}


def backend(name: str) -> type[Backend]:
    """The backend of that name.

    Raises
    ------
    UsageError
        If there is none, or it is not installed.
    """
    if name not in BACKENDS:
        raise UsageError(f"unknown backend {name!r}; expected one of {', '.join(BACKENDS)}")
    if name == "cbc" and not pulp.COIN_CMD(path=_cbc()).available():
        raise UsageError("the backend cbc is not installed here; use the backend highs")
    if name == "scip" and not pulp.SCIP_PY().available():
        raise UsageError("the backend scip is not installed; pip install 'tcp-drill[scip]'")
    return BACKENDS[name]
