"""What is made once in a process, whichever thread asks first."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import TypeVar

__all__ = ["once"]

T = TypeVar("T")


def once(make: Callable[[], T]) -> Callable[[], T]:
    """Return a function that makes something at its first call, and returns the same ever after.

    Unlike `functools.cache` it makes it once even if several threads ask at the same time: code of which there are two,
    one of them forgotten, would be taken out of memory while it runs.

    Parameters
    ----------
    make
        Makes it.
    """
    lock, made = threading.RLock(), list[T]()

    @functools.wraps(make)
    def found() -> T:
        if not made:
            with lock:
                if not made:
                    made.append(make())
        return made[0]

    return found
