"""Independent tasks on many processes: joblib's own workers, or an existing Dask or Ray cluster.

There is no scheduler here: joblib hands the tasks out.  This module connects
it, keeps what is finished, and makes the tasks again that a dead worker took
with it.  A task is a pure function of its argument, so what comes back does
not depend on where it ran, on how many workers there are, or on who died.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import TypeVar

from tcp.errors import TcpError, UsageError

Task = TypeVar("Task")
Answer = TypeVar("Answer")

BACKENDS = ("loky", "dask", "ray")

TRIES = 3
"""How many times in a row workers may die before a single task is finished."""

BATCH = 32
"""Tasks handed to Ray at a time: its joblib backend gives back whole batches only."""


class FleetError(TcpError):
    """Workers, or the cluster itself, are lost and stay lost; what had come back is kept."""


@dataclass(frozen=True)
class Fleet:
    """Where tasks run.

    Parameters
    ----------
    jobs : int, optional
        Processes; default: one a core, or all that the cluster has.
    backend : {"loky", "dask", "ray"}
        Processes of this machine, or joblib's backend for a cluster.
    scheduler : str, optional
        Address of the Dask scheduler, ``HOST:PORT``, or of the Ray head.

    Raises
    ------
    UsageError
        For an unknown backend, or an address where there is nothing to reach.
    """

    jobs: int | None = None
    backend: str = "loky"
    scheduler: str | None = None

    def __post_init__(self) -> None:
        if self.backend not in BACKENDS:
            known = ", ".join(BACKENDS)
            raise UsageError(f"unknown backend {self.backend!r}; expected one of {known}")
        if self.backend == "loky" and self.scheduler is not None:
            raise UsageError("--scheduler needs --backend dask or ray")
        if self.backend == "dask" and self.scheduler is None:
            raise UsageError("--backend dask needs --scheduler HOST:PORT of a running cluster")

    @property
    def alone(self) -> bool:
        """Whether tasks run one after the other in this process."""
        return self.backend == "loky" and self.jobs == 1

    def run(
        self, function: Callable[[Task], Answer], tasks: Sequence[Task]
    ) -> Iterator[tuple[int, Answer]]:
        """Number and answer of every task, as soon as it is finished, in any order.

        Parameters
        ----------
        function : callable
            A function of a module, without side effects that would hurt if
            they happened twice.
        tasks : sequence
            Its arguments; they and the answers travel pickled.

        Raises
        ------
        UsageError
            If the backend's package is not installed or the cluster is not there.
        FleetError
            If workers die again and again before any task is finished.
        """
        if self.alone or not tasks:
            yield from ((k, function(task)) for k, task in enumerate(tasks))
            return
        left, deaths = dict(enumerate(tasks)), 0
        with self._connected() as lost:
            while left:
                try:
                    for number, answer in self._once(function, left):
                        del left[number]
                        deaths = 0
                        yield number, answer
                except lost as error:
                    deaths += 1
                    if deaths == TRIES:
                        raise FleetError(_obituary(len(left), error)) from error

    def _once(
        self, function: Callable[[Task], Answer], left: dict[int, Task]
    ) -> Iterator[tuple[int, Answer]]:
        """Hand out what is left; stops with an exception where a worker's death breaks the pool."""
        from joblib import Parallel, delayed

        numbers = list(left)
        count = self.jobs or (own_cores() if self.backend == "loky" else -1)
        if self.backend == "ray":
            for k in range(0, len(numbers), BATCH):
                batch = numbers[k : k + BATCH]
                pool = Parallel(n_jobs=count)
                yield from pool(delayed(_numbered)(function, n, left[n]) for n in batch)
            return
        pool = Parallel(n_jobs=count, return_as="generator_unordered")
        with _deaf():  # workers are started here
            answers = pool(delayed(_numbered)(function, n, left[n]) for n in numbers)
        yield from answers

    @contextmanager
    def _connected(self) -> Iterator[tuple[type[Exception], ...]]:
        """Connect joblib for the time of the tasks; yields what the loss of workers raises."""
        if self.backend == "loky":
            yield (BrokenProcessPool,)
            return
        from joblib import parallel_config

        with ExitStack() as stack:
            try:
                connect = _dask if self.backend == "dask" else _ray
                lost = stack.enter_context(connect(self.scheduler))
            except ModuleNotFoundError as error:
                remedy = f"pip install 'tcp-drill[{self.backend}]'"
                raise UsageError(f"--backend {self.backend} needs {error.name}: {remedy}") from None
            stack.enter_context(parallel_config(backend=self.backend))
            yield lost


