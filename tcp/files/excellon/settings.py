"""What a drill file says about its numbers, and what to do where it is silent.

Units, number format and zero rule are stated in many places: ``METRIC,LZ``,
``METRIC,000.000``, ``;FILE_FORMAT=4:4``, KiCad's and Siemens' comments,
``M71``.  :class:`Settings` collects them with their lines, refuses
contradictions, falls back on a sidecar file and on the caller's
:class:`Hints`, and refuses to read a number that nobody explains.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Generic, TypeVar

from tcp.errors import InputError, UsageError
from tcp.files.excellon.bulk import Numbers
from tcp.files.excellon.document import Ints
from tcp.files.excellon.numbers import Digits, Style, Units, Zeros, parse_digits, pointed, unpointed
from tcp.words import shown

STANDARD = {Units.INCH: Digits(2, 4), Units.MM: Digits(3, 3)}
"""The formats that INCH and METRIC mean where nothing else is said."""

T = TypeVar("T")


@dataclass(frozen=True)
class Hints:
    """What the caller knows about a file that the file does not state.

    Parameters
    ----------
    units : Units, optional
        ``--units``.
    digits : Digits, optional
        ``--format``.
    zeros : Zeros, optional
        ``--zeros``: the zeros that are kept.
    unfinished : bool
        Accept a file without its end (M30).
    sidecar : path, optional
        The Allegro ``nc_param.txt`` or Altium ``.DRR`` that belongs to the file.
    """

    units: Units | None = None
    digits: Digits | None = None
    zeros: Zeros | None = None
    unfinished: bool = False
    sidecar: Path | None = None


@dataclass(frozen=True)
class Sidecar:
    """What a file beside the drill file says about it; ``counts``: holes by tool."""

    path: Path
    units: Units | None = None
    digits: Digits | None = None
    zeros: Zeros | None = None
    incremental: bool = False
    counts: Mapping[int, int] = field(default_factory=dict)


@dataclass
class Stated(Generic[T]):
    """A value with the line that states it (0: not the file itself)."""

    flag: str
    value: T | None = None
    line: int = 0
    source: str = ""

    def __post_init__(self) -> None:
        self.source = f"--{self.flag}"

    def state(self, value: T, line: int, path: Path) -> None:
        """Take a value, unless another one stands already."""
        if self.value is not None and self.value != value:
            where = f"line {self.line}" if self.line else self.source
            raise InputError(
                f"states {self.flag} {value}, but {where} says {self.value}", path, line
            )
        if self.value is None or not self.line:
            self.value, self.line = value, line

    def offer(self, value: T | None, source: Path, path: Path) -> None:
        """Take a sidecar's value; it must not contradict."""
        if value is None:
            return
        if self.value is not None and self.value != value:
            raise InputError(
                f"the sidecar {source.name} says {self.flag} {value}, but the file or a flag says "
                f"{self.value}; correct or remove the sidecar",
                path,
                self.line or None,
            )
        if self.value is None:
            self.value, self.source = value, f"the sidecar {source.name}"


