"""Finding where event functions pass through zero inside a step.

A step of the integrator leaves an interpolant behind.  The watch compares the sign of each event function with
the sign that it last had for certain, and narrows the interpolant down to the first change.  It needs nothing
from the integrator but the interpolant, so that a root beyond the next output time can simply wait.  Where both are
compiled, routines do the same (`atwood.integrators.event_routines`).

The rules, which decide the cases on the edge:

- arriving at zero exactly is an event; leaving zero is not, nor is touching it;
- at zero, and up to the rounding of its value, an event has no sign: after a restart there, and after it has happened,
  the sign is the first that is larger than rounding, at times that move away from there by more and more;
- a change within rounding of a restart belongs to the restart, unless the sign before is handed on to it;
- events within rounding of each other happen together;
- a function that passes zero and comes back within a step has passed it: see `atwood.integrators.event_location`;
- what needs no exact time happens at the end of the step in which its sign changed, unless something else does before.

Event functions that come near zero between two points of a solution: what tangents say, and where to look.

A function that is convex between two points lies above its tangents there.  If each tangent keeps the sign up to the
middle, so does the function.  Where one does not, the function is read between, at the least value of the cubic through
both points with these slopes (Hermite), and both parts are judged in the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from math import inf, isnan, sqrt
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.tangents import FULL, SECANT, STEEP
from atwood.errors import KernelEvaluationError
from atwood.integrators.protocol import JUST_HAPPENED, ExplicitProblem, ImplicitProblem, State, Values
from atwood.lazy_dataclasses import dataclass

Interpolant = Callable[[float], State]

ROUNDING = float(np.finfo(np.float64).eps)
FARTHER = 4.0
"""Signs near zero are read at times of which each is so many times as far from there as the one before."""

NOISE = 16.0
"""A value has a sign from so many times its change on, when the state changes by rounding."""


HALF = 0.5
MOST = 200
"""A step is read at no more places than these: what then is left is a touch, not a passage."""

SHORTEST = 1e-6
"""Parts of a step that are shorter than this share are not divided: there the depth is rounding."""

TINY = 1e-300
"""Makes zero positive."""

PASSED = 0.9
"""What has passed zero by this share of its margin at the start of a mode happens there.

