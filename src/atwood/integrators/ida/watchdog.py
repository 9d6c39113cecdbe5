"""How long IDA is left alone, and whether it gets on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from math import inf

import numpy as np

from atwood.integrators.event_location import ROUNDING
from atwood.integrators.protocol import paced
from atwood.lazy_dataclasses import dataclass

MOMENT = 0.02
"""IDA is left alone for about so long, in seconds."""

FIRST_CHUNK, LARGEST_CHUNK = 20, 1_000_000
"""How many steps IDA is left alone for: at first, and at most."""

_FIRST_COMPILED_CHUNK, _SMALL = 500, 40
"""The same at first with compiled functions, up to so many unknowns; with more of them fewer."""


STALLED_STEPS = 50
"""So many steps in a row that do not move the time beyond rounding are a failure."""

_LONGER = 1e-9
"""Share of the run that is tried at last for it: IDA itself tries a thousandth and, from there, a millionth of that."""

_MOVES = 1e3
"""The shortest first step, in roundings of the time: IDA's own is shorter where much begins at once."""

_LAP = 2000
"""Over so many steps it is judged how they get on."""

_REPEATED, _ENDLESS = 0.25, 1e9
"""Steps do not get on if such a share of them had to be repeated, and it would take so many to the end."""

_TRAPPED, _NO_GROWTH, _RARE_GROWTH = 0.3, 1e6, 4.0
"""Where so large a share is repeated, no step of the next lap is longer, and later ones only by such a factor.

In what dies away fast, a step of order one that is made longer starts a new transient, and is repeated. IDA looks at
higher orders only after steps of the same length, so that it stays at the order and at the length of the transient.
"""


def other_first_steps(t: float, horizon: float) -> tuple[float, float]:
    """Return first steps, s, to try where IDA's own fails: it is too long, or too short to move the time.

    The shorter one comes first. In a longer one, which is of order one, a force that acts briefly may be over.
    """
    return max(_MOVES * float(np.spacing(abs(t))), 1e-15 * horizon), _LONGER * horizon


def hardly_moves(before: float, t: float) -> bool:
    """Return whether a first step is near the rounding of the time: what it begins with is rounding, too."""
    return bool(t - before < 0.1 * _MOVES * float(np.spacing(abs(before))))


def first_chunk(size: int) -> int:
    """Return how many steps IDA is left alone for at first with compiled functions of so many unknowns."""
    return max(1, _FIRST_COMPILED_CHUNK * _SMALL // max(_SMALL, size))


@dataclass
class Watchdog:
    """How many steps IDA is left alone for, and whether they still move the time.

    Attributes
    ----------
    chunk
        The number of steps.
    allowed
        What IDA was told last.
    mark
        A time, and the number of steps until then, from which it is judged whether the time still moves.
    lap
        The same with the number of steps that were repeated until then, from which it is judged whether the run gets
        on.
    is_trapped
        Whether steps of the last lap were repeated because they were longer than those before.
    """

    chunk: int = FIRST_CHUNK
    allowed: int = 0
    mark: tuple[float, int] = field(default=(-inf, 0))
    lap: tuple[float, int, int] = field(default=(-inf, 0, 0))
    is_trapped: bool = False

    def learn(self, seconds: float, used_up: bool) -> None:
        """Come closer to a chunk that takes a moment."""
        self.chunk = paced(self.chunk, seconds, used_up, MOMENT, LARGEST_CHUNK)

    def stalls(self, t: float, steps: int) -> bool:
        """Tell whether the last steps have moved the time by no more than rounding."""
        since, count = self.mark
        if t - since > 4 * ROUNDING * abs(t) * (steps - count):
            self.mark = t, steps
            return False
        return steps - count >= STALLED_STEPS

    def judge_lap(self, t: float, steps: int, repeated: Callable[[], int], horizon: float) -> tuple[bool, float | None]:
        """Return, once a lap, whether the run would never end, and the required growth of its steps if it changed."""
        since, count, before = self.lap
        taken = steps - count
        if taken < _LAP:
            return False, None
        self.lap = t, steps, repeated()
        again, was_trapped = self.lap[2] - before, self.is_trapped
        self.is_trapped = again > _TRAPPED * taken
        growth = _NO_GROWTH if self.is_trapped else _RARE_GROWTH if was_trapped else None
        return again > _REPEATED * taken and (t - since) * _ENDLESS < horizon * taken, growth
