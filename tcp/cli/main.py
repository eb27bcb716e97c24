"""The ``tcp`` command: one group, one file per subcommand, loaded when it is called.

A new subcommand is one file in this folder with a click command named
``command``, and one line in :data:`COMMANDS`.  A command returns its exit code
(None is 0); every error becomes one sentence on stderr and its exit code here
and nowhere else.
"""

from __future__ import annotations

import errno
import io
import os
import sys
import traceback
from collections.abc import Callable
from importlib import import_module
from typing import Any

import click

import tcp
from tcp.errors import Exit, OutputError, TcpError, system_reason

COMMANDS: dict[str, str] = {
    "solve": "Find the shortest drilling order of workpieces, and prove it.",
    "optimize": "Put the holes of drill files into a shorter order.",
    "info": "Describe a workpiece.",
    "export": "Write a workpiece's integer programme for other solvers.",
    "check": "Check a certificate, trusting nothing that wrote it.",
    "bound": "Prove a lower bound on every route, for any number of holes.",
    "pareto": "Travel time against axis balance: the exact Pareto front of a small workpiece.",
    "experiment": "Repeat solver runs and set them beside a paper's table.",
    "validate": "Judge a route and its claimed time: valid, true, optimal?",
    "audit": "Judge every claim of whole papers, and of your own.",
    "oracle": "Pin certified optima for the tests of your own solver.",
    "explain": "What the code of a finding means.",
}
"""Every subcommand and its line in the help; the code is in ``tcp.cli.NAME``."""

EPILOG = """\b
Examples:
  tcp solve data/wp3.csv                      a good route, quickly
  tcp solve --exact data/wp3.csv              the shortest one, with a proof
  tcp solve --travel case2 --json board.csv   both axes move at once; JSON
  tcp info board.tsp                          what is in the file

`tcp COMMAND --help` explains a command; docs/cli.md lists every exit code."""


class TcpGroup(click.Group):
    """Loads subcommands by name and turns exceptions into sentences and exit codes."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the subcommands, in the order of the help."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The subcommand, imported now."""
        if cmd_name not in COMMANDS:
            return None
        found = import_module(f"tcp.cli.{cmd_name.replace('-', '_')}").command
        assert isinstance(found, click.Command)
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list of subcommands, without importing any of them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def invoke(self, ctx: click.Context) -> Any:
        """Run the subcommand; a reader that leaves is told, where click would exit with 1."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what is left to flush goes nowhere
            raise OutputError("stopped, because nobody reads the result any more") from None

    def main(self, *args: Any, **extra: Any) -> Any:
        """Run the command line; always leaves with ``SystemExit``, for tests as for users."""
        extra["standalone_mode"] = False
        if isinstance(sys.stdout, io.TextIOWrapper):  # a name may hold what the encoding cannot
            sys.stdout.reconfigure(errors="backslashreplace")
        sys.exit(int(guarded(lambda: super(TcpGroup, self).main(*args, **extra)) or Exit.OK))


NOT_OURS = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.ENAMETOOLONG, errno.EIO, errno.EFBIG)
"""What goes wrong with files and is no bug: no space, a name that is too long, and so on."""


def guarded(run: Callable[[], Any]) -> Any:
    """``run()``, or one sentence on stderr and the exit code of what went wrong."""
    try:
        return run()
    except TcpError as error:
        return complain(error)
    except click.ClickException as error:
        ctx = getattr(error, "ctx", None)
        where = f" (see {ctx.command_path} --help)" if ctx is not None else ""
        _say(f"tcp: {error.format_message().rstrip('.')}{where}")
        return Exit.USAGE
    except (click.Abort, KeyboardInterrupt):
        _say("tcp: interrupted before there was a result")
        return Exit.INTERRUPTED
    except PermissionError as error:
        return complain(OutputError(f"cannot look at {error.filename}: permission denied"))
    except OSError as error:
        if error.errno not in NOT_OURS:
            return _internal(error)
        where = f" {error.filename}" if error.filename else " the result"
        return complain(OutputError(f"cannot write{where}: {system_reason(error)}"))
    except Exception as error:
        if _by_ctrl_c(error):
            _say("tcp: interrupted before there was a result")
            return Exit.INTERRUPTED
        return _internal(error)


def _internal(error: Exception) -> Exit:
    if debugging():
        traceback.print_exc()
    kind = type(error).__name__
    _say(f"tcp: internal error: {kind}: {error} (TCP_DEBUG=1 shows where; please report it)")
    return Exit.INTERNAL


def _by_ctrl_c(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind an error: a library that is being loaded turns it into its own."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def complain(error: TcpError) -> Exit:
    """Print the error's sentence; its exit code."""
    if debugging():
        traceback.print_exception(error)
    _say(f"tcp: {error}")
    return error.exit_code


def debugging() -> bool:
    """Whether tracebacks are wanted (``--debug`` or the environment's ``TCP_DEBUG``)."""
    return os.environ.get("TCP_DEBUG", "") not in ("", "0")


def _say(sentence: str) -> None:
    click.echo(sentence.replace("\n", " "), err=True)


def _debug(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    if value:
        os.environ["TCP_DEBUG"] = "1"


@click.group(cls=TcpGroup, epilog=EPILOG, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(tcp.__version__, prog_name="tcp")
@click.option(
    "--debug",
    is_flag=True,
    expose_value=False,
    callback=_debug,
    help="Show tracebacks (as TCP_DEBUG=1 does).",
)
def main() -> None:
    """Find the order in which a CNC drill visits the holes of a workpiece, and prove it shortest.

    Routes are open paths in axis travel time; costs are exact.
    """


if __name__ == "__main__":
    main()
