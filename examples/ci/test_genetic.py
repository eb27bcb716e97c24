"""The third-party solver's own tests, judged by the fixture ``drill_oracle``.

CROSSOVER=one-point pytest examples/ci    fails, and says which holes come twice
CROSSOVER=order pytest examples/ci        passes
"""

import importlib.util
import os
from pathlib import Path

import pytest

HERE = Path(__file__).parent
spec = importlib.util.spec_from_file_location("genetic", HERE / "genetic.py")
genetic = importlib.util.module_from_spec(spec)
spec.loader.exec_module(genetic)

CROSSOVER = os.environ.get("CROSSOVER", "order")
POINTS = genetic.read_board(HERE / "board.csv")


@pytest.mark.drill("board.csv", travel="sequential", numbering="0")
def test_routes_are_valid(drill_oracle):
    for seed in range(5):
        drill_oracle.assert_valid(genetic.solve(POINTS, CROSSOVER, seed))


@pytest.mark.drill("board.csv", travel="sequential", numbering="0")
def test_routes_are_within_ten_percent(drill_oracle):
    drill_oracle.assert_optimal(genetic.solve(POINTS, CROSSOVER), within=0.1)


def test_optimum_is_what_it_was(drill_oracle):
    assert drill_oracle.optimum("board.csv", "sequential") <= genetic.length(
        genetic.solve(POINTS, "order"), POINTS
    )
