"""Smooth scenes many runs at a time: starts, tolerances and quantities as arrays, steps in machine code.

What a run does before its first step (`find_start`, `make_plan`, tolerances) is done here for all runs of a piece at
once. What needs more than that - a start that is no list of coordinates, a failure, a run that turns out stiff - is
done as for a run by itself.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.expr import depends_on
from atwood.forms.quantities import find_observables, observer
from atwood.integrators.ensemble.batch import BatchPlaces
from atwood.integrators.explicit_problem import LOOSEST
from atwood.late import dataclass
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.simulation.events.modes import find_event_functions
from atwood.simulation.initialization.many import size_rows
from atwood.simulation.run.stiffness import can_be_stiff
from atwood.study.sweeps.batch_values import ParameterRows, StartRows
from atwood.study.sweeps.motions import METHODS, Way, find_way, open_places
from atwood.study.sweeps.runs import Records, SweepRequest, shared_work

__all__ = ["run_batches", "why_not_batched"]


_PIECE, _NUMBERS = 2_000, 2_000_000
"""So many runs are prepared together at most, and so many numbers handed out by them."""


def why_not_batched(request: SweepRequest) -> str:
    """Return why a sweep's runs must be made one by one, in words; empty if they can be made many at a time."""
    assembly, options = request.assembly, request.options
    if options.solver not in ("auto", *METHODS):
        return f"the solver {options.solver!r} was asked for"
    if assembly.form != "reduced":
        return "the dae form keeps constraints"
    equations = assembly.reduced
    if not equations.coordinates:
        return "nothing is free to move"
    if equations.states or assembly.discrete_states:
        return "parts of it have states of their own"
    if find_event_functions(assembly):
        return "events are watched"
    if assembly.relations or equations.prescribed:
        return "something in it follows the clock"
    if assembly.mechanism.space.is_line:
        return "on a line, each start says on which side of each other the parts are"
    if options.solver == "auto" and can_be_stiff(assembly):
        return "whether it is stiff depends on each run (with solver='explicit' it is not asked)"
    if options.max_seconds is not None:
        return "each run has a limit of time"
    if request.has_turns:
        return "a quantity counts turns on the way"
    return find_way(request)[1]


