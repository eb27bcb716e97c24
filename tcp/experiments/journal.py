"""The results file: one JSON line a run, appended as runs finish, safe against being killed.

A line counts only if it is whole: valid JSON with every field, ended by a
newline, and its checksum right.  Anything else is what a killed process left
behind; it is skipped, and the run is made again.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from tcp.errors import InputError, OutputError, system_reason


@dataclass(frozen=True)
class Run:
    """One finished run.

    Parameters
    ----------
    key : str
        What it depends on (:meth:`tcp.experiments.spec.Column.key`).
    seed : int
        Its seed.
    optimum, cost : int or None
        The proved optimum it was measured against and its best cost, in quanta.
    route : str
        The best route, holes by id, separated by blanks.
    trace : list of [iteration, cost]
        Best so far, one entry an improvement; iteration 0 is the initial population.
    iterations, evaluations : int or None
        Made, until the optimum was hit or the limit reached; None where the solver counts none.
    seconds, cpu : float
        Wall time of the run, and processor time of the thread that made it.
    """

    key: str
    seed: int
    optimum: int | None
    cost: int | None
    route: str
    trace: list[list[int]]
    iterations: int | None
    evaluations: int | None
    seconds: float
    cpu: float

    @property
    def optimal(self) -> bool:
        """Whether the run has the optimum."""
        return self.cost is not None and self.optimum is not None and self.cost <= self.optimum

    @property
    def hit(self) -> int | None:
        """Iteration at which the run first had the optimum: its last one, if the trace lacks it."""
        if self.iterations is None or self.optimum is None or not self.optimal:
            return None
        return next((at for at, cost in self.trace if cost <= self.optimum), self.iterations)

    @property
    def last(self) -> int | None:
        """Iteration of the last improvement."""
        if self.iterations is None:
            return None
        return self.trace[-1][0] if self.trace else 0


class Journal:
    """An append-only file of :class:`Run`.

    Parameters
    ----------
    path : path
        The file; created with the first run.
    curves : bool
        Whether to keep whole traces.  Without them a line has 200 bytes instead of
        thousands: the last improvement is enough for every table, not for a figure.
    """

    def __init__(self, path: str | Path, *, curves: bool = True):
        self.path, self.curves = Path(path), curves

    def runs(self) -> dict[str, Run]:
        """Every whole run in the file by its key; a run made twice counts once.

        Raises
        ------
        InputError
            If the file cannot be read.
        """
        return {run.key: run for run in self._whole()}

    def _whole(self) -> Iterator[Run]:
        try:
            data = self.path.read_bytes()
        except FileNotFoundError:
            return
        except OSError as error:
            reason = system_reason(error)
            raise InputError(f"cannot read the results: {reason}", self.path) from None
        *lines, _ = data.split(b"\n")  # what stands behind the last newline is half a line
        for line in lines:
            run = _parse(line)
            if run is not None:
                yield run

    def append(self, run: Run) -> None:
        """Add one run and see it to the disk.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        self._write(_line(run if self.curves else replace(run, trace=run.trace[-1:])))

    def prepare(self) -> None:
        """End a line that a killed process left half-written; fail now rather than after a run.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        self._write(b"")

    def _write(self, line: bytes) -> None:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("ab+") as file:
                end = file.seek(0, os.SEEK_END)
                file.seek(max(end - 1, 0))
                torn = end > 0 and file.read(1) != b"\n"
                file.write((b"\n" if torn else b"") + line)
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise OutputError(f"cannot write {self.path}: {system_reason(error)}") from None


def _line(run: Run) -> bytes:
    body = json.dumps(asdict(run), separators=(",", ":")).encode()
    return b"%08x %s\n" % (zlib.crc32(body), body)


def _parse(line: bytes) -> Run | None:
    head, _, body = line.partition(b" ")
    if head != b"%08x" % zlib.crc32(body):
        return None
    try:
        data: Any = json.loads(body)
    except ValueError:
        return None
    if not isinstance(data, dict) or set(data) != {f.name for f in fields(Run)}:
        return None
    return Run(**data)
