"""Running a native solver so that it can be stopped.

A solver in C++ holds the main thread until it returns, and Python delivers
Ctrl-C only to the main thread.  So the native call runs in a thread of its
own, and the main thread looks at the clock many times a second.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

from tcp.stop import StopReason

T = TypeVar("T")

PERIOD = 0.05
"""Seconds between two looks at the clock."""


def attend(
    call: Callable[[], T], watch: Callable[[], StopReason | None], cancel: Callable[[], None]
) -> tuple[T, StopReason | None]:
    """Run ``call`` in a thread until it returns; cancel it once ``watch`` names a reason.

    Parameters
    ----------
    call : callable
        The native solve.
    watch : callable
        Asked every :data:`PERIOD` seconds, in the calling thread.
    cancel : callable
        Makes ``call`` return soon; called again each period until it does,
        since a solver may miss a request that comes before its search starts.

    Returns
    -------
    result, reason
        What ``call`` returned, and why it was cancelled, if it was.
    """
    results: list[T] = []
    errors: list[BaseException] = []

    def work() -> None:
        try:
            results.append(call())
        except BaseException as error:  # handed on to the caller below
            errors.append(error)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    reason: StopReason | None = None
    try:
        thread.join(PERIOD / 10)  # most calls are short
        while thread.is_alive():
            reason = reason or watch()
            if reason is not None:
                cancel()
            thread.join(PERIOD)
    except BaseException:
        cancel()
        raise
    if errors:
        raise errors[0]
    return results[0], reason
