"""Which G- and M-codes the reader takes, and what becomes of the others."""

from __future__ import annotations

CYCLES = {"81", "82", "83", "73", "74", "84", "85", "86", "89"}
"""Canned cycles that work at X and Y and come back up: drilling, tapping, boring."""

STATE = {"17", "40", "94"}
LENGTH = {"43", "49"}
OFFSETS = {"54", "55", "56", "57", "58", "59", "59.1", "59.2", "59.3"}
GROUP = dict.fromkeys(OFFSETS, "offset") | dict.fromkeys(("61", "61.1", "64"), "path")
FIRST_OFFSET = "54"
"""Holds where a program names no work offset."""

ARCS = {"90.1", "91.1"}
HOME = {"28", "30", "53"}
AUXILIARY = {"0", "1", "3", "4", "5", "7", "8", "9"}

STRANGE = {
    "18": ("17", "drills in another plane"),
    "19": ("17", "drills in another plane"),
    "16": ("15", "makes places polar"),
    "12.1": ("13.1", "makes places polar"),
    "51": ("50", "scales places"),
    "68": ("69", "turns places"),
    "68.2": ("69", "tilts the plane"),
    "66": ("67", "calls a macro at every place"),
}
"""Codes that give X and Y another meaning: until which code, and what they do."""

PLAIN = {plain for plain, _ in STRANGE.values()}
