"""Circles and points of a DXF drawing as holes, by layer and diameter (needs ``ezdxf``)."""

from __future__ import annotations

import math
import re
from fractions import Fraction
from pathlib import Path
from typing import Any

from tcp.errors import InputError, UsageError, system_reason
from tcp.files.layered import STEP, Drill, reading
from tcp.files.reading import Reading
from tcp.files.text import read_bounded
from tcp.words import counted

MM = {
    1: Fraction(254, 10),  # inches
    2: Fraction(3048, 10),  # feet
    4: Fraction(1),  # millimetres
    5: Fraction(10),  # centimetres
    6: Fraction(1000),  # metres
    8: Fraction(254, 10**7),  # microinches
    9: Fraction(254, 10**4),  # mils
    10: Fraction(9144, 10),  # yards
    12: Fraction(1, 10**6),  # nanometres
    13: Fraction(1, 1000),  # micrometres
    14: Fraction(100),  # decimetres
}
"""Millimetres to the unit, by ``$INSUNITS``; 0 states none."""

_STATES_UNITS = re.compile(rb"\b9\s+\$INSUNITS\b|\t\0?\$INSUNITS\0")
"""Group 9 names a variable of the header, in text or in a binary drawing."""

ROUND = 1e-6
"""An arc within so many turns of a full one, or an ellipse's axes so alike, are round."""


def read(path: Path, *, units: str | None = None, tool: str | int | None = None) -> Reading:
    """The holes of one tool (layer and diameter) of a drawing; see :func:`tcp.files.read`.

    Raises
    ------
    UsageError
        If ``ezdxf`` is not installed.
    InputError
        If the file is no DXF, states no units, or has no circles or points.
    """
    try:
        import ezdxf
    except ImportError:
        raise UsageError("DXF needs ezdxf: pip install 'tcp-drill[dxf]'") from None
    try:
        drawing = ezdxf.readfile(path)
        space = drawing.modelspace()
        found = [_circle(entity) for entity in space.query("CIRCLE POINT")]
        notes = _left_out(space)
    except InputError as error:
        raise InputError(str(error), path) from None
    except OSError as error:
        if error.errno is None:  # how ezdxf says it
            raise InputError("is no DXF drawing", path) from None
        raise InputError(f"cannot be read: {system_reason(error)}", path) from None
    except Exception as error:  # ezdxf's parser raises whatever it stumbles over
        reason = " ".join(str(error).split())[:200] or "it may be cut off"
        raise InputError(f"is no DXF drawing: {reason}", path) from None
    # Where there is no header, ezdxf makes one up, in metres.
    code = drawing.header.get("$INSUNITS", 0) if _STATES_UNITS.search(read_bounded(path)) else 0
    stated = MM.get(code)
    asked = None if units is None else MM[1 if units == "inch" else 4]
    if stated is None and code != 0:
        raise InputError(f"the drawing's units ($INSUNITS {code}) are none of a workpiece", path)
    if stated is None and asked is None:
        raise InputError("the drawing does not state its units; pass --units mm or inch", path)
    if stated is not None and asked is not None and stated != asked:
        raise InputError(f"the drawing states other units than --units {units}", path)
    if not all(math.isfinite(value) for circle in found for value in circle[:3]):
        raise InputError("a circle or point has no finite place or radius", path)
    unit = stated or asked or Fraction(1)
    drills = [
        Drill(_nm(x, unit), _nm(y, unit), 2 * _nm(radius, unit) * STEP, layer)
        for x, y, radius, layer in found
    ]
    return reading(path, drills, tool, notes)


def _left_out(space: Any) -> list[str]:
    """Notes on what may be holes too."""
    blocks = sum(map(_holds_circles, space.query("INSERT")))
    arcs = sum(map(_comes_round, space.query("ARC ELLIPSE")))
    notes = []
    if blocks:
        references = counted(blocks, "block reference")
        notes.append(f"{references} with circles or points left out; explode them")
    if arcs:
        circles = counted(arcs, "full circle")
        notes.append(f"{circles} drawn as arc or ellipse left out; draw circles")
    return notes


def _holds_circles(insert: Any) -> bool:
    """Whether there is a circle or point in a block, or in one that it refers to."""
    return any(
        _holds_circles(entity)
        if entity.dxftype() == "INSERT"
        else entity.dxftype() in ("CIRCLE", "POINT") or _comes_round(entity)
        for entity in insert.virtual_entities()
    )


def _comes_round(entity: Any) -> bool:
    """Whether it is an arc or ellipse that is a circle, to the digits that drawings have."""
    if entity.dxftype() == "ARC":
        turns: float = (entity.dxf.end_angle - entity.dxf.start_angle) / 360
    elif entity.dxftype() == "ELLIPSE" and abs(abs(entity.dxf.ratio) - 1) < ROUND:
        turns = (entity.dxf.end_param - entity.dxf.start_param) / math.tau
    else:
        return False
    return turns == 0 or abs(abs(turns) - 1) < ROUND


def _circle(entity: Any) -> tuple[float, float, float, str]:
    """Centre, radius and layer of a circle; a point is one without extent."""
    layer = str(entity.dxf.layer)
    if entity.dxftype() == "POINT":
        return entity.dxf.location.x, entity.dxf.location.y, 0.0, layer
    if abs(entity.dxf.extrusion.z) != 1:
        raise InputError("a circle does not lie in the drawing's plane")
    place = entity.ocs().to_wcs(entity.dxf.center)  # mirrored where it is seen from below
    radius = entity.dxf.radius
    if radius <= 0:
        at = f"{place.x:g} {place.y:g}"
        raise InputError(f"the circle at {at} has a radius of {radius:g}; expected more than 0")
    return place.x, place.y, radius, layer


def _nm(value: float, unit: Fraction) -> int:
    """A drawing's number (a double) in whole nanometres."""
    return round(Fraction(value) * unit / STEP)
