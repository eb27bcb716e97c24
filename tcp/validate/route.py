"""Is this a route of this instance, and what does it cost?

The facade passes every solver's answer through here before anybody sees it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from tcp.instance import Instance
from tcp.rules import long_runs, unbalanced


def faults(instance: Instance, route: Sequence[int]) -> list[str]:
    """Everything that keeps ``route`` from being a route of ``instance``, in words.

    Parameters
    ----------
    instance : Instance
        The problem.
    route : sequence of int
        Holes in drilling order, by position in the workpiece (from 0).

    Returns
    -------
    list of str
        One sentence a fault; empty for a valid route.
    """
    ids, n = instance.workpiece.ids, len(instance)
    count = Counter(route)
    found = [f"there is no hole number {h}" for h in sorted(count) if not 0 <= h < n]
    found += [
        f"hole {ids[h]} is drilled {c} times" for h, c in count.items() if c > 1 and 0 <= h < n
    ]
    if len(count) < n or found:
        found += [f"hole {ids[h]} is not drilled" for h in range(n) if h not in count]
    if found:
        return found
    return (
        _end_faults(instance, route) + _rule_faults(instance, route) + _move_faults(instance, route)
    )


def _end_faults(instance: Instance, route: Sequence[int]) -> list[str]:
    ids, ends = instance.workpiece.ids, instance.ends
    found = []
    if ends.start is not None and route[0] != ends.start:
        found.append(f"the route starts at hole {ids[route[0]]}, not at {ids[ends.start]}")
    if ends.end is not None and route[-1] != ends.end:
        found.append(f"the route ends at hole {ids[route[-1]]}, not at {ids[ends.end]}")
    return found


def _rule_faults(instance: Instance, route: Sequence[int]) -> list[str]:
    form, ids = instance.form, instance.workpiece.ids
    if not form.forbidden and not instance.rules.together:
        return []
    tour = instance.tour(route)
    used = {(min(p), max(p)) for p in zip(tour, tour[1:] + tour[:1], strict=True)}
    found = [
        f"holes {ids[i]} and {ids[j]} must not follow each other"
        for i, j in form.forbidden
        if (i, j) in used
    ]
    together = sorted({(min(p), max(p)) for p in instance.rules.together})
    return found + [
        f"holes {ids[i]} and {ids[j]} must follow each other"
        for i, j in together
        if (i, j) not in used
    ]


def _move_faults(instance: Instance, route: Sequence[int]) -> list[str]:
    """Rules about successive moves, measured along the route."""
    rules, piece = instance.rules, instance.workpiece
    x, y = piece.x[list(route)], piece.y[list(route)]
    found = []
    if rules.axis_run is not None:
        found += [
            f"{length} successive moves from hole {piece.ids[route[first]]} on follow one axis, "
            f"more than {rules.axis_run}"
            for first, length in long_runs(x, y, rules.axis_run)
        ]
    if rules.balance is not None and rules.balance.most is not None:
        count = len(unbalanced(x, y, rules.balance))
        if count > rules.balance.most:
            found.append(
                f"{count} windows of {rules.balance.window} moves are unbalanced, "
                f"more than {rules.balance.most}"
            )
    return found
