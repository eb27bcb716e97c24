"""A route as a picture: SVG written here, PNG through matplotlib.

The line's colour runs from blue (first hole) to red (last), so that the
direction shows without arrows.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from tcp.errors import UsageError
from tcp.files.write import write_file
from tcp.report.shades import shaded
from tcp.report.table import describe, duration, proof
from tcp.result import Result
from tcp.words import plain

Place = tuple[float, float]
Run = tuple[str, list[Place]]

SIZE = 720
"""Longer side of the drawing, in pixels."""

MARGIN = 40
LABELLED = 150
"""Most holes for which ids are drawn."""

RUNS = 64
"""Most shades of the line."""


@dataclass(frozen=True)
class Drawing:
    """A result in millimetres, ready to be drawn by any means.

    Parameters
    ----------
    title, subtitle : str
        Two lines of text.
    holes : list of (x, y)
        In drilling order.
    labels : list of str
        Ids in drilling order; empty where there are too many.
    runs : list of (colour, places)
        The line in pieces of one shade.
    home : (x, y) or None
        The home position.
    """

    title: str
    subtitle: str
    holes: list[Place]
    labels: list[str]
    runs: list[Run]
    home: Place | None


def drawing(result: Result) -> Drawing:
    """What there is to draw.

    Raises
    ------
    UsageError
        If the result has no route.
    """
    instance, piece = result.instance, result.instance.workpiece
    if result.route is None or result.time is None:
        raise UsageError(f"{instance.name} has no route to draw")
    step = float(piece.step)
    holes = [(float(piece.x[i]) * step, float(piece.y[i]) * step) for i in result.route]
    ends = instance.ends
    home = None if ends.home is None else (float(ends.home[0]), float(ends.home[1]))
    line = list(holes)
    if home is not None:
        line = [home] * ends.outward + line + [home] * ends.back
    if ends.closed:
        line.append(line[0])
    few = len(holes) <= LABELLED
    return Drawing(
        title=f"{plain(instance.name)}: {duration(result.time, instance)} ({proof(result)})",
        subtitle=plain(describe(instance)),
        holes=holes,
        labels=[plain(piece.ids[i]) for i in result.route] if few else [],
        runs=_runs(line),
        home=home,
    )


def _runs(line: list[Place]) -> list[Run]:
    """The line in at most :data:`RUNS` pieces, from blue to red."""
    return [(colour, line[a : b + 1]) for colour, a, b in shaded(len(line) - 1, RUNS)]


def save_plot(result: Result, path: Path, like: Sequence[Path] = ()) -> None:
    """Draw the route to a file: ``.svg``, or ``.png`` where matplotlib is installed.

    It is kept from whom any of the files ``like`` is kept from.

    Raises
    ------
    UsageError
        For another suffix, or PNG without matplotlib.
    OutputError
        If the file cannot be written.
    """
    kinds = {".svg": svg, ".png": png}
    suffix = path.suffix.lower()
    if suffix not in kinds:
        raise UsageError(f"{path}: pictures are written as {' or '.join(kinds)}")
    write_file(path, kinds[suffix](drawing(result)), like=like)


def svg(picture: Drawing) -> bytes:
    """The drawing as a self-contained SVG document."""
    places = picture.holes + ([picture.home] if picture.home else [])
    left, low = (min(p[axis] for p in places) for axis in (0, 1))
    right, high = (max(p[axis] for p in places) for axis in (0, 1))
    scale = SIZE / (max(right - left, high - low) or 1.0)
    width, height = (right - left) * scale + 2 * MARGIN, (high - low) * scale + 2 * MARGIN + 30

    def at(place: Place) -> Place:
        return (place[0] - left) * scale + MARGIN, (high - place[1]) * scale + MARGIN + 30

    body = [
        f'<text x="{MARGIN}" y="26" font-size="18">{escape(picture.title)}</text>',
        f'<text x="{MARGIN}" y="46" font-size="13" fill="#555">{escape(picture.subtitle)}</text>',
    ]
    for colour, run in picture.runs:
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(at, run))
        body.append(f'<polyline points="{points}" stroke="{colour}"/>')
    body += _svg_holes([at(place) for place in picture.holes], picture.labels)
    if picture.home is not None:
        x, y = at(picture.home)
        body.append(f'<path d="M{x:.1f},{y:.1f}m-6,-6h12v12h-12z" fill="#1b7837"/>')
    return _document(max(width, 420), height, body).encode()


def _svg_holes(holes: list[Place], labels: list[str]) -> list[str]:
    """Circles, the first and last ones filled, and ids where there is room."""
    radius = 4 if labels else max(0.6, 40 / len(holes) ** 0.5)
    fills = {0: "#2166ac", len(holes) - 1: "#cb181d"}
    parts = []
    for k, (x, y) in enumerate(holes):
        size, fill = (radius * 1.6, fills[k]) if k in fills else (radius, "#fff")
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{size:.1f}" fill="{fill}"/>')
    taken = [_box(place, 5, 5) for place in holes]
    for name, (x, y) in zip(labels, holes, strict=False):
        width = 6.5 * len(name)
        corners = [(x + dx * (6 + width / 2), y + dy) for dy in (-9, 10) for dx in (1, -1)]
        boxes = [_box(corner, width / 2, 5) for corner in corners]
        free = [k for k, box in enumerate(boxes) if not any(_overlap(box, t) for t in taken)]
        best = free[0] if free else 0
        taken.append(boxes[best])
        tx, ty = corners[best]
        text = f'<text x="{tx:.1f}" y="{ty + 4:.1f}" font-size="11" text-anchor="middle">'
        parts.append(f"{text}{escape(name)}</text>")
    return parts


_Box = tuple[float, float, float, float]


def _box(centre: Place, width: float, height: float) -> _Box:
    """Left, top, right and bottom of what reaches so far around its centre."""
    return centre[0] - width, centre[1] - height, centre[0] + width, centre[1] + height


def _overlap(a: _Box, b: _Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _document(width: float, height: float, body: list[str]) -> str:
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
            f'width="{width:.0f}" height="{height:.0f}" font-family="sans-serif">',
            "<style>polyline{fill:none;stroke-width:2;stroke-linejoin:round}"
            "circle{stroke:#222;stroke-width:1}</style>",
            '<rect width="100%" height="100%" fill="#fff"/>',
            *body,
            "</svg>",
            "",
        ]
    )


def png(picture: Drawing) -> bytes:
    """The drawing as a PNG image.

    Raises
    ------
    UsageError
        If matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise UsageError(
            "PNG needs matplotlib: pip install 'tcp-drill[plot]', or write .svg"
        ) from None
    figure = Figure(figsize=(8, 8), layout="constrained")
    axes = figure.subplots()
    for colour, run in picture.runs:
        axes.plot(*zip(*run, strict=True), color=colour, linewidth=1.5, zorder=1)
    sizes = 14 if picture.labels else max(0.5, 2000 / len(picture.holes))
    x, y = zip(*picture.holes, strict=True)
    axes.scatter(x, y, s=sizes, c="white", edgecolors="#222", zorder=2)
    for k, colour in ((0, "#2166ac"), (-1, "#cb181d")):
        axes.scatter(x[k : k + 1 or None], y[k : k + 1 or None], s=3 * sizes, c=colour, zorder=3)
    if picture.home is not None:
        axes.scatter([picture.home[0]], [picture.home[1]], s=60, c="#1b7837", marker="s", zorder=3)
    for name, place in zip(picture.labels, picture.holes, strict=False):
        axes.annotate(
            name, place, xytext=(4, 4), textcoords="offset points", fontsize=7, parse_math=False
        )
    axes.set_title(f"{picture.title}\n{picture.subtitle}", fontsize=10, parse_math=False)
    axes.set_aspect("equal")
    image = io.BytesIO()
    figure.savefig(image, format="png", dpi=120)
    return image.getvalue()
