"""``tcp check``: does a certificate prove what it claims, and is it about my workpiece?"""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import click

from tcp.cli.options import READ, Problem, problem_options
from tcp.cli.terminal import tell
from tcp.errors import Exit
from tcp.validate import certificate as checker

EPILOG = """\b
Examples:
  tcp check wp3.cert.json
  tcp check wp3.cert.json.gz data/wp3.csv
  tcp check wp3.cert.json data/wp3.csv --travel case2 --start 49

\b
Exit codes: 0 verified, 1 refuted (or about something else), 2 usage,
3 malformed or unreadable, 6 unsupported version, 70 internal error."""

FIRST = "the first argument must be a certificate, a JSON file as --certificate writes it"


@click.command(epilog=EPILOG)
@click.argument("certificate", type=READ)
@click.argument("workpiece", required=False, type=READ)
@problem_options
@click.option("--json", "as_json", is_flag=True, help="One JSON object instead of sentences.")
def command(problem: Problem, certificate: Path, workpiece: Path | None, as_json: bool) -> int:
    """Check the proof in CERTIFICATE in exact arithmetic, trusting nothing that wrote it.

    With WORKPIECE, it must be about exactly these holes; with options, about
    exactly this travel model, these ends and rules.
    """
    asked = problem.asks
    if asked and workpiece is None:
        raise click.UsageError("options say what WORKPIECE means; give the file too")
    try:
        raw = checker.unzip(certificate)
        checker.demand(raw.lstrip()[:1] == b"{", FIRST)
        holes, sha256 = _about(problem, workpiece, asked) if workpiece else (None, None)
        verdict = checker.check(raw, holes, sha256)
    except checker.Failure as failure:
        if as_json:
            click.echo(json.dumps({"verdict": failure.word, "reason": str(failure)}))
        else:
            click.echo(f"tcp: {certificate}: {failure.word}: {failure}", err=True)
        return Exit(failure.code)
    if as_json:
        click.echo(json.dumps({"verdict": "verified", **verdict._asdict()}))
        return Exit.OK
    click.echo(f"verified: {verdict.statement}\nsha256 {verdict.sha256}")
    click.echo(checker.TRUST + (checker.YOURS if holes is None else "."))
    return Exit.OK


def _about(
    problem: Problem, workpiece: Path, asked: bool
) -> tuple[list[tuple[str, Fraction, Fraction]], str | None]:
    """Holes of the workpiece, and the instance's hash where more than the holes was said."""
    reading = problem.read(workpiece)
    tell(workpiece, reading.notes)
    piece = reading.workpiece
    holes = [(h.id, h.x, h.y) for h in map(piece.hole, range(len(piece)))]
    said = asked or piece.matrix is not None
    return holes, problem.instance(reading).sha256 if said else None