@dataclass
class Settings:
    """The number settings of one file, growing while it is read."""

    path: Path
    hints: Hints = field(default_factory=Hints)
    sidecar: Sidecar | None = None

    def __post_init__(self) -> None:
        self.units: Stated[Units] = Stated("units", self.hints.units)
        self.digits: Stated[Digits] = Stated("format", self.hints.digits)
        self.zeros: Stated[Zeros] = Stated("zeros", self.hints.zeros)
        self.pointed = False
        self.unpointed = False
        self.short = False
        self.plus = False
        self.places = 0
        self._settled: Digits | None = None
        self._memo: dict[bytes, int] = {}
        if self.sidecar is not None:
            beside = self.sidecar
            self.units.offer(beside.units, beside.path, self.path)
            self.digits.offer(beside.digits, beside.path, self.path)
            self.zeros.offer(beside.zeros, beside.path, self.path)

    def value(self, text: bytes, line: int) -> int:
        """A coordinate in units of ``10**-PLACES``.

        Raises
        ------
        InputError
            Where units, format or zeros are needed and not stated.
        """
        known = self._memo.get(text)
        if known is not None:
            return known
        if self.units.value is None:
            self._refuse_units(line)
        try:
            value = self._pointed(text) if b"." in text else self._unpointed(text, line)
        except ValueError:
            raise InputError(self._too_long(text), self.path, line) from None
        self.plus = self.plus or text[:1] == b"+"
        if len(self._memo) > 200_000:
            self._memo.clear()
        self._memo[text] = value
        return value

    def values(self, numbers: Numbers) -> Ints | None:
        """Coordinates in units of ``10**-PLACES``; None where :meth:`value` has to look at each."""
        if self.units.value is None:
            return None
        bare = ~numbers.pointed
        digits = self.settle() if bare.any() else STANDARD[self.units.value]
        values = numbers.values(digits, self.zeros.value)
        if values is None:
            return None
        if bare.any():
            self.unpointed = True
            self.short = self.short or bool((numbers.count[bare] < digits.width).any())
            self.places = max(self.places, digits.decimals)
        if numbers.pointed.any():
            self.pointed = True
            self.places = max(self.places, int(numbers.decimals.max()))
        self.plus = self.plus or bool(numbers.plus.any())
        return values

    def length(self, text: bytes, line: int) -> Fraction | None:
        """A tool's diameter in mm; None where it is not given, 0 or without a decimal point."""
        if not text or (b"." not in text and len(text) > 2):
            return None
        units = self.units.value
        if units is None:
            self._refuse_units(line)
        assert units is not None
        try:
            diameter = Fraction(text.decode()) * units.in_mm
        except ValueError:
            raise InputError(f"{shown(text)} is no diameter", self.path, line) from None
        if diameter < 0:
            raise InputError(f"{shown(text)} is no diameter: it is negative", self.path, line)
        return diameter or None

    def style(self) -> Style:
        """How the file writes its numbers."""
        digits = self._settled if self.unpointed else None
        zeros = self.zeros.value if self.short else None
        return Style(self.places, digits, zeros, self.plus)

    def _pointed(self, text: bytes) -> int:
        value, decimals = pointed(text)
        self.pointed = True
        self.places = max(self.places, decimals)
        return value

    def _unpointed(self, text: bytes, line: int) -> int:
        digits = self.settle()
        self.unpointed = True
        value = unpointed(text, digits, self.zeros.value)
        if value is None:
            raise InputError(
                f"{shown(text)} has fewer than the {digits.width} digits of format {digits}, and "
                f"the file does not say which zeros are missing; pass --zeros lz if it keeps the "
                f"leading zeros, --zeros tz if it keeps the trailing ones",
                self.path,
                line,
            )
        self.short = self.short or len(text.lstrip(b"+-")) < digits.width
        self.places = max(self.places, digits.decimals)
        return value

    def settle(self) -> Digits:
        """The format that numbers without a point have; fixed from the first of them on."""
        if self._settled is None:
            assert self.units.value is not None
            self._settled = self.digits.value or STANDARD[self.units.value]
        return self._settled

    def _too_long(self, text: bytes) -> str:
        if b"." in text:
            expected = "expected at most 8 digits and 9 decimals"
            return f"{shown(text)} is no coordinate of a board; {expected}"
        digits, stated = self.settle(), self.digits.value is not None
        source = "the stated" if stated else f"the {self.units.value} standard"
        return (
            f"{shown(text)} has more than the {digits.width} digits of {source} format {digits}; "
            f"pass the true one as --format, or put Allegro's nc_param.txt beside the file"
        )

    def _refuse_units(self, line: int) -> None:
        raise InputError(
            "the file does not state its units; pass --units mm or --units inch"
            " (and --format and --zeros where they are not standard)",
            self.path,
            line,
        )

    def state_units(self, units: Units, line: int) -> None:
        """``METRIC``, ``INCH``, ``M71``, ``M72`` or a comment that says so."""
        self.units.state(units, line, self.path)

    def state_digits(self, digits: Digits, line: int) -> None:
        """A number format; too late once numbers have been read in another one."""
        self.digits.state(digits, line, self.path)
        if self._settled is not None and self._settled != digits:
            raise InputError(
                f"states the format {digits} after coordinates in {self._settled}", self.path, line
            )

    def _state_format(self, text: str, line: int) -> None:
        """A format as a comment spells it."""
        try:
            digits = parse_digits(text)
        except UsageError as error:
            raise InputError(f"states a format, but {error}", self.path, line) from None
        self.state_digits(digits, line)

    def state_zeros(self, zeros: Zeros, line: int) -> None:
        """``LZ`` or ``TZ``."""
        self.zeros.state(zeros, line, self.path)

    def unit_line(self, text: str, line: int) -> bool:
        """Read ``METRIC``, ``INCH``, ``M71``, ``M72`` with what follows; False if it is not one."""
        word, *rest = [part.strip() for part in text.upper().split(",")]
        units = {"METRIC": Units.MM, "M71": Units.MM, "INCH": Units.INCH, "M72": Units.INCH}
        if word not in units:
            return False
        self.state_units(units[word], line)
        for part in rest:
            if part in ("LZ", "TZ"):
                self.state_zeros(Zeros(part.lower()), line)
            elif re.fullmatch(r"0+\.0+", part):
                whole, _, decimals = part.partition(".")
                self._state_format(f"{len(whole)}:{len(decimals)}", line)
            elif part:
                expected = "expected LZ, TZ or a format like 000.000"
                message = f"{shown(part)} after {word} is unknown; {expected}"
                raise InputError(message, self.path, line)
        return True

    def comment(self, text: str, line: int) -> None:
        """Formats stated in comments by Altium, P-CAD, EasyEDA, Eagle, KiCad and Siemens."""
        found = re.match(r";\s*FILE_FORMAT\s*=\s*(\d[^\s;,]*)", text)
        if found:
            self._state_format(found[1], line)
        found = re.match(r";\s*FORMAT=\{(-:-|\d+:\d+)\s*/[^/]*/\s*(inch|metric)\s*/([^}]*)", text)
        if found:
            if found[1] != "-:-":  # numbers carry a point
                self._state_format(found[1], line)
            self.state_units(Units.INCH if found[2] == "inch" else Units.MM, line)
            if "suppress" in found[3]:
                self.state_zeros(Zeros.TZ if "lead" in found[3] else Zeros.LZ, line)
        found = re.match(r";\s*Format\s*:\s*(\d+\.\d+)\s*/\s*\w+\s*/\s*(Inch|MM)", text)
        if found:
            self._state_format(found[1], line)
            self.state_units(Units.INCH if found[2] == "Inch" else Units.MM, line)
