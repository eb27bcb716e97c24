"""A folder of certificates, looked up by the instance's hash and checked on every load."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from tcp.errors import InputError
from tcp.instance import Instance
from tcp.validate import certificate as checker
from tcp.validate.known import Known


def file_name(instance: Instance) -> str:
    """Name of an instance's certificate: readable, and unique by its hash."""
    stem = "".join(c if c.isalnum() and c.isascii() else "-" for c in instance.name[:40])
    return f"{stem}.{instance.travel.model}.{instance.sha256[:16]}.cert.json.gz"


@dataclass(frozen=True)
class CertificateFolder:
    """Knowledge from certificates in a folder.

    Nothing in the folder is trusted: a certificate counts only if the
    independent checker verifies it now, for exactly the instance asked about.
    """

    folder: Path
    _seen: dict[str, Known | None] = field(default_factory=dict, repr=False, compare=False)

    def path(self, instance: Instance) -> Path | None:
        """The file about an instance, gzipped or not; None if there is none."""
        found = sorted(self.folder.glob(f"*.{instance.sha256[:16]}.cert.json*"))
        return found[0] if found else None

    def known(self, instance: Instance) -> Known | None:
        """What the folder's certificate proves about ``instance``.

        Raises
        ------
        InputError
            If there is a certificate that proves nothing.
        """
        if instance.sha256 not in self._seen:
            path = self.path(instance)
            self._seen[instance.sha256] = None if path is None else load(path, instance)
        return self._seen[instance.sha256]


def load(path: Path, instance: Instance) -> Known:
    """Check a certificate and say what it proves about ``instance``.

    Raises
    ------
    InputError
        If it does not prove its claim, or is about another instance.
    """
    try:
        raw = checker.unzip(path)
        verdict = checker.check(raw, sha256=instance.sha256)
    except checker.Failure as failure:
        raise InputError(f"is no valid certificate for {instance.name}: {failure}", path) from None
    if verdict.lower is None:
        raise InputError(f"proves that {instance.name} has no route at all", path)
    route = checker.load(raw).get("route")
    found = None if route is None else tuple(int(v) for v in route)
    return Known(verdict.lower, verdict.upper, path.name, found)
