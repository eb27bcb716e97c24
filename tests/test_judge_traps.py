"""Claims that look true, or false, and are not: rounding, numbering, sizes, bad input."""

from __future__ import annotations

import json
import os
from fractions import Fraction

import numpy as np
import pytest
from click.testing import CliRunner

from tcp import Ends, Instance, Model, Travel, Workpiece
from tcp.cli.main import main
from tcp.errors import InputError, UsageError
from tcp.files import read
from tcp.files.claims import read_claims
from tcp.oracle import judge
from tcp.pytest_plugin import DrillOracle
from tcp.validate import repair, validate
from tcp.validate.known import Known

TENS = "NAME: tens\nTYPE: TSP\nDIMENSION: 6\nEDGE_WEIGHT_TYPE: EUC_2D\nNODE_COORD_SECTION\n"
TENS += "".join(f"{k + 1} {10 * k} 0\n" for k in range(6)) + "EOF\n"
EXPLICIT = (
    "NAME: ex\nTYPE: TSP\nDIMENSION: 5\nEDGE_WEIGHT_TYPE: EXPLICIT\n"
    "EDGE_WEIGHT_FORMAT: FULL_MATRIX\nEDGE_WEIGHT_SECTION\n"
    + "".join(" ".join(str(abs(i - j)) for j in range(5)) + "\n" for i in range(5))
    + "EOF\n"
)


def run(*words):
    done = CliRunner().invoke(main, [str(w) for w in words])
    assert not done.exception or isinstance(done.exception, SystemExit), done.exception
    return done


def line(*xs: str) -> Workpiece:
    return Workpiece.from_decimals("line", [(x, "0") for x in xs])


# --- rounded costs --------------------------------------------------------------


@pytest.mark.parametrize(("claimed", "code"), [("50", 0), ("47", 1), ("53", 1), ("46.6", 1)])
def test_where_rounded_costs_are_defined_there_is_no_tolerance(tmp_path, claimed, code):
    path = tmp_path / "tens.tsp"
    path.write_text(TENS)
    done = run("validate", path, "--route", "1 2 3 4 5 6", "--claimed", claimed)
    assert done.exit_code == code, done.stdout


@pytest.mark.parametrize(
    ("claimed", "holds"), [("98", True), ("98.000", True), ("98.049", False), ("97.96", False)]
)
def test_a_length_without_a_quantum_is_measured_finely(claimed, holds):
    piece = line(*map(str, range(99)))
    verdict = validate(Instance(piece, Travel(Model.EUCLIDEAN)), range(1, 100), claimed=claimed)
    assert ("TCP201" not in verdict.codes()) is holds


def test_a_length_with_many_digits_is_told_from_its_neighbours():
    piece = Workpiece.from_decimals("diagonal", [("0", "0"), ("1", "1"), ("2", "2")])
    instance = Instance(piece, Travel(Model.EUCLIDEAN))
    assert "TCP202" in validate(instance, "1 2 3", claimed="2.82843").codes()
    assert "TCP201" in validate(instance, "1 2 3", claimed="2.82853").codes()


@pytest.mark.parametrize(("claimed", "possible"), [("199", False), ("199.9", False), ("200", True)])
def test_one_printed_unit_below_the_optimum_is_impossible(claimed, possible):
    instance = Instance(line("0", "100", "200"))
    known = Known(200, 200, certified=True)
    codes = validate(instance, "1 2 3", claimed=claimed, known=known).codes()
    assert ("TCP303" not in codes) is possible


# --- whose travel model, whose numbers ------------------------------------------------


def test_the_plugin_takes_the_files_own_travel(tmp_path):
    (tmp_path / "ex.tsp").write_text(EXPLICIT)
    (tmp_path / "tens.tsp").write_text(TENS)
    oracle = DrillOracle(tmp_path, tmp_path / "cache", 20.0)
    assert oracle.optimum("ex.tsp") == 4 and oracle.optimum("tens.tsp") == 50
    with pytest.raises(AssertionError, match="above the certified optimum"):
        oracle.on("ex.tsp").assert_optimal("1 3 5 2 4")
    oracle.on("ex.tsp").assert_optimal("5 4 3 2 1")
    with pytest.raises(UsageError, match="no places"):
        oracle.on("ex.tsp", "sequential")


