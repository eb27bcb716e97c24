"""``tcp solve`` and ``tcp info`` as users call them: output, files, exit codes, Ctrl-C."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
import sys
import threading
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from xml.etree import ElementTree

import pytest
from click.testing import CliRunner

from tcp.cli.main import main
from tcp.cli.options import setting
from tcp.files import read
from tcp.stop import Clock, Stop

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT / "data"
SLOW = ROOT / "tests" / "files" / "slow_tcp.py"


def tcp(*words):
    return CliRunner().invoke(main, [str(word) for word in words])


def solved(*words):
    done = tcp("solve", "--json", *words)
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)


def test_the_table_says_what_matters():
    done = tcp("solve", "--exact", "--solver", "held-karp", DATA / "wp2.csv")
    assert done.exit_code == 0 and done.stderr == ""
    lines = [line.split(maxsplit=1) for line in done.stdout.splitlines()[1:]]
    labels = [line[0] for line in lines]
    assert labels == ["route", "time", "lower", "gap", "proof", "solver", "seconds"]
    assert dict(lines)["time"] == "280" and "optimal" in dict(lines)["proof"]


def test_json_has_exactly_the_documented_keys():
    data = solved("--travel", "case2", "--seed", 7, "--start", 3, DATA / "wp1.csv")
    assert list(data) == [
        *("instance", "route", "cost", "lower_bound", "gap", "status", "proof", "solver"),
        *("seed", "stop_reason", "runtime_s", "versions"),
    ]
    assert list(data["instance"]) == ["name", "holes", "travel", "ends", "quantum", "sha256"]
    assert data["instance"]["ends"] == {"start": "3"} and data["route"][0] == "3"
    assert sorted(data["route"]) == [str(i) for i in range(1, 10)]
    assert data["seed"] == 7 and data["status"] == "optimal" and data["gap"] == 0
    assert {"python", "tcp", "numpy"} <= set(data["versions"])


def test_a_formulation_asks_for_milp():
    done = tcp("solve", "--formulation", "mtz", DATA / "five.csv")
    assert done.exit_code == 0 and "milp" in done.stdout


def test_auto_says_what_it_picked():
    done = tcp("solve", DATA / "five.csv")
    assert "held-karp (auto: " in " ".join(done.stdout.split())


def test_costs_in_json_are_exact_decimals():
    data = solved("--solver", "held-karp", "--vx", "3", "--vy", "8", DATA / "five.csv")
    assert Fraction(data["cost"]) * 24 % 1 == 0 and data["cost"] == data["lower_bound"]
    data = solved("--solver", "held-karp", DATA / "wp1.csv")
    assert Decimal(data["cost"]) == Decimal("322.5")


def test_several_files_give_one_object_each_and_the_worst_exit_code(tmp_path):
    bad = tmp_path / "bad.csv"
    bad.write_text("")
    done = tcp("solve", "--json", DATA / "five.csv", bad, DATA / "wp1.csv")
    assert done.exit_code == 3
    assert [json.loads(line)["instance"]["name"] for line in done.stdout.splitlines()] == [
        "five",
        "wp1",
    ]
    assert done.stderr == f"tcp: {bad}: the file is empty; expected a list of holes\n"


@pytest.mark.parametrize("text", ["3.5,-2\n", "1,2\n4,6\n", "1,2\n1,2\n"])
@pytest.mark.parametrize("ends", [[], ["--closed"], ["--home", "0,0"], ["--start", "1"]])
def test_one_and_two_holes(tmp_path, text, ends):
    path = tmp_path / "tiny.csv"
    path.write_text(text)
    done = tcp("solve", "--exact", *ends, path)
    assert done.exit_code == 0, done.stderr


USAGE = {
    "unknown travel": ["--travel", "walk"],
    "unknown start": ["--start", "99"],
    "unknown end": ["--end", "x"],
    "speed 0": ["--vx", "0"],
    "negative speed": ["--vy", "-3"],
    "speed no number": ["--vx", "fast"],
    "speed over zero": ["--vx", "1/0"],
    "acceleration missing": ["--travel", "trapezoidal"],
    "acceleration without ramps": ["--travel", "case2", "--ax", "5", "--ay", "5"],
    "axes of no ramps": ["--axes", "sequential"],
    "zero acceleration": ["--travel", "trapezoidal", "--ax", "0", "--ay", "1"],
    "zero quantum": ["--quantum", "0"],
    "rounding of exact times": ["--rounding", "up"],
    "home no point": ["--home", "here"],
    "home half a point": ["--home", "3,"],
    "legs without home": ["--legs", "out"],
    "closed with end": ["--closed", "--end", "3"],
    "closed with home": ["--closed", "--home", "0,0"],
    "start is end": ["--start", "1", "--end", "1"],
    "unknown solver": ["--solver", "magic"],
    "unknown option of a solver": ["--solver", "held-karp", "--set", "depth=3"],
    "seed as an option of a solver": ["--set", "seed=5"],
    "stop as an option of a solver": ["--set", "stop=5"],
    "word for a number": ["--solver", "htga", "--set", "np=many"],
    "half a generation": ["--solver", "htga", "--set", "gn=2.5"],
    "number for a word": ["--solver", "milp", "--set", "backend=3"],
    "unknown formulation": ["--formulation", "guess"],
    "home not finite": ["--home", "nan,0"],
    "setting without value": ["--set", "depth"],
    "negative seed": ["--seed", "-1"],
    "negative time": ["--time-limit", "-1"],
    "time no number": ["--time-limit", "nan"],
    "negative gap": ["--gap", "-0.1"],
    "no matrix": ["--travel", "explicit"],
    "route suffix": ["--out", "route.xls"],
    "picture suffix": ["--plot", "route.gif"],
    "unknown unit": ["--units", "cubit"],
}


@pytest.mark.parametrize("kind", USAGE)
def test_usage_errors_are_one_sentence_and_exit_2(kind):
    done = tcp("solve", *USAGE[kind], DATA / "wp1.csv")
    assert done.exit_code == 2, (done.stdout, done.stderr)
    assert done.stderr.startswith("tcp: ") and done.stderr.count("\n") == 1


def test_a_certificate_is_written_and_passes_the_checker(tmp_path):
    proof = tmp_path / "wp1.cert.json"
    done = tcp("solve", "--exact", "--certificate", proof, DATA / "wp1.csv")
    assert done.exit_code == 0 and "certified" in done.stdout
    assert tcp("check", proof, DATA / "wp1.csv").exit_code == 0
    assert tcp("check", proof, DATA / "wp2.csv").exit_code == 1
    assert list(tmp_path.iterdir()) == [proof]


def test_a_certificate_of_less_than_the_solver_proved_is_no_proof(tmp_path, monkeypatch):
    solving = sys.modules["tcp.solve"]
    engine = solving._with_evidence

    def hurried(instance, outcome, seed, clock, report):
        return engine(instance, outcome, seed, Clock(Stop(time=0)), report)

    monkeypatch.setattr(solving, "_with_evidence", hurried)
    proof = tmp_path / "wp2.cert.json"
    words = ("solve", "--solver", "held-karp", "--certificate", proof, DATA / "wp2.csv")
    for exact, code in (((), 0), (("--exact",), 5)):
        done = tcp(*words, *exact)
        assert done.exit_code == code and "optimal, trusted" in done.stdout
        assert "note: the certificate proves a lower bound, not the route" in done.stderr
        assert "takes at least" in tcp("check", proof, DATA / "wp2.csv").stdout


@pytest.mark.parametrize(
    ("command", "rule"),
    [
        (["solve", "--solver", "branch-and-cut"], ["--balance", "2,1/2,2"]),
        (["solve", "--solver", "positions"], ["--axis-run", "3"]),
        (["solve"], ["--jump-diameters", "1"]),
        (["bound"], ["--balance", "2,1/2,2"]),
    ],
)
def test_certificates_of_rules_they_do_not_know_are_refused_before_any_work(
    command, rule, tmp_path
):
    proof, file = tmp_path / "proof.json", tmp_path / "holes.csv"
    file.write_text("x,y,diameter\n0,0,1\n5,0,1\n0,7,1\n9,9,1\n")
    done = tcp(*command, *rule, "--units", "mm", "--certificate", proof, file)
    assert done.exit_code == 2 and "certificates know no rule about" in done.output
    assert not proof.exists()


def test_states_of_rules_that_certificates_do_not_know_are_refused(tmp_path):
    state = tmp_path / "state.json"
    done = tcp("solve", "--balance", "2,1/2,2", "--save-state", state, DATA / "wp1.csv")
    assert done.exit_code == 2 and not state.exists()


def test_certificates_of_too_many_holes_are_refused_before_the_work(tmp_path, monkeypatch):
    """The route came out without one, and without a word."""
    monkeypatch.setattr("tcp.exact.branch_and_cut.run.LARGEST", 5)
    proof = tmp_path / "proof.json"
    done = tcp("solve", "--solver", "held-karp", "--certificate", proof, DATA / "wp1.csv")
    assert done.exit_code == 2 and done.stdout == ""
    assert "no certificate of wp1: branch-and-cut makes it, and it takes up to 5" in done.stderr


def test_several_certificates_need_a_directory(tmp_path):
    files = [DATA / "wp1.csv", DATA / "five.csv"]
    assert tcp("solve", "--exact", "--certificate", tmp_path / "one.json", *files).exit_code == 2
    assert tcp("solve", "--exact", "--certificate", tmp_path, *files).exit_code == 0
    written = {path.name for path in tmp_path.iterdir()}
    assert written == {"wp1.cert.json.gz", "five.cert.json.gz"}


def test_a_certificate_that_cannot_be_written_is_exit_7(tmp_path):
    nowhere = tmp_path / "missing" / "wp1.cert.json"
    assert tcp("solve", "--exact", "--certificate", nowhere, DATA / "wp1.csv").exit_code == 7


def test_a_certified_bound_is_not_called_an_optimum():
    from types import SimpleNamespace

    from tcp.report.table import proof
    from tcp.result import Proof, Status

    def said(status, kind):
        return proof(SimpleNamespace(status=status, proof=kind))

    assert said(Status.OPTIMAL, Proof.CERTIFIED) == "optimal, certified"
    assert "optimal" not in said(Status.FEASIBLE, Proof.CERTIFIED)
    assert said(Status.FEASIBLE, Proof.NONE) == "none"


def test_gaps_are_percentages_however_small():
    from tcp.report.table import percent

    gaps = [None, 0, 0.25, -0.25, 1e-4, 3.4e-5, 1e-6, 2e-12]
    said = ["unknown", "0 %", "25.00 %", "-25.00 %", "0.01 %", "0.0034 %", "0.0001 %"]
    assert [percent(gap) for gap in gaps] == [*said, "under 0.0001 %"]


@pytest.mark.parametrize(
    ("gap", "said"), [(0.123412, "12.35 %"), (0.1234, "12.34 %"), (0.07, "7.00 %")]
)
def test_a_gap_is_rounded_up(gap, said):
    from tcp.report.table import percent

    assert percent(gap) == said


def test_one_hole_is_in_the_singular(tmp_path):
    path = tmp_path / "one.csv"
    path.write_text("3,4\n")
    assert "1 hole fits the dynamic programme" in tcp("solve", path).stdout


def test_infeasible_is_exit_4():
    done = tcp("solve", "--min-jump", "400", DATA / "wp1.csv")
    assert done.exit_code == 4 and "infeasible" in done.stdout


def test_exact_without_a_proof_in_time_is_exit_5():
    words = ["--json", "--solver", "slow", "--time-limit", "0.1", str(DATA / "wp1.csv")]
    for exact, code in ((["--exact"], 5), ([], 0)):
        done = slow_tcp(*exact, *words)
        assert done.returncode == code, done.stderr
        data = json.loads(done.stdout)
        assert data["status"] == "feasible" and data["stop_reason"] == "time limit"
        assert data["lower_bound"] == "0.01" and len(data["route"]) == 9


def slow_tcp(*words):
    return subprocess.run(
        [sys.executable, SLOW, "solve", *words], capture_output=True, text=True, timeout=60
    )


@pytest.mark.parametrize(("exact", "code"), [([], 0), (["--exact"], 5)])
def test_ctrl_c_returns_the_best_so_far(exact, code):
    words = ["--json", "--solver", "slow", *exact, str(DATA / "wp1.csv"), str(DATA / "wp2.csv")]
    process = subprocess.Popen(
        [sys.executable, SLOW, "solve", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None and process.stderr.readline() == "started\n"
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=30)
    assert process.returncode == code
    data = json.loads(out)  # one object: the second file was not begun
    assert data["stop_reason"] == "interrupted" and len(data["route"]) == 9


def test_a_second_ctrl_c_leaves_at_once(monkeypatch):
    from tcp.cli import solve

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(solve, "solve", interrupted)
    done = tcp("solve", DATA / "wp1.csv")
    assert done.exit_code == 130 and done.stdout == ""
    assert done.stderr.strip() == "tcp: interrupted before there was a result"


def on_pty(words):
    """What a person sees: everything that a command writes to a terminal."""
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, SLOW, "solve", *words],
        stdout=theirs,
        stderr=theirs,
        stdin=theirs,
        env=os.environ | {"TERM": "xterm", "COLUMNS": "100"},
    )
    os.close(theirs)
    seen = []

    def collect() -> None:
        while True:
            try:
                chunk = os.read(ours, 4096)
            except OSError:  # Linux: the other side has closed
                return
            if not chunk:
                return
            seen.append(chunk)

    reader = threading.Thread(target=collect)
    reader.start()
    code = process.wait(timeout=60)
    reader.join(timeout=10)
    os.close(ours)
    return code, b"".join(seen).decode()


@pytest.mark.parametrize(
    ("text", "value"),
    [("3", 3), ("-2", -2), ("1e3", 1e3), ("true", True), ("ox", "ox"), ("a=b", "a=b")],
)
def test_a_setting_is_a_number_where_it_looks_like_one(text, value):
    key, found = setting(f"np-size={text}")
    assert (key, found, type(found)) == ("np_size", value, type(value))


def test_a_terminal_has_a_live_line_and_a_pipe_has_none():
    words = ["--solver", "slow", "--time-limit", "0.7", str(DATA / "wp1.csv")]
    code, seen = on_pty(words)
    assert code == 0
    assert "wp1: best 345.68  bound 0.01  gap" in seen and "lower bound" in seen
    done = slow_tcp(*words)
    assert done.returncode == 0 and done.stderr == "started\n"
    assert "best" not in done.stdout and "\x1b" not in done.stdout
    code, seen = on_pty(["--json", *words])
    assert code == 0 and "best" not in seen


def test_routes_are_written_and_read_back(tmp_path):
    out = tmp_path / "route.csv"
    assert tcp("solve", "--out", out, DATA / "wp1.csv").exit_code == 0
    again = read(out).workpiece
    data = json.loads(tcp("solve", "--json", DATA / "wp1.csv").stdout)
    assert list(again.ids) == data["route"]
    info = json.loads(tcp("info", "--json", out).stdout)
    assert info["file_order"] == data["cost"]


def test_several_files_need_a_directory(tmp_path):
    files = [DATA / "five.csv", DATA / "wp1.csv"]
    done = tcp("solve", "--out", tmp_path / "one.csv", *files)
    assert done.exit_code == 2 and "give a directory" in done.stderr
    done = tcp("solve", "--out", tmp_path, "--plot", tmp_path, *files)
    assert done.exit_code == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        *("five.route.csv", "five.svg", "wp1.route.csv", "wp1.svg")
    ]


def test_an_output_that_cannot_be_written_is_exit_7(tmp_path):
    done = tcp("solve", "--out", tmp_path / "none" / "r.csv", DATA / "five.csv")
    assert done.exit_code == 7 and "cannot write" in done.stderr


def test_loops_of_links_are_refused_or_replaced(tmp_path):
    loop = tmp_path / "loop.csv"
    loop.symlink_to(loop)
    assert tcp("solve", loop).exit_code == 3
    assert tcp("solve", "--out", loop, DATA / "wp1.csv").exit_code == 0
    assert loop.read_text().count("\n") >= 9 and not loop.is_symlink()


def test_tours_are_written_for_tsplib(tmp_path):
    out = tmp_path / "five.tour"
    assert tcp("solve", "--closed", "--out", out, DATA / "five.csv").exit_code == 0
    words = out.read_text().split()
    tour = words[words.index("TOUR_SECTION") + 1 :]
    assert sorted(tour[:5]) == list("12345") and tour[5:] == ["-1", "EOF"]


def test_pictures(tmp_path):
    ends = ["--home", "0,0", "--legs", "out"]
    for name in ("a.svg", "a.png"):
        done = tcp("solve", *ends, "--plot", tmp_path / name, DATA / "five.csv")
        assert done.exit_code == 0, done.stderr
    root = ElementTree.parse(tmp_path / "a.svg").getroot()
    tags = [element.tag.rpartition("}")[2] for element in root.iter()]
    assert tags.count("circle") == 5 and tags.count("polyline") == 5
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "words",
    [
        "solve p.csv --plot a.svg",
        "solve p.csv --out a.csv",
        "solve p.csv --certificate a.json",
        "solve p.csv --save-state a.json",
        "bound p.csv --certificate a.json",
        "bound p.csv --certificate a.json.gz --method lp",
        "oracle pin p.csv",
        "export p.csv --out a.mps",
        "validate p.csv --route 1,2,3,4 --out a.txt",
        "validate q.csv --route-file p.csv --out a.txt",
        "audit p.toml --out a.txt",
    ],
)
def test_what_is_made_of_a_private_file_is_private(tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    holes = "id,x,y\n1,0,0\n2,1,1\n3,2,1\n4,5,1\n"
    claims = (DATA / "claims" / "htga-2016.toml").read_text()
    for path in (Path("p.csv"), Path("q.csv"), Path("p.toml")):
        path.write_text(holes if path.suffix == ".csv" else claims)
        path.chmod(0o600 if path.stem == "p" else 0o644)
    given = set(tmp_path.rglob("*"))
    done = tcp(*words.split())
    made = [path for path in tmp_path.rglob("*") if path.is_file() and path not in given]
    assert made, done.output
    assert {path.stat().st_mode & 0o777 for path in made} == {0o600}


@pytest.mark.parametrize("command", ["solve", "info"])
def test_no_id_colours_the_terminal(tmp_path, command):
    path = tmp_path / "p.csv"
    path.write_text("id,x,y\n\x1b[31mred,0,0\n")
    done = tcp(command, path)
    assert done.exit_code == 0 and "\\x1b[31mred" in done.stdout and "\x1b" not in done.stdout


def test_ids_and_paths_are_printed_whole(tmp_path):
    path = tmp_path / "p.csv"
    ids = [f"via-pad-number-{k}-{'x' * k}" for k in range(0, 100, 7)]
    path.write_text("id,x,y\n" + "".join(f"{name},{k},0\n" for k, name in enumerate(ids)))
    printed = tcp("solve", path).stdout.split()
    assert set(ids) <= set(printed)


def test_names_in_pictures_are_escaped(tmp_path):
    path = tmp_path / "evil.csv"
    names = ("<script>alert(1)</script>", "$\\frac{", "&amp;", "\x1b[31m")
    path.write_text("id,x,y\n" + "".join(f"{name},{k},0\n" for k, name in enumerate(names)))
    for name in ("e.svg", "e.png"):
        assert tcp("solve", "--plot", tmp_path / name, path).exit_code == 0
    assert "<script" not in (tmp_path / "e.svg").read_text()
    ElementTree.parse(tmp_path / "e.svg")


def test_png_without_matplotlib_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    done = tcp("solve", "--plot", tmp_path / "a.png", DATA / "five.csv")
    assert done.exit_code == 2 and "tcp-drill[plot]" in done.stderr


def test_the_files_own_travel_is_the_default(tmp_path):
    path = tmp_path / "p.tsp"
    path.write_text(
        "NAME: p\nTYPE: TSP\nDIMENSION: 3\nEDGE_WEIGHT_TYPE: CEIL_2D\n"
        "NODE_COORD_SECTION\n1 0 0\n2 1 1\n3 2 2\nEOF\n"
    )
    assert solved(path)["cost"] == "4"
    assert solved("--travel", "euclidean", path)["cost"] == "4"
    assert solved("--quantum", "0.01", path)["cost"] == "2.84"
    assert solved("--travel", "case1", path)["cost"] == "4"
    assert solved("--travel", "case2", path)["cost"] == "2"
    assert solved("--travel", "case2", path)["instance"]["quantum"] == "1"


def test_notes_go_to_stderr(tmp_path):
    path = tmp_path / "p.csv"
    path.write_text("id,x,y,net\n1,0,0,a\n2,0,0,b\n")
    done = tcp("solve", "--json", path)
    assert json.loads(done.stdout)["cost"] == "0"
    assert done.stderr == (
        f"tcp: {path}: note: ignored column: net\n"
        f"tcp: {path}: note: 1 place with more than one hole (holes 1 and 2)\n"
    )


def test_info_describes_a_workpiece(tmp_path):
    path = tmp_path / "p.csv"
    path.write_text("id,x_in,y_in,dia,tool\nA,1,2,0.04,T1\nB,3,2,0.04,T1\nC,3,2,,\n")
    data = json.loads(tcp("info", "--json", path).stdout)
    assert data["holes"] == 3 and data["step_mm"] == "25.4"
    assert data["x_mm"] == ["25.4", "76.2"] and data["y_mm"] == ["50.8", "50.8"]
    assert data["diameters_mm"] == {"1.016": 2, "none": 1} and data["tools"] == {"T1": 2, "none": 1}
    assert data["coincident"] == 1 and data["file_order"] == "50.8"
    text = tcp("info", path).stdout
    path.write_text("id,x,y,dia,tool\nA,1,2,10,T10\nB,3,2,0.25,T2\nC,3,3,2,T1\n")
    data = json.loads(tcp("info", "--json", path).stdout)
    assert list(data["diameters_mm"]) == ["0.25", "2", "10"]
    assert list(data["tools"]) == ["T1", "T2", "T10"]
    assert "T1 (2 holes)" in text and "none (1 hole)" in text and "coincident" in text


@pytest.mark.parametrize("option", ["--out", "--plot", "--certificate"])
def test_what_needs_an_ending_is_no_device(option):
    done = tcp("solve", DATA / "five.csv", option, "/dev/stdout")
    assert done.exit_code == 2 and "expected a name that ends in" in done.stderr
    assert done.stdout == ""


@pytest.mark.parametrize("option", ["--out", "--plot", "--certificate", "--save-state"])
def test_no_output_ever_replaces_an_input(tmp_path, option):
    board = tmp_path / "board.csv"
    board.write_text("id,x,y\na,0,0\nb,3,4\n")
    before = board.read_bytes()
    for name in (board, tmp_path / "." / "board.csv"):
        done = tcp("solve", option, name, board)
        assert done.exit_code == 2 and done.stdout == ""  # refused before anything is solved
        assert board.read_bytes() == before
    (tmp_path / "link.csv").symlink_to(board)
    assert tcp("solve", option, tmp_path / "link.csv", board).exit_code == 2


def test_no_output_replaces_another(tmp_path):
    for folder in ("a", "b", "out"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "board.csv").write_text("1,2\n3,4\n")
    boards = [tmp_path / "a" / "board.csv", tmp_path / "b" / "board.csv"]
    done = tcp("solve", "--out", tmp_path / "out", *boards)
    assert done.exit_code == 2 and "written twice" in done.stderr
    assert tcp("solve", "--out", tmp_path / "out", boards[0]).exit_code == 0
    one = tmp_path / "one.csv"
    assert tcp("solve", "--out", one, "--save-state", one, boards[0]).exit_code == 2


def test_a_missing_folder_is_seen_before_the_work(tmp_path):
    done = tcp("solve", "--out", tmp_path / "none" / "r.csv", DATA / "wp1.csv")
    assert done.exit_code == 7 and done.stdout == ""


@pytest.mark.parametrize("wish", [("--out", "m.csv"), ("--plot", "m.svg")])
def test_holes_without_places_are_not_drawn_or_listed(tmp_path, wish):
    """Coordinates made up would be read back as another problem."""
    matrix = tmp_path / "m.tsp"
    head = "NAME: m\nTYPE: TSP\nDIMENSION: 3\nEDGE_WEIGHT_TYPE: EXPLICIT\n"
    matrix.write_text(head + "EDGE_WEIGHT_FORMAT: UPPER_ROW\nEDGE_WEIGHT_SECTION\n1 2 3\nEOF\n")
    done = tcp("solve", wish[0], tmp_path / wish[1], matrix)
    assert done.exit_code == 2 and "no places; give --out NAME.tour" in done.stderr
    assert tcp("solve", "--out", tmp_path / "m.tour", matrix).exit_code == 0
