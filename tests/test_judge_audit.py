"""The audit of the four papers finds by itself what is known to be wrong with them."""

from __future__ import annotations

import tempfile
from collections import Counter
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcp import Instance, Workpiece
from tcp.errors import InputError
from tcp.files import read
from tcp.files.claims import read_claims
from tcp.files.printed import parse_printed
from tcp.result import decimal
from tcp.validate import audit
from tcp.validate.known import NOTHING
from tcp.validate.store import CertificateFolder
from tcp.validate.suspect import suspicion

ROOT = Path(__file__).resolve().parents[1]
CLAIMS = sorted((ROOT / "data" / "claims").glob("*.toml"))


@pytest.fixture(scope="module")
def papers():
    folder = CertificateFolder(ROOT / "data" / "certificates")
    found = audit(CLAIMS, knowledge=folder, suspect=True)
    return {entry.key: entry for entry in found.entries}


def codes(entry) -> list[str]:
    return [f.code for f in entry.findings]


def data_of(entry, code):
    return next(f.data for f in entry.findings if f.code == code)


def test_every_sequence_and_statistic_is_there(papers):
    kinds = Counter((key.split("#")[0], entry.kind) for key, entry in papers.items())
    assert kinds["htga-2016", "route"] == 4 * 2 + 2 * 5 + 1  # Tables VI-IX, X-XI, the damaged text
    assert kinds["htga-2016", "statistics"] == 12
    assert kinds["cuckoo-2014", "route"] == 6 + 2  # Table 4, and the reversal of section 2
    assert kinds["cuckoo-2014", "statistics"] == 6 + 5 + 6
    assert kinds["cuckoo-2014", "matrix"] == 2
    assert kinds["firefly", "route"] == 2
    assert kinds["firefly", "statistics"] == 6 and kinds["firefly", "parameters"] == 4
    assert kinds["bmga", "parameters"] == 6 and kinds["bmga", "arithmetic"] == 10


@pytest.mark.parametrize(
    ("table", "twice", "missing", "places", "recomputed", "claimed"),
    [
        ("case1", "2", "42", (1, 43), "1750.381", "1460.216"),
        ("case2", "6", "46", (1, 30), "1454.229", "1107.927"),
    ],
)
def test_both_cuckoo_wp3_sequences_are_no_routes(
    papers, table, twice, missing, places, recomputed, claimed
):
    entry = papers[f"cuckoo-2014#table-4-wp3-{table}"]
    assert entry.verdict == "refuted"
    one = next(f for f in entry.findings if f.code == "TCP101")
    assert one.data["hole"] == twice and one.location.positions == places
    assert data_of(entry, "TCP102")["hole"] == missing
    assert data_of(entry, "TCP201") == {
        "claimed": claimed,
        "recomputed": recomputed,
        "difference": decimal(Fraction(claimed) - Fraction(recomputed)),
    }
    assert entry.facts["Recomputed"] == recomputed


@pytest.mark.parametrize(("case", "optimum"), [("case1", "1482.604"), ("case2", "1127.248")])
def test_both_cuckoo_wp3_times_lie_below_the_certified_optimum(papers, case, optimum):
    for key in (f"cuckoo-2014#table-4-wp3-{case}", f"cuckoo-2014#table-3-{case}"):
        assert data_of(papers[key], "TCP303")["bound"] == optimum


def test_a_least_time_below_the_optimum_is_found_too(papers):
    below = [f for f in papers["cuckoo-2014#table-3-case2"].findings if f.code == "TCP303"]
    assert [f.data["claimed"] for f in below] == ["1107.927", "1119.706"]


def test_which_published_routes_are_certified_optimal(papers):
    optimal = {key for key, entry in papers.items() if "TCP301" in codes(entry)}
    tables = [
        f"htga-2016#table-{t}-{who}-route"
        for t in ("vi", "vii", "viii", "ix")
        for who in ("cs", "htga")
    ]
    tables += ["htga-2016#table-x-htga-route", "htga-2016#table-xi-htga-route"]
    cuckoo = [f"cuckoo-2014#table-4-{w}-case{c}" for w in ("wp1", "wp2") for c in (1, 2)]
    assert optimal == {*tables, *cuckoo, "firefly#best-solution", "firefly#best-solution-reversed"}
    above = {
        key: data_of(entry, "TCP302")["percent"]
        for key, entry in papers.items()
        if "TCP302" in codes(entry)
    }
    assert above.pop("htga-2016#table-x-feasible-1") == pytest.approx(5.9441, abs=1e-3)
    assert "htga-2016#table-xi-feasible-1" in above


