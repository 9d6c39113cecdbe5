"""Calls of Python functions: what a piece of work costs, the same on every machine."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType


@dataclass
class Calls:
    """How many calls were made."""

    count: int = 0


@contextmanager
def calls(after: Callable[[], bool] = lambda: True) -> Iterator[Calls]:
    """Count the calls of Python functions in a ``with`` block, from when ``after`` holds."""
    made = Calls()

    def note(_frame: FrameType, event: str, _argument: object) -> None:
        if event == "call" and after():
            made.count += 1

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        yield made
    finally:
        sys.setprofile(before)
