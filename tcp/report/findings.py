"""Findings for people and programs: one audit, many formats.

Everything an audit shows may come from strangers: each format escapes what it
prints (control characters, markup, links), and none evaluates anything.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from typing import Any

from tcp.report.findings_pages import html_page, markdown_page
from tcp.report.findings_text import text_page
from tcp.report.findings_tools import junit, sarif
from tcp.result import decimal
from tcp.validate.auditing import Audit, Entry
from tcp.validate.codes import CODES
from tcp.validate.findings import Finding
from tcp.validate.repairs import Repair, Repairs

JSON_FORMAT = "tcp-audit-1"


def render(audit: Audit, name: str, *, strict: bool = False, details: str = "all") -> str:
    """An audit in a format.

    Parameters
    ----------
    audit : Audit
        The verdicts.
    name : str
        A key of :data:`FORMATS`.
    strict : bool
        Whether warnings fail, too.
    details : str
        ``all``, ``failing`` or ``none``: which claims get a detail page in text.
    """
    return FORMATS[name](audit, strict, details)


def json_page(audit: Audit) -> str:
    """The audit as one JSON object."""
    return json.dumps(data(audit), indent=2, ensure_ascii=False) + "\n"


def data(audit: Audit) -> dict[str, Any]:
    """The audit as plain data; times are exact decimal strings."""
    verdicts = Counter(entry.verdict for entry in audit.entries)
    codes = Counter(f.code for f in audit.findings)
    return {
        "format": JSON_FORMAT,
        "sources": list(audit.sources),
        "summary": {"claims": len(audit.entries), "verdicts": dict(verdicts), "codes": dict(codes)},
        "entries": [_entry(entry) for entry in audit.entries],
    }


def _entry(entry: Entry) -> dict[str, Any]:
    found = {
        "key": entry.key,
        "kind": entry.kind,
        "title": entry.title,
        "verdict": entry.verdict,
        "facts": dict(entry.facts),
        "findings": [_finding(f) for f in entry.findings],
    }
    return found | ({"repairs": _repairs(entry.repairs)} if entry.repairs else {})


def _finding(found: Finding) -> dict[str, Any]:
    place = found.location
    return {
        "code": found.code,
        "name": CODES[found.code].name,
        "severity": str(found.severity),
        "message": found.message,
        "path": place.path,
        "line": place.line,
        "claim": place.claim,
        "positions": list(place.positions),
        "data": dict(found.data),
    }


def _repairs(repairs: Repairs) -> dict[str, Any]:
    best = repairs.best
    return {
        "changes": repairs.changes,
        "total": repairs.total,
        "complete": repairs.complete,
        "smallest": [_repair(repairs, r) for r in repairs.smallest],
        "cheapest": None if best is None else _repair(repairs, best) | {"proof": "exact"},
        "refusal": repairs.refusal,
    }


def _repair(repairs: Repairs, one: Repair) -> dict[str, Any]:
    ids = repairs.instance.workpiece.ids
    return {
        "time": decimal(repairs.time(one)),
        "percent_above_bound": repairs.above(one),
        "edits": list(one.edits),
        "route": [ids[h] for h in one.route],
    }


FORMATS: dict[str, Callable[[Audit, bool, str], str]] = {
    "text": lambda audit, strict, details: text_page(audit, details),
    "json": lambda audit, strict, details: json_page(audit),
    "junit": lambda audit, strict, details: junit(audit, strict),
    "sarif": lambda audit, strict, details: sarif(audit),
    "markdown": lambda audit, strict, details: markdown_page(audit),
    "html": lambda audit, strict, details: html_page(audit),
}
"""Every output format of the judge."""
