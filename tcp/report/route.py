"""The route of a result as a file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import tcp
from tcp.errors import UsageError
from tcp.files.route import route_csv, route_tour
from tcp.files.write import write_file
from tcp.report.table import describe
from tcp.result import Result, decimal

WRITERS = {".csv": route_csv, ".tour": route_tour}


def save_route(result: Result, path: Path, like: Sequence[Path] = ()) -> None:
    """Write the route as CSV, or as a TSPLIB tour where the name ends in ``.tour``.

    It is kept from whom any of the files ``like`` is kept from.

    Raises
    ------
    UsageError
        For any other suffix, or a result without a route.
    OutputError
        If the file cannot be written.
    """
    if path.suffix.lower() not in WRITERS:
        raise UsageError(f"{path}: routes are written as {' or '.join(WRITERS)}")
    if result.route is None or result.time is None:
        raise UsageError(f"{result.instance.name} has no route to write")
    bound = "unknown" if result.lower_bound is None else decimal(result.lower_bound)
    remarks = [
        f"route of {result.instance.name} by tcp {tcp.__version__}, {result.solver}",
        f"{describe(result.instance)}: {decimal(result.time)}, lower bound {bound}",
        f"{result.status}, proof {result.proof}, instance {result.instance.sha256}",
    ]
    text = WRITERS[path.suffix.lower()](result.instance.workpiece, result.route, remarks)
    write_file(path, text, like=like)
