"""What can go wrong, and the exit code each failure carries.

Every error that a user can cause is a :class:`TcpError` whose message is one
sentence; the command line prints it and leaves with ``exit_code``.  Anything
else that escapes is a bug in ``tcp`` and exits with :attr:`Exit.INTERNAL`.
"""

from __future__ import annotations

from enum import IntEnum
from fractions import Fraction
from numbers import Integral
from pathlib import Path


class Exit(IntEnum):
    """Exit codes of the command line, all documented in ``docs/cli.md``."""

    OK = 0
    FINDINGS = 1
    USAGE = 2
    INPUT = 3
    INFEASIBLE = 4
    NO_PROOF = 5
    UNSUPPORTED = 6
    OUTPUT = 7
    INTERNAL = 70
    INTERRUPTED = 130


class TcpError(Exception):
    """Base of all errors that have a cause outside the program."""

    exit_code: Exit = Exit.INTERNAL


class UsageError(TcpError):
    """The call asks for something that does not exist or does not fit together."""

    exit_code = Exit.USAGE


def demand_exact(name: str, value: object) -> None:
    """Raise UsageError unless a value is a whole number or a Fraction: a float is not exact."""
    if isinstance(value, bool) or not isinstance(value, int | Fraction):
        raise UsageError(f"{name} must be a whole number or a Fraction, not {value!r}")


def demand_whole(name: str, value: object) -> None:
    """Raise UsageError unless a value is a whole number, numpy's included."""
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise UsageError(f"{name} must be a whole number, not {value!r}")


class InputError(TcpError):
    """A file cannot be read, or what it says is not valid.

    Parameters
    ----------
    message : str
        One sentence: what was found and what was expected.
    path : path, optional
        The file that is at fault.
    line : int, optional
        The line in it, counted from 1.
    """

    exit_code = Exit.INPUT

    def __init__(self, message: str, path: str | Path | None = None, line: int | None = None):
        self.path = None if path is None else Path(path)
        self.line = line
        where = "" if path is None else f"{path}: " if line is None else f"{path}:{line}: "
        super().__init__(where + message)


class OutputError(TcpError):
    """A file cannot be written; what stood there before is untouched."""

    exit_code = Exit.OUTPUT


class InfeasibleError(TcpError):
    """No route satisfies the ends and rules that were asked for."""

    exit_code = Exit.INFEASIBLE


class ProofError(TcpError):
    """A proof was asked for and not reached within the limits."""

    exit_code = Exit.NO_PROOF


def system_reason(error: OSError) -> str:
    """Why the system refused, in its own words, to stand behind a colon."""
    return (error.strerror or str(error)).lower()
