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
from contextlib import contextmanager
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


class Node(list[Any]):
    """A list of the file: its name, its words and the lists in it."""

    line = 1
    """Where it opens."""


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
    found = list(_drills(board, path))
    slots = sum(oval for _, oval in found)
    notes = [f"{counted(slots, 'oval hole')} taken by the centre"] if slots else []
    return reading(path, [drill for drill, _ in found], tool, notes)


def _parse(text: str, path: Path) -> Node:
    """The file's one list, nested."""
    stack = [Node()]
    at, line, size = 0, 1, len(text.rstrip())
    while at < size:
        found = _TOKEN.match(text, at)
        if found is None or len(stack) > DEEPEST:
            raise InputError("is no S-expression", path, line)
        line += text.count("\n", at, found.end())
        at = found.end()
        if found[1] == "(":
            stack.append(Node())
            stack[-1].line = line
        elif found[1] == ")":
            done = stack.pop()
            if not stack:
                raise InputError("closes more than it opens", path, line)
            stack[-1].append(done)
        else:
            stack[-1].append(found[3] if found[2] is None else found[2])
    if len(stack) != 1:
        raise InputError("is cut off: a bracket is not closed", path)
    board = stack[0][0]
    if len(stack[0]) != 1 or not isinstance(board, Node):
        raise InputError("is no KiCad board; expected one list (kicad_pcb ...)", path)
    return board


def _children(node: Node, name: str) -> Iterator[Node]:
    return (child for child in node if isinstance(child, Node) and child and child[0] == name)


def _child(node: Node, name: str) -> Node | None:
    return next(_children(node, name), None)


def _words(node: Node | None) -> list[str]:
    """What a list says after its name, without the lists in it."""
    return [word for word in (node or [])[1:] if isinstance(word, str)]


def _drills(board: Node, path: Path) -> Iterator[tuple[Drill, bool]]:
    """Every drilled hole, and whether it is oval."""
    usual = _via_drills(board)
    for via in _children(board, "via"):
        with _named(via, path):
            drill = _via(via, usual)
        yield drill, False
    for name in ("footprint", "module"):
        for footprint in _children(board, name):
            for pad in _children(footprint, "pad"):
                with _named(pad, path):
                    found = _pad(pad, footprint)
                if found is not None:
                    yield found, "oval" in _words(_child(pad, "drill"))


@contextmanager
def _named(node: Node, path: Path) -> Iterator[None]:
    """Errors name the pad or via, and its line."""
    try:
        yield
    except TcpError as error:
        raise InputError(f"a {node[0]} is not understood: {error}", path, node.line) from None


def _via(via: Node, usual: dict[str, str]) -> Drill:
    """A via's hole."""
    x, y, *_ = _place(via)
    net = _words(_child(via, "net")) or [""]
    size = _size(via) or usual.get(net[0])
    if size is None:
        raise InputError(f"the via at {x} {y} has no drill, nor has its net class")
    return Drill(_nm(x), -_nm(y), _diameter(size), _depth(via))


def _pad(pad: Node, footprint: Node) -> Drill | None:
    """A pad's hole, if it has one."""
    size = _size(pad)
    if size is None:
        return None
    at, origin = _place(pad), _place(footprint)
    turn = _mm(origin[2]) if len(origin) > 2 else Fraction(0)
    x, y = _turned(_nm(at[0]), _nm(at[1]), turn)
    plated = "non-plated" if pad[2:3] == ["np_thru_hole"] else "plated"
    return Drill(_nm(origin[0]) + x, -(_nm(origin[1]) + y), _diameter(size), plated)


def _place(node: Node) -> list[str]:
    """X, Y and the turn, if there is one."""
    at = _child(node, "at") or Node()
    if len(at) < 3 or len(_words(at)) < len(at) - 1:
        raise InputError(f"the {node[0]} has no place; expected (at X Y)")
    return _words(at)


def _size(node: Node) -> str | None:
    """The drill that a pad or via states; None for 0, or where it states none."""
    drill = _child(node, "drill")
    if drill is None:
        return None
    sizes = [word for word in _words(drill) if word != "oval"]
    if not sizes and _child(drill, "offset") is None:  # which pads without a hole may have
        raise InputError("the drill has no size; expected (drill D) or (drill oval W H)")
    return sizes[0] if sizes and _mm(sizes[0]) else None


def _depth(via: Node) -> str:
    """What a via is drilled with: all that goes through, or its own pair of layers."""
    layers = _child(via, "layers")
    through = not {"blind", "buried", "micro"} & {word for word in via if isinstance(word, str)}
    return "plated" if through or layers is None else " to ".join(map(str, layers[1:]))


def _via_drills(board: Node) -> dict[str, str]:
    """The drill of a net's vias that state none (KiCad 5 and before), by the net's number."""
    names = {str(net[2]): str(net[1]) for net in _children(board, "net") if len(net) > 2}
    found: dict[str, str] = {}
    for group in _children(board, "net_class"):
        drill = _words(_child(group, "via_drill"))
        for net in _children(group, "add_net"):
            for name in _words(net)[:1]:
                if drill and name in names:
                    found[names[name]] = drill[0]
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
