"""Routes as files: CSV with coordinates, and TSPLIB tours."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from tcp.result import decimal
from tcp.workpiece import Workpiece


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
    for i in route:
        hole = workpiece.hole(i)
        row = [hole.id, decimal(hole.x), decimal(hole.y)]
        if sized:
            row.append("" if hole.diameter is None else decimal(hole.diameter))
        if tooled:
            row.append(hole.tool or "")
        rows.writerow(row)
    return text.getvalue()


def route_tour(workpiece: Workpiece, route: Sequence[int], remarks: Sequence[str] = ()) -> str:
    """A route as a TSPLIB tour: nodes by their number in the file, from 1.

    TSPLIB knows only closed tours; an open path is written from its first to
    its last hole, and a comment says so.
    """
    lines = [f"NAME : {workpiece.name}.tour"]
    lines += [f"COMMENT : {' '.join(remark.split())}" for remark in remarks]
    lines += ["TYPE : TOUR", f"DIMENSION : {len(workpiece)}", "TOUR_SECTION"]
    lines += [str(i + 1) for i in route]
    return "\n".join([*lines, "-1", "EOF", ""])
