"""A board before and after, side by side: SVG written here, PNG through matplotlib.

The path's colour runs from blue to red with its progress; jumps that are long
for the board are dashed in magenta; holes have their tool's colour and size;
a ring marks where the path begins, a square where it ends.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from tcp.boards.board import Board
from tcp.boards.trail import Trail, follow
from tcp.errors import UsageError
from tcp.files.excellon import Kind, Program
from tcp.files.write import write_file
from tcp.report.board import amount
from tcp.report.shades import shade, shaded
from tcp.words import plain

PANEL = 520
MARGIN = 18
HEAD = 58
FOOT = 26
"""Pixels below a picture, for its scale."""

JUMP = "#d0007a"
BEGIN, END = "#1a9641", "#222222"
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
    drilled : list of bool
        Whether there is a hole at each place, and not only a way to the next one.
    jumps : list of int
        Moves (by the index of their first place) that are highlighted.
    sizes : list of float
        Diameters of the board's tools; 0 where the file states none.
    """

    title: str
    places: list[tuple[float, float]]
    tools: list[int]
    drilled: list[bool]
    jumps: list[int]
    sizes: list[float]


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
    used = sorted(program.used)
    names = {tool: i for i, tool in enumerate(used)}
    tools = [names[t] for t in program.rows.tool[trail.row].tolist()]
    drilled = (program.rows.kind[trail.row] != Kind.PASS).tolist()
    reach = np.hypot(np.ptp(trail.x), np.ptp(trail.y))
    moves = np.hypot(np.diff(trail.x), np.diff(trail.y))
    jumps = np.flatnonzero(moves > LONG * reach).tolist() if reach else []
    places = list(zip((trail.x * step).tolist(), (trail.y * step).tolist(), strict=True))
    count = f", {len(jumps)} long jump{'s' if len(jumps) != 1 else ''}"
    sizes = [float(program.tools[tool].diameter or 0) for tool in used]
    return Side(title + count, places, tools, drilled, jumps, sizes)


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
        width, height = wide * scale + 2 * MARGIN, high * scale + 2 * MARGIN + FOOT
        return cls(min(x), max(y), scale, max(width, 220.0), height)

    def at(self, place: tuple[float, float]) -> tuple[float, float]:
        """Pixels of a place."""
        x = (place[0] - self.left) * self.scale + MARGIN
        return round(x, 1), round((self.top - place[1]) * self.scale + MARGIN, 1)

    def bar(self) -> tuple[float, float]:
        """A round length for the scale: millimetres and pixels."""
        most = 0.4 * self.width / self.scale
        power = 10.0 ** np.floor(np.log10(most))
        length = float(max(k for k in (1, 2, 5) if k * power <= most) * power)
        return length, length * self.scale


def board_svg(board: Board) -> str:
    """Both pictures as one SVG document, with a legend."""
    before, after = sides(board)
    frame = Frame.around(before.places)
    gap = frame.width + 12
    legend, high = legend_svg(board, 2 * frame.width + 12)
    parts = [
        f'<text x="{at + 2:.1f}" y="48" font-size="13" fill="#444">{escape(side.title)}</text>'
        f'<g transform="translate({at:.1f},{HEAD})">{side_svg(side, frame)}</g>'
        for side, at in ((before, 8.0), (after, 8.0 + gap))
    ]
    height = frame.height + HEAD + high
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{2 * frame.width + 28:.0f}" '
        f'height="{height:.0f}" font-family="sans-serif">'
        f'<rect width="100%" height="100%" fill="#ffffff"/>'
        f'<text x="10" y="24" font-size="17">{escape(plain(board.before.path.name))}</text>'
        f"{''.join(parts)}"
        f'<g transform="translate(8,{frame.height + HEAD:.1f})">{legend}</g></svg>\n'
    )


