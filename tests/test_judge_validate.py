"""The judge on one route: it names exactly what is wrong, and nothing else."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Ends, Instance, Model, Rules, Travel, Workpiece
from tcp.errors import InputError, UsageError
from tcp.files.order import order_of, read_order
from tcp.files.printed import Agreement, parse_printed
from tcp.result import decimal
from tcp.validate import repair, validate
from tcp.validate.known import Known
from tcp.validate.sequence import walk


def board(n: int, seed: int = 1) -> Workpiece:
    rng = np.random.default_rng(seed)
    points = rng.integers(0, 1000, (n, 2)).tolist()
    return Workpiece.from_decimals("board", [(str(x), str(y)) for x, y in points])


def named(verdict) -> set[tuple]:
    """Sequence findings as (code, what, places)."""
    return {
        (f.code, f.data.get("hole", f.data.get("label")), f.location.positions)
        for f in verdict.findings
        if f.code in ("TCP101", "TCP102", "TCP103", "TCP104")
    }


permutations = st.integers(2, 30).flatmap(lambda n: st.permutations(range(1, n + 1)))


@given(permutations)
def test_a_permutation_is_a_route(order):
    instance = Instance(board(len(order)))
    cost = instance.cost([h - 1 for h in order])
    verdict = validate(instance, order, claimed=decimal(cost * instance.quantum))
    assert verdict.valid and verdict.holds and verdict.cost == cost
    assert verdict.codes() == ["TCP206", "TCP304"]


@given(permutations, st.data())
def test_duplicate_is_named_with_the_hole_it_drove_out(order, data):
    n = len(order)
    i, j = data.draw(st.permutations(range(n)).map(lambda p: sorted(p[:2])))
    into = data.draw(st.booleans())
    lost, kept = (order[i], order[j]) if into else (order[j], order[i])
    order[i] = order[j] = kept
    assert named(validate(Instance(board(n)), order)) == {
        ("TCP101", str(kept), (i + 1, j + 1)),
        ("TCP102", str(lost), ()),
    }


@given(permutations, st.data())
def test_drop_is_named(order, data):
    n = len(order)
    lost = order.pop(data.draw(st.integers(0, n - 1)))
    assert named(validate(Instance(board(n)), order)) == {
        ("TCP102", str(lost), ()),
        ("TCP104", None, ()),
    }


@given(permutations, st.data())
def test_insert_is_named(order, data):
    n = len(order)
    at, extra = data.draw(st.integers(0, n)), data.draw(st.integers(1, n))
    order.insert(at, extra)
    places = tuple(k + 1 for k, h in enumerate(order) if h == extra)
    assert named(validate(Instance(board(n)), order)) == {
        ("TCP101", str(extra), places),
        ("TCP104", None, ()),
    }


@given(permutations, st.data())
def test_out_of_range_is_named(order, data):
    n = len(order)
    at = data.draw(st.integers(0, n - 1))
    wrong = data.draw(st.one_of(st.integers(-(10**30), 0), st.integers(n + 1, 10**30)))
    lost, order[at] = order[at], wrong
    verdict = validate(Instance(board(n)), order)
    assert named(verdict) == {
        ("TCP103", str(wrong), (at + 1,)),
        ("TCP102", str(lost), ()),
    }
    assert verdict.cost is None


@given(permutations, st.data())
def test_swap_is_named_by_the_time_it_changes(order, data):
    n, instance = len(order), Instance(board(len(order)))
    claimed = decimal(instance.cost([h - 1 for h in order]) * instance.quantum)
    i, j = data.draw(st.permutations(range(n)).map(lambda p: sorted(p[:2])))
    order[i], order[j] = order[j], order[i]
    verdict = validate(instance, order, claimed=claimed)
    assert verdict.valid
    if verdict.time == Fraction(claimed):
        assert "TCP206" in verdict.codes()
        return
    assert "TCP201" in verdict.codes()
    pairs = [tuple(f.data["pair"]) for f in verdict.findings if "pair" in f.data]
    pairs += [tuple(p) for f in verdict.findings for p in f.data.get("pairs", ())]
    assert (i + 1, j + 1) in pairs
    for a, b in pairs:  # every pair named does make the claim true
        back = list(order)
        back[a - 1], back[b - 1] = back[b - 1], back[a - 1]
        assert instance.cost([h - 1 for h in back]) * instance.quantum == Fraction(claimed)


@settings(max_examples=60, deadline=None)
@given(
    permutations,
    st.sampled_from([Ends(closed=True), Ends(home=(Fraction(5), Fraction(7)), outward=True)]),
)
def test_swaps_are_found_with_other_ends(order, ends):
    instance = Instance(board(len(order)), ends=ends)
    claimed = decimal(instance.cost([h - 1 for h in order]) * instance.quantum)
    order[0], order[-1] = order[-1], order[0]
    verdict = validate(instance, order, claimed=claimed)
    if verdict.time != Fraction(claimed):
        pairs = [tuple(f.data["pair"]) for f in verdict.findings if "pair" in f.data]
        pairs += [tuple(p) for f in verdict.findings for p in f.data.get("pairs", ())]
        assert (1, len(order)) in pairs


def test_numbers_from_zero_are_recognised_but_not_guessed():
    instance = Instance(board(4))
    verdict = validate(instance, [0, 2, 1, 3])
    assert not verdict.valid and "TCP107" in verdict.codes()
    assert validate(instance, [0, 2, 1, 3], numbering="0").valid
    assert validate(instance, [1, 3, 2, 4], numbering="1").valid
    assert not validate(instance, [1, 3, 2, 4], numbering="0").valid


@pytest.mark.parametrize(
    "text",
    ["3 1 2", "3,1,2", "3;1;2", "3-1-2", "3->1->2", "3 → 1 → 2", "[3 1 2]", "(3, 1, 2)", "3|1|2",
     "3\t1\n2", "{3 1 2}", "3>1>2", '"3","1","2"', "312"],
)  # fmt: skip
def test_separators_of_all_kinds(text):
    order = order_of(text, board(3))
    assert order.entries.tolist() == [2, 0, 1]
    assert order.joined == (text == "312")


def test_ids_are_names_and_may_hold_hyphens():
    piece = Workpiece.from_decimals(
        "p", [("0", "0"), ("1", "0"), ("2", "0")], ["A-1", "B-2", "über"]
    )
    assert order_of("über, A-1, B-2", piece).entries.tolist() == [2, 0, 1]
    assert order_of("A-1 C-9", piece).unknown == ("C-9",)


def test_negative_numbers_are_labels_not_separators():
    order = order_of("1 -2 3", board(3))
    assert order.unknown == ("-2",)


def test_rounding_is_told_from_cutting_and_from_error():
    exact = Fraction("235.25")
    for text, agreement in {
        "235.25": Agreement.EXACT,
        "235.250": Agreement.EXACT,
        "235.3": Agreement.ROUNDED,
        "235": Agreement.ROUNDED,
        "235.2": Agreement.CUT,
        "235.20": Agreement.DIFFERENT,
        "235.4": Agreement.DIFFERENT,
        "236": Agreement.DIFFERENT,
        "2.3525e2": Agreement.EXACT,
        "2.4E+2": Agreement.ROUNDED,
    }.items():
        assert parse_printed(text).agreement(exact) is agreement, text


@given(st.decimals(0, 10**6, places=5), st.integers(0, 4))
def test_every_rounding_and_cutting_is_recognised(value, places):
    exact = Fraction(value)
    scale = 10**places
    half_up = Fraction(math.floor(exact * scale + Fraction(1, 2)), scale)
    cut = Fraction(math.floor(exact * scale), scale)
    assert parse_printed(f"{float(half_up):.{places}f}").agreement(exact).holds
    assert parse_printed(f"{float(cut):.{places}f}").agreement(exact).holds
    off = Fraction(math.floor(exact * scale) + 2, scale)
    assert not parse_printed(f"{float(off):.{places}f}").agreement(exact).holds


@pytest.mark.parametrize(
    "bad", ["nan", "inf", "-inf", "1e5000", "x", "", "1..2", "0x10", "9" * 200, 1.5, True]
)
def test_what_is_no_number_is_refused(bad):
    with pytest.raises(InputError):
        parse_printed(bad)


def readings_of(instance, route, claimed):
    verdict = validate(instance, route, claimed=claimed)
    assert "TCP201" in verdict.codes() or "TCP204" in verdict.codes()
    return [f.data["reading"] for f in verdict.findings if f.code == "TCP204"]


def test_other_readings_are_found():
    piece = Workpiece.from_decimals(
        "p", [("3", "1"), ("10", "0"), ("13", "7"), ("1", "9"), ("8", "4")]
    )
    route = "1 2 3 4 5"
    entries = np.arange(5)
    stated = Instance(piece)

    def time(travel=None, ends=None):
        other = Instance(piece, travel or Travel(), ends or Ends())
        return walk(other, entries) * other.quantum

    assert any(
        "Case 2" in r for r in readings_of(stated, route, decimal(time(Travel(Model.SIMULTANEOUS))))
    )
    euclid = decimal(time(Travel(Model.EUCLIDEAN)))
    assert any("Euclid" in r for r in readings_of(stated, route, euclid))
    assert any(
        r == "closed tour"
        for r in readings_of(stated, route, decimal(time(ends=Ends(closed=True))))
    )
    home = Ends(home=(Fraction(0), Fraction(0)), outward=True)
    assert any("outward leg" in r for r in readings_of(stated, route, decimal(time(ends=home))))
    inch = decimal(time() * Fraction(254, 10))
    assert any("inch for mm" in r for r in readings_of(stated, route, inch))
    longest = max(int(c) for c in stated.form.costs(entries, np.roll(entries, -1)))
    pseudo = time(ends=Ends(closed=True)) - longest * stated.quantum
    assert pseudo != time()
    assert any("longest move" in r for r in readings_of(stated, route, decimal(pseudo)))


def test_readings_that_do_not_fit_into_62_bits_are_left_out():
    far = [("0", "0"), ("40000000000", "1"), ("7", "90000000000")]
    instance = Instance(Workpiece.from_decimals("far", far))
    assert "TCP201" in validate(instance, "1 2 3", claimed="5").codes()


def test_a_mirrored_board_and_ranks_are_readings():
    square = Workpiece.from_decimals(
        "s", [("0", "0"), ("4", "0"), ("0", "1"), ("4", "1"), ("2", "9"), ("2", "-8")]
    )
    instance = Instance(square)
    route = [1, 3, 5, 2, 6, 4]
    mirrored = [2, 4, 5, 1, 6, 3]  # left and right exchanged
    mirror = {1: 2, 2: 1, 3: 4, 4: 3, 5: 5, 6: 6}
    assert [mirror[h] for h in route] == mirrored
    cornered = Instance(square, Travel(), Ends(home=(Fraction(0), Fraction(0)), outward=True))
    claimed = decimal(cornered.cost([h - 1 for h in mirrored]) * cornered.quantum)
    assert any("left to right" in r for r in readings_of(cornered, route, claimed))
    piece = board(7)
    ranks = [3, 1, 7, 5, 2, 6, 4]
    order = [int(k) + 1 for k in np.argsort(ranks)]
    instance = Instance(piece)
    claimed = decimal(instance.cost([h - 1 for h in order]) * instance.quantum)
    assert any("place of each hole" in r for r in readings_of(instance, ranks, claimed))


def test_a_reversed_route_with_fixed_ends_is_recognised():
    instance = Instance(board(4), ends=Ends(start=3))
    verdict = validate(instance, "1 2 3 4")
    assert verdict.codes()[:2] == ["TCP105", "TCP204"] and not verdict.valid
    assert validate(instance, "4 3 2 1").valid


def test_process_rules_are_findings():
    instance = Instance(board(3), rules=Rules(forbidden=((0, 1),), together=((1, 2),)))
    assert validate(instance, "2 1 3").codes()[:2] == ["TCP106", "TCP106"]
    assert validate(instance, "1 3 2").valid
    row = Workpiece.from_decimals("row", [("0", "0"), ("1", "0"), ("2", "0"), ("2", "1")])
    runs = Instance(row, rules=Rules(axis_run=1))
    assert validate(runs, "1 2 3 4").codes()[0] == "TCP106"
    assert repair(runs, "1 2 3 3").refusal is not None


def test_below_the_bound_is_impossible_with_the_benefit_of_rounding():
    instance = Instance(Workpiece.from_decimals("p", [("0", "0"), ("1.25", "0"), ("2.25", "0")]))
    known = Known(225, 225)  # quanta of 0.01
    assert "TCP303" in validate(instance, "1 2 3", claimed="2.1", known=known).codes()
    assert "TCP303" not in validate(instance, "1 2 3", claimed="2.2", known=known).codes()
    assert "TCP303" in validate(instance, "1 2 3", claimed="2.20", known=known).codes()


def test_optimality_is_judged_from_data():
    instance = Instance(board(4))
    costs = {
        r: instance.cost([h - 1 for h in r]) for r in [(1, 2, 3, 4), (2, 1, 3, 4), (4, 1, 2, 3)]
    }
    best, worst = min(costs.values()), max(costs, key=costs.get)
    known = Known(best, best)
    assert "TCP301" in validate(instance, min(costs, key=costs.get), known=known).codes()
    verdict = validate(instance, worst, known=known, optimal=True)
    late = next(f for f in verdict.findings if f.code == "TCP302")
    assert late.severity == "warning"
    assert late.data["percent"] == pytest.approx(100 * (costs[worst] - best) / best, abs=1e-5)
    assert (
        next(
            f for f in validate(instance, worst, known=known).findings if f.code == "TCP302"
        ).severity
        == "note"
    )
    assert "TCP305" in validate(instance, worst, known=Known(best - 1)).codes()
    twice = validate(instance, "1 1 2 3", claimed=decimal(best * instance.quantum), known=known)
    assert "TCP306" in twice.codes()


def test_a_bound_above_a_valid_route_is_a_bug_not_a_finding():
    instance = Instance(board(3))
    with pytest.raises(RuntimeError, match="wrong"):
        validate(instance, "1 2 3", known=Known(10**9))


def write(tmp_path, name, text):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("r.txt", "# a route\n3\n1\n2\n"),
        ("r.txt", "# a route\r3\r1\r2\r"),
        ("r.csv", "id,x_mm,y_mm\r3,0,0\r1,1,1\r2,2,2\r"),
        ("r.json", "[3, 1, 2]"),
        ("r.json", '{"route": ["3", "1", "2"], "cost": "4"}'),
        ("r.tour", "NAME: r\nTYPE: TOUR\nDIMENSION: 3\nTOUR_SECTION\n3\n1\n2\n-1\nEOF\n"),
        ("r.csv", "id,x_mm,y_mm\n3,0,0\n1,1,1\n2,2,2\n"),
        ("r.csv", "# remark\nhole;order\n1;2\n2;3\n3;1\n"),
        ("r.csv", "3\n1\n2\n"),
    ],
)
def test_route_files_of_every_kind(tmp_path, name, text):
    order = read_order(write(tmp_path, name, text), board(3))
    assert order.entries.tolist() == [2, 0, 1]


def test_findings_in_a_file_have_its_line(tmp_path):
    path = write(tmp_path, "r.txt", "1\n\n2\n2\n")
    verdict = validate(Instance(board(3)), read_order(path, board(3)))
    twice = next(f for f in verdict.findings if f.code == "TCP101")
    assert (twice.location.path, twice.location.line) == (str(path), 4)
    path = write(tmp_path, "r.csv", "hole,order\n1,2\n9,1\n")
    verdict = validate(Instance(board(3)), read_order(path, board(3)))
    assert next(f for f in verdict.findings if f.code == "TCP103").location.line == 3


BAD_ROUTES = {
    "empty": ("r.txt", b"", "no route"),
    "blank": ("r.txt", b"\n \n# nothing\n", "no route"),
    "binary": ("r.txt", b"1 2 \x00 3", "binary"),
    "latin-1": ("r.txt", b"1\n\xe9\n", "UTF-8"),
    "json cut off": ("r.json", b'{"route": [1, 2', "not JSON"),
    "json of another kind": ("r.json", b'{"cost": 3}', "route"),
    "json deep": ("r.json", b"[" * 100_000, "JSON"),
    "json floats": ("r.json", b"[1, 2.5]", "no hole"),
    "json nan": ("r.json", b"[1, NaN]", "no hole"),
    "tour cut off": ("r.tour", b"TYPE: TOUR\nTOUR_SECTION\n1\n2\n", "truncated"),
    "csv ragged": ("r.csv", b"hole,order\n1,1\n2\n", "cells"),
    "csv place twice": ("r.csv", b"hole,order\n1,1\n2,1\n", "twice"),
    "csv no place": ("r.csv", b"hole,order\n1,first\n2,1\n", "place"),
}


@pytest.mark.parametrize("case", BAD_ROUTES)
def test_bad_route_files_are_one_sentence(tmp_path, case):
    name, data, words = BAD_ROUTES[case]
    with pytest.raises(InputError, match=words) as caught:
        read_order(write(tmp_path, name, data), board(3))
    assert str(tmp_path) in str(caught.value) and "\n" not in str(caught.value)
    assert caught.value.exit_code == 3


def test_missing_files_and_folders_are_one_sentence(tmp_path):
    for path in (tmp_path, tmp_path / "absent.txt"):
        with pytest.raises(InputError, match="cannot be read"):
            read_order(path, board(3))


def test_ids_that_overflow_are_labels():
    huge = "9" * 30
    order = order_of(f"1 2 {huge}", board(3))
    assert order.unknown == (huge,)
    with pytest.raises(InputError, match="10\\^18"):
        order_of(f"1 2 {huge}", board(3), "0")
    with pytest.raises(UsageError, match="numbering"):
        order_of("1 2", board(3), "2")
    assert len(order_of("x" * 10**6 + " 1", board(3)).unknown[0]) <= 80


def test_ten_million_entries_are_handled():
    piece = board(49)
    rng = np.random.default_rng(3)
    entries = rng.integers(1, 52, 10_000_000)
    verdict = validate(Instance(piece), entries, claimed="1")
    codes = verdict.codes()
    assert codes.count("TCP101") == 49 and codes.count("TCP103") == 2 and "TCP104" in codes
    assert verdict.count.surplus == int((entries <= 49).sum()) - 49


def test_sums_beyond_64_bits_are_exact():
    piece = Workpiece.from_decimals("far", [("0", "0"), ("1000000000", "0")])
    instance = Instance(piece, Travel(quantum=Fraction(1, 10**8)))
    entries = np.tile(np.array([0, 1]), 50)
    assert walk(instance, entries) == 99 * 10**17


@given(st.binary(max_size=200))
def test_no_bytes_break_the_reader(data):
    import tempfile
    from pathlib import Path

    with tempfile.TemporaryDirectory() as folder:
        for name in ("r.txt", "r.json", "r.csv"):
            path = Path(folder) / name
            path.write_bytes(data)
            try:
                order = read_order(path, board(3))
            except InputError:
                continue
            validate(Instance(board(3)), order, claimed="7")
