"""``tcp solve``: the shortest drilling order of each file."""

from __future__ import annotations

import json
from dataclasses import dataclass
from fractions import Fraction
from inspect import signature
from pathlib import Path
from typing import Any

import click

from tcp.cli.main import complain
from tcp.cli.options import READ, Problem, number, problem_options, setting
from tcp.cli.terminal import PROOF, PROOF_ENDINGS, check_outputs, on_terminal, output_path, tell
from tcp.errors import Exit, TcpError, UsageError
from tcp.files.write import is_stream, real_path
from tcp.instance import Instance
from tcp.report.data import result_data
from tcp.report.route import save_route
from tcp.report.table import summary
from tcp.result import Proof, Report, Result, Status, silent
from tcp.solve import SOLVERS, solve
from tcp.stop import Stop, StopReason

EPILOG = """\b
Examples:
  tcp solve --exact data/wp2.csv
  tcp solve --travel case2 --start 49 --time-limit 10 data/wp3.csv
  tcp solve --home 0,0 --legs out --json data/fa14.csv
  tcp solve --solver milp --formulation mtz --set backend=cbc data/wp1.csv
  tcp solve --exact --certificate wp3.cert.json data/wp3.csv
  tcp solve --exact --closed --out berlin52.tour berlin52.tsp
  tcp solve --out route.csv --plot route.svg board.csv

\b
Exit codes: 0 done (with --exact: proved), 2 usage, 3 unreadable or invalid
input, 4 infeasible, 5 no proof (or no route) within the limits, 7 an output
file cannot be written, 70 internal error, 130 interrupted without a result.
With several files the highest one counts."""


@dataclass(frozen=True)
class Run:
    """How to solve, the same for every file of a call."""

    solver: str
    exact: bool
    time_limit: float | None
    gap: float | None
    goal: Fraction | None
    iterations: int | None
    seed: int
    settings: dict[str, Any]
    live: bool

    def __call__(self, instance: Instance, certificate: Path | None, source: Path) -> Result:
        """Solve the instance in ``source``, with a live line where one is wanted."""
        if not self.live:
            return self._solve(instance, certificate, source, silent)
        from tcp.report.live import live_line

        with live_line(instance) as report:
            return self._solve(instance, certificate, source, report)

    def _solve(
        self, instance: Instance, certificate: Path | None, source: Path, report: Report
    ) -> Result:
        goal = None if self.goal is None else self.goal / instance.quantum
        return solve(
            instance,
            self.solver,
            stop=Stop(self.time_limit, self.iterations, self.gap, goal),
            seed=self.seed,
            exact=self.exact,
            report=report,
            certificate=certificate,
            like=(source,),
            **self.settings,
        )


@dataclass(frozen=True)
class Outputs:
    """Where the answers go."""

    as_json: bool
    out: Path | None
    plot: Path | None
    certificate: Path | None
    many: bool

    def place(self, wish: Path | None, path: Path, suffix: str) -> Path | None:
        """Where a wish is granted for the workpiece in ``path``."""
        return None if wish is None else output_path(wish, path, self.many, suffix)

    def proof(self, path: Path) -> Path | None:
        """Where the proof about the workpiece in ``path`` goes."""
        return self.place(self.certificate, path, PROOF)

    def route(self, path: Path) -> Path | None:
        """Where its route goes."""
        return self.place(self.out, path, ".route.csv")

    def picture(self, path: Path) -> Path | None:
        """Where its picture goes."""
        return self.place(self.plot, path, ".svg")

    def check(self, files: tuple[Path, ...], state: Path | None) -> None:
        """See that all of this, and the state, can be written, before any work is done."""
        wishes: list[tuple[Path | None, tuple[str, ...]]] = [(state, ())]
        wishes += [
            (place(path), suffixes)
            for path in files
            for place, suffixes in (
                (self.proof, PROOF_ENDINGS),
                (self.route, (".csv", ".tour")),
                (self.picture, (".svg", ".png")),
            )
        ]
        check_outputs([(path, ends) for path, ends in wishes if path is not None], files)

    def fit(self, instance: Instance, path: Path) -> None:
        """See that the holes have places where files are to show them."""
        route, piece = self.route(path), instance.workpiece
        shown = self.plot is not None or (route is not None and route.suffix.lower() == ".csv")
        if shown and piece.matrix is not None and piece.nowhere:
            raise UsageError(f"{path}: states travel times and no places; give --out NAME.tour")

    def __call__(self, result: Result, path: Path) -> None:
        """Print one result and write its files."""
        click.echo(json.dumps(result_data(result)) if self.as_json else summary(result))
        route, picture = self.route(path), self.picture(path)
        if result.route is not None and route is not None:
            save_route(result, route, like=(path,))
        if result.route is not None and picture is not None:
            from tcp.report.plot import save_plot

            save_plot(result, picture, like=(path,))


