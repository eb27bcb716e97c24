"""The whole engine: optimal, certified, for every travel model, kind of ends and rule."""

from __future__ import annotations

import itertools
import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tcp import Ends, Instance, Model, Rules, Status, Stop, Travel, Workpiece, solve
from tcp.errors import UsageError
from tcp.exact.branch_and_cut import cutting, tree
from tcp.exact.branch_and_cut.relaxation import Answer, Relaxation
from tcp.files import certificate as files
from tcp.files.certificate import to_text
from tcp.result import Proof
from tcp.stop import StopReason
from tcp.validate import certificate as checker
from tcp.validate.route import faults

F = Fraction
TRAVELS = [
    Travel(),
    Travel(Model.SIMULTANEOUS, vx=F(3)),
    Travel(Model.EUCLIDEAN),
    Travel(Model.TRAPEZOIDAL, ax=F(2), ay=F(3)),
]
HOME = {"home": (F(-7, 3), F(1, 2))}
KINDS = [
    {},
    {"closed": True},
    {"start": 0},
    {"end": 0},
    {"start": 0, "end": 1},
    {"start": 1, "closed": True},
    {**HOME, "outward": True},
    {**HOME, "back": True, "start": 0},
    {**HOME, "outward": True, "back": True},
]


def verified(instance: Instance, **options: object) -> checker.Verdict:
    """Solve with the engine and have the independent checker verify what it claims."""
    from tcp.exact.branch_and_cut.run import run
    from tcp.result import silent
    from tcp.stop import Clock

    clock = Clock(options.pop("stop", Stop()))
    outcome = run(instance, rng=np.random.default_rng(0), clock=clock, report=silent, **options)
    verdict = checker.check(to_text(outcome.evidence).encode(), None, instance.sha256)
    assert verdict.lower == outcome.bound
    if outcome.route is None:
        assert verdict.upper is None
    else:
        assert faults(instance, outcome.route) == []
        assert verdict.upper == instance.cost(outcome.route)
    return verdict


def brute_force(instance: Instance) -> int | None:
    orders = itertools.permutations(range(len(instance)))
    costs = (instance.cost(p) for p in orders if not faults(instance, p))
    return min(costs, default=None)


@st.composite
def instances(draw, least: int, most: int) -> Instance:
    n = draw(st.integers(least, most))
    reach = draw(st.sampled_from([2, 9, 400]))
    coordinate = st.integers(0, reach)
    holes = draw(st.lists(st.tuples(coordinate, coordinate), min_size=n, max_size=n))
    kind = draw(st.sampled_from(KINDS))
    assume(n > 1 or max(kind.get("start", 0), kind.get("end", 0)) == 0)
    assume(n > 1 or kind != {"start": 0, "end": 1})
    pair = st.tuples(st.integers(0, n - 1), st.integers(0, n - 1)).filter(lambda p: p[0] != p[1])
    pairs = st.lists(pair, max_size=4) if n > 1 else st.just([])
    rules = Rules(tuple(draw(pairs)), tuple(draw(pairs)[:2])) if draw(st.booleans()) else Rules()
    travel = draw(st.sampled_from(TRAVELS))
    return Instance(Workpiece.from_decimals("w", holes), travel, Ends(**kind), rules)


@settings(max_examples=120, deadline=None)
@given(instance=instances(1, 6))
def test_small_instances_agree_with_brute_force(instance):
    verdict = verified(instance)
    assert verdict.lower == verdict.upper == brute_force(instance)


@settings(max_examples=25, deadline=None)
@given(instance=instances(9, 12))
def test_medium_instances_agree_with_the_dynamic_programme(instance):
    verdict = verified(instance)
    assert verdict.lower == verdict.upper == solve(instance, "held-karp").cost


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_a_handful_of_holes(n, kind):
    if n == 1 and kind.get("start", 0) + kind.get("end", 0) + ("start" in kind and "end" in kind):
        pytest.skip("these ends name a second hole")
    piece = Workpiece.from_decimals("few", [(0, 0), (5, 1), (2, 7)][:n])
    instance = Instance(piece, Travel(), Ends(**kind))
    verdict = verified(instance)
    assert verdict.lower == verdict.upper == brute_force(instance)


