"""Audit whole papers: every claim of one or more claims files, against itself and each other."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path

from tcp.errors import InputError, UsageError
from tcp.files.claims import Claim, ClaimsFile, read_claims
from tcp.files.order import Order, order_of
from tcp.files.printed import Agreement, Printed, parse_printed
from tcp.instance import Instance
from tcp.result import decimal
from tcp.validate.claim import validate
from tcp.validate.findings import Finding, Location, Severity, finding, worst
from tcp.validate.formula import comparison, value
from tcp.validate.known import NOTHING, Knowledge, Known
from tcp.validate.quotations import quotation_findings, subject_findings, workpiece_findings
from tcp.validate.repairs import Repairs, repair
from tcp.validate.sequence import walk
from tcp.validate.statistics import statistics_findings
from tcp.validate.suspect import suspicions
from tcp.workpiece import Workpiece


@dataclass(frozen=True, eq=False)
class Entry:
    """The verdict on one claim.

    Parameters
    ----------
    key : str
        ``SOURCE#ID``, or the name of a single claim.
    kind : str
        Kind of the claim.
    title : str
        Where it stands in the source.
    facts : mapping
        What was claimed, recomputed, certified: labels and values to show.
    findings : tuple of Finding
        Reasons.
    repairs : Repairs or None
        For a sequence that is no route.
    """

    key: str
    kind: str
    title: str
    facts: Mapping[str, str]
    findings: tuple[Finding, ...]
    repairs: Repairs | None = None

    @property
    def verdict(self) -> str:
        """``refuted``, ``doubtful`` or ``holds``, by the heaviest finding."""
        heaviest = worst(self.findings)
        return {Severity.ERROR: "refuted", Severity.WARNING: "doubtful"}.get(
            heaviest or Severity.NOTE, "holds"
        )


@dataclass(frozen=True, eq=False)
class Audit:
    """The verdicts on all claims.

    Parameters
    ----------
    entries : tuple of Entry
        One per claim, in the order of the files.
    sources : tuple of str
        The papers, as titles with year.
    suspect : bool
        Whether misprinted coordinates were looked for.
    """

    entries: tuple[Entry, ...]
    sources: tuple[str, ...] = ()
    suspect: bool = False

    @property
    def findings(self) -> list[Finding]:
        """All findings."""
        return [f for entry in self.entries for f in entry.findings]

    def failed(self, strict: bool = False) -> bool:
        """Whether there is an error, or with ``strict`` a warning."""
        heaviest = worst(self.findings)
        return heaviest is Severity.ERROR or (strict and heaviest is Severity.WARNING)


def audit(
    files: Iterable[str | Path],
    *,
    knowledge: Knowledge = NOTHING,
    ignore: Collection[str] = (),
    suspect: bool = False,
) -> Audit:
    """Judge every claim of claims files.

    Parameters
    ----------
    files : iterable of paths
        Claims files (TOML); quotations are compared among them.
    knowledge : Knowledge
        Certified bounds and optima.
    ignore : collection of str
        Codes to leave out.
    suspect : bool
        Whether to search single misprinted coordinates that explain refuted times.

    Returns
    -------
    Audit
        One entry per claim.

    Raises
    ------
    InputError
        If a file cannot be read, or two files have one source key.
    """
    read = [read_claims(path) for path in files]
    book = _Book.of(read, knowledge)
    subjects = subject_findings(claim for f in read for claim in f.claims)
    entries = []
    for file in read:
        for claim in file.claims:
            entry = _Judge(book, file, claim, suspect).entry()
            found = [*entry.findings, *subjects.get(claim.key, [])]
            entries.append(replace(entry, findings=_located(found, claim, ignore)))
    return Audit(tuple(entries), tuple(_title(f) for f in read), suspect)


def single(
    instance: Instance,
    order: Order,
    *,
    claimed: Printed | None = None,
    known: Known | None = None,
    optimal: bool = False,
    mend: bool = False,
    ignore: Collection[str] = (),
) -> Entry:
    """The entry of one route that stands in no claims file.

    Parameters
    ----------
    instance, order, claimed, known, optimal
        As for :func:`tcp.validate.validate`.
    mend : bool
        Whether to repair a sequence that is no route.
    ignore : collection of str
        Codes to leave out.
    """
    verdict = validate(instance, order, claimed=claimed, known=known, optimal=optimal)
    facts = {"Problem": f"{instance.name}, {_moves(instance)}", **_bound(instance, known)}
    if claimed is not None:
        facts["Claimed"] = claimed.text
    if verdict.time is not None:
        facts["Recomputed"] = decimal(verdict.time)
    repairs = repair(instance, order, known=known) if mend and not verdict.count.valid else None
    found = tuple(f for f in verdict.findings if f.code not in ignore)
    return Entry(instance.name, "route", "", facts, found, repairs)


def _bound(instance: Instance, known: Known | None) -> dict[str, str]:
    if known is None:
        return {}
    label = f"{known.word.capitalize()} {'optimum' if known.optimal else 'lower bound'}"
    return {label: decimal(known.times(instance)[0])}


def _title(file: ClaimsFile) -> str:
    parts = [str(file.source["key"]), str(file.source["title"]), str(file.source.get("year", ""))]
    return ", ".join(p for p in parts if p)


def _located(found: list[Finding], claim: Claim, ignore: Collection[str]) -> tuple[Finding, ...]:
    """Findings at the line of the key they speak of, without the ignored ones."""
    located = []
    for one in found:
        if one.code not in ignore:
            line = claim.line_of(_KEY_OF.get(one.code[:4], {}).get(claim.kind))
            located.append(one.at(Location(str(claim.path), line, claim.key)))
    return tuple(located)


_KEY_OF: dict[str, dict[str, str]] = {
    "TCP1": {"route": "sequence"},
    "TCP2": {"route": "time"},
    "TCP3": {"route": "time", "statistics": "best_time"},
    "TCP5": {"arithmetic": "printed"},
    "TCP7": {"route": "damaged", "workpiece": "same_as"},
}


@dataclass(frozen=True, eq=False)
class _Book:
    """All claims of an audit, for formulas and quotations to look up."""

    claims: Mapping[str, Claim]
    files: Mapping[str, ClaimsFile]
    pieces: Mapping[str, Workpiece]
    knowledge: Knowledge
    _known: dict[str, Known | None] = field(default_factory=dict)

    @classmethod
    def of(cls, files: list[ClaimsFile], knowledge: Knowledge) -> _Book:
        by_source: dict[str, ClaimsFile] = {}
        for file in files:
            key = str(file.source["key"])
            if key in by_source:
                raise InputError(f"the source {key!r} is also in {by_source[key].path}", file.path)
            by_source[key] = file
        claims = {c.key: c for f in files for c in f.claims}
        pieces = {
            f"{key}#{name}": piece
            for key, f in by_source.items()
            for name, piece in f.workpieces.items()
        }
        return cls(claims, by_source, pieces, knowledge)

    def known(self, instance: Instance) -> Known | None:
        """What is certified, looked up once a problem."""
        if instance.sha256 not in self._known:
            self._known[instance.sha256] = self.knowledge.known(instance)
        return self._known[instance.sha256]


@dataclass(frozen=True, eq=False)
class _Judge:
    """One claim with everything around it; also looks up figures for its formulas."""

    book: _Book
    file: ClaimsFile
    claim: Claim
    suspect: bool = False

    def entry(self) -> Entry:
        """The verdict; a claim that cannot be understood stops the audit with its line."""
        judge: Mapping[str, Callable[[], Entry]] = {
            "workpiece": self.workpiece,
            "route": self.route,
            "statistics": self.statistics,
            "parameters": self.parameters,
            "arithmetic": self.arithmetic,
            "matrix": self.matrix,
        }
        try:
            entry = judge[self.claim.kind]()
        except InputError as error:
            if error.path is not None:
                raise
            text = f"claim {self.claim.id}: {error}"
            raise InputError(text, self.file.path, self.claim.line) from None
        damaged = self.claim.text("damaged")
        if not damaged:
            return entry
        return replace(entry, findings=(*entry.findings, finding("TCP701", damaged)))

    def make(
        self, facts: Mapping[str, str], found: Iterable[Finding], repairs: Repairs | None = None
    ) -> Entry:
        """The entry of this claim."""
        claim = self.claim
        note = {"Note": claim.text("note")} if claim.text("note") else {}
        return Entry(
            claim.key, claim.kind, claim.text("where"), {**facts, **note}, tuple(found), repairs
        )

    def problem(self) -> tuple[Instance | None, Known | None, dict[str, str]]:
        """Instance, certified knowledge, and facts about both."""
        instance = self.file.instance(self.claim)
        if instance is None:
            return None, None, {}
        known = self.book.known(instance)
        problem = f"{self.claim.text('workpiece')}, {_moves(instance)}"
        return instance, known, {"Problem": problem, **_bound(instance, known)}

    def workpiece(self) -> Entry:
        """A set of coordinates."""
        piece = self.file.workpieces[self.claim.id]
        found = workpiece_findings(self.claim, piece, self.book.claims, self.book.pieces)
        return self.make({"Holes": str(len(piece))}, found)

    def route(self) -> Entry:
        """A sequence, with or without a time."""
        claim = self.claim
        instance, known, facts = self.problem()
        if instance is None:
            raise InputError("a route needs a workpiece")
        order = order_of(
            claim.values["sequence"], instance.workpiece, claim.text("numbering") or "ids"
        )
        time = claim.number("time")
        verdict = validate(
            instance,
            order,
            claimed=time,
            known=known,
            optimal=bool(claim.values.get("optimal", False)),
        )
        if time is not None:
            facts["Claimed"] = time.text
        if verdict.time is not None:
            facts["Recomputed"] = decimal(verdict.time)
        facts["Sequence"] = _shown(claim.values["sequence"])
        found = [
            *verdict.findings,
            *quotation_findings(claim, self.book.claims, instance.workpiece),
        ]
        repairs = None if verdict.count.valid else repair(instance, order, known=known)
        if self.suspect and time is not None and "TCP201" in verdict.codes():
            try:
                more, suspected = suspicions(instance, order.entries, time, repairs)
            except UsageError as refusal:
                more, suspected = {"Misprints": str(refusal)}, []
            facts |= more
            found += suspected
        return self.make(facts, found, repairs)

    def statistics(self) -> Entry:
        """A column of a table of figures."""
        claim = self.claim
        instance, known, facts = self.problem()
        for key, given in claim.values.items():
            if isinstance(given, (Printed, int)) and key not in ("vx", "vy", "closed"):
                facts[key.replace("_", " ").capitalize()] = str(given)
        best = claim.number("best_time")
        if best is not None:
            facts["Claimed"] = best.text
        found = statistics_findings(claim, instance, known, self)
        return self.make(facts, found + quotation_findings(claim, self.book.claims, None))

    def parameters(self) -> Entry:
        """The parameters of an algorithm."""
        facts = dict(self.claim.values["values"])
        return self.make(facts, quotation_findings(self.claim, self.book.claims, None))

    def arithmetic(self) -> Entry:
        """A figure and its formula, or a comparison."""
        claim = self.claim
        facts = {"Statement": claim.text("statement")}
        figure = {"printed", "compute", "alternatives"} & claim.values.keys()
        if "holds" in claim.values and figure:
            raise InputError(f"arithmetic has either holds or {min(figure)}, not both")
        if "holds" in claim.values:
            true, a, b = comparison(claim.values["holds"], self)
            relation = _RELATIONS[claim.values["holds"][0]]
            text = f"{decimal(a)} is {'' if true else 'not '}{relation} {decimal(b)}"
            return self.make(facts, [finding("TCP505" if true else "TCP504", text)])
        if "printed" not in claim.values or "compute" not in claim.values:
            raise InputError("arithmetic needs printed and compute, or holds")
        facts["Claimed"] = _plain(claim.values["printed"])
        return self.make(facts, self.figure_findings(claim.values["printed"]))

    def figure_findings(self, printed: Printed | tuple[int, ...]) -> list[Finding]:
        """A printed figure against its formula, then against the alternatives."""
        exact = value(self.claim.values["compute"], self)
        agreement = _agreement(printed, exact)
        percent = isinstance(printed, Printed) and printed.percent
        shown, gives = _plain(printed), _brief(exact, percent)
        if agreement is Agreement.CUT:
            return [finding("TCP502", f"{shown} is {gives}, cut off")]
        if agreement.holds:
            rounded = ", rounded" if agreement is Agreement.ROUNDED else ""
            return [finding("TCP505", f"{shown} is {gives}{rounded}")]
        found = [finding("TCP501", f"printed {shown}, but the formula gives {gives}")]
        for says, formula in self.claim.values.get("alternatives", ()):
            if _agreement(printed, value(formula, self)).holds:
                found.append(finding("TCP503", f"{shown} is {says}"))
        return found

    def matrix(self) -> Entry:
        """A printed travel matrix."""
        instance = self.file.instance(self.claim)
        if instance is None:
            raise InputError("a matrix needs a workpiece")
        rows = [[parse_printed(v) for v in row.split()] for row in self.claim.values["rows"]]
        n = len(instance)
        if len(rows) != n or any(len(row) != n for row in rows):
            raise InputError(f"the matrix must have {n} rows of {n} numbers")
        exact = instance.form.full_matrix()
        found = [
            finding(
                "TCP606",
                f"from {instance.workpiece.ids[i]} to {instance.workpiece.ids[j]} takes "
                f"{decimal(int(exact[i, j]) * instance.quantum)}, not {rows[i][j]}",
            )
            for i in range(n)
            for j in range(n)
            if not rows[i][j].agreement(int(exact[i, j]) * instance.quantum).holds
        ]
        done = found or [finding("TCP609", f"all {n * n} entries are those of the coordinates")]
        return self.make({"Problem": f"{instance.name}, {_moves(instance)}"}, done)

    def _claim(self, name: str) -> tuple[ClaimsFile, Claim]:
        key = name if "#" in name else f"{self.claim.source}#{name}"
        if key not in self.book.claims:
            raise InputError(f"a formula refers to {key}, which is not among the audited files")
        claim = self.book.claims[key]
        return self.book.files[claim.source], claim

    def figure(self, claim: str, key: str) -> Fraction:
        """A printed figure of another claim."""
        found = self._claim(claim)[1]
        given = found.values.get(key, found.values.get("values", {}).get(key))
        if isinstance(given, Printed):
            return given.value
        if given is None or isinstance(given, (bool, tuple)):
            raise InputError(f"{found.key} has no figure {key!r}")
        return parse_printed(given).value

    def time(self, claim: str) -> Fraction:
        """The recomputed time of another claim's sequence."""
        file, found = self._claim(claim)
        instance = file.instance(found)
        if instance is None or "sequence" not in found.values:
            raise InputError(f"{found.key} has no sequence")
        order = order_of(
            found.values["sequence"], instance.workpiece, found.text("numbering") or "ids"
        )
        if order.unknown:
            raise InputError(f"{found.key} has entries that are no holes")
        return walk(instance, order.entries) * instance.quantum

    def optimum(self, claim: str) -> Fraction:
        """The certified optimum of another claim's problem."""
        file, found = self._claim(claim)
        instance = file.instance(found)
        known = None if instance is None else self.book.known(instance)
        if instance is None or known is None or not known.optimal:
            raise InputError(f"no optimum is certified for the problem of {found.key}")
        return known.lower * instance.quantum


