"""Scenes with events many runs at a time: all runs go to their next event, then all enter their next modes.

Each mode has one compiled session for each thread, which takes one run after another from where it stands to its next
event or to the end. What a run by itself does before each stretch (sizes, tolerances, the values from which events are
looked for) is worked out for all of them at once. A run in which something else happens is left to be made by itself.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen.llvm.engine import lane_count
from atwood.errors import AtwoodError
from atwood.forms.assembly import Assembly
from atwood.integrators.batch import NOTICED
from atwood.integrators.lanes import LaneBatch, Watched
from atwood.integrators.methods import AUTO
from atwood.integrators.protocol import Budget, Handed, Status
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.outputs.event_functions import UPDATE, EventFunction
from atwood.simulation.dynamics.orientation_coordinates import COORDINATE_SWITCH
from atwood.simulation.events.mode_change import enter_mode
from atwood.simulation.events.modes import EventRecord
from atwood.study.sweeps.batch_values import ParameterRows, StartRows, read_starts
from atwood.study.sweeps.modes import SweepMode, find_mode
from atwood.study.sweeps.motions import make_ready
from atwood.study.sweeps.readout import read_quantities
from atwood.study.sweeps.runs import Records, SweepRequest

_CHATTER = 20
"""A run with so many stretches in a row that hardly last is left to be made, and judged, by itself."""

_SECOND = 2.0
"""A run that is noticed in its second step is taken from its start again: its search goes on from that of the first."""

_SHORT = 1e-9
"""A stretch of a smaller share of the run hardly lasts."""


@dataclass(eq=False)
class _State:
    """Where a run is.

    Attributes
    ----------
    run, row
        Its number, and its place in the piece.
    t, y
        Time, coordinates and speeds of its mode.
    modes
        The modes of all parts.
    shown
        How many output times it has passed.
    steps, short
        Steps so far, and stretches in a row that hardly lasted.
    """

    run: int
    row: int
    t: float
    y: FloatArray
    modes: tuple[tuple[str, str], ...]
    shown: int = 0
    steps: int = 0
    short: int = 0


@dataclass(frozen=True, eq=False)
class _Samples:
    """States of a run in one mode at output times, one row each."""

    state: _State
    first: int
    t: FloatArray
    y: FloatArray


@dataclass(frozen=True, eq=False)
class _Ready:
    """What runs of one mode begin with, one row each: see `_Piece.advance`."""

    t: FloatArray
    y: FloatArray
    values: FloatArray | None
    watched: Watched
    absolute: FloatArray


class Waves:
    """Pieces of a sweep over a scene with events.

    Parameters
    ----------
    request, records
        What to run, and where to write what became of it.
    """

    def __init__(self, request: SweepRequest, records: Records) -> None:
        self.request, self.records = request, records
        self.starts, self.rows = StartRows(request), ParameterRows(request)
        self._own = threading.local()

    def work(self, runs: NDArray[np.intp], stop: threading.Event) -> int:
        """Make the runs of one piece; return how many are done."""
        runs, (q, u), lengths, parameters = read_starts(self.starts, self.rows, runs)
        assembly = self.request.assembly
        first = tuple(sorted(assembly.modes.items()))
        begin = assembly.flat.t_start
        states = [
            _State(run, row, begin, np.concatenate([q[row], u[row]]), first) for row, run in enumerate(runs.tolist())
        ]
        piece = _Piece(self, np.concatenate([q, u], axis=1), lengths, parameters, stop)
        while states:
            if stop.is_set():
                return 0
            after: list[_State] = []
            for modes in dict.fromkeys(one.modes for one in states):
                together = [one for one in states if one.modes == modes]
                mode = self.mode(modes, together[0], piece)
                if mode is not None:
                    after += piece.advance(mode, together)
            states = after
        return piece.record()

    def mode(self, modes: tuple[tuple[str, str], ...], state: _State, piece: _Piece) -> SweepMode | None:
        """Return a mode with this thread's session; None where runs that come there are made by themselves."""
        if not hasattr(self._own, "modes"):
            self._own.modes, self._own.kept = {}, {}
        known: dict[tuple[tuple[str, str], ...], SweepMode | None] = self._own.modes
        if modes not in known:
            n = len(self.request.assembly.other_mode(dict(modes), {}).reduced.coordinates)
            at = state.t, state.y[:n], state.y[n:], float(piece.lengths[state.row])
            known[modes] = find_mode(self.request, dict(modes), at, self.rows.varies)[0]
        return known[modes]

    def keeps_state(self, mode: SweepMode, modes: tuple[tuple[str, str], ...]) -> bool:
        """Return whether a run can go on from a mode in others as it stands."""
        known: dict[tuple[tuple[str, str], ...], bool] = self._own.kept.setdefault(mode, {})
        if modes not in known:
            known[modes] = mode.keeps_state(modes)
        return known[modes]

    def own(self, run: int, modes: tuple[tuple[str, str], ...]) -> Assembly:
        """Return the assembly of one run in some modes."""
        return self.starts.assembly(run).other_mode(dict(modes), {})


