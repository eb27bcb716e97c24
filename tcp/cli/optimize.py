"""``tcp optimize``: a drill file in, the same holes in a shorter order out."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import click

from tcp.boards.board import Board, Wishes
from tcp.boards.chain import ToolOrder
from tcp.boards.deliver import Target, backup_of, collect, manifest, write_board
from tcp.boards.effort import CHECK_LIMIT, LIMITS, Effort
from tcp.boards.machine import Machine, misfit, read_machine
from tcp.boards.optimise import News, optimise
from tcp.cli.main import complain
from tcp.cli.options import READ, fleet_options, number, point
from tcp.cli.terminal import check_folder, check_outputs, on_terminal, output_path, tell
from tcp.errors import Exit, OutputError, TcpError, UsageError, system_reason
from tcp.files.drilling import read_drilling
from tcp.files.excellon import Hints, Program, hints, oddities
from tcp.files.excellon.numbers import tool_number
from tcp.files.write import is_stream, write_file
from tcp.fleet import Fleet, FleetError
from tcp.report.board import board_data, board_table, summary_table
from tcp.travel import parse_model

EPILOG = """\b
Examples:
  tcp optimize board.drl                      writes board-optimized.drl
  tcp optimize --check gerbers/               how much travel is wasted?
  tcp optimize --exact --out fab/ *.drl       proved, or exit code 5
  tcp optimize --machine linear.toml --start 0,0 --park 0,400 board.drl
  tcp optimize --jobs 8 boards/*.drl
  tcp optimize --backend dask --scheduler 10.0.0.5:8786 boards/*.drl
  tcp optimize --units inch --format 2:4 --zeros lz pads.drl

\b
Exit codes: 0 done, 1 with --check: a shorter order exists, 2 usage, 3 unreadable
or not understood, 5 with --exact: a tool without proof, 7 not written, 70 internal
error, 130 interrupted. With several files the highest one counts."""

CONTRADICTIONS = (
    ("in_place", "out", "--in-place replaces the input"),
    ("check", "in_place", "--check only judges and writes no board"),
    ("check", "out", "--check only judges and writes no board"),
    ("check", "force", "--check only judges and writes no board"),
)
"""Options that do not go together: the one, the other, and why."""

LIMIT_HELP = ", ".join(f"{effort} {limit:g}" for effort, limit in LIMITS.items())


@dataclass(frozen=True)
class Job:
    """One call: what to do with every board, and what to write."""

    wishes: Wishes
    hints: Hints
    target: Target
    dry_run: bool
    exact: bool
    as_json: bool
    many: bool
    live: bool

    @property
    def writes(self) -> bool:
        """Whether boards are written, and not only looked at."""
        return not (self.dry_run or self.wishes.check)

    def read(self, path: Path) -> Program:
        """Read one board, and say what is odd about it."""
        program = read_drilling(path, self.hints)
        tell(path, [*program.notes, *oddities(program)])
        return program

    def deliver(self, board: Board) -> tuple[Path | None, Exit]:
        """Write an optimised board; where to, and what it means for the exit code."""
        written = None
        if self.writes and not (self.exact and not board.proved):
            written = write_board(board, self.target, self.many, self.hints)
        if self.exact and not board.proved:
            unproved = [part for part in board.parts if not part.proved]
            reason = f"no proof for {', '.join(f'T{part.tool}' for part in unproved)}"
            if not all(part.unclear for part in unproved):
                reason += "; --time-limit gives a tool more seconds"
            click.echo(f"tcp: {board.before.path}: {reason}", err=True)
            return written, Exit.NO_PROOF
        if self.wishes.check and board.costs_after.total < board.costs_before.total:
            return written, Exit.FINDINGS
        return written, Exit.OK


@dataclass(frozen=True)
class Optimised:
    """What became of one file: a board, the file it went to, or what went wrong."""

    board: Board | None = None
    written: Path | None = None
    code: Exit = Exit.OK
    error: TcpError | None = None


def _optimised(task: tuple[Program, Wishes, Hints]) -> Board | TcpError:
    """One board: what a worker process does."""
    try:
        return optimise(*task)
    except TcpError as error:
        return error


def _one_by_one(job: Job, paths: list[Path]) -> Iterator[Optimised]:
    """The boards in turn, with a live line; stops after one that was interrupted."""
    for path in paths:
        try:
            program = job.read(path)
            with _live(job.live) as news:
                board = optimise(program, job.wishes, job.hints, news)
        except TcpError as error:
            yield Optimised(error=error)
            continue
        yield _delivered(job, board)
        if board.interrupted:
            return


def _side_by_side(job: Job, paths: list[Path], fleet: Fleet) -> Iterator[Optimised]:
    """The boards on many processes: each written once done, given away in file order."""
    done: dict[int, Optimised] = {}
    tasks: dict[int, tuple[Program, Wishes, Hints]] = {}
    for place, path in enumerate(paths):
        try:
            tasks[place] = (job.read(path), job.wishes, job.hints)
        except TcpError as error:
            done[place] = Optimised(error=error)
    places, following = list(tasks), 0
    try:
        for k, found in fleet.run(_optimised, list(tasks.values())):
            done[places[k]] = _delivered(job, found)
            while following in done:
                yield done.pop(following)
                following += 1
    except (KeyboardInterrupt, FleetError):  # tell what is finished, for it is written
        yield from (done[place] for place in sorted(done))
        raise
    yield from (done[place] for place in sorted(done))


def _delivered(job: Job, found: Board | TcpError) -> Optimised:
    if isinstance(found, TcpError):
        return Optimised(error=found)
    try:
        return Optimised(found, *job.deliver(found))
    except TcpError as error:
        return Optimised(error=error)


@contextmanager
def _live(wanted: bool) -> Iterator[News | None]:
    """News on stderr's terminal, one line that changes with the tool at work."""
    if not wanted:
        yield None
        return
    from tcp.report.live import live_board

    with live_board() as news:
        yield news


def place(text: str) -> Path:
    """Where to write; an option's type.  What ends like a folder's name must be one.

    Raises
    ------
    OutputError
        If it is none.
    """
    path = Path(text)
    if text.endswith(("/", os.sep)) and not path.is_dir():
        raise OutputError(f"cannot write {text}: there is no folder {path}")
    return path


def _tool(text: str) -> int:
    number = tool_number(text)
    if number is None:
        raise click.BadParameter(f"{text!r} is not a tool; expected e.g. T3")
    return number


_READING = [
    click.option("--units", type=click.Choice(["mm", "inch"]), help="Where the file is silent."),
    click.option("--format", metavar="N:M", help="Digits before and behind the missing point."),
    click.option("--zeros", type=click.Choice(["lz", "tz"]), help="Zeros kept: leading, trailing."),
    click.option(
        "--sidecar", type=click.Path(path_type=Path), help="The nc_param.txt of the file."
    ),
    click.option("--unfinished", is_flag=True, help="Accept a file without M30."),
]
_MACHINE = [
    click.option("--machine", type=click.Path(path_type=Path), help="A machine profile (TOML)."),
    click.option("--travel", metavar="MODEL", help="Travel model.  [default: simultaneous]"),
    click.option("--vx", type=number, metavar="MM/S", help="Speed of the x axis."),
    click.option("--vy", type=number, metavar="MM/S", help="Speed of the y axis."),
    click.option("--ax", type=number, metavar="MM/S2", help="Acceleration of the x axis."),
    click.option("--ay", type=number, metavar="MM/S2", help="Acceleration of the y axis."),
    click.option("--start", type=point, metavar="X,Y", help="Where the machine stands before."),
    click.option("--home", type=point, metavar="X,Y", help="Both --start and --park."),
    click.option("--park", type=point, metavar="X,Y", help="Where it goes to afterwards."),
]


Function = Callable[..., Any]


def _options(options: list[Any]) -> Callable[[Function], Function]:
    def give(function: Function) -> Function:
        for option in reversed(options):
            function = option(function)
        return function

    return give


@click.command(epilog=EPILOG)
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=READ)
@click.option(
    "--effort",
    type=click.Choice([str(e) for e in Effort]),
    default="normal",
    show_default=True,
    help="fast: only seek; normal: seek and prove; proof: take the time it needs.",
)
@click.option(
    "--time-limit", type=float, metavar="S", help=f"Seconds a tool.  [default: {LIMIT_HELP}]"
)
@click.option("--exact", is_flag=True, help="Write only what is proved shortest, else exit 5.")
@click.option("--seed", type=int, default=0, show_default=True, help="Source of all randomness.")
@click.option(
    "--tool-order",
    type=click.Choice([str(o) for o in ToolOrder]),
    default="keep",
    show_default=True,
    help="The order of tools: the file's, by diameter, or the shortest.",
)
@click.option("--merge-tool-selections", "merge", is_flag=True, help="Select each tool once.")
@click.option("--expand", is_flag=True, help="Write repeats and patterns out hole by hole.")
@click.option(
    "--keep-first", type=click.IntRange(0), default=0, metavar="N", help="Holes that stay in front."
)
@click.option("--keep", multiple=True, metavar="T", help="A tool whose order stays; repeatable.")
@click.option(
    "--panels/--no-panels", default=True, help="Solve a board that is repeated k x m once."
)
@_options(_MACHINE)
@_options(_READING)
@fleet_options("1, boards one after the other")
@click.option("--out", "-o", type=place, metavar="PATH", help="File or directory to write.")
@click.option("--in-place", is_flag=True, help="Replace the input; it is kept as NAME.bak.")
@click.option("--force", is_flag=True, help="Overwrite an existing output.")
@click.option("--dry-run", is_flag=True, help="Do everything but write boards.")
@click.option("--check", is_flag=True, help="Only judge the file; exit 1 if it wastes travel.")
@click.option(
    "--certificates", type=click.Path(path_type=Path), help="Folder for a certificate a tool."
)
@click.option("--plot", type=click.Path(path_type=Path), help="Before and after: .svg or .png.")
@click.option(
    "--report", type=click.Path(path_type=Path), help="A self-contained page (.html) to look at."
)
@click.option("--manifest", type=click.Path(path_type=Path), help="Write hashes as JSON.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object a board, on one line.")
def command(files: tuple[Path, ...], **given: Any) -> int:
    """Put the holes of each drill FILE (Excellon, G-code) into a shorter order, tool by tool.

    Only the order changes: the new file is read back and compared hole by
    hole before it is put in place. FILE may be a directory or a pattern.
    """
    boards, done = [], 0
    paths, errors = collect(files)
    worst = max([Exit.OK, *map(complain, errors)])
    job, fleet = _job(given, len(paths) > 1), _fleet(given)
    _check_outputs(job, paths, given)
    each = _one_by_one(job, paths) if fleet.alone else _side_by_side(job, paths, fleet)
    try:
        for found in each:
            done += 1
            if found.board is not None:
                boards.append((found.board, found.written))
            worst = max(worst, _tell(job, found, given["plot"], given["report"]))
    except KeyboardInterrupt:
        if not done:
            raise
        worst = Exit.INTERRUPTED
    finally:  # after Ctrl-C, too: these boards are written
        if len(boards) > 1 and not job.as_json:
            click.echo("\n" + summary_table([board for board, _ in boards]))
        if given["manifest"] is not None:
            write_file(given["manifest"], manifest(boards), like=paths)
    if done < len(paths):
        click.echo(f"tcp: interrupted: {done} of {len(paths)} files are done", err=True)
        return Exit.INTERRUPTED
    return worst


def _tell(job: Job, found: Optimised, plot: Path | None, page: Path | None) -> Exit:
    """Print what became of a file, and draw it; the exit code that it means."""
    worst = found.code
    if found.error is not None:
        worst = complain(found.error)
    if found.board is not None:
        before = found.board.before
        tell(before.path, found.board.notes[len(before.notes) :])  # the reader's are told already
        try:
            _show(found.board, plot, page, job.many)
        except TcpError as error:
            worst = max(worst, complain(error))
        data = json.dumps(board_data(found.board, found.written)) if job.as_json else None
        click.echo(data or board_table(found.board, found.written))
    return worst


def _show(board: Board, plot: Path | None, page: Path | None, many: bool) -> None:
    """Draw the board and write its page, where that is asked for."""
    source = board.before.path
    if plot is not None:
        from tcp.report.board_plot import save_board_plot

        save_board_plot(board, output_path(plot, source, many, ".svg"))
    if page is not None:
        from tcp.report.board_html import save_board_html

        save_board_html(board, output_path(page, source, many, ".html"))


def _job(given: dict[str, Any], many: bool) -> Job:
    """The job that the options mean.

    Raises
    ------
    UsageError
        If they contradict each other.
    """
    if given["time_limit"] is not None and not given["time_limit"] > 0:
        raise UsageError(f"--time-limit must be greater than 0, not {given['time_limit']:g}")
    if given["seed"] < 0:
        raise UsageError(f"--seed must be 0 or more, not {given['seed']}")
    for one, other, reason in CONTRADICTIONS:
        if given[one] and given[other]:
            raise UsageError(f"{reason}; drop --{other.replace('_', '-')}")
    if given["exact"] and given["effort"] == Effort.FAST:
        raise UsageError("--exact needs proofs, --effort fast seeks none; drop one of them")
    if given["certificates"] is not None and given["effort"] == Effort.FAST:
        raise UsageError("--certificates needs proofs, --effort fast seeks none; drop one of them")
    for name in ("start", "park"):
        if given["home"] is not None and given[name] is not None:
            raise UsageError(f"--home is both --start and --park; drop --{name}")
    effort = Effort.PROOF if given["exact"] and given["effort"] == "normal" else given["effort"]
    wishes = Wishes(
        machine=_machine(given),
        effort=Effort(effort),
        time_limit=_time_limit(given),
        seed=given["seed"],
        start=given["start"] or given["home"],
        park=given["park"] or given["home"],
        keep_first=given["keep_first"],
        keep=frozenset(map(_tool, given["keep"])),
        tool_order=ToolOrder(given["tool_order"]),
        merge=given["merge"],
        expand=given["expand"],
        certificates=_folder(given["certificates"]),
        panels=given["panels"],
        check=given["check"],
    )
    return Job(
        wishes=wishes,
        hints=hints(
            given["units"], given["format"], given["zeros"], given["unfinished"], given["sidecar"]
        ),
        target=Target(given["out"], given["in_place"], given["force"]),
        dry_run=given["dry_run"],
        exact=given["exact"],
        as_json=given["as_json"],
        many=many,
        live=not given["as_json"] and on_terminal(),
    )


def _time_limit(given: dict[str, Any]) -> float | None:
    """Seconds a tool; a file that is only judged gets fewer."""
    if given["time_limit"] is None and given["check"] and not given["exact"]:
        return CHECK_LIMIT if given["effort"] == "normal" else None
    limit: float | None = given["time_limit"]
    return limit


def _check_outputs(job: Job, paths: Sequence[Path], given: dict[str, Any]) -> None:
    """See that all that is asked for can be written, before any work is done."""
    targets: list[tuple[Path, tuple[str, ...]]] = []
    found: set[Path] = set()
    for path in paths:
        if job.writes and job.target.in_place:
            check_folder(path)
            backup_of(path)
        elif job.writes:
            target = job.target.path(path, job.many)
            targets.append((target, ()))
            stands = target.is_file() and not is_stream(target)
            found |= {target} if stands and not job.target.force else set()
        if given["plot"] is not None:
            targets.append((output_path(given["plot"], path, job.many, ".svg"), (".svg", ".png")))
        if given["report"] is not None:
            page = output_path(given["report"], path, job.many, ".html")
            targets.append((page, () if is_stream(page) else (".html", ".htm")))
    if given["manifest"] is not None:
        targets.append((given["manifest"], ()))
    if given["certificates"] is not None:
        check_folder(given["certificates"] / "T1")
        twice = [stem for stem, count in Counter(path.stem for path in paths).items() if count > 1]
        if twice:
            raise UsageError(f"--certificates: several boards are called {min(twice)}")
    check_outputs(targets, paths)
    if found:
        raise OutputError(f"{min(found)} exists already; say --force to overwrite it")


def _fleet(given: dict[str, Any]) -> Fleet:
    """Where the boards are worked on: one after the other, unless more is asked for."""
    jobs = given["jobs"]
    if jobs is None and given["backend"] == "loky":
        jobs = 1
    return Fleet(jobs, given["backend"], given["scheduler"])


def _folder(path: Path | None) -> Path | None:
    """A folder for outputs, made if need be."""
    if path is not None:
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"cannot make {path}: {system_reason(error)}") from None
    return path


def _machine(given: dict[str, Any]) -> Machine:
    machine = Machine() if given["machine"] is None else read_machine(given["machine"])
    changes: dict[str, Fraction] = {
        name: given[name] for name in ("vx", "vy", "ax", "ay") if given[name] is not None
    }
    travel = machine.travel
    model = travel.model if given["travel"] is None else parse_model(given["travel"])
    wrong = misfit(model, changes.keys() | ({"vx", "vy"} if machine.timed else set()))
    if wrong:
        raise UsageError(wrong)
    timed = machine.timed or "vx" in changes
    return replace(machine, travel=replace(travel, model=model, **changes), timed=timed)  # type: ignore[arg-type]