def _agreement(printed: Printed | tuple[int, ...], exact: Fraction | tuple[int, ...]) -> Agreement:
    if isinstance(printed, Printed) and isinstance(exact, Fraction):
        return printed.agreement(exact)
    return Agreement.EXACT if printed == exact else Agreement.DIFFERENT


_RELATIONS = {
    "greater": "greater than",
    "at-least": "at least",
    "less": "less than",
    "at-most": "at most",
    "equal": "equal to",
}


def _plain(printed: Printed | tuple[int, ...]) -> str:
    return printed.text if isinstance(printed, Printed) else " ".join(map(str, printed))


def _brief(exact: Fraction | tuple[int, ...], percent: bool = False) -> str:
    if isinstance(exact, tuple):
        return " ".join(map(str, exact))
    if percent:
        return f"{_brief(exact * 100)}%"
    text = decimal(exact)
    if len(text) <= 20 and "/" not in text:
        return text
    try:
        return f"{float(exact):.8g}"
    except OverflowError:
        return f"about 10^{len(str(int(abs(exact)))) - 1}"


def _moves(instance: Instance) -> str:
    ends = instance.ends
    parts = [str(instance.travel.model)]
    if instance.travel.vx != 1 or instance.travel.vy != 1:
        parts.append(f"vx {decimal(instance.travel.vx)}, vy {decimal(instance.travel.vy)}")
    parts.append("closed" if ends.closed else "open" if ends.home is None else "with home legs")
    return ", ".join(parts)


def _shown(sequence: str | tuple[str, ...]) -> str:
    text = sequence if isinstance(sequence, str) else " ".join(sequence)
    return text if len(text) <= 400 else f"{text[:397]}..."
