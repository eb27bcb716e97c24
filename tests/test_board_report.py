"""The board's pictures and its page: well formed, escaped, self-contained, alive in a browser."""

from __future__ import annotations

import fcntl
import json
import os
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from fractions import Fraction
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from click.testing import CliRunner

from tcp.boards.board import Board, Wishes
from tcp.boards.effort import Effort
from tcp.boards.optimise import optimise
from tcp.cli.main import main
from tcp.errors import UsageError
from tcp.files import gcode
from tcp.files.excellon import parse
from tcp.report.board import three_digits
from tcp.report.board_html import board_html, save_board_html
from tcp.report.board_plot import Frame, board_svg, save_board_plot, side_svg, sides

NASTY = "<script>alert(1)<b>&\"'.drl"
TEXT = (
    "M48\nMETRIC,TZ\nT1C.001\nT2C.002\n%\nT1\nX0Y0\nX9000Y0\nX100Y0\nX9100Y0\nR2X-50\nT2\n"
    "X50Y50G85X90Y50\n</script><b>\nM30\n"
).replace("</script><b>\n", ";</script><b>\n")


@pytest.fixture(scope="module")
def board() -> Board:
    program = parse(TEXT.encode(), NASTY)
    return optimise(program, Wishes(effort=Effort.FAST, time_limit=1))


