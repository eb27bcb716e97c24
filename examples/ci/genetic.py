"""A third-party drill router: a small genetic algorithm, with the classic bug as an option.

``crossover="one-point"`` glues the head of one parent to the tail of the other
as if a route were a bit string: holes come twice and others never.
``crossover="order"`` (OX) fills the rest in the other parent's order.
"""

from __future__ import annotations

import csv
import itertools
import random
from pathlib import Path

Point = tuple[float, float]


def read_board(path: str | Path) -> list[Point]:
    lines = [line for line in Path(path).read_text().splitlines() if not line.startswith("#")]
    return [(float(row["x"]), float(row["y"])) for row in csv.DictReader(lines)]


def length(route: list[int], points: list[Point]) -> float:
    """Time of a route, axes one after the other at 1 mm/s."""
    moves = itertools.pairwise(points[hole] for hole in route)
    return sum(abs(a[0] - b[0]) + abs(a[1] - b[1]) for a, b in moves)


def one_point(a: list[int], b: list[int], rng: random.Random) -> list[int]:
    cut = rng.randrange(1, len(a))
    return a[:cut] + b[cut:]


def order(a: list[int], b: list[int], rng: random.Random) -> list[int]:
    i, j = sorted(rng.sample(range(len(a) + 1), 2))
    middle = a[i:j]
    rest = [hole for hole in b if hole not in middle]
    return rest[:i] + middle + rest[i:]


def improve(route: list[int], points: list[Point]) -> list[int]:
    """Reverse segments and move holes while that helps."""
    best, better = route, True
    while better:
        better = False
        for i in range(len(best)):
            for j in range(i + 1, len(best) + 1):
                turned = best[:i] + best[i:j][::-1] + best[j:]
                moved = best[:i] + best[i + 1 : j] + [best[i]] + best[j:]
                for other in (turned, moved):
                    if length(other, points) < length(best, points) - 1e-9:
                        best, better = other, True
    return best


def solve(points: list[Point], crossover: str = "one-point", seed: int = 1) -> list[int]:
    """A drilling order as numbers from 0."""
    rng = random.Random(seed)
    cross = {"one-point": one_point, "order": order}[crossover]
    people = [rng.sample(range(len(points)), len(points)) for _ in range(8)]
    people = [improve(p, points) for p in people]
    for _ in range(15):
        child = improve(cross(*rng.sample(people, 2), rng), points)
        people.sort(key=lambda p: length(p, points))
        if length(child, points) <= length(people[-1], points):
            people[-1] = child
    return min(people, key=lambda p: length(p, points))
