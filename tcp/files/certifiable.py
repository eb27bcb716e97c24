"""Which instances certificates can be about."""

from __future__ import annotations

from tcp.errors import UsageError
from tcp.instance import Instance


def certifiable(instance: Instance) -> None:
    """See before the work that there can be a certificate of it.

    Raises
    ------
    UsageError
        For rules that the format does not know.
    """
    rules = instance.rules
    names = {
        "a jump in diameters": rules.jump_diameters,
        "axis balance": rules.balance,
        "a longest axis run": rules.axis_run,
    }
    unknown = [name for name, value in names.items() if value is not None]
    if unknown:
        raise UsageError(f"certificates know no rule about {unknown[0]}; drop one of the two")
