"""The facade: it trusts no solver, knows its registry and hands Ctrl-C to the clock."""

from __future__ import annotations

import importlib
import os
import signal
import sys
from types import ModuleType

import pytest

from tcp import Ends, Instance, Proof, Rules, Status, Stop, StopReason, Workpiece
from tcp.errors import UsageError
from tcp.result import Outcome, Progress
from tcp.stop import Clock

facade = importlib.import_module("tcp.solve")  # tcp.solve itself is the function

THREE = Instance(Workpiece.from_decimals("three", [("0", "0"), ("1", "0"), ("5", "0")]))


@pytest.fixture
def fake(monkeypatch):
    """Registers a solver whose behaviour the test chooses."""

    def register(run, exact=True, refusal=lambda instance: None):
        module = ModuleType("tcp_fake_solver")
        module.run, module.refusal = run, refusal
        monkeypatch.setitem(sys.modules, "tcp_fake_solver", module)
        registry = {**facade.SOLVERS, "fake": facade.Entry("tcp_fake_solver", exact=exact)}
        monkeypatch.setattr(facade, "SOLVERS", registry)

    return register


def answering(outcome):
    def run(instance, *, rng, clock, report):
        return outcome

    return run


def test_an_honest_optimum(fake):
    fake(answering(Outcome((0, 1, 2), bound=5)))
    result = facade.solve(THREE, "fake", exact=True)
    assert (result.status, result.proof, result.cost) == (Status.OPTIMAL, Proof.TRUSTED, 5)
    assert result.ids == ("1", "2", "3") and result.gap == 0


def test_a_bound_within_the_granularity_is_a_proof(fake):
    even = Instance(Workpiece.from_decimals("even", [("0", "0"), ("2", "0"), ("6", "0")]))
    fake(answering(Outcome((0, 1, 2), bound=5)))
    assert even.granularity == 2
    assert facade.solve(even, "fake").status is Status.OPTIMAL


def test_bounds_below_zero_mean_zero(fake):
    place = Instance(Workpiece.from_decimals("place", [("1", "1"), ("1", "1")]))
    fake(answering(Outcome((0, 1), bound=-7)))
    assert facade.solve(place, "fake").status is Status.OPTIMAL


@pytest.mark.parametrize("route", [(0, 1), (0, 1, 1), (0, 1, 3), (0, 1, 2, 2), ()])
def test_a_route_that_is_none_never_leaves(fake, route):
    fake(answering(Outcome(route)))
    with pytest.raises(facade.SolverError, match="route that is none"):
        facade.solve(THREE, "fake")


def test_a_bound_above_the_route_never_leaves(fake):
    fake(answering(Outcome((0, 1, 2), bound=6)))
    with pytest.raises(facade.SolverError, match="above its own route"):
        facade.solve(THREE, "fake")


def test_unknown_names_are_refused(fake):
    fake(answering(Outcome((0, 1, 2))), exact=False)
    for arguments, message in [
        (("nobody",), "unknown solver"),
        (("fake", {"exact": True}), "cannot prove"),
        (("fake", {"depth": 3}), "no option 'depth'"),
        (("fake", {"seed": -1}), "seed"),
    ]:
        options = arguments[1] if len(arguments) > 1 else {}
        with pytest.raises(UsageError, match=message):
            facade.solve(THREE, arguments[0], **options)


def test_a_refusal_is_passed_on(fake):
    fake(answering(Outcome(None)), refusal=lambda instance: "it is too big")
    with pytest.raises(UsageError, match="fake cannot solve three: it is too big"):
        facade.solve(THREE, "fake")


def test_no_route_is_unknown_or_infeasible(fake):
    fake(answering(Outcome(None)))
    assert facade.solve(THREE, "fake").status is Status.UNKNOWN
    fake(answering(Outcome(None, infeasible=True)))
    result = facade.solve(THREE, "fake")
    assert (result.status, result.proof) == (Status.INFEASIBLE, Proof.TRUSTED)


def test_the_trace_keeps_improvements_only(fake):
    def run(instance, *, rng, clock, report):
        for cost, bound in [(9, 1), (9, 1), (8, 1), (8, 3), (8, 2)]:
            report(Progress(clock.elapsed, cost, bound))
        return Outcome((0, 1, 2), bound=3)

    fake(run)
    seen = []
    result = facade.solve(THREE, "fake", report=seen.append)
    assert [(p.cost, p.bound) for p in result.trace] == [(9, 1), (8, 1), (8, 3)]
    assert len(seen) == 5 and result.status is Status.FEASIBLE


def test_control_c_asks_for_the_best_so_far(fake):
    def run(instance, *, rng, clock, report):
        os.kill(os.getpid(), signal.SIGINT)
        assert clock.reason() is StopReason.INTERRUPTED
        return Outcome((0, 1, 2), bound=0, stopped=StopReason.INTERRUPTED)

    fake(run)
    before = signal.getsignal(signal.SIGINT)
    assert facade.solve(THREE, "fake").stopped is StopReason.INTERRUPTED
    assert signal.getsignal(signal.SIGINT) is before


def test_a_second_control_c_stops_at_once(fake):
    def run(instance, *, rng, clock, report):
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)
        raise AssertionError("not reached")

    fake(run)
    with pytest.raises(KeyboardInterrupt):
        facade.solve(THREE, "fake")


