"""How long each stage from a scene to its motion takes.

Stages may lie within each other: equations are derived when the start first asks for them. Each is charged with its own
time alone, so that the times of all add up to the whole.
"""

from __future__ import annotations

import time
from contextvars import ContextVar

__all__ = ["STAGES", "Stopwatch", "stage", "watching"]

STAGES = {
    "flatten": "the scene as parts and connections",
    "mechanism": "laws, nodes, bodies and joints",
    "equations": "equations of motion and programs, derived or from the cache",
    "code": "machine code and Python code, compiled or from the cache",
    "start": "consistent start values",
    "preparation": "rank, scales, choice of the solver",
    "integration": "steps, events, outputs",
}
"""The stages, in the order in which they begin, and what each makes."""


class Stopwatch:
    """The time that each stage took.

    Attributes
    ----------
    seconds
        By name of the stage, as far as it was entered, s.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._open: list[str] = []
        self._since = 0.0

    def enter(self, name: str) -> None:
        """Begin a stage; the one that it lies in waits."""
        self._charge()
        self._open.append(name)

    def leave(self) -> None:
        """End the last stage; the one that it lies in goes on."""
        self._charge()
        self._open.pop()

    def _charge(self) -> None:
        now = time.perf_counter()
        if self._open:
            name = self._open[-1]
            self.seconds[name] = self.seconds.get(name, 0.0) + now - self._since
        self._since = now

    def in_order(self) -> dict[str, float]:
        """Return the times in the order of `STAGES`."""
        return {name: self.seconds[name] for name in STAGES if name in self.seconds}


_watch: ContextVar[Stopwatch | None] = ContextVar("stopwatch", default=None)


class stage:
    """Charges the time of a block to a stage, where somebody watches.

    Parameters
    ----------
    name
        One of `STAGES`.
    """

    __slots__ = ("_name", "_stopwatch")

    def __init__(self, name: str) -> None:
        self._name = name

    def __enter__(self) -> None:
        self._stopwatch = _watch.get()
        if self._stopwatch is not None:
            self._stopwatch.enter(self._name)

    def __exit__(self, *_: object) -> None:
        if self._stopwatch is not None:
            self._stopwatch.leave()


class watching:
    """Time the stages in a block; one that watches already goes on."""

    __slots__ = ("_token",)

    def __enter__(self) -> Stopwatch:
        known = _watch.get()
        made = Stopwatch() if known is None else known
        self._token = _watch.set(made)
        return made

    def __exit__(self, *_: object) -> None:
        _watch.reset(self._token)