@pytest.mark.parametrize(
    ("claim", "times"),
    [
        ("table-4-wp3-case1", ["1570.732", "1990.569"]),
        ("table-4-wp3-case2", ["1210.763", "2000.016"]),
    ],
)
def test_repairs_are_the_papers_feasible_1_and_2(papers, claim, times):
    repairs = papers[f"cuckoo-2014#{claim}"].repairs
    assert repairs.total == 2 and repairs.complete
    assert [decimal(repairs.time(r)) for r in repairs.smallest] == times
    assert decimal(repairs.time(repairs.best)) == times[0]
    assert repairs.above(repairs.best) > 5


@pytest.mark.parametrize(
    ("claim", "time"),
    [
        ("table-x-original", "1750.381"),
        ("table-x-feasible-1", "1570.732"),
        ("table-x-feasible-2", "1990.569"),
        ("table-x-htga-route", "1482.604"),
        ("table-xi-original", "1454.229"),
        ("table-xi-feasible-1", "1210.763"),
        ("table-xi-feasible-2", "2000.016"),
        ("table-xi-htga-route", "1127.248"),
    ],
)
def test_the_htga_papers_own_times_hold(papers, claim, time):
    entry = papers[f"htga-2016#{claim}"]
    assert entry.facts["Recomputed"] == time and "TCP206" in codes(entry)


def test_htga_wp3_tables_contradict_themselves(papers):
    for table in ("x", "xi"):
        found = codes(papers[f"htga-2016#table-{table}-htga"])
        assert {"TCP402", "TCP403", "TCP404"} <= set(found)
        assert "TCP405" not in found  # the percentages do follow from the figures
    for table in ("vi", "vii", "viii", "ix"):
        assert "TCP409" in codes(papers[f"htga-2016#table-{table}-htga"])


def test_parameters_contradict_the_cited_source(papers):
    entry = papers["htga-2016#table-v-cs"]
    assert data_of(entry, "TCP601") == {"parameter": "alpha_h", "here": "33", "there": "1"}
    assert codes(entry) == ["TCP601", "TCP701"]


def test_figures_quoted_differently(papers):
    for weight in ("0.0", "0.5", "1.0"):
        found = [
            f for f in papers[f"firefly#table-iii-zhu-w{weight}"].findings if f.code == "TCP604"
        ]
        assert [f.data["key"] for f in found] == ["least_iterations", "average_iterations"]


def test_arithmetic_of_the_running_texts(papers):
    wrong = {
        "cuckoo-2014#ten-holes": "10!, without halving",
        "cuckoo-2014#twenty-holes": "20!, without halving",
        "cuckoo-2014#saving-wp3": "least times",
        "cuckoo-2014#text-ratio-wp1": "18 iterations of 50",
        "cuckoo-2014#text-ratio-wp2": "23 iterations",
    }
    for key, words in wrong.items():
        assert codes(papers[key]) == ["TCP501", "TCP503"], key
        assert words in papers[key].findings[1].message
    refuted = {k for k, e in papers.items() if e.kind == "arithmetic" and e.verdict == "refuted"}
    assert refuted == {
        *wrong,
        "htga-2016#wp1-more-iterations-for-cs",
        "htga-2016#wp1-higher-most",
        "bmga#abstract-range",
        "bmga#over-5000-holes",
        "bmga#abstract-reduction",
    }
    for key in ("htga-2016#solution-space-wp3", "htga-2016#six-holes", "cuckoo-2014#saving-wp1"):
        assert codes(papers[key]) == ["TCP505"], key


def test_search_ratios_of_both_tables_follow(papers):
    ratios = [
        e for k, e in papers.items() if k.startswith(("cuckoo-2014#table-5", "cuckoo-2014#table-6"))
    ]
    assert len(ratios) == 11 and not any("TCP408" in codes(e) for e in ratios)


def test_coordinates_of_two_papers_are_compared(papers):
    found = next(f for f in papers["firefly#fa14"].findings if f.code == "TCP702")
    assert found.data["holes"] == 4 and "mirrored" in found.message


def test_hole_counts_of_the_cuckoo_paper(papers):
    for name in ("wp1", "wp2", "wp3"):
        assert "TCP605" in codes(papers[f"cuckoo-2014#{name}"])


