"""Reading CSV as people have it, exactly; and fast."""

from __future__ import annotations

import itertools
import os
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Workpiece
from tcp.errors import InputError, OutputError, UsageError
from tcp.files import read
from tcp.files.numbers import Decimals, TooFine, common_steps
from tcp.files.route import in_millimetres, route_csv
from tcp.files.write import write_file
from tcp.result import decimal

ROOT = Path(__file__).resolve().parents[1]


def reading(tmp_path, text, **options):
    path = tmp_path / "piece.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read(path, **options)


def holes(workpiece):
    return [(h.id, h.x, h.y) for h in map(workpiece.hole, range(len(workpiece)))]


EXPECTED = [("A", Fraction(1, 2), Fraction(2)), ("B", Fraction(-3), Fraction(9, 4))]

SAME = {
    "plain": "id,x,y\nA,0.5,2\nB,-3,2.25\n",
    "semicolon": "id;x;y\nA;0.5;2\nB;-3;2.25\n",
    "tab": "id\tx\ty\nA\t0.5\t2\nB\t-3\t2.25\n",
    "blanks": "id  x   y\nA   0.5 2\nB -3 2.25\n",
    "decimal comma": "id;x;y\nA;0,5;2\nB;-3;2,25\n",
    "decimal comma, tab": "id\tx\ty\nA\t0,5\t2,0\nB\t-3\t2,25\n",
    "no header": "A,0.5,2\nB,-3,2.25\n",
    "bom": b"\xef\xbb\xbfid,x,y\nA,0.5,2\nB,-3,2.25\n",
    "crlf": "id,x,y\r\nA,0.5,2\r\nB,-3,2.25\r\n",
    "old mac": "id,x,y\rA,0.5,2\rB,-3,2.25\r",
    "no last newline": "id,x,y\nA,0.5,2\nB,-3,2.25",
    "comments and blanks": "# a board\n\nid,x,y\n# one\nA,0.5,2\n\n  # two\nB,-3,2.25\n\n",
    "rows of empty cells": "id,x,y\nA,0.5,2\n,,\nB,-3,2.25\n,,\n",
    "spaces": " id , x , y \n A , 0.5 , 2 \n B , -3 , 2.25 \n",
    "quotes": '"id","x","y"\n"A","0.5","2"\n"B","-3","2.25"\n',
    "other order": "y,x,id\n2,0.5,A\n2.25,-3,B\n",
    "capitals and units": "No.,X (mm),Y [mm]\nA,0.5,2\nB,-3,2.25\n",
    "names": "hole_id,x_mm,y_mm\nA,0.5,2\nB,-3,2.25\n",
    "exponents, signs, dots": "id,x,y\nA,5e-1,+2.\nB,-3E0,2.2500\n",
    "leading dot": "id,x,y\nA,.5,2\nB,-3,2.25\n",
    "trailing delimiters": "id,x,y\nA,0.5,2,,\nB,-3,2.25,\n",
    "trailing delimiters without header": "A,0.5,2,\nB,-3,2.25,\n",
    "units in a comment": "# units: mm\nid,x,y\nA,0.5,2\nB,-3,2.25\n",
    "a sign for number as heading": "#,y,x\nA,2,0.5\nB,2.25,-3\n",
    "a header that is a comment": "# from a lathe, x and y\n# y  x id\n2 0.5 A\n2.25 -3 B\n",
}


@pytest.mark.parametrize("kind", SAME)
def test_one_table_in_many_dialects(tmp_path, kind):
    found = reading(tmp_path, SAME[kind])
    assert holes(found.workpiece) == EXPECTED
    assert found.workpiece.step == Fraction(1, 100)
    assert found.workpiece.name == "piece" and found.travel is None and found.notes == ()


def test_quoted_cells_may_hold_the_delimiter(tmp_path):
    found = reading(tmp_path, 'id,x,y\n"A,1",0.5,2\n"a ""b""",1,1\n')
    assert found.workpiece.ids == ("A,1", 'a "b"')


def test_ids_are_row_numbers_where_there_are_none(tmp_path):
    assert reading(tmp_path, "3,4\n5,6\n").workpiece.ids == ("1", "2")
    assert reading(tmp_path, "y,x\n3,4\n5,6\n").workpiece.hole(0).x == 4


