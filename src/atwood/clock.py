"""A limit of time that holds for everything below it: whoever works for long looks at the clock.

A run sets its clock; expressions, kernels and solvers look at it wherever they are, without being handed it. Another
thread does not have it.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextvars import ContextVar
from math import inf
from typing import Any, TypeVar

__all__ = ["GRACE", "Clock", "TimeIsUp", "check_time", "more_time", "time_left", "within_time"]

T = TypeVar("T")

GRACE = 0.1
"""Where the time is used up there still are so many seconds to find a start, and as many to record what there is."""

_deadline: ContextVar[float] = ContextVar("deadline", default=inf)


class TimeIsUp(BaseException):
    """The time is used up; like an interruption, it passes through whatever handles errors, up to whose clock it is."""


class Clock:
    """A limit of time, from now on.

    Parameters
    ----------
    seconds
        The limit, s; None for none.
    """

    def __init__(self, seconds: float | None) -> None:
        self._end = inf if seconds is None else time.perf_counter() + max(0.0, seconds)

    @property
    def left(self) -> float:
        """What is left, s; negative behind the limit, infinite without one."""
        return self._end - time.perf_counter()

    def kept(self, grace: float = 0.0) -> _Ending:
        """Let everything in a ``with`` block keep the limit, or end so many seconds behind it."""
        return _Ending(self._end + grace)


def more_time() -> _Ending:
    """Give what is in a ``with`` block at least a little time from now on, however little is left."""
    return _Ending(max(_deadline.get(), time.perf_counter() + GRACE))


class _Ending:
    """Lets a ``with`` block end at a time."""

    __slots__ = ("_end", "_token")

    def __init__(self, end: float) -> None:
        self._end = end

    def __enter__(self) -> None:
        self._token = _deadline.set(self._end)

    def __exit__(self, *_: object) -> None:
        _deadline.reset(self._token)


def time_left() -> float:
    """Return the time that is left, s; infinite where nothing limits it."""
    return _deadline.get() - time.perf_counter()


def check_time() -> None:
    """Look at the clock."""
    end = _deadline.get()
    if end != inf and time.perf_counter() >= end:
        raise TimeIsUp


def within_time(work: Callable[[], T]) -> T:
    """Return what a function gives that cannot look at the clock: it is left to itself where the time is used up."""
    if _deadline.get() == inf:
        return work()
    made: list[T] = []
    failed: list[BaseException] = []

    def attempt(*_: Any) -> None:
        try:
            made.append(work())
        except BaseException as error:  # raised again where it is asked for
            failed.append(error)

    check_time()
    thread = threading.Thread(target=attempt)
    thread.start()
    thread.join(max(0.0, time_left()))
    if failed:
        raise failed[0]
    if not made:
        raise TimeIsUp
    return made[0]
