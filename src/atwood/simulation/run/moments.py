"""Sample times and time events of a run that its steps pass without Python; see `atwood.integrators.moments`.

That is where nothing is watched, nothing prescribed jumps, and the steps are machine code. What is recorded is what
single stretches record, to the bit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np

from atwood.arrays import BoolArray, FloatArray, IntArray
from atwood.clock import check_time
from atwood.forms.assembly import Assembly
from atwood.integrators.explicit_session import ExplicitSession
from atwood.integrators.moments import DONE, PAUSES, USED_UP, Changes
from atwood.integrators.session import Session
from atwood.lazy_dataclasses import dataclass
from atwood.simulation.events.impacts_in_time import motion_switches
from atwood.simulation.events.sampling import Sampler, Updated
from atwood.simulation.events.time_events import MOMENT, Schedule
from atwood.simulation.problem.options import RunOptions, Samples
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.run.recorder import Recorder
from atwood.simulation.run.session import Filling

_BLOCKS = 50
"""Progress is told about so many times."""

_MANY = 20
"""From so many updates on it pays to compile them."""


@dataclass(frozen=True, eq=False)
class Ahead:
    """The moments that lie ahead of a stretch.

    Attributes
    ----------
    times
        Its start, and the moments, s.
    samples
        Those of the rest of the run.
    schedule, sampler
        What they are made of.
    update
        Makes updates at a time, of a scene in a state, in Python.
    """

    times: FloatArray
    samples: Samples
    schedule: Schedule
    sampler: Sampler
    update: Callable[[Sequence[int], Assembly, float, FloatArray, FloatArray], Updated]


@dataclass(frozen=True, eq=False)
class Passed:
    """Where a run is that went through moments.

    Attributes
    ----------
    t, begun
        The time, and that of the last moment that it went through, s.
    held
        The discrete states.
    is_refused
        Whether it did not go on by itself.
    error
        What an update has raised.
    """

    t: float
    begun: float
    held: tuple[float, ...]
    is_refused: bool
    error: Exception | None


def times_ahead(plan: SceneProblem, schedule: Schedule, sampler: Sampler, t: float, options: RunOptions) -> FloatArray:
    """Return a time, and the moments after it that steps can pass by themselves: none if they cannot."""
    assembly, end = plan.assembly, options.t_end
    own = assembly.own_equations
    times, are_apart = _merged(t, end, schedule.times.tobytes(), sampler.times.tobytes())
    if len(times) == 1:
        return times
    is_plain = not (
        plan.finding.redundant
        or plan.dependent_speeds
        or (own.contacts and sampler.updates)
        or assembly.sides is not None
        or plan.balance.kinematic_map.has_homogeneous
        or motion_switches(assembly)
        or (options.max_steps is not None and not own.contacts)
        or options.on_step is not None
        or options.conditions
        or any(one.law.options.at for one in sampler.updates)
    )
    return times if is_plain and are_apart else times[:1]


@lru_cache(maxsize=4)
def _merged(t: float, end: float, *given: bytes) -> tuple[FloatArray, bool]:
    """Return a time and those of some moments that come behind it, before an end, and whether steps fit between."""
    moments = [one[one > t] for one in map(np.frombuffer, given)]
    times = np.unique(np.concatenate([[t], *moments]))
    times = times[times < end]
    times.flags.writeable = False
    gaps = np.diff(np.concatenate([times, [end]]))
    return times, bool(np.all(gaps > MOMENT * np.spacing(np.abs(times) + end)))


def change_on_the_way(session: Session, ahead: Ahead, plan: SceneProblem) -> bool:
    """Let steps that change sets of contacts pass the time events ahead, too; return whether they can."""
    if not isinstance(session, ExplicitSession):
        return False
    relations = ahead.schedule.values[:, ahead.schedule.times.searchsorted(ahead.times, side="right")].T
    place = len(plan.assembly.parameters) - relations.shape[1]
    return session.change_at(ahead.times[1:], relations, place, float(ahead.samples.times[-1]))


def pass_moments(
    session: ExplicitSession,
    filling: Filling,
    recorder: Recorder,
    ahead: Ahead,
    start: FloatArray,
    first_shown: bool,
    progress: Callable[[float], object] | None,
) -> Passed | None:
    """Go through moments, and record what single stretches would; None where not even the first came out well."""
    way = _Way(ahead, recorder.plan)
    given, changes = ahead.samples, way.each(lambda due: bool(due), bool)
    about = ahead.times.tobytes(), given.times.tobytes(), given.shown.tobytes(), changes.tobytes(), first_shown
    samples, shown, first = _rows(*about, bool(ahead.sampler.due_at(float(given.times[-1]))))
    moments = session.through(way.changes(filling, samples, first))
    if moments is None:
        return None
    code, most = PAUSES, len(ahead.times) if progress is None else -(-len(ahead.times) // _BLOCKS)
    try:
        while code in (PAUSES, USED_UP):
            code = session.pass_moments(moments, way.ask, most)
            if progress is not None:
                progress(float(samples[moments.filled - 1]))
            check_time()
    finally:
        is_whole = code in (DONE, PAUSES, USED_UP)
        count = moments.filled if is_whole else int(first[moments.now])
        begun = moments.now + is_whole
        way.held = moments.held
        if count > 1:
            rows = samples[:count], moments.values[:count], shown[:count]
            recorder.take_pieces(*rows, ahead.times[1:begun], way.plan_at)
    if count == 1:
        return None
    held = tuple(moments.held[begun - 1].tolist())
    return Passed(float(samples[count - 1]), float(ahead.times[begun - 1]), held, code != DONE, way.error)


@lru_cache(maxsize=4)
def _rows(
    moments_: bytes, times_: bytes, shown_: bytes, due_: bytes, first_shown: bool, changes_at_end: bool
) -> tuple[FloatArray, BoolArray, IntArray]:
    """Return the samples of all stretches, each with both its ends, which are shown, and where each begins.

    Of moments, of samples and of which are shown; it depends on nothing else, and a run again has the same.
    """
    moments, given_times, given_shown = np.frombuffer(moments_), np.frombuffer(times_), np.frombuffer(shown_, bool)
    later = given_times[int(given_times.searchsorted(moments[0], side="right")) :]
    times = np.union1d(moments, later)
    counts = np.ones(len(times), dtype=np.intp)
    counts[times.searchsorted(moments[1:])] = 2
    rows = np.repeat(times, counts)
    place = np.minimum(given_times.searchsorted(rows), len(given_times) - 1)
    shown = (given_times[place] == rows) & given_shown[place]
    begins = rows.searchsorted(moments, side="right") - 1  # behind the state before
    shown[begins[1:] - 1] = False
    shown[begins[1:][np.frombuffer(due_, dtype=bool)[1:]]] = True
    shown[0] = first_shown
    if changes_at_end:  # the state just after it is shown
        shown[-1] = False
    first = np.append(begins, len(rows)).astype(np.int64)
    for values in (rows, shown, first):
        values.flags.writeable = False
    return rows, shown, first


class _Way:
    """What happens at the moments, and the scene between them."""

    def __init__(self, ahead: Ahead, plan: SceneProblem) -> None:
        self._ahead, self._plan = ahead, plan
        self._pieces = ahead.schedule.times.searchsorted(ahead.times, side="right")
        self._due, self._number = ahead.sampler.due_at_each(ahead.times)
        self.held = np.zeros((0, 0))
        self.error: Exception | None = None

    def each(self, of: Callable[[tuple[int, ...]], int], kind: type = np.int64) -> IntArray:
        """Return something of which updates are due, for each moment."""
        return np.array([of(one) for one in self._due], dtype=kind)[self._number]

    def changes(self, filling: Filling, samples: FloatArray, first: IntArray) -> Changes:
        """Return what happens, for the session of some rates."""
        ahead, assembly, rates = self._ahead, self._plan.assembly, filling.own.rates
        which = self.each(lambda due: -1 if due else 0)
        update: tuple[int, int] = 0, 0
        keep: object = None
        if np.count_nonzero(which) >= _MANY:
            from atwood.simulation.events.traced import update_code

            found = update_code(assembly, ahead.sampler)
            if found is not None:
                code, chains = found
                which = self.each(lambda due: chains.get(due, 0))
                data, keep = code.bind(assembly)
                update = code.address, data
        which[0] = 0  # what happens at the start has happened
        relations = np.ascontiguousarray(ahead.schedule.values[:, self._pieces].T)
        return Changes(
            ahead.times,
            first,
            samples,
            which,
            relations,
            filling.values(self._plan).copy(),
            (len(assembly.mechanism.table.values), len(assembly.discrete_states)),
            update,
            tuple(zip(filling.own.prologues, filling.own.places, strict=True)),
            filling.own.scratch,
            (rates.project, rates.project_data),
            float(ahead.samples.times[-1]),
            (keep, filling),
        )

    def assembly_at(self, held: tuple[float, ...], k: int) -> Assembly:
        """Return the scene with the relations from a moment on, and with some discrete states."""
        found = self._ahead.schedule.applied(self._plan.assembly, int(self._pieces[k]))
        return found.with_held(held) if held else found

    def plan_at(self, k: int) -> SceneProblem:
        """Return the plan for the stretch from a moment on."""
        return self._plan if k == 0 else self._plan.in_piece(self.assembly_at(tuple(self.held[k].tolist()), k))

    def ask(self, k: int, state: FloatArray, parameters: FloatArray) -> bool:
        """Make the updates of a moment in Python."""
        assembly = self._plan.assembly
        own = len(assembly.mechanism.table.values)
        held = slice(own, own + len(assembly.discrete_states))
        q, u = self._plan.program.split(state)
        there = self.assembly_at(tuple(parameters[held].tolist()), k)
        try:
            made = self._ahead.update(
                self._due[self._number[k]], there, float(self._ahead.times[k]), q.copy(), u.copy()
            )
        except Exception as error:  # it is raised where the stretches before are recorded
            self.error = error
            return False
        q[:], parameters[held] = made.coordinates, made.held
        return True
