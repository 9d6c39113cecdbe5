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

from collections.abc import Callable

import numpy as np

from atwood.arrays import BoolArray
from atwood.codegen.tangents import SECANT
from atwood.errors import KernelEvaluationError
from atwood.integrators.dips import Point, find_dip, may_dip
from atwood.integrators.protocol import FloatArray, ImplicitProblem, IndexArray
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
        self._directions = np.array(problem.event_directions or (0,) * problem.event_count, dtype=np.intp)
        self._rough = np.zeros(problem.event_count, dtype=bool)
        self._rough[list(problem.event_rough)] = True
        self._moment = 100 * ROUNDING * horizon
        self._set_signs(np.zeros(problem.event_count, dtype=np.intp))
        self._fired = np.zeros(problem.event_count, dtype=bool)
        self._fired_at = -np.inf
        self._start = -np.inf
        self._settling = True
        self._last: Point | None = None
        self.evaluations = 0

    @property
    def signs(self) -> FloatArray:
        """The sign that each event last had for certain; zero where it is not known."""
        return np.array(self._sign_list)

    @property
    def is_settling(self) -> bool:
        """Whether signs are still to be read a little after a restart."""
        return self._settling

    def restart(self, state: State) -> None:
        """Take the signs from a new start of the solution."""
        t = state[0]
        signs = np.sign(self._values(state)).astype(np.intp)
        if t == self._fired_at:
            signs[self._fired] = 0
        self._set_signs(signs)
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

    def _values(self, state: State) -> FloatArray:
        self.evaluations += 1
        try:
            values = np.asarray(self._function(*state), dtype=np.float64)
        except ArithmeticError as error:
            raise KernelEvaluationError(f"the event functions have no value at t = {state[0]:.9g}: {error}") from error
        missing = np.isnan(values)
        if missing.any():
            raise KernelEvaluationError(f"event function {int(missing.argmax())} has no value at t = {state[0]:.9g}")
        return values

    def _set_signs(self, signs: IndexArray) -> None:
        self._signs = signs
        self._sign_list = [float(sign) for sign in signs]

    def _nothing_changed(self, state: State) -> bool:
        """Tell quickly, for the many steps without events, that all signs are still the same."""
        self.evaluations += 1
        try:
            values = self._function(*state)
        except ArithmeticError:
            return False
        # A product is positive only for two signs that are equal and known.
        return all(value * sign > 0.0 for value, sign in zip(values, self._sign_list, strict=True))

    def _crossings(self, values: FloatArray) -> tuple[IndexArray, BoolArray]:
        """Return the signs of values, and which of them have passed zero in a direction that counts."""
        signs = np.sign(values).astype(np.intp)
        changed = (self._signs != 0) & (signs != self._signs)
        allowed = (self._directions == 0) | (self._directions == -self._signs)
        return signs, changed & allowed

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
            signs, crossed = self._crossings(values)
            if not crossed.any():
                # A zero that is not an event keeps the sign it came with.
                self._set_signs(np.where(signs != 0, signs, self._signs))
                return None
            if not np.any(crossed & ~self._rough):
                self._set_signs(np.where(signs != 0, signs, self._signs))
                return Root(at(end), tuple(int(sign) for sign in np.where(crossed, signs, 0)))
            before, time = self._narrow(begin, end, values, at, tolerance)
            dip = self._dip(begin, before, at)
            if dip is not None:
                return self._first_root(begin, dip, at) or self._first_root(dip, end, at)
            # What follows within rounding belongs to the same moment.
            after = min(time + moment, end)
            signs, together = self._crossings(self._values(at(after)))
            state = at(time)
            together |= self._crossings(self._values(state))[1]
            events = np.where(together, -self._signs, 0)
            self._set_signs(np.where(together, signs, self._signs))
            if time - self._start > moment:
                self._fired, self._fired_at = together, time
                return Root(state, tuple(int(event) for event in events))
            if after >= end:
                return None
            begin = after

    def _dip(self, begin: float, end: float, at: Interpolant) -> float | None:
        """Return a time between two others at which an event has the other sign, where both have the known one."""
        signs = np.where(self._rough, 0.0, self._signs)
        if not (signs.any() and begin < end):
            return None
        last = self._last
        first = last if last is not None and last.time == begin else self._point(at(begin), end - begin)
        self._last = last = self._point(at(end), begin - end)
        if not may_dip(first, last, signs).any():
            return None
        return find_dip(first, last, signs, lambda t, width: self._point(at(t), -width))

    def _point(self, state: State, width: float) -> Point:
        """Return values and slopes, the latter over a small part of a width that begins at the state."""
        t, y, yp = state
        values, past = self._values(state), SECANT * width
        self.evaluations += 1
        try:
            others = np.asarray(self._function(t + past, y + past * yp, yp), dtype=np.float64)
        except ArithmeticError:
            others = values
        with np.errstate(invalid="ignore"):
            return Point(t, values, np.nan_to_num((others - values) / past, nan=0.0))

    def _narrow(
        self, begin: float, end: float, end_values: FloatArray, at: Interpolant, tolerance: float
    ) -> tuple[float, float]:
        """Return the last time before some event has passed zero and the first after it, within the tolerance.

        Regula falsi on the event functions that have passed zero at the end, with a bisection whenever two
        guesses together did not halve the interval.
        """
        values = self._values(at(begin))
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
            if self._crossings(middle_values)[1].any():
                end, end_values = middle, middle_values
            else:
                begin, values = middle, middle_values
        return begin, end

    def _guess(self, begin: float, end: float, values: FloatArray, end_values: FloatArray) -> float:
        """Return the earliest zero of the chords of the event functions that have passed zero at the end."""
        chosen = self._crossings(end_values)[1]
        first, last = values[chosen], end_values[chosen]
        slope = first - last
        share = np.divide(first, slope, out=np.full_like(first, 0.5), where=slope != 0.0)
        share = np.clip(np.nan_to_num(share, nan=0.5), 0.0, 1.0)
        return begin + float(share.min()) * (end - begin)
