"""A million mutated certificates: everything the checker accepts has to be true.

    python benchmarks/certificate_mutations.py [--total 1000000] [--workers 2] [--seconds S]

Prints one line per kind of mutation (tried, refused, still true) and leaves with 1 if the
checker accepted a falsehood.  The same code runs 10,000 of them in the test suite.  Chunks of
10,000 are appended to benchmarks/results/certificate_mutations.jsonl, so that an interrupted run
goes on where it stopped; a change of the checker begins anew.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.certificates.mutation_run import bases, checker, kinds, lies, run

CHUNK = 10_000
ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results" / "certificate_mutations.jsonl"


def chunk(seed: int) -> dict[str, Any]:
    """One chunk of mutations over its own certificates."""
    started = time.process_time()
    texts = bases(4, seed=1_000 * seed)
    tally = run(CHUNK, seed, texts + lies(texts))
    return {
        "seed": seed,
        "checker": version(),
        "seconds": round(time.process_time() - started, 1),
        "tried": tally.tried,
        "refused": tally.refused,
        "accepted": tally.accepted,
        "false": tally.false,
    }


def version() -> str:
    """The checker's own bytes, in short."""
    return hashlib.sha256(Path(checker.__file__).read_bytes()).hexdigest()[:16]


def done() -> list[dict[str, Any]]:
    """The chunks that this very checker has been through."""
    lines = RESULTS.read_text().splitlines() if RESULTS.exists() else []
    return [r for r in map(json.loads, lines) if r["checker"] == version()]


def table(chunks: list[dict[str, Any]]) -> str:
    """One line per kind."""
    tried, refused, accepted = (
        sum((Counter(c[name]) for c in chunks), Counter[str]())
        for name in ("tried", "refused", "accepted")
    )
    lines = [f"{'mutation':32} {'tried':>9} {'refused':>9} {'still true':>10}"]
    lines += [f"{k:32} {tried[k]:9,} {refused[k]:9,} {accepted[k]:10,}" for k in kinds()]
    total, no, yes = (sum(c.values()) for c in (tried, refused, accepted))
    seconds = sum(c["seconds"] for c in chunks)
    lines.append(f"{'all':32} {total:9,} {no:9,} {yes:10,}   {seconds:.0f} CPU s")
    lines.append(f"falsehoods accepted: {sum(len(c['false']) for c in chunks)}")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--total", type=int, default=1_000_000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="begin no chunk after")
    given = parser.parse_args()
    started, known = time.perf_counter(), {c["seed"] for c in done()}
    seeds = [s for s in range(1, given.total // CHUNK + 1) if s not in known]
    with ProcessPoolExecutor(given.workers) as pool:
        waiting = [pool.submit(chunk, seed) for seed in seeds]
        for finished in as_completed(waiting):
            if finished.cancelled():
                continue
            with RESULTS.open("a") as stream:
                stream.write(json.dumps(finished.result()) + "\n")
            if time.perf_counter() - started > given.seconds:
                pool.shutdown(wait=False, cancel_futures=True)
    print(table(done()))
    return any(c["false"] for c in done())


if __name__ == "__main__":
    sys.exit(main())
