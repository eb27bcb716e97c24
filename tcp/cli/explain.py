"""``tcp explain``: the page of a finding's code."""

from __future__ import annotations

import difflib

import click

from tcp.errors import UsageError
from tcp.validate.codes import CODES, catalogue, page

EPILOG = """\b
Examples:
  tcp explain TCP303
  tcp explain --all
  tcp explain --all --markdown > docs/findings.md"""


@click.command(epilog=EPILOG)
@click.argument("codes", nargs=-1, metavar="CODE...")
@click.option("--all", "everything", is_flag=True, help="Every code, one line each.")
@click.option("--markdown", is_flag=True, help="With --all: every page, as Markdown.")
def command(codes: tuple[str, ...], everything: bool, markdown: bool) -> None:
    """Explain what the findings with CODE mean, how they are decided, and what to do."""
    if markdown and not everything:
        raise UsageError("--markdown is for --all")
    if everything and codes:
        raise UsageError("--all explains every code; drop it, or the codes")
    if everything:
        lines = [f"{c}  {e.severity:<8} {e.summary}" for c, e in CODES.items()]
        click.echo(catalogue() if markdown else "\n".join(lines), nl=not markdown)
        return
    if not codes:
        raise UsageError("name a code such as TCP303, or --all")
    for code in codes:
        name = code.upper()
        if name not in CODES:
            near = difflib.get_close_matches(name, CODES, n=1)
            hint = f"; did you mean {near[0]}?" if near else "; tcp explain --all lists them"
            raise UsageError(f"there is no code {code!r}{hint}")
        click.echo(page(name))