def test_roundings_are_told_from_errors(papers):
    for key in ("htga-2016#table-vii-cs-route", "cuckoo-2014#table-4-wp1-case2"):
        assert "TCP203" in codes(papers[key]) and "TCP201" not in codes(papers[key])
    assert "TCP202" in codes(papers["htga-2016#table-ix-cs-route"])


def test_damaged_cells_are_marked(papers):
    assert "TCP701" in codes(papers["htga-2016#table-v-cs"])
    assert "TCP701" in codes(papers["htga-2016#table-x-feasible-1"])
    scanned = papers["htga-2016#table-x-feasible-1-as-scanned"]
    assert {f.data.get("label") for f in scanned.findings if f.code == "TCP103"} == {"50"}
    missing = {f.data.get("hole") for f in scanned.findings if f.code == "TCP102"}
    assert missing == {"3", "4", "5"}


def test_no_single_misprint_explains_the_cuckoo_times(papers):
    for case in ("case1", "case2"):
        entry = papers[f"cuckoo-2014#table-4-wp3-{case}"]
        assert "TCP704" not in codes(entry)
        together = [label for label in entry.facts if label.startswith("Patterns completed")]
        assert len(together) == 3 and all("26, 14, 46" in label for label in together)


def test_transcribed_coordinates_are_the_workpieces_of_data():
    htga = read_claims(ROOT / "data" / "claims" / "htga-2016.toml").workpieces
    firefly = read_claims(ROOT / "data" / "claims" / "firefly.toml").workpieces
    cuckoo = read_claims(ROOT / "data" / "claims" / "cuckoo-2014.toml").workpieces
    pairs = {"wp1": htga["wp1"], "wp2": htga["wp2"], "wp3": htga["wp3"]}
    pairs |= {"fa14": firefly["fa14"], "five": cuckoo["five"]}
    for name, piece in pairs.items():
        assert piece.sha256 == read(ROOT / "data" / f"{name}.csv").workpiece.sha256, name
    for name in ("wp1", "wp2", "wp3"):
        assert cuckoo[name].sha256 == htga[name].sha256


def test_ignored_codes_are_gone_and_absent_sources_are_notes():
    found = audit(CLAIMS[-1:], ignore={"TCP403", "TCP304"})
    assert not {"TCP403", "TCP304"} & {f.code for f in found.findings}
    assert "TCP608" in {f.code for f in found.findings}
    assert found.failed()


def test_locations_are_the_lines_of_the_keys(papers):
    entry = papers["cuckoo-2014#table-4-wp3-case1"]
    text = (ROOT / "data" / "claims" / "cuckoo-2014.toml").read_text().splitlines()
    one = next(f for f in entry.findings if f.code == "TCP101")
    assert text[one.location.line - 1].startswith('sequence = "2 39 40')
    late = next(f for f in entry.findings if f.code == "TCP201")
    assert text[late.location.line - 1] == "time = 1460.216"


def claims(tmp_path, body, name="c.toml", head='format = "tcp-claims-1"\n'):
    path = tmp_path / name
    path.write_text(f'{head}[source]\nkey = "{Path(name).stem}"\ntitle = "t"\n{body}')
    return path


PIECE = '[[workpiece]]\nid = "p"\nwhere = "w"\nholes = ["1 0 0", "2 1 0", "3 5 0"]\n'
ROUTE = '[[route]]\nid = "r"\nwhere = "w"\nworkpiece = "p"\nsequence = "1 2 3"\n'

