"""An audit as a page: Markdown for repositories, HTML for browsers.  All text is escaped."""

from __future__ import annotations

import re
from html import escape

from tcp.report.findings_text import plain, repair_lines, row, summary
from tcp.validate.auditing import Audit, Entry
from tcp.validate.codes import CODES

_COLUMNS = ("Verdict", "Claim", "Where", "Claimed", "Recomputed", "Certified", "Codes")
_SPECIAL = re.compile(r"([\\`*_{}\[\]()#+!|~<>&-])")

_STYLE = """
body{font:15px/1.45 system-ui,sans-serif;max-width:70em;margin:2em auto;padding:0 1em;color:#1c2733}
table{border-collapse:collapse;width:100%;font-size:13px}td,th{border:1px solid #d5dce3;
padding:.3em .5em;text-align:left;vertical-align:top}th{background:#f1f4f7}
.refuted{color:#a3172a;font-weight:600}.doubtful{color:#8a5a00;font-weight:600}.holds{color:#17663a}
.error{border-left:4px solid #a3172a}.warning{border-left:4px solid #d08a00}.note{border-left:4px
solid #9fb0bf}li{list-style:none;margin:.2em 0;padding-left:.6em}ul{padding-left:0}
code{background:#f1f4f7;padding:0 .2em;overflow-wrap:anywhere}h3{margin-top:1.8em}
"""


def markdown(text: str) -> str:
    """Text without any meaning in Markdown."""
    return _SPECIAL.sub(r"\\\1", plain(text))


def markdown_page(audit: Audit) -> str:
    """The audit as Markdown: sources, verdict table, a section per claim."""
    parts = ["# Audit of published claims\n", f"{summary(audit)}.\n"]
    parts += [f"* {markdown(source)}" for source in audit.sources]
    parts += ["\n## Verdicts\n", f"| {' | '.join(_COLUMNS)} |", "|---" * len(_COLUMNS) + "|"]
    parts += [_markdown_row(entry) for entry in audit.entries]
    parts.append("\n## Claims\n")
    parts += [_markdown_entry(entry) for entry in audit.entries]
    parts.append("## Codes\n")
    codes = sorted({f.code for f in audit.findings})
    parts += [f"* **{code}** {CODES[code].summary}" for code in codes]
    return "\n".join(parts) + "\n"


def _markdown_row(entry: Entry) -> str:
    verdict, key, claimed, recomputed, certified, codes = (markdown(c) for c in row(entry))
    cells = (f"**{verdict}**", key, markdown(entry.title), claimed, recomputed, certified, codes)
    return f"| {' | '.join(cells)} |"


def _markdown_entry(entry: Entry) -> str:
    lines = [f"### {markdown(entry.key)}\n", f"{markdown(entry.title)}: **{entry.verdict}**\n"]
    lines += [f"* {markdown(label)}: {markdown(shown)}" for label, shown in entry.facts.items()]
    for found in entry.findings:
        place = f" (line {found.location.line})" if found.location.line else ""
        lines.append(f"* {found.code} {found.severity}: {markdown(found.message)}{place}")
    if entry.repairs is not None:
        lines += [f"* {markdown(line.strip())}" for line in repair_lines(entry.repairs)]
    return "\n".join([*lines, ""])


def html_page(audit: Audit) -> str:
    """The audit as one self-contained page without scripts."""
    head = "".join(f"<th>{name}</th>" for name in _COLUMNS)
    rows = "".join(_html_row(entry) for entry in audit.entries)
    sources = "".join(f"<li>{_text(source)}</li>" for source in audit.sources)
    pages = "".join(_html_entry(entry) for entry in audit.entries)
    policy = "default-src 'none'; style-src 'unsafe-inline'"
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        f"<title>Audit of published claims</title><style>{_STYLE}</style></head><body>"
        f"<h1>Audit of published claims</h1><p>{_text(summary(audit))}.</p><ul>{sources}</ul>"
        f"<h2>Verdicts</h2><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
        f"<h2>Claims</h2>{pages}</body></html>\n"
    )


def _text(text: str) -> str:
    return escape(plain(text), quote=True)


def _html_row(entry: Entry) -> str:
    verdict, key, claimed, recomputed, certified, codes = (_text(c) for c in row(entry))
    link = f'<a href="#{_anchor(entry.key)}">{key}</a>'
    cells = (link, _text(entry.title), claimed, recomputed, certified, codes)
    rest = "".join(f"<td>{cell}</td>" for cell in cells)
    return f'<tr><td class="{verdict}">{verdict}</td>{rest}</tr>'


def _anchor(key: str) -> str:
    return re.sub(r"[^A-Za-z0-9_.-]", "-", key)


def _html_entry(entry: Entry) -> str:
    facts = "".join(
        f"<li>{_text(label)}: <code>{_text(shown)}</code></li>"
        for label, shown in entry.facts.items()
    )
    found = "".join(
        f'<li class="{f.severity}"><strong>{f.code}</strong> {_text(f.message)}</li>'
        for f in entry.findings
    )
    mended = ""
    if entry.repairs is not None:
        mended = "".join(f"<li>{_text(line.strip())}</li>" for line in repair_lines(entry.repairs))
    return (
        f'<h3 id="{_anchor(entry.key)}">{_text(entry.key)}: '
        f'<span class="{entry.verdict}">{entry.verdict}</span></h3>'
        f"<p>{_text(entry.title)}</p><ul>{facts}</ul><ul>{found}{mended}</ul>"
    )
