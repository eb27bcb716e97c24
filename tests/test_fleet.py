"""Fleets: the same answers in any place, whoever dies meanwhile; clusters are real processes."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner

from tcp.cli.main import main
from tcp.errors import Exit, UsageError
from tcp.fleet import TRIES, Fleet, FleetError, own_cores, threads

ROOT = Path(__file__).resolve().parents[1]


def square(number: int) -> int:
    return number * number


def die_once(task: tuple[Path, int]) -> int:
    """The worker that finds the poison takes it and dies of it."""
    poison, number = task
    if number == 3 and poison.exists():
        poison.unlink()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def die(number: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return number


def fail(number: int) -> int:
    raise UsageError(f"no {number}")


def patient(task: tuple[Path, int]) -> int:
    """Leave word of who works where, and take a while; the first to make number 3 dies of it."""
    folder, number = task
    (folder / f"{number}-{os.getpid()}").touch()
    time.sleep(0.15)
    if number == 3 and len(list(folder.glob("3-*"))) == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def deaf(number: int) -> bool:
    return signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def cores(number: int) -> int:
    return threads(99)


def test_one_job_runs_here_and_in_order():
    assert list(Fleet(1).run(square, [3, 1, 2])) == [(0, 9), (1, 1), (2, 4)]
    assert list(Fleet(2).run(square, [])) == []


def test_two_processes_give_the_same_answers():
    assert dict(Fleet(2).run(square, list(range(20)))) == {k: k * k for k in range(20)}


def test_ctrl_c_is_for_this_process_alone():
    handler = signal.getsignal(signal.SIGINT)
    assert all(told for _, told in Fleet(2).run(deaf, range(6)))
    assert signal.getsignal(signal.SIGINT) is handler


def test_workers_share_the_cores(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    whole = own_cores()
    assert [told for _, told in Fleet(1).run(cores, [0])] == [whole]
    assert {told for _, told in Fleet(3).run(cores, range(6))} == {max(1, whole // 3)}
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    assert (threads(3), threads(99)) == (3, 7)


def test_cores_that_are_not_ours_are_not_counted(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {3, 5, 6}, raising=False)
    assert (threads(2), threads(99)) == (2, 3)


def test_what_is_written_before_ctrl_c_is_in_the_manifest(tmp_path, monkeypatch):
    def interrupted(fleet, function, tasks):
        yield 0, function(tasks[0])
        raise KeyboardInterrupt

    monkeypatch.setattr(Fleet, "run", interrupted)
    words, out, listed = boards(tmp_path, 2), tmp_path / "out", tmp_path / "manifest.json"
    words += ["--jobs", "2", "--out", str(out), "--manifest", str(listed)]
    out.mkdir()
    done = CliRunner().invoke(main, ["optimize", *words])
    assert done.exit_code == Exit.INTERRUPTED
    assert [path.name for path in out.iterdir()] == ["board0.drl"]
    assert "board0.drl" in listed.read_text() and "board1.drl" not in listed.read_text()
    assert done.stderr.endswith("tcp: interrupted: 1 of 2 files are done\n")


@pytest.mark.filterwarnings("ignore:A worker stopped:UserWarning")
def test_a_worker_that_is_killed_is_replaced_and_its_task_made_again(tmp_path):
    poison = tmp_path / "poison"
    poison.touch()
    answers = dict(Fleet(2).run(die_once, [(poison, k) for k in range(8)]))
    assert not poison.exists()
    assert answers == {k: k * k for k in range(8)}


def test_workers_that_die_again_and_again_end_the_run():
    with pytest.raises(FleetError, match=rf"{TRIES} times in a row with 2 tasks left"):
        list(Fleet(2).run(die, [1, 2]))


def test_a_task_that_fails_fails_once():
    with pytest.raises(UsageError, match="no 7"):
        list(Fleet(2).run(fail, [7]))


def test_what_a_fleet_needs():
    with pytest.raises(UsageError, match="unknown backend 'threads'; expected one of loky"):
        Fleet(backend="threads")
    with pytest.raises(UsageError, match="--scheduler needs --backend"):
        Fleet(scheduler="x:1")
    with pytest.raises(UsageError, match="needs --scheduler HOST:PORT"):
        Fleet(backend="dask")


@pytest.mark.parametrize(("backend", "package"), [("dask", "distributed"), ("ray", "ray")])
def test_a_missing_extra_is_named(backend, package, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    fleet = Fleet(backend=backend, scheduler="127.0.0.1:1")
    with pytest.raises(UsageError, match=rf"pip install 'tcp-drill\[{backend}\]'"):
        list(fleet.run(square, [1]))


# --- a real Dask cluster ----------------------------------------------------


@contextmanager
def dask_cluster(tmp_path: Path, workers: int = 2):
    """A scheduler and its workers; yields its address and their processes, the scheduler first."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{probe.getsockname()[1]}"
    dask = [sys.executable, "-m", "distributed.cli"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path}
    quiet["env"] = {**os.environ, "PYTHONPATH": str(ROOT)}
    host, port = address.split(":")
    processes = [
        subprocess.Popen(
            [dask[0], dask[1], f"{dask[2]}.dask_scheduler", "--host", host, "--port", port,
             "--no-dashboard"], **quiet,
        )
    ]  # fmt: skip
    for _ in range(workers):
        words = [f"{dask[2]}.dask_worker", address, "--nthreads", "1", "--no-nanny"]
        words += ["--no-dashboard"]
        processes.append(subprocess.Popen([dask[0], dask[1], *words], **quiet))
    try:
        import distributed

        with distributed.Client(address, timeout=30, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=60)
        yield address, processes
    finally:
        for process in processes:
            process.kill()
            process.wait()