BAD = {
    "unknown key": (PIECE + ROUTE + "tiem = 5\n", "did you mean 'time'"),
    "unknown kind": ("[[routes]]\nid = 1\n", "did you mean 'route'"),
    "missing key": ("[[route]]\nid = 'r'\nwhere = 'w'\n", "'sequence' is missing"),
    "duplicate claim": (PIECE + ROUTE + ROUTE, "twice, first in line"),
    "duplicate across kinds": (PIECE + ROUTE.replace('"r"', '"p"'), "twice"),
    "NaN time": (PIECE + ROUTE + "time = nan\n", "not a finite number"),
    "infinite time": (PIECE + ROUTE + "time = -inf\n", "not a finite number"),
    "absurd time": (PIECE + ROUTE + "time = 1e99999\n", "beyond all measure"),
    "huge integer": (PIECE + ROUTE + f"time = {'9' * 6000}\n", "more than 1,000 characters"),
    "time as date": (PIECE + ROUTE + "time = 2026-01-01\n", "expected a number"),
    "list for text": (PIECE + ROUTE.replace('where = "w"\nwork', 'where = []\nwork'), "text"),
    "no such workpiece": (ROUTE, "no workpiece 'p'"),
    "empty sequence": (PIECE + ROUTE.replace("1 2 3", " "), "no route"),
    "unknown travel": (PIECE + ROUTE + 'travel = "diagonal"\n', "unknown travel model"),
    "zero speed": (PIECE + ROUTE + "vx = 0\n", "vx must be greater"),
    "unknown start": (PIECE + ROUTE + 'start = "9"\n', "no hole '9'"),
    "ragged hole": (PIECE.replace("3 5 0", "3 5"), "not 'id x y'"),
    "hole twice": (PIECE.replace("3 5 0", "2 5 0"), "unique"),
    "NaN coordinate": (PIECE.replace("3 5 0", "3 nan 0"), "not a finite number"),
    "no holes": (PIECE.replace('["1 0 0", "2 1 0", "3 5 0"]', "[]"), "at least one hole"),
    "outside": (PIECE.replace("holes = ", 'file = "../p.csv"\n#'), "leads outside"),
    "absolute": (PIECE.replace("holes = ", 'file = "/etc/passwd"\n#'), "leads outside"),
    "unknown units": (PIECE.replace("holes = ", 'units = "ell"\nfile = "p.csv"\n#'), "units must"),
    "absent file": (PIECE.replace("holes = ", 'file = "p.csv"\n#'), "p.csv"),
    "bad formula": (
        '[[arithmetic]]\nid="a"\nwhere="w"\nstatement="s"\nprinted=1\ncompute=["eval", 1]\n',
        "unknown operation 'eval'",
    ),
    "huge factorial": (
        '[[arithmetic]]\nid="a"\nwhere="w"\nstatement="s"\nprinted=1\n'
        'compute=["factorial", 1000000000]\n',
        "factorial takes",
    ),
    "huge power": (
        '[[arithmetic]]\nid="a"\nwhere="w"\nstatement="s"\nprinted=1\n'
        'compute=["power", 10, 10000]\n',
        "bits",
    ),
    "division by zero": (
        '[[arithmetic]]\nid="a"\nwhere="w"\nstatement="s"\nprinted=1\ncompute=["divide", 1, 0]\n',
        "divides by zero",
    ),
    "absent figure": (
        '[[arithmetic]]\nid="a"\nwhere="w"\nstatement="s"\nprinted=1\n'
        'compute=["figure", "x", "time"]\n',
        "not among the audited files",
    ),
    "deep arrays": (f"[[arithmetic]]\ncompute = {'[' * 5000}{']' * 5000}\n", "nested"),
    "deep tables": (f"x = {'{a = ' * 5000}1{'}' * 5000}\n", "nested"),
    "dotted bomb": (f"{'a.' * 100_000}a = 1\n", "dotted"),
    "dotted quoted bomb": ('"a"' + '."a"' * 50 + " = 1\n", "dotted"),
    "no toml": ("[[route\n", "not TOML"),
    "cut off": (PIECE + '[[route]]\nid = "r', "not TOML"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_claims_are_one_sentence_with_their_file(tmp_path, case):
    body, words = BAD[case]
    path = claims(tmp_path, body)
    with pytest.raises(InputError, match=words) as caught:
        audit([path])
    text = str(caught.value)
    assert text.startswith(str(tmp_path)) and "\n" not in text and len(text) < 1000
    assert caught.value.exit_code == 3


def test_the_line_of_a_bad_claim_is_named(tmp_path):
    path = claims(tmp_path, PIECE + ROUTE + "tiem = 5\n")
    line = path.read_text().splitlines().index("tiem = 5") + 1
    with pytest.raises(InputError, match=f"c.toml:{line}: "):
        audit([path])


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "empty"),
        (b"\x00\x01", "binary"),
        (b"format = \xff", "UTF-8"),
        (b'format = "tcp-claims-9"', "no claims file"),
        (b"\n" * (9 * 2**20), "MiB"),
    ],
)
def test_what_is_no_claims_file_is_refused(tmp_path, data, words):
    path = tmp_path / "c.toml"
    path.write_bytes(data)
    with pytest.raises(InputError, match=words):
        audit([path])
    for absent in (tmp_path, tmp_path / "none.toml"):
        with pytest.raises(InputError, match="cannot be read"):
            audit([absent])


