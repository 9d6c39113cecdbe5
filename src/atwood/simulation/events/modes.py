"""Events and modes: what is watched, by which margins, and how a state is taken into another mode.

An event maps (mode, q, u) to (mode, q, u). States pass between modes through maximal coordinates, which both share.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from atwood.arrays import BoolArray, FloatArray
from atwood.codegen import BoundKernel
from atwood.expr import Program, depends_on
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.loose import has_touched, is_loose, loosened
from atwood.forms.quantities import known_program
from atwood.integrators.event_location import ALIKE, LONGEST, PASSED, ROUNDING, SHORT, TINY
from atwood.integrators.protocol import StepResult
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.outputs.event_functions import (
    CLOSES,
    CONTACT,
    RESTS,
    RUNS,
    UPDATE,
    EventFunction,
    list_event_functions,
)
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.orientation_coordinates import (
    COORDINATE_SWITCH,
    switch_functions,
)
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.simulation.dynamics.scales import coordinate_scales
from atwood.simulation.events.sides import SIDE, side_functions
from atwood.simulation.problem.conditions import Condition, condition_functions
from atwood.simulation.problem.problem import SceneProblem

if TYPE_CHECKING:
    from atwood.codegen.sundials.events import EventCode, EventData


_EVENT_FUNCTIONS: Key[tuple[EventFunction, ...]] = Key("event functions")
_NEEDS: Key[_Needs] = Key("what event functions read")
_EVENTS: Key[Program] = Key("events")
_EVENT_PROGRAM: Key[Program | None] = Key("events and their shifts")
_EVENT_CODE: Key[EventCode | None] = Key("machine code of events")
_REACTIONS: Key[ReactionSolver] = Key("reactions that events read")
_AT_START: Key[dict[str, Any]] = Key("what events know at the start of a mode")
_RATES: Key[Program] = Key("rates of gaps")
_IS_THERE: Key[Program] = Key("whether an event is there")


@dataclass(frozen=True)
class Impact:
    """What happened where a gap closed with a speed.

    Attributes
    ----------
    time
        s.
    part, law
        The component, and its gap.
    impulse
        Along the gap, N s or N m s.
    friction
        Impulses along its slips.
    before, after
        Rates of the gap, m/s or rad/s; the first is negative.
    loss
        Energy that was lost, J, also by friction.
    """

    time: float
    part: str
    law: str
    impulse: float
    friction: tuple[float, ...]
    before: float
    after: float
    loss: float


@dataclass(frozen=True)
class EventRecord:
    """An event that has happened.

    Attributes
    ----------
    time
        s.
    part, law
        Whose event it is.
    message
        What has happened, in words.
    target
        The mode it led to, or ``"stop"``; empty where no mode changed.
    impact
        Whether velocities jumped.
    kind
        ``"event"`` for one that a part declares. Of gaps and slips ``"impact"``, ``"closes"``, ``"opens"``,
        ``"slips"``, ``"sticks"``, ``"reverses"`` (of a slip), ``"rests"`` (impacts have accumulated) or ``"jams"``.
    struck
        Of an impact of a gap its impulses, speeds and loss.
    """

    time: float
    part: str
    law: str
    message: str
    target: str
    impact: bool
    kind: str = "event"
    struck: Impact | None = None

    def describe(self) -> str:
        """Return what happened, where and when."""
        return f"at t = {self.time:.9g} s, {self.part}{': ' if self.part else ''}{self.message}"


LAST = 1000
"""So many impacts are remembered, to see whether they follow each other ever faster."""


@dataclass(frozen=True, eq=False)
class ToldLater:
    """Events at jumps that the steps have made by themselves, which few ask for.

    Attributes
    ----------
    make
        Tells of them, in order.
    strikes
        Gives times and parts of the impacts among them, of many the last.
    """

    make: Callable[[], Sequence[EventRecord]]
    strikes: Callable[[], Sequence[tuple[float, str]]]

    @cached_property
    def events(self) -> Sequence[EventRecord]:
        """The events."""
        return self.make()


def find_event_functions(assembly: Assembly) -> tuple[EventFunction, ...]:
    """Return what is watched in the modes of an assembly."""
    return assembly.shared.get(_EVENT_FUNCTIONS, lambda: _event_functions(assembly), is_loose(assembly))


def _event_functions(assembly: Assembly) -> tuple[EventFunction, ...]:
    declared = list_event_functions(assembly.mechanism, assembly.own_equations, assembly.reactions, assembly.modes)
    values = loosened(assembly, [one.value for one in declared])
    found = [
        one if one.value is value else replace(one, value=value) for one, value in zip(declared, values, strict=True)
    ]
    return (
        *(one for one in found if not (one.target in CONTACT and one.value.is_constant)),
        *side_functions(assembly),
        *switch_functions(assembly.own_equations),  # last: of what happens at the same time, the others come first
    )


@dataclass(frozen=True)
class _Needs:
    """Whether events read reactions, or accelerations."""

    reactions: bool
    accelerations: bool


_NOTHING = _Needs(False, False)


def _find_needs(assembly: Assembly, event_functions: Sequence[EventFunction]) -> _Needs:
    symbols, accelerations = [one.symbol for one in assembly.reactions], assembly.own_equations.accelerations
    return _Needs(
        depends_on([one.value for one in event_functions], symbols),
        depends_on([one.value for one in event_functions], accelerations),
    )


MARGIN = 10.0
"""What starts at zero must pass it by so many tolerances, lest errors of a step set it off."""

_RUNS = 1000.0
"""Times what is small: slips in two directions that are faster than this may come to rest again."""

_BLUR = 8.0
"""Times rounding: a gap that opens at zero has closed again when it has passed zero by so much."""

_MOVED = 1e-6
"""Relative to themselves or to their scales, coordinates are moved by so much to see what reads them."""

_MOMENT = 1e-12
"""In units of the scene's time: so much later it is seen whether something slows down."""


