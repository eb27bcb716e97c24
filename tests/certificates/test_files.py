"""The files in correct/, incorrect/ and malformed/, files of absurd size, and ``tcp check``."""

from __future__ import annotations

import gzip
import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

import tcp.validate.certificate as checker
from tcp.cli.main import main
from tests.certificates import make_files

FOLDER = Path(__file__).parent
ROOT = FOLDER.parent.parent


def code_of(path: Path) -> tuple[int, str]:
    try:
        return 0, checker.check(checker.unzip(path)).statement
    except checker.Failure as failure:
        return failure.code, str(failure)


FILES = [
    (path, code)
    for folder, code in (("correct", 0), ("incorrect", 1), ("malformed", 3))
    for path in sorted((FOLDER / folder).glob("*.json"))
]


@pytest.mark.parametrize(("path", "code"), FILES, ids=lambda v: getattr(v, "stem", ""))
def test_every_file_gets_its_verdict(path, code):
    assert code_of(path)[0] == code, code_of(path)[1]


def test_no_file_is_missing():
    names = {path.stem for path, _ in FILES}
    assert len(FILES) > 70
    assert names >= make_files.INCORRECT.keys() | make_files.MALFORMED.keys()


def test_the_worked_example_of_the_documentation():
    """The JSON in docs/certificate.md is the file correct/five.json, and it is verified."""
    page = (ROOT / "docs" / "certificate.md").read_text()
    (block,) = re.findall(r"```json\n(.*?)```", page, re.DOTALL)
    shown = json.loads(block)
    assert shown == json.loads((FOLDER / "correct" / "five.json").read_text())
    statement = checker.check(block.encode()).statement
    assert statement in page
    assert checker.check(block.encode()).lower == 10


FIVE = (FOLDER / "correct" / "five.json").read_text()


def test_files_of_absurd_size_are_refused(tmp_path, monkeypatch):
    bomb = tmp_path / "bomb.json.gz"
    with gzip.open(bomb, "wb", compresslevel=1) as stream:
        for _ in range(9):
            stream.write(b"[" * 2**20)
    monkeypatch.setattr(checker, "MAX_BYTES", 2**23)
    assert code_of(bomb) == (3, f"a certificate has at most {2**23} bytes")
    assert len(checker.unzip(bomb)) == 2**23 + 1


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 100_000 + "]" * 100_000, "no valid JSON"),
        ("[" * 7_000_000, "too many lists"),
        ("[" + "0," * 60_000_001, "too many lists or numbers"),
        ("[" + "1" * 5_000 + "]", "no valid JSON"),
        (FIVE.replace('"lower":10', '"lower":' + "1" * 4_000), "whole number"),
        (FIVE.replace('"lower":10', '"lower":1e1'), "lower must be of type int"),
        (FIVE.replace('"lower":10', '"lower":Infinity'), "lower must be of type int"),
        (FIVE.replace('"lower":10', '"lower":10,"lower":10'), "same key twice"),
        ("null", "not a tcp-certificate"),
        ("", "no valid JSON"),
    ],
    ids=lambda v: str(v)[:20],
)
def test_hostile_texts_are_refused(text, words):
    with pytest.raises(checker.Failure, match=words) as caught:
        checker.check(text.encode())
    assert caught.value.code == 3


def test_a_hundred_megabytes_are_refused_or_read(tmp_path):
    """A valid certificate blown up with spaces is read; one with rubbish is refused."""
    padded = FIVE.replace('"tree":[', '"tree":[' + " " * 100_000_000).encode()
    assert checker.check(padded).lower == 10
    with pytest.raises(checker.Failure, match="no valid JSON"):
        checker.check(padded.replace(b"   ]", b" ]]")[:-3])


def test_bytes_that_are_no_text_or_no_gzip(tmp_path):
    for data in (b"\xff\xfe", b"\x1f\x8b\x08rubbish", gzip.compress(FIVE.encode())[:-9]):
        path = tmp_path / "x.json.gz"
        path.write_bytes(data)
        assert code_of(path)[0] == 3


def test_other_versions_are_unsupported():
    with pytest.raises(checker.Failure, match="version 3") as caught:
        checker.check(FIVE.replace('"version":1', '"version":3').encode())
    assert caught.value.code == 6


# --- tcp check -------------------------------------------------------------------------


@pytest.fixture
def holes(tmp_path):
    path = tmp_path / "five.csv"
    path.write_text("id;x;y\n1;1,0;2\n2;3;1\n3;5;2\n4;3;3\n5;1;4\n")
    return path


def check(*arguments) -> tuple[int, str]:
    found = CliRunner().invoke(main, ["check", *map(str, arguments)])
    return found.exit_code, found.output


def test_tcp_check_says_what_is_proved(holes):
    file = FOLDER / "correct" / "five.json"
    code, text = check(file)
    assert code == 0 and "takes 10 s (10 quanta of 1 s), and no route takes less" in text
    assert "that the workpiece in the file is yours" in text
    assert json.loads(FIVE)["instance"]["sha256"] in text
    code, text = check(file, holes)
    assert code == 0 and "Trusted: this checker, Python, numpy and the machine." in text
    code, text = check(file, holes, "--json", "--travel", "case1")
    assert code == 0 and json.loads(text)["lower"] == 10


def test_swapped_arguments_are_told_in_one_sentence(holes):
    code, text = check(holes, FOLDER / "correct" / "five.json")
    assert code == 3 and text.count("\n") == 1
    assert "five.csv: malformed: the first argument must be a certificate" in text


def test_tcp_check_refuses_other_problems(holes):
    file = FOLDER / "correct" / "five.json"
    for options in (("--travel", "case2"), ("--start", "5"), ("--vx", "2"), ("--closed",)):
        code, text = check(file, holes, *options)
        assert code == 1 and "another instance" in text
    holes.write_text(holes.read_text().replace("5;1;4", "5;1;4,5"))
    code, text = check(file, holes)
    assert code == 1 and "another workpiece" in text


def test_tcp_check_names_the_tool_it_takes(tmp_path):
    board = tmp_path / "b.drl"
    hits = "T1\nX1.Y1.\nT2\n" + "".join(f"X{x}.Y{y}.\n" for x, y in ((0, 0), (1, 0), (3, 9)))
    board.write_text(f"M48\nMETRIC,TZ\nT1C0.8\nT2C1.0\n%\n{hits}M30\n")
    code, text = check(FOLDER / "correct" / "five.json", board)
    assert code == 1 and "another workpiece" in text
    assert "T2 drills most holes and is taken; --tool chooses among T1" in text


def test_tcp_check_has_its_exit_codes(tmp_path, holes):
    assert check(FOLDER / "malformed" / "nan-dual.json")[0] == 3
    assert check(FOLDER / "incorrect" / "lost-leaf.json")[0] == 1
    assert check(tmp_path / "none.json")[0] == 3
    assert check()[0] == 2
    assert check(FOLDER / "correct" / "five.json", "--start", "1")[0] == 2
    assert check(FOLDER / "correct" / "five.json", tmp_path / "none.csv")[0] == 3
    newer = tmp_path / "newer.json"
    newer.write_text(FIVE.replace('"version":1', '"version":3'))
    assert check(newer)[0] == 6
    code, text = check(newer, "--json")
    assert code == 6 and json.loads(text)["verdict"] == "unsupported"