def test_links_out_of_the_folder_are_not_followed(tmp_path):
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "secret.csv").write_text("id,x,y\n1,0,0\n")
    (inside / "p.csv").symlink_to(tmp_path / "secret.csv")
    path = claims(inside, PIECE.replace("holes = ", 'file = "p.csv"\n#'))
    with pytest.raises(InputError, match="leads outside"):
        audit([path])
    (inside / "q.csv").write_text("id,x,y\n1,0,0\n2,1,0\n3,5,0\n")
    good = claims(inside, PIECE.replace("holes = ", 'file = "q.csv"\n#') + ROUTE + "time = 5\n")
    assert not audit([good]).failed()


def test_one_source_key_is_one_file(tmp_path):
    a, b = claims(tmp_path, PIECE), tmp_path / "d.toml"
    b.write_text(a.read_text())
    with pytest.raises(InputError, match="also in"):
        audit([a, b])


def test_borrowing_is_one_step_only(tmp_path):
    claims(tmp_path, PIECE.replace("holes = ", 'from = "c.toml#p"\n#'), "d.toml")
    path = claims(tmp_path, PIECE.replace("holes = ", 'from = "d.toml#p"\n#'), "e.toml")
    claims(tmp_path, PIECE)
    with pytest.raises(InputError, match="itself borrowed"):
        audit([path])


STATISTICS = '[[statistics]]\nid = "s"\nwhere = "w"\n'


@pytest.mark.parametrize(
    ("body", "code"),
    [
        ("least_time = 5\naverage_time = 4.4\n", "TCP401"),
        ("average_time = 9\nmost_time = 8\n", "TCP402"),
        ("least_time = 9\nmost_time = 8\n", "TCP403"),
        ("best_time = 7.9\nleast_time = 8.0\n", "TCP404"),
        ("best_time = 100\nmost_time = 120\nmost_error = '25%'\n", "TCP405"),
        ("most_iterations = 101\ngenerations = 100\n", "TCP406"),
        ("least_time = 1\naverage_time = 9.5\nmost_time = 10\nruns = 2\n", "TCP407"),
        (
            "least_iterations = 1\naverage_iterations = 2.5\nmost_iterations = 4\nruns = 3\n",
            "TCP407",
        ),
        ("least_iterations = 1\naverage_iterations = 5\nmost_iterations = 9\nruns = 1\n", "TCP407"),
        ("least_time = -5\naverage_time = -3\nmost_time = -1\n", "TCP410"),
        ("best_time = -0.5\n", "TCP410"),
        ("least_iterations = 7\nleast_solutions = 71\nsolutions_per_iteration = 10\n", "TCP408"),
        ("least_solutions = 70\nleast_ratio = '8%'\nsolution_space = 1000\n", "TCP408"),
    ],
)
def test_each_contradiction_of_statistics_is_found(tmp_path, body, code):
    found = audit([claims(tmp_path, STATISTICS + body)])
    assert code in {f.code for f in found.findings}


@pytest.mark.parametrize(
    "body",
    [
        "least_time = 5\naverage_time = 5.0\nmost_time = 5.04\nbest_time = 5\nruns = 7\n",
        "best_time = 100\nmost_time = 120\nmost_error = '20%'\n",
        "least_time = 5\naverage_time = 5.0\nmost_time = 5.04\nruns = 1\n",
        "best_time = 3\nmost_time = 4\nmost_error = '33.3%'\n",
        "least_iterations = 1\naverage_iterations = 2.3\nmost_iterations = 4\nruns = 3\n",
        "least_solutions = 70\nleast_ratio = '7.0%'\nsolution_space = ['multiply', 10, 100]\n",
    ],
)
def test_sound_statistics_are_left_alone(tmp_path, body):
    found = audit([claims(tmp_path, STATISTICS + body)], knowledge=NOTHING)
    assert {f.code for f in found.findings} == {"TCP409"}


def test_arithmetic_is_a_figure_or_a_comparison(tmp_path):
    body = "[[arithmetic]]\nid = 'a'\nwhere = 'w'\nstatement = 's'\nholds = ['equal', 1, 1]\n"
    assert not audit([claims(tmp_path, body)]).failed()
    with pytest.raises(InputError, match="claim a: arithmetic has either holds or compute"):
        audit([claims(tmp_path, body + "printed = 999\ncompute = ['add', 1]\n")])


