"""What is recorded of a run: samples of each stretch in one mode, projected where the form has constraints."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import chain, pairwise
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.clock import TimeIsUp, more_time
from atwood.errors import SolveError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass, made_of
from atwood.simulation.events.time_events import Schedule
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.problem.projection import (
    Misses,
    TakesNearest,
    left_alone,
    misses_of,
    once,
    project_rows,
    project_safely,
)

if TYPE_CHECKING:
    from atwood.integrators.time_stepping.session import Change
    from atwood.simulation.singular.crossing import SingularCrossing
    from atwood.simulation.singular.passing import PassedCrossing


_PENDING = 512
"""So many states of the solver are projected together, at most."""

_LAST = 32
"""The same where time may be short."""


_States: TypeAlias = tuple[FloatArray, FloatArray, NDArray[np.bool_]]
"""Times, states of the solver, one row each, and whether they are outputs."""


@dataclass(frozen=True, eq=False)
class SegmentRecord:
    """A stretch of a run in one mode.

    Attributes
    ----------
    plan
        What it was run with.
    impact
        Whether it began with an impact.
    time
        Sample times, shape (samples,).
    coordinates, speeds
        Of the form, projected where the form has constraints, orientations with coordinates of size one; shape
        (number, samples).
    shown
        Which samples are outputs.
    misses
        Gives `held`, which is worked out when somebody asks.
    singular_crossings
        Singular positions that it passed through.
    after_time_event
        Whether it began at a time event, at which energy that comes or goes is work of inputs and drives.
    lost
        Energy that contacts of a group have taken since its start, J, shape (samples,); None where there is none.
    rests
        Whether it began where impacts had accumulated.
    """

    plan: SceneProblem
    impact: bool
    time: FloatArray
    coordinates: FloatArray
    speeds: FloatArray
    shown: NDArray[np.bool_]
    misses: Misses
    singular_crossings: tuple[SingularCrossing, ...] = ()
    after_time_event: bool = False
    lost: FloatArray | None = None
    rests: bool = False

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "misses": partial(np.asarray, self.held)}

    @property
    def held(self) -> FloatArray:
        """By how much the solver's own states missed the constraints on position and velocity, shape (2, samples)."""
        return self.misses()

    @property
    def assembly(self) -> Assembly:
        """The scene in this mode."""
        return self.plan.assembly


@dataclass(frozen=True, eq=False)
class Stretch:
    """What was recorded from one stop of the solver to the next: records from jump to jump, made when asked for.

    Attributes
    ----------
    plan, impact, after_time_event, rests
        As of the first record.
    time, coordinates, speeds, shown, misses, singular_crossings, lost
        As of `SegmentRecord`, for all records.
    starts
        Numbers of the samples that begin a record.
    changes
        Make the changes of the states of contacts, in order.
    plan_at
        Gives the plan of each record by its number, where these begin at moments and not at jumps.
    pieces
        The time events among the changes, where there are some.
    """

    plan: SceneProblem
    impact: bool
    after_time_event: bool
    time: FloatArray
    coordinates: FloatArray
    speeds: FloatArray
    shown: NDArray[np.bool_]
    misses: Misses
    singular_crossings: tuple[SingularCrossing, ...]
    starts: NDArray[np.int_]
    changes: Sequence[Callable[[], Sequence[Change]]]
    lost: FloatArray | None
    rests: bool
    plan_at: Callable[[int], SceneProblem] | None = None
    pieces: Schedule | None = None

    def records(self) -> Iterable[SegmentRecord]:
        """Return the records from jump to jump."""
        known: dict[tuple[tuple[float, ...], int], SceneProblem] = {}
        passed = set(() if self.pieces is None else self.pieces.times.tolist())
        changes = list(chain.from_iterable(make() for make in self.changes))
        found = np.searchsorted([one.time for one in changes], self.time[self.starts], side="right").tolist()
        ends = [*self.starts.tolist(), len(self.time)]
        at, is_moment = self.plan_at, self.plan_at is not None
        for k, ((first, last), number) in enumerate(zip(pairwise(ends), found, strict=True)):
            change, each = changes[number - 1] if number else None, slice(first, last)
            yield made_of(
                SegmentRecord,
                plan=at(k) if at is not None else self._plan_of(change, known),
                impact=self.impact if first == 0 else not is_moment and (change is None or change.strikes),
                time=self.time[each],
                coordinates=self.coordinates[:, each],
                speeds=self.speeds[:, each],
                shown=self.shown[each],
                misses=partial(_columns, self.misses, each),
                singular_crossings=self.singular_crossings,
                lost=None if self.lost is None else self.lost[each],
                after_time_event=self.after_time_event
                if first == 0
                else is_moment or (change is not None and change.time in passed),
                rests=self.rests if first == 0 else change is not None and change.rests,
            )

    def _plan_of(self, change: Change | None, known: dict[tuple[tuple[float, ...], int], SceneProblem]) -> SceneProblem:
        """Return the plan in the states that contacts have from a change on."""
        if change is None or change.held is None:
            return self.plan
        piece = -1 if self.pieces is None else self.pieces.piece(change.time)
        if (place := (change.held, piece)) not in known:
            assembly = self.plan.assembly
            if self.pieces is not None:
                assembly = self.pieces.applied(assembly, piece)
            known[place] = self.plan.in_piece(assembly.with_held(change.held))
        return known[place]