def legend_svg(board: Board, width: float) -> tuple[str, float]:
    """What colours and marks mean, as SVG elements, and how high that is."""
    stops = "".join(f'<stop offset="{k / 4}" stop-color="{shade(k / 4)}"/>' for k in range(5))
    line = f'stroke="{JUMP}" stroke-width="1.4" stroke-dasharray="5 3"'
    marks = [
        (
            196.0,
            '<rect x="4" y="-8" width="60" height="7" fill="url(#way)"/>',
            70,
            "first to last move",
        ),
        (
            268.0,
            f'<line x1="4" y1="-4" x2="40" y2="-4" {line}/>',
            46,
            f"jump over {LONG:.0%} of the diagonal",
        ),
        (66.0, _ring(9, -4), 18, "begin"),
        (58.0, _square(9, -4), 18, "end"),
    ]
    for i, tool in enumerate(sorted(board.before.used)):
        diameter = board.before.tools[tool].diameter
        size = "" if diameter is None else f" {float(diameter):.3f} mm"
        dot = f'<circle cx="9" cy="-4" r="4" fill="{TOOLS[i % len(TOOLS)]}"/>'
        marks.append((36.0 + 7.2 * len(f"T{tool}{size}"), dot, 18, f"T{tool}{size}"))
    out, x, y = [f'<defs><linearGradient id="way">{stops}</linearGradient></defs>'], 0.0, 20.0
    for wide, mark, at, text in marks:
        if x and x + wide > width:
            x, y = 0.0, y + 20.0
        words = f'<text x="{at}" y="0" font-size="12" fill="#444">{escape(text)}</text>'
        out.append(f'<g transform="translate({x:.0f},{y:.0f})">{mark}{words}</g>')
        x += wide
    return "".join(out), y + 12.0


def _ring(x: float, y: float) -> str:
    return f'<circle cx="{x}" cy="{y}" r="5" fill="none" stroke="{BEGIN}" stroke-width="2.4"/>'


def _square(x: float, y: float) -> str:
    box = f'<rect x="{x - 4:.1f}" y="{y - 4:.1f}" width="8" height="8"'
    return f'{box} fill="none" stroke="{END}" stroke-width="2"/>'


def side_svg(side: Side, frame: Frame) -> str:
    """One picture as SVG elements."""
    spots = [frame.at(place) for place in side.places]
    thin = 1.1 if len(spots) < 800 else 0.7
    out = [
        f'<rect x="0.5" y="0.5" width="{frame.width - 1:.1f}" height="{frame.height - 1:.1f}" '
        f'fill="#fbfbf9" stroke="#dddddd"/><g stroke="none">',
        *_holes(side, frame, spots),
        f'</g><g fill="none" stroke-width="{thin}" stroke-linejoin="round">',
    ]
    for colour, a, b in shaded(len(spots) - 1, RUNS):
        points = " ".join(f"{x},{y}" for x, y in spots[a : b + 1])
        out.append(f'<polyline points="{points}" stroke="{colour}"/>')
    for i in side.jumps:
        (x1, y1), (x2, y2) = spots[i], spots[i + 1]
        line = f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}"'
        out.append(f'{line} stroke="{JUMP}" stroke-width="1.4" stroke-dasharray="5 3"/>')
    out.append(f"</g>{_ring(*spots[0])}{_square(*spots[-1])}{_scale(frame)}")
    return "".join(out)


def _holes(side: Side, frame: Frame, spots: list[tuple[float, float]]) -> list[str]:
    """The holes as dots, a path a tool; as wide as they are drilled where that can be seen."""
    least, out = (3.2 if len(spots) < 800 else 2.0), []
    for tool in sorted(set(side.tools)):
        dots = "".join(
            f"M{x} {y}h0"
            for (x, y), t, hole in zip(spots, side.tools, side.drilled, strict=True)
            if hole and t == tool
        )
        wide = min(max(least, side.sizes[tool] * frame.scale), 14.0)
        colour = TOOLS[tool % len(TOOLS)]
        style = f'stroke="{colour}" stroke-width="{wide:.1f}" stroke-linecap="round"'
        out.append(f'<path d="{dots}" {style} opacity="0.75"/>')
    return out


