"""The colour of a path: blue where it begins, through violet, red where it ends."""

from __future__ import annotations


def shade(t: float) -> str:
    """Colour at ``t`` in [0, 1]."""
    stops = [(33, 102, 172), (140, 70, 160), (203, 24, 29)]
    low, share = (stops[:2], 2 * t) if t < 0.5 else (stops[1:], 2 * t - 1)
    mixed = (round(a + (b - a) * share) for a, b in zip(*low, strict=True))
    return "#" + "".join(f"{channel:02x}" for channel in mixed)


def shaded(moves: int, most: int) -> list[tuple[str, int, int]]:
    """A path of so many moves in at most ``most`` pieces: colour, first and last place of each."""
    pieces = min(moves, most)
    cuts = [moves * k // pieces for k in range(pieces + 1)] if pieces else []
    return [(shade(k / max(pieces - 1, 1)), cuts[k], cuts[k + 1]) for k in range(pieces)]
