"""The facade: look the solver up, run it, check its answer, return it.  No algorithm here."""

from __future__ import annotations

import inspect
import platform
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from numbers import Integral, Real
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

import numpy as np

from tcp.errors import TcpError, UsageError, demand_whole
from tcp.instance import Instance
from tcp.result import Outcome, Progress, Proof, Report, Result, Status, silent
from tcp.stop import Clock, Stop, compiling_is_free
from tcp.validate.route import faults
from tcp.words import counted


@dataclass(frozen=True)
class Entry:
    """One row of the registry.

    The module offers ``run(instance, *, rng, clock, report, **options) ->
    Outcome`` and ``refusal(instance) -> str | None``, the sentence that says
    why it cannot take an instance.  It is imported only when it is used.
    """

    module: str
    exact: bool
    libraries: tuple[str, ...] = ()
    moves: bool = False  # knows rules about successive moves (axis run, balance)


SOLVERS: Mapping[str, Entry] = {
    "held-karp": Entry("tcp.exact.held_karp", exact=True, libraries=("numba",)),
    "branch-and-cut": Entry(
        "tcp.exact.branch_and_cut.run", exact=True, libraries=("highspy", "numba", "scipy")
    ),
    "cp-sat": Entry("tcp.exact.cp_sat", exact=True, libraries=("ortools",)),
    "local-search": Entry(
        "tcp.exact.local_search", exact=False, libraries=("numba", "highspy", "scipy")
    ),
    "routing": Entry("tcp.exact.routing", exact=True, libraries=("ortools",)),
    "htga": Entry("tcp.heuristics.htga", exact=False, libraries=("numba",)),
    "cuckoo": Entry("tcp.heuristics.cuckoo", exact=False, libraries=("numba",)),
    "firefly": Entry("tcp.heuristics.firefly", exact=False, libraries=("numba",)),
    "milp": Entry("tcp.exact.milp", exact=True, libraries=("pulp", "highspy")),
    "positions": Entry("tcp.exact.positions", exact=True, libraries=("ortools",), moves=True),
    "bmga": Entry("tcp.heuristics.bmga", exact=False, libraries=("numba", "scipy"), moves=True),
    "pso": Entry("tcp.heuristics.pso", exact=False, libraries=("numba",)),
    "acs": Entry("tcp.heuristics.acs", exact=False, libraries=("numba",)),
}


class SolverError(TcpError):
    """A solver returned something that is not true: a bug in ``tcp``, never the user's fault."""


def solve(
    instance: Instance,
    solver: str = "auto",
    *,
    stop: Stop | None = None,
    seed: int = 0,
    exact: bool = False,
    report: Report = silent,
    certificate: str | Path | None = None,
    like: Sequence[Path] = (),
    **options: Any,
) -> Result:
    """Solve an instance and check the answer.

    Parameters
    ----------
    instance : Instance
        The problem.
    solver : str
        A name of :data:`SOLVERS`, or ``auto``.
    stop : Stop, optional
        When to return early; without one, an exact solver runs to its proof.
    seed : int
        Source of all randomness, >= 0: the same seed gives the same route.
    exact : bool
        Ask for a proof: refuses solvers that cannot give one.
    report : callable
        Receives :class:`Progress` while the solver runs.
    certificate : path, optional
        Write the proof here (gzipped if the name ends in ``.gz``).  A solver
        without evidence of its own is followed by the proof engine, which
        starts from its route.  The file appears only once the independent
        checker has verified it.
    like : sequence of path
        What is written is kept from whom any of these files is kept from.
    **options
        The solver's own options.

    Returns
    -------
    Result
        The route, re-costed and validated, with its bound, status and proof.

    Raises
    ------
    UsageError
        For an unknown solver or option, or an instance the solver cannot take.
    SolverError
        If the solver's answer does not hold.
    """
    if not isinstance(stop, Stop | None):
        raise UsageError(f"stop must be a Stop, such as Stop(time=10), not {stop!r}")
    name, why = solver, ""
    if solver == "auto":
        name, why = choose(instance, exact, certificate is not None)
    entry, module = _look_up(name, exact)
    _check_call(name, instance, seed, options)
    if certificate is not None:
        _check_certifiable(instance)
    known, wishes = inspect.signature(module.run).parameters, {"exact": exact, "like": like}
    options |= {key: value for key, value in wishes.items() if value and key in known}
    clock, trace = Clock(stop or Stop()), _Trace(report)

    def compiling() -> None:
        report(Progress(clock.elapsed, note="compiling, once on this machine"))

    with interruptible(clock), compiling_is_free(clock, compiling):
        outcome = _run(name, instance, seed, clock, trace, options)
        if certificate is not None and outcome.evidence is None:
            outcome = _with_evidence(instance, outcome, seed, clock, trace)
    if why:
        outcome = replace(outcome, details={"auto": f"{name}: {why}", **outcome.details})
    result = _checked(instance, name, entry, outcome, seed, clock.elapsed, tuple(trace.kept))
    if certificate is None:
        return result
    return _certified(result, outcome.evidence, Path(certificate), like)


