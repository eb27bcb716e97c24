"""The judge's command line and its output formats: exit codes, escaping, schemas."""

from __future__ import annotations

import json
import re
import tomllib
import xml.etree.ElementTree as xml
from pathlib import Path

import jsonschema
import pytest
from click.testing import CliRunner

from tcp.cli.main import main
from tcp.files.claims_schema import schema
from tcp.report.findings import FORMATS, render
from tcp.validate import audit
from tcp.validate.codes import CODES, catalogue

ROOT = Path(__file__).resolve().parents[1]
CLAIMS = sorted((ROOT / "data" / "claims").glob("*.toml"))
EVIL = '<script>alert("1")</script>&[x](javascript:1)|`\x1b[31m'

BOARD = "id,x,y\n1,0,0\n2,3,0\n3,3,4\n"


def run(*words):
    done = CliRunner().invoke(main, [str(w) for w in words])
    assert not done.exception or isinstance(done.exception, SystemExit), done.exception
    return done


@pytest.fixture
def board(tmp_path):
    path = tmp_path / "board.csv"
    path.write_text(BOARD)
    return path


def test_a_report_replaces_no_input(board, tmp_path):
    route = tmp_path / "route.txt"
    route.write_text("1 2 3")
    for source in (board, route):
        done = CliRunner().invoke(
            main, ["validate", str(board), "--route-file", str(route), "--out", str(source)]
        )
        assert "is an input and would be overwritten" in f"{done.output}{done.exception}"
    claims = tmp_path / "own.toml"
    claims.write_text(CLAIMS[0].read_text())
    done = CliRunner().invoke(main, ["audit", str(claims), "--out", str(claims)])
    assert "is an input and would be overwritten" in f"{done.output}{done.exception}"
    assert board.read_text() == BOARD and route.read_text() == "1 2 3"
    assert claims.read_text() == CLAIMS[0].read_text()


def test_a_report_without_a_folder_is_told_before_the_judging(board, tmp_path):
    done = CliRunner().invoke(
        main, ["validate", str(board), "--route", "9 9", "--out", str(tmp_path / "none" / "r")]
    )
    assert "there is no folder" in f"{done.output}{done.exception}"


def evil_claims(tmp_path):
    path = tmp_path / "evil.toml"
    name = EVIL.replace('"', '\\"').replace("\x1b", "\\u001b")
    path.write_text(
        f'format = "tcp-claims-1"\n[source]\nkey = "evil"\ntitle = "{name}"\n'
        f'[[workpiece]]\nid = "p"\nwhere = "{name}"\n'
        'holes = ["<script>alert(1)</script> 0 0", "b 1 0", "c 5 0"]\n'
        f'[[route]]\nid = "{name}"\nwhere = "{name}"\nnote = "{name}"\nworkpiece = "p"\n'
        'sequence = ["<script>alert(1)</script>", "<script>alert(1)</script>", "<img src=x>"]\n'
    )
    return path


def test_exit_codes_of_validate(board, tmp_path):
    assert run("validate", board, "--route", "1 2 3", "--claimed", "7").exit_code == 0
    assert run("validate", board, "--route", "1 2 2").exit_code == 1
    assert run("validate", board, "--route", "1 2 3", "--claimed", "8").exit_code == 1
    assert run("validate", board).exit_code == 2
    assert run("validate", board, "--route", "1", "--column", "x").exit_code == 2
    assert run("validate", board, "--route", "1 2 3", "--ignore", "TCP999").exit_code == 2
    assert run("validate", board, "--route", "1 2 3", "--claimed", "nan").exit_code == 3
    assert run("validate", tmp_path / "absent.csv", "--route", "1").exit_code == 3
    assert run("validate", board, "--route", " ").exit_code == 3
    assert run("validate", board, "--route-file", tmp_path).exit_code == 3
    late = ("validate", board, "--route", "2 1 3", "--optimum", "7")
    assert run(*late).exit_code == 0
    assert run(*late, "--optimal").exit_code == 0
    assert run(*late, "--optimal", "--strict").exit_code == 1
    assert run(*late, "--optimal", "--strict", "--ignore", "TCP302").exit_code == 0