def test_claims_take_the_files_own_travel(tmp_path):
    (tmp_path / "tens.tsp").write_text(TENS)
    claims = tmp_path / "c.toml"
    head = 'format = "tcp-claims-1"\n[source]\nkey = "s"\ntitle = "t"\n'
    piece = '[[workpiece]]\nid = "w"\nwhere = "p"\nfile = "tens.tsp"\n'
    route = '[[route]]\nid = "{0}"\nwhere = "p"\nworkpiece = "w"\nsequence = "1 2"\ntime = 1\n'
    named = route.format("b") + 'travel = "euclidean"\n'
    other = route.format("c") + 'travel = "sequential"\nvx = 2\n'
    claims.write_text(head + piece + route.format("a") + named + other)
    found = read_claims(claims)
    own, same, else_ = (found.instance(c) for c in found.claims if c.kind == "route")
    assert own.sha256 == same.sha256 == Instance(*_reading(tmp_path / "tens.tsp")).sha256
    assert (else_.travel.model, else_.travel.vx) == (Model.SEQUENTIAL, 2)


def _reading(path):
    reading = read(path)
    return reading.workpiece, reading.travel


def test_times_without_places_are_travelled_as_stated(tmp_path):
    path = tmp_path / "ex.tsp"
    path.write_text(EXPLICIT)
    assert run("info", path).exit_code == 0
    done = run("info", "--travel", "case1", path)
    assert done.exit_code == 2 and "no places" in done.output


@pytest.mark.parametrize("ids", [("3", "1", "2", "4"), ("7", "8", "9", "10"), ("a", "b", "c", "d")])
def test_a_tour_that_was_written_is_read_as_it_was_meant(tmp_path, ids):
    board, tour = tmp_path / "perm.csv", tmp_path / "perm.tour"
    rows = (f"{name},{x},0" for name, x in zip(ids, (0, 10, 20, 35), strict=True))
    board.write_text("\n".join(["id,x,y", *rows]) + "\n")
    assert run("solve", "--exact", "--out", tour, board).exit_code == 0
    done = run("validate", board, "--route-file", tour, "--claimed", "35")
    assert done.exit_code == 0 and "TCP206" in done.stdout


def test_a_tours_numbers_are_read_as_asked(tmp_path):
    board, tour = tmp_path / "perm.csv", tmp_path / "t.tour"
    board.write_text("id,x,y\n3,0,0\n1,10,0\n2,20,0\n4,35,0\n")
    tour.write_text("COMMENT : no TOUR_SECTION here\nTOUR_SECTION\n3 1 2 4\n-1\nEOF\n")
    words = ("validate", board, "--route-file", tour, "--claimed")
    assert run(*words, "35").exit_code == 0
    assert run(*words, "55", "--numbering", "1").exit_code == 0
    for text in ("3 1 2 4\n-1\nEOF\n99\n", "3 1 2 4\nEOF\n99\n", "3 1 2 4 -1 -1 EOF"):
        tour.write_text(f"TOUR_SECTION\n{text}")  # whatever stands behind the end
        assert run(*words, "35").exit_code == 0
    tour.write_text("TOUR_SECTION\n3 1\n-1\n2 4\n-1\nEOF\n")
    done = run(*words, "35")
    assert done.exit_code == 3 and "t.tour:4: more follows" in done.output


# --- exact comparisons ------------------------------------------------------------------


def test_the_slightest_excess_is_not_optimal():
    piece = Workpiece.from_decimals("fine", [("0", "0"), ("600", "800"), ("1200.000001", "0")])
    instance = Instance(piece)
    known = Known(2_600_000_001, 2_600_000_001, certified=True)
    assert instance.cost((0, 1, 2)) == 2_800_000_001
    best = min(instance.cost(r) for r in ((0, 1, 2), (0, 2, 1), (1, 0, 2)))
    known = Known(best, best, certified=True)
    worse = next(r for r in ((0, 1, 2), (0, 2, 1), (1, 0, 2)) if instance.cost(r) == best + 1)
    route = [str(v + 1) for v in worse]
    assert judge(instance, route, known=known, within=Fraction(0)).failed()
    assert not judge(instance, route, known=known, within=Fraction(1, 10**9)).failed()


