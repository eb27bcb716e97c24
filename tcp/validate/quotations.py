"""Claims against each other: quotations, parameters, coordinates that two papers print."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from fractions import Fraction

from tcp.errors import InputError
from tcp.files.claims import Claim
from tcp.files.order import order_of
from tcp.files.printed import Printed, parse_printed
from tcp.result import decimal
from tcp.validate.findings import Finding, finding
from tcp.workpiece import Workpiece

NAMED = 12
"""So many differing holes are named."""


def quotation_findings(
    claim: Claim, claims: Mapping[str, Claim], piece: Workpiece | None
) -> list[Finding]:
    """Findings 601 to 603, 607, 608 and 610: a claim against the claim it quotes."""
    quoted = claim.text("quotes")
    if not quoted:
        return []
    source = claims.get(quoted)
    if source is None:
        return [finding("TCP608", f"the quoted claim {quoted} is not among the audited files")]
    if source is claim:
        raise InputError(f"quotes itself, {quoted}")
    compared = [
        *_parameters(claim, source),
        *_figures(claim, source),
        *_sequences(claim, source, piece),
    ]
    if not compared:
        return [finding("TCP610", f"has no parameter, figure or sequence in common with {quoted}")]
    found = [difference for difference in compared if difference is not None]
    return found or [finding("TCP607", f"repeats {quoted} faithfully")]


def same(a: Printed, b: Printed) -> bool:
    """Whether one printed figure is the other, or the other rounded."""
    return a.agreement(b.value).holds or b.agreement(a.value).holds


def _parameters(claim: Claim, source: Claim) -> list[Finding | None]:
    """Of each parameter that both have the difference, None where they agree."""
    mine, theirs = claim.values.get("values", {}), source.values.get("values", {})
    return [
        None
        if _same_text(mine[name], theirs[name])
        else finding(
            "TCP601",
            f"{name} is {mine[name]} here, but {theirs[name]} in {_place(source)}",
            parameter=name,
            here=mine[name],
            there=theirs[name],
        )
        for name in mine
        if name in theirs
    ]


def _same_text(a: str, b: str) -> bool:
    try:
        return same(parse_printed(a), parse_printed(b))
    except InputError:
        return _bare(a) == _bare(b)


def _bare(text: str) -> str:
    return re.sub(r"\s+", "", text).lower()


def _figures(claim: Claim, source: Claim) -> list[Finding | None]:
    found: list[Finding | None] = []
    for key, mine in claim.values.items():
        theirs = source.values.get(key)
        if isinstance(mine, Printed) and isinstance(theirs, Printed) and key not in ("vx", "vy"):
            different = not same(mine, theirs)
        elif key in ("runs", "population", "generations") and theirs is not None:
            different = mine != theirs
        else:
            continue
        text = f"{_words(key)} is {mine} here, but {theirs} in {_place(source)}"
        misquoted = finding("TCP602", text, key=key, here=str(mine), there=str(theirs))
        found.append(misquoted if different else None)
    return found


def _place(claim: Claim) -> str:
    return f"{claim.key} ({claim.text('where')})"


def _words(key: str) -> str:
    return key.replace("_", " ")


def _sequences(claim: Claim, source: Claim, piece: Workpiece | None) -> list[Finding | None]:
    mine, theirs = claim.values.get("sequence"), source.values.get("sequence")
    if mine is None or theirs is None or piece is None:
        return []
    a = order_of(mine, piece, claim.text("numbering") or "ids")
    b = order_of(theirs, piece, source.text("numbering") or "ids")
    if len(a) == len(b) and a.unknown == b.unknown and bool((a.entries == b.entries).all()):
        return [None]
    text = f"{len(a)} entries here, {len(b)} in {source.key}"
    if len(a) == len(b):
        places = [k + 1 for k in range(len(a)) if a.entries[k] != b.entries[k]][:NAMED]
        text = f"the sequence differs from {source.key} at places {', '.join(map(str, places))}"
    return [finding("TCP603", text)]


def subject_findings(claims: Iterable[Claim]) -> dict[str, list[Finding]]:
    """Finding 604, by claim: figures that two sources give differently for one subject."""
    groups: dict[str, list[Claim]] = {}
    for claim in claims:
        if claim.text("subject"):
            groups.setdefault(claim.text("subject"), []).append(claim)
    found: dict[str, list[Finding]] = {}
    for subject, group in groups.items():
        for k, claim in enumerate(group):
            for other in group[:k]:
                if other.source != claim.source:
                    found.setdefault(claim.key, []).extend(_differing(subject, claim, other))
    return found


def _differing(subject: str, claim: Claim, other: Claim) -> list[Finding]:
    found = []
    for key, mine in claim.values.items():
        theirs = other.values.get(key)
        if not (isinstance(mine, Printed) and isinstance(theirs, Printed)) or same(mine, theirs):
            continue
        text = (
            f"{subject}: {_words(key)} is {mine} here{_cited(claim)}, but {theirs} in "
            f"{other.key}{_cited(other)}"
        )
        found.append(finding("TCP604", text, key=key, here=mine.text, there=theirs.text))
    return found


def _cited(claim: Claim) -> str:
    return f" (citing {claim.text('cites')})" if claim.text("cites") else ""


def workpiece_findings(
    claim: Claim, piece: Workpiece, claims: Mapping[str, Claim], pieces: Mapping[str, Workpiece]
) -> list[Finding]:
    """Findings 605, 702, 703 and 608: a workpiece against what is said about it."""
    found, stated = [], claim.values.get("stated_holes")
    if stated is not None and stated != len(piece):
        text = f"the text speaks of {stated} holes, the workpiece has {len(piece)}"
        found.append(finding("TCP605", text, stated=stated, holes=len(piece)))
    other = claim.text("same_as")
    if not other:
        return found
    if other not in pieces:
        return [*found, finding("TCP608", f"the workpiece {other} is not among the audited files")]
    return found + _coordinates(claim, piece, pieces[other], claims[other])


def _coordinates(claim: Claim, piece: Workpiece, other: Workpiece, source: Claim) -> list[Finding]:
    """Hole by hole, after mirroring x or y at half the number that the claim states."""
    mirror_x, mirror_y = claim.number("mirror_x"), claim.number("mirror_y")
    different = []
    for k, name in enumerate(piece.ids):
        here = piece.hole(k)
        place = (_mirrored(here.x, mirror_x), _mirrored(here.y, mirror_y))
        if name not in other.index:
            different.append(f"{name} (absent there)")
            continue
        there = other.hole(other.index[name])
        if place != (there.x, there.y):
            different.append(
                f"{name} ({decimal(place[0])},{decimal(place[1])} here, "
                f"{decimal(there.x)},{decimal(there.y)} there)"
            )
    mirrored = " mirrored" if mirror_x is not None or mirror_y is not None else ""
    if not different:
        return [finding("TCP703", f"the same{mirrored} coordinates as {source.key}")]
    more = f" and {len(different) - NAMED} more" if len(different) > NAMED else ""
    text = (
        f"{len(different)} holes differ from{mirrored} {source.key}: {'; '.join(different[:NAMED])}"
    )
    return [finding("TCP702", text + more, holes=len(different))]


def _mirrored(value: Fraction, at: Printed | None) -> Fraction:
    return value if at is None else at.value - value