def test_misquoted_sequences_and_figures(tmp_path):
    source = claims(tmp_path, PIECE + ROUTE + "time = 5\n", "a.toml")
    quoting = ROUTE.replace("1 2 3", "1 3 2") + 'time = 6\nquotes = "a#r"\n'
    found = audit([source, claims(tmp_path, PIECE + quoting, "b.toml")])
    assert {"TCP602", "TCP603"} <= {f.code for f in found.findings}


PARAMETERS = '[[parameters]]\nid = "v"\nwhere = "w"\nvalues = { a = 1 }\n'


@pytest.mark.parametrize(
    ("values", "quoted", "code"),
    [("a = 1", "a#v", "TCP607"), ("b = 2", "a#v", "TCP610"), ("a = 1", "a#r", "TCP610")],
)
def test_a_quotation_repeats_only_what_could_be_compared(tmp_path, values, quoted, code):
    source = claims(tmp_path, PIECE + PARAMETERS + ROUTE, "a.toml")
    body = PARAMETERS.replace("a = 1", values) + f'quotes = "{quoted}"\n'
    quoting = claims(tmp_path, body, "b.toml")
    assert codes(audit([source, quoting]).entries[-1]) == [code]


def test_a_claim_that_quotes_itself_is_refused(tmp_path):
    with pytest.raises(InputError, match="claim v: quotes itself, c#v"):
        audit([claims(tmp_path, PARAMETERS + 'quotes = "c#v"\n')])


def test_a_wrong_matrix_is_named_entry_by_entry(tmp_path):
    rows = (
        '[[matrix]]\nid = "m"\nwhere = "w"\nworkpiece = "p"\nrows = ["0 1 5", "1 0 4", "5 9 0"]\n'
    )
    found = audit([claims(tmp_path, PIECE + rows)])
    assert [f.message for f in found.findings] == ["from 3 to 2 takes 4, not 9"]


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_damaged_claims_files_are_refused_or_judged(data):
    """Whatever happens to the bytes: findings, or one sentence; never a traceback."""
    raw = bytearray((ROOT / "data" / "claims" / "bmga.toml").read_bytes())
    kind = data.draw(st.sampled_from(["cut", "flip", "repeat", "insert"]))
    at = data.draw(st.integers(0, len(raw) - 1))
    if kind == "cut":
        raw = raw[:at]
    elif kind == "flip":
        raw[at] = data.draw(st.integers(0, 255))
    elif kind == "repeat":
        end = data.draw(st.integers(at, min(len(raw), at + 400)))
        raw = raw[:end] + raw[at:end] + raw[end:]
    else:
        raw[at:at] = data.draw(
            st.sampled_from([b"nan", b"[[", b'"""', b"= 1e999", b"\n[x]\n", b"\\"])
        )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "c.toml"
        path.write_bytes(bytes(raw))
        try:
            audit([path])
        except InputError as error:
            assert "\n" not in str(error) and len(str(error)) < 2000


def test_misprints_of_large_boards_are_refused_in_words(tmp_path):
    holes = ", ".join(f'"{k} {k} 0"' for k in range(700))
    piece = f'[[workpiece]]\nid = "p"\nwhere = "w"\nholes = [{holes}]\n'
    order = " ".join(str(k) for k in range(700))
    path = claims(tmp_path, piece + ROUTE.replace("1 2 3", order) + "time = 5\n")
    (entry,) = (e for e in audit([path], suspect=True).entries if e.kind == "route")
    assert "up to 600 holes" in entry.facts["Misprints"]


def test_a_misprint_is_found_where_there_is_one(tmp_path):
    """A digit of one coordinate is changed; the search names the change that undoes it."""
    rng = np.random.default_rng(8)
    points = rng.integers(100, 999, (12, 2)).tolist()
    true = Workpiece.from_decimals("t", [(str(x), str(y)) for x, y in points])
    claimed = str(Instance(true).cost(range(12)))
    points[4][0] = int(str(points[4][0])[::-1])
    printed = Workpiece.from_decimals("p", [(str(x), str(y)) for x, y in points])
    found = suspicion(Instance(printed), np.arange(12), parse_printed(claimed))
    places = {(c.hole, c.x, c.y) for c, _, _ in found.hits}
    assert (4, int(true.x[4]), int(true.y[4])) in places
    assert found.tried > 500
    for candidate, time, _ in found.hits:
        x, y = printed.x.copy(), printed.y.copy()
        x[candidate.hole], y[candidate.hole] = candidate.x, candidate.y
        moved = Instance(Workpiece("m", printed.ids, x, y))
        assert moved.cost(range(12)) == time == int(claimed)