def test_an_optimum_of_nothing_is_missed_by_anything():
    piece = Workpiece("one place", ("1", "2", "3"), np.zeros(3, np.int64), np.zeros(3, np.int64))
    assert not judge(Instance(piece), "1 2 3", known=Known(0, 0), within=Fraction(0)).failed()
    instance = Instance(line("0", "1", "2"))
    assert judge(instance, "1 2 3", known=Known(0, 0), within=Fraction(1)).failed()


# --- sizes and bad input ----------------------------------------------------------------


@pytest.mark.parametrize("holes", [60, 180, 1200])
@pytest.mark.parametrize("report", ["text", "json", "sarif"])
def test_a_sequence_that_lacks_most_holes_is_judged(tmp_path, holes, report):
    board = tmp_path / "board.csv"
    board.write_text("x,y\n" + "".join(f"{k},{k * k % 17}\n" for k in range(holes)))
    done = run("validate", board, "--route", "1 2 3", "--repair", "--report", report)
    assert done.exit_code == 1


def test_few_repairs_are_all_listed():
    found = repair(Instance(line("0", "1", "2", "3")), "1 2 2")
    assert found.total == 16 and len(found.smallest) == 16 and found.complete


def test_ids_that_begin_like_comments_come_back(tmp_path):
    board, route = tmp_path / "b.csv", tmp_path / "r.csv"
    board.write_text('id,x,y\n"#1",0,0\n"#2",1,0\nplain,2,0\n#a, "b" c\n')
    assert run("solve", "--out", route, board).exit_code == 0
    done = run("validate", board, "--route-file", route, "--claimed", "2")
    assert done.exit_code == 0, done.output


BAD = {
    "long number": ("--route=-123456789012345678 1 2", "--numbering", "0"),
    "lone surrogate": ("--route-file", "surrogate.json"),
    "endless": ("--route-file", "/dev/zero"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_routes_are_one_sentence(tmp_path, monkeypatch, case):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tcp.files.order.MAX_BYTES", 2**20)
    (tmp_path / "b.csv").write_text("x,y\n0,0\n1,0\n2,0\n")
    (tmp_path / "surrogate.json").write_text(json.dumps(["\ud800", "1", "2"]))
    done = run("validate", "b.csv", "--report", "json", *BAD[case])
    assert done.exit_code in (1, 3) and "internal" not in done.output


def test_a_name_that_is_no_text_is_named_in_sarif(tmp_path):
    (tmp_path / "b.csv").write_text("x,y\n0,0\n1,0\n2,0\n")
    route = tmp_path / os.fsdecode(b"r\xff.txt")
    route.write_text("1 2 2")
    done = run("validate", tmp_path / "b.csv", "--route-file", route, "--report", "sarif")
    assert done.exit_code == 1 and "r%FF.txt" in done.stdout


def test_speeds_beyond_62_bits_are_refused_in_one_column_too(tmp_path):
    (tmp_path / "column.csv").write_text("x,y\n0,0\n0,1\n0,2\n")
    done = run("info", tmp_path / "column.csv", "--vx", "1e-25")
    assert done.exit_code == 2 and "62-bit" in done.output


def test_a_folder_of_certificates_that_is_a_file(tmp_path):
    (tmp_path / "b.csv").write_text("x,y\n0,0\n1,0\n2,0\n")
    done = run("oracle", "pin", tmp_path / "b.csv", "--dir", tmp_path / "b.csv")
    assert done.exit_code == 7 and "cannot make the folder" in done.output


def test_a_search_space_of_nothing_is_refused(tmp_path):
    claims = tmp_path / "c.toml"
    claims.write_text(
        'format = "tcp-claims-1"\n[source]\nkey = "s"\ntitle = "t"\n'
        '[[statistics]]\nid = "a"\nwhere = "p"\nsolution_space = 0\n'
        'best_solutions = 5\nbest_ratio = "3%"\n'
    )
    done = run("audit", claims)
    assert done.exit_code == 3 and "c.toml" in done.output


def test_open_and_closed_ends_of_a_matrix_keep_their_model():
    times = np.array([[0, 1], [1, 0]], np.int64)
    none = np.zeros(2, np.int64)
    piece = Workpiece("two", ("1", "2"), none, none, matrix=times)
    with pytest.raises(UsageError, match="no places"):
        Instance(piece, ends=Ends(closed=True))
    with pytest.raises(InputError):
        read("/dev/null")