def run_batches(
    request: SweepRequest, records: Records, threads: int, watch: Callable[[int], object]
) -> NDArray[np.intp]:
    """Make the runs that can be made many at a time.

    Parameters
    ----------
    request, records
        What to run, and where to write what became of it.
    threads
        How many threads share them.
    watch
        Called with the number of runs that were done since.

    Returns
    -------
    array
        Numbers of the runs that are left, to be made one by one.
    """
    equations = request.assembly.reduced
    count, shown = request.cases.count, len(request.times) * (len(equations.coordinates) + len(equations.speeds))
    length = max(1, min(_PIECE, -(-count // (4 * threads)), _NUMBERS // max(1, shown)))
    pieces = [np.arange(first, min(first + length, count)) for first in range(0, count, length)]
    way, _ = find_way(request)
    assert way is not None
    batches = _Batches(request, records, way)
    shared_work(batches.work, pieces, threads, watch)
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
        self.motion, self.solver, self.values = way.motion, way.solver, way.values
        self.starts, self.rows = StartRows(request), ParameterRows(request)
        self.needs_reactions = _reads(request, [one.symbol for one in request.assembly.reactions])
        self._own = threading.local()
        self._places()  # what threads share is made before they begin

    def work(self, runs: NDArray[np.intp], stop: threading.Event) -> int:
        """Make the runs of one piece; return how many are done."""
        from atwood.integrators.ensemble.batch import Batch

        ready = self._prepare(runs)
        if not len(ready.runs):
            return 0
        request, options = self.request, self.request.options
        begin = request.assembly.flat.t_start
        limits = ready.tolerances, options.max_steps
        batch = Batch(self._places(), begin, request.times, ready.state, *limits, ready.parameters)
        while not batch.advance():
            if stop.is_set():
                return 0
        counts = batch.counts
        good = (batch.codes == 0) & np.all(np.isfinite(batch.values), axis=(1, 2))
        if options.solver == "auto":
            good &= counts[:, 4] == 0  # what has turned out stiff is made by itself, and may change its solver
        return self._record(ready, batch.values, counts[:, 0], good, batch.seconds)

    def _places(self) -> BatchPlaces:
        """Return where this thread's session is."""
        if not hasattr(self._own, "places"):
            self._own.places = open_places(self.motion, self.solver, self.request.options, self.values)
        found: BatchPlaces = self._own.places
        return found

    # -- before the first step ------------------------------------------------------------------------------------

    def _prepare(self, runs: NDArray[np.intp]) -> _Prepared:
        parameters, usable = self.rows.read(runs)
        q, u, lengths, found = self.starts.read(runs, parameters)
        usable &= found & np.all(np.isfinite(q), axis=1) & np.all(np.isfinite(u), axis=1)
        runs, q, u, lengths = runs[usable], q[usable], u[usable], lengths[usable]
        parameters = None if parameters is None else parameters[usable]
        t = np.full(len(runs), self.request.assembly.flat.t_start)
        with np.errstate(all="ignore"):
            time = self._time(t, q, u, lengths, parameters)
            state, values, usable = self.motion.begin(float(t[0]) if len(t) else 0.0, q, u, parameters, lengths, time)
            usable &= np.isfinite(time) & self._has_inertia(t, q, u, values, lengths)
            tolerances = self._tolerances(lengths, time)[:, self.motion.columns()]
        usable &= np.all(np.isfinite(tolerances), axis=1)
        kept = None if values is None else values[usable]
        return _Prepared(runs[usable], state[usable], kept, tolerances[usable])

    def _has_inertia(
        self, t: FloatArray, q: FloatArray, u: FloatArray, values: FloatArray | None, lengths: FloatArray
    ) -> NDArray[np.bool_]:
        """Return where nothing can move without inertia, by the measure of `make_plan`."""
        mass = self.motion.masses(t, q.T, u.T, values)
        directions = self.motion.open_directions(t, q.T, u.T, values)
        if directions is None:
            _, sizes = size_rows(self.request.assembly.reduced, lengths)
        else:
            mass = np.swapaxes(directions, 1, 2) @ mass @ directions
            sizes = 1.0 / np.sqrt(np.abs(np.diagonal(mass, axis1=1, axis2=2)))
        mass = mass * sizes[:, :, None] * sizes[:, None, :]
        usable = np.all(np.isfinite(mass), axis=(1, 2))
        mass[~usable] = np.eye(mass.shape[1])
        found = np.linalg.eigvalsh(mass)
        good: NDArray[np.bool_] = usable & (found[:, 0] > 1e-14 * np.maximum(found[:, -1], 1e-300))
        return good

    def _time(
        self, t: FloatArray, q: FloatArray, u: FloatArray, lengths: FloatArray, parameters: FloatArray | None
    ) -> FloatArray:
        """Return in what time something happens in each run, as `find_scales` has it; nan where that has no value."""
        request, assembly = self.request, self.request.assembly
        if not len(t):
            return np.zeros(0)
        a = self.motion.accelerations(t, q.T, u.T, parameters).T
        _, sizes = size_rows(assembly.reduced, lengths)
        span = request.options.t_end - assembly.flat.t_start
        times = [np.full_like(u, span), sizes / np.abs(u), np.sqrt(sizes / np.abs(a))]
        symbols = [one.name for one in assembly.parameters]
        if "gravity" in symbols:
            given = assembly.parameter_values if parameters is None else parameters.T
            gravity = np.abs(given[symbols.index("gravity")])
            times.append(np.broadcast_to(np.sqrt(lengths / gravity)[:, None], u.shape))
        every = np.concatenate(times, axis=1)
        time: FloatArray = np.min(np.where(every > 0.0, every, np.inf), axis=1)
        return np.where(np.all(np.isfinite(a), axis=1), time, np.nan)

    def _tolerances(self, lengths: FloatArray, time: FloatArray) -> FloatArray:
        """Return the absolute tolerances of all coordinates and speeds of each run, as `Plan.tolerances` has them."""
        coordinate_sizes, sizes = size_rows(self.request.assembly.reduced, lengths)
        relative = min(self.request.options.relative_tolerance, LOOSEST)
        return np.concatenate([relative * coordinate_sizes, relative * (sizes / time[:, None])], axis=1)

    # -- after the last step --------------------------------------------------------------------------------------

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
        request, assembly = self.request, self.request.assembly
        count, moments = int(np.sum(good)), len(request.times)
        if not count:
            return np.zeros((len(request.paths), 0, moments))
        t, known = np.tile(request.times, count), len(assembly.parameters)
        rows = None if ready.parameters is None else np.repeat(ready.parameters[good], moments, axis=0)
        values = assembly.parameter_values if rows is None else rows[:, :known].T
        q, u = self.motion.states(t, states[good].reshape(count * moments, states.shape[2]), rows)
        q = kinematic_map_of(assembly, "reduced").normalized(q)
        a = np.zeros_like(u)
        reactions = np.zeros((len(assembly.reactions), len(t)))
        if _reads(request, list(assembly.reduced.accelerations)):
            a = self.motion.accelerations(t, q, u, rows)
        if self.needs_reactions:
            reactions = self._reactions(ready.runs[good], t, q, u, moments, values, ready.parameters is not None)
        kernel = assembly.compiled(observer(assembly, request.paths), vectorized=True).bind(values)
        found: FloatArray = kernel(t[None, :], q, u, a, reactions)[0]
        return found.reshape(len(request.paths), count, moments)

    def _reactions(
        self,
        runs: NDArray[np.intp],
        t: FloatArray,
        q: FloatArray,
        u: FloatArray,
        moments: int,
        values: FloatArray,
        varies: bool,
    ) -> FloatArray:
        first = ReactionSolver(self.request.assembly, float(t[0]), q[:, 0], u[:, 0])
        if not varies:
            return first.at(t, q, u)[0]
        if not first.finding.redundant:
            return first.for_rows(values).at(t, q, u)[0]
        found = []
        for k, run in enumerate(runs.tolist()):
            part = slice(k * moments, (k + 1) * moments)
            solver = ReactionSolver(self.rows.assembly(run), float(t[part][0]), q[:, part][:, 0], u[:, part][:, 0])
            found.append(solver.at(t[part], q[:, part], u[:, part])[0])
        return np.concatenate(found, axis=1)


def _reads(request: SweepRequest, symbols: Any) -> bool:
    """Return whether a quantity depends on any of some symbols."""
    return any(depends_on(one.value, symbols) for one in find_observables(request.assembly, request.paths))
