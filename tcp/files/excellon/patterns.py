"""Repeats of a hit (R) and of a pattern (M25 ... M01, M02, M08).

Reading chosen where the manuals are silent: the shifts of successive M02 add
up; M70, M80 and M90 swap or mirror the pattern about the program's zero, as
it was first drilled, before it is shifted; after a copy the machine's position
is taken as unknown, so the next coordinates must name both axes.
"""

from __future__ import annotations

from tcp.files.excellon.program import Copy, Kind, Mark, Repeat
from tcp.files.excellon.state import State, Words, code_of

FORMAT_1 = {2: 30, 24: 1, 26: 2, 1: 6, 27: 8, 0: 9, 21: 80, 22: 90}
"""M-codes of ``FMAT,1`` and what they are called in format 2."""

_FORMAT_2 = {code: own for own, code in FORMAT_1.items()}


class Patterns(State):
    """The part of the reader that repeats things."""

    def _m(self, code: int) -> str:
        """What the file calls an M-code."""
        return f"M{_FORMAT_2.get(code, code) if self.format_1 else code:02d}"

    def _meant(self, code: int) -> int:
        """What an M-code of the file is called in format 2."""
        return FORMAT_1.get(code, code) if self.format_1 else code

    def _repeat(self, words: Words) -> None:
        found = dict(words)
        if [letter for letter, _ in words[1:3]][:1] == ["M"]:
            if self._meant(code_of(words[1][1])) != 2:
                self.refuse(f"R repeats copies by {self._m(2)}, not by another M-code")
            self._pattern_code(2, words[2:], self._count(words))
            return
        row = len(self.columns[0]) - 1
        last_hit = row >= 0 and self.columns[0][row] == Kind.HIT
        if not last_hit or self.columns[9][row] != self.barrier or self.open:
            self.refuse("R repeats a hit, but no hit stands before it")
        if not found.keys() <= {"R", "X", "Y"} or not 2 <= len(found) == len(words):
            self.refuse("R needs a count and a step in X or Y")
        line = self.at + 1
        dx = self.settings.value(found["X"], line) if "X" in found else 0
        dy = self.settings.value(found["Y"], line) if "Y" in found else 0
        count = self._count(words)
        self._multiply(count)
        self.repeats.setdefault(row, []).append(Repeat(count, dx, dy, self.at))
        assert self.x is not None and self.y is not None
        self.x, self.y = self.x + count * dx, self.y + count * dy
        self.columns[4][row], self.columns[5][row] = self.x, self.y
        self.columns[7][row] = self.at + 1
        self.columns[8][row] |= Mark.FREE

    def _count(self, words: Words) -> int:
        text = words[0][1]
        if not text.isdigit() or not 0 < int(text) <= 1_000_000:
            self.refuse("R needs a count from 1 to 1,000,000")
        return int(text)

    def _pattern_code(self, code: int, rest: Words, times: int = 1) -> None:
        self._flush_open()
        self._barrier()
        self.pattern_codes += 1
        here = len(self.columns[0])
        if code == 25:
            if self.pattern_from is not None:
                if self.pattern_named:
                    self._unended()
                self._barrier()  # the hits before, in an open pattern, are no neighbours
            self._close_pattern()
            self.pattern_named = True
            self.pattern_codes, self.pattern_enter = 1, self.barrier - 1
            self.pattern_from, self.pattern_line = here, self.at
            self.before_pattern = self.holes
            self.pattern = None
        elif code == 1:
            if self.pattern_from is None:
                self.refuse(f"{self._m(1)} ends a pattern, but no M25 begins one")
            assert self.pattern_from is not None
            self.pattern, self.pattern_from = (self.pattern_from, here), None
            self.in_pattern = self.holes - self.before_pattern
        elif code == 8:
            if self.pattern_from is not None:
                ends, missing = self._m(8), self._m(1)
                self.refuse(f"{ends} ends step and repeat, but the pattern's {missing} is missing")
            self._close_pattern(by_name=True)
        elif rest:
            self._copy(rest, times)
        elif self.pattern is None:
            self._incomplete()

    def _unended(self) -> None:
        self.at = self.pattern_line
        self.refuse(f"the pattern that begins here has no end ({self._m(1)})")

    def _incomplete(self) -> None:
        copies, before = self._m(2), f"M25 ... {self._m(1)}"
        self.refuse(f"{copies} repeats a pattern, but none is complete; expected {before} before")

    def _copy(self, rest: Words, times: int) -> None:
        if self.pattern is None:
            self._incomplete()
        shift = {letter: text for letter, text in rest if letter in "XY" and text}
        codes = {self._meant(code_of(text)) for letter, text in rest if letter == "M"}
        twice = len(shift) < sum(letter in "XY" for letter, _ in rest)
        if not codes <= {70, 80, 90} or twice or any(c not in "XYM" for c, _ in rest):
            known = f"X, Y, M70, {self._m(80)} and {self._m(90)}"
            self.refuse(f"{self._m(2)} is followed by something else than {known}")
        line = self.at + 1
        before = self.copies[-1] if self.copies else Copy(0, 0)
        dx, dy = (self.settings.value(shift[a], line) if a in shift else 0 for a in "XY")
        self._multiply(times * self.in_pattern)
        turned = (70 in codes, 80 in codes, 90 in codes)
        if self.in_pattern:  # copies of nothing are nothing
            self.copies += [
                Copy(before.dx + n * dx, before.dy + n * dy, *turned) for n in range(1, times + 1)
            ]
        self.x = self.y = None