@pytest.mark.parametrize("option", ["--optimum", "--lower-bound"])
def test_a_stated_bound_that_a_route_refutes_is_a_finding(board, option):
    done = run("validate", board, "--route", "1 2 3", option, "100")
    assert done.exit_code == 1 and "TCP307" in done.stdout
    assert "100 is wrong: this valid route takes 7" in done.stdout


def test_no_share_of_a_bound_of_nothing(board):
    done = run("validate", board, "--route", "1 2 3", "--lower-bound", "0", "--report", "json")
    page = json.loads(done.stdout, parse_constant=pytest.fail)
    assert done.exit_code == 0 and "TCP305" in str(page)


def test_what_validate_prints(board):
    done = run(
        "validate", board, "--route", "1-2-2", "--claimed", "7", "--repair", "--optimum", "7"
    )
    assert "TCP101 error: hole 2 is drilled more than once: at places 2 and 3" in done.stdout
    assert "smallest repairs: 2 ways with 1 change" in done.stdout
    assert "7, 0.000 % above" in done.stdout
    assert "stated optimum" in done.stdout.lower()


def test_the_drill_order_column_is_a_route(tmp_path):
    path = tmp_path / "b.csv"
    path.write_text("id,x,y,order\na,0,0,2\nb,3,0,3\nc,3,4,1\n")
    done = run("validate", path, "--column", "order", "--claimed", "10", "--report", "json")
    data = json.loads(done.stdout)
    assert done.exit_code == 0 and data["entries"][0]["facts"]["Recomputed"] == "10"
    assert run("validate", path, "--column", "rank").exit_code == 3


def test_exit_codes_of_audit(tmp_path):
    assert run("audit", *CLAIMS, "--details", "none").exit_code == 1
    assert run("audit").exit_code == 2
    assert run("audit", tmp_path / "absent.toml").exit_code == 3
    (tmp_path / "half.toml").write_bytes(CLAIMS[0].read_bytes()[:3000])
    assert run("audit", tmp_path / "half.toml").exit_code == 3
    sound = tmp_path / "sound.toml"
    sound.write_text(
        'format = "tcp-claims-1"\n[source]\nkey = "s"\ntitle = "s"\n[[arithmetic]]\nid = "a"\n'
        'where = "w"\nstatement = "s"\nprinted = 24\ncompute = ["factorial", 4]\n'
    )
    assert run("audit", sound, "--strict").exit_code == 0


def test_the_verdict_table_and_pages():
    done = run("audit", *CLAIMS)
    table, _, rest = done.stdout.partition("\n\n")
    assert len(table.splitlines()) == 2 + 146
    assert re.search(r"^refuted +cuckoo-2014#table-4-wp3-case1 +1460.216 +1750.381", table, re.M)
    assert rest.count(" of the ") and "htga-2016#table-v-cs: refuted" in rest
    failing = run("audit", *CLAIMS, "--details", "failing").stdout
    assert len(failing) < len(done.stdout)


@pytest.mark.parametrize("name", FORMATS)
def test_nothing_of_a_stranger_gets_through(tmp_path, name):
    text = render(audit([evil_claims(tmp_path)]), name)
    assert "\x1b" not in text
    if name in ("html", "junit"):
        assert "<script" not in text and "<img" not in text
    if name == "html":
        assert "javascript:" not in re.sub(r">[^<]*<", "><", text)
    if name == "markdown":
        assert not re.search(r"(?<!\\)\]\(javascript", text)
        assert not re.search(r"(?<!\\)<script", text)
    if name == "sarif":
        for result in json.loads(text)["runs"][0]["results"]:
            assert not re.search(r"(?<!\\)\[", result["message"]["text"])


def test_every_claim_has_its_own_place_on_the_page(tmp_path):
    path = evil_claims(tmp_path)
    text = path.read_text()
    head, mark, claim = text.partition("[[route]]")
    name = re.search(r"^id = .*$", claim, re.M)[0]
    twins = "".join(mark + claim.replace(name, f'id = "{one}"') for one in ("a b", "a-b", "a_b"))
    path.write_text(head + twins)
    page = render(audit([path]), "html")
    places = re.findall(r' id="([^"]*)"', page)
    assert len(places) == len(set(places)) == 4  # with the workpiece
    assert re.findall(r'href="#([^"]*)"', page) == places


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_is_written_to_a_file(tmp_path, name):
    out = tmp_path / "out"
    done = run("audit", *CLAIMS, "--format", name, "--out", out)
    assert done.exit_code == 1 and done.stdout == "" and out.stat().st_size > 1000
    assert not list(tmp_path.glob(".out*"))


