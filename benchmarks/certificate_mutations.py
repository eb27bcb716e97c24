"""A million mutated certificates: everything the checker accepts has to be true.

    python benchmarks/certificate_mutations.py [--total 1000000] [--workers 2]

Prints one line per kind of mutation (tried, refused, still true) and leaves with 1 if the
checker accepted a falsehood.  The same code runs 10,000 of them in the test suite.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from tests.certificates.mutation_run import Tally, bases, kinds, lies, run

CHUNK = 10_000


def chunk(seed: int) -> Tally:
    """One chunk of mutations over its own certificates."""
    texts = bases(4, seed=1_000 * seed)
    return run(CHUNK, seed, texts + lies(texts))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--total", type=int, default=1_000_000)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    started = time.perf_counter()
    tried, refused, accepted, false = Counter(), Counter(), Counter(), []
    with ProcessPoolExecutor(given.workers) as pool:
        for tally in pool.map(chunk, range(1, given.total // CHUNK + 1)):
            tried.update(tally.tried), refused.update(tally.refused)
            accepted.update(tally.accepted), false.extend(tally.false)
    print(f"{'mutation':32} {'tried':>9} {'refused':>9} {'still true':>10}")
    for kind in kinds():
        print(f"{kind:32} {tried[kind]:9,} {refused[kind]:9,} {accepted[kind]:10,}")
    total, no, yes = (sum(c.values()) for c in (tried, refused, accepted))
    seconds = time.perf_counter() - started
    print(f"{'all':32} {total:9,} {no:9,} {yes:10,}   {seconds:.0f} s")
    print(f"falsehoods accepted: {len(false)}")
    print("\n".join(false[:3]))
    return bool(false)


if __name__ == "__main__":
    sys.exit(main())
