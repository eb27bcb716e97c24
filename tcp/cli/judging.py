"""What ``tcp validate`` and ``tcp audit`` share: certificates, formats, exit codes."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import click

from tcp.cli.terminal import check_outputs
from tcp.errors import Exit, UsageError
from tcp.files.write import write_file
from tcp.validate.auditing import Audit
from tcp.validate.codes import CODES
from tcp.validate.known import NOTHING, Knowledge

FORMATS = ("text", "json", "junit", "sarif", "markdown", "html")


@dataclass(frozen=True)
class Judging:
    """How to judge and report, the same for every claim of a call."""

    certificates: Path | None = None
    report_as: str = "text"
    out: Path | None = None
    strict: bool = False
    ignore: tuple[str, ...] = ()

    def codes(self) -> set[str]:
        """The codes to ignore.

        Raises
        ------
        UsageError
            If there is no such code.
        """
        for code in self.ignore:
            if code not in CODES:
                raise UsageError(f"--ignore: there is no code {code!r}; see tcp explain --all")
        return set(self.ignore)

    def knowledge(self, *near: Path) -> Knowledge:
        """The folder of certificates: the one given, else ``certificates`` near the files."""
        from tcp.validate.store import CertificateFolder

        if self.certificates is not None:
            if not self.certificates.is_dir():
                raise UsageError(f"--certificates: {self.certificates} is no folder")
            return CertificateFolder(self.certificates)
        for path in near:
            for folder in (path.parent / "certificates", path.parent.parent / "certificates"):
                if folder.is_dir():
                    return CertificateFolder(folder)
        return NOTHING

    def check_out(self, *inputs: Path | None) -> None:
        """See before any work that the report has a place to go, which is no input."""
        if self.out is not None:
            check_outputs([(self.out, ())], [path for path in inputs if path is not None])

    def report(self, audit: Audit, inputs: Sequence[Path], details: str = "all") -> int:
        """Print the audit of some files, or write it; the exit code."""
        from tcp.report.findings import render

        text = render(audit, self.report_as, strict=self.strict, details=details)
        if self.out is None:
            click.echo(text, nl=False)
        else:
            write_file(self.out, text, like=inputs)
        return Exit.FINDINGS if audit.failed(self.strict) else Exit.OK


def judging_options(*names_of_report: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a command the options of :class:`Judging`, passed as one ``judging``.

    ``names_of_report`` are the flags that choose the output format.
    """
    report = click.option(
        *names_of_report,
        "report_as",
        type=click.Choice(FORMATS),
        default="text",
        show_default=True,
        help="Output format.",
    )
    return functools.partial(_with_options, report=report)


def _with_options(function: Callable[..., Any], report: Callable[..., Any]) -> Callable[..., Any]:
    names = [f.name for f in fields(Judging)]

    @functools.wraps(function)
    def wrapped(*args: Any, **given: Any) -> Any:
        given["ignore"] = tuple(given["ignore"])
        return function(*args, judging=Judging(**{n: given.pop(n) for n in names}), **given)

    for option in reversed([report, *_OPTIONS]):
        wrapped = option(wrapped)
    return wrapped


_OPTIONS = [
    click.option(
        "--certificates",
        type=click.Path(path_type=Path),
        metavar="DIR",
        help="Folder of certificates (default: 'certificates' beside the files or their folder).",
    ),
    click.option("--out", type=click.Path(path_type=Path), help="Write to this file instead."),
    click.option("--strict", is_flag=True, help="Warnings fail, too."),
    click.option("--ignore", multiple=True, metavar="CODE", help="Leave out findings of a code."),
]