def grid(width: int, height: int) -> Workpiece:
    return Workpiece.from_decimals("grid", [(x, y) for x in range(width) for y in range(height)])


@pytest.mark.parametrize("travel", TRAVELS)
def test_a_closed_odd_grid_needs_branching_or_combs(travel):
    instance = Instance(grid(5, 5), travel, Ends(closed=True))
    verdict = verified(instance)
    assert verdict.lower == verdict.upper


def test_explicit_times():
    rng = np.random.default_rng(4)
    matrix = rng.integers(1, 100, (10, 10))
    matrix = np.triu(matrix, 1) + np.triu(matrix, 1).T
    zeros = np.zeros(10, np.int64)
    piece = Workpiece("matrix", tuple(map(str, range(10))), zeros, zeros.copy(), matrix=matrix)
    instance = Instance(piece, Travel(Model.EXPLICIT))
    assert verified(instance).lower == solve(instance, "held-karp").cost


INFEASIBLE = {
    "a hole with three partners": Rules(together=((0, 1), (0, 2), (0, 3))),
    "a cycle of partners": Rules(together=((0, 1), (1, 2), (2, 0))),
    "required and forbidden": Rules(together=((0, 1),), forbidden=((1, 0),)),
    "an isolated hole": Rules(forbidden=tuple((0, j) for j in range(1, 9))),
    "two islands": Rules(
        forbidden=tuple((i, j) for i in range(4) for j in range(4, 9)),
    ),
    "no two of five may meet": Rules(
        forbidden=tuple(itertools.combinations(range(6), 2)),
    ),
}


@pytest.mark.parametrize("why", INFEASIBLE)
def test_infeasible_rules_are_certified(why):
    instance = Instance(grid(3, 3), Travel(), Ends(closed=True), INFEASIBLE[why])
    verdict = verified(instance)
    assert verdict.lower is None


def test_infeasibility_that_needs_branching():
    """The Petersen graph is 2-connected and 3-regular, but has no Hamiltonian cycle."""
    edges = {(i, (i + 1) % 5) for i in range(5)} | {(i, i + 5) for i in range(5)}
    edges |= {(5 + i, 5 + (i + 2) % 5) for i in range(5)}
    edges = {tuple(sorted(e)) for e in edges}
    forbidden = tuple(p for p in itertools.combinations(range(10), 2) if p not in edges)
    instance = Instance(grid(5, 2), Travel(), Ends(closed=True), Rules(forbidden=forbidden))
    assert verified(instance).lower is None
    path = Instance(grid(5, 2), Travel(), Ends(), Rules(forbidden=forbidden))
    verdict = verified(path)
    assert verdict.lower == verdict.upper == solve(path, "held-karp").cost


def scattered(n: int, seed: int) -> Workpiece:
    points = np.random.default_rng(seed).integers(0, 1000, (n, 2))
    return Workpiece.from_decimals("scattered", [(int(a), int(b)) for a, b in points])


def test_a_time_limit_returns_a_certified_bound():
    instance = Instance(scattered(150, 1), Travel(Model.EUCLIDEAN))
    for seconds in (0.0, 0.05):
        verdict = verified(instance, stop=Stop(time=seconds))
        assert 0 <= verdict.lower <= verdict.upper


def test_same_seed_same_proof():
    instance = Instance(scattered(60, 2), Travel(Model.EUCLIDEAN))
    texts = []
    for _ in range(2):
        result = solve(instance, "branch-and-cut", seed=3)
        texts.append((result.route, result.details["nodes"], result.details["rounds"]))
    assert texts[0] == texts[1]


def test_costs_of_a_thousand_million_quanta():
    travel = Travel(vx=F(1, 1_000_003), vy=F(1, 999_983))
    for seed in range(3):
        instance = Instance(scattered(25, seed), travel)
        verdict = verified(instance)
        assert verdict.lower == verdict.upper > 10**9


