"""How far something is, in one line on standard error that is written over; notebooks show it, too."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeAlias

__all__ = ["Progress", "told"]

Progress: TypeAlias = Callable[..., object] | bool | None
"""What a function that takes long may be given: what to call on the way, or True for a line on standard error."""

_PAUSE = 0.1
"""s; the line is written no more often."""

_BAR = 24


@contextmanager
def told(
    progress: Progress, name: str, say: Callable[..., tuple[float, str]]
) -> Iterator[Callable[..., object] | None]:
    """Yield what is to be called on the way: what was given, or what writes the line; None if nothing is."""
    if not isinstance(progress, bool):
        yield progress
        return
    if not progress:
        yield None
        return
    line = _Line(name)
    try:
        yield lambda *given: line.show(*say(*given))
    finally:
        line.clear()


class _Line:
    """One line that is written over."""

    def __init__(self, name: str) -> None:
        self.name, self.width, self.written = name, 0, 0.0
        self.began = time.perf_counter()

    def show(self, share: float, said: str) -> None:
        """Write how far it is, if that was not done just now."""
        now = time.perf_counter()
        if now - self.written < _PAUSE and share < 1.0:
            return
        self.written = now
        done = min(max(share, 0.0), 1.0)
        bar = "#" * round(done * _BAR)
        self._write(f"{self.name} [{bar:<{_BAR}}] {100.0 * done:3.0f} %  {said}  {now - self.began:.1f} s")

    def clear(self) -> None:
        """Take the line away."""
        if self.width:
            self._write("")
            self._put("\r")

    def _write(self, text: str) -> None:
        self._put(f"\r{text:<{self.width}}")
        self.width = len(text)

    def _put(self, text: str) -> None:
        stream: Any = sys.stderr
        if stream is not None:  # as in a program without a console
            stream.write(text)
            stream.flush()
