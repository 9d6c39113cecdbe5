"""Finding where event functions pass through zero inside a step.

A step of the integrator leaves an interpolant behind.  The watch compares the sign of each event function with
the sign that it last had for certain, and narrows the interpolant down to the first change.  It needs nothing
from the integrator but the interpolant, so that a root beyond the next output time can simply wait.
Routines do all this (`atwood.integrators.event_routines`), for compiled functions and for functions in Python alike.

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

import ctypes
from collections.abc import Callable
from ctypes import c_double, c_int, c_void_p
from math import inf, nan
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, INTEGER, NUMBER, Kind
from atwood.errors import KernelEvaluationError
from atwood.integrators.protocol import JUST_HAPPENED, ExplicitProblem, ImplicitProblem, State
from atwood.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from atwood.codegen.llvm.build import Built
    from atwood.codegen.sundials.events import EventData
    from atwood.integrators.python_calls import PythonCalls

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


LARGEST = float(np.finfo(np.float64).max)
"""Slopes are no larger, so that what is worked out from them stays a number."""

FIELDS: dict[str, Kind] = {
    **dict.fromkeys(
        ("interpolate", "session", "events", "data", "y", "yp", "shifted", "turns", "rows", "kept"), ADDRESS
    ),
    **dict.fromkeys(("moment", "start", "end", "here", "fired_at", "root", "before", "after", "dip"), NUMBER),
    **dict.fromkeys(("change", "told"), NUMBER),
    **dict.fromkeys(("size", "count", "settling", "evaluations", "is_first", "bad"), INTEGER),
}
"""The memory of a search. `here` is the time that was read, `root` the last that was tried, `bad` what has no value,
`kept` what the rows were before the last search, `change` when parameters change next, if that is known beforehand,
`told` the time of the last state that the steps handed out."""

ROWS = {
    name: k
    for k, name in enumerate(
        (
            *("sign", "direction", "rough", "carried", "unsure", "origin", "blind", "fired", "given", "found"),
            *("noise", "known", "others", "lower", "upper", "crossed", "later", "old", "dipping"),
        )
    )
}
"""Rows with a number for each event; behind them come points: time, values and slopes of each."""

FIRST, LAST, BEGIN, STACK = range(4)
"""Points: the first and the last of a part of a step, the first of all of it, and those that are still to come."""

NEAR_WHOLE = 1.0 / 16.0
"""Slopes over a small part of a width serve for a part of it that is no shorter than this share."""

FOUND, NO_STATE, NO_VALUE = 1, 2, 3
"""How a search ends that finds an event, cannot read a state, or an event function."""

_PLACES = {name: k for k, name in enumerate(FIELDS)}
_FILES = ("codegen/tangents.py", "integrators/event_location.py", "integrators/protocol.py")
_INTERPOLATE = ctypes.CFUNCTYPE(c_int, c_void_p, c_double, c_void_p, c_void_p)
_SEARCH = ctypes.CFUNCTYPE(c_int, c_void_p, c_double, c_double)
_RESTART = ctypes.CFUNCTYPE(c_int, c_void_p, c_double)


@once
def _routines() -> Built:
    source = RoutineSource("integrators.event_routines", _FILES)
    return build_code([], CodeOptions(level=2), exports=("search", "restart"), routines=source)


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
    signs
        What is known of each event before the first start; None for what the problem says.
    events
        The compiled events; None if they are a function in Python.
    interpolation
        With these, the addresses of a function ``int (void *session, double t, double *y, double *yp)`` and of its
        session.

    Attributes
    ----------
    place, functions
        The addresses of its memory, and of the routines that search and start anew.
    """

    def __init__(
        self,
        problem: ImplicitProblem | ExplicitProblem,
        horizon: float,
        signs: tuple[int, ...] | None = None,
        events: EventData | None = None,
        interpolation: tuple[int, int] = (0, 0),
    ) -> None:
        count, size = problem.event_count, problem.size
        self._calls: PythonCalls | None = None
        self._at: Interpolant | None = None  # what a function in Python reads
        if events is None:
            from atwood.codegen.sundials.events import EVENTS
            from atwood.integrators.python_calls import PythonCalls

            assert problem.events is not None
            self._calls = calls = PythonCalls()
            interpolation = calls.address(_INTERPOLATE, self._read, {2: size, 3: size}), 0
            function, data = calls.address(EVENTS, problem.events, {1: size, 2: size}, (3, count)), 0
        else:
            function, data = events.plain, events.address
        self._own = problem.event_signs
        turns, rows, points = len(FIELDS) + 3 * size, len(FIELDS) + 5 * size, (STACK + MOST + 2) * (1 + 2 * count)
        kept = rows + len(ROWS) * count + points
        self._numbers = memory = np.zeros(kept + len(ROWS) * count)
        self._integers = memory.view(np.int64)
        self._state = memory[len(FIELDS) : turns - size].reshape(2, size)
        memory[turns:rows].reshape(2, size)[:] = [turn(1.0 + 2.4 * np.arange(size)) for turn in (np.cos, np.sin)]
        self._rows = memory[rows : rows + len(ROWS) * count].reshape(len(ROWS), count)
        self._kept_rows = memory[kept:].reshape(len(ROWS), count)
        self._row("direction")[:] = problem.event_directions or 0.0
        self._row("rough")[list(problem.event_rough)] = 1.0
        self.place = begin = memory.ctypes.data
        arrays = {name: begin + 8 * (len(FIELDS) + k * size) for k, name in enumerate(("y", "yp", "shifted", "turns"))}
        self._set(interpolate=interpolation[0], session=interpolation[1], events=function, data=data)
        self._set(**arrays, rows=begin + 8 * rows, kept=begin + 8 * kept, size=size, count=count)
        self._keep = events
        addresses = _routines().code.addresses
        self.functions = addresses["search"], addresses["restart"]
        self._search, self._restart = _SEARCH(self.functions[0]), _RESTART(self.functions[1])
        self.begin(horizon, signs)

    def begin(self, horizon: float, signs: tuple[int, ...] | None) -> None:
        """Begin another run, as a new locator would."""
        self._given = self._own if signs is None else signs
        self._row("sign")[:] = self._row("fired")[:] = 0.0
        self._set(moment=100 * ROUNDING * horizon, fired_at=nan, settling=1, evaluations=0, change=inf, told=-inf)

    def change_at(self, t: float) -> None:
        """Know when parameters change next."""
        self._set(change=t)

    def tell(self, t: float) -> None:
        """Know that a state was handed out that the steps did not hand out themselves."""
        self._set(told=t)

    def _row(self, name: str) -> FloatArray:
        row: FloatArray = self._rows[ROWS[name]]
        return row

    def _set(self, **fields: float) -> None:
        for name, value in fields.items():
            (self._numbers if FIELDS[name] is NUMBER else self._integers)[_PLACES[name]] = value

    @property
    def signs(self) -> FloatArray:
        """The sign that each event last had for certain; zero where it is not known."""
        return self._row("sign")

    @property
    def evaluations(self) -> int:
        """How often events have been evaluated."""
        return int(self._integers[_PLACES["evaluations"]])

    @property
    def is_settling(self) -> bool:
        """Whether nothing is known yet of the first step after a restart."""
        return bool(self._integers[_PLACES["settling"]])

    def settle(self) -> None:
        """Know that nothing happened in the first step after the last start."""
        self._set(settling=0)

    def _read(self, _: int | None, t: float, y: FloatArray, yp: FloatArray) -> bool:
        assert self._at is not None
        y[:], yp[:] = self._at(t)[1:]
        return True

    def restart(self, state: State) -> None:
        """Take the signs from a new start of the solution."""
        self._at = lambda _: state
        given, self._given = self._given, ()
        self._row("given")[:] = given or self.handed_on(state[0])
        self._set(is_first=int(bool(given)))
        self._run(self._restart, state[0])

    def handed_on(self, t: float, ahead: Root | None = None) -> tuple[int, ...]:
        """Return what a start at a time is to know of each event: its sign, or that it has just happened."""
        has_fired = t == self._numbers[_PLACES["fired_at"]]
        found = _whole(self._row("sign"))
        if has_fired:
            found = [JUST_HAPPENED if one else sign for one, sign in zip(self._row("fired"), found, strict=True)]
        return tuple(found if ahead is None else (-one or sign for one, sign in zip(ahead.events, found, strict=True)))

    def search(self, begin: float, end: float, at: Interpolant) -> Root | None:
        """Return the first root between two times of the last step, or `None`.

        After a root the search can go on from the root's time.  Functions in Python read the interpolant `at`.
        """
        self._kept_rows[:], self._at = self._rows, at
        return self.found(self._run(self._search, begin, end))

    def forget_search(self) -> None:
        """Know what was known before the last search, as the step in which it searched is another one now."""
        self._rows[:] = self._kept_rows

    @property
    def last(self) -> float:
        """The time of the event that was found last."""
        return float(self._numbers[_PLACES["root"]])

    def found(self, code: int) -> Root | None:
        """Return what a search has found that ended so."""
        if not self._checked(code):
            return None
        y, yp = self._state
        state = self.last, y.copy(), yp.copy()
        return Root(state, tuple(_whole(self._row("found"))))

    def _run(self, function: Callable[..., int], *times: float) -> int:
        """Return the code with which a routine ends, or raise what it says."""
        calls = self._calls
        return self._checked(function(self.place, *times) if calls is None else calls.run(function, self.place, *times))

    def _checked(self, code: int) -> int:
        """Return a code, or raise what it says."""
        if code in (NO_STATE, NO_VALUE):
            time, bad = self._numbers[_PLACES["root"]], int(self._integers[_PLACES["bad"]])
            why = None if self._calls is None else self._calls.complaint
            if why is not None and code == NO_STATE:
                raise why
            if why is not None:
                raise KernelEvaluationError(f"the event functions have no value at t = {time:.9g}: {why}") from why
            what = (
                "the right-hand side has no value within a step,"
                if code == NO_STATE
                else f"event function {bad} has no value"
            )
            raise KernelEvaluationError(f"{what} at t = {time:.9g}")
        return code


def _whole(values: FloatArray) -> list[int]:
    return [int(one) for one in values.tolist()]