@pytest.mark.parametrize(
    ("text", "options"),
    [
        ("x_in,y_in\n1,0.5\n", {}),
        ('X ("),Y [inch]\n1,0.5\n', {}),
        ("x (inches),y (in)\n1,0.5\n", {}),
        ("# Units = inch\n1,0.5\n", {}),
        ("x,y\n# units: inch\n1,0.5\n", {}),
        ("1,0.5\n# units: inch,\n", {}),
        ("# units: in\nx_in,y\n1,0.5\n# Unit: inches\n", {}),
        ("1,0.5\n# x_in,y_in\n3,4\n", {}),
        ("# x_in,y_in,,\n1,0.5,,\n", {}),
        ("# x_in,y_in\nx,y\n1,0.5\n", {}),
        ("1,0.5\n", {"units": "inch"}),
        ("x_inch,y\n1,0.5\n", {"units": "inch"}),
        ("x,y,units\n1,0.5,inch\n2,3,IN\n", {}),
        ("x,y,dia (inch)\n1,0.5,0.04\n", {"units": "inch"}),
        ("x_in,y,dia (inch)\n1,0.5,0.04\n", {}),
        ("#;x_in;y_in;dia\n1;1;0.5;0.04\n", {}),
    ],
)
def test_inches_are_exact(tmp_path, text, options):
    piece = reading(tmp_path, text, **options).workpiece
    assert piece.hole(0).x == Fraction(254, 10) and piece.hole(0).y == Fraction(127, 10)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("# units: inch\n# units: mm\nx,y\n1,2\n", "2: units are mm here, but inch in line 1"),
        ("# units: inch\nx,y\n1,2\n# units: mm\n", "4: units are mm here, but inch in line 1"),
        ("# x_in,y_in\n# x_mm,y_mm\n1,2\n", "2: units are mm here, but inch in line 1"),
        ("x_mm,y_mm\n# units: inch\n1,2\n", "1: .* contradict"),
        ("x,y\n# units: inch (was mm)\n1,2\n", "2: units 'inch .was mm.'; expected mm or inch"),
        ("1,2\n# y,x\n3,4\n", "2: this comment names other columns"),
        ("x,y,dia\n# x,y,dia_in\n3,4,1\n", "2: the diameters are in inch; expected x and y"),
    ],
)
def test_comments_about_units_that_contradict_are_refused(tmp_path, text, said):
    with pytest.raises(InputError, match=f"csv:{said}"):
        reading(tmp_path, text)


def test_a_comment_below_the_header_contradicts_the_flag(tmp_path):
    with pytest.raises(InputError, match="contradict each other"):
        reading(tmp_path, "x,y\n# units: inch\n1,2\n", units="mm")


def test_diameters_and_tools(tmp_path):
    text = "id;x;y;dia (mm);tool\nA;1;2;0,8;T1\nB;2;3;;\n"
    piece = reading(tmp_path, text).workpiece
    assert piece.diameters == (Fraction(4, 5), None)
    assert piece.tools == ("T1", None)


def test_what_is_ignored_or_coincident_is_noted(tmp_path):
    found = reading(tmp_path, "id,net,x,y,layer\nA,GND,1,2,top\nB,VCC,1.0,2.00,top\nC,,3,3,\n")
    assert found.notes == (
        "ignored columns: net, layer",
        "1 place with more than one hole (holes A and B)",
    )


@pytest.mark.parametrize(
    ("name", "count"), [("wp1", 9), ("wp2", 14), ("wp3", 49), ("fa14", 14), ("five", 5)]
)
def test_the_papers_workpieces(name, count):
    found = read(ROOT / "data" / f"{name}.csv")
    assert len(found.workpiece) == count and found.notes == ()
    assert found.workpiece.ids == tuple(str(i + 1) for i in range(count))


numbers = st.one_of(
    st.decimals(-10_000, 10_000, allow_nan=False, places=4).map(str),
    st.integers(-(10**6), 10**6).map(str),
    st.sampled_from(["0", "-0", "0.10", "1e2", "12.5000", "-.5", "7.", "1E-4", "0.00000"]),
)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(numbers, numbers), min_size=1, max_size=8))
def test_digits_become_the_same_steps_as_decimals_do(pairs):
    x, y = Decimals(), Decimals()
    for a, b in pairs:
        x.add(a)
        y.add(b)
    (sx, sy), places = common_steps(x, y)
    piece = Workpiece.from_decimals("p", pairs)
    assert piece.step == Fraction(1, 10**places)
    assert piece.x.tolist() == sx.tolist() and piece.y.tolist() == sy.tolist()
    assert all(
        Fraction(Decimal(a)) == s * piece.step for (a, _), s in zip(pairs, sx.tolist(), strict=True)
    )


