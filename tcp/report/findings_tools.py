"""An audit for other tools: JUnit XML for test dashboards, SARIF for code review."""

from __future__ import annotations

import json
import os
from pathlib import PurePath
from typing import Any
from urllib.parse import quote
from xml.sax.saxutils import escape, quoteattr

import tcp
from tcp.validate.auditing import Audit, Entry
from tcp.validate.codes import CODES
from tcp.validate.findings import Finding, Severity
from tcp.words import plain


def junit(audit: Audit, strict: bool) -> str:
    """JUnit XML: a suite per source, a test case per claim; errors fail, warnings if ``strict``."""
    suites: dict[str, list[Entry]] = {}
    for entry in audit.entries:
        suites.setdefault(entry.key.partition("#")[0], []).append(entry)
    parts = ['<?xml version="1.0" encoding="UTF-8"?>', "<testsuites>"]
    for name, entries in suites.items():
        failures = sum(bool(_failing(e, strict)) for e in entries)
        head = f'name={_attribute(name)} tests="{len(entries)}" failures="{failures}"'
        parts += [f"<testsuite {head}>", *(_case(e, strict) for e in entries), "</testsuite>"]
    return "\n".join([*parts, "</testsuites>", ""])


def _attribute(text: str) -> str:
    return quoteattr(plain(text))


def _failing(entry: Entry, strict: bool) -> list[Finding]:
    severe = {Severity.ERROR, Severity.WARNING} if strict else {Severity.ERROR}
    return [f for f in entry.findings if f.severity in severe]


def _case(entry: Entry, strict: bool) -> str:
    source, _, name = entry.key.partition("#")
    failing = _failing(entry, strict)
    body = [
        f"<failure type={_attribute(f.code)} message={_attribute(f.message)}>"
        f"{escape(plain(f'{f.location} {f.code} {f.message}'.strip()))}</failure>"
        for f in failing[:1]
    ]
    rest = [f for f in entry.findings if f not in failing[:1]]
    if rest:
        lines = "\n".join(plain(f"{f.code} {f.severity}: {f.message}") for f in rest)
        body.append(f"<system-out>{escape(lines)}</system-out>")
    head = f"classname={_attribute(source)} name={_attribute(name or source)}"
    return f"<testcase {head}>{''.join(body)}</testcase>"


def sarif(audit: Audit) -> str:
    """SARIF 2.1.0, as code review tools show it at the line."""
    used = sorted({f.code for f in audit.findings})
    driver = {
        "name": "tcp",
        "version": tcp.__version__,
        "rules": [_rule(code) for code in used],
    }
    results = [
        _result(entry, found, used.index(found.code))
        for entry in audit.entries
        for found in entry.findings
    ]
    log = {
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{"tool": {"driver": driver}, "results": results, "columnKind": "utf16CodeUnits"}],
    }
    return json.dumps(log, indent=2) + "\n"


def _rule(code: str) -> dict[str, Any]:
    entry = CODES[code]
    return {
        "id": code,
        "name": "".join(word.capitalize() for word in entry.name.split("-")),
        "shortDescription": {"text": entry.summary},
        "fullDescription": {"text": entry.why},
        "help": {"text": entry.remedy},
        "defaultConfiguration": {"level": entry.severity},
    }


def _result(entry: Entry, found: Finding, index: int) -> dict[str, Any]:
    place: dict[str, Any] = {
        "logicalLocations": [{"fullyQualifiedName": plain(entry.key), "kind": "member"}]
    }
    if found.location.path is not None:
        place["physicalLocation"] = {
            "artifactLocation": {"uri": _uri(found.location.path)},
            "region": {"startLine": found.location.line or 1},
        }
    return {
        "ruleId": found.code,
        "ruleIndex": index,
        "level": str(found.severity),
        "message": {"text": _no_links(plain(found.message))},
        "locations": [place],
    }


def _no_links(text: str) -> str:
    """Brackets in SARIF messages can make links; a backslash keeps them text."""
    return text.replace("\\", "\\\\").replace("[", "\\[").replace("]", "\\]")


def _uri(path: str) -> str:
    return quote(os.fsencode(PurePath(path).as_posix()))
