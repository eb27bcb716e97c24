"""What it is worth to choose the tools' paths and the moves between them together.

    python benchmarks/board_links.py [--fresh]

Every board of the corpus with ``--effort fast``: travel of the file, with every path at its
shortest and only its direction chosen, and with the ends chosen as well; and the same with the
tools in the best order.  One line of JSON a board is appended to
benchmarks/results/board_links.jsonl, so that an interrupted run goes on; the table is printed.
At most a few seconds a tool.  The corpus is found in TCP_CORPUS, or in ../shared/corpus.
"""

from __future__ import annotations

import argparse
import json
import os
import tomllib
from pathlib import Path
from typing import Any

from tcp.boards.board import Wishes
from tcp.boards.chain import ToolOrder
from tcp.boards.effort import Effort
from tcp.boards.optimise import optimise
from tcp.errors import TcpError
from tcp.files.excellon import hints, read_program

ROOT = Path(__file__).resolve().parents[1]
BOARDS = Path(os.environ.get("TCP_CORPUS", ROOT.parent / "shared" / "corpus")) / "boards"
OUT = ROOT / "benchmarks" / "results" / "board_links.jsonl"
HINTS = tomllib.loads((ROOT / "tests" / "files" / "board_hints.toml").read_text())


def run(path: Path) -> dict[str, Any]:
    """One board; travel in mm."""
    given = hints(**HINTS.get(path.name, {}))
    program = read_program(path, given)
    row: dict[str, Any] = {"board": path.name}
    for order in (ToolOrder.KEEP, ToolOrder.OPTIMISE):
        try:
            board = optimise(program, Wishes(effort=Effort.FAST, tool_order=order), given)
        except TcpError as error:  # tools that must not change places
            row[order] = {"refused": str(error).rsplit(": ", 1)[-1]}
            continue
        costs = (board.costs_before, board.costs_after)
        row[order] = {
            "tools": len(board.parts),
            "before": float(board.worth(costs[0].total)),
            "after": float(board.worth(costs[1].total)),
            "links": [float(board.worth(c.links)) for c in costs],
            "gain": float(board.worth(board.ends_gain)),
            "order_gain": float(board.worth(board.order_gain)),
            "bound": float(board.worth(board.bound)),
        }
    return row


def table(rows: list[dict[str, Any]]) -> str:
    """One line a board with several tools, and their sum."""
    lines = [
        f"{'board':42} {'file':>9} {'paths':>9} {'ends':>9} {'saved':>7} {'bound':>9} {'order':>9}"
    ]
    sums = [0.0] * 5
    for row in sorted(rows, key=lambda row: str(row["board"])):
        kept = row["keep"]
        if "refused" in kept or kept["tools"] < 2:
            continue
        free = row["optimise"].get("after", kept["after"])
        values = [kept["before"], kept["after"] + kept["gain"], kept["after"], kept["bound"], free]
        sums = [a + b for a, b in zip(sums, values, strict=True)]
        lines.append(line(str(row["board"]), values))
    return "\n".join([*lines, line("all", sums)])


def line(name: str, values: list[float]) -> str:
    before, paths, ends, bound, free = values
    saved = f"{100 * (1 - ends / paths):.1f} %" if paths else "-"
    return f"{name:42} {before:9.1f} {paths:9.1f} {ends:9.1f} {saved:>7} {bound:9.1f} {free:9.1f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fresh", action="store_true", help="Begin anew.")
    if parser.parse_args().fresh:
        OUT.unlink(missing_ok=True)
    rows = [json.loads(text) for text in OUT.read_text().splitlines()] if OUT.exists() else []
    known = {row["board"] for row in rows}
    for path in sorted(p for p in BOARDS.iterdir() if p.suffix != ".tsv"):
        if path.name in known:
            continue
        try:
            rows.append(run(path))
        except TcpError:
            continue  # not a drill file
        with OUT.open("a") as stream:
            stream.write(json.dumps(rows[-1]) + "\n")
    print(table(rows))


if __name__ == "__main__":
    main()
