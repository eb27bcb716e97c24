"""What is asked for, and a board before and after."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path

from tcp.boards.chain import ToolOrder
from tcp.boards.choose import Solved
from tcp.boards.effort import Effort
from tcp.boards.machine import Machine
from tcp.boards.trail import Costs, Point
from tcp.errors import UsageError
from tcp.files.excellon import Program
from tcp.result import Proof
from tcp.travel import CostRule


@dataclass(frozen=True)
class Wishes:
    """What to do with a board.

    Parameters
    ----------
    machine : Machine
        How it moves.
    effort : Effort
        How hard to try.
    time_limit : float, optional
        Seconds a tool; default: the effort's own.
    seed : int
        Source of all randomness.
    start, park : (x, y), optional
        Where the machine stands before, and goes to after the job, in mm.
    keep_first : int
        The first so many holes stay where they are (alignment holes).
    keep : frozenset of int
        Tools whose order stays.
    tool_order : ToolOrder
        The order of tools: the file's, by diameter, or the shortest.
    merge : bool
        Select each tool once.
    expand : bool
        Write repeats and step-and-repeat blocks out hole by hole.
    certificates : path, optional
        Folder for a certificate of every stretch that is proved.
    panels : bool
        Solve a board that is repeated k x m once, and link its copies.
    check : bool
        Whether the file is only to be judged: the report says how much of its travel is needed.

    Raises
    ------
    UsageError
        If the first holes are to stay in front, but their tools may move.
    """

    machine: Machine = field(default_factory=Machine)
    effort: Effort = Effort.NORMAL
    time_limit: float | None = None
    seed: int = 0
    start: Point | None = None
    park: Point | None = None
    keep_first: int = 0
    keep: frozenset[int] = frozenset()
    tool_order: ToolOrder = ToolOrder.KEEP
    merge: bool = False
    expand: bool = False
    certificates: Path | None = None
    panels: bool = True
    check: bool = False

    def __post_init__(self) -> None:
        if self.keep_first and (self.merge or self.tool_order is not ToolOrder.KEEP):
            raise UsageError(
                "--keep-first keeps the file's first holes in front, so tools stay where they are; "
                "drop --tool-order and --merge-tool-selections"
            )

    @property
    def text_guard(self) -> str:
        """How far the text around the units has to stay the same; see ``compare``."""
        if self.merge or self.expand:
            return "free"
        return "same" if self.tool_order is ToolOrder.KEEP else "moved"


@dataclass(frozen=True)
class Part:
    """A tool selection, before and after; costs in quanta.

    Parameters
    ----------
    number : int
        Its position among the file's selections.
    tool : int
        The tool.
    holes : int
        Holes, slots and paths.
    before, after : int
        Travel inside the selection.
    bound : int or None
        What it takes at least; None where nothing is known.
    proof : Proof
        How ``after`` equals ``bound``, if it does.
    solved : tuple of Solved
        What was solved; empty where the order is locked or leaves no choice.
    locked : bool
        Whether the user locked it.
    unclear : bool
        Whether it stays since not all of its lines are understood.
    proved : bool
        Whether the shortest order is known.  It may differ from the one chosen,
        where the way to the next tool weighs more.
    saves : int
        What a path that is longer than the shortest known saves between the tools.
    """

    number: int
    tool: int
    holes: int
    before: int
    after: int
    bound: int | None
    proof: Proof = Proof.NONE
    solved: tuple[Solved, ...] = ()
    locked: bool = False
    unclear: bool = False
    proved: bool = False
    saves: int = 0

    @property
    def seconds(self) -> float:
        """Time spent on it."""
        return sum(s.answer.seconds for s in self.solved)

    @property
    def optimal(self) -> bool:
        """Whether its order is proved shortest, not only kept."""
        if self.locked or self.unclear:
            return False
        return self.bound is not None and self.bound >= self.after

    def sharpened(self, bound: int) -> Part:
        """With another bound on its travel, where that is the better one."""
        if self.unclear or (self.bound is not None and bound <= self.bound):
            return self
        closed = bound >= self.after
        proof = Proof.TRUSTED if closed else self.proof
        return replace(self, bound=bound, proof=proof, proved=self.proved or closed)


@dataclass(frozen=True, eq=False)
class Board:
    """A board before and after.

    Parameters
    ----------
    before, after : Program
        As read, and as read back from ``data``.
    data : bytes
        The new file; the old one where nothing better was found.
    parts : tuple of Part
        The tool selections in the old file's order.
    costs_before, costs_after : Costs
        Travel of both.
    bound : int
        Travel that any order of the file needs, tool order kept.
    rule : CostRule
        Costs of moves; its quantum is what one unit of all costs here is worth.
    wishes : Wishes
        What was asked for.
    notes : tuple of str
        What the reader and the optimiser have to say.
    interrupted : bool
        Whether Ctrl-C cut the work short.
    text_guard : str
        How far the text around the units must be the same; see ``compare``.
    order_gain : int
        What the new order of tools saves against the file's own order of tools.
    ends_gain : int
        What is saved by paths that begin and end where their neighbours want them to.
    """

    before: Program
    after: Program
    data: bytes = field(repr=False)
    parts: tuple[Part, ...]
    costs_before: Costs
    costs_after: Costs
    bound: int
    rule: CostRule
    wishes: Wishes
    notes: tuple[str, ...] = ()
    interrupted: bool = False
    text_guard: str = "same"
    order_gain: int = 0
    ends_gain: int = 0

    @property
    def original(self) -> bytes:
        """The input's bytes."""
        return self.before.document.data

    @property
    def changed(self) -> bool:
        """Whether the new file differs."""
        return self.data != self.original

    @property
    def proved(self) -> bool:
        """Whether every tool's shortest order is known."""
        return all(part.proved for part in self.parts)

    def worth(self, cost: int) -> Fraction:
        """Seconds (mm at unit speed) of a cost."""
        return cost * self.rule.quantum
