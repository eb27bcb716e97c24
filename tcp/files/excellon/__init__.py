"""Excellon drill files: lossless text, exact meaning, and a writer that only re-orders."""

from __future__ import annotations

from tcp.files.excellon.numbers import Digits, Units, Zeros, parse_digits
from tcp.files.excellon.piece import choose_tool, expanded, oddities, workpiece
from tcp.files.excellon.program import Kind, Mark, Program, Tool
from tcp.files.excellon.reader import parse, read_program
from tcp.files.excellon.settings import Hints

__all__ = [
    "Digits",
    "Hints",
    "Kind",
    "Mark",
    "Program",
    "Tool",
    "Units",
    "Zeros",
    "choose_tool",
    "expanded",
    "oddities",
    "parse",
    "parse_digits",
    "read_program",
    "workpiece",
]
