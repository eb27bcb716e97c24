"""Whatever bytes a file holds, a reader returns a workpiece or one sentence."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tcp import Instance
from tcp.errors import InputError, UsageError
from tcp.files import Reading, read

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