ENGINE = "branch-and-cut"
"""Who proves what other solvers found."""


def _check_certifiable(instance: Instance) -> None:
    from tcp.files.certifiable import certifiable

    certifiable(instance)
    refusal = refuses(ENGINE, instance)
    if refusal:
        raise UsageError(f"no certificate of {instance.name}: {ENGINE} makes it, and {refusal}")


def _run(
    name: str,
    instance: Instance,
    seed: int,
    clock: Clock,
    report: Report,
    options: Mapping[str, Any],
) -> Outcome:
    """What a registered solver answers; it is not checked yet."""
    run: Callable[..., Outcome] = import_module(SOLVERS[name].module).run
    rng = np.random.default_rng(seed)
    try:
        return run(instance, rng=rng, clock=clock, report=report, **options)
    except MemoryError:
        raise UsageError(f"{name} needs more memory than there is") from None


def _with_evidence(
    instance: Instance, outcome: Outcome, seed: int, clock: Clock, report: Report
) -> Outcome:
    """A solver's outcome with a certificate that the proof engine made, starting from its route."""
    proved = _run(ENGINE, instance, seed, clock, report, {"start_route": outcome.route})
    better = outcome.route is None or (
        proved.route is not None and instance.cost(proved.route) < instance.cost(outcome.route)
    )
    bounds = [b for b in (outcome.bound, proved.bound) if b is not None]
    return replace(
        outcome,
        route=proved.route if better else outcome.route,
        bound=max(bounds, default=None),
        infeasible=outcome.infeasible or proved.infeasible,
        details={**outcome.details, "proof engine": dict(proved.details)},
        evidence=proved.evidence,
    )


def _certified(result: Result, evidence: Any, path: Path, like: Sequence[Path]) -> Result:
    """Write the evidence; it gets its name only once the checker has verified what was written."""
    from tcp.files.certificate import write
    from tcp.validate import certificate as checker

    verdicts: list[checker.Verdict] = []
    try:
        write(
            evidence,
            path,
            lambda raw: verdicts.append(checker.check(raw, None, result.instance.sha256)),
            like,
        )
    except checker.Failure as failure:
        raise SolverError(f"{result.solver} wrote a certificate that fails: {failure}") from None
    proved = (
        result.status is Status.INFEASIBLE
        if verdicts[0].lower is None
        else sharpen(result.instance, verdicts[0].lower) == result.bound
    )
    return replace(result, certificate=path, proof=Proof.CERTIFIED if proved else result.proof)


SMALL = 16
"""Up to so many nodes the dynamic programme answers before others have set up their model."""

MEDIUM = 50
"""Up to so many nodes a proof costs no more than a good route, so that nobody has to ask for it."""

PROVERS = ("branch-and-cut", "cp-sat", "held-karp", "positions")
"""Who proves beyond that, in order of preference."""

SEEKERS = ("local-search", "routing", "cp-sat", "held-karp", "positions")
"""Who looks for a good route without a proof, in order of preference."""

LAST = "bmga"
"""Who takes what all of these refuse, rules about successive moves on large boards; no proof."""


