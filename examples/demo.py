"""What ``make demo`` runs: the papers' workpieces, both cases, through every exact model.

Every row is one workpiece in one of the papers' two cases; the columns named
after solvers show the seconds each took to its proof.  All must agree.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from tcp import Instance, Result, Status, Travel, solve
from tcp.errors import UsageError
from tcp.files import read
from tcp.report.table import columns
from tcp.result import decimal
from tcp.solve import SOLVERS
from tcp.stop import Stop
from tcp.travel import parse_model

ROOT = Path(__file__).resolve().parents[1]
PIECES = ("wp1", "wp2", "wp3", "fa14")
CASES = ("case1", "case2")
PROVERS = ("held-karp", "cp-sat", "milp", "branch-and-cut")
LIMIT = Stop(time=30)


def proved(instance: Instance, solver: str) -> Result | None:
    """The solver's answer, or None where the instance is too large for it."""
    try:
        return solve(instance, solver, exact=True, stop=LIMIT)
    except UsageError:
        return None


def row(piece: str, case: str, solvers: list[str]) -> tuple[list[str], bool]:
    """One line of the table, and whether all solvers proved the same optimum."""
    reading = read(ROOT / "data" / f"{piece}.csv")
    instance = Instance(reading.workpiece, Travel(parse_model(case)))
    results = {name: proved(instance, name) for name in solvers}
    answers = [r for r in results.values() if r is not None]
    agreed = {r.cost for r in answers if r.status is Status.OPTIMAL}
    good = len(agreed) == 1 and all(r.status is Status.OPTIMAL for r in answers)
    optimum = decimal(agreed.pop() * instance.quantum) if good else "NOT PROVED"
    seconds = ["-" if r is None else f"{r.seconds:.2f}" for r in results.values()]
    return [piece, str(len(instance)), case, str(instance.travel.model), optimum, *seconds], good


def main() -> int:
    """Print the table; 0 if every solver proved every optimum and all agree."""
    started = time.monotonic()
    solvers = [name for name in PROVERS if name in SOLVERS]
    print("Shortest drilling orders (open path, any start and end, axes at 1 mm/s), proved by")
    print("every exact model; seconds to the proof (a solver's first row includes its loading).")
    print("The first run on a machine compiles for about half a minute.\n", flush=True)
    rows, good = [], True
    for piece in PIECES:
        for case in CASES:
            line, agreed = row(piece, case, solvers)
            rows.append(line)
            good &= agreed
    header = ["workpiece", "holes", "case", "travel", "shortest time", *solvers]
    print(columns(header, rows))
    print(f"\nAll solvers agree: {'yes' if good else 'NO'}. ", end="")
    print(f"Total {time.monotonic() - started:.1f} s. Next: tcp solve --exact data/wp3.csv")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