class Tags(HTMLParser):
    VOID = frozenset({"meta", "link"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.scripts = 0
        self.outside: list[str] = []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.scripts += tag == "script"
        for name, value in attributes:
            if name in ("src", "href") and value != "data:,":
                self.outside.append(value or "")
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_page_is_well_formed_escaped_and_needs_nothing_else(board):
    page = board_html(board)
    tags = Tags()
    tags.feed(page)
    assert tags.open == [] and tags.outside == [] and tags.scripts == 2
    assert "<script>alert" not in page and "&lt;script&gt;alert(1)" in page
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)", page)
    block = re.search(r'id="paths">(.*?)</script>', page, re.S)
    data = json.loads(block[1])
    assert len(data["after"]["xy"]) == 2 * len(data["after"]["tools"]) == 2 * 8
    assert "proved shortest" in page and "T2" in page


def test_the_picture_shows_both_paths_and_the_long_jumps(board):
    root = ElementTree.fromstring(board_svg(board))
    lines = root.findall(".//{*}polyline")
    assert len(lines) > 4 and len(root.findall("{*}g[@transform]")) == 3
    text = " ".join(root.itertext())
    for said in ("before: ", "after: ", "long jump", "first to last move", "T1 0.001 mm", "begin"):
        assert said in text
    dashed = root.findall(".//{*}line[@stroke-dasharray]")
    assert len(dashed) == sum(len(side.jumps) for side in sides(board)) + 1  # one in the legend
    before, after = sides(board)
    assert len(before.jumps) > len(after.jumps) >= 1
    assert NASTY in "".join(root.itertext())


def test_pictures_are_written_as_svg_or_png(board, tmp_path):
    save_board_plot(board, tmp_path / "a.svg")
    assert (tmp_path / "a.svg").read_text().startswith("<svg")
    pytest.importorskip("matplotlib", reason="PNG needs matplotlib")
    save_board_plot(board, tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(UsageError, match=r"\.svg or \.png"):
        save_board_plot(board, tmp_path / "a.pdf")


def test_any_name_gives_a_picture(tmp_path):
    board = optimise(parse(TEXT.encode(), "$\\frac{\x1b[31m.drl"), Wishes(effort=Effort.FAST))
    assert "$\\frac{\\x1b[31m.drl" in "".join(ElementTree.fromstring(board_svg(board)).itertext())
    assert "\x1b" not in board_html(board)
    pytest.importorskip("matplotlib", reason="PNG needs matplotlib")
    save_board_plot(board, tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("0", "0.00"),
        ("0.0042", "0.00420"),
        ("2.976", "2.98"),
        ("12.38", "12.4"),
        ("1234", "1234.0"),
    ],
)
def test_small_differences_do_not_look_like_none(value, said):
    assert three_digits(Fraction(value)) == said


def test_a_rapid_to_nowhere_is_drawn_as_no_hole():
    text = b"G21 G90\nG0 Z5\nG0 X0 Y0\nG81 X5 Y5 Z-1 R1\nX9\nX7\nG80\nG0 X0 Y0\nM2\n"
    before, after = sides(optimise(gcode.parse(text, "a.ngc"), Wishes(effort=Effort.FAST)))
    assert before.drilled == after.drilled == [False, True, True, True, False]
    assert side_svg(before, Frame.around(before.places)).count("h0") == 3


def test_png_without_matplotlib_ends_the_call_before_any_work(tmp_path, monkeypatch):
    monkeypatch.setattr("tcp.cli.terminal.find_spec", lambda name: None)
    monkeypatch.setattr("tcp.cli.optimize.optimise", None)
    path = tmp_path / "a.drl"
    path.write_bytes(b"M48\nMETRIC,TZ\nT1C1\n%\nT1\nX1Y1\nM30\n")
    done = CliRunner().invoke(main, ["optimize", str(path), "--plot", str(tmp_path / "a.png")])
    assert done.exit_code == 2 and "pip install 'tcp-drill[plot]'" in done.stderr


def test_the_command_writes_picture_and_page(tmp_path):
    path = tmp_path / "board.drl"
    path.write_text(TEXT)
    words = ["--plot", tmp_path / "a.svg", "--report", tmp_path / "a.html", "--dry-run"]
    done = CliRunner().invoke(main, ["optimize", *map(str, [path, *words])])
    assert done.exit_code == 0
    assert {p.name for p in tmp_path.iterdir()} == {"board.drl", "a.svg", "a.html"}


# -- in a browser --------------------------------------------------------------------------


class Browser:
    """Headless Chromium, spoken to over its debugging pipe; no further library needed."""

    def __init__(self, program: str, profile: Path):
        to_read, self._write = os.pipe()
        self._read, to_write = os.pipe()
        high = [fcntl.fcntl(end, fcntl.F_DUPFD, 50) for end in (to_read, to_write)]
        flags = (
            "--headless --no-sandbox --disable-gpu --disable-dev-shm-usage --no-first-run "
            "--disable-quic --disable-sync --disable-background-networking "
            "--disable-component-update"
        )
        self.process = subprocess.Popen(
            [program, *flags.split(), "--remote-debugging-pipe", f"--user-data-dir={profile}"],
            preexec_fn=lambda: [os.dup2(end, fd) for end, fd in zip(high, (3, 4), strict=True)],
            pass_fds=(3, 4),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for end in (to_read, to_write, *high):
            os.close(end)
        os.set_blocking(self._read, False)
        self._buffer = b""
        self._number = 0
        self.events: list[dict[str, Any]] = []

    def call(self, method: str, session: str | None = None, **params: Any) -> dict[str, Any]:
        """One command and its answer; everything else that comes is kept as an event."""
        self._number += 1
        message: dict[str, Any] = {"id": self._number, "method": method, "params": params}
        if session:
            message["sessionId"] = session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        for answer in self._messages(30):
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]
            self.events.append(answer)
        raise AssertionError(f"chromium did not answer {method}")

    def _messages(self, seconds: float) -> Iterator[dict[str, Any]]:
        limit = time.monotonic() + seconds
        while time.monotonic() < limit:
            message, mark, rest = self._buffer.partition(b"\0")
            if mark:
                self._buffer = rest
                yield json.loads(message)
                continue
            try:
                more = os.read(self._read, 1 << 16)
                assert more, "chromium went away"
                self._buffer += more
            except BlockingIOError:
                time.sleep(0.02)

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        os.close(self._write)
        os.close(self._read)


def test_the_page_plays_in_chromium_without_a_console_error(board, tmp_path):
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        pytest.skip("chromium is not installed (Debian: apt-get install chromium)")
    page = tmp_path / "board.html"
    save_board_html(board, page)
    browser = Browser(program, tmp_path / "profile")
    try:
        target = browser.call("Target.createTarget", url="about:blank")["targetId"]
        session = browser.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]

        def value(code: str) -> Any:
            answer = browser.call("Runtime.evaluate", session, expression=code)
            assert "exceptionDetails" not in answer, answer
            return answer["result"].get("value")

        for domain in ("Runtime", "Log", "Page"):
            browser.call(f"{domain}.enable", session)
        browser.call("Page.navigate", session, url=page.as_uri())
        limit = time.monotonic() + 20
        while value("document.readyState") != "complete" and time.monotonic() < limit:
            time.sleep(0.05)
        assert value("document.querySelectorAll('figure svg').length") == 2
        assert value("document.querySelectorAll('.fact b')[1].textContent").endswith(" mm")
        assert value("document.body.dataset.shown") == "8"
        value("document.getElementById('play').click()")
        assert value("document.body.dataset.state") == "playing"
        seen = set()
        while value("document.body.dataset.state") == "playing" and time.monotonic() < limit:
            seen.add(int(value("document.body.dataset.shown")))
            time.sleep(0.05)
        assert len(seen) > 2 and value("document.body.dataset.shown") == "8"
        assert value("document.getElementById('where').textContent") == "8 of 8, T2"
        value(
            "(function(){const w=document.getElementById('which');w.value='before';"
            "w.dispatchEvent(new Event('change'));})()"
        )
        assert value("document.body.dataset.shown") == "0"
        wrong = [
            event
            for event in browser.events
            if event.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded")
            or (
                event.get("method") == "Runtime.consoleAPICalled"
                and event["params"]["type"] in ("error", "warning", "assert")
            )
        ]
        assert wrong == []
    finally:
        browser.close()
