"""How the judge scales: a million holes, ten million entries, in time and memory.

    python benchmarks/judge.py [--holes 1000000]

Each case runs in a process of its own; prints one line per case with the seconds of the judgement
(building the instance apart), the process's peak memory, and what was found.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))

from tcp import Instance, Workpiece
from tcp.files.order import read_order
from tcp.validate import repair, validate
from tcp.validate.known import Known


def board(holes: int) -> Workpiece:
    rng = np.random.default_rng(1)
    x, y = rng.integers(0, 10**6, (2, holes))
    return Workpiece("random", tuple(map(str, range(1, holes + 1))), x, y)


def shuffled(holes: int) -> np.ndarray:
    return np.random.default_rng(2).permutation(holes) + 1


def valid(holes: int) -> str:
    """A route with its right time."""
    instance = Instance(board(holes))
    route = shuffled(holes)
    claimed = str(instance.cost((route - 1).tolist()))
    return judged(lambda: validate(instance, route, claimed=claimed, known=Known(1)))


def wrong_time(holes: int) -> str:
    """A route with a wrong time: all other readings are tried."""
    instance = Instance(board(holes))
    return judged(lambda: validate(instance, shuffled(holes), claimed="12345.6"))


def corrupted(holes: int) -> str:
    """Half of all entries replaced at random."""
    instance, route = Instance(board(holes)), shuffled(holes)
    rng = np.random.default_rng(3)
    at = rng.random(holes) < 0.5
    route[at] = rng.integers(-5, holes + 5, int(at.sum()))
    return judged(lambda: validate(instance, route))


def ten_million(holes: int) -> str:
    """Ten million entries in a text file, for a board of 49 holes."""
    instance = Instance(board(49))
    entries = np.random.default_rng(4).integers(1, 52, 10_000_000)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "route.txt"
        path.write_bytes(b"\n".join(entries.astype("S2").tolist()))
        return judged(lambda: validate(instance, read_order(path, instance.workpiece), claimed="1"))


def mended(holes: int) -> str:
    """A tenth as many holes, two entries wrong: the exact cheapest repair."""
    instance, route = Instance(board(holes // 10)), shuffled(holes // 10)
    route[5], route[-7] = route[50], route[60]
    started = time.perf_counter()
    found = repair(instance, route)
    seconds = time.perf_counter() - started
    best = "refused" if found.best is None else f"best {found.best.cost}"
    return f"{seconds:8.2f} s  {found.total} smallest repairs, {best}"


def judged(run) -> str:
    started = time.perf_counter()
    verdict = run()
    seconds = time.perf_counter() - started
    codes = ", ".join(f"{n} x {code}" for code, n in sorted(Counter(verdict.codes()).items()))
    return f"{seconds:8.2f} s  {verdict.count.length} entries: {codes}"


CASES = {f.__name__: f for f in (valid, wrong_time, corrupted, ten_million, mended)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--holes", type=int, default=1_000_000)
    parser.add_argument("--case", choices=CASES, help="run one case in this process")
    given = parser.parse_args()
    if given.case:
        text = CASES[given.case](given.holes)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"{given.case:<12} {peak:7.0f} MB {text}")
        return
    print(f"{given.holes} holes; numpy {np.__version__}, Python {sys.version.split()[0]}")
    for name in CASES:
        command = [sys.executable, __file__, "--holes", str(given.holes), "--case", name]
        print(subprocess.run(command, capture_output=True, text=True, check=True).stdout, end="")


if __name__ == "__main__":
    main()