def margins_at_start(
    functions: Sequence[EventFunction], values: FloatArray, small: FloatArray
) -> tuple[BoolArray, FloatArray]:
    """Return which events have happened where a mode starts, and what is added to those that start at zero."""
    directions = np.array([one.direction for one in functions], dtype=np.float64)
    counts = np.array([not one.is_noted for one in functions], dtype=np.bool_)
    happened: BoolArray = counts & (directions * values > PASSED * small)
    return happened, np.where(counts & (np.abs(values) <= small), -directions * small, 0.0)


_SEEN = frozenset(("shift", "_sides", "needs", "reactions", "kernel", "broken"))
"""What an `EventProbe` knows when it has looked at the start of its mode."""


class EventProbe:
    """The events of one mode as a function of the solver's state.

    Parameters
    ----------
    plan
        The scene in its mode.
    t, q, u
        The state at the start of the mode.
    tolerance
        Relative tolerance of the run. A one-sided event that starts within ten times this of zero, as a rope does that
        has just gone slack, happens only when it has passed zero by as much; else errors of a step would set it off.
    conditions
        What the run looks for besides.

    Attributes
    ----------
    handed
        What the session before, in the same mode, hands on; see `EventLocator.handed_on`.
    """

    shift: FloatArray
    needs: _Needs
    reactions: ReactionSolver | None
    kernel: BoundKernel | None
    broken: EventFunction | None
    _sides: FloatArray

    def __init__(
        self,
        plan: SceneProblem,
        t: float,
        q: FloatArray,
        u: FloatArray,
        tolerance: float,
        conditions: tuple[Condition, ...] = (),
    ) -> None:
        self.plan = plan
        self.handed: tuple[int, ...] = ()
        self.assembly = assembly = plan.assembly
        self._about = conditions, is_loose(assembly)
        self.event_functions = (*condition_functions(assembly, conditions), *find_event_functions(assembly))
        self._start = t, q.copy(), u.copy(), tolerance

    def of(self, plan: SceneProblem) -> EventProbe:
        """Return the same of a copy of its plan, with what is seen at the start."""
        made, _ = object.__new__(EventProbe), self.broken
        vars(made).update(vars(self), plan=plan)
        return made

    def at(self, plan: SceneProblem, t: float, q: FloatArray, u: FloatArray) -> EventProbe:
        """Return the same events from another state on, in which the same is watched."""
        made, start = object.__new__(EventProbe), (t, q.copy(), u.copy(), self._start[3])
        own = {"event_functions": self.event_functions, "_about": self._about, "_start": start}
        vars(made).update(own, plan=plan, assembly=plan.assembly, handed=())
        return made

    def __getattr__(self, name: str) -> Any:
        """Look at the start when somebody asks for what is seen there: most changes of a set are followed by others."""
        if name not in _SEEN:
            raise AttributeError(name)
        (t, q, u, tolerance), plan = self._start, self.plan
        about = t, q.tobytes(), u.tobytes(), tolerance, plan.scales, plan.finding.kept, self._about
        seen = self.assembly.kept.get(_AT_START, self._seen, *about)
        vars(self).update(seen)
        return seen[name]

    def _seen(self) -> dict[str, Any]:
        """Return what is seen at the start."""
        self.shift = self._sides = np.zeros(0)
        self.needs = _NOTHING
        self.reactions = self.kernel = self.broken = None
        if self.event_functions:
            self._look(*self._start)
        return {name: vars(self)[name] for name in _SEEN}

    def _look(self, t: float, q: FloatArray, u: FloatArray, tolerance: float) -> None:
        """See where the events are at the start of the mode."""
        plan, assembly = self.plan, self.assembly
        self.needs = assembly.shared.get(_NEEDS, lambda: _find_needs(assembly, self.event_functions), self._about)
        state = t, q.tobytes(), u.tobytes()
        if self.needs.reactions:
            self.reactions = assembly.kept.get(_REACTIONS, lambda: ReactionSolver(assembly, t, q, u), *state)
        program = self.program() if self.needs == _NOTHING else None
        if program is None:
            watched = [one.value for one in self.event_functions]
            program = known_program(assembly, _EVENTS, lambda: watched, self._about)
        self.kernel = assembly.kernel(program)
        sizes = [plan.scales.of_law(one.part, one.law, one.unit) for one in self.event_functions]
        small = MARGIN * tolerance * np.array(sizes)
        self.shift = np.zeros(len(small))
        values = self.values(t, q, u)
        happened, self.shift = margins_at_start(self.event_functions, values, small)
        self._sides = np.where(np.abs(values) > small, np.sign(values), 0.0)
        sided = np.array([one.target == SIDE for one in self.event_functions], dtype=np.bool_)
        # What has just passed zero, or will soon, is off by rounding.
        self.shift = np.where(sided & (values <= 0.0), 2.0 * np.abs(values) + TINY, self.shift)
        opening = self._opening(t, q, u, small) & (happened | (np.abs(values) <= small))
        if opening.any():
            blur = _BLUR * self._rounding(t, q, u, values)
            opening &= np.abs(values) <= np.maximum(small, blur)  # far from the origin the second is larger
            self.shift = np.where(opening, np.where(values > blur, 0.0, 2.0 * np.abs(values) + blur), self.shift)
        happened &= ~opening
        self._arm(values, small, happened, (t, q, u))
        self.broken = next((one for one, has in zip(self.event_functions, happened, strict=True) if has), None)

    def _arm(
        self, values: FloatArray, small: FloatArray, happened: BoolArray, state: tuple[float, FloatArray, FloatArray]
    ) -> None:
        """Look for slips in two directions to fall below what is small; of those that begin, first to rise above it."""
        later = None
        for i, one in enumerate(self.event_functions):
            if one.target in (RESTS, RUNS):
                size = abs(values[i])
                runs = size > _RUNS * small[i]
                if small[i] < size <= _RUNS * small[i]:  # several come to rest together, and one of them is first
                    later = self._soon(*state) if later is None else later
                    runs = abs(later[i]) < size
                is_off = runs == (one.target == RUNS)
                self.shift[i] = (2.0 * size + 2.0) if is_off else -small[i] if runs else _RUNS * small[i]
                happened[i] = False

    def _soon(self, t: float, q: FloatArray, u: FloatArray) -> FloatArray:
        """Return the values a moment later."""
        moment = _MOMENT * self.plan.scales.time
        rates = kinematic_map_of(self.assembly, self.assembly.form).rates(t, q, u)
        accelerations, _ = self.plan.balance.accelerate(t, q, u, self.plan.kept)
        return self.values(t + moment, q + moment * rates, u + moment * accelerations) - self.shift

    def _rounding(self, t: float, q: FloatArray, u: FloatArray, values: FloatArray) -> FloatArray:
        """Return by how much rounding of the coordinates that an event reads moves it."""
        scales = self.plan.scales
        far = np.maximum(np.abs(q), coordinate_scales(self.assembly.own_equations, scales.length))
        moved = np.array([self.values(t, q + step, u) - values for step in np.diag(_MOVED * far)])
        found: FloatArray = ROUNDING / _MOVED * np.sum(np.abs(moved), axis=0)
        return found

    def _opening(self, t: float, q: FloatArray, u: FloatArray, small: FloatArray) -> BoolArray:
        """Return which gaps are at zero and open with a speed: they need no margin."""
        found = np.zeros(len(self.event_functions), dtype=np.bool_)
        gaps = [
            (i, one.rate) for i, one in enumerate(self.event_functions) if one.target == CLOSES and one.rate is not None
        ]
        if gaps:
            program = known_program(self.assembly, _RATES, lambda: [rate for _, rate in gaps], self._about)
            idle = [0.0] * len(self.assembly.reactions)
            rates = self.assembly.kernel(program)([t], q, u, np.zeros_like(u), idle)[0]
            for (i, _), rate in zip(gaps, rates, strict=True):
                found[i] = rate * self.plan.scales.time > small[i]
        return found

    def follow(self, handed: tuple[int, ...]) -> None:
        """Take what the session before hands on; an event whose value has jumped has the sign that it has now.

        Relations of what moves are read anew: where one has changed, its difference begins at zero.
        """
        if not self.event_functions:
            return
        if len(handed) != len(self.event_functions):  # other relations are watched from here on
            handed = (0,) * len(self.event_functions) if handed else ()
        found = zip(handed, self._sides.tolist(), self.event_functions, strict=bool(handed))
        self.handed = tuple(
            0 if one.target == SIDE or (abs(sign) == 1 and sign * side < 0.0) else sign for sign, side, one in found
        )
        if not self.handed and any(one.target in CONTACT for one in self.event_functions):
            # What a state of a contact watches is positive in it, also where that is less than rounding.
            self.handed = tuple(int(one.target in CONTACT) for one in self.event_functions)

    @property
    def directions(self) -> tuple[int, ...]:
        """Direction of each event."""
        return tuple(one.direction for one in self.event_functions)

    @property
    def rough(self) -> tuple[int, ...]:
        """Numbers of the events whose exact time does not matter."""
        return tuple(i for i, one in enumerate(self.event_functions) if one.target == COORDINATE_SWITCH)

    @property
    def anew(self) -> tuple[int, ...]:
        """Numbers of the events of gaps and slips, at which a run starts anew."""
        return tuple(i for i, one in enumerate(self.event_functions) if one.target in CONTACT)

    def values(self, t: float, q: FloatArray, u: FloatArray) -> FloatArray:
        """Return the value of each event at a state, shifted where it starts at zero."""
        assert self.kernel is not None
        if self.needs == _NOTHING:
            return np.asarray(self.kernel([t], q, u, self.shift)[0])
        reactions: Any = [0.0] * len(self.assembly.reactions)
        accelerations = np.zeros_like(u)
        if self.reactions is not None:
            found, _ = self.reactions.at(np.array([t]), q[:, None], u[:, None])
            reactions = found[:, 0]
        if self.needs.accelerations and len(u):
            accelerations, _ = self.plan.balance.accelerate(t, q, u, self.plan.kept)
        values: FloatArray = np.asarray(self.kernel([t], q, u, accelerations, reactions)[0]) + self.shift
        return values

    def compiled(self, for_ida: bool) -> EventData | None:
        """Return the same as machine code, for one session; None if nothing is watched, or it cannot be compiled."""
        code = self.code(for_ida)
        return None if code is None else code.bind(self.assembly.parameter_values, self.shift)

    def code(self, for_ida: bool) -> EventCode | None:
        """Return the machine code of the same, for any parameter values and shifts; see `compiled`."""
        if not self.event_functions or not len(self.assembly.own_equations.coordinates):
            return None

        def make() -> EventCode | None:
            program = self.program()
            if program is None or program.calls_python:
                return None
            from atwood.codegen.sundials.events import compile_events

            return compile_events(program, for_ida, has_touched(self.assembly))

        return self.assembly.shared.get(_EVENT_CODE, make, for_ida, *self.key)

    @property
    def key(self) -> tuple[Any, ...]:
        """What the program of the events depends on, besides the scene in its mode."""
        maximal = () if self.reactions is None else self.reactions.finding.kept
        return self.plan.finding.kept, maximal, self._about

    def program(self) -> Program | None:
        """Return the events as a program of (t, q, u, shift); see `atwood.forms.event_program.event_program`."""
        kept, maximal, _ = self.key

        def make() -> Program | None:
            from atwood.forms.event_program import event_program

            return event_program(self.assembly, [one.value for one in self.event_functions], kept, maximal)

        return self.assembly.shared.get(_EVENT_PROGRAM, make, *self.key)

    def function(self) -> Callable[[float, FloatArray, FloatArray], FloatArray] | None:
        """Return the events as a function of the solver's vector; None if nothing is watched."""
        if not self.event_functions:
            return None
        n, m = len(self.assembly.own_equations.coordinates), len(self.assembly.own_equations.speeds)
        return lambda t, y, yp: self.values(t, y[:n], y[n : n + m])

    def sides_of_conditions(self, t: float, q: FloatArray, u: FloatArray) -> FloatArray:
        """Return on which side of zero each condition is at a state; 0 where it is at zero."""
        own = [one for one in self.event_functions if not one.part]
        sizes = [self.plan.scales.of_law(one.part, one.law, one.unit) for one in own]
        values = (self.values(t, q, u) - self.shift)[: len(own)]
        return np.where(np.abs(values) > MARGIN * self._start[3] * np.array(sizes), np.sign(values), 0.0)

    def jumped(self, before: FloatArray, t: float, q: FloatArray, u: FloatArray) -> list[EventRecord]:
        """Return the conditions that a jump has taken from one side of zero to the other, as that of an impact."""
        found = zip(self.event_functions, before, self.sides_of_conditions(t, q, u), strict=False)
        return [
            self._record(t, one)
            for one, was, side in found
            if one.is_there is None and was * side < 0.0 and one.direction in (0, side)
        ]

    def broken_at_start(self, t: float) -> EventRecord | None:
        """Return the first event whose one-sided bound does not hold from the outset."""
        return None if self.broken is None else self._record(t, self.broken)

    def between(self, start: float, end: float) -> EventRecord | None:
        """Return the first event between two times in which nothing is free to move; None if there is none."""
        if not self.event_functions:
            return None
        nothing = np.zeros(0)
        before, after = self.values(start, nothing, nothing), self.values(end, nothing, nothing)
        found: list[tuple[float, EventFunction]] = []
        for i, function in enumerate(self.event_functions):
            if before[i] == 0.0 or np.sign(before[i]) == np.sign(after[i]):
                continue
            if function.direction and np.sign(after[i] - before[i]) != function.direction:
                continue
            low, high = start, end
            while high - low > 4e-16 * max(abs(low), abs(high), end - start):
                middle = 0.5 * (low + high)
                if not low < middle < high:
                    break
                same = np.sign(self.values(middle, nothing, nothing)[i]) == np.sign(before[i])
                low, high = (middle, high) if same else (low, middle)
            found.append((high, function))
        return self._record(*min(found, key=lambda one: one[0])) if found else None

    def changing(self, step: StepResult) -> list[EventRecord]:
        """Return what changes something when the driver reports events: the first, and further updates of states."""
        found = [self._record(step.t, one) for one in self._fired(step) if one.target]
        return [one for i, one in enumerate(found) if i == 0 or one.target in (UPDATE, *CONTACT)]

    def noted(self, step: StepResult) -> list[EventRecord]:
        """Return what changes nothing among what the driver reports."""
        return [self._record(step.t, one) for one in self._fired(step) if not one.target]

    def changed_sides(self, step: StepResult) -> tuple[int, ...]:
        """Return the numbers of the relations of what moves that change where the driver stopped."""
        return tuple(int(one.law) for one in self._fired(step) if one.target == SIDE)

    def _fired(self, step: StepResult) -> list[EventFunction]:
        """Return what the driver reports, without zeros that do not count."""
        fired = [one for one, sign in zip(self.event_functions, step.events, strict=True) if sign]
        return [one for one in fired if one.is_there is None or self._is_there(step, one)]

    def _is_there(self, step: StepResult, one: EventFunction) -> bool:
        assembly, expression = self.assembly, one.is_there
        assert expression is not None
        program = known_program(assembly, _IS_THERE, lambda: [expression], one.law, self._about)
        kernel = assembly.kernel(program)
        q, u = self.plan.program.split(step.y)
        return bool(kernel([step.t], q, u, np.zeros_like(u), [0.0] * len(assembly.reactions))[0][0] > 0.0)

    def _record(self, t: float, function: EventFunction) -> EventRecord:
        return EventRecord(t, function.part, function.law, function.message, function.target, function.impact)


