"""One mode of a scene with events, as the runs of a sweep meet it: its rates, its events and a session."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen.sundials.events import EventCode, EventData
from atwood.errors import AtwoodError
from atwood.expr import Program
from atwood.forms.assembly import Assembly
from atwood.forms.other_values import decisions_of
from atwood.forms.sides import has_sides
from atwood.integrators.embedded.looks import handed
from atwood.integrators.embedded.rates import CompiledAccelerations, OwnRates
from atwood.integrators.embedded.tableau import Tableau
from atwood.integrators.event_location import NOISE, ROUNDING
from atwood.integrators.explicit_session import ExplicitSession
from atwood.integrators.lanes import LanePlaces, Watched
from atwood.integrators.protocol import Budget, Handed, Statistics, Status, StepResult
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.outputs.event_functions import EventFunction
from atwood.simulation.dynamics.orientation_coordinates import COORDINATE_SWITCH
from atwood.simulation.dynamics.scales import size_of, total_masses
from atwood.simulation.events.modes import MARGIN, EventProbe, EventRecord, margins_at_start, without_margin
from atwood.simulation.problem.explicit_scene import own_rates
from atwood.simulation.problem.preparation import make_problem
from atwood.simulation.run.choice import choose
from atwood.study.sweeps.motions import Motion, lanes_for, task_of
from atwood.study.sweeps.runs import SweepRequest

_CLEAR = 4.0
"""The sign of an event at the start is beyond doubt from so many times its rounding on."""


@dataclass(frozen=True, eq=False)
class SweepMode:
    """A mode with a session of its own, for one thread.

    Attributes
    ----------
    motion
        The scene in this mode, with the values of the first run.
    functions
        What is watched.
    session
        Takes the steps of one run after another.
    rates, own_rates
        The compiled rates, and their place for parameters.
    events, event_data, program
        The compiled events with theirs, and their program of (t, q, u, shift); None where nothing is watched.
    columns
        Where the parameters of this mode stand among those of the sweep.
    pair
        The method.
    lanes
        Opens a session that takes runs side by side; None where there is none for this mode.
    """

    motion: Motion
    functions: tuple[EventFunction, ...]
    session: ExplicitSession
    rates: CompiledAccelerations
    own_rates: OwnRates
    events: EventCode | None
    event_data: EventData | None
    program: Program | None
    columns: NDArray[np.intp]
    pair: Tableau
    lanes: Callable[[], LanePlaces | None]

    @property
    def assembly(self) -> Assembly:
        """The scene in this mode."""
        return self.motion.assembly

    @property
    def coordinates(self) -> int:
        """How many coordinates there are."""
        return len(self.assembly.reduced.coordinates)

    def arranged(self, rows: FloatArray) -> FloatArray:
        """Return parameters of runs, one row each, in the order of this mode."""
        return rows[:, self.columns]

    def keeps_state(self, modes: tuple[tuple[str, str], ...]) -> bool:
        """Return whether other modes have the same coordinates and speeds, none of them held by a constraint."""
        other, own = self.assembly.other_mode(dict(modes), {}).reduced, self.assembly.reduced
        alike = [one.name for one in other.names] == [one.name for one in own.names]
        return (
            alike
            and [one.name for one in other.speed_names] == [one.name for one in own.speed_names]
            and not (other.constraints or own.constraints or own.orientation_coordinates)
        )

    def signs(
        self,
        t: FloatArray,
        q: FloatArray,
        u: FloatArray,
        values: FloatArray | None,
        lengths: FloatArray,
        time: FloatArray,
        tolerance: float,
    ) -> tuple[Watched, NDArray[np.bool_], NDArray[np.bool_]]:
        """Return what is known of events at the start, and which runs can go on from there, alone and side by side.

        What is added to events that start at zero is that of `atwood.simulation.events.modes.EventProbe`; a run in
        which a one-sided bound does not hold at once is made by itself. Side by side with others goes what has signs
        beyond rounding: see `atwood.integrators.event_location`.
        """
        runs, count = len(t), len(self.functions)
        if self.program is None:
            nothing = np.zeros((runs, 0))
            return Watched(nothing, nothing), *np.ones((2, runs), dtype=bool)
        bound = self.assembly.parameter_values if values is None else values.T
        kernel = self.assembly.compiled(self.program, vectorized=True).bind(bound)

        def values_at(y: FloatArray) -> FloatArray:
            q, u = np.split(y, [self.coordinates], axis=1)
            return np.broadcast_to(kernel(t[None, :], q.T, u.T, np.zeros((count, runs)))[0], (count, runs)).T

        y = np.concatenate([q, u], axis=1)
        found = values_at(y)
        mass = total_masses(self.assembly, lengths, values)
        small = np.empty((runs, count))
        for k, one in enumerate(self.functions):
            small[:, k] = MARGIN * tolerance * size_of(one.unit, lengths, time, mass)
        happened, shifts = margins_at_start(self.functions, found, small)
        known = np.all(np.isfinite(found), axis=1) & np.all(found + shifts != 0.0, axis=1)
        usable = known & ~np.any(happened, axis=1)
        noise = np.zeros_like(found)
        for turn in (np.cos, np.sin):
            moved = values_at(y + ROUNDING * np.abs(y) * turn(1.0 + 2.4 * np.arange(y.shape[1])))
            noise = np.maximum(noise, NOISE * np.abs(moved - found))
        clear = usable & np.all(np.abs(found + shifts) > _CLEAR * noise, axis=1)
        return Watched(shifts, np.sign(found + shifts)), usable, clear

    def run(
        self,
        t: float,
        y: FloatArray,
        values: FloatArray | None,
        shift: FloatArray,
        absolute: FloatArray,
        budget: Budget,
        times: FloatArray,
        end: float,
        handed: Handed | None = None,
    ) -> tuple[FloatArray, StepResult, Statistics]:
        """Take a run from a state through output times, as far as no event stops it.

        It may have gone a part of the way side by side with others, and then goes on where it is `handed` over.
        """
        if values is not None:
            self.rates.fill(self.own_rates, values)
        if self.events is not None and self.event_data is not None:
            given = self.assembly.parameter_values if values is None else values
            self.events.fill(self.event_data, given, shift)
        self.session.begin_again(t, y, end - t, budget, None, end, absolute)
        if handed is not None:
            self.session.take_over(handed)
        found, _, result = self.session.sample(times)
        if result.status is Status.EVENT and self.event_data is not None:
            watched = self.event_data.function()
            result = without_margin(lambda t, y: watched(t, y, y), shift, result, t)
            found = found[: np.searchsorted(times[: len(found)], result.t, side="right")]
        return found, result, self.session.statistics

    def handed(self, numbers: FloatArray) -> Handed:
        """Return what a run is handed over with that was watched side by side with others."""
        size = self.coordinates + len(self.assembly.reduced.speeds)
        return handed(self.pair, size, len(self.functions), numbers)

    def event(self, result: StepResult) -> EventFunction | None:
        """Return which event a run goes on from: the first that happened and leads somewhere."""
        fired = (one for one, sign in zip(self.functions, result.events, strict=True) if sign and one.target)
        return next(fired, None)

    def record(self, event: EventFunction, t: float) -> EventRecord:
        """Return an event of a run."""
        return EventRecord(t, event.part, event.law, event.message, event.target, event.impact)


def find_mode(
    request: SweepRequest, modes: Mapping[str, str], at: tuple[float, FloatArray, FloatArray, float], varies: bool
) -> tuple[SweepMode | None, str]:
    """Return a mode of the first run, by what it is at a state; None, and why, where runs are made by themselves."""
    base, options = request.assembly, request.options
    assembly = base.other_mode(dict(modes), {})
    equations = assembly.reduced
    if equations.constraints or not equations.coordinates:
        return None, "events are watched where constraints are left among the coordinates"
    if has_sides(assembly):
        return None, "its laws compare what moves"
    t, q, u, length = at
    try:
        plan = make_problem(assembly, t, q, u, length, options.t_end - base.flat.t_start)
        chosen = choose(plan, options, t, q, u).method
        probe = EventProbe(plan, t, q, u, options.relative_tolerance, options.conditions)
    except AtwoodError:
        return None, "the first run cannot start"
    functions = probe.event_functions
    if plan.relative_share < 1.0:
        return None, "bodies float far from the origin"
    if chosen.tableau is None:
        return None, f"the solver is {chosen.key!r}, and events are watched"
    if any(one.target == COORDINATE_SWITCH for one in functions):
        return None, "its orientations change their coordinates on the way"
    names = [one.name for one in base.parameters]
    own = [one.name for one in assembly.parameters]
    if varies and (decisions_of(assembly.mechanism, assembly.shared) or not set(own) <= set(names)):
        return None, "what is varied may change how a mode is solved"
    columns = np.array([names.index(one) if one in names else 0 for one in own], dtype=np.intp)
    found, data = own_rates(assembly), probe.compiled(for_ida=False)
    if found is None or (functions and data is None):
        return None, "it calls functions in Python"
    motion = Motion(assembly)
    program = probe.program() if functions else None
    task = task_of(motion, chosen, options, assembly.parameter_values, found[1], functions, data, program)
    session = chosen.open(replace(task, t=t, y=np.concatenate([q, u])))
    assert isinstance(session, ExplicitSession)
    code = None if data is None else probe.code(for_ida=False)
    lanes = cache(lambda: lanes_for(chosen, task))
    return SweepMode(motion, functions, session, *found, code, data, program, columns, chosen.tableau, lanes), ""
