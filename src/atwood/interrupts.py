"""Ctrl-C while compiled code calls Python: noted by the signal's handler, and raised once that code has returned."""

from __future__ import annotations

import signal
import threading
from typing import Protocol

__all__ = ["InterruptLater", "Interruptible"]


class Interruptible(Protocol):
    """What takes up that Ctrl-C came, and raises it after the call of compiled code."""

    interrupted: bool


class InterruptLater:
    """While this is entered, Ctrl-C is noted, and makes compiled code return as soon as it calls a Python function.

    Otherwise the exception could arise where a C function has just called Python, and would be lost there.  A second
    Ctrl-C is raised at once, so that a function that never returns can be left.  Only the main thread gets
    signals, and a handler that somebody else has installed is left alone.

    Parameters
    ----------
    record
        Takes up that Ctrl-C came.
    """

    def __init__(self, record: Interruptible) -> None:
        self._record = record
        self._installed = False

    def __enter__(self) -> None:
        if (
            threading.current_thread() is threading.main_thread()
            and signal.getsignal(signal.SIGINT) is signal.default_int_handler
        ):
            signal.signal(signal.SIGINT, self._handle)
            self._installed = True

    def __exit__(self, *_: object) -> None:
        if self._installed:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            self._installed = False

    def _handle(self, *_: object) -> None:
        if self._record.interrupted:
            raise KeyboardInterrupt
        self._record.interrupted = True
