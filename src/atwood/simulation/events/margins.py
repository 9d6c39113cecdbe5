"""Events that a margin has kept back, at the time at which their value was zero."""

from __future__ import annotations

from collections.abc import Callable

from atwood.arrays import FloatArray
from atwood.integrators.protocol import StepResult
from atwood.late import replace

__all__ = ["without_margin"]

_SHORT = 1e-6
"""Share of the time since the mode began in which the rate of an event is read."""

_LONGEST = 0.1
"""Share of that time by which an event may be brought forward, by one Euler step back."""


def without_margin(
    values: Callable[[float, FloatArray], FloatArray], shift: FloatArray, step: StepResult, began: float
) -> StepResult:
    """Return an event at the time at which its value was zero.

    What starts at zero has to pass it by ten times the tolerance, lest errors of a step set it off.
    Where it comes from the other side, and crosses the margin in a small part of the time since the mode began,
    there is no doubt, and the margin would only make the event late, and what follows later still.

    Parameters
    ----------
    values, shift
        ``values(t, y)``: the events of the mode with what is added to those that start at zero.
    step
        Where the solver stopped at an event.
    began
        When the mode began, s.
    """
    fired = [i for i, sign in enumerate(step.events) if sign]
    since = step.t - began
    if len(fired) != 1 or not shift[fired[0]] or not since > 0.0:
        return step
    number, margin = fired[0], float(shift[fired[0]])

    def value(earlier: float) -> float:
        return float(values(step.t - earlier, step.y - earlier * step.yp)[number]) - margin

    now, short = value(0.0), _SHORT * since
    rate = (now - value(short)) / short
    if rate * margin >= 0.0 or not abs(now) < _LONGEST * since * abs(rate):
        return step
    earlier = now / rate
    return replace(step, t=step.t - earlier, y=step.y - earlier * step.yp)