def choose(instance: Instance, exact: bool, certificate: bool = False) -> tuple[str, str]:
    """The solver that ``auto`` stands for, and why.

    It goes by the number of nodes (holes, a home position, an open end), by
    the rules that a solver must know, and by whether a proof or even its
    certificate is wanted.

    Raises
    ------
    UsageError
        If every solver refuses the instance.
    """
    n, size = len(instance), instance.form.size
    proving = exact or certificate or size <= MEDIUM
    order = PROVERS if proving else SEEKERS
    aim = "a certificate" if certificate else "a proof" if proving else "a good route"
    if size <= SMALL:
        order = ("held-karp", *order)
    if not exact and not certificate:
        order = (*order, LAST)
    refusals: dict[str, list[str]] = {}
    for name in dict.fromkeys(order):
        refusal = refuses(name, instance)
        if refusal is None and name == "held-karp" and size <= SMALL:
            fit = f"{counted(n, 'hole')} {'fits' if n == 1 else 'fit'}"
            return name, f"{fit} the dynamic programme, which always proves"
        if refusal is None:
            rank = "last resort for a good route" if name == LAST else f"first choice for {aim}"
            return name, f"the {rank} over {counted(n, 'hole')}{_refused(refusals)}"
        refusals.setdefault(refusal, []).append(name)
    raise UsageError(f"no solver takes {instance.name} with {n} holes{_refused(refusals)}")


def _refused(refusals: Mapping[str, Sequence[str]]) -> str:
    """Who refused for which reason."""
    return "".join(f"; refused by {', '.join(names)}: {why}" for why, names in refusals.items())


def _look_up(name: str, exact: bool) -> tuple[Entry, ModuleType]:
    if name not in SOLVERS:
        raise UsageError(f"unknown solver {name!r}; expected auto or one of {', '.join(SOLVERS)}")
    entry = SOLVERS[name]
    if exact and not entry.exact:
        raise UsageError(f"{name} cannot prove a route optimal; drop --exact or choose another")
    return entry, import_module(entry.module)


def defaults(solver: str) -> dict[str, Any]:
    """Options of a registered solver and the values they have unless they are set."""
    return {name: p.default for name, p in _options(solver).items()}


PROTOCOL = ("instance", "rng", "clock", "report", "like")
"""What a solver is given besides its options."""


def _options(solver: str) -> dict[str, inspect.Parameter]:
    parameters = inspect.signature(import_module(SOLVERS[solver].module).run).parameters
    return {name: p for name, p in parameters.items() if name not in PROTOCOL}


def _check_call(name: str, instance: Instance, seed: int, options: Mapping[str, Any]) -> None:
    demand_whole("the seed", seed)
    if seed < 0:
        raise UsageError(f"the seed must be 0 or more, not {seed}")
    check_options(name, options)
    refusal = refuses(name, instance)
    if refusal:
        raise UsageError(f"{name} cannot solve {instance.name}: {refusal}")


def check_options(solver: str, options: Mapping[str, Any]) -> None:
    """Whether a registered solver has these options and takes values of their kind.

    Raises
    ------
    UsageError
        For an unknown option or a value of another kind; the range is the solver's own affair.
    """
    parameters = _options(solver)
    for option, value in options.items():
        if option not in parameters:
            offered = ", ".join(sorted(parameters)) or "no options"
            raise UsageError(f"{solver} has no option {option!r}; it takes {offered}")
        default = parameters[option].default
        wanted = _OPTIONAL.get(parameters[option].annotation, type(default))
        if wanted in _KINDS and not _fits(value, wanted):
            raise UsageError(f"{solver}: {option} is {_KINDS[wanted]}, not {value!r:.40}")


MOST = 10**12
"""No whole number that an option takes is larger."""

_KINDS = {
    bool: "true or false",
    int: "a whole number up to 10^12",
    float: "a finite number",
    str: "a word",
}
"""What an option takes, by the type of its default."""

_OPTIONAL = {"float | None": float, "int | None": int}
"""Types of the options whose default is that they are not set."""


def _fits(value: Any, kind: type) -> bool:
    """Whether a value may stand where the default is of ``kind``; a whole number is a number."""
    if isinstance(value, bool):
        return kind is bool
    wide: Any = {int: Integral, float: Real}
    most = {int: MOST, float: sys.float_info.max}
    if not isinstance(value, wide.get(kind, kind)):
        return False
    return kind not in most or bool(abs(value) <= most[kind])


def refuses(name: str, instance: Instance) -> str | None:
    """Why a registered solver cannot take an instance, or None."""
    entry = SOLVERS[name]
    if instance.rules.sequential and not entry.moves:
        return no_moves()
    refusal: str | None = import_module(entry.module).refusal(instance)
    return refusal


