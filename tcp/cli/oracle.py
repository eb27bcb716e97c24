"""``tcp oracle``: optima with certificates, pinned beside tests."""

from __future__ import annotations

from pathlib import Path

import click

from tcp.cli.main import complain
from tcp.cli.options import READ, Problem, problem_options
from tcp.cli.terminal import tell
from tcp.errors import Exit, TcpError, UsageError
from tcp.instance import Instance
from tcp.oracle import FOLDER, describe, prove, statement
from tcp.validate.store import CertificateFolder

EPILOG = """\b
Examples:
  tcp oracle pin tests/board.csv --travel case2      prove and pin the optimum
  tcp oracle show tests/board.csv --travel case2     what is pinned, checked again

\b
The certificate goes to the folder 'certificates' beside FILE (or --dir) and
belongs into version control. Tests use it through the pytest fixture
drill_oracle; tcp validate and tcp audit find it by themselves.
Exit codes: 0 pinned, 2 usage, 3 unreadable input or a certificate that proves
nothing, 4 infeasible, 5 no proof within the limit, 70 internal error."""


@click.group(epilog=EPILOG)
def command() -> None:
    """Pin certified optima for tests, and show them."""


@command.command(epilog=EPILOG)
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=READ)
@click.option("--dir", "folder", type=click.Path(path_type=Path), help="Folder of certificates.")
@click.option("--time-limit", type=float, metavar="S", help="Seconds for each proof.")
@problem_options
def pin(
    problem: Problem, files: tuple[Path, ...], folder: Path | None, time_limit: float | None
) -> int:
    """Prove the optimum of each FILE and write its certificate beside it."""
    worst = Exit.OK
    for path in files:
        try:
            instance = _instance(problem, path)
            home = folder or path.parent / FOLDER
            known = CertificateFolder(home).known(instance)
            if known is None or not known.optimal:
                known = prove(instance, home, time_limit, like=(path,))
        except TcpError as error:
            worst = max(worst, complain(error))
            continue
        click.echo(statement(instance, known))
        if not known.optimal:
            worst = max(worst, Exit.NO_PROOF)
    return worst


@command.command(epilog=EPILOG)
@click.argument("file", type=READ)
@click.option("--dir", "folder", type=click.Path(path_type=Path), help="Folder of certificates.")
@problem_options
def show(problem: Problem, file: Path, folder: Path | None) -> None:
    """Check the certificate pinned for FILE again and say what it proves."""
    instance = _instance(problem, file)
    home = folder or file.parent / FOLDER
    known = CertificateFolder(home).known(instance)
    if known is None:
        raise UsageError(
            f"{home} holds no certificate for {describe(instance)}; run tcp oracle pin"
        )
    click.echo(statement(instance, known))


def _instance(problem: Problem, path: Path) -> Instance:
    """The instance in a file, with its reader's notes on stderr."""
    reading = problem.read(path)
    tell(path, reading.notes)
    return problem.instance(reading)
