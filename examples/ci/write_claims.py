"""Write the solver's answers as a claims file, for ``tcp audit`` in CI.

python examples/ci/write_claims.py order > answers.claims.toml
tcp audit answers.claims.toml --format sarif --out findings.sarif
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import genetic


def claims(crossover: str) -> str:
    """One route claim per seed."""
    points = genetic.read_board(Path(__file__).parent / "board.csv")
    parts = [
        'format = "tcp-claims-1"\n\n[source]\nkey = "genetic"\ntitle = "A genetic drill router"\n',
        '\n[[workpiece]]\nid = "board"\nwhere = "board.csv"\nfile = "board.csv"\n',
    ]
    for seed in range(3):
        route = genetic.solve(points, crossover, seed)
        time = genetic.length(route, points)
        parts.append(
            f'\n[[route]]\nid = "seed-{seed}"\nwhere = "solve(seed={seed})"\nworkpiece = "board"\n'
            f'travel = "sequential"\nnumbering = "0"\nsequence = {route}\ntime = {time}\n'
        )
    return "".join(parts)


if __name__ == "__main__":
    print(claims(sys.argv[1] if len(sys.argv) > 1 else "order"), end="")
