"""Whatever bytes a file holds, a reader returns a workpiece or one sentence."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import sys
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tcp import Instance
from tcp.errors import InputError, UsageError
from tcp.files import Reading, read

ROOT = Path(__file__).parents[1]

CELLS = ["x", "y", "id", "X (mm)", "y_in", "diameter", "tool", "1", "2.5", "-3", "1e3", "1,5"]
CELLS += ["", " ", "nan", "#", '"', '"a', "é", "\0", "9" * 40, "1e308", "# units: inch", "\u2028"]
WORDS = ["NAME", "TYPE", "TSP", "DIMENSION", "EDGE_WEIGHT_TYPE", "EUC_2D", "EXPLICIT", ":", "EOF"]
WORDS += ["EDGE_WEIGHT_FORMAT", "UPPER_ROW", "FULL_MATRIX", "NODE_COORD_SECTION", "-1", "0"]
WORDS += ["EDGE_WEIGHT_SECTION", "DISPLAY_DATA_SECTION", "2", "3", "1.5", "1e9", "nan", "\n", "\n"]

tables = st.lists(
    st.builds(
        lambda delimiter, cells: delimiter.join(cells),
        st.sampled_from([",", ";", "\t", " "]),
        st.lists(st.sampled_from(CELLS), min_size=1, max_size=5),
    ),
    max_size=6,
).map(lambda lines: "\n".join(lines).encode())
problems = st.lists(st.sampled_from(WORDS), max_size=40).map(lambda words: " ".join(words).encode())
head = b"NAME: p\nTYPE: TSP\nDIMENSION: 2\nEDGE_WEIGHT_TYPE: "


def judged(folder, name, data):
    path = folder / name
    path.write_bytes(data)
    try:
        reading = read(path)
    except InputError as error:
        assert "\n" not in str(error) and len(str(error)) < 600
        return
    assert isinstance(reading, Reading) and len(reading.workpiece) >= 1
    with contextlib.suppress(UsageError):  # a board too wide for 62-bit costs
        assert Instance(reading.workpiece).granularity >= 1


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


@settings(max_examples=300, deadline=None)
@given(tables | st.binary(max_size=60))
@example(b'"1,2\n')
@example(b"x,y\n1,2\x1c3,4\n")
def test_csv(folder, data):
    judged(folder, "f.csv", data)


@settings(max_examples=300, deadline=None)
@given(problems | st.binary(max_size=60) | problems.map(lambda tail: head + tail))
@example(head + b"EUC_2D\nNODE_COORD_SECTION\n")
@example(head + b"EXPLICIT\nEDGE_WEIGHT_FORMAT: FULL_MATRIX\nEDGE_WEIGHT_SECTION\n")
def test_tsplib(folder, data):
    judged(folder, "f.tsp", data)


def test_a_drawing_that_its_parser_stumbles_over_is_refused(tmp_path):
    """What the fuzzer found: ezdxf raises IndexError for a header that ends early."""
    pytest.importorskip("ezdxf", reason="DXF needs ezdxf")
    path = tmp_path / "f.dxf"
    path.write_bytes(b"0\nSECTION\n2\nHEADER\n9\n$ACADVER\n0\nAC1T\n8\n0\n0\nENDSEC\n0\nEOF\n")
    with pytest.raises(InputError, match="is no DXF drawing"):
        read(path)


def test_a_long_heading_is_shortened(tmp_path):
    """What the fuzzer found: a message as long as the file's first line."""
    path = tmp_path / "f.csv"
    path.write_text(f"id;X ({'m' * 3000});y\na;1;2\n")
    with pytest.raises(InputError, match="expected mm or inch") as caught:
        read(path)
    assert len(str(caught.value)) < 300


def test_a_long_keyword_value_is_shortened(tmp_path):
    """What the fuzzer found: TSPLIB messages as long as the line."""
    path = tmp_path / "f.tsp"
    for key in ("TYPE", "EDGE_WEIGHT_TYPE"):
        path.write_text(f"{key}: {'m' * 3000}\nDIMENSION: 3\nNODE_COORD_SECTION\n1 0 0\n")
        with pytest.raises(InputError, match="expected") as caught:
            read(path)
        assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    "text", ["id,x,y\n{0},1,2\n{0},3,4\n", "x,y\n1,2{0}\n", "# units: {0}\n1,2\n", "{0},{0}\n{0}\n"]
)
def test_a_long_cell_is_shortened(tmp_path, text):
    path = tmp_path / "f.csv"
    path.write_text(text.format("m" * 3000))
    with pytest.raises(InputError) as caught:
        read(path)
    assert len(str(caught.value)) < 300


def fuzzer():
    spec = importlib.util.spec_from_file_location("fuzzer", ROOT / "benchmarks" / "fuzz_readers.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_fuzzer_says_what_it_needs(monkeypatch, capsys):
    module = fuzzer()
    monkeypatch.setattr(sys, "argv", ["fuzz_readers.py", "csv"])
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert module.main() == 2
    assert "pip install atheris" in capsys.readouterr().err


DONE = "import sys; print('Done 12 runs in 5 second(s)', file=sys.stderr)"


@pytest.mark.parametrize(
    ("script", "code", "said"),
    [
        ("raise SystemExit(3)", 3, "csv: 0 s, 0 executions, ended early, code 3"),
        (DONE, 0, "csv: 5 s, 12 executions, ended in time; 0 kinds of failure"),
        (DONE + "; raise SystemExit(77)", 3, "csv: 5 s, 12 executions, ended early, code 77"),
    ],
)
def test_a_fuzzer_that_crashes_is_not_clean(tmp_path, monkeypatch, capsys, script, code, said):
    module = fuzzer()
    child = tmp_path / "child.py"
    child.write_text(script)
    results = tmp_path / "fuzz.json"
    words = ["fuzz_readers.py", "csv", "--out", str(tmp_path), "--results", str(results)]
    monkeypatch.setattr(sys, "argv", words)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: name)
    monkeypatch.setattr(module, "__file__", str(child))
    assert module.main() == code
    assert said in capsys.readouterr().out
    row = json.loads(results.read_text())["csv"]
    assert row["found"] == [] and row["versions"]["python"]


def test_what_the_fuzzer_found_and_is_mended_goes():
    target = fuzzer().drill_target("excellon")
    assert fuzzer().keeps_the_rules(target, b"no drill file")
    assert not fuzzer().keeps_the_rules(lambda data: 1 / 0, b"")
