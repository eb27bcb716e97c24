"""BMGA: the bi-objective multi-population genetic algorithm of Yang et al.

Source: H.-C. Yang, K.-J. Liu, M.-H. Hung, F.-T. Cheng, "Drill-path optimization
with time limit and thermal protection".  Step numbers are those of its Section
II.  The paper's three methods are

* mGAuk: ``crossover="uniform"``, ``clusters=True`` (the default),
* mGAu:  ``crossover="uniform"``, ``clusters=False``,
* mGAp:  ``crossover="points"``, ``clusters=False``.

The process rules (D_m, k diameters, axis balance, T_sm) belong to the instance
(:class:`tcp.rules.Rules`); where it has no balance rule, the paper's own window
(w = 10, 0.5 to 2) guides the search.

Readings chosen, because the paper is silent:

* Equation (1) leaves f open: the fitness is 1 / (travel + price * unbalanced
  windows), the price of a window being ``weight`` mean legs of the first path.
  A broken rule costs more than any path.
* Step 1, "a random point, which is derived by the K-NN method": a path of
  nearest neighbours from a random hole; with ``clusters`` it may take any of
  the ``knn`` nearest, each farther one with a quarter of the chance.
* Substrates ("K-NN using the nearest distance ratio"): holes are joined to
  their K nearest neighbours that lie within ``ratio`` times the mean distance
  of such neighbours; what hangs together is a substrate.  More than
  ``substrate`` holes are halved across the longer side until they fit.
* Step 4: multi-point crossover takes alternate stretches between random points
  from the first parent, uniform crossover every gene with probability 1/2; the
  other places take the other genes in the sequence of the second parent.
  Mutation reverses the path between two random points.
* Step 6: an epoch is ``epoch`` generations; a population stops when more than
  ``stall`` epochs in a row improved its path by no more than T_RPI, the others go on.
  "Terminate if it violated the minimum hole distance or moved continually along a
  single axis for 10 holes" is no end of the run here: these are rules of the instance.
  T_sm, which "a single continuous movement" must not exceed, is a number of moves.
* "The position nearest to two neighboring clusters is taken as the starting points":
  paths start anywhere here, and meet in Step 7.
* Step 7: from the start on, always the nearest end of a sub-path not yet joined.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from tcp.errors import UsageError
from tcp.heuristics.orders import TRIVIAL, Orders, below, enumerate_all, length, orders, part
from tcp.heuristics.selection import rank, spin, spin_up
from tcp.heuristics.substrates import join, substrates
from tcp.instance import MATRIX_LIMIT, Instance
from tcp.jit import kernel, lean
from tcp.result import Outcome, Progress, Report
from tcp.rules import Balance, unbalanced
from tcp.stop import Clock, StopReason
from tcp.travel import SAFE, Ints
from tcp.validate.route import faults

Genes = NDArray[np.int32]
Floats = NDArray[np.float64]
Marks = NDArray[np.bool_]


def refusal(instance: Instance) -> str | None:
    """Why the instance cannot be searched, or None."""
    form = instance.form
    if form.size > MATRIX_LIMIT:
        return None if form.matrix is None else f"a matrix beyond {MATRIX_LIMIT} nodes"
    highest = int(form.full_matrix().max())
    if (highest * form.size + 1) * (form.size + 1) >= SAFE:
        return "its penalties for broken rules would exceed 62-bit integers"
    return None


@dataclass(frozen=True)
class Settings:
    """The parameters of :func:`run` that the populations share."""

    np: int
    mr: float
    uniform: bool
    points: int
    clusters: bool
    knn: int
    ratio: float
    substrate: int
    epoch: int
    stall: int
    trpi: float
    te: float
    weight: float

    def __post_init__(self) -> None:
        if min(self.np, self.points, self.knn, self.epoch, self.substrate) < 2 or self.stall < 0:
            raise UsageError("bmga needs np, points, knn, epoch, substrate >= 2 and stall >= 0")
        if not 0 <= self.mr <= 1 or min(self.ratio, self.trpi, self.te, self.weight) < 0:
            raise UsageError("bmga needs mr in [0, 1] and no negative ratio, trpi, te or weight")


def run(
    instance: Instance,
    *,
    rng: Generator,
    clock: Clock,
    report: Report,
    np: int = 50,
    mr: float = 0.5,
    crossover: str = "uniform",
    points: int = 4,
    clusters: bool = True,
    knn: int = 3,
    ratio: float = 2.0,
    substrate: int = 200,
    epoch: int = 100,
    stall: int = 10,
    trpi: float = 0.05,
    te: float = 1800.0,
    weight: float = 1.0,
) -> Outcome:
    """Search with the bi-objective multi-population genetic algorithm.

    Parameters
    ----------
    instance, rng, clock, report
        As in every solver.
    np : int
        Chromosomes of each population, >= 2.
    mr : float
        Mutation rate, in [0, 1].
    crossover : {"uniform", "points"}
        mGAu or mGAp.
    points : int
        Points of the multi-point crossover, >= 2.
    clusters : bool
        A population for every substrate, or one for the whole board.
    knn, ratio, substrate : int, float, int
        K, the nearest distance ratio, and most holes of a substrate.
    epoch, stall, trpi : int, int, float
        Generations an epoch, epochs without progress, and T_RPI.
    te : float
        T_E in seconds.
    weight : float
        Price of an unbalanced window in mean legs of the first path, >= 0.

    Returns
    -------
    Outcome
        The best route that keeps the instance's rules; ``details`` has the
        generations made (of the population that made most), the paths evaluated, the
        number of substrates and the unbalanced windows.

    Raises
    ------
    UsageError
        For a parameter out of range.
    """
    if crossover not in ("uniform", "points"):
        raise UsageError(f"bmga knows the crossovers uniform and points, not {crossover!r}")
    uniform = crossover == "uniform"
    settings = Settings(
        np, mr, uniform, points, clusters, knn, ratio, substrate, epoch, stall, trpi, te, weight
    )
    if len(instance) > MATRIX_LIMIT and not clusters:
        raise UsageError(f"bmga without clusters takes up to {MATRIX_LIMIT} holes")
    if len(instance) <= MATRIX_LIMIT:
        problem = orders(instance)
        if len(problem) <= TRIVIAL:
            return enumerate_all(instance, problem)
    return _Motherboard(instance, settings, rng, clock, report).run()


@dataclass(eq=False)
class _Population:
    """The chromosomes of one substrate; ``slots`` lists them best first.

    ``price`` holds what an unbalanced window and a move too many along one
    axis cost, ``limits`` the window w, R_min, R_max and the longest axis run;
    ``made`` counts its generations.
    """

    problem: Orders
    x: Floats
    y: Floats
    limits: Floats
    price: Ints
    genes: Genes
    costs: Ints
    slots: Ints
    stalled: int = 0
    made: int = 0

    @property
    def cost(self) -> int:
        """Travel and penalties of the best chromosome."""
        return int(self.costs[self.slots[0]])

    @property
    def path(self) -> tuple[int, ...]:
        """The best chromosome as holes."""
        return self.problem.route(self.genes[self.slots[0]])

    @property
    def scale(self) -> tuple[Ints, Floats, Floats, Floats, Ints]:
        """What the kernels price a chromosome with."""
        return self.problem.legs, self.x, self.y, self.limits, self.price


def _populate(
    instance: Instance, problem: Orders, rule: Balance, s: Settings, rng: Generator
) -> _Population:
    """Step 1: paths of near neighbours from random holes, and their fitness."""
    index, piece = np.array(problem.free, dtype=np.int64), instance.workpiece
    genes = np.zeros((2 * s.np, len(index)), dtype=np.int32)
    _near_paths(rng, problem.legs, genes, s.np, s.knn if s.clusters else 1)
    price = s.weight * _mean_leg(problem, genes[0])
    if 2 * price * len(index) >= SAFE:
        raise UsageError(f"bmga: weight {s.weight:g} makes windows cost more than 62-bit integers")
    window = round(price)
    broken = problem.penalty or int(problem.legs.max()) * len(problem.legs) + 1
    limits = [rule.window, float(rule.low), float(rule.high), instance.rules.axis_run or 0]
    population = _Population(
        problem=problem,
        x=piece.x[index].astype(np.float64),
        y=piece.y[index].astype(np.float64),
        limits=np.array(limits, dtype=np.float64),
        price=np.array([window, broken]),
        genes=genes,
        costs=np.zeros(2 * s.np, dtype=np.int64),
        slots=np.arange(2 * s.np),
    )
    _evaluate(*population.scale, genes, population.costs, s.np)
    rank(population.costs, population.slots, s.np)
    return population


def _mean_leg(problem: Orders, path: Genes) -> float:
    """Mean leg of a path, legs that carry the price of a rule left out."""
    legs = problem.legs[path[:-1], path[1:]]
    plain = legs[(legs >= 0) & (legs < (problem.penalty or SAFE))]
    return float(plain.mean()) if len(plain) else 0.0


class _Motherboard:
    """One run: the populations, and the best whole route so far."""

    def __init__(
        self, instance: Instance, settings: Settings, rng: Generator, clock: Clock, report: Report
    ):
        self.instance, self.settings, self.rng = instance, settings, rng
        self.clock, self.report = clock, report
        self.rule = instance.rules.balance or Balance()
        self.populations = [
            _populate(instance, problem, self.rule, settings, rng) for problem in self._problems()
        ]
        self.best: tuple[int, ...] | None = None
        self.value = (0, 0)
        self.generations = 0

    def _problems(self) -> list[Orders]:
        """The substrates; a single one knows the ends, several meet them when they are joined."""
        ends, s = self.instance.ends, self.settings
        if s.clusters:
            fixed = (ends.start, ends.end)
            free = [h for h in range(len(self.instance)) if h not in fixed]
            groups = substrates(self.instance, free, s.knn, s.ratio, s.substrate)
            if len(groups) > 1:
                return [part(self.instance, group) for group in groups]
        return [orders(self.instance)]

    def run(self) -> Outcome:
        """Epochs of every population that still improves, then the joined path."""
        self._keep()
        stopped = self._stop()
        while stopped is None and any(p.stalled <= self.settings.stall for p in self.populations):
            for population in self.populations:
                if stopped is None and population.stalled <= self.settings.stall:
                    stopped = self._epoch(population)
            self.generations = max(p.made for p in self.populations)
            self._keep()
            stopped = stopped or self._stop()
        return Outcome(
            self.best,
            stopped=stopped or StopReason.COMPLETED,
            details={
                "iterations": self.generations,
                "evaluations": sum(self.settings.np * (p.made + 1) for p in self.populations),
                "substrates": len(self.populations),
                "unbalanced": self._unbalanced(self.best) if self.best else 0,
            },
        )

    def _epoch(self, p: _Population) -> StopReason | None:
        """Steps 2-6 for one population, in pieces so that stops are heard."""
        s, before, limit = self.settings, p.cost, self.clock.stop.iterations
        end = p.made + s.epoch if limit is None else min(p.made + s.epoch, limit)
        piece = max(1, 1_000_000 // (s.np * max(len(p.x), 1)))
        while p.made < end:
            steps = min(piece, end - p.made)
            _generations(
                self.rng,
                *p.scale,
                p.genes,
                p.costs,
                p.slots,
                s.np,
                s.mr,
                s.uniform,
                s.points,
                steps,
            )
            p.made += steps
            reason = self._stop()
            if reason is not None:
                return reason
        p.stalled = p.stalled + 1 if before - p.cost <= s.trpi * abs(before) else 0
        return None

    def _stop(self) -> StopReason | None:
        if self.clock.elapsed >= self.settings.te:
            return StopReason.TIME
        cost = None if self.best is None else self.instance.cost(self.best)
        return self.clock.reason(cost, None, self.generations)

    def _keep(self) -> None:
        """Step 7: join the sub-paths; keep the route if it is allowed and better."""
        paths = [p.path for p in self.populations]
        route = paths[0] if len(paths) == 1 else join(self.instance, paths)
        if faults(self.instance, route):
            return
        cost = self.instance.cost(route)
        price = int(self.populations[0].price[0])
        value = (cost + price * self._unbalanced(route), cost)
        if self.best is None or value < self.value:
            self.best, self.value = route, value
            self.report(Progress(self.clock.elapsed, cost, None, self.generations))

    def _unbalanced(self, route: tuple[int, ...]) -> int:
        piece, index = self.instance.workpiece, np.array(route)
        return len(unbalanced(piece.x[index], piece.y[index], self.rule))


@kernel
def _near_paths(rng: Generator, legs: Ints, genes: Genes, count: int, knn: int) -> None:
    """Step 1: from a random hole always on to one of the ``knn`` nearest that are left."""
    m = genes.shape[1]
    left = np.zeros(m, dtype=np.int64)
    near = np.zeros(knn, dtype=np.int64)
    for i in range(count):
        for k in range(m):
            left[k] = k
        here = below(rng, m)
        for k in range(m):
            genes[i, k] = left[here]
            left[here] = left[m - k - 1]
            rest = m - k - 1
            found = 0
            for r in range(rest):  # the nearest, in order
                leg = legs[genes[i, k], left[r]]
                at = found
                while at > 0 and legs[genes[i, k], left[near[at - 1]]] > leg:
                    if at < knn:
                        near[at] = near[at - 1]
                    at -= 1
                if at < knn:
                    near[at] = r
                    found = min(found + 1, knn)
            choice = 0
            while choice + 1 < found and rng.random() < 0.25:
                choice += 1
            here = near[choice]


@lean
def _value(order: Genes, legs: Ints, x: Floats, y: Floats, limits: Floats, price: Ints) -> int:
    """Step 2: travel, unbalanced windows and runs along one axis, as one price."""
    m = len(order)
    total = length(order, legs)
    w, run = int(limits[0]), int(limits[3])
    if price[0] == 0 and run == 0:
        return total
    dx, dy = 0.0, 0.0
    axis, along = 0, 0
    for k in range(m - 1):
        sx = abs(x[order[k + 1]] - x[order[k]])
        sy = abs(y[order[k + 1]] - y[order[k]])
        dx += sx
        dy += sy
        if k >= w:
            dx -= abs(x[order[k - w + 1]] - x[order[k - w]])
            dy -= abs(y[order[k - w + 1]] - y[order[k - w]])
        if k >= w - 1 and (limits[1] * dy > dx or dx > limits[2] * dy):
            total += price[0]
        now = 0 if (sx > 0.0) == (sy > 0.0) else 1 if sx > 0.0 else 2
        along = along + 1 if now == axis else 1
        axis = now
        if run > 0 and axis > 0 and along > run:
            total += price[1]
    return total


@lean
def _evaluate(
    legs: Ints, x: Floats, y: Floats, limits: Floats, price: Ints,
    genes: Genes, costs: Ints, count: int,
) -> None:  # fmt: skip
    for i in range(count):
        costs[i] = _value(genes[i], legs, x, y, limits, price)


@kernel
def _generations(
    rng: Generator, legs: Ints, x: Floats, y: Floats, limits: Floats, price: Ints, genes: Genes,
    costs: Ints, slots: Ints, population: int, mr: float, uniform: bool, points: int, steps: int,
) -> None:  # fmt: skip
    """Steps 2-5, ``steps`` times."""
    m = genes.shape[1]
    wheel = np.zeros(population)
    mask = np.zeros(m, dtype=np.bool_)
    used = np.zeros(m, dtype=np.bool_)
    for _ in range(steps):
        spin_up(costs, slots, population, wheel)  # Step 3
        for k in range(population, 2 * population):  # Step 4
            child = slots[k]
            _choose(rng, mask, uniform, points)
            _cross(genes, slots[spin(rng, wheel)], slots[spin(rng, wheel)], child, mask, used)
            if rng.random() < mr:
                _reverse(rng, genes[child])
            costs[child] = _value(genes[child], legs, x, y, limits, price)
        rank(costs, slots, 2 * population)  # Step 5


@lean
def _choose(rng: Generator, mask: Marks, uniform: bool, points: int) -> None:
    """Which genes come from the first parent: each by a coin, or alternate stretches."""
    m = len(mask)
    if uniform:
        for k in range(m):
            mask[k] = rng.random() < 0.5
        return
    for k in range(m):
        mask[k] = False
    for _ in range(points):  # every point turns all genes behind it
        at = below(rng, m)
        for k in range(at, m):
            mask[k] = not mask[k]


@lean
def _cross(genes: Genes, one: int, two: int, child: int, mask: Marks, used: Marks) -> None:
    """The masked genes of the first parent in place, the others in the second's sequence."""
    m = len(mask)
    for k in range(m):
        used[k] = False
    for k in range(m):
        if mask[k]:
            genes[child, k] = genes[one, k]
            used[genes[one, k]] = True
    at = 0
    for k in range(m):
        gene = genes[two, k]
        if not used[gene]:
            while mask[at]:
                at += 1
            genes[child, at] = gene
            at += 1


@lean
def _reverse(rng: Generator, order: Genes) -> None:
    """Mutation: the path between two random points runs the other way."""
    a, b = below(rng, len(order)), below(rng, len(order))
    i, j = min(a, b), max(a, b)
    while i < j:
        order[i], order[j] = order[j], order[i]
        i += 1
        j -= 1