def own_cores() -> int:
    """Cores that this process may use, which are not all of them under ``taskset`` or in a jail."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def threads(most: int) -> int:
    """How many threads a task should use here: one a core of its own, at most ``most``.

    joblib tells its workers by ``OMP_NUM_THREADS`` how many cores each has, unless
    the user set that; without it, all that the process may use are its own.
    """
    said = os.environ.get("OMP_NUM_THREADS", "")
    return max(1, min(most, int(said) if said.isdigit() else own_cores()))


@contextmanager
def _deaf() -> Iterator[None]:
    """Processes started inside ignore Ctrl-C for good; this one answers it and ends them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _numbered(function: Callable[[Task], Answer], number: int, task: Task) -> tuple[int, Answer]:
    return number, function(task)


def _obituary(left: int, error: Exception) -> str:
    tasks = "one task" if left == 1 else f"{left} tasks"
    reason = " ".join(str(error).split()) or type(error).__name__
    return f"workers died {TRIES} times in a row with {tasks} left ({reason:.200})"


CONNECT = 10
"""Seconds in which a scheduler has to answer."""


@contextmanager
def _dask(scheduler: str | None) -> Iterator[tuple[type[Exception], ...]]:
    """A client of a running Dask cluster; the scheduler itself moves tasks off dead workers."""
    from distributed import Client, KilledWorker
    from distributed.client import FutureCancelledError
    from distributed.comm import CommClosedError
    from distributed.utils import LoopRunner

    try:
        LoopRunner().run_sync(_greet, scheduler)
        client = Client(scheduler, timeout=CONNECT, set_as_default=True)
    except (TimeoutError, MemoryError):  # nothing is said there, or words taken for huge lengths
        remedy = "expected its own port, not that of its dashboard"
        raise UsageError(f"what is at {scheduler} is no Dask scheduler; {remedy}") from None
    except (OSError, ValueError) as error:
        raise UsageError(f"no Dask scheduler answers at {scheduler}: {error}") from None
    with client:
        try:
            yield KilledWorker, FutureCancelledError, CommClosedError
        except OSError as error:
            if client.status == "running":  # the task's own
                raise
            raise FleetError(f"the Dask scheduler at {scheduler} is lost ({error})") from error


async def _greet(scheduler: str) -> None:
    """See that a scheduler answers in time; a client alone waits for the first word for ever."""
    import asyncio

    from distributed.comm import connect

    comm = await asyncio.wait_for(connect(scheduler, timeout=CONNECT), 2 * CONNECT)
    await comm.close()


@contextmanager
def _ray(address: str | None) -> Iterator[tuple[type[Exception], ...]]:
    """A connection to a running Ray cluster."""
    import ray
    from ray.exceptions import NodeDiedError, RayActorError, WorkerCrashedError
    from ray.util.joblib import register_ray

    try:
        ray.init(address=address or "auto", log_to_driver=False)
    except (ConnectionError, ValueError) as error:
        raise UsageError(f"no Ray cluster answers at {address or 'auto'}: {error}") from None
    register_ray()
    try:
        yield RayActorError, WorkerCrashedError, NodeDiedError
    finally:
        ray.shutdown()
