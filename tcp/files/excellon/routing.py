"""Routed paths (G00, M15, G01 ... M16), slots (G85) and canned cycles."""

from __future__ import annotations

from tcp.files.excellon.patterns import Patterns
from tcp.files.excellon.program import Kind, Mark, Motion
from tcp.files.excellon.state import DRILL, ROUT, Words, code_of


class Routing(Patterns):
    """The part of the reader that follows the router."""

    def _route(self, code: int, words: Words, named: bool = True) -> None:
        """A rout move; ``named`` if its own line says G00 to G03."""
        found = dict(words)
        if not found.keys() <= {"X", "Y", "A", "I", "J"} or len(found) < len(words):
            self.refuse("a rout move takes X, Y, A, I and J only")
        self.mode, self.motion = ROUT, code
        complete = "X" in found and "Y" in found and not self.incremental
        if code == 0:
            if self.down:
                self.refuse("G00 while the router is down; expected M16 before")
            self._flush_open()
        if not {"X", "Y"} & found.keys():
            if found:
                self.refuse("an arc without its end; expected X and Y")
            if not self.open:
                self._barrier()
            return
        if not self.open:
            self._begin()
        x, y = self._place(found.get("X"), found.get("Y"))
        arc = tuple((k, self.settings.value(found[k], self.at + 1)) for k in "AIJ" if k in found)
        if not self.open:
            self.open_first = self.at
            self.open_mark = Mark.COMPLETE if complete else Mark(0)
            if self.incremental:
                self.open_mark |= Mark.INCREMENTAL
            self.open_state = (self.barrier, self.compensated)
            if code or not named:
                self.open_mark |= Mark.FIXED
        self.open.append(Motion(code, x, y, arc, self.at))

    def _plunge(self) -> None:
        if self.mode != ROUT or not self.open:
            self.refuse("M15 plunges the router, but no G00 positions it")
        if len(self.open) > 1:
            self.open_mark |= Mark.FIXED
        self.down = True
        self.open_mark |= Mark.PLUNGED

    def _retract(self) -> None:
        if self.down:
            self._close_route(self.at)
        elif not self.open:
            self._barrier()
        self.down = False

    def _flush_open(self) -> None:
        """End a rout that no M16 ends; it stays where it is."""
        if self.down:
            self.refuse("the router is still down; expected M16 or M17 before")
        if len(self.open) > 1:
            self.open_mark |= Mark.FIXED
            self.note("a rout without M15 is kept in its place")
            self._close_route(self.open[-1].line)
        elif self.open and self.tool is not None:
            self.open_mark |= Mark.FIXED
            self._close_route(self.open[0].line)
        elif self.open:
            self._barrier()
        self.open = []

    def _close_route(self, last: int) -> None:
        moves, mark = tuple(self.open), self.open_mark
        start, end = moves[0], moves[-1]
        if self.open_state != (self.barrier, self.compensated):
            mark |= Mark.FIXED  # a command inside outlasts the path
        straight = len(moves) == 2 and end.code == 1 and not end.arc
        straight = straight and not self.compensated and not self.incremental
        if straight and not mark & Mark.FIXED:
            mark |= Mark.FREE
        here, self.at = self.at, last
        row = self._row(Kind.ROUTE, (start.x, start.y, end.x, end.y), self.open_first, mark)
        self.columns[8][row] = mark  # incremental or not as it began, not as it ends
        self.at, self.routes[row], self.open = here, moves, []

    def _drill_mode(self, alone: bool) -> None:
        """G05: back to drilling; ``alone`` on its line, it belongs to the path that it ends."""
        if self.mode == ROUT:
            self._flush_open()
            row = len(self.columns[0]) - 1
            if alone and row in self.routes and self.columns[7][row] == self.at:
                self.columns[7][row] = self.at + 1
                self.columns[8][row] |= Mark.DRILLS_AFTER
            else:
                self._barrier()
        self.mode, self.motion = DRILL, 0

    def _canned(self, words: Words) -> None:
        """``X#Y#G85X#Y#`` and the drilled patterns of G82, G83, G84 and G87."""
        at = [letter for letter, _ in words].index("G")
        code = code_of(words[at][1])
        start, end = dict(words[:at]), dict(words[at + 1 :])
        if not start:
            self.refuse(f"G{code} without the place where it begins; expected X#Y#G{code}X#Y#")
        twice = len(start) + len(end) < len(words) - 1
        if code not in (82, 83, 84, 85, 87) or not start.keys() | end.keys() <= {"X", "Y"} or twice:
            self.refuse(f"G{code:02d} behind coordinates is not understood; expected G85")
        if self.incremental:
            self.refuse(f"G{code} in incremental mode is not understood")
        self._begin()
        x1, y1 = self._place(start.get("X"), start.get("Y"))
        complete = Mark.COMPLETE if len(start) == 2 else Mark(0)
        if code == 85:
            if not end:
                self.refuse("G85 without the slot's second end")
            x2, y2 = self._place(end.get("X"), end.get("Y"))
            self._row(Kind.SLOT, (x1, y1, x2, y2), self.at, complete | Mark.FREE)
            return
        values = [(axis, self.settings.value(end[axis], self.at + 1)) for axis in sorted(end)]
        row = self._row(Kind.CANNED, (x1, y1, x1, y1), self.at, complete | Mark.FIXED)
        self.routes[row] = (Motion(code, x1, y1, tuple(values), self.at),)
        self.note(f"the pattern drilled by G{code} is kept in its place and counts as one")
        self.x = self.y = None
