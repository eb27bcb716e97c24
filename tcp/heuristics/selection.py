"""Roulette wheel and ranking, shared by the genetic algorithms."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from tcp.jit import lean
from tcp.travel import Ints

Floats = NDArray[np.float64]


@lean
def spin_up(times: Ints, slots: Ints, population: int, wheel: Floats) -> None:
    """The cumulative shares of the parents: each in proportion to 1 over its time (or cost)."""
    total = 0.0
    for k in range(population):
        total += 1.0 / max(times[slots[k]], 1)
        wheel[k] = total


@lean
def spin(rng: Generator, wheel: Floats) -> int:
    """The first parent whose cumulative probability exceeds a random number."""
    at = rng.random() * wheel[-1]
    low, high = 0, len(wheel) - 1
    while low < high:
        middle = (low + high) // 2
        if wheel[middle] > at:
            high = middle
        else:
            low = middle + 1
    return low


@lean
def rank(times: Ints, slots: Ints, end: int) -> None:
    """Sort ``slots[:end]`` by time; stable, and quick where the first NP are sorted already."""
    for k in range(1, end):
        slot = slots[k]
        at = k
        while at > 0 and times[slots[at - 1]] > times[slot]:
            slots[at] = slots[at - 1]
            at -= 1
        slots[at] = slot