def test_the_facade_writes_only_what_the_checker_passes(tmp_path):
    instance = Instance(scattered(30, 5))
    path = tmp_path / "proof.cert.json.gz"
    result = solve(instance, exact=True, certificate=path)
    assert result.solver == "branch-and-cut"
    assert (result.status, result.proof) == (Status.OPTIMAL, Proof.CERTIFIED)
    assert result.certificate == path
    assert list(tmp_path.iterdir()) == [path]
    assert checker.check(checker.unzip(path), None, instance.sha256).lower == result.cost
    assert solve(instance, exact=True).proof is Proof.TRUSTED


@pytest.mark.parametrize("solver", ["held-karp", "cp-sat", "milp", "local-search"])
def test_other_solvers_are_certified_too(tmp_path, solver):
    instance = Instance(scattered(11, 6), Travel(Model.SIMULTANEOUS), Ends(start=2))
    path = tmp_path / "proof.json"
    result = solve(instance, solver, certificate=path, stop=Stop(iterations=500))
    assert (result.status, result.proof) == (Status.OPTIMAL, Proof.CERTIFIED)
    assert result.solver.startswith(solver)
    assert path.exists()


def test_infeasibility_is_certified_by_the_facade(tmp_path):
    rules = INFEASIBLE["two islands"]
    instance = Instance(grid(3, 3), Travel(), Ends(closed=True), rules)
    result = solve(instance, "branch-and-cut", certificate=tmp_path / "no.json")
    assert (result.status, result.proof) == (Status.INFEASIBLE, Proof.CERTIFIED)


def test_an_interrupt_returns_what_there_is():
    from tcp.exact.branch_and_cut.run import run
    from tcp.stop import Clock

    clock = Clock(Stop())
    seen = []

    def interrupting(news):
        seen.append(news)
        clock.interrupt()

    instance = Instance(scattered(200, 8), Travel(Model.EUCLIDEAN))
    outcome = run(instance, rng=np.random.default_rng(0), clock=clock, report=interrupting)
    assert outcome.stopped is StopReason.INTERRUPTED
    assert seen
    assert checker.check(to_text(outcome.evidence).encode()).lower == outcome.bound


def test_too_many_nodes_are_refused():
    from tcp.exact.branch_and_cut.run import LARGEST

    points = np.arange(LARGEST + 1, dtype=np.int64)
    piece = Workpiece("long", tuple(map(str, points)), points, points.copy())
    with pytest.raises(UsageError, match="20000 nodes"):
        solve(Instance(piece), "branch-and-cut")


def stopped_after(instance: Instance, path, nodes: int):
    """A run that saves its state and is stopped after a few nodes."""
    from tcp.exact.branch_and_cut.run import run
    from tcp.stop import Clock

    clock = Clock(Stop())

    def watch(news):
        if news.iteration >= nodes:
            clock.interrupt()

    return run(instance, rng=np.random.default_rng(0), clock=clock, report=watch, save_state=path)


def test_a_saved_proof_goes_on(tmp_path):
    instance, path = many_nodes(), tmp_path / "state.json.gz"
    full = verified(instance)
    half = stopped_after(instance, path, 3)
    assert half.stopped is StopReason.INTERRUPTED
    saved = checker.check(checker.unzip(path), None, instance.sha256)
    assert saved.lower == half.bound < full.lower
    again = verified(instance, resume=path)
    assert again.lower == again.upper == full.lower
    finished = solve(instance, "branch-and-cut", resume=path, save_state=path)
    assert finished.status is Status.OPTIMAL
    done = solve(instance, "branch-and-cut", resume=path)
    assert (done.cost, done.details["rounds"]) == (full.lower, 0)


def many_nodes() -> Instance:
    """An instance that does not close at the root."""
    return Instance(scattered(120, 21), Travel(), Ends(closed=True))


def test_states_of_other_instances_are_refused(tmp_path):
    from tcp.errors import InputError

    path = tmp_path / "state.json"
    stopped_after(many_nodes(), path, 1)
    with pytest.raises(InputError, match="another instance"):
        solve(Instance(scattered(20, 1)), "branch-and-cut", resume=path)
    path.write_text("{}")
    with pytest.raises(InputError):
        solve(many_nodes(), "branch-and-cut", resume=path)
    with pytest.raises(InputError):
        solve(many_nodes(), "branch-and-cut", resume=tmp_path / "absent.json")