Equal parts pass their margins together. One of them ends the mode, and the others are at the end of theirs to rounding:
a whole margin would leave them at zero, with a sign that nobody knows.
"""

SHORT = 1e-6
"""Share of the time since the mode began in which the rate of an event is read."""

ALIKE = 1.0 + 1e-6
"""Events that pass their margins at once have passed zero at once, if it was earlier by shares as alike as this."""

LONGEST = 0.1
"""Share of that time by which an event may be brought forward, by one Euler step back."""


@dataclass(frozen=True, eq=False)
class Point:
    """Event functions and their rates of change along the solution at a time."""

    time: float
    values: Sequence[float]
    slopes: Sequence[float]


def may_dip(first: Point, last: Point, signs: Sequence[float], share: float = FULL) -> list[bool]:
    """Return which functions may lose the sign between two points at both of which they have it."""
    width = last.time - first.time
    return [
        sign != 0.0 and _may(sign * a, sign * b, sign * down * width, sign * up * width, share)
        for a, b, down, up, sign in zip(first.values, last.values, first.slopes, last.slopes, signs, strict=True)
    ]


def _may(a: float, b: float, down: float, up: float, share: float) -> bool:
    if not (a > 0.0 and b > 0.0):
        return False
    return a + share * down <= 0.0 or b - share * up <= 0.0 or max(abs(down), abs(up)) > STEEP * max(a, b)


def find_dip(first: Point, last: Point, signs: Sequence[float], read: Callable[[float, float], Point]) -> float | None:
    """Return a time at which one of the functions has lost its sign between two points; None if none does."""
    shortest = SHORTEST * (last.time - first.time)
    parts, count, share = [(first, last)], 0, FULL
    while parts and count < MOST:
        a, b = parts.pop()
        width = b.time - a.time
        suspects = [i for i, may in enumerate(may_dip(a, b, signs, share)) if may]
        if not suspects or width <= shortest:
            continue
        lowest = min(_lowest(a, b, i, signs[i]) for i in suspects)
        point = read(a.time + lowest * width, width)
        if any(sign and sign * value <= 0.0 for sign, value in zip(signs, point.values, strict=True)):
            return point.time
        parts += [(point, b), (a, point)]
        count, share = count + 1, HALF
    return None


def _lowest(a: Point, b: Point, i: int, sign: float) -> float:
    """Return where, as a share, the cubic of a function is least; the middle where it has no least value inside."""
    width = b.time - a.time
    down, up = (sign * float(one.slopes[i]) * width for one in (a, b))
    rise = sign * float(b.values[i] - a.values[i])
    square, linear = 3.0 * (down + up - 2.0 * rise), 2.0 * (3.0 * rise - 2.0 * down - up)
    inside = linear * linear - 4.0 * square * down
    below = linear + sqrt(inside) if inside >= 0.0 else 0.0
    share = -2.0 * down / below if below != 0.0 else 0.5
    return min(max(share, 1e-3), 1.0 - 1e-3) if 0.0 < share < 1.0 else 0.5


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
    signs
        What is known of each event before the first start; None for what the problem says.
    """

    def __init__(
        self, problem: ImplicitProblem | ExplicitProblem, horizon: float, signs: tuple[int, ...] | None = None
    ) -> None:
        assert problem.events is not None
        self._function = problem.events
        self._directions = problem.event_directions or (0,) * problem.event_count
        self._rough = [i in problem.event_rough for i in range(problem.event_count)]
        self._moment = 100 * ROUNDING * horizon
        self._signs = [0] * problem.event_count
        self._given = problem.event_signs if signs is None else signs  # before the first start
        self._carried = [False] * problem.event_count  # whether its sign at the start is that before
        self._fired = [False] * problem.event_count
        self._fired_at = -inf
        self._start = -inf
        self._settling = True
        self._unsure = [False] * problem.event_count  # whether it has been zero, and has had no sign since
        self._origin = [0.0] * problem.event_count  # what its value was then
        self._blind = [-inf] * problem.event_count  # until when its value is not looked at
        self._last: Point | None = None
        self._known: dict[float, list[float]] = {}  # values at the times that were read
        self._evaluations = 0
        self._kept: tuple[list[Any], ...] = ()

    @property
    def evaluations(self) -> int:
        """How often events have been evaluated."""
        return self._evaluations

    @property
    def signs(self) -> FloatArray:
        """The sign that each event last had for certain; zero where it is not known."""
        return np.array(self._signs, dtype=np.float64)

    @property
    def is_settling(self) -> bool:
        """Whether nothing is known yet of the first step after a restart."""
        return self._settling

    def restart(self, state: State) -> None:
        """Take the signs from a new start of the solution."""
        t, self._known = state[0], {}
        is_first, given, self._given = bool(self._given), self._given or self.handed_on(t), ()
        values, noise = self._values(state), self._noise(state, 0.0)
        at_zero = [abs(value) <= least for value, least in zip(values, noise, strict=True)]
        for i, (value, zero, one) in enumerate(zip(values, at_zero, given, strict=True)):
            self._carried[i] = abs(one) == 1 and (is_first or zero or one * value > 0.0)
            self._unsure[i] = one == JUST_HAPPENED or (zero and one == 0)
            self._origin[i] = value if one == JUST_HAPPENED else 0.0
            self._signs[i] = 0 if self._unsure[i] else one if self._carried[i] else _sign(value)
        self._blind = [-inf] * len(values)
        self._start = t
        self._settling = True
        self._last = None

    def handed_on(self, t: float, ahead: Root | None = None) -> tuple[int, ...]:
        """Return what a start at a time is to know of each event: its sign, or that it has just happened."""
        fired = self._fired if t == self._fired_at else [False] * len(self._signs)
        found = [JUST_HAPPENED if one else sign for one, sign in zip(fired, self._signs, strict=True)]
        return tuple(found if ahead is None else (-one or sign for one, sign in zip(ahead.events, found, strict=True)))

    def search(self, begin: float, end: float, at: Interpolant) -> Root | None:
        """Return the first root between two times of the last step, or `None`.

        After a root the search can go on from the root's time.
        """
        rows: tuple[list[Any], ...] = (self._signs, self._unsure, self._origin, self._blind, self._fired)
        self._kept = tuple([*row] for row in rows)
        self._settling, self._end, self._known = False, end, {}
        at = cache(at)  # the ends of parts of a step are read more than once
        if any(self._unsure):
            self._settle(begin, at)
        clear = min(max(self._blind), end)
        if begin < clear < end:
            return self._first_root(begin, clear, at) or self._first_root(clear, end, at)
        return self._first_root(begin, end, at)

    def forget_search(self) -> None:
        """Know what was known before the last search, as the step in which it searched is another one now."""
        self._signs, self._unsure, self._origin, self._blind, self._fired = self._kept
        self._last = None

    def _settle(self, begin: float, at: Interpolant) -> None:
        """Read the signs of what is or has just been zero where they are larger than rounding.

        Until then nobody looks at them.  An event whose sign is that of before has only touched zero.
        """
        noise = self._noise(at(begin), self._end - begin)
        for i, unsure in enumerate(self._unsure):
            self._blind[i] = inf if unsure else self._blind[i]
        past = self._moment
        while any(self._unsure) and begin < self._end:
            time = min(begin + past, self._end)
            for i, value in enumerate(self._values(at(time))):
                if self._unsure[i] and abs(value) > noise[i] and abs(value - self._origin[i]) > noise[i]:
                    self._signs[i], self._blind[i], self._unsure[i] = _sign(value), time, False
            if time >= self._end:
                break
            past *= FARTHER

    def _noise(self, state: State, width: float) -> list[float]:
        """Return how large values can be that are zero but for rounding, in a step of some width."""
        t, y, yp = state
        values = self._values(state)
        least = [0.0] * len(values)
        size = ROUNDING * (np.abs(y) + width * np.abs(yp))
        for turn in (np.cos, np.sin):  # so that no two unknowns change by the same share
            try:
                others = _listed(self._function(t, y + size * turn(1.0 + 2.4 * np.arange(len(y))), yp))
            except ArithmeticError:
                continue
            self._evaluations += 1
            least = [max(m, NOISE * abs(b - a)) for m, a, b in zip(least, values, others, strict=True)]
        return least

    def _values(self, state: State) -> list[float]:
        if (known := self._known.get(state[0])) is not None:
            return known
        self._evaluations += 1
        try:
            values = _listed(self._function(*state))
        except ArithmeticError as error:
            raise KernelEvaluationError(f"the event functions have no value at t = {state[0]:.9g}: {error}") from error
        for i, value in enumerate(values):
            if isnan(value):
                raise KernelEvaluationError(f"event function {i} has no value at t = {state[0]:.9g}")
        self._known[state[0]] = values
        return values

    def _nothing_changed(self, state: State) -> bool:
        """Tell quickly, for the many steps without events, that all signs are still the same."""
        self._evaluations += 1
        try:
            values = self._function(*state)
        except ArithmeticError:
            return False
        # A product is positive only for two signs that are equal and known.
        return all(value * sign > 0.0 for value, sign in zip(values, self._signs, strict=True))

    def _crossings(self, values: Sequence[float], t: float) -> list[bool]:
        """Return which values have passed zero at a time in a direction that counts."""
        return [
            known != 0 and _sign(value) != known and direction in (0, -known) and t > blind
            for value, known, direction, blind in zip(values, self._signs, self._directions, self._blind, strict=True)
        ]

    def _learn(self, values: Sequence[float], t: float) -> None:
        """Take the signs of all values that have one."""
        self._signs = [
            known if t <= blind else _sign(value) or known
            for value, known, blind in zip(values, self._signs, self._blind, strict=True)
        ]

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
            crossed = self._crossings(values, end)
            if not any(crossed):
                # A zero that is not an event keeps the sign it came with.
                self._learn(values, end)
                return None
            if all(rough for one, rough in zip(crossed, self._rough, strict=True) if one):
                self._learn(values, end)
                return Root(at(end), tuple(_sign(v) if one else 0 for v, one in zip(values, crossed, strict=True)))
            before, time = self._narrow(begin, end, values, at, tolerance)
            dip = self._dip(begin, before, at)
            if dip is not None:
                return self._first_root(begin, dip, at) or self._first_root(dip, end, at)
            # What follows within rounding belongs to the same moment.
            after, state = min(time + moment, end), at(time)
            here, later = self._crossings(self._values(state), time), self._crossings(self._values(at(after)), after)
            together, known = [one or other for one, other in zip(here, later, strict=True)], self._signs
            self._signs = [-sign if one else sign for one, sign in zip(together, known, strict=True)]
            self._unsure = [one or other for one, other in zip(together, self._unsure, strict=True)]
            self._origin = [0.0 if one else value for one, value in zip(together, self._origin, strict=True)]
            self._settle(time, at)
            is_start = time - self._start <= moment
            passed = [
                one and sign != old and (carried or not is_start)
                for one, sign, old, carried in zip(together, self._signs, known, self._carried, strict=True)
            ]
            if any(passed):
                self._fired, self._fired_at = passed, time
                return Root(state, tuple(-sign if one else 0 for one, sign in zip(passed, known, strict=True)))
            if after >= end:
                return None
            begin = after

    def _dip(self, begin: float, end: float, at: Interpolant) -> float | None:
        """Return a time between two others at which an event has the other sign, where both have the known one."""
        signs = [
            0 if rough or begin < blind else sign
            for rough, sign, blind in zip(self._rough, self._signs, self._blind, strict=True)
        ]
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
        self._evaluations += 1
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
            if any(self._crossings(middle_values, middle)):
                end, end_values = middle, middle_values
            else:
                begin, values = middle, middle_values
        return begin, end

    def _guess(self, begin: float, end: float, values: Sequence[float], end_values: Sequence[float]) -> float:
        """Return the earliest zero of the chords of the event functions that have passed zero at the end."""
        least = 1.0
        for first, last, chosen in zip(values, end_values, self._crossings(end_values, end), strict=True):
            if chosen:
                share = first / (first - last) if first != last else 0.5
                least = min(least, 0.5 if isnan(share) else max(share, 0.0))
        return begin + least * (end - begin)


def _sign(value: float) -> int:
    return (value > 0.0) - (value < 0.0)


def _listed(values: Values) -> list[float]:
    return values.tolist() if isinstance(values, np.ndarray) else [float(value) for value in values]


LARGEST = float(np.finfo(np.float64).max)


def _slope(change: float, width: float) -> float:
    """Return a rate of change, zero where there is none."""
    slope = change / width
    return 0.0 if isnan(slope) else min(max(slope, -LARGEST), LARGEST)