def test_json_holds_everything():
    done = run("audit", *CLAIMS, "--format", "json", "--suspect")
    data = json.loads(done.stdout)
    assert data["format"] == "tcp-audit-1" and data["summary"]["claims"] == 146
    entry = next(e for e in data["entries"] if e["key"] == "cuckoo-2014#table-4-wp3-case2")
    assert [r["time"] for r in entry["repairs"]["smallest"]] == ["1210.763", "2000.016"]
    assert entry["repairs"]["cheapest"]["time"] == "1210.763"
    assert {f["severity"] for f in entry["findings"]} == {"error"}


def test_junit_counts_failures():
    root = xml.fromstring(run("audit", *CLAIMS, "--format", "junit").stdout)
    failures = root.findall("testsuite/testcase/failure")
    refuted = [e for e in audit(CLAIMS).entries if e.verdict == "refuted"]
    assert len(root.findall("testsuite/testcase")) == 146 and len(failures) == len(refuted)
    assert sum(int(s.get("failures")) for s in root) == len(refuted)
    strict = xml.fromstring(run("audit", *CLAIMS, "--format", "junit", "--strict").stdout)
    assert len(strict.findall("testsuite/testcase/failure")) > len(refuted)


def test_sarif_points_at_the_line():
    log = json.loads(run("audit", *CLAIMS, "--format", "sarif").stdout)
    driver = log["runs"][0]["tool"]["driver"]
    rules = [r["id"] for r in driver["rules"]]
    assert log["version"] == "2.1.0"
    for result in log["runs"][0]["results"]:
        assert rules[result["ruleIndex"]] == result["ruleId"]
        assert result["level"] in ("error", "warning", "note")
        place = result["locations"][0]["physicalLocation"]
        text = Path(place["artifactLocation"]["uri"]).read_text().splitlines()
        assert 1 <= place["region"]["startLine"] <= len(text)


def test_explain_has_a_page_for_every_code():
    for code in CODES:
        done = run("explain", code.lower())
        assert done.exit_code == 0 and done.stdout.startswith(code)
    assert run("explain").exit_code == 2
    assert run("explain", "--markdown", "TCP303").exit_code == 2
    assert run("explain", "--all", "TCP303").exit_code == 2
    assert run("explain", "--all").stdout.count("\n") == len(CODES)
    done = run("explain", "TCP30")
    assert done.exit_code == 2 and "did you mean" in done.stderr


def test_generated_documents_are_current(monkeypatch):
    monkeypatch.chdir(ROOT)
    assert (ROOT / "docs" / "findings.md").read_text() == catalogue()
    page = run("audit", *(p.relative_to(ROOT) for p in CLAIMS), "--suspect", "--format", "markdown")
    assert (ROOT / "docs" / "audit.md").read_text() == page.stdout, "run the command in its head"
    published = json.loads((ROOT / "docs" / "claims.schema.json").read_text())
    assert published == schema() == json.loads(run("audit", "--schema").stdout)


@pytest.mark.parametrize("path", CLAIMS, ids=lambda p: p.stem)
def test_claims_satisfy_the_published_schema(path):
    jsonschema.validate(tomllib.loads(path.read_text()), schema())
    broken = tomllib.loads(path.read_text()) | {"claim": []}
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(broken, schema())


def test_every_judging_option_is_documented():
    text = (ROOT / "docs" / "cli.md").read_text()
    shared = {p.name for p in main.get_command(None, "info").params}
    for name in ("validate", "audit", "explain"):
        command = main.get_command(None, name)
        for parameter in (p for p in command.params if p.name not in shared):
            for option in parameter.opts:
                if option.startswith("--"):
                    assert f"{option}" in text, option