def no_moves() -> str:
    """Why what knows pairs of holes only cannot take rules about successive moves."""
    able = ", ".join(name for name, entry in SOLVERS.items() if entry.moves)
    return f"it does not know rules about successive moves (axis run, balance); {able} do"


class _Trace:
    """Passes news on and keeps those that improve the route or the bound."""

    def __init__(self, report: Report):
        self.kept: list[Progress] = []
        self._report = report
        self._cost: float = float("inf")
        self._bound: float = float("-inf")

    def __call__(self, news: Progress) -> None:
        cost = self._cost if news.cost is None else news.cost
        bound = self._bound if news.bound is None else news.bound
        if cost < self._cost or bound > self._bound:
            self.kept.append(news)
        self._cost, self._bound = min(cost, self._cost), max(bound, self._bound)
        self._report(news)


@contextmanager
def interruptible(clock: Clock) -> Iterator[None]:
    """First Ctrl-C asks for the best so far; a second one stops at once.

    What is interruptible inside of something interruptible is a part of it: both are asked.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGINT)
    around = getattr(before, "__self__", None)
    outer = around.clocks if isinstance(around, _CtrlC) else ()
    if any(one.interrupted for one in outer):
        clock.interrupt()
    signal.signal(signal.SIGINT, _CtrlC((clock, *outer)).answer)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@dataclass(frozen=True)
class _CtrlC:
    """What is asked to end by Ctrl-C, from the innermost outwards."""

    clocks: tuple[Clock, ...]

    def answer(self, number: int, frame: FrameType | None) -> None:
        """Handle the signal."""
        if any(clock.interrupted for clock in self.clocks):
            raise KeyboardInterrupt
        for clock in self.clocks:
            clock.interrupt()


def _checked(
    instance: Instance,
    name: str,
    entry: Entry,
    outcome: Outcome,
    seed: int,
    seconds: float,
    trace: tuple[Progress, ...],
) -> Result:
    cost = None
    if outcome.route is not None:
        wrong = faults(instance, outcome.route)
        if wrong:
            raise SolverError(f"{name} returned a route that is none: {wrong[0]}")
        cost = instance.cost(outcome.route)
    bound = sharpen(instance, outcome.bound)
    if cost is not None and bound is not None and bound > cost:
        raise SolverError(f"{name} claims the bound {bound}, above its own route of {cost}")
    status = _status(cost, bound, outcome.infeasible)
    proved = status in (Status.OPTIMAL, Status.INFEASIBLE)
    return Result(
        instance=instance,
        route=outcome.route,
        cost=cost,
        bound=bound,
        status=status,
        proof=Proof.TRUSTED if proved else Proof.NONE,
        stopped=outcome.stopped,
        solver=outcome.solver or name,
        seed=seed,
        seconds=seconds,
        versions=versions(entry.libraries),
        details=_details(instance, outcome),
        trace=trace,
    )


def _details(instance: Instance, outcome: Outcome) -> Mapping[str, Any]:
    """The solver's details, and how many windows of moves its route leaves unbalanced."""
    if instance.rules.balance is None or outcome.route is None:
        return outcome.details
    return {**outcome.details, "unbalanced": instance.penalty(outcome.route)}


def sharpen(instance: Instance, bound: int | None) -> int | None:
    """The smallest cost not below ``bound``: a multiple of the granularity, and >= 0."""
    if bound is None:
        return None
    g = instance.granularity
    return max(0, -(-bound // g) * g)


def _status(cost: int | None, bound: int | None, infeasible: bool) -> Status:
    if infeasible:
        return Status.INFEASIBLE
    if cost is None:
        return Status.UNKNOWN
    return Status.OPTIMAL if cost == bound else Status.FEASIBLE


def versions(libraries: tuple[str, ...] = ()) -> dict[str, str]:
    """Versions of Python, tcp, numpy and the named libraries."""
    found = {"python": platform.python_version()}
    packages = {"tcp": "tcp-drill", "numpy": "numpy", **{name: name for name in libraries}}
    for name, package in packages.items():
        found[name] = _installed(package)
    return found


@cache
def _installed(package: str) -> str:
    from importlib.metadata import PackageNotFoundError, version  # a tenth of the time to load tcp

    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
