"""How far something is, in one line on standard error that is written over; notebooks show it, too."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any, TypeAlias

__all__ = ["Progress", "told"]

Progress: TypeAlias = Callable[..., object] | bool | None
"""What a function that takes long may be given: what to call on the way, or True for a line on standard error."""

_PAUSE = 0.1
"""s; the line is written no more often."""

_BAR = 24


class told:
    """Gives what is to be called on the way: what was given, or what writes the line; None if nothing is.

    Parameters
    ----------
    progress
        What a function was given.
    name
        What the line begins with.
    say
        Gives the share that is done, and words, from what is called with.
    """

    def __init__(self, progress: Progress, name: str, say: Callable[..., tuple[float, str]]) -> None:
        self._progress, self._say = progress, say
        self._line = _Line(name) if progress is True else None

    def __enter__(self) -> Callable[..., object] | None:
        line, say = self._line, self._say
        if line is not None:
            return lambda *given: line.show(*say(*given))
        return None if isinstance(self._progress, bool) else self._progress

    def __exit__(self, *_: object) -> None:
        if self._line is not None:
            self._line.clear()


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
