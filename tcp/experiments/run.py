"""Make the runs that an experiment still lacks, in parallel, and keep each as it finishes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from tcp.errors import InputError, ProofError, UsageError
from tcp.experiments.journal import Journal, Run
from tcp.experiments.spec import Column, Experiment
from tcp.fleet import Fleet
from tcp.instance import Instance
from tcp.result import Result, Status
from tcp.solve import solve
from tcp.stop import Stop, StopReason
from tcp.validate.store import CertificateFolder


@dataclass(frozen=True)
class Optimum:
    """A proved optimum and where the proof comes from.

    Parameters
    ----------
    cost : int
        In quanta.
    seconds : float
        What the proof, or its check, took in this run.
    proof : str
        ``certificate checked``, or ``trusted`` and by which solver.
    """

    cost: int
    seconds: float
    proof: str


Told = Callable[[int, int], None]
"""Receives the number of finished runs and of all."""


def optima(experiment: Experiment) -> dict[str, Optimum]:
    """The proved optimum of each instance that an experiment solves, by the instance's hash.

    A certificate beside the workpiece is checked and believed; without one,
    an exact solver proves the optimum here and now.

    Raises
    ------
    ProofError
        If an optimum cannot be proved.
    """
    found: dict[str, Optimum] = {}
    for column in experiment.columns:
        instance = column.instance
        if column.solver and instance.sha256 not in found:
            found[instance.sha256] = certified(column) or prove(instance)
    return found


def certified(column: Column) -> Optimum | None:
    """The optimum that a checked certificate in the column's folder states, if there is one."""
    folder = column.certificates
    if folder is None or not folder.is_dir():
        return None
    began = time.perf_counter()
    known = CertificateFolder(folder).known(column.instance)
    if known is None or not known.optimal:
        return None
    return Optimum(known.lower, time.perf_counter() - began, "certificate checked")


def prove(instance: Instance) -> Optimum:
    """Prove the optimum of an instance with an exact solver.

    Raises
    ------
    ProofError
        If the solver ends without a proof.
    """
    result = _solved(instance, exact=True)
    if result.status is not Status.OPTIMAL or result.cost is None:
        raise ProofError(f"no proved optimum for {instance.name}: {result.status}")
    return Optimum(result.cost, result.seconds, f"{result.proof} ({result.solver})")


def conduct(
    experiment: Experiment,
    known: dict[str, Optimum],
    journal: Journal,
    *,
    fleet: Fleet | None = None,
    told: Told = lambda done, total: None,
) -> dict[str, Run]:
    """Make every run that the journal lacks, and return all runs of the experiment by key.

    Results do not depend on the fleet: a run is its column and its seed.  A
    run ends early once it has the proved optimum: it cannot improve.

    Parameters
    ----------
    experiment : Experiment
        What to run.
    known : dict
        Proved optima (:func:`optima`).
    journal : Journal
        Where finished runs are kept.
    fleet : Fleet, optional
        Where the runs are made; default: one process a core.
    told : callable
        Hears of progress.

    Raises
    ------
    UsageError
        If the fleet cannot be reached, or a solver refuses what :func:`rehearse` would have told.
    FleetError
        If it is lost; the runs that came back are in the journal.
    OutputError
        If the journal cannot be written.
    """
    done = journal.runs()
    wanted = _wanted(experiment)
    missing = [(key, *wanted[key]) for key in wanted if key not in done]
    finished = len(wanted) - len(missing)
    told(finished, len(wanted))
    if missing:
        journal.prepare()
        tasks = [(key, c, seed, known[c.instance.sha256].cost) for key, c, seed in missing]
        for _, run in (fleet or Fleet()).run(one_run, tasks):
            journal.append(run)
            done[run.key] = run
            finished += 1
            told(finished, len(wanted))
    return {key: done[key] for key in wanted}


def one_run(task: tuple[str, Column, int, int]) -> Run:
    """One run: key, column, seed and proved optimum.  What every worker process does."""
    key, column, seed, optimum = task
    began = time.thread_time()
    result = _solved(
        column.instance,
        column.solver,
        stop=Stop(target=Fraction(optimum)),
        seed=seed,
        **column.options,
    )
    return Run(
        key=key,
        seed=seed,
        optimum=optimum,
        cost=result.cost,
        route=" ".join(result.ids or ()),
        trace=[[p.iteration, p.cost] for p in result.trace if p.cost is not None],
        iterations=_count(result, "iterations"),
        evaluations=_count(result, "evaluations"),
        seconds=round(result.seconds, 4),
        cpu=round(time.thread_time() - began, 4),
    )


def _solved(*problem: Any, **options: Any) -> Result:
    """As :func:`tcp.solve.solve`, but Ctrl-C ends the experiment, and not only this solve."""
    result = solve(*problem, **options)
    if result.stopped is StopReason.INTERRUPTED:
        raise KeyboardInterrupt
    return result


def _count(result: Result, name: str) -> int | None:
    value = result.details.get(name)
    return value if isinstance(value, int) else None


def _wanted(experiment: Experiment) -> dict[str, tuple[Column, int]]:
    """Column and seed of every run of an experiment, by the run's key."""
    return {
        column.key(seed): (column, seed)
        for column in experiment.columns
        if column.solver
        for seed in range(experiment.seed, experiment.seed + experiment.runs)
    }


def rehearse(experiment: Experiment, journal: Journal) -> None:
    """Let the columns that still lack runs begin one, and stop it at once.

    An option out of range is told before hours of proofs and runs, and the workers
    find compiled code in the cache.

    Raises
    ------
    InputError
        If a solver refuses its options or its instance.
    """
    done = journal.runs()
    lacking = {c.name: c for key, (c, _) in _wanted(experiment).items() if key not in done}
    for column in lacking.values():
        try:
            _solved(column.instance, column.solver, stop=Stop(1.0, iterations=1), **column.options)
        except UsageError as error:
            raise InputError(f"column {column.name!r}: {error}", experiment.path) from None