def test_seeds_are_the_only_randomness(fake):
    def run(instance, *, rng, clock, report):
        return Outcome(tuple(rng.permutation(3).tolist()))

    fake(run)
    routes = {facade.solve(THREE, "fake", seed=5).route for _ in range(5)}
    assert len(routes) == 1


@pytest.mark.parametrize(
    ("stop", "call", "reason"),
    [
        (Stop(time=0), {}, StopReason.TIME),
        (Stop(iterations=3), {"iterations": 3}, StopReason.ITERATIONS),
        (Stop(iterations=3), {"iterations": 2}, None),
        (Stop(target=10), {"cost": 10}, StopReason.TARGET),
        (Stop(target=10), {"cost": 11}, None),
        (Stop(gap=0.1), {"cost": 100, "bound": 90}, StopReason.GAP),
        (Stop(gap=0.1), {"cost": 100, "bound": 89}, None),
        (Stop(gap=0.0), {"cost": 100}, None),
    ],
)
def test_stops(stop, call, reason):
    from tcp.stop import Clock

    assert Clock(stop).reason(**call) is reason


@pytest.mark.parametrize("wrong", [{"time": -1}, {"time": float("nan")}, {"gap": -0.1}])
def test_limits_are_not_negative(wrong):
    with pytest.raises(UsageError):
        Stop(**wrong)


@pytest.mark.parametrize(
    ("value", "words"),
    [("many", "whole number"), (2.5, "whole number"), (True, "whole number"), (None, "whole")],
)
def test_an_options_type_is_that_of_its_default(fake, value, words):
    def run(instance, *, rng, clock, report, rounds=3, rate=0.5, name="x", fast=False):
        return Outcome((0, 1, 2), bound=5)

    fake(run)
    with pytest.raises(UsageError, match=words):
        facade.solve(THREE, "fake", rounds=value)
    for bad in ({"rate": "1"}, {"name": 1}, {"fast": 1}):
        with pytest.raises(UsageError, match=f"fake: {min(bad)} is"):
            facade.solve(THREE, "fake", **bad)
    assert facade.solve(THREE, "fake", rounds=2, rate=1, name="y", fast=True).cost == 5


def test_compiling_costs_no_time():
    import numba

    from tcp.stop import Clock, compiling_is_free

    ticks = iter(range(100))
    clock = Clock(Stop(), now=lambda: float(next(ticks)))

    @numba.njit
    def inner(x):
        return x + 1

    @numba.njit
    def outer(x):
        return inner(x) * 2  # compiles within the compilation of outer

    heard = []
    with compiling_is_free(clock, lambda: heard.append(clock.elapsed)):
        outer(3)
    assert heard == [1, 1]
    assert clock.elapsed == 2  # asked at 0, paused at 1, resumed at 2, asked again at 3
    outer(3.5)
    assert clock.elapsed == 3 and heard == [1, 1]  # nobody listens any more


def test_compiling_is_told(fake):
    import numba

    def run(instance, *, rng, clock, report):
        numba.njit(lambda x: x + 1)(3)
        return Outcome((0, 1, 2))

    fake(run)
    seen = []
    facade.solve(THREE, "fake", report=seen.append)
    assert [news.note for news in seen] == ["compiling, once on this machine"]


def test_a_paused_clock_stands_still_however_often_it_is_paused():
    from tcp.stop import Clock

    now = [0.0]
    clock = Clock(Stop(time=5), now=lambda: now[0])
    now[0] = 1.0
    with clock.paused():
        now[0] = 10.0
        with clock.paused():
            now[0] = 100.0
        assert clock.elapsed == 1 and clock.reason() is None
    now[0] = 102.0
    assert (clock.elapsed, clock.remaining) == (3, 2)


def grid(n):
    return Workpiece.from_decimals("grid", [(k % 9, k // 9) for k in range(n)])


@pytest.mark.parametrize(
    ("n", "how", "wanted"),
    [
        (15, {}, "held-karp"),
        (16, {}, "branch-and-cut"),  # the open end is a node as well
        (16, {"ends": Ends(closed=True)}, "held-karp"),
        (16, {"ends": Ends(closed=True), "certificate": True}, "held-karp"),
        (40, {"exact": True}, "branch-and-cut"),
        (40, {"certificate": True}, "branch-and-cut"),
        (60, {"exact": True}, "branch-and-cut"),
        (60, {}, "local-search"),
        (30, {"rules": Rules(axis_run=2), "exact": True}, "positions"),
    ],
)
def test_auto_goes_by_size_ends_rules_and_what_is_asked(n, how, wanted):
    ends, rules = how.pop("ends", Ends()), how.pop("rules", Rules())
    instance = Instance(grid(n), ends=ends, rules=rules)
    name, why = facade.choose(instance, how.pop("exact", False), **how)
    assert name == wanted
    assert ("refused" in why) == (wanted == "positions")


def test_ctrl_c_asks_everything_that_is_interruptible():
    inner, outer = Clock(Stop()), Clock(Stop())
    with facade.interruptible(outer), facade.interruptible(inner):
        signal.raise_signal(signal.SIGINT)
        assert inner.interrupted and outer.interrupted
    late = Clock(Stop())
    with facade.interruptible(outer), facade.interruptible(late):
        assert late.interrupted  # what begins after Ctrl-C ends at once
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
