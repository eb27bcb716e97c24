"""Held-Karp bounds of growing workpieces: value, time and memory.

    python benchmarks/bounds.py [--corpus DIR] [--sizes 1000 10000 100000]

Random uniform workpieces (Euclidean, quantum 1/1000 of the mean spacing) and, with a corpus, its
TSPLIB files as open paths in sequential travel.  For random points the Held-Karp bound of a closed
tour is about 0.7080 sqrt(n A) (Johnson, McGeoch and Rothberg, SODA 1996), the column's comparison.
"""

from __future__ import annotations

import argparse
import resource
import time
from fractions import Fraction
from pathlib import Path

import numpy as np

from tcp import Instance, Model, Travel, Workpiece
from tcp.bounds.one_tree import one_tree_bound
from tcp.files import read


def scattered(n: int) -> Instance:
    """``n`` random holes on a square whose side is 1000 sqrt(n) steps."""
    side = int(1000 * n**0.5)
    x, y = np.random.default_rng(n).integers(0, side, (2, n))
    piece = Workpiece(f"random {n}", tuple(map(str, range(n))), x, y)
    return Instance(piece, Travel(Model.EUCLIDEAN, quantum=Fraction(1)))


def row(instance: Instance) -> None:
    """One line of the table."""
    started = time.perf_counter()
    cpu = time.process_time()
    bound = one_tree_bound(instance)
    wall, cpu = time.perf_counter() - started, time.process_time() - cpu
    n, peak = len(instance), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    share = ""
    if instance.name.startswith("random"):
        share = f"{bound.value / (1000 * n):.4f}"
    value = float(bound.value * instance.quantum)
    print(
        f"{instance.name:16} {n:7} {value:16,.2f} {share:>7} "
        f"{bound.iterations:6} {wall:8.1f} {cpu:8.1f} {peak:7}",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="*", default=[1_000, 10_000, 100_000])
    parser.add_argument("--corpus", type=Path)
    given = parser.parse_args()
    one_tree_bound(scattered(100))  # compile
    print(f"{'instance':16} {'holes':>7} {'bound':>16} {'/sqrtnA':>7} {'trees':>6}", end=" ")
    print(f"{'wall s':>8} {'cpu s':>8} {'MiB':>7}")
    for n in given.sizes:
        row(scattered(n))
    for path in sorted((given.corpus / "tsplib").glob("*.tsp")) if given.corpus else ():
        row(Instance(read(path).workpiece, Travel()))


if __name__ == "__main__":
    main()
