"""What is made once in a process, whichever thread asks first."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


def once(make: Callable[P, T]) -> Callable[P, T]:
    """Return a function that makes something at its first call, and returns the same ever after.

    Unlike `functools.cache` it makes it once even if several threads ask at the same time: code of which there are two,
    one of them forgotten, would be taken out of memory while it runs.
    """
    lock, made = threading.RLock(), dict[tuple[object, ...], T]()

    @functools.wraps(make)
    def found(*given: P.args, **named: P.kwargs) -> T:
        if given not in made:
            with lock:
                if given not in made:
                    made[given] = make(*given, **named)
        return made[given]

    return found
