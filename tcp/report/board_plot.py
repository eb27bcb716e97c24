"""A board before and after, side by side: SVG written here, PNG through matplotlib.

The path's colour runs from blue to red with its progress; jumps that are long
for the board are drawn in magenta; holes are drawn in their tool's colour.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np

from tcp.boards.optimise import Board
from tcp.boards.trail import Trail, follow
from tcp.errors import UsageError
from tcp.files.excellon import Program
from tcp.files.write import write_file
from tcp.report.board import amount

PANEL = 520
MARGIN = 16
HEAD = 46
JUMP = "#d0007a"
TOOLS = ("#1b9e77", "#7570b3", "#e6ab02", "#66a61e", "#a6761d", "#666666", "#1f78b4", "#b15928")
RUNS = 96
"""Most shades of a path."""

LONG = 0.25
"""A jump longer than this share of the board's diagonal is highlighted."""


@dataclass(frozen=True)
class Side:
    """One of the two pictures, in millimetres.

    Parameters
    ----------
    title : str
        Above the picture.
    places : list of (x, y)
        The path.
    tools : list of int
        Index of the tool at each place, among the board's tools.
    jumps : list of int
        Moves (by the index of their first place) that are highlighted.
    """

    title: str
    places: list[tuple[float, float]]
    tools: list[int]
    jumps: list[int]


def sides(board: Board) -> tuple[Side, Side]:
    """The two pictures of a board."""
    unit = board.wishes.machine.unit
    return (
        _side(board.before, f"before: {amount(board, board.costs_before.total)} {unit}"),
        _side(board.after, f"after: {amount(board, board.costs_after.total)} {unit}"),
    )


def _side(program: Program, title: str) -> Side:
    trail: Trail = follow(program)
    step = float(program.step)
    names = {tool: i for i, tool in enumerate(sorted(program.used))}
    tools = [names[t] for t in program.rows.tool[trail.row].tolist()]
    reach = np.hypot(np.ptp(trail.x), np.ptp(trail.y))
    moves = np.hypot(np.diff(trail.x), np.diff(trail.y))
    jumps = np.flatnonzero(moves > LONG * reach).tolist() if reach else []
    places = list(zip((trail.x * step).tolist(), (trail.y * step).tolist(), strict=True))
    return Side(title, places, tools, jumps)


def shade(t: float) -> str:
    """Colour at ``t`` in [0, 1], from blue through violet to red."""
    stops = [(33, 102, 172), (140, 70, 160), (203, 24, 29)]
    low, share = (stops[:2], 2 * t) if t < 0.5 else (stops[1:], 2 * t - 1)
    mixed = (round(a + (b - a) * share) for a, b in zip(*low, strict=True))
    return "#" + "".join(f"{channel:02x}" for channel in mixed)


@dataclass(frozen=True)
class Frame:
    """Where a board lies on a panel."""

    left: float
    top: float
    scale: float
    width: float
    height: float

    @classmethod
    def around(cls, places: list[tuple[float, float]]) -> Frame:
        """The frame that shows all places on a panel."""
        x, y = [p[0] for p in places], [p[1] for p in places]
        wide, high = max(x) - min(x), max(y) - min(y)
        scale = (PANEL - 2 * MARGIN) / (max(wide, high) or 1.0)
        return cls(min(x), max(y), scale, wide * scale + 2 * MARGIN, high * scale + 2 * MARGIN)

    def at(self, place: tuple[float, float]) -> tuple[float, float]:
        """Pixels of a place."""
        x = (place[0] - self.left) * self.scale + MARGIN
        return round(x, 1), round((self.top - place[1]) * self.scale + MARGIN, 1)


def board_svg(board: Board) -> str:
    """Both pictures as one SVG document."""
    before, after = sides(board)
    frame = Frame.around(before.places)
    panel = max(frame.width, 200.0)
    parts = [
        f'<text x="{MARGIN + at:.1f}" y="38" font-size="13" fill="#444">{escape(side.title)}</text>'
        f'<g transform="translate({at:.1f},{HEAD})">{side_svg(side, frame)}</g>'
        for side, at in ((before, 0.0), (after, panel))
    ]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{2 * panel:.0f}" '
        f'height="{frame.height + HEAD:.0f}" font-family="sans-serif">'
        f'<rect width="100%" height="100%" fill="#ffffff"/>'
        f'<text x="{MARGIN}" y="20" font-size="16">{escape(board.before.path.name)}</text>'
        f"{''.join(parts)}</svg>\n"
    )


def side_svg(side: Side, frame: Frame) -> str:
    """One picture as SVG elements."""
    moves = len(side.places) - 1
    pieces = min(moves, RUNS)
    cuts = [moves * k // pieces for k in range(pieces + 1)] if pieces else []
    spots = [frame.at(place) for place in side.places]
    out = ['<g fill="none" stroke-width="1" stroke-linejoin="round">']
    for k in range(pieces):
        points = " ".join(f"{x},{y}" for x, y in spots[cuts[k] : cuts[k + 1] + 1])
        out.append(f'<polyline points="{points}" stroke="{shade(k / max(pieces - 1, 1))}"/>')
    for i in side.jumps:
        (x1, y1), (x2, y2) = spots[i], spots[i + 1]
        line = f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}"'
        out.append(f'{line} stroke="{JUMP}" stroke-dasharray="5 3"/>')
    out.append('</g><g stroke="none">')
    radius = 2.0 if len(spots) < 800 else 1.2
    for tool in sorted(set(side.tools)):
        dots = " ".join(
            f"M{x - radius:.1f} {y}h{2 * radius:.1f}"
            for (x, y), t in zip(spots, side.tools, strict=True)
            if t == tool
        )
        colour = TOOLS[tool % len(TOOLS)]
        out.append(f'<path d="{dots}" stroke="{colour}" stroke-width="{2 * radius:.1f}"/>')
    return "".join([*out, "</g>"])


def save_board_plot(board: Board, path: Path) -> None:
    """Draw a board before and after to ``.svg``, or ``.png`` with matplotlib.

    Raises
    ------
    UsageError
        For another suffix, or PNG without matplotlib.
    OutputError
        If the file cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix == ".svg":
        write_file(path, board_svg(board))
    elif suffix == ".png":
        write_file(path, _png(board))
    else:
        raise UsageError(f"{path}: pictures are written as .svg or .png")


def _png(board: Board) -> bytes:
    try:
        from matplotlib.collections import LineCollection
        from matplotlib.figure import Figure
    except ImportError:
        raise UsageError("PNG needs matplotlib: pip install 'tcp-drill[plot]'") from None
    figure = Figure(figsize=(12, 6.4), layout="constrained")
    figure.suptitle(board.before.path.name)
    for at, side in enumerate(sides(board)):
        axes = figure.add_subplot(1, 2, at + 1)
        places = np.array(side.places)
        lines = np.stack([places[:-1], places[1:]], axis=1)
        colours = [shade(k / max(len(lines) - 1, 1)) for k in range(len(lines))]
        axes.add_collection(LineCollection(list(lines), colors=colours, linewidths=0.7))
        jumps = list(lines[side.jumps])
        axes.add_collection(LineCollection(jumps, colors=JUMP, linewidths=0.8, linestyles="--"))
        dots = [TOOLS[t % len(TOOLS)] for t in side.tools]
        axes.scatter(places[:, 0], places[:, 1], s=3, c=dots, zorder=3)
        axes.set_title(side.title, fontsize=10)
        axes.set_aspect("equal")
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=110)
    return stream.getvalue()
