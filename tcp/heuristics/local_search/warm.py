"""Compiling before any clock runs: what breeding needs in a second process, the rest in this one.

numba compiles under the interpreter lock, so threads do not help.  Both processes keep what they
compile in the cache on disk, and what one has finished the other loads.  Once a machine.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path
from subprocess import DEVNULL, Popen

import numpy as np

from tcp import jit
from tcp.fleet import threads
from tcp.heuristics.local_search import starts
from tcp.heuristics.local_search.alpha import alpha_nearest
from tcp.heuristics.local_search.anneal import FEW, Search
from tcp.heuristics.local_search.crossover import mate
from tcp.heuristics.local_search.population import Population
from tcp.heuristics.local_search.survey import bare_ground, survey
from tcp.instance import Ends, Instance, TourForm
from tcp.result import silent
from tcp.stop import Clock, Stop
from tcp.workpiece import Workpiece


@cache
def warm_up() -> None:
    """Compile (or load from the cache) every kernel, on two clusters of a dozen holes."""
    form, rng, clock = _clusters(), np.random.default_rng(0), Clock(Stop())
    with _second_process():
        ground = survey(form, 4)
        ground = alpha_nearest(ground, starts.greedy(ground), form.real, 4)
        orders = starts.greedy(ground), starts.curve(ground)
        searches = [Search(ground, order, rng, clock, silent) for order in orders]
        for search in searches:
            search.descend()
            search.first.kick(8, 0.0)
    for search in searches:
        search.kick(8, 1)
        search.kick(FEW * ground.size, 1)


def warm_breeding() -> None:
    """Compile what breeding needs, without a search before it."""
    ground, rng = bare_ground(_clusters()), np.random.default_rng(0)
    tours = [(rng.permutation(ground.size).astype(np.int32), 0) for _ in range(2)]
    with ThreadPoolExecutor(1) as pool:
        Population(ground, tours, greed=1.0).breed(rng, pool, Clock(Stop()), lambda *_: None)


def _clusters() -> TourForm:
    x = np.tile(np.arange(12, dtype=np.int64) ** 2 % 13, 2)
    piece = Workpiece("warm-up", tuple(map(str, range(24))), x + np.repeat([0, 500], 12), x[::-1])
    return Instance(piece, ends=Ends(start=0)).form


@contextmanager
def _second_process() -> Iterator[None]:
    """Compile what breeding needs in a second process, if it is not on disk and a core is free.

    If that fails in any way, it is compiled here afterwards.
    """
    with ExitStack() as stack:
        process = None
        if threads(2) > 1 and not jit.on_disk(mate) and _is_python(sys.executable):
            code = f"import sys; sys.path[:] = {sys.path!r}; import {__name__} as w"
            command = [sys.executable, "-c", f"{code}; w.warm_breeding()"]
            with suppress(OSError):
                process = stack.enter_context(Popen(command, stdout=DEVNULL, stderr=DEVNULL))
        try:
            yield
        except BaseException:
            if process is not None:
                process.kill()
            raise


def _is_python(program: str | None) -> bool:
    """Whether a program is the interpreter, not one that embeds it or was frozen with it."""
    frozen = getattr(sys, "frozen", False)
    return not frozen and Path(program or "").name.startswith("python")
