"""The oracle: certified optima on demand, from a folder of certificates or proved now.

It stands above the solvers and the judge: it asks the one for a proof and lets
the other check it.  ``tcp oracle`` and the pytest plugin are thin around it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

from tcp.errors import Exit, OutputError, TcpError, system_reason
from tcp.files.order import order_of
from tcp.instance import Instance
from tcp.result import decimal
from tcp.solve import solve
from tcp.stop import Stop, StopReason
from tcp.validate.auditing import Audit, single
from tcp.validate.findings import Severity, finding
from tcp.validate.known import Known
from tcp.validate.sequence import walk
from tcp.validate.store import CertificateFolder, file_name, load

FEW = 3
"""Repairs of more changes than this say little in a test's output."""

FOLDER = "certificates"
"""Name of the folder beside a workpiece that holds its certificates."""


class NoProofError(TcpError):
    """No optimum is pinned, and none was or may be proved."""

    exit_code = Exit.NO_PROOF


def prove(
    instance: Instance, folder: Path, time_limit: float | None = None, like: Sequence[Path] = ()
) -> Known:
    """Solve to proof and write the certificate to a folder; it counts once it is read back.

    It is kept from whom any of the files ``like`` is kept from.

    Raises
    ------
    NoProofError
        If nothing could be proved within the limit.
    KeyboardInterrupt
        If Ctrl-C ended the proof: it is for the caller, too.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the folder {folder}: {system_reason(error)}") from None
    path = folder / file_name(instance)
    result = solve(instance, stop=Stop(time_limit), exact=True, certificate=path, like=like)
    if result.stopped is StopReason.INTERRUPTED:
        raise KeyboardInterrupt
    if result.certificate is None:
        raise NoProofError(f"{describe(instance)}: nothing was proved ({result.stopped})")
    return load(path, instance)


def describe(instance: Instance) -> str:
    """An instance in a few words."""
    return f"{instance.name} ({len(instance)} holes, {instance.travel.model})"


def statement(instance: Instance, known: Known) -> str:
    """What is known, in one line."""
    lower, upper = known.times(instance)
    what = f"optimum {decimal(lower)}" if known.optimal else f"at least {decimal(lower)}"
    if not known.optimal and upper is not None:
        what += f", at most {decimal(upper)}"
    return f"{describe(instance)}: {what}, certified by {known.source}"


@dataclass(frozen=True)
class Oracle:
    """Certified optima, looked up in folders and proved where they are missing.

    Parameters
    ----------
    folders : tuple of path
        Folders of certificates, searched in this order.
    cache : path or None
        Where new certificates go; None never proves anything.
    time_limit : float or None
        Seconds for a proof.
    like : tuple of path
        New certificates are kept from whom any of these files is kept from.
    """

    folders: tuple[Path, ...] = ()
    cache: Path | None = None
    time_limit: float | None = None
    like: tuple[Path, ...] = ()

    def known(self, instance: Instance) -> Known:
        """The certified optimum of an instance.

        Raises
        ------
        NoProofError
            If it is neither pinned nor may be, or could be, proved.
        InputError
            If a certificate is there but proves nothing.
        """
        places = [*self.folders, *([] if self.cache is None else [self.cache])]
        for folder in places:
            known = CertificateFolder(folder).known(instance)
            if known is not None and known.optimal:
                return known
        if self.cache is None:
            raise NoProofError(f"no optimum of {describe(instance)} is pinned; run: tcp oracle pin")
        known = prove(instance, self.cache, self.time_limit, self.like)
        if not known.optimal:
            raise NoProofError(f"{describe(instance)}: no proof within the limit")
        return known

    def time(self, instance: Instance) -> Fraction:
        """The certified optimal time of an instance."""
        return self.known(instance).lower * instance.quantum


def judge(
    instance: Instance,
    route: Iterable[str | int] | str,
    *,
    numbering: str = "ids",
    known: Known | None = None,
    within: Fraction | None = None,
) -> Audit:
    """One route as an audit that fails if it is no route, or farther from optimal than ``within``.

    Parameters
    ----------
    instance : Instance
        The problem.
    route : text or iterable of labels
        The sequence.
    numbering : str
        ``ids``, ``0`` or ``1``.
    known : Known, optional
        The certified optimum.
    within : Fraction, optional
        Largest excess over the optimum, relative; None asks for a valid route only.
    """
    order = order_of(route, instance.workpiece, numbering)
    entry = single(instance, order, known=known, mend=True, ignore={"TCP304"})
    if entry.repairs is not None and entry.repairs.changes > FEW:
        entry = replace(entry, repairs=None)
    if within is None or known is None:
        return Audit((entry,))
    late = [f for f in entry.findings if f.code == "TCP302"]
    if late and walk(instance, order.entries) > known.lower * (1 + within):
        limit = float(within)
        text = f"{late[0].message}; at most {limit:.4%} is allowed"
        strict = finding("TCP302", text, severity=Severity.ERROR, **late[0].data)
        rest = tuple(f for f in entry.findings if f.code != "TCP302")
        entry = replace(entry, findings=(*rest, strict))
    return Audit((entry,))