NO_NUMBERS = """x nan -inf Infinity 1e 1.2.3 1,5 0x10 1_000 --1 + . \u0663
    1e308 1e-40 1e999999999 1e9999999999"""


@pytest.mark.parametrize("text", ["", "1 2", "9" * 70, *NO_NUMBERS.split()])
def test_what_is_no_coordinate_is_refused(text):
    with pytest.raises(InputError):
        Decimals().add(text)


def test_decimal_commas_are_not_thousands():
    column = Decimals(decimal_comma=True)
    column.add("1,5")
    for text in ("1.234,5", "1,234,5", "1,234.5"):
        with pytest.raises(InputError):
            column.add(text)


@pytest.mark.parametrize("text", ["1e30", "4503599627370497", "0.0000000000000001"])
def test_grids_beyond_52_bits_are_refused(text):
    column = Decimals()
    column.add("1")
    column.add(text)
    with pytest.raises(TooFine) as error:
        common_steps(column)
    assert error.value.row == 1


def test_a_route_file_reads_back_in_drilling_order(tmp_path):
    text = 'id,x,y,diameter,tool\nA,1.25,2,0.8,T1\n#,2,3,,\n"a,b",0,-1,1,T2\n'
    piece = reading(tmp_path, text.replace("\n#,", '\n"q#",')).workpiece
    route = (2, 0, 1)
    again = reading(tmp_path, route_csv(piece, route, ["two\nlines"])).workpiece
    assert holes(again) == [holes(piece)[i] for i in route]
    assert again.diameters == tuple(piece.diameters[i] for i in route)
    assert again.tools == tuple(piece.tools[i] for i in route)


@given(
    st.lists(st.integers(-(2**52), 2**52), min_size=1, max_size=5),
    st.sampled_from(["1", "1/1000", "127/50", "127/5000000", "10", "1/3", "1/1024"]),
)
def test_coordinates_are_printed_exactly(steps, step):
    expected = [decimal(value * Fraction(step)) for value in steps]
    assert in_millimetres(np.array(steps, dtype=np.int64), Fraction(step)) == expected


def test_files_are_replaced_whole_or_not_at_all(tmp_path):
    path = tmp_path / "route.csv"
    write_file(path, "one")
    write_file(path, b"two")
    assert path.read_text() == "two"
    assert list(tmp_path.iterdir()) == [path]
    for wrong in (tmp_path / "none" / "route.csv", path / "below"):
        with pytest.raises(OutputError, match="cannot write"):
            write_file(wrong, "x")
    assert path.read_text() == "two"


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "route.csv"
    write_file(path, "old")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tcp.files.write.os.fsync", full)
    with pytest.raises(OutputError, match="no space left"):
        write_file(path, "new")
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


@pytest.fixture
def piped():
    """Puts bytes into a pipe; the path to read them from, once."""
    ends = []

    def fill(data: bytes) -> Path:
        outlet, inlet = os.pipe()
        ends.append(outlet)
        os.write(inlet, data)
        os.close(inlet)
        return Path(f"/dev/fd/{outlet}")

    yield fill
    for end in ends:
        os.close(end)


def test_a_pipe_holds_a_table_or_is_refused_with_what_to_do(piped):
    assert len(read(piped(b"id,x,y\nA,1,2\nB,3,4\n")).workpiece) == 2
    drill = b"M48\nMETRIC,TZ\nT1C1\n%\nT1\nX1.0Y1.0\nX2.0Y2.0\nM30\n"
    others = (drill, b"T1\nX1Y2\nM30\n", b"G21\nG81 X1 Y2 Z-1 R1 F9\nM30\n", b"NAME: a\n")
    for text in others:
        with pytest.raises(InputError, match=r":1: .*a pipe .* read as CSV.*board\.drl"):
            read(piped(text))
    with pytest.raises(UsageError, match=r"no option 'tool'.*a pipe .* read as CSV.*board\.drl"):
        read(piped(drill), tool="T1")


def test_large_files_are_read_in_seconds(tmp_path):
    """A tenth of a million rows; the million is measured in the benchmarks."""
    rows = (f"{i},{i % 997}.{i % 1000:03d},{i // 997}.5\n" for i in range(100_000))
    path = tmp_path / "large.csv"
    path.write_text("id,x,y\n" + "".join(itertools.chain(rows)))
    piece = read(path).workpiece
    assert len(piece) == 100_000 and piece.step == Fraction(1, 1000)
    assert piece.hole(99_999).x == 299 + Fraction(999, 1000)