def _scale(frame: Frame) -> str:
    """A bar of a round length."""
    length, wide = frame.bar()
    y = frame.height - 12
    bar = f"M{MARGIN} {y - 4:.1f}v8m0-4h{wide:.1f}m0-4v8"
    return (
        f'<path d="{bar}" stroke="#666" fill="none"/><text x="{MARGIN + wide + 6:.1f}" '
        f'y="{y + 4:.1f}" font-size="11" fill="#666">{length:g} mm</text>'
    )


def save_board_plot(board: Board, path: Path) -> None:
    """Draw a board before and after to ``.svg``, or ``.png`` with matplotlib.

    Of a private board it is private, too.

    Raises
    ------
    UsageError
        For another suffix, or PNG without matplotlib.
    OutputError
        If the file cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix == ".svg":
        write_file(path, board_svg(board), like=(board.before.path,))
    elif suffix == ".png":
        write_file(path, _png(board), like=(board.before.path,))
    else:
        raise UsageError(f"{path}: pictures are written as .svg or .png")


def _png(board: Board) -> bytes:
    try:
        from matplotlib.collections import LineCollection
        from matplotlib.figure import Figure
        from matplotlib.layout_engine import ConstrainedLayoutEngine
    except ImportError:
        raise UsageError("PNG needs matplotlib: pip install 'tcp-drill[plot]'") from None
    handles = _handles(board)
    frame = Frame.around(sides(board)[0].places)
    lines = 1 + (len(handles) + 5) // 6
    height = 1.6 + 6 * min(frame.height / frame.width, 1.1) + 0.22 * lines
    foot = 0.22 * lines / height
    layout = ConstrainedLayoutEngine(rect=(0, foot, 1, 1 - foot))
    figure = Figure(figsize=(13, height), layout=layout)
    figure.suptitle(plain(board.before.path.name), parse_math=False)
    for at, side in enumerate(sides(board)):
        axes = figure.add_subplot(1, 2, at + 1)
        places = np.array(side.places)
        moves = np.stack([places[:-1], places[1:]], axis=1)
        colours = [shade(k / max(len(moves) - 1, 1)) for k in range(len(moves))]
        axes.add_collection(LineCollection(list(moves), colors=colours, linewidths=0.7))
        jumps = list(moves[side.jumps])
        axes.add_collection(LineCollection(jumps, colors=JUMP, linewidths=1.1, linestyles="--"))
        dots = np.array([TOOLS[t % len(TOOLS)] for t in side.tools])[side.drilled]
        holes = places[side.drilled]
        axes.scatter(holes[:, 0], holes[:, 1], s=4, c=dots, zorder=3)
        axes.plot(*places[0], "o", mfc="none", mec=BEGIN, mew=1.6, ms=8, zorder=4)
        axes.plot(*places[-1], "s", mfc="none", mec=END, mew=1.4, ms=7, zorder=4)
        axes.set_title(side.title, fontsize=10)
        axes.set_xlabel("x in mm")
        axes.set_ylabel("y in mm")
        axes.set_aspect("equal")
    figure.legend(handles=handles, loc="lower center", ncols=6, fontsize=8, frameon=False)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=110)
    return stream.getvalue()


def _handles(board: Board) -> list[Any]:
    """The legend's entries: the way's colours, long jumps, both ends, the tools."""
    from matplotlib.lines import Line2D

    found = [
        Line2D([], [], color=shade(0), label="first move"),
        Line2D([], [], color=shade(1), label="last move"),
        Line2D([], [], color=JUMP, ls="--", label=f"jump over {LONG:.0%} of the diagonal"),
        Line2D([], [], ls="", marker="o", mfc="none", mec=BEGIN, label="begin"),
        Line2D([], [], ls="", marker="s", mfc="none", mec=END, label="end"),
    ]
    for i, tool in enumerate(sorted(board.before.used)):
        diameter = board.before.tools[tool].diameter
        label = f"T{tool}" if diameter is None else f"T{tool} {float(diameter):.3f} mm"
        found.append(Line2D([], [], ls="", marker="o", color=TOOLS[i % len(TOOLS)], label=label))
    return found