def without_margin(
    values: Callable[[float, FloatArray], FloatArray], shift: FloatArray, step: StepResult, began: float
) -> StepResult:
    """Return an event at the time at which its value was zero.

    What starts at zero has to pass it by ten times the tolerance, lest errors of a step set it off.
    Where it comes from the other side, and crosses the margin in a small part of the time since the mode began,
    there is no doubt, and the margin would only make the event late, and what follows later still.
    """
    fired = [i for i, sign in enumerate(step.events) if sign]
    since = step.t - began
    if not fired or not all(shift[fired]) or not since > 0.0:
        return step
    margins = shift[fired]
    now, rates = _passing(values, step, fired, SHORT * since)
    now = now - margins
    if np.any(rates * margins >= 0.0) or not np.all(np.abs(now) < LONGEST * since * np.abs(rates)):
        return step
    earlier = float(np.min(now / rates))  # equal ones happen at once
    if not np.max(now / rates) <= ALIKE * earlier:
        return step
    return replace(step, t=step.t - earlier, y=step.y - earlier * step.yp)


def seen_late(
    values: Callable[[float, FloatArray], FloatArray], shift: FloatArray, step: StepResult, began: float
) -> float:
    """Return how long after their zeros events without a margin were seen, s.

    Times are rounded, and always past them.
    """
    fired, since = [i for i, sign in enumerate(step.events) if sign], step.t - began
    if not fired or any(shift[fired]) or not since > 0.0:
        return 0.0
    now, rates = _passing(values, step, fired, SHORT * since)
    if not np.all(now * rates > 0.0):
        return 0.0
    return min(float(np.min(now / rates)), 4.0 * ROUNDING * (abs(step.t) + since))


def _passing(
    values: Callable[[float, FloatArray], FloatArray], step: StepResult, fired: list[int], short: float
) -> tuple[FloatArray, FloatArray]:
    """Return values of events, and their rates over a short time before."""
    now, before = (values(step.t - t, step.y - t * step.yp)[fired] for t in (0.0, short))
    return now, (now - before) / short