@dataclass(frozen=True, eq=False)
class _Block:
    """Samples that are done: shapes (samples,), (number, samples); what gives (2, samples)."""

    time: FloatArray
    q: FloatArray
    u: FloatArray
    shown: NDArray[np.bool_]
    misses: Misses

    def without_last(self) -> _Block:
        return self.first(len(self.time) - 1)

    def first(self, count: int) -> _Block:
        misses = partial(_columns, self.misses, slice(count))
        return _Block(self.time[:count], self.q[:, :count], self.u[:, :count], self.shown[:count], misses)


class Recorder:
    """Takes up samples of a segment; they are projected many at a time.

    Parameters
    ----------
    plan
        The scene in its mode.

    Attributes
    ----------
    nearest
        How the session projects states, if it can.
    by_formulas
        Whether formulas put its states onto the constraints.
    """

    def __init__(self, plan: SceneProblem) -> None:
        self.plan = plan
        self.singular_crossings: list[SingularCrossing] = []
        self.nearest: TakesNearest | None = None
        self.by_formulas = False
        self._jumps: list[FloatArray] = []
        self._passed: list[PassedCrossing] = []
        self._changes: list[Callable[[], Sequence[Change]]] = []
        self.pieces: Schedule | None = None
        self._plan_at: Callable[[int], SceneProblem] | None = None
        self.loss_until: Callable[[FloatArray], FloatArray] | None = None
        # What is done, and states that wait: changed together, so that an interruption loses and repeats nothing.
        self._samples: tuple[tuple[_Block, ...], list[_States]] = ((), [])

    @property
    def end(self) -> float:
        """Time of the last sample; minus infinity if there is none."""
        blocks, pending = self._samples
        if pending:
            return float(pending[-1][0][-1])
        return float(blocks[-1].time[-1]) if blocks else -np.inf

    def take(self, t: float, y: FloatArray, shown: bool) -> None:
        """Record a state of the solver; one at the time of the last takes its place, as after an event."""
        blocks, pending = self._samples
        one = np.array([t]), np.array(y)[None], np.array([shown])
        if t == self.end:
            if pending:
                rest = _cut(pending[-1], stop=-1)
                pending[-1:] = [rest, one] if len(rest[0]) else [one]
                return
            last = blocks[-1].without_last()
            blocks = (*blocks[:-1], last) if len(last.time) else blocks[:-1]
            self._samples = (blocks, [one])
            return
        pending.append(one)
        if len(pending) >= _PENDING:
            self.settle()

    def take_all(self, t: Sequence[float], y: FloatArray, shown: Sequence[bool]) -> None:
        """Record states of the solver after the last sample, one row each, to be projected with those that wait."""
        pending = self._samples[1]
        if len(t):
            pending.append((np.array(t), y, np.array(shown, dtype=bool)))
        if _count(pending) >= _PENDING:
            self.settle()

    def take_many(
        self,
        t: FloatArray,
        y: FloatArray,
        shown: NDArray[np.bool_],
        jumps: tuple[FloatArray, FloatArray] | None = None,
        shows_jumps: NDArray[np.bool_] | bool = True,
    ) -> None:
        """Record states of the solver after the last sample, one row each, with those at jumps among them.

        Jumps are times, and states before and after; the last argument says which of these are outputs.
        """
        pending = self._samples[1]
        if jumps is not None and len(jumps[0]):
            times, states = jumps[0].repeat(2), jumps[1].reshape(-1, jumps[1].shape[-1])
            t, shows = np.concatenate([times, t]), np.empty(len(times), dtype=bool)
            shows[:], order, once = shows_jumps, t.argsort(kind="stable"), np.empty(len(t), dtype=bool)
            t = t[order]
            once[:2], once[2:] = True, t[2:] != t[:-2]  # an output at a jump is that after it
            if not once.all():
                t, order = t[once], order[once]
            # An index of rows takes twenty times as long as `take`.
            y, shown = np.concatenate([states, y]).take(order, axis=0), np.concatenate([shows, shown])[order]
            self._jumps.append(jumps[0])
        if not len(t):
            return
        pending.append((t, y, shown))
        if not self.plan.balance.constraints or _count(pending) >= _PENDING:  # else projected with what follows
            self.settle()

    def take_pieces(
        self,
        t: FloatArray,
        y: FloatArray,
        shown: NDArray[np.bool_],
        moments: FloatArray,
        plan_at: Callable[[int], SceneProblem],
    ) -> None:
        """Record a stretch that goes through moments, in place of all; it has samples before and after each.

        What gives the plan from the start, 0, and from each moment on is called when somebody asks.
        """
        self._samples, self._jumps, self._plan_at = ((), [(t, y, shown)]), [moments], plan_at
        self.settle()

    def take_changes(self, changes: Callable[[], Sequence[Change]]) -> None:
        """Record what makes the states of contacts from some moments on."""
        self._changes.append(changes)

    def pass_over(self, crossing: SingularCrossing, t: FloatArray, shown: NDArray[np.bool_]) -> None:
        """Record a singular crossing, in place of all samples since its start; its states are not to be projected."""
        assert crossing.path is not None
        self.rewind(crossing.path.start)
        self._settle(None)
        self.singular_crossings.append(crossing)
        if len(t):
            q, u, _ = crossing.path.at(t)
            q = self.plan.balance.kinematic_map.normalized(q)
            self._add(_Block(t, q, u, shown.copy(), partial(misses_of, self.plan, t, q, u)))

    def note(self, singular_crossings: Sequence[SingularCrossing]) -> None:
        """Record crossings that the solver made by itself; states on their ways are those of the paths."""
        self.settle()
        for crossing in singular_crossings:
            self.singular_crossings.append(crossing)
            self._cover(crossing)

    def take_passed(self, crossings: Sequence[PassedCrossing]) -> None:
        """Record crossings that steps have made by themselves, before states that come with them; as the others."""
        self.singular_crossings += crossings
        self._passed += crossings
        self._cover(crossings[0])

    def _cover(self, crossing: SingularCrossing) -> None:
        """Take states on the way of a crossing from its path."""
        for block in self._samples[0]:
            inside = crossing.covers(block.time)
            if crossing.path is not None and inside.any():
                q, u, _ = crossing.path.at(block.time[inside])
                block.q[:, inside], block.u[:, inside] = self.plan.balance.kinematic_map.normalized(q), u

    def rewind(self, t: float) -> None:
        """Forget all samples after a time."""
        blocks, pending = self._samples
        kept = (one.first(int(np.searchsorted(one.time, t, side="right"))) for one in blocks)
        waiting = (_cut(one, stop=int(np.searchsorted(one[0], t, side="right"))) for one in pending)
        self._samples = (tuple(one for one in kept if len(one.time)), [one for one in waiting if len(one[0])])

    def settle(self) -> None:
        """Project all that waits; the last by itself, since a run goes on from it, whatever samples are before it."""
        pending = self._samples[1]
        is_apart = self.plan.is_projected and _count(pending) > 1
        if is_apart and self.by_formulas and self._settle_exact():
            return
        if is_apart and self._passed:
            self._settle(_count(pending) - 1)
        self._settle(None, is_apart and not self._passed)

    def _settle_exact(self) -> bool:
        """Take all that waits as it is; return whether it could be."""
        if self._passed:
            return False
        t, y, shown = _joined(self._samples[1])
        made = left_alone(self.plan, t, y)
        if made is not None:
            self._add(_Block(t, made.coordinates, made.speeds, shown, made.misses))
        return made is not None

    def _settle(self, count: int | None, is_apart: bool = False) -> None:
        """Project so many of what waits, the first; all if that is None, of which the last may come apart."""
        pending = self._samples[1]
        if pending:
            waiting = _joined(pending)
            if count is None or count >= len(waiting[0]):
                self._finish(*waiting, is_apart=is_apart)
            else:
                self._finish(*_cut(waiting, stop=count), [_cut(waiting, count)])

    def last(self) -> tuple[float, FloatArray, FloatArray, Misses]:
        """Return time, coordinates and speeds of the last sample, and what gives misses of constraints up to it."""
        self.settle()
        block = self._samples[0][-1]
        return float(block.time[-1]), block.q[:, -1], block.u[:, -1], block.misses

    def close(self) -> float:
        """Show the last sample, and return its time; what there is no time left to project is dropped."""
        with more_time():
            try:
                while self._samples[1]:
                    self._settle(_LAST)
            except TimeIsUp:
                self._samples = self._samples[0], []
        if self._samples[0]:
            self._samples[0][-1].shown[-1] = True
        return self.end

    @property
    def is_empty(self) -> bool:
        """Whether nothing has been recorded, and nothing waits."""
        return not any(self._samples)

    def stretch(self, impact: bool, after_time_event: bool = False, rests: bool = False) -> Stretch:
        """Return what was recorded."""
        self.settle()
        blocks = self._samples[0]
        last = blocks[-1]
        time, q, u, shown, misses = last.time, last.q, last.u, last.shown, last.misses
        if len(blocks) > 1:
            q, u = (np.concatenate([getattr(one, name) for one in blocks], axis=1) for name in ("q", "u"))
            misses = once(lambda: np.concatenate([one.misses() for one in blocks], axis=1))
            time, shown = (np.concatenate([getattr(one, name) for one in blocks]) for name in ("time", "shown"))
        # A path may lead over a place behind the end, or behind an event.
        crossings = tuple(one for one in self.singular_crossings if one.path is None or one.time <= time[-1])
        starts = np.zeros(1, dtype=int)
        if self._jumps:
            starts = np.concatenate([starts, time.searchsorted(np.concatenate(self._jumps)) + 1])
            starts = starts[starts < len(time)]
        lost = None if self.loss_until is None else self.loss_until(time)
        rest = crossings, starts, tuple(self._changes), lost, rests, self._plan_at, self.pieces
        return Stretch(self.plan, impact, after_time_event, time, q, u, shown, misses, *rest)

    def _finish(
        self,
        t: FloatArray,
        y: FloatArray,
        shown: NDArray[np.bool_],
        waiting: Sequence[_States] = (),
        is_apart: bool = False,
    ) -> None:
        arcs = [arc for one in self._passed for arc in one.arcs if arc.end > t[0]]
        if arcs:
            from atwood.simulation.singular.collocation import states_on  # few runs come to such a position

            self._finish_around(t, y, shown, waiting, states_on(arcs, t))
        else:
            self._add(self._projected(t, y, shown, is_apart), waiting)

    def _finish_around(
        self,
        t: FloatArray,
        y: FloatArray,
        shown: NDArray[np.bool_],
        waiting: Sequence[_States],
        known: tuple[NDArray[np.bool_], FloatArray, FloatArray],
    ) -> None:
        """Project states but those on the ways over singular positions, which are known."""
        inside, *states = known
        block = self._projected(t[~inside], y[~inside], shown[~inside])
        q, u = (np.empty((len(one), len(t))) for one in states)
        for all_of, rest, own in zip((q, u), (block.q, block.u), states, strict=True):
            all_of[:, ~inside], all_of[:, inside] = rest, own
        self._add(_Block(t, q, u, shown, partial(misses_of, self.plan, t, q, u)), waiting)

    def _projected(self, t: FloatArray, y: FloatArray, shown: NDArray[np.bool_], is_apart: bool = False) -> _Block:
        """Return states on the constraints; those before one that cannot be projected are kept where there is one."""
        projects = len(t) and self.plan.balance.constraints
        made = project_rows(self.plan, t, y, self.nearest, is_apart) if projects else None
        if made is None or not self.plan.is_projected:
            q, u = (part.copy() for part in self.plan.program.split(y.T))
            q = self.plan.balance.kinematic_map.normalized(q)
            misses = partial(np.zeros, (2, len(t))) if made is None else made.misses
            return _Block(t, q, u, shown, misses)
        block = _Block(t, made.coordinates, made.speeds, shown, made.misses)
        doubtful = np.flatnonzero(made.doubtful).tolist()
        q, u = (part.copy() for part in self.plan.program.split(y.T)) if doubtful else (y.T, y.T)
        for i in doubtful:
            one = self.plan.balance.kinematic_map.normalized(q[:, i])
            try:
                block.q[:, i], block.u[:, i] = project_safely(self.plan, float(t[i]), one, u[:, i])
            except SolveError:
                self._add(block.first(int(i)))
                raise
        return block

    def _add(self, block: _Block, waiting: Sequence[_States] = ()) -> None:
        blocks = self._samples[0]
        self._samples = ((*blocks, block) if len(block.time) else blocks, list(waiting))


def _columns(misses: Misses, each: slice) -> FloatArray:
    return misses()[:, each]


def _count(pending: Sequence[_States]) -> int:
    """Return how many states wait."""
    return sum(len(one[0]) for one in pending)


def _joined(pending: Sequence[_States]) -> _States:
    """Return states in one piece."""
    t, y, shown = zip(*pending, strict=True)
    return np.concatenate(t), np.concatenate(y), np.concatenate(shown)


def _cut(one: _States, start: int | None = None, stop: int | None = None) -> _States:
    """Return some of the states, in their order."""
    t, y, shown = one
    return t[start:stop], y[start:stop], shown[start:stop]
