"""``tcp experiment``: repeat solver runs and set the figures beside a paper's."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from tcp.cli.options import READ, fleet_options
from tcp.cli.terminal import Say, check_outputs, status_line
from tcp.errors import Exit, UsageError
from tcp.experiments.journal import Journal
from tcp.experiments.plot import ENDINGS, blank, save_convergence
from tcp.experiments.run import conduct, optima, rehearse
from tcp.experiments.spec import MOST, load
from tcp.experiments.statistics import summarise
from tcp.experiments.table import honest_table, whole_report
from tcp.fleet import Fleet

EPILOG = """\b
Examples:
  tcp experiment data/experiments/htga-table-viii.toml --table
  tcp experiment data/experiments/cuckoo-table-2.toml --runs 100 --plot wp2.svg
  tcp experiment data/experiments/*.toml --jobs 2 --table

\b
Finished runs are kept in results/NAME.jsonl (--results changes the folder). Stopped at any
moment, even killed, the same command continues where it was and ends with the same table.

\b
Exit codes: 0 done, 2 usage, 3 unreadable or invalid experiment, 5 an optimum cannot be
proved, 7 results cannot be written, 70 internal error or workers lost for good, 130
interrupted (what is finished is kept)."""


@click.command(epilog=EPILOG)
@click.argument("files", nargs=-1, required=True, metavar="EXPERIMENT...", type=READ)
@click.option("--runs", type=click.IntRange(1, MOST), help="Runs of each column, not the file's.")
@fleet_options("one a core")
@click.option(
    "--results", type=click.Path(path_type=Path), default=Path("results"), show_default=True,
    help="Folder of the results files.",
)  # fmt: skip
@click.option("--table", is_flag=True, help="Print our figures beside the paper's.")
@click.option("--plot", type=click.Path(path_type=Path), help="Draw the convergence (.svg, .png).")
def command(
    files: tuple[Path, ...],
    runs: int | None,
    jobs: int | None,
    backend: str,
    scheduler: str | None,
    results: Path,
    table: bool,
    plot: Path | None,
) -> Exit:
    """Make the runs of each EXPERIMENT that are missing, and summarise all of them.

    Each run is measured against the optimum, which an exact solver proves first.
    """
    if plot is not None and len(files) > 1:
        raise UsageError("--plot draws one experiment; name one file")
    if plot is not None:
        check_outputs([(plot, ENDINGS)], files)
        blank()  # without matplotlib, fail before hours of runs rather than after them
    fleet = Fleet(jobs, backend, scheduler)
    experiments = [load(path) for path in files]
    if runs is not None:
        experiments = [replace(experiment, runs=runs) for experiment in experiments]
    journals = [Journal(results / f"{path.stem}.jsonl") for path in files]
    for experiment, journal in zip(experiments, journals, strict=True):
        rehearse(experiment, journal)
    for experiment, journal in zip(experiments, journals, strict=True):
        known = optima(experiment)
        with status_line(experiment.path.stem) as say:

            def told(done: int, total: int, say: Say = say) -> None:
                say(f"{done} of {total} runs")

            try:
                made = conduct(experiment, known, journal, fleet=fleet, told=told)
            except KeyboardInterrupt:
                kept = len(journal.runs())
                click.echo(f"tcp: interrupted: {kept} runs are kept in {journal.path}", err=True)
                return Exit.INTERRUPTED
        summaries = summarise(experiment.columns, known, made)
        click.echo(whole_report(experiment, summaries) if table else honest_table(summaries))
        if plot is not None:
            save_convergence(experiment, summaries, plot)
    return Exit.OK
