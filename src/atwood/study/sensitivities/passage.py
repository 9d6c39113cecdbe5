"""The way of derivatives through the stretches of a run, and over what happens between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from atwood.arrays import FloatArray, IndexArray
from atwood.errors import AtwoodError, SolveError, UnsupportedError
from atwood.expr import Expression, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.result.result import Result
from atwood.simulation.contacts.values import layout_of
from atwood.simulation.dynamics.scales import coordinate_scales, motion_scales
from atwood.simulation.events.sampling import find_sampler
from atwood.simulation.events.time_events import find_schedule
from atwood.simulation.initialization.start import own_state
from atwood.simulation.run.recorder import SegmentRecord
from atwood.simulation.run.run import walked
from atwood.study.sensitivities.augmented import Augmented, Stretch
from atwood.study.sensitivities.changes import Beside, Change, Leg, WatchedWalk
from atwood.study.sensitivities.columns import SHARES, Column, differentiated, extrapolated
from atwood.study.sensitivities.inputs import NodeColumn
from atwood.study.sensitivities.quantities import derivatives, written
from atwood.study.sensitivities.starts import exact_changes

_AGREES = 1e3
"""So many tolerances may lie between a motion with derivatives and the run; its own errors grow like the columns."""

_MORE = 100
"""Times the steps of the run: explicit steps that are so many more tell of a stiff motion."""

_GRAZING = 1e-7
"""In the scene's sizes and times: what passes zero more slowly touches it."""

_TANGENT = 1e-5
"""In the scene's sizes: columns that miss constraints by more do not belong to motions on them."""

_MOVED = (1e-3, 1e-4, 1e-5)
"""In the scene's sizes: so far states are moved at most to see what an impact or an update makes of them."""

_SMOOTH = 1e-5
"""So far two differences may be apart, as a share, that what happens is smooth."""

_EVENTS: Key[tuple[Expression, ...]] = Key("events as functions of the state")