@click.command(epilog=EPILOG)
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=READ)
@click.option("--solver", default="auto", show_default=True, help=f"auto, {', '.join(SOLVERS)}.")
@click.option("--exact", is_flag=True, help="Ask for a proof; exit 5 where there is none in time.")
@problem_options
@click.option("--time-limit", type=float, metavar="S", help="Seconds of wall time for each file.")
@click.option(
    "--gap", type=float, metavar="G", help="Relative gap that is good enough: 0.01 is 1 %."
)
@click.option("--target", "goal", type=number, help="Travel time that is good enough.")
@click.option("--iterations", type=int, help="Iterations, as the solver counts them.")
@click.option("--seed", type=int, default=0, show_default=True, help="Source of all randomness.")
@click.option("--formulation", help="milp: subtour, mtz or flow.")
@click.option("--backend", help="milp: highs, cbc or scip.")
@click.option(
    "--set", "settings", multiple=True, metavar="KEY=VALUE", help="An option of the solver's own."
)
@click.option("--json", "as_json", is_flag=True, help="One JSON object a file, on one line.")
@click.option("--out", type=click.Path(path_type=Path), help="Write the route: .csv, or .tour.")
@click.option("--plot", type=click.Path(path_type=Path), help="Draw the route: .svg or .png.")
@click.option(
    "--certificate",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write the proof, once checked: .json or .json.gz.",
)
@click.option(
    "--save-state",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="branch-and-cut: keep an unfinished proof here, renewed every half minute.",
)
@click.option(
    "--resume",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="branch-and-cut: go on from a saved state.",
)
def command(
    problem: Problem,
    files: tuple[Path, ...],
    solver: str,
    settings: tuple[str, ...],
    formulation: str | None,
    backend: str | None,
    as_json: bool,
    out: Path | None,
    plot: Path | None,
    certificate: Path | None,
    save_state: Path | None,
    resume: Path | None,
    **how: Any,
) -> int:
    """Find the order in which to drill the holes of each FILE.

    A file is CSV, TSPLIB, Excellon, G-code, KiCad or DXF.

    The route is an open path from any hole to any other, unless --start, --end, --home or
    --closed say otherwise. Ctrl-C returns the best route so far.
    """
    own = solver_options(settings)
    named: dict[str, Any] = {"formulation": formulation, "backend": backend}
    named |= {"save_state": save_state, "resume": resume}
    own |= {key: value for key, value in named.items() if value is not None}
    if (save_state or resume) and len(files) > 1:
        raise click.UsageError("--save-state and --resume take one FILE at a time")
    if solver == "auto" and (save_state or resume):
        solver = "branch-and-cut"  # whose options these are
    if solver == "auto" and (formulation or backend):
        solver = "milp"  # whose options these are
    run = Run(solver=solver, settings=own, live=not as_json and on_terminal(), **how)
    outputs = Outputs(as_json, out, plot, certificate, len(files) > 1)
    outputs.check(files, save_state)
    if save_state is not None:
        keep_state(save_state, resume)
    worst = Exit.OK
    for path in files:
        try:
            reading = problem.read(path)
            tell(path, reading.notes)
            instance = problem.instance(reading)
            outputs.fit(instance, path)
            result = run(instance, outputs.proof(path), path)
            outputs(result, path)
        except TcpError as error:
            worst = max(worst, complain(error))
            continue
        if certified_less(result):
            tell(path, ["the certificate proves a lower bound, not the route; give more time"])
        worst = max(worst, verdict(result, run.exact))
        if result.stopped is StopReason.INTERRUPTED:
            break
    return worst


def keep_state(state: Path, resume: Path | None) -> None:
    """See that a new proof does not replace the state of another: hours of work may be in it.

    Raises
    ------
    UsageError
        If there is a state that is not the one to resume.
    """
    if is_stream(state) or not state.exists() or not state.stat().st_size:
        return
    if resume is None or real_path(resume) != real_path(state):
        raise UsageError(f"{state} exists; --resume it to go on, or remove it to begin anew")


def solver_options(settings: tuple[str, ...]) -> dict[str, Any]:
    """What ``--set`` gives to the solver.

    Raises
    ------
    UsageError
        For what is no solver's own affair but that of an option here.
    """
    own = dict(setting(text) for text in settings)
    for key in own:
        if key in signature(solve).parameters:
            flag = f"; give --{key}" if key in ("solver", "seed", "exact", "certificate") else ""
            raise UsageError(f"--set {key}: no solver has an option of that name{flag}")
    return own


def verdict(result: Result, exact: bool) -> Exit:
    """The exit code that a result deserves."""
    if result.status is Status.INFEASIBLE:
        return Exit.INFEASIBLE
    proved = result.status is Status.OPTIMAL and not certified_less(result)
    return Exit.NO_PROOF if result.route is None or (exact and not proved) else Exit.OK


def certified_less(result: Result) -> bool:
    """Whether a solver proved its route, and the certificate written proves less."""
    proved = result.status is Status.OPTIMAL and result.proof is not Proof.CERTIFIED
    return proved and result.certificate is not None
