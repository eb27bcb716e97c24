"""Drilled holes of a KiCad board (``.kicad_pcb``): pads and vias, plated or not.

Vias that do not go through the board are drilled by themselves, one pair of
layers after the other; they make tools of their own.

The file is an S-expression.  A pad's position is turned with its footprint;
turns by quarters are exact, others are rounded to KiCad's nanometre.  Y is
turned up, as in KiCad's own drill files.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

from tcp.errors import InputError, TcpError
from tcp.files.layered import STEP, Drill, reading
from tcp.files.reading import Reading
from tcp.files.text import read_bounded
from tcp.words import counted, shown
from tcp.workpiece import exact_decimal

_TOKEN = re.compile(r'\s*(?:([()])|"((?:[^"\\]|\\.)*)"|([^\s()"]+))')
DEEPEST = 200

Node = list[Any]


def read(path: Path, *, units: str | None = None, tool: str | int | None = None) -> Reading:
    """The holes of one tool of a KiCad board; see :func:`tcp.files.read`.

    Raises
    ------
    InputError
        If the file is no KiCad board or holds no drilled hole.
    """
    if units == "inch":
        raise InputError("KiCad boards are in mm; drop --units", path)
    try:
        text = read_bounded(path).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("is not UTF-8 text; expected a KiCad board", path) from None
    if not text.strip():
        raise InputError("the file is empty; expected a KiCad board", path)
    board = _parse(text, path)
    if not board or board[0] != "kicad_pcb":
        raise InputError("is no KiCad board; expected (kicad_pcb ...)", path)
    try:
        found = list(_drills(board))
    except (TcpError, IndexError, TypeError, ValueError) as error:
        raise InputError(f"a pad or via is not understood: {error}", path) from None
    slots = sum(oval for _, oval in found)
    notes = [f"{counted(slots, 'oval hole')} taken by the centre"] if slots else []
    return reading(path, [drill for drill, _ in found], tool, notes)


def _parse(text: str, path: Path) -> Node:
    """The file's one list, nested."""
    stack: list[Node] = [[]]
    at, size = 0, len(text.rstrip())
    while at < size:
        found = _TOKEN.match(text, at)
        if found is None or len(stack) > DEEPEST:
            raise InputError("is no S-expression", path, text.count("\n", 0, at) + 1)
        at = found.end()
        if found[1] == "(":
            stack.append([])
        elif found[1] == ")":
            done = stack.pop()
            if not stack:
                raise InputError("closes more than it opens", path, text.count("\n", 0, at) + 1)
            stack[-1].append(done)
        else:
            stack[-1].append(found[3] if found[2] is None else found[2])
    if len(stack) != 1:
        raise InputError("is cut off: a bracket is not closed", path)
    board = stack[0][0]
    if len(stack[0]) != 1 or not isinstance(board, list):
        raise InputError("is no KiCad board; expected one list (kicad_pcb ...)", path)
    return board


def _children(node: Node, name: str) -> Iterator[Node]:
    return (child for child in node if isinstance(child, list) and child and child[0] == name)


def _child(node: Node, name: str) -> Node | None:
    return next(_children(node, name), None)


def _drills(board: Node) -> Iterator[tuple[Drill, bool]]:
    """Every drilled hole, and whether it is oval."""
    usual = _via_drills(board)
    for via in _children(board, "via"):
        at, drill, net = _child(via, "at"), _child(via, "drill"), _child(via, "net")
        if at is None:
            continue
        size = drill[1] if drill and _mm(drill[1]) else usual.get(str(net[1]) if net else "")
        if size is None:
            raise InputError(f"the via at {at[1]} {at[2]} has no drill, nor has its net class")
        yield Drill(_nm(at[1]), -_nm(at[2]), _diameter(size), _depth(via)), False
    for name in ("footprint", "module"):
        for footprint in _children(board, name):
            origin = _child(footprint, "at") or ["at", "0", "0"]
            turn = _mm(origin[3]) if len(origin) > 3 else Fraction(0)
            for pad in _children(footprint, "pad"):
                drill, at = _child(pad, "drill"), _child(pad, "at")
                sizes = [w for w in (drill or [])[1:] if isinstance(w, str) and w != "oval"]
                if drill is None or at is None or not sizes or not _mm(sizes[0]):
                    continue
                x, y = _turned(_nm(at[1]), _nm(at[2]), turn)
                plated = "non-plated" if pad[2] == "np_thru_hole" else "plated"
                place = _nm(origin[1]) + x, -(_nm(origin[2]) + y)
                yield Drill(*place, _diameter(sizes[0]), plated), "oval" in drill


def _depth(via: Node) -> str:
    """What a via is drilled with: all that goes through, or its own pair of layers."""
    layers = _child(via, "layers")
    through = not {"blind", "buried", "micro"} & {word for word in via if isinstance(word, str)}
    return "plated" if through or layers is None else " to ".join(map(str, layers[1:]))


def _via_drills(board: Node) -> dict[str, Any]:
    """The drill of a net's vias that state none (KiCad 5 and before), by the net's number."""
    names = {str(net[2]): str(net[1]) for net in _children(board, "net") if len(net) > 2}
    found: dict[str, Any] = {}
    for group in _children(board, "net_class"):
        drill = _child(group, "via_drill")
        for net in _children(group, "add_net"):
            if drill is not None and str(net[1]) in names:
                found[names[str(net[1])]] = drill[1]
    return found


def _turned(x: int, y: int, degrees: Fraction) -> tuple[int, int]:
    """A point turned about the origin as KiCad does (y down, counter-clockwise)."""
    quarters = degrees / 90
    if quarters.denominator == 1:
        for _ in range(int(quarters) % 4):
            x, y = y, -x
        return x, y
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return round(x * c + y * s), round(-x * s + y * c)


def _mm(text: str) -> Fraction:
    return Fraction(exact_decimal(text))


def _diameter(text: str) -> Fraction:
    size = _mm(text)
    if size < 0:
        raise InputError(f"a drill of {shown(text)} mm; expected 0 (no hole) or more")
    return size


def _nm(text: str) -> int:
    return round(_mm(text) / STEP)