class _Piece:
    """Runs that are made together."""

    def __init__(
        self,
        waves: Waves,
        begun: FloatArray,
        lengths: FloatArray,
        parameters: FloatArray | None,
        stop: threading.Event,
    ) -> None:
        self.waves, self.request, self.lengths, self.parameters = waves, waves.request, lengths, parameters
        self.begun, self.stop = begun, stop
        self.samples: dict[tuple[tuple[str, str], ...], list[_Samples]] = {}
        self.ended: dict[int, tuple[_State, str]] = {}
        self.seconds = 0.0

    def advance(self, mode: SweepMode, states: Sequence[_State]) -> list[_State]:
        """Take runs in one mode to their next event; return those that go on, each in the mode that it enters."""
        n, rows = mode.coordinates, np.array([one.row for one in states])
        y, t = np.array([one.y for one in states]), np.array([one.t for one in states])
        q, u, lengths = y[:, :n], y[:, n:], self.lengths[rows]
        values = None if self.parameters is None else mode.arranged(self.parameters[rows])
        options = self.request.options
        *_, time, absolute, usable = make_ready(mode.motion, t, q, u, values, lengths, options)
        with np.errstate(all="ignore"):
            watched, known, clear = mode.signs(t, q, u, values, lengths, time, options.relative_tolerance)
        ready = _Ready(t, y, values, watched, absolute)
        chosen = np.flatnonzero(usable & known)
        left = self._side_by_side(mode, states, ready, chosen[clear[chosen]])
        going: list[tuple[_State, EventFunction]] = []
        for k in chosen.tolist():
            handed = left.get(k)
            if k in left and handed is None:
                continue
            event = self._stretch(mode, states[k], ready, k, handed)
            if event is not None:
                going.append((states[k], event))
        return [one for one, event in going if self._enter(mode, one, event)]

    def _side_by_side(
        self, mode: SweepMode, states: Sequence[_State], ready: _Ready, chosen: NDArray[np.intp]
    ) -> dict[int, Handed | None]:
        """Take runs side by side as far as no event is noticed; return with what those go on that met one.

        None stands for what has come to its end, or is to be made by itself.
        """
        options, times, width = self.request.options, self.request.times, lane_count()
        chosen = chosen[[states[k].shown < len(times) for k in chosen.tolist()]] if len(chosen) else chosen
        wide = mode.lanes() if len(chosen) >= width and options.max_steps is None else None
        if wide is None:
            return {}
        shown = np.array([states[k].shown for k in chosen.tolist()])
        batch = LaneBatch(
            wide,
            ready.t[chosen],
            times,
            ready.y[chosen],
            ready.absolute[chosen],
            parameters=None if ready.values is None else ready.values[chosen],
            horizons=options.t_end - ready.t[chosen],
            firsts=shown,
            watched=Watched(ready.watched.shifts[chosen], ready.watched.signs[chosen]),
        )
        while not batch.advance():
            if self.stop.is_set():
                return dict.fromkeys(chosen.tolist())
        self.seconds += batch.seconds
        found: dict[int, Handed | None] = {}
        for row, k in enumerate(chosen.tolist()):
            state, code = states[k], int(batch.codes[row])
            handed = mode.handed(batch.left[row]) if code == NOTICED else None
            if handed is not None and handed.fields["taken"] == _SECOND:
                continue
            found[k] = handed
            past = len(times) if handed is None else np.searchsorted(times, handed.fields["t_old"], side="right")
            y = batch.values[row, state.shown : past]
            if handed is None:
                may_change = options.solver == AUTO and batch.stiff[row] > 0  # its solver
                if code != 0 or may_change or not np.all(np.isfinite(y)):
                    continue
                state.steps += int(batch.steps[row])
                self.ended[state.run] = state, "finished"
            self._take(state, times[state.shown : past], y)
        return found

    def _stretch(
        self, mode: SweepMode, state: _State, ready: _Ready, k: int, handed: Handed | None
    ) -> EventFunction | None:
        """Take one run to its next event; return it where another mode follows. What ends a run is noted."""
        request, values = self.request, None if ready.values is None else ready.values[k]
        shift, absolute = ready.watched.shifts[k], ready.absolute[k]
        most, end = request.options.max_steps, request.options.t_end
        budget = Budget(max_steps=None if most is None else max(0, most - state.steps))
        before, left = state.t, request.times[state.shown :]
        try:
            y, result, cost = mode.run(state.t, state.y, values, shift, absolute, budget, left, end, handed)
        except AtwoodError:  # said by the run by itself
            return None
        if mode.session.seems_stiff and request.options.solver == AUTO:  # it may change its solver
            return None
        state.steps += cost.steps
        self.seconds += cost.seconds
        self._take(state, left[: len(y)], y)
        if result.status is Status.REACHED:
            self.ended[state.run] = state, "finished"
            return None
        event = mode.event(result) if result.status is Status.EVENT else None
        if event is None or event.target in (UPDATE, COORDINATE_SWITCH, ""):
            return None
        state.t, state.y = result.t, result.y
        if event.target == "stop":
            self._stop(state, mode.record(event, state.t))
            return None
        state.short = state.short + 1 if state.t - before < _SHORT * (end - request.assembly.flat.t_start) else 0
        return event if state.short < _CHATTER else None

    def _take(self, state: _State, t: FloatArray, y: FloatArray) -> None:
        """Take states at output times."""
        if len(y):
            self.samples.setdefault(state.modes, []).append(_Samples(state, state.shown, t, y))
            state.shown += len(y)

    def _stop(self, state: _State, record: EventRecord) -> None:
        """Note a run that an event has stopped: its last state is shown where one is asked for."""
        times = self.request.times
        if self.request.only_end or (state.shown < len(times) and times[state.shown] == state.t):
            self._take(state, np.array([state.t]), state.y[None, :])
        self.ended[state.run] = state, record.describe()

    def _enter(self, mode: SweepMode, state: _State, event: EventFunction) -> bool:
        """Take a run into the mode that an event leads to; return whether it goes on here."""
        modes = tuple(sorted({**dict(state.modes), event.part: event.target}.items()))
        if state.t >= self.request.options.t_end:  # the run by itself says how it ends
            return False
        if event.impact or not self.waves.keeps_state(mode, modes):
            before = self.waves.own(state.run, state.modes)
            n, length = mode.coordinates, float(self.lengths[state.row])
            at = state.t, state.y[:n], state.y[n:]
            try:
                _, q, u = enter_mode(at, before, mode.record(event, state.t), before.other_mode, length)
            except AtwoodError:
                return False
            state.y = np.concatenate([q, u])
        state.modes = modes
        return True

    # -- what came out --------------------------------------------------------------------------------------------

    def record(self) -> int:
        """Write what became of the runs that came to an end; return how many these are."""
        records, request = self.waves.records, self.request
        whole = dict.fromkeys(self.ended, True)
        for modes, parts in self.samples.items():
            parts = [one for one in parts if one.state.run in self.ended]
            if not parts:
                continue
            found = self._read(modes, parts)
            if found is None:
                whole.update((one.state.run, False) for one in parts)
                continue
            at = 0
            for one in parts:
                many = len(one.t)
                records.values[:, one.state.run, one.first : one.first + many] = found[:, at : at + many]
                at += many
        rows = np.array([self.ended[run][0].row for run in whole], dtype=np.intp)
        parameters, runs = self.parameters, np.array([*whole], dtype=np.intp)
        right = self.waves.starts.are_right(runs, None if parameters is None else parameters[rows], self._moved)
        done = [run for run, is_right in zip(whole, right.tolist(), strict=True) if is_right and whole[run]]
        for run in done:
            state, how = self.ended[run]
            records.steps[run] = state.steps
            records.status[run] = "finished" if how == "finished" else "stopped"
            if how == "finished":
                records.end_time[run] = request.options.t_end if request.only_end else request.times[-1]
            else:
                records.end_time[run], records.messages[run] = state.t, how
        with records.lock:
            records.seconds += self.seconds
            records.batched += len(done)
        return len(done)

    def _moved(self) -> FloatArray:
        """Return how far the coordinates that are lengths went in each run that came to an end, m."""
        found = dict.fromkeys(self.ended, 0.0)
        for modes, parts in self.samples.items():
            mode = self.waves.mode(modes, parts[0].state, self)
            assert mode is not None
            places = [k for k, one in enumerate(mode.motion.assembly.reduced.names) if one.unit == "m"]
            for one in parts:
                if one.state.run in found and one.y.shape[1] == self.begun.shape[1]:
                    away = np.abs(one.y - self.begun[one.state.row])[:, places]
                    found[one.state.run] = max(found[one.state.run], float(np.max(away, initial=0.0)))
        return np.array([*found.values()])

    def _read(self, modes: tuple[tuple[str, str], ...], parts: Sequence[_Samples]) -> FloatArray | None:
        mode = self.waves.mode(modes, parts[0].state, self)
        assert mode is not None
        counts = [len(one.t) for one in parts]
        t, y = np.concatenate([one.t for one in parts]), np.concatenate([one.y for one in parts])
        places = np.repeat([one.state.row for one in parts], counts)
        rows = None if self.parameters is None else mode.arranged(self.parameters[places])
        numbers = np.repeat([one.state.run for one in parts], counts)
        own: Callable[[int], Assembly] = lambda run: self.waves.own(run, modes)  # noqa: E731
        state = t, y[:, : mode.coordinates].T, y[:, mode.coordinates :].T
        try:
            return read_quantities(mode.motion, self.request.paths, state, rows, numbers, own)
        except AtwoodError:  # a quantity that there is not in this mode
            return None
