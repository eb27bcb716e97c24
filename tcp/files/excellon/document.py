"""A drill file as text: every byte belongs to one line, and every line to the file.

The reader never throws text away and the writer never makes a file up: a
:class:`Document` is the bytes as they were found, cut into lines that keep
their own line ending.  Writing the lines back gives the same bytes, whatever
they contain.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]

_CHUNK = 1 << 22

ENDINGS = (b"\r\n", b"\n", b"\r")


@dataclass(frozen=True, eq=False)
class Document:
    """The bytes of a file and where its lines begin.

    Parameters
    ----------
    data : bytes
        The whole file.
    starts : int64 array of shape (lines + 1,)
        Offsets of the lines' first bytes, and the file's length.
    """

    data: bytes = field(repr=False)
    starts: Ints = field(repr=False)

    def __len__(self) -> int:
        return len(self.starts) - 1

    def line(self, number: int) -> bytes:
        """Line ``number`` (from 0) with its ending."""
        return self.data[self.starts[number] : self.starts[number + 1]]

    def text(self, first: int, last: int) -> bytes:
        """Lines ``first`` to ``last - 1``, as one piece."""
        return self.data[self.starts[first] : self.starts[last]]

    def lines(self) -> Iterator[bytes]:
        """All lines in order; joined, they are the file."""
        return (self.line(i) for i in range(len(self)))

    def endings(self, lines: NDArray[np.integer[Any]]) -> NDArray[np.uint8]:
        """How the lines right before some lines end: 10 LF, 1 CR LF, 13 CR, 0 not at all."""
        data, stop = np.frombuffer(self.data, dtype=np.uint8), self.starts[lines]
        last: NDArray[np.uint8] = data[stop - 1]
        before = data[np.maximum(stop - 2, 0)]
        last[(last != 10) & (last != 13)] = 0
        last[(last == 10) & (before == 13)] = 1
        return last

    def write(self) -> bytes:
        """The file again, from its lines."""
        return b"".join(self.lines())


def cut(data: bytes) -> Document:
    """Cut a file into lines; any of LF, CR LF and CR ends one."""
    found = [np.zeros(1, dtype=np.int64)]
    for at in range(0, len(data), _CHUNK):
        here = np.frombuffer(data, np.uint8, min(_CHUNK, len(data) - at), at)
        ends = here == 10
        if b"\r" in data[at : at + _CHUNK]:
            following = np.append(
                here[1:], np.uint8((data[at + _CHUNK : at + _CHUNK + 1] or b"\0")[0])
            )
            ends |= (here == 13) & (following != 10)
        found.append(np.flatnonzero(ends) + at + 1)
    starts = np.concatenate(found)
    if starts[-1] != len(data):
        starts = np.append(starts, len(data))
    return Document(data, starts)


def ending(line: bytes) -> bytes:
    """The line's own ending; empty for an unfinished last line."""
    return next((e for e in ENDINGS if line.endswith(e)), b"")
