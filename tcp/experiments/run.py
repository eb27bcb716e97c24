"""Make the runs that an experiment still lacks, in parallel, and keep each as it finishes."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from tcp.errors import ProofError, UsageError
from tcp.experiments.journal import Journal, Run
from tcp.experiments.spec import Column, Experiment
from tcp.instance import Instance
from tcp.result import Result, Status
from tcp.solve import solve
from tcp.stop import Stop
from tcp.validate.store import CertificateFolder

BACKENDS = ("loky", "dask", "ray")


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
    """The proved optimum of each instance of an experiment, by the instance's hash.

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
        if instance.sha256 not in found:
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
    result = solve(instance, exact=True)
    if result.status is not Status.OPTIMAL or result.cost is None:
        raise ProofError(f"no proved optimum for {instance.name}: {result.status}")
    return Optimum(result.cost, result.seconds, f"{result.proof} ({result.solver})")


def conduct(
    experiment: Experiment,
    known: dict[str, Optimum],
    journal: Journal,
    *,
    jobs: int | None = None,
    backend: str = "loky",
    scheduler: str | None = None,
    told: Told = lambda done, total: None,
) -> dict[str, Run]:
    """Make every run that the journal lacks, and return all runs of the experiment by key.

    Results do not depend on ``jobs`` or ``backend``: a run is its column and
    its seed.  A run ends early once it has the proved optimum: it cannot improve.

    Parameters
    ----------
    experiment : Experiment
        What to run.
    known : dict
        Proved optima (:func:`optima`).
    journal : Journal
        Where finished runs are kept.
    jobs : int, optional
        Processes; default: one a core.
    backend : {"loky", "dask", "ray"}
        joblib's own backends; the last two use an existing cluster.
    scheduler : str, optional
        Address of the Dask scheduler or Ray head.
    told : callable
        Hears of progress.

    Raises
    ------
    UsageError
        For an unknown backend, or one whose package is not installed.
    """
    done = journal.runs()
    wanted = {
        column.key(seed): (column, seed)
        for column in experiment.columns
        if column.solver
        for seed in range(experiment.seed, experiment.seed + experiment.runs)
    }
    missing = [(key, *wanted[key]) for key in wanted if key not in done]
    finished = len(wanted) - len(missing)
    told(finished, len(wanted))
    if missing:
        _warm(experiment)
        tasks = [(key, c, seed, known[c.instance.sha256].cost) for key, c, seed in missing]
        with _cluster(backend, scheduler):
            for run in _parallel(tasks, jobs, backend):
                journal.append(run)
                done[run.key] = run
                finished += 1
                told(finished, len(wanted))
    return {key: done[key] for key in wanted}


def one_run(key: str, column: Column, seed: int, optimum: int) -> Run:
    """One run of a column: what every worker process does."""
    result = solve(
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
        route=list(result.ids or ()),
        trace=[[p.iteration, p.cost] for p in result.trace if p.cost is not None],
        iterations=_count(result, "iterations"),
        evaluations=_count(result, "evaluations"),
        seconds=round(result.seconds, 6),
    )


def _count(result: Result, name: str) -> int:
    value = result.details.get(name, 0)
    return int(value) if isinstance(value, int) else 0


def _warm(experiment: Experiment) -> None:
    """Compile in this process first, so that workers find the compiled code in the cache."""
    for column in {c.solver: c for c in experiment.columns if c.solver}.values():
        solve(column.instance, column.solver, stop=Stop(iterations=1), **column.options)


def _parallel(
    tasks: list[tuple[str, Column, int, int]], jobs: int | None, backend: str
) -> Iterator[Run]:
    """Finished runs, as soon as the backend gives them away."""
    if jobs == 1 and backend == "loky":
        yield from (one_run(*task) for task in tasks)
        return
    from joblib import Parallel, delayed

    count = jobs or (os.cpu_count() or 1 if backend == "loky" else -1)
    if backend == "ray":  # returns only whole batches
        for batch in _batches(tasks, 32):
            yield from Parallel(n_jobs=count)(delayed(one_run)(*task) for task in batch)
        return
    pool = Parallel(n_jobs=count, return_as="generator_unordered")
    yield from pool(delayed(one_run)(*task) for task in tasks)


def _batches(tasks: list[Any], size: int) -> Iterable[list[Any]]:
    return (tasks[k : k + size] for k in range(0, len(tasks), size))


@contextmanager
def _cluster(backend: str, scheduler: str | None) -> Iterator[None]:
    """Connect joblib to a backend for the time of the runs."""
    if backend not in BACKENDS:
        raise UsageError(f"unknown backend {backend!r}; expected one of {', '.join(BACKENDS)}")
    if backend == "loky":
        if scheduler is not None:
            raise UsageError("--scheduler needs --backend dask or ray")
        yield
        return
    from joblib import parallel_config

    try:
        with _connected(backend, scheduler), parallel_config(backend=backend):
            yield
    except ModuleNotFoundError as error:
        remedy = f"pip install 'tcp-drill[{backend}]'"
        raise UsageError(f"--backend {backend} needs {error.name}: {remedy}") from None


@contextmanager
def _connected(backend: str, scheduler: str | None) -> Iterator[None]:
    if backend == "dask":
        if scheduler is None:
            raise UsageError("--backend dask needs --scheduler ADDRESS of a running cluster")
        from distributed import Client

        with Client(scheduler):
            yield
        return
    import ray
    from ray.util.joblib import register_ray

    ray.init(address=scheduler or "auto")
    register_ray()
    try:
        yield
    finally:
        ray.shutdown()
