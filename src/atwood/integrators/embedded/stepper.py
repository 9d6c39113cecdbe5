"""Embedded pairs as machine code: no Python runs between outputs.

The code of the steps is the same for all problems of a pair and comes from the cache after the first time.  What a
problem adds is the compiled right-hand side (`atwood.integrators.embedded.rates`).

Memory of a session of an embedded pair: what routines and Python agree on.
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable, Mapping
from ctypes import c_double, c_int, c_void_p
from functools import partial
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import RoutineSource, once
from atwood.codegen.routines import ADDRESS, CODE, INTEGER, NUMBER, Kind, Routine, Value
from atwood.integrators.embedded.tableau import Tableau
from atwood.integrators.protocol import (
    PROJECTION,
    RATES,
    CompiledRates,
    ExplicitProblem,
    Handed,
    Nearest,
    SolverOptions,
    StepMonitor,
    absolute_tolerances,
)
from atwood.integrators.stepper import (
    COUNTED,
    LANE_FIELDS,
    PROJECTS,
    WIDTH,
    Memory,
    Routines,
    Stepper,
    fields_of,
    number_kind,
    open_routine as session_routine,
    routines_of,
)

if TYPE_CHECKING:
    from atwood.codegen.sundials.events import EventData
    from atwood.integrators.batch import BatchPlaces
    from atwood.integrators.event_location import EventLocator
    from atwood.integrators.jumps import Jumps
    from atwood.integrators.moments import Changes, Moments
    from atwood.integrators.python_calls import PythonCalls

FIELDS = fields_of(
    (
        *("function", "data", "arrays", "events", "events_data", "values", "signs"),
        *("project", "project_data", "watch", "watch_data", "due", "guard", "guard_data"),
        *("search", "restart", "locator", "jump", "jump_data", "behind"),
    ),
    (
        *("t", "t_old", "h", "next", "stop", "relative", "longest", "horizon", "first", "looked", "likeness", "tried"),
        *("last", "finish", "edgy", "calm"),
    ),
    (
        *("size", "padded", "is_dense", "event_count", "watches_stiffness", "seen", "looks"),
        *("waits", "found", "crossed"),
    ),
)


MANY_FIELDS: dict[str, Kind] = {
    **FIELDS,
    **LANE_FIELDS,
    "shortened": NUMBER,
    **dict.fromkeys(("derived", "scratch", "looks_at", "events_derived", "events_scratch"), ADDRESS),
    **dict.fromkeys(("arrived", "coordinates", "speeds", "given"), INTEGER),
}
"""The fields of runs side by side: which of them have arrived at the end of a step, and what their rates are."""


def open_routine(
    pair: Tableau,
    name: str,
    more: Mapping[str, Kind] | None = None,
    result: Kind = CODE,
    exported: bool = False,
    runs: int = 1,
) -> tuple[Routine, Memory, list[Value]]:
    """Return a new routine of a session, its memory, and its further arguments: numbers of each of so many runs."""
    fields = FIELDS if runs == 1 else MANY_FIELDS
    given = {one: number_kind(runs) if kind is NUMBER else kind for one, kind in (more or {}).items()}
    own = number_kind(runs) if result is NUMBER else result
    return session_routine(partial(Memory, fields, pair.rows, runs=runs), name, given, own, exported)


_GUARDS = ctypes.CFUNCTYPE(c_int, *[c_double, c_void_p, c_void_p] * 2, c_void_p)


class CompiledStepper(Stepper):
    """The state of a run with an embedded pair.

    Parameters
    ----------
    problem
        The equations.  Where these have no compiled functions, the steps call those in Python.
    options
        The accuracy.
    pair
        The method.
    """

    _fields = FIELDS

    def __init__(self, problem: ExplicitProblem, options: SolverOptions, pair: Tableau) -> None:
        self._size, self._options, self._rows = problem.size, options, pair.rows
        self._calls: PythonCalls | None = None
        self._restart: Callable[[float], None] | None = None
        self._faster_events: Callable[[float], int | None] | None = None
        self._jumps: Jumps | None = None
        guard = problem.guard
        if problem.compiled is None or (guard is not None and not guard.function):
            from atwood.integrators.python_calls import PythonCalls

            self._calls = PythonCalls()
        rates = self._in_python(problem) if problem.compiled is None else problem.compiled()
        self._rates, self._keep = rates, rates.keep
        n, padded = problem.size, -(-problem.size // WIDTH) * WIDTH
        # All memory is one piece, since looking up an address takes longer than a step: the table, fields, and outputs.
        begin = pair.rows["all"] * padded
        end = begin + len(FIELDS)
        memory = np.zeros(end + 2 * n)
        self._arrays = arrays = memory[:begin].reshape(-1, padded)
        self._values = memory[end:].reshape(2, n)
        self._ends = arrays[pair.rows["y"], :n], arrays[pair.rows["end slope"], :n]
        arrays[pair.rows["absolute"]] = 1.0
        arrays[pair.rows["absolute"], :n] = absolute_tolerances(options, n)
        self._begin_at(memory[begin:], arrays=memory.ctypes.data, size=n, padded=padded)
        self._set(function=rates.function, data=rates.data, project=rates.project, project_data=rates.project_data)
        self._set(relative=options.relative_tolerance, first=options.first_step or 0.0)
        self._set(longest=options.max_step or inf, horizon=options.horizon)
        if guard is not None:
            self._keep = (self._keep, guard)
            function = guard.function
            if self._calls is not None and not function:
                places = dict.fromkeys((1, 2, 4, 5), problem.size)
                function = self._calls.address(_GUARDS, guard.passes, places)
            self._set(guard=function, guard_data=guard.data)
        first = self._session + 8 * len(FIELDS)
        self._outputs = first, first + 8 * n
        self._routines = _routines(pair)
        self._functions = self._routines.functions

    def _go_on(self, last: int, function: str, *arguments: int) -> int | None:
        """Take steps, and see whether the next ones are to be taken by faster code."""
        if self._rates.faster is None and self._faster_events is None and self._jumps is None:
            return super()._go_on(last, function, *arguments)
        began = time.perf_counter()
        code = super()._go_on(last, function, *arguments)
        self._change_over(time.perf_counter() - began)
        return code

    def _change_over(self, seconds: float) -> None:
        """Go on with faster code, which has the same bits, where that pays after steps that took so long."""
        better = None if self._rates.faster is None else self._rates.faster(seconds)
        if better is not None:
            self._rates, self._keep = better, (self._keep, better.keep)
            self._set(function=better.function, project=better.project)
        events = None if self._faster_events is None else self._faster_events(seconds)
        if events is not None:
            self._faster_events = None
            self._set(events=events)
        if self._jumps is not None:
            self._jumps.spend(seconds)

    def batch_places(self) -> BatchPlaces:
        """Return the addresses with which many runs can be made in one call."""
        return self._batch_places(self._routines.built, self._arrays[self._rows["absolute"]])

    def through(self, changes: Changes) -> Moments | None:
        """Return a way through moments at which parameters change, from the start on."""
        from atwood.integrators.moments import Moments

        horizon = self._session + 8 * self._places["horizon"]
        return Moments(self.batch_places(), horizon, changes, self._ends[0], self._change_over)

    def watch(self, events: EventData) -> bool:
        """Come back with `Outcome.NOTICED` after a step in which an event may have happened."""
        self._events, self._signs = np.zeros((2, events.count))
        self._keep, self._restart, self._faster_events = (self._keep, events), events.restart, events.faster
        values, signs = (array.ctypes.data for array in (self._events, self._signs))
        self._set(events=events.explicit, events_data=events.address, values=values, signs=signs)
        self._set(event_count=events.count)
        return True

    def interpolation(self) -> tuple[int, int] | None:
        """Return the addresses of the function that reads the last step, and of its session."""
        return super().interpolation() if self._calls is None else None

    def expect(self, signs: FloatArray) -> None:
        """Say which sign each event has; where it is zero, every step is noticed."""
        self._signs[:] = signs

    def leap(self, locator: EventLocator, jumps: Jumps, last: float) -> bool:
        """Locate events without Python, up to a last time, and make the jumps that can be made so."""
        if self._count("locator") != locator.place:
            self._keep, self._jumps = (self._keep, locator), jumps
            search, restart = locator.functions
            self._set(search=search, restart=restart, locator=locator.place, signs=locator.signs.ctypes.data)
        finish = self._number("t") + self._number("horizon")
        self._set(jump=jumps.function, jump_data=jumps.data, last=last, finish=finish)
        return True

    @property
    def waits(self) -> bool:
        """Whether an event is located that nobody has seen to yet."""
        return self._count("waits") == 1

    def take_event(self) -> int | None:
        """Return what came of the search for an event that is left to Python, once; None where there is none."""
        if self._count("waits") != 2:
            return None
        self._set(waits=0)
        return self._count("found")

    def shorten(self, event: float) -> bool:
        """Take the last step anew to just behind an event, where that finds it better; whether it was."""
        return self._call("shorten", event) != 0

    def nearest(self, t: FloatArray, y: FloatArray, sizes: FloatArray) -> Nearest | None:
        """Take states, one row each, onto the constraints as steps are; None where none can be taken so."""
        return None if self._calls is not None else super().nearest(t, y, sizes)

    def set_monitor(self, monitor: StepMonitor) -> bool:
        """Let the motion be looked at, and come back with `Outcome.NOTICED` where something is seen."""
        self._monitor = monitor
        self._set(jump=0)  # what looks at the motion starts anew at each event
        self._set(watch=monitor.watch or monitor.look, watch_data=monitor.watch_data or monitor.data)
        self._set(due=monitor.due_at, behind=monitor.behind)
        return True

    def has_noticed(self) -> bool:
        """Return whether something was seen since this was last asked."""
        seen = self._count("seen")
        self._set(seen=0)
        return seen != 0

    def limit_steps(self, longest: float) -> None:
        """Take no longer steps from now on than this, nor than the options allow."""
        self._set(longest=min(longest, self._options.max_step or inf))

    def watch_stiffness(self) -> None:
        """Let `run` and `sample` come back with `Outcome.NOTICED` whenever the problem seems stiff."""
        self._set(watches_stiffness=1)

    def renew(self, horizon: float, absolute: FloatArray | None = None) -> None:
        """Count from zero again, for a run of another typical length, s, and perhaps with other tolerances."""
        if absolute is not None:
            self._arrays[self._rows["absolute"], : self._size] = np.maximum(absolute, np.finfo(float).tiny)
        self._integers[self._places["steps"] :][:COUNTED] = 0
        self._set(horizon=horizon, longest=self._options.max_step or inf, watch=0, seen=0)

    def take_over(self, handed: Handed) -> None:
        """Stand behind a step that was taken side by side with those of other runs."""
        self._arrays[:, : self._size] = handed.rows
        names = {"taken": "steps", "edges": "stiff"}
        self._set(is_dense=0, **{names.get(name, name): value for name, value in handed.fields.items()})

    def begin_of_step(self) -> float:
        """Return the time at the begin of the last step."""
        return self._number("t_old")

    def start(self, t: float, y: FloatArray) -> bool:
        """Start anew from a state; return whether it has finite rates."""
        self._change_over(0.0)
        if self._restart is not None:
            self._restart(t)
        return super().start(t, y)

    def _call(self, function: str, *arguments: float) -> int:
        """Call a function of the steps and return its code, or raise what Python functions raised in it."""
        own = super()._call
        return own(function, *arguments) if self._calls is None else self._calls.run(own, function, *arguments)

    def _in_python(self, problem: ExplicitProblem) -> CompiledRates:
        """Return rates and projection that call Python."""
        size, calls = problem.size, self._calls
        assert calls is not None
        rates = calls.address(RATES, problem.rates, {1: size}, (2, size))
        project = 0 if problem.project is None else calls.address(PROJECTION, problem.project, {1: size}, (1, size))
        return CompiledRates(rates, project=project, keep=calls)


_FILES = (
    *(f"integrators/embedded/{name}.py" for name in ("dense_output", "stepper", "tableau")),
    *(f"integrators/{name}.py" for name in ("event_location", "protocol", "stepper")),
)


@once
def _routines(pair: Tableau) -> Routines:
    """Return the routines of a pair."""
    source = RoutineSource("integrators.embedded.steps", _FILES, (pair,))
    return routines_of(source, project_each=PROJECTS, shorten=(c_double,))
