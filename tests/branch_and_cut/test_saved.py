"""A proof that is killed goes on: states within the root, and a real kill -9."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import tcp.validate.certificate as checker
from tcp import Ends, Instance, Model, Status, Travel, Workpiece, solve
from tcp.exact.branch_and_cut import run as engine
from tcp.stop import Clock, Stop


def slow() -> Instance:
    """An instance with a root of many rounds and some nodes."""
    x, y = np.random.default_rng(4).integers(0, 4000, (2, 150))
    piece = Workpiece("slow", tuple(map(str, range(150))), x, y)
    return Instance(piece, Travel(Model.SIMULTANEOUS), Ends(closed=True))


class Still(Clock):
    """A clock that stands: writing takes no time, so that every state is due."""

    elapsed = 0.0


def test_the_root_is_saved_while_it_is_cut(tmp_path, monkeypatch):
    """Every state on disk is a true certificate, also before the first branch."""
    monkeypatch.setattr(engine, "SAVE_EVERY", 0.0)
    instance, path, clock, seen = slow(), tmp_path / "state.json.gz", Still(Stop()), []

    def watch(news):
        if path.exists():
            raw = checker.unzip(path)
            verdict = checker.check(raw, None, instance.sha256)
            seen.append((b"children" in raw, verdict.lower, verdict.upper))
        if news.iteration > 1:
            clock.interrupt()

    generator = np.random.default_rng(0)
    outcome = engine.run(instance, rng=generator, clock=clock, report=watch, save_state=path)
    within = [(low, high) for branched, low, high in seen if not branched]
    assert within[0][0] == 0 and within[0][1] is not None
    assert any(0 < low < high for low, high in within)
    assert outcome.bound >= max(low for low, _ in within)


def test_a_resumed_tree_asks_whether_it_is_hard_by_the_gap_it_was_left_with(tmp_path, monkeypatch):
    """The root of a saved tree has no bound of its own; zero would make every tree look easy."""
    instance, path, asked = slow(), tmp_path / "state.json.gz", []
    left = solve(instance, "branch-and-cut", stop=Stop(iterations=1), save_state=path)
    assert 0 < left.bound < left.cost

    def run(tree):
        asked.append((tree.nodes[0].bound, tree.bound))
        tree.processed = 8
        asked.append(tree._hard())
        tree.stopped = True

    monkeypatch.setattr(engine.Tree, "run", run)
    solve(instance, "branch-and-cut", resume=path)
    assert asked == [(left.bound, left.bound), True]


CHILD = """
import sys
sys.path.insert(0, sys.argv[2])
from tests.branch_and_cut.test_saved import slow
from tcp import solve
from tcp.exact.branch_and_cut import run
run.SAVE_EVERY = 0.0
resume = {"resume": sys.argv[1]} if sys.argv[3:] else {}
solve(slow(), "branch-and-cut", save_state=sys.argv[1], **resume)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there is no kill -9")
def test_a_killed_proof_goes_on(tmp_path, request):
    """Killed twice without warning, after some states were written; then finished."""
    instance, path = slow(), tmp_path / "state.json.gz"
    lower = -1
    for attempt in range(2):
        command = [sys.executable, "-c", CHILD, str(path), str(request.config.rootpath)]
        child = subprocess.Popen([*command, *["resume"] * attempt])
        known = lower
        while child.poll() is None and lower <= known:
            time.sleep(0.02)
            if path.exists():
                lower = checker.check(checker.unzip(path), None, instance.sha256).lower
        child.send_signal(signal.SIGKILL)
        child.wait()
    proof = tmp_path / "proof.cert.json.gz"
    result = solve(instance, "branch-and-cut", exact=True, resume=path, certificate=proof)
    assert result.status is Status.OPTIMAL
    verdict = checker.check(checker.unzip(proof), None, instance.sha256)
    assert lower <= verdict.lower == verdict.upper == result.cost
    assert solve(instance, "branch-and-cut", exact=True).cost == result.cost
