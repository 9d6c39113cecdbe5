"""Finding where event functions pass through zero inside a step.

A step of the integrator leaves an interpolant behind.  The watch compares the sign of each event function with
the sign that it last had for certain, and narrows the interpolant down to the first change.  It needs nothing
from the integrator but the interpolant, so that a root beyond the next output time can simply wait.

The rules, which decide the cases on the edge:

- arriving at zero exactly is an event; leaving zero is not;
- what has just happened at a restart does not happen again there: its sign is read a little later;
- a change within rounding of a restart belongs to the restart;
- events within rounding of each other happen together;
- a function that passes zero and comes back within a step has passed it: see `atwood.integrators.dips`;
- what needs no exact time happens at the end of the step in which its sign changed, unless something else does before.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf, isnan

import numpy as np

from atwood.codegen.tangents import SECANT
from atwood.errors import KernelEvaluationError
from atwood.integrators.dips import Point, find_dip, may_dip
from atwood.integrators.protocol import FloatArray, ImplicitProblem, Values
from atwood.late import dataclass

__all__ = ["EventLocator", "Root", "State"]

State = tuple[float, FloatArray, FloatArray]
Interpolant = Callable[[float], State]

ROUNDING = float(np.finfo(np.float64).eps)
SETTLING = 0.1
"""The share of the first step after which the sign of an event that starts at zero is read."""


@dataclass(frozen=True, eq=False)
class Root:
    """Events that happen together: the state just past zero, and +-1 or 0 for each event function."""

    state: State
    events: tuple[int, ...]


class EventLocator:
    """The signs of a problem's event functions along a solution.

    Events are few, and are read at some tens of places one after the other: plain numbers, since arrays of so few take
    ten times as long.

    Parameters
    ----------
    problem
        The problem, with its events and their directions.
    horizon
        A typical length of the run: what is shorter by the rounding of the arithmetic counts as one moment.
    """

    def __init__(self, problem: ImplicitProblem, horizon: float) -> None:
        assert problem.events is not None
        self._function = problem.events
        self._directions = problem.event_directions or (0,) * problem.event_count
        self._rough = [i in problem.event_rough for i in range(problem.event_count)]
        self._moment = 100 * ROUNDING * horizon
        self._signs = [0] * problem.event_count
        self._fired = [False] * problem.event_count
        self._fired_at = -inf
        self._start = -inf
        self._settling = True
        self._last: Point | None = None
        self.evaluations = 0

    @property
    def signs(self) -> FloatArray:
        """The sign that each event last had for certain; zero where it is not known."""
        return np.array(self._signs, dtype=np.float64)

    @property
    def is_settling(self) -> bool:
        """Whether signs are still to be read a little after a restart."""
        return self._settling

    def restart(self, state: State) -> None:
        """Take the signs from a new start of the solution."""
        t = state[0]
        signs = [_sign(value) for value in self._values(state)]
        if t == self._fired_at:
            signs = [0 if fired else sign for sign, fired in zip(signs, self._fired, strict=True)]
        self._signs = signs
        self._start = t
        self._settling = True
        self._last = None

    def search(self, begin: float, end: float, at: Interpolant) -> Root | None:
        """Return the first root between two times of the last step, or `None`.

        After a root the search can go on from the root's time.
        """
        if self._settling:
            settled = begin + SETTLING * (end - begin)
            root = self._first_root(begin, settled, at)
            if root is not None:
                return root
            begin, self._settling = settled, False
        return self._first_root(begin, end, at)

    def _values(self, state: State) -> list[float]:
        self.evaluations += 1
        try:
            values = _listed(self._function(*state))
        except ArithmeticError as error:
            raise KernelEvaluationError(f"the event functions have no value at t = {state[0]:.9g}: {error}") from error
        for i, value in enumerate(values):
            if isnan(value):
                raise KernelEvaluationError(f"event function {i} has no value at t = {state[0]:.9g}")
        return values

    def _nothing_changed(self, state: State) -> bool:
        """Tell quickly, for the many steps without events, that all signs are still the same."""
        self.evaluations += 1
        try:
            values = self._function(*state)
        except ArithmeticError:
            return False
        # A product is positive only for two signs that are equal and known.
        return all(value * sign > 0.0 for value, sign in zip(values, self._signs, strict=True))

    def _crossings(self, values: Sequence[float]) -> list[bool]:
        """Return which values have passed zero in a direction that counts."""
        return [
            known != 0 and _sign(value) != known and direction in (0, -known)
            for value, known, direction in zip(values, self._signs, self._directions, strict=True)
        ]

    def _learn(self, values: Sequence[float], which: Sequence[bool] | None = None) -> None:
        """Take the signs of values; of all that are not zero, or of those that are named."""
        pairs = enumerate(zip(values, self._signs, strict=True))
        if which is None:
            self._signs = [_sign(value) or known for _, (value, known) in pairs]
        else:
            self._signs = [_sign(value) if which[i] else known for i, (value, known) in pairs]

    def _first_root(self, begin: float, end: float, at: Interpolant) -> Root | None:
        dip = self._dip(begin, end, at)
        if dip is not None:
            return self._first_root(begin, dip, at) or self._first_root(dip, end, at)
        if self._nothing_changed(at(end)):
            return None
        tolerance = 4 * ROUNDING * (abs(end) + (end - begin))
        moment = max(self._moment, 25 * tolerance)
        while True:
            values = self._values(at(end))
            crossed = self._crossings(values)
            if not any(crossed):
                # A zero that is not an event keeps the sign it came with.
                self._learn(values)
                return None
            if all(rough for one, rough in zip(crossed, self._rough, strict=True) if one):
                self._learn(values)
                return Root(at(end), tuple(_sign(v) if one else 0 for v, one in zip(values, crossed, strict=True)))
            before, time = self._narrow(begin, end, values, at, tolerance)
            dip = self._dip(begin, before, at)
            if dip is not None:
                return self._first_root(begin, dip, at) or self._first_root(dip, end, at)
            # What follows within rounding belongs to the same moment.
            after = min(time + moment, end)
            later, state = self._values(at(after)), at(time)
            here = self._crossings(self._values(state))
            together = [one or other for one, other in zip(self._crossings(later), here, strict=True)]
            events = tuple(-sign if one else 0 for one, sign in zip(together, self._signs, strict=True))
            self._learn(later, together)
            if time - self._start > moment:
                self._fired, self._fired_at = together, time
                return Root(state, events)
            if after >= end:
                return None
            begin = after

    def _dip(self, begin: float, end: float, at: Interpolant) -> float | None:
        """Return a time between two others at which an event has the other sign, where both have the known one."""
        signs = [0 if rough else sign for rough, sign in zip(self._rough, self._signs, strict=True)]
        if not (any(signs) and begin < end):
            return None
        last = self._last
        first = last if last is not None and last.time == begin else self._point(at(begin), end - begin)
        self._last = last = self._point(at(end), begin - end)
        if not any(may_dip(first, last, signs)):
            return None
        return find_dip(first, last, signs, lambda t, width: self._point(at(t), -width))

    def _point(self, state: State, width: float) -> Point:
        """Return values and slopes, the latter over a small part of a width that begins at the state."""
        t, y, yp = state
        values, past = self._values(state), SECANT * width
        self.evaluations += 1
        try:
            others = _listed(self._function(t + past, y + past * yp, yp))
        except ArithmeticError:
            others = values
        return Point(t, values, [_slope(b - a, past) for a, b in zip(values, others, strict=True)])

    def _narrow(
        self, begin: float, end: float, end_values: Sequence[float], at: Interpolant, tolerance: float
    ) -> tuple[float, float]:
        """Return the last time before some event has passed zero and the first after it, within the tolerance.

        Regula falsi on the event functions that have passed zero at the end, with a bisection whenever two
        guesses together did not halve the interval.
        """
        values: Sequence[float] = self._values(at(begin))
        width, guesses = end - begin, 0
        while end - begin > tolerance:
            if guesses == 2:
                bisect, guesses = end - begin > 0.5 * width, 0
                width = end - begin
            else:
                bisect = False
            middle = 0.5 * (begin + end) if bisect else self._guess(begin, end, values, end_values)
            # Step over the root by half the tolerance: the next guess then closes in from the other side.
            middle = min(max(middle, begin + 0.5 * tolerance), end - 0.5 * tolerance)
            if not begin < middle < end:
                break
            guesses += 1
            middle_values = self._values(at(middle))
            if any(self._crossings(middle_values)):
                end, end_values = middle, middle_values
            else:
                begin, values = middle, middle_values
        return begin, end

    def _guess(self, begin: float, end: float, values: Sequence[float], end_values: Sequence[float]) -> float:
        """Return the earliest zero of the chords of the event functions that have passed zero at the end."""
        least = 1.0
        for first, last, chosen in zip(values, end_values, self._crossings(end_values), strict=True):
            if chosen:
                share = first / (first - last) if first != last else 0.5
                least = min(least, 0.5 if isnan(share) else max(share, 0.0))
        return begin + least * (end - begin)


def _sign(value: float) -> int:
    return (value > 0.0) - (value < 0.0)


def _listed(values: Values) -> list[float]:
    return values.tolist() if isinstance(values, np.ndarray) else [float(value) for value in values]


_LARGEST = float(np.finfo(np.float64).max)


def _slope(change: float, width: float) -> float:
    """Return a rate of change, zero where there is none."""
    slope = change / width
    return 0.0 if isnan(slope) else min(max(slope, -_LARGEST), _LARGEST)
