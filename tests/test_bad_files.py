"""Every kind of bad input has its file, and gets one sentence that names file and line."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from click.testing import CliRunner

from tcp.cli.main import main
from tcp.errors import InputError
from tcp.files import read, text

BAD = Path(__file__).resolve().parent / "files" / "bad"

EXPECTED = {
    # CSV: file, line (None where no line is at fault), words of the sentence
    "empty.csv": (None, "empty"),
    "blank.csv": (None, "empty"),
    "only_comments.csv": (None, "no holes"),
    "header_only.csv": (1, "no holes"),
    "missing_column.csv": (1, "column y is missing"),
    "one_column.csv": (1, "found 1 column"),
    "four_columns_no_header.csv": (1, "no header"),
    "text_for_number.csv": (3, "'two' is not a number"),
    "empty_cell.csv": (3, "empty cell"),
    "nan.csv": (2, "not a finite number"),
    "infinity.csv": (3, "not a finite number"),
    "duplicate_id.csv": (4, "stands in line 2 already"),
    "empty_id.csv": (2, "no id"),
    "ragged_short.csv": (3, "found 2 columns"),
    "ragged_long.csv": (3, "found 4 columns"),
    "utf16.csv": (1, "UTF-16"),
    "utf16_no_bom.csv": (1, "UTF-16"),
    "latin1.csv": (3, "0xE4 is not UTF-8"),
    "binary.csv": (1, "binary"),
    "huge_value.csv": (3, "'1e308' is beyond any workpiece"),
    "tiny_value.csv": (3, "2^52 steps"),
    "too_fine.csv": (2, "2^52 steps"),
    "decimal_comma_ambiguous.csv": (1, "no header"),
    "thousands.csv": (2, "'1.234,5' is not a number"),
    "unknown_unit.csv": (1, "expected mm or inch"),
    "mixed_units.csv": (1, "partly in mm"),
    "diameter_unit.csv": (1, "the diameters are in inch, x and y in mm"),
    "mixed_marks.csv": (3, "decimal commas and points are mixed, from line 2 on"),
    "mixed_marks_diameter.csv": (2, "decimal commas and points are mixed"),
    "mixed_unit_column.csv": (1, "contradict each other"),
    "unknown_unit_column.csv": (3, "'cm'; expected mm or inch"),
    "two_x.csv": (1, "two columns are named x"),
    "zero_diameter.csv": (2, "more than 0"),
    "text_diameter.csv": (2, "'big' is not a number"),
    "broken_quote.csv": (2, "quotes"),
    # TSPLIB
    "not_tsplib.tsp": (1, "KEYWORD"),
    "no_points.tsp": (None, "NODE_COORD_SECTION"),
    "few_points.tsp": (7, "DIMENSION says 3"),
    "geo.tsp": (4, "EUC_2D"),
    "atsp.tsp": (2, "expected TSP"),
    "tour.tsp": (2, "expected TSP"),
    "dimension.tsp": (3, "'many'"),
    "two_dimensions.tsp": (4, "DIMENSION '3', but line 3 says '2'"),
    "no_dimension.tsp": (None, "DIMENSION"),
    "huge_dimension.tsp": (3, "expected 1 to 6000"),
    "duplicate.tsp": (7, "stands in line 6 already"),
    "nan.tsp": (7, "not a finite number"),
    "three_d.tsp": (6, "found 4 columns"),
    "asymmetric.tsp": (7, "not symmetric"),
    "short_matrix.tsp": (7, "found 2 weights"),
    "negative_matrix.tsp": (7, "'-1'"),
    "format.tsp": (5, "UPPER_ROW"),
}


def test_every_bad_file_is_expected():
    assert {p.name for p in BAD.iterdir()} == set(EXPECTED)


@pytest.mark.parametrize("name", EXPECTED)
def test_bad_files_are_refused_with_file_and_line(name):
    line, words = EXPECTED[name]
    with pytest.raises(InputError) as caught:
        read(BAD / name)
    assert (caught.value.path, caught.value.line) == (BAD / name, line)
    assert words in str(caught.value)
    done = CliRunner().invoke(main, ["info", str(BAD / name)])
    assert done.exit_code == 3 and done.stdout == ""
    assert done.stderr == f"tcp: {caught.value}\n"


def refused(path: Path, words: str) -> None:
    done = CliRunner().invoke(main, ["solve", str(path)])
    assert (done.exit_code, done.stdout) == (3, "")
    assert done.stderr.startswith(f"tcp: {path}") and done.stderr.count("\n") == 1
    assert words in done.stderr and len(done.stderr) < 400


def test_directories_and_missing_files(tmp_path):
    refused(tmp_path, "is a directory")
    refused(tmp_path / "none.csv", "no such file")
    loop = tmp_path / "loop.csv"
    loop.symlink_to(loop)
    refused(loop, "symbolic links")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_files_without_permission(tmp_path):
    path = tmp_path / "secret.csv"
    path.write_text("1,2\n")
    path.chmod(0)
    refused(path, "permission denied")


def test_a_denied_file_is_one_sentence_for_root_too(tmp_path, monkeypatch):
    def denied(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", denied)
    monkeypatch.setattr(os, "access", lambda *_: False)  # what click asks
    (tmp_path / "secret.csv").touch()
    refused(tmp_path / "secret.csv", "permission denied")


def test_a_line_of_a_gigabyte_is_refused_without_reading_it(tmp_path):
    path = tmp_path / "long.csv"
    with path.open("wb") as file:
        file.write(b"id,x,y\n1,2,3\n")
        file.truncate(2**30)  # sparse: a gigabyte of NUL bytes without a newline
    refused(path, ":3: the line is longer than 1048576 bytes")
    text_line = tmp_path / "digits.csv"
    text_line.write_bytes(b"id,x,y\n1," + b"1" * (2**20 + 10))
    refused(text_line, ":2: the line is longer")


def test_a_file_beyond_all_size_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(text, "MAX_BYTES", 2**20)
    path = tmp_path / "many.csv"
    path.write_bytes(b"1,2,3\n" * 200_000)
    refused(path, "larger than 1 MiB")


def test_an_endless_line_of_columns_is_quick(tmp_path):
    path = tmp_path / "wide.csv"
    path.write_bytes(b"," * 500_000 + b"\n" + b"1" + b",1" * 500_000 + b"\n")
    refused(path, "columns and no header")


@pytest.mark.parametrize(
    ("text", "flag"), [("x_mm,y_mm\n1,2\n", "inch"), ("# units: inch\n1,2\n", "mm")]
)
def test_units_do_not_contradict_each_other(tmp_path, text, flag):
    path = tmp_path / "piece.csv"
    path.write_text(text)
    with pytest.raises(InputError, match="contradict"):
        read(path, units=flag)
