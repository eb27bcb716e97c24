"""``tcp audit``: judge every claim of whole papers."""

from __future__ import annotations

import json
from pathlib import Path

import click

from tcp.cli.judging import Judging, judging_options
from tcp.cli.options import READ
from tcp.errors import UsageError
from tcp.files.claims_schema import schema
from tcp.validate.auditing import audit

EPILOG = """\b
Examples:
  tcp audit data/claims/*.toml
  tcp audit data/claims/*.toml --suspect
  tcp audit data/claims/*.toml --suspect --format markdown --out docs/audit.md
  tcp audit claims.toml --strict --ignore TCP701 --format sarif --out findings.sarif

\b
Exit codes: 0 all hold, 1 findings of severity error (with --strict also
warnings), 2 usage, 3 unreadable or invalid input, 70 internal error.
docs/claims.md describes claims files; tcp explain CODE explains a finding."""


@click.command(epilog=EPILOG)
@click.argument("files", nargs=-1, metavar="CLAIMS.toml...", type=READ)
@click.option(
    "--details",
    type=click.Choice(("all", "failing", "none")),
    default="all",
    show_default=True,
    help="Which claims get a detail page in text output.",
)
@click.option(
    "--suspect", is_flag=True, help="Look for one misprinted coordinate that explains a claim."
)
@click.option("--schema", "show_schema", is_flag=True, help="Print the JSON Schema of claims.")
@judging_options("--format", "--report")
def command(
    judging: Judging, files: tuple[Path, ...], details: str, suspect: bool, show_schema: bool
) -> int:
    """Judge every claim in CLAIMS.toml files, against itself and each other."""
    if show_schema:
        click.echo(json.dumps(schema(), indent=2))
        return 0
    if not files:
        raise UsageError("name one or more claims files, such as data/claims/*.toml")
    judging.check_out(*files)
    found = audit(
        files, knowledge=judging.knowledge(*files), ignore=judging.codes(), suspect=suspect
    )
    return judging.report(found, files, details)
