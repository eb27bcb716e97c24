"""Routes as files: CSV with coordinates, and TSPLIB tours."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from tcp.files.order import numbered
from tcp.result import decimal
from tcp.workpiece import Ints, Workpiece

MAX_PLACES = 30
"""Steps with more decimal places than this are printed one by one."""


def route_csv(workpiece: Workpiece, route: Sequence[int], remarks: Sequence[str] = ()) -> str:
    """A route as CSV: one row per hole in drilling order, in mm; ``tcp`` reads it back.

    Parameters
    ----------
    workpiece : Workpiece
        The holes.
    route : sequence of int
        Holes in drilling order, by position.
    remarks : sequence of str
        Lines of comment for the top.
    """
    text = io.StringIO()
    text.writelines(f"# {' '.join(remark.split())}\n" for remark in remarks)
    rows = csv.writer(text, lineterminator="\n")
    if any(name.startswith("#") for name in workpiece.ids):  # unquoted, it would be a comment
        rows = csv.writer(text, lineterminator="\n", quoting=csv.QUOTE_ALL)
    sized, tooled = bool(workpiece.diameters), bool(workpiece.tools)
    rows.writerow(["id", "x_mm", "y_mm", *["diameter_mm"] * sized, *["tool"] * tooled])
    order = np.asarray(route, dtype=np.int64)
    x = in_millimetres(workpiece.x[order], workpiece.step)
    y = in_millimetres(workpiece.y[order], workpiece.step)
    for i, *row in zip(order.tolist(), x, y, strict=True):
        row.insert(0, workpiece.ids[i])
        if sized:
            diameter = workpiece.diameters[i]
            row.append("" if diameter is None else decimal(diameter))
        if tooled:
            row.append(workpiece.tools[i] or "")
        rows.writerow(row)
    return text.getvalue()


def in_millimetres(steps: Ints, step: Fraction) -> list[str]:
    """Coordinates in steps as exact decimal strings; a million in a second or two."""
    places = 0
    while places < MAX_PLACES and (step * 10**places).denominator > 1:
        places += 1
    unit = step * 10**places
    if places == 0 or unit.denominator > 1:
        return [decimal(v * step) for v in steps.tolist()]
    texts = []
    for value in steps.tolist():
        digits = f"{abs(value) * unit.numerator:0{places + 1}d}"
        text = f"{digits[:-places]}.{digits[-places:]}".rstrip("0").rstrip(".")
        texts.append(f"-{text}" if value < 0 else text)
    return texts


def route_tour(workpiece: Workpiece, route: Sequence[int], remarks: Sequence[str] = ()) -> str:
    """A route as a TSPLIB tour: nodes by their ids if all of these are numbers, else from 1.

    TSPLIB knows only closed tours; an open path is written from its first to
    its last hole, and a comment says so.
    """
    lines = [f"NAME : {workpiece.name}.tour"]
    lines += [f"COMMENT : {' '.join(remark.split())}" for remark in remarks]
    lines += ["TYPE : TOUR", f"DIMENSION : {len(workpiece)}", "TOUR_SECTION"]
    own = numbered(workpiece)
    lines += [workpiece.ids[i] if own else str(i + 1) for i in route]
    return "\n".join([*lines, "-1", "EOF", ""])