class Passage:
    """Derivatives along a run.

    Parameters
    ----------
    result
        The run.
    columns
        What it is differentiated by.
    paths
        Quantities.
    rtol, max_steps
        Tolerance and limit.
    """

    def __init__(
        self, result: Result, columns: tuple[Column, ...], paths: tuple[str, ...], rtol: float, max_steps: int | None
    ) -> None:
        self.columns, self.paths, self.rtol = columns, paths, rtol
        self._changes: dict[tuple[int, str], tuple[FloatArray, object]] = {}
        self._times: dict[tuple[int, str], tuple[FloatArray, FloatArray, object]] = {}
        self.max_steps: int | None = max_steps
        run = result.run
        self.steps: int = run.statistics.steps
        if max_steps is None:
            self.max_steps = _MORE * (self.steps + 1000)
        self.where, self.first, self.end = run.assembly.flat.name, run.assembly, run.options.t_end
        rests = next((one for one in run.events if one.kind == "rests"), None)
        if rests is not None:
            raise SolveError(
                f"at t = {rests.time:.9g} s impacts have accumulated, and their sum has no derivatives",
                where=rests.part,
                advice="Let the run end before.",
            )
        assert run.start is not None
        self.start = run.start
        if run.segments[0].assembly.shared is not run.assembly.shared:
            raise UnsupportedError(
                "the run begins in other coordinates than the scene was assembled in",
                where=self.where,
                advice="Ask with orientation='quaternion'.",
            )
        self.segments: tuple[SegmentRecord, ...] = run.segments
        if len(run.segments) == 1 and not run.events and not run.assembly.discrete_states:
            self.legs = [_only_leg(run.segments[0])]
            return
        walk, again = walked(run.assembly, run.start, run.options, WatchedWalk)
        assert isinstance(walk, WatchedWalk)
        self.legs, self.segments = walk.legs, again.segments
        shown = np.concatenate([one.time[one.shown] for one in self.segments])
        if len(shown) != len(result.time):
            raise SolveError("the run came out otherwise when it was made again", where=self.where)

    def go(self) -> tuple[FloatArray, FloatArray]:
        """Return values and derivatives of the quantities at the outputs, times the scales of the columns."""
        moved, held = self._at_start()
        values, found = [], []
        for number, leg in enumerate(self.legs):
            segment = self.segments[leg.number]
            self._refuse_singular(segment)
            seeds, begin = self._seeds(leg, held), np.concatenate(leg.begin[1:])
            augmented = Augmented(leg.plan, leg.begin[0], begin, seeds, self._pattern(leg, seeds))
            moved = self._tangent(leg, augmented, begin, moved, seeds)
            stretch = self._along(leg, segment, augmented, begin, moved)
            shown = np.flatnonzero(segment.shown)
            if len(shown):
                expressions = written(leg.plan, self.paths, leg.begin[0], begin)
                states = segment.time[shown], stretch.states[shown], stretch.columns[shown]
                now = derivatives(leg.plan.assembly, expressions, *states, seeds)
                values.append(now[0])
                found.append(now[1])
            if number + 1 < len(self.legs):
                moved, held = self._over(leg, self.legs[number + 1], stretch.columns[-1], held, seeds)
        return np.concatenate(values, axis=1), np.concatenate(found, axis=2)

    def _at_start(self) -> tuple[FloatArray, FloatArray]:
        """Return derivatives of the state and of discrete states where the first stretch begins."""
        here, length = own_state(self.first, self.start), self.start.length
        seeds = np.array([self._parameters(self.first, one) for one in self.columns])
        known = exact_changes(self.first, self.start, self.columns, seeds)
        pairs = zip(known, self.columns, strict=True)
        moved = np.array([column.start(here, length) if one is None else one for one, column in pairs])
        held = np.zeros((len(self.columns), len(self.first.discrete_states)))
        if held.size:
            held = np.array([self._held_at_start(one) for one in self.columns])
        state, still = np.concatenate(here), np.zeros(len(self.columns))
        for change in self.legs[0].changes:
            moved, held, state = self._changed(change, self.start.time, state, moved, held, still)
        return moved, held

    def _tangent(
        self, leg: Leg, augmented: Augmented, begin: FloatArray, moved: FloatArray, seeds: FloatArray
    ) -> FloatArray:
        """Return columns on the constraints; refuse those that would open or close what is closed to rounding."""
        found, sizes = augmented.tangent(leg.begin[0], begin, moved), leg.plan.tolerances(1.0, {})[: len(begin)]
        off, size = np.abs(found - moved) / sizes, np.max(np.abs(moved) / sizes, initial=0.0)
        contacts = leg.plan.assembly.own_equations.contacts
        if contacts and np.max(off, initial=0.0) > _TANGENT * max(size, 1.0):
            rows = [one.row.rate for one in contacts]
            state = np.array([leg.begin[0]]), begin[None, :], moved[None, :, :]
            _, slopes = derivatives(leg.plan.assembly, rows, *state, seeds)
            part = contacts[int(np.argmax(np.max(np.abs(slopes[:, :, 0]), axis=1)))].row.key[0]
            raise SolveError(
                f"at t = {leg.begin[0]:.9g} s it touches, and a small change in one direction would let it go or make "
                "it collide: there are no derivatives",
                where=part,
                advice="Start a little before, or with the gap open, or leave that value out.",
            )
        return found

    def _refuse_singular(self, segment: SegmentRecord) -> None:
        for crossing in segment.singular_crossings:
            raise SolveError(
                f"it passes a singular position at t = {crossing.time:.9g} s, where there are no derivatives",
                where=self.where,
                advice="Let the run end before.",
            )

    def _beside(self, now: Assembly, column: Column, share: float) -> Assembly:
        """Return a scene with a parameter moved, in the mode and the piece of the run that an assembly is in."""
        if column.is_start:
            return now
        plain = self.first if now.shared is self.first.shared else now
        there = {column.path: column.value + share * column.scale}
        made = column.near(share) if plain is self.first else plain.with_values(there)
        if made.why_new:
            raise UnsupportedError(f"it shapes the equations in another mode: {made.why_new}", where=column.path)
        made = made.with_relations(now.relation_values) if now.relations else made
        return made.with_held(now.held_now) if now.discrete_states else made

    def _parameters(self, now: Assembly, column: Column) -> FloatArray:
        """Return the change of each parameter in a mode with a column; found once in each mode."""
        about = id(now.shared), column.path
        if about not in self._changes:
            self._changes[about] = self._changes_in(now, column), now.shared
        return self._changes[about][0]

    def _changes_in(self, now: Assembly, column: Column) -> FloatArray:
        if column.is_start:
            return np.zeros(len(now.parameters))
        if column.symbols and now.shared is self.first.shared:
            return np.array([column.scale * (one.name in column.symbols) for one in now.parameters])
        here = now.parameter_values
        near = self._beside(now, column, SHARES[0]).parameter_values
        moved, to = near != here, column.value + SHARES[0] * column.scale
        if np.all(here[moved] == column.value) and np.all(near[moved] == to):  # it is handed on as it is
            return np.where(moved, column.scale, 0.0)
        return extrapolated(lambda share: self._beside(now, column, share).parameter_values)

    def _seeds(self, leg: Leg, held: FloatArray) -> FloatArray:
        """Return the change of each parameter in a stretch by each column."""
        return self._seeds_in(leg.assembly, leg.plan.assembly.parameters, held)

    def _seeds_in(self, plain: Assembly, symbols: Sequence[Expression], held: FloatArray) -> FloatArray:
        places = {symbol: k for k, symbol in enumerate(symbols)}
        own = [places[symbol] for symbol in plain.parameters if symbol in places]
        kept = [k for k, symbol in enumerate(plain.parameters) if symbol in places]
        seeds = np.zeros((len(self.columns), len(symbols)))
        for j, column in enumerate(self.columns):
            if not column.is_start:
                seeds[j, own] = self._parameters(plain, column)[kept]
        apart = set_apart(plain)
        for k, one in enumerate(plain.discrete_states):
            if k not in apart:
                seeds[:, places[one.symbol]] = held[:, k]
        return seeds

    def _pattern(self, leg: Leg, seeds: FloatArray) -> tuple[tuple[int, ...], ...]:
        """Return the parameters that change with each column; those of inputs in any stretch, so that all are alike."""
        places = {symbol: k for k, symbol in enumerate(leg.plan.assembly.parameters)}
        states = leg.assembly.discrete_states
        found = []
        for column, row in zip(self.columns, seeds, strict=True):
            own = set(np.flatnonzero(row).tolist())
            if isinstance(column, NodeColumn):
                part = column.driven.part
                own |= {places[one.symbol] for one in states if one.path.startswith(f"{part}.piece[")}
            found.append(tuple(sorted(own)))
        return tuple(found)

    def _along(
        self, leg: Leg, segment: SegmentRecord, augmented: Augmented, begin: FloatArray, moved: FloatArray
    ) -> Stretch:
        """Return the motion with its derivatives at the samples of a stretch."""
        times = segment.time
        states, columns = np.tile(begin, (len(times), 1)), np.tile(moved, (len(times), 1, 1))
        last = np.arange(len(times)) == len(times) - 1
        wanted = np.flatnonzero((segment.shown | last) & (times > leg.begin[0]))
        if not len(wanted):
            return Stretch(states, columns, 0)
        part = augmented.run(leg.begin[0], begin, moved, times[wanted], self.rtol, self.max_steps)
        states[wanted], columns[wanted] = part.states, part.columns
        self._check(segment, states[wanted], columns[wanted], wanted)
        return Stretch(states, columns, part.steps)

    def _check(self, segment: SegmentRecord, states: FloatArray, columns: FloatArray, wanted: IndexArray) -> None:
        """Refuse a motion that comes out otherwise than in the run, by more than errors can have grown."""
        apart, size, sizes = self._apart(segment, states, wanted)
        grown = 1.0 + np.max(np.abs(columns) / sizes, axis=(1, 2), initial=0.0) + size
        self._refuse_apart(segment.time[wanted], apart, grown)

    def _apart(
        self, segment: SegmentRecord, states: FloatArray, wanted: IndexArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return how far states are from those of the run, how large these are, and the sizes that both are in."""
        sizes = segment.plan.tolerances(1.0, {})[: states.shape[1]]
        run = np.concatenate([segment.coordinates, segment.speeds])[:, wanted].T
        apart = np.max(np.abs(states - run) / sizes, axis=1, initial=0.0)
        return apart, np.max(np.abs(run) / sizes, axis=1, initial=0.0), sizes

    def _refuse_apart(self, times: FloatArray, apart: FloatArray, grown: FloatArray) -> None:
        far = np.flatnonzero(~(apart <= _AGREES * max(self.rtol, 1e-13) * grown))
        if len(far):
            raise SolveError(
                f"the motion with its derivatives leaves the run at t = {times[far[0]]:.9g} s",
                where=self.where,
                advice="Ask for a smaller rtol, or let the run end before.",
            )

    def _over(
        self, leg: Leg, after: Leg, columns: FloatArray, held: FloatArray, seeds: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return derivatives of the state and of discrete states behind what ends a stretch."""
        still = leg.end[0] <= leg.begin[0]
        moments = np.zeros(len(self.columns)) if still else self._moments(leg, columns, seeds)
        is_later = bool(np.any(moments))
        if is_later:
            columns = columns + _rates(leg, leg.end) * moments[:, None]
        state = np.concatenate(leg.end[1:])
        for change in after.changes:
            columns, held, state = self._changed(change, leg.end[0], state, columns, held, moments)
        return (columns - _rates(after, after.begin) * moments[:, None] if is_later else columns), held

    def _changed(
        self,
        change: Change,
        t: float,
        state: FloatArray,
        columns: FloatArray,
        held: FloatArray,
        moments: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return derivatives of the state and of discrete states behind a change, and the state there."""
        if change.enters:
            return columns, self._entered(change, t, held), state
        n = len(change.assembly.own_equations.coordinates)
        if change.updated is not None:
            seeds, count = self._seeds_in(change.assembly, change.assembly.parameters, held), held.shape[1]
            about = np.array([t]), state[None, :], columns[None, :, :], seeds, moments
            values, slopes = (one[..., 0] for one in derivatives(change.assembly, change.updated, *about))
            behind = np.concatenate([slopes[count:].T, columns[:, n:]], axis=1)
            return behind, slopes[:count].T, np.concatenate([values[count:], state[n:]])
        now, equations = np.array(change.assembly.held_now), change.assembly.own_equations
        sizes = np.concatenate([one(equations, self.start.length) for one in (coordinate_scales, motion_scales)])

        def moved(
            column: Column, by: FloatArray, kept: FloatArray, later: float, scale: float, step: float
        ) -> FloatArray:
            share = scale * step

            def beside(one: Assembly) -> Assembly:
                made = self._beside(one, column, share)
                return made.with_held(tuple((now + share * kept).tolist())) if len(kept) else made

            there = state + share * by
            q, u, values = change.apply(beside, (t + share * later, there[:n], there[n:]))
            return np.concatenate([q, u, values])

        found = []
        plain: Beside = lambda one: one  # noqa: E731
        base = np.concatenate(change.apply(plain, (t, state[:n], state[n:])))
        still = [len(base) - len(now) + k for k in set_apart(change.assembly)]
        for j, column in enumerate(self.columns):
            own = columns[j], held[j], float(moments[j])
            size = max(1.0, float(np.max(np.abs(columns[j] / sizes), initial=0.0)))
            found.append(self._differences(partial(moved, column, *own), size, t, still))
        count = len(base) - len(now)
        made = np.array(found)
        return made[:, :count], made[:, count:], base[:count]

    def _differences(
        self, moved: Callable[[float, float], FloatArray], size: float, t: float, still: list[int]
    ) -> FloatArray:
        """Return the derivative of what a change makes, from states so near that it is smooth among them.

        What has no derivatives of itself is `still`.
        """
        for nearer in _MOVED:
            scale = nearer / (SHARES[0] * size)
            found, apart = (one / scale for one in differentiated(partial(moved, scale)))
            apart[still] = found[still] = 0.0
            if np.max(np.abs(apart), initial=0.0) <= _SMOOTH * max(size, float(np.max(np.abs(found), initial=0.0))):
                return found
        raise SolveError(
            f"what happens at t = {t:.9g} s changes with the state before it by leaps: there are no derivatives",
            where=self.where,
            advice="Change the scene or its start a little, or let the run end before.",
        )

    def _held_at_start(self, column: Column) -> FloatArray:
        if isinstance(column, NodeColumn):
            return column.pieces(self.first, self.start.time)
        return extrapolated(lambda share: np.array(column.near(share).held_at_start))

    def _entered(self, change: Change, t: float, held: FloatArray) -> FloatArray:
        """Return derivatives of the discrete states where other pieces of inputs begin."""
        found, parts = held.copy(), change.enters
        states = change.assembly.discrete_states
        found[:, [i for i, one in enumerate(states) if one.path.rpartition(".")[0] in parts]] = 0.0
        for j, column in enumerate(self.columns):
            if isinstance(column, NodeColumn) and column.driven.part in parts:
                found[j] += column.pieces(change.assembly, t)
        return found

    def _moments(self, leg: Leg, columns: FloatArray, seeds: FloatArray) -> FloatArray:
        """Return by how much the time at which a stretch ends changes with each column, s."""
        assert leg.outcome is not None
        assert leg.probe is not None
        event, t = leg.outcome.event, leg.end[0]
        if event is None:
            return np.array([self._moment_of_time(leg, column, t) for column in self.columns])
        program = leg.probe.program()
        functions = leg.probe.event_functions
        if program is None:
            raise UnsupportedError(
                f"at t = {t:.9g} s an event reads a reaction that the state alone does not determine", where=event.part
            )
        expressions = leg.plan.assembly.shared.get(
            _EVENTS,
            lambda: tuple(substitute(list(program.results), dict.fromkeys(program.inputs[-1].symbols, 0.0))),
            program,
        )
        about = (event.part, event.law, event.target)
        numbers = [i for i, one in enumerate(functions) if (one.part, one.law, one.target) == about]
        if leg.outcome.sides:
            numbers = [
                i for i, one in enumerate(functions) if one.target == "side" and int(one.law) in leg.outcome.sides
            ]
        rates = _rates(leg, leg.end)
        every = np.concatenate([columns, rates[None, :]])[None, :, :]
        state, times = np.concatenate(leg.end[1:])[None, :], np.array([t])
        own = np.concatenate([seeds, np.zeros((1, seeds.shape[1]))])
        passing = np.append(np.zeros(len(columns)), 1.0)
        chosen = [expressions[i] for i in numbers]
        values, slopes = derivatives(leg.plan.assembly, chosen, times, state, every, own, passing)
        scales = np.array([leg.plan.scales.of(functions[i].unit) for i in numbers])
        first = int(np.argmin(np.abs(values[:, 0]) / scales))
        rate = float(slopes[first, -1, 0])
        if not abs(rate) * leg.plan.scales.time > _GRAZING * scales[first]:
            raise SolveError(
                f"at t = {t:.9g} s it touches the place of an event ({event.message}) without passing it, and there "
                "are no derivatives",
                where=event.part or self.where,
                advice="Change the scene or its start a little, or let the run end before.",
            )
        return np.asarray(-slopes[first, :-1, 0] / rate)

    def _moment_of_time(self, leg: Leg, column: Column, t: float) -> float:
        """Return by how much a time event, or a sample time, changes with a column."""
        if column.is_start:
            return 0.0

        here, slopes = self._times_by(leg.assembly, column)
        return float(slopes[np.argmin(np.abs(here - t))])

    def _times_by(self, now: Assembly, column: Column) -> tuple[FloatArray, FloatArray]:
        """Return the time events and sample times of a mode, and by how much each changes with a column."""
        about = id(now.shared), column.path
        if about in self._times:
            return self._times[about][:2]

        def times(share: float) -> FloatArray:
            assembly, begin = self._beside(now, column, share), self.start.time
            schedule = find_schedule(assembly, begin, self.end)
            return np.sort(np.concatenate([schedule.times, find_sampler(assembly, begin, self.end, np.zeros(0)).times]))

        here = times(0.0)

        def at(share: float) -> FloatArray:
            found = times(share)
            if len(found) == len(here):
                return found
            after = np.clip(np.searchsorted(found, here), 1, max(1, len(found) - 1))
            low, high = found[after - 1], found[np.minimum(after, len(found) - 1)]
            return np.where(here - low < high - here, low, high)

        try:
            self._times[about] = here, extrapolated(at), now.shared
        except AtwoodError as error:
            raise UnsupportedError(f"its times do not follow it: {error.message}", where=column.path) from error
        return self._times[about][:2]


def set_apart(assembly: Assembly) -> set[int]:
    """Return the discrete states that have no derivatives: whether gaps and slips hold, and ways in which slips go.

    These are one of a few numbers, or that which the speeds say.
    """
    if not assembly.own_equations.contacts:
        return set()
    return {place for some in layout_of(assembly).places for place in some}


def _only_leg(segment: SegmentRecord) -> Leg:
    """Return a run in which nothing happens as one stretch."""
    begin, end = (
        (float(segment.time[k]), segment.coordinates[:, k].copy(), segment.speeds[:, k].copy()) for k in (0, -1)
    )
    return Leg((), segment.plan, segment.assembly, None, begin, end, None, 0)


def _rates(leg: Leg, state: tuple[float, FloatArray, FloatArray]) -> FloatArray:
    """Return the rates of coordinates and speeds in a stretch."""
    plan, (t, q, u) = leg.plan, state
    accelerations, _ = plan.balance.accelerate(t, q, u, plan.kept)
    return np.concatenate([plan.balance.kinematic_map.rates(t, q, u), accelerations])