@pytest.mark.filterwarnings("default")  # the cluster's own libraries may warn
def test_a_dask_cluster_loses_a_worker_and_no_answer(tmp_path):
    pytest.importorskip("distributed", reason="the dask extra is not installed")
    notes = tmp_path / "notes"
    notes.mkdir()
    with dask_cluster(tmp_path) as (address, (_, *workers)):
        fleet = Fleet(backend="dask", scheduler=address)
        answers = dict(fleet.run(patient, [(notes, k) for k in range(16)]))
    assert answers == {k: k * k for k in range(16)}
    who = [path.name.split("-") for path in notes.iterdir()]
    assert {int(pid) for _, pid in who} == {worker.pid for worker in workers}
    assert sum(number == "3" for number, _ in who) == 2, "made again by the other one"


@pytest.mark.filterwarnings("default")
def test_optimize_on_a_cluster_writes_what_it_writes_alone(tmp_path):
    pytest.importorskip("distributed", reason="the dask extra is not installed")
    words = boards(tmp_path, 6)
    alone = run_optimize(tmp_path / "alone", words)
    pair = run_optimize(tmp_path / "pair", [*words, "--jobs", "2"])
    with dask_cluster(tmp_path) as (address, _):
        many = run_optimize(
            tmp_path / "many", [*words, "--backend", "dask", "--scheduler", address]
        )
    assert many == pair == alone
    assert len(alone[1]) == 5


def boards(folder: Path, count: int) -> list[str]:
    """Small boards whose routes are proved, a broken one among them."""
    names = []
    for k in range(count):
        holes = "".join(f"X{(37 * i * (k + 3)) % 101}Y{(53 * i) % 97}\n" for i in range(12))
        text = f"M48\nMETRIC,TZ\nT1C.001\n%\nT1\n{holes}M30\n"
        if k == 2:
            text = text.replace("METRIC,TZ\n", "").replace("T1C.001", "T1C.0x")
        path = folder / f"board{k}.drl"
        path.write_text(text)
        names.append(str(path))
    return names


def run_optimize(out: Path, words: list[str]) -> tuple[list[str], dict[str, bytes], int]:
    """What was printed but for the times, what was written, and the exit code."""
    out.mkdir()
    done = CliRunner().invoke(main, ["optimize", *words, "--json", "--out", str(out)])
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    said = [row["file"] if "file" in row else row["input"] for row in rows]
    return said, {p.name: p.read_bytes() for p in out.iterdir()}, done.exit_code


@pytest.mark.filterwarnings("default")
def test_no_scheduler_is_said_in_one_sentence(monkeypatch):
    pytest.importorskip("distributed", reason="the dask extra is not installed")
    monkeypatch.setattr("tcp.fleet.CONNECT", 0.5)
    with pytest.raises(UsageError, match=r"no Dask scheduler answers at 127\.0\.0\.1:1"):
        list(Fleet(backend="dask", scheduler="127.0.0.1:1").run(square, [1]))


@pytest.mark.filterwarnings("default")
def test_a_dask_scheduler_that_dies_ends_the_run_with_what_came_back(tmp_path, monkeypatch):
    pytest.importorskip("distributed", reason="the dask extra is not installed")
    monkeypatch.setattr("tcp.fleet.CONNECT", 3)
    (tmp_path / "3-0").touch()  # nobody has to die of it
    with dask_cluster(tmp_path) as (address, (scheduler, *_)):
        answers = Fleet(backend="dask", scheduler=address).run(
            patient, [(tmp_path, k) for k in range(64)]
        )
        number, answer = next(answers)
        scheduler.kill()
        with pytest.raises(FleetError, match=rf"the Dask scheduler at {address} is lost \("):
            list(answers)
    assert answer == number * number


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("word", [b"", b"HTTP/1.1 400 Bad Request\r\n\r\n"])
def test_another_program_is_no_scheduler(word, monkeypatch):
    pytest.importorskip("distributed", reason="the dask extra is not installed")
    monkeypatch.setattr("tcp.fleet.CONNECT", 1)
    with socket.create_server(("127.0.0.1", 0)) as server:

        def talk() -> None:
            peer, _ = server.accept()
            with peer:
                peer.sendall(word)
                while peer.recv(4096):
                    pass

        threading.Thread(target=talk, daemon=True).start()
        address = f"127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(UsageError, match=rf"what is at {address} is no Dask scheduler"):
            list(Fleet(backend="dask", scheduler=address).run(square, [1]))


# --- a real Ray cluster -----------------------------------------------------


@contextmanager
def ray_cluster():
    """A Ray head with two workers, in processes of their own; yields its address."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    words = ["start", "--head", "--block", f"--port={port}", "--num-cpus=2"]
    words += ["--include-dashboard=false", "--disable-usage-stats"]
    head = subprocess.Popen(
        [str(Path(sys.executable).parent / "ray"), *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    try:
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.5)
        time.sleep(3)  # the port is open before the node has registered
        yield f"127.0.0.1:{port}"
    finally:
        head.terminate()
        head.wait(30)


@pytest.mark.slow
@pytest.mark.timeout(120)
@pytest.mark.filterwarnings("default")
def test_a_ray_cluster_gives_the_same_answers_though_a_worker_dies(tmp_path, monkeypatch):
    pytest.importorskip("ray", reason="the ray extra is not installed")
    monkeypatch.setenv("RAY_AUTH_MODE", "disabled")
    poison = tmp_path / "poison"
    poison.touch()
    with ray_cluster() as address:
        fleet = Fleet(backend="ray", scheduler=address)
        answers = dict(fleet.run(die_once, [(poison, k) for k in range(8)]))
    assert not poison.exists()
    assert answers == {k: k * k for k in range(8)}