def test_a_damaged_state_is_refused(tmp_path):
    from tcp.errors import InputError

    instance, path = Instance(scattered(20, 1)), tmp_path / "state.json.gz"
    stopped_after(instance, path, 1)
    data = path.read_bytes()
    for damaged in (data[: len(data) // 2], data[:40] + b"\xff\xff\xff" + data[43:], data[:2]):
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=r"state\.json\.gz"):
            solve(instance, "branch-and-cut", resume=path)


FIVE = Workpiece("five", tuple("12345"), np.array([1, 3, 5, 3, 1]), np.array([2, 1, 2, 3, 4]))


def test_a_pair_that_is_priced_out_and_in_keeps_its_leaf_closed(tmp_path):
    """The root's duals alone prove the optimum, so that every pair is dead, used ones too."""
    instance = Instance(FIVE)
    duals = files.Duals(10, np.array([21, 10, 20, 10, 20, -20]))
    tree = [files.Fix(duals, 1), files.EdgeBranch(0, 1, 2, 3), files.Leaf(duals), files.Leaf(duals)]
    state, proof = tmp_path / "state.json", tmp_path / "proof.json"
    route = (4, 0, 1, 3, 2)
    files.write(files.Certificate.for_instance(instance, lower=10, route=route, tree=tree), state)
    checker.check(state.read_bytes(), None, instance.sha256)
    result = solve(instance, "branch-and-cut", resume=state, certificate=proof)
    assert (result.cost, result.status) == (10, Status.OPTIMAL)
    assert checker.check(proof.read_bytes(), None, instance.sha256).lower == 10


D, NOUGHT = [19, 10, 19, 10, 18, -18], [0] * 6
D0, D1 = [11, 16, 16, 12, 10, -12], [21, 6, 24, 12, 14, -24]


@pytest.mark.parametrize(
    ("lower", "fixes", "edge", "leaves"),
    [
        (5, [(10, [16, 14, 20, 9, 22, -19])], None, [(1, NOUGHT)]),
        (10, [(10, D0), (10, D1), (1, NOUGHT)], (1, 5), [(10, D0), (10, D1)]),
    ],
)
def test_pairs_that_one_proof_forces_and_another_kills(tmp_path, lower, fixes, edge, leaves):
    """What the checker accepts is gone on with to what it accepts."""
    instance = Instance(FIVE)
    given = [files.Duals(scale, np.array(pi)) for scale, pi in (*fixes, *leaves)]
    tree: list[files.Node] = [files.Fix(d, k + 1) for k, d in enumerate(given[: len(fixes)])]
    if edge is not None:
        tree.append(files.EdgeBranch(*edge, len(tree) + 1, len(tree) + 2))
    tree += [files.Leaf(d) for d in given[len(fixes) :]]
    state, proof = tmp_path / "state.json", tmp_path / "proof.json"
    route = (4, 0, 1, 3, 2)
    files.write(
        files.Certificate.for_instance(instance, lower=lower, route=route, tree=tree), state
    )
    checker.check(state.read_bytes(), None, instance.sha256)
    result = solve(instance, "branch-and-cut", resume=state, certificate=proof)
    assert (result.cost, result.status, result.proof) == (10, Status.OPTIMAL, Proof.CERTIFIED)


def test_a_state_that_is_not_true_is_refused(tmp_path):
    """Teeth that overlap, multipliers of no branch, routes that are none."""
    from tcp.errors import InputError

    instance, path = Instance(scattered(11, 10)), tmp_path / "state.json"
    pool = files.Pool()
    comb = pool.cut([[0], [1], [1], [1]])
    potentials = np.zeros(instance.form.size, np.int64)
    potentials[:2] = -500, -1500
    duals = files.Duals(1, potentials, ((comb, 500),))
    route = solve(instance, "held-karp").route
    false = files.Certificate.for_instance(
        instance, lower=0, route=route, pool=pool, tree=[files.Leaf(duals)]
    )
    files.write(false, path)
    with pytest.raises(InputError, match="cannot be resumed"):
        solve(instance, "branch-and-cut", resume=path)
    honest = files.Certificate.for_instance(
        instance, lower=0, route=route, tree=[files.Leaf(files.Duals(1, 0 * potentials))]
    )
    files.write(honest, path)
    assert solve(instance, "branch-and-cut", resume=path).status is Status.OPTIMAL
    for bad in ([0] * 11, [99] * 11, ["a"] * 11):
        path.write_text(json.dumps({**json.loads(files.to_text(honest)), "route": bad}))
        with pytest.raises(InputError, match=r"cannot be resumed|malformed"):
            solve(instance, "branch-and-cut", resume=path)


def test_states_on_the_command_line(tmp_path):
    from click.testing import CliRunner

    from tcp.cli.main import main
    from tcp.errors import Exit

    board, state, proof = (str(tmp_path / n) for n in ("b.csv", "s.json.gz", "p.json"))
    lines = ["id,x,y", *(f"h{k},{7 * k % 31},{11 * k % 29}" for k in range(25))]
    (tmp_path / "b.csv").write_text("\n".join(lines) + "\n")
    first = CliRunner().invoke(
        main, ["solve", "--exact", "--time-limit", "0", "--save-state", state, board]
    )
    assert first.exit_code == Exit.NO_PROOF
    before = (tmp_path / "s.json.gz").read_bytes()
    for other in ([], ["--resume", proof]):  # the first command again: it lost the state
        again = CliRunner().invoke(main, ["solve", "--save-state", state, *other, board])
        assert again.exit_code == Exit.USAGE and "--resume it to go on" in again.output
    assert (tmp_path / "s.json.gz").read_bytes() == before
    onward = ["--save-state", state, "--resume", state, "--time-limit", "0"]
    assert CliRunner().invoke(main, ["solve", *onward, board]).exit_code == Exit.OK
    second = CliRunner().invoke(
        main, ["solve", "--exact", "--resume", state, "--certificate", proof, board]
    )
    assert second.exit_code == Exit.OK, second.output
    assert CliRunner().invoke(main, ["check", proof, board]).exit_code == Exit.OK
    wrong = CliRunner().invoke(main, ["solve", "--closed", "--resume", state, board])
    assert wrong.exit_code == Exit.INPUT


def test_gap_target_and_node_limits_stop_the_search():
    instance = many_nodes()
    best = solve(instance, "branch-and-cut")
    near = solve(instance, "branch-and-cut", stop=Stop(gap=0.05))
    assert near.stopped in (StopReason.GAP, StopReason.COMPLETED)
    assert near.gap <= 0.05
    few = solve(instance, "branch-and-cut", stop=Stop(iterations=1))
    assert few.stopped is StopReason.ITERATIONS
    assert few.bound <= best.cost <= few.cost
    met = solve(instance, "branch-and-cut", stop=Stop(target=best.cost * 2))
    assert met.cost <= best.cost * 2


@pytest.mark.parametrize("n", [20, 120])
@pytest.mark.parametrize(
    ("stop", "reason"),
    [
        (Stop(time=0), StopReason.TIME),
        (Stop(iterations=0), StopReason.ITERATIONS),
        (Stop(gap=1.0), StopReason.GAP),
        (Stop(target=10**9), StopReason.TARGET),
    ],
)
def test_an_early_stop_says_why_at_any_size(n, stop, reason):
    result = solve(Instance(scattered(n, 21)), "branch-and-cut", stop=stop)
    done = result.status is Status.OPTIMAL and result.stopped is StopReason.COMPLETED
    assert result.stopped is reason or done


def test_a_file_after_one_out_of_time_is_solved(tmp_path):
    from click.testing import CliRunner

    from tcp.cli.main import main

    boards = [str(tmp_path / name) for name in ("a.csv", "b.csv")]
    for board in boards:
        lines = ["id,x,y", *(f"h{k},{7 * k % 31},{11 * k % 29}" for k in range(25))]
        Path(board).write_text("\n".join(lines) + "\n")
    done = CliRunner().invoke(main, ["solve", "--exact", "--time-limit", "0", "--json", *boards])
    assert len(done.stdout.splitlines()) == 2


def test_costs_beyond_a_proof_are_given_up_honestly():
    travel = Travel(vx=F(1, 10**12 + 3), vy=F(1, 10**12 - 17))
    result = solve(Instance(scattered(80, 80), travel), "branch-and-cut")
    assert result.bound <= result.cost
    assert result.status is Status.OPTIMAL or "gave up" in result.details


def test_the_proof_does_not_depend_on_the_number_of_threads(monkeypatch):
    monkeypatch.setattr(tree, "HARD", 1)  # local cuts after the root
    x, y = np.random.default_rng(3).integers(0, 1000, (2, 150))
    instance = Instance(Workpiece("random", tuple(map(str, range(150))), x, y))
    proofs = []
    for number in ("1", "2"):
        monkeypatch.setenv("OMP_NUM_THREADS", number)
        result = solve(instance, "branch-and-cut", exact=True, seed=3)
        proofs.append((result.route, result.bound, result.details))
    assert proofs[0] == proofs[1]
    assert proofs[0][2]["nodes"] > 1  # local cuts and branching took part


@pytest.mark.parametrize("lost", [{2}, {3}, {1, 2}])
def test_a_simplex_run_that_loses_its_way_is_made_again(monkeypatch, lost):
    instance = Instance(scattered(60, 11), Travel(Model.EUCLIDEAN))
    plain = verified(instance)
    runs = losing_its_way(monkeypatch, lambda count: count % (1 + max(lost)) in lost)
    verdict = verified(instance)
    assert (verdict.lower, verdict.upper) == (plain.lower, plain.upper)
    assert len(runs) > 3


def test_a_lost_simplex_run_goes_on_from_where_it_was(monkeypatch):
    instance = Instance(scattered(60, 11), Travel(Model.EUCLIDEAN))
    plain = solve(instance, "branch-and-cut", exact=True, seed=1)
    losing_its_way(monkeypatch, lambda count: count % 2 == 1)  # the end of every first run
    again = solve(instance, "branch-and-cut", exact=True, seed=1)
    assert (again.cost, again.bound) == (plain.cost, plain.bound)
    anew = 2 * plain.details["simplex_iterations"]  # at least, if every lost run began afresh
    assert again.details["simplex_iterations"] < 0.6 * anew


def test_pairs_enter_the_lp_at_a_solution_and_not_together_with_cuts(monkeypatch):
    """With both at once the basis is good for neither simplex method."""
    monkeypatch.setattr(cutting, "PRICE_EVERY", 3)
    real, waiting = Relaxation.add_pairs, []

    def add_pairs(self, keys):
        count = len(self.keys)
        real(self, keys)
        if self.solved and len(self.keys) > count:
            waiting.append(self._new_rows > 0)

    monkeypatch.setattr(Relaxation, "add_pairs", add_pairs)
    x, y = np.random.default_rng(1).integers(0, 1000, (2, 300))
    instance = Instance(Workpiece("random", tuple(map(str, range(300))), x, y))
    solve(instance, "branch-and-cut", exact=True, stop=Stop(iterations=1))
    assert len(waiting) > 3 and not any(waiting)


def test_a_simplex_method_that_is_lost_for_good_ends_the_search_and_says_so(monkeypatch):
    losing_its_way(monkeypatch, lambda count: count > 4)
    result = solve(Instance(scattered(60, 11), Travel(Model.EUCLIDEAN)), "branch-and-cut")
    assert (result.status, result.stopped) == (Status.FEASIBLE, StopReason.COMPLETED)
    assert "too coarse" in result.details["gave up"]
    assert 0 < result.bound < result.cost


def losing_its_way(monkeypatch, lost):
    """Let the simplex runs whose number ``lost`` says be lost; returns the list of all runs."""
    real, runs = Relaxation._run, []

    def run(self, strategy):
        runs.append(strategy)
        answer = real(self, strategy)
        return Answer.LOST if lost(len(runs)) else answer

    monkeypatch.setattr(Relaxation, "_run", run)
    return runs
