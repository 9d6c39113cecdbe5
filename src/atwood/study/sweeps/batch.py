"""Smooth scenes many runs at a time: starts, tolerances and quantities as arrays, steps in machine code.

What a run does before its first step (`find_start`, `make_problem`, tolerances) is done here for all runs of a piece at
once. What needs more than that - a start that is no list of coordinates, a failure, a run that turns out stiff - is
done as for a run by itself.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError
from atwood.forms.sides import has_sides
from atwood.integrators.batch import Batch, BatchPlaces
from atwood.integrators.lanes import LaneBatch, LanePlaces
from atwood.integrators.methods import AUTO, METHODS
from atwood.lazy_dataclasses import dataclass
from atwood.result.segment_quantities import reads
from atwood.simulation.events.modes import find_event_functions
from atwood.simulation.initialization.start import find_start
from atwood.simulation.problem.conditions import condition_functions
from atwood.simulation.problem.curved_laws import find_curved
from atwood.study.sweeps.batch_values import ParameterRows, StartRows, read_starts
from atwood.study.sweeps.modes import find_mode
from atwood.study.sweeps.motions import Way, find_way, make_ready, open_lanes, open_places
from atwood.study.sweeps.readout import read_quantities
from atwood.study.sweeps.runs import Records, SweepRequest, shared_work
from atwood.study.sweeps.waves import Waves

_PIECE, _NUMBERS = 2_000, 2_000_000
"""So many runs are prepared together at most, and so many numbers handed out by them."""


def why_not_batched(request: SweepRequest) -> str:
    """Return why a sweep's runs must be made one by one, in words; empty if they can be made many at a time."""
    assembly, options = request.assembly, request.options
    if options.solver != AUTO and METHODS[options.solver].batch is None:
        return f"the solver {options.solver!r} was asked for"
    varies = any(not axis.is_start for axis in request.cases.axes) or bool(assembly.mechanism.constants)
    if varies and find_curved(assembly):
        return "laws that may act briefly or narrowly are watched with the values of each run"
    if assembly.form != "reduced":
        return "the dae form keeps constraints"
    equations = assembly.reduced
    if not equations.coordinates:
        return "nothing is free to move"
    if equations.states or assembly.discrete_states:
        return "parts of it have states of their own"
    if assembly.relations or equations.prescribed:
        return "something in it follows the clock"
    if has_sides(assembly):
        return "its laws compare what moves"
    if assembly.mechanism.space.is_line:
        return "on a line, each start says on which side of each other the parts are"
    if options.accuracy is not None:
        return "each run has tolerances for its accuracy"
    if any(one.is_there is not None for one in condition_functions(assembly, options.conditions)):
        return "each run stops at a condition on an angle that comes out within one turn"
    if options.conditions and any(one.target not in ("", "stop") for one in find_event_functions(assembly)):
        return "each run may stop at a condition that a change of mode meets"
    if options.max_seconds is not None:
        return "each run has a limit of time"
    if request.has_turns:
        return "a quantity counts turns on the way"
    return _first_mode(request) if _is_watched(request) else find_way(request)[1]


def _is_watched(request: SweepRequest) -> bool:
    """Return whether events are looked for: of the parts, or what runs are to stop at."""
    return bool(request.options.conditions) or bool(find_event_functions(request.assembly))


def _first_mode(request: SweepRequest) -> str:
    """Return why runs with events must be made one by one, by what the first of them is; empty if they need not."""
    assembly = request.assembly
    try:
        start = find_start(assembly)
    except AtwoodError:
        return "the first run cannot start"
    at = start.time, start.coordinates, start.speeds, start.length
    varies = any(not axis.is_start for axis in request.cases.axes) or bool(assembly.mechanism.constants)
    return find_mode(request, assembly.modes, at, varies)[1]


def run_batches(
    request: SweepRequest, records: Records, threads: int, watch: Callable[[int], object]
) -> NDArray[np.intp]:
    """Make the runs that can be made many at a time."""
    equations = request.assembly.reduced
    count, shown = request.cases.count, len(request.times) * (len(equations.coordinates) + len(equations.speeds))
    length = max(1, min(_PIECE, -(-count // (4 * threads)), _NUMBERS // max(1, shown)))
    pieces = [np.arange(first, min(first + length, count)) for first in range(0, count, length)]
    if _is_watched(request):
        shared_work(Waves(request, records).work, pieces, threads, watch)
    else:
        way, _ = find_way(request)
        assert way is not None
        shared_work(_Batches(request, records, way).work, pieces, threads, watch)
    return np.flatnonzero([not status for status in records.status])


@dataclass(frozen=True, eq=False)
class _Prepared:
    """Runs that are ready for their first step; parameters are None where all have the same."""

    runs: NDArray[np.intp]
    state: FloatArray
    parameters: FloatArray | None
    tolerances: FloatArray


class _Batches:
    """Pieces of a sweep, each prepared, run and read out as arrays."""

    def __init__(self, request: SweepRequest, records: Records, way: Way) -> None:
        self.request, self.records = request, records
        self.motion, self.method, self.values = way.motion, way.method, way.values
        self.starts, self.rows = StartRows(request), ParameterRows(request)
        symbols = [one.symbol for one in request.assembly.reactions]
        self.needs_reactions = reads(request.assembly, request.paths, symbols)
        self._own = threading.local()
        if self._lanes() is None:  # what threads share is made before they begin
            self._places()

    def work(self, runs: NDArray[np.intp], stop: threading.Event) -> int:
        """Make the runs of one piece; return how many are done."""
        ready = self._prepare(runs)
        if not len(ready.runs):
            return 0
        request, options = self.request, self.request.options
        begin = request.assembly.flat.t_start
        limits = ready.tolerances, options.max_steps
        given = begin, request.times, ready.state, *limits, ready.parameters
        wide = self._lanes()
        if wide is not None and len(ready.runs) >= wide.lanes:
            batch: Batch | LaneBatch = LaneBatch(wide, *given)
        else:
            batch = Batch(self._places(), *given)
        while not batch.advance():
            if stop.is_set():
                return 0
        good = (batch.codes == 0) & np.all(np.isfinite(batch.values), axis=(1, 2))
        if options.solver == AUTO:
            good &= batch.stiff == 0  # what has turned out stiff is made by itself, and may change its solver
        good &= self.starts.are_right(ready.runs, ready.parameters, lambda: self._moved(ready, batch.values))
        return self._record(ready, batch.values, batch.steps, good, batch.seconds)

    def _places(self) -> BatchPlaces:
        """Return where this thread's session is."""
        if not hasattr(self._own, "places"):
            self._own.places = open_places(self.motion, self.method, self.request.options, self.values)
        found: BatchPlaces = self._own.places
        return found

    def _lanes(self) -> LanePlaces | None:
        """Return where this thread's session of runs side by side is, if there is one."""
        if not hasattr(self._own, "lanes"):
            own = self.motion, self.method, self.request.options, self.values
            self._own.lanes = open_lanes(*own, self.request.cases.count)
        found: LanePlaces | None = self._own.lanes
        return found

    # -- before the first step ------------------------------------------------------------------------------------

    def _prepare(self, runs: NDArray[np.intp]) -> _Prepared:
        runs, (q, u), lengths, parameters = read_starts(self.starts, self.rows, runs)
        t, options = np.full(len(runs), self.request.assembly.flat.t_start), self.request.options
        state, values, _, tolerances, good = make_ready(self.motion, t, q, u, parameters, lengths, options)
        return _Prepared(runs[good], state[good], None if values is None else values[good], tolerances[good])

    # -- after the last step --------------------------------------------------------------------------------------

    def _moved(self, ready: _Prepared, states: FloatArray) -> FloatArray:
        """Return how far the coordinates that are lengths went in each run, m."""
        names = self.request.assembly.reduced.names
        places = [k for k, i in enumerate(self.motion.columns()) if i < len(names) and names[i].unit == "m"]
        away: FloatArray = np.abs(states - ready.state[:, None])[:, :, places]
        return np.asarray(np.max(away, axis=(1, 2), initial=0.0))

    def _record(
        self, ready: _Prepared, states: FloatArray, steps: NDArray[np.int64], good: NDArray[np.bool_], seconds: float
    ) -> int:
        records, runs = self.records, ready.runs[good]
        values = self._quantities(ready, states, good)
        whole = np.all(np.isfinite(values), axis=(0, 2)) if values.size else np.ones(len(runs), dtype=bool)
        if self.needs_reactions:  # shares of parallel connections are not known, and stay nan
            whole[:] = True
        done = runs[whole]
        records.values[:, done] = values[:, whole]
        records.steps[done] = steps[good][whole]
        records.end_time[done] = self.request.options.t_end if self.request.only_end else self.request.times[-1]
        for run in done.tolist():
            records.status[run] = "finished"
        with records.lock:
            records.seconds += seconds
            records.batched += len(done)
        return len(done)

    def _quantities(self, ready: _Prepared, states: FloatArray, good: NDArray[np.bool_]) -> FloatArray:
        """Return the quantities of the runs that came to their end, shape (quantities, runs, times)."""
        request = self.request
        count, moments = int(np.sum(good)), len(request.times)
        t = np.tile(request.times, count)
        rows = None if ready.parameters is None else np.repeat(ready.parameters[good], moments, axis=0)
        q, u = self.motion.states(t, states[good].reshape(count * moments, states.shape[2]), rows)
        numbers = np.repeat(ready.runs[good], moments)
        found = read_quantities(self.motion, request.paths, (t, q, u), rows, numbers, self.rows.assembly)
        return found.reshape(len(request.paths), count, moments)
