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
from atwood.errors import AtwoodError
from atwood.expr import depends_on
from atwood.forms.accelerations import accelerations_of
from atwood.forms.quantities import find_observables, observer
from atwood.integrators.explicit_problem import LOOSEST
from atwood.integrators.protocol import SolverOptions
from atwood.late import dataclass, replace
from atwood.simulation.dynamics.columns import masses_at
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.simulation.events.modes import find_event_functions
from atwood.simulation.initialization.many import size_rows
from atwood.simulation.initialization.start import find_start
from atwood.simulation.problem.explicit_scene import compiled_rates, explicit_problem
from atwood.simulation.problem.preparation import make_plan
from atwood.simulation.run.choice import choose
from atwood.simulation.run.stiffness import can_be_stiff
from atwood.study.sweeps.batch_values import ParameterRows, StartRows
from atwood.study.sweeps.runs import Records, SweepRequest, shared_work

__all__ = ["run_batches", "why_not_batched"]


_PIECE, _NUMBERS = 2_000, 2_000_000
"""So many runs are prepared together at most, and so many numbers handed out by them."""


def why_not_batched(request: SweepRequest) -> str:
    """Return why a sweep's runs must be made one by one, in words; empty if they can be made many at a time."""
    assembly, options = request.assembly, request.options
    if options.solver not in ("auto", "explicit"):
        return f"the solver {options.solver!r} was asked for"
    if assembly.form != "reduced":
        return "the dae form keeps constraints"
    equations = assembly.reduced
    if equations.constraints or not equations.coordinates:
        is_free = not equations.constraints
        return "nothing is free to move" if is_free else "constraints are left among its coordinates"
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
    return _why_not_compiled(request)


def _why_not_compiled(request: SweepRequest) -> str:
    assembly, options = request.assembly, request.options
    problem = explicit_problem(assembly)
    if problem is None or problem.compiled is None:
        return "it calls functions in Python"
    try:
        start = find_start(assembly)
        q, u = start.coordinates, start.speeds
        plan = make_plan(assembly, start.time, q, u, start.length, options.t_end - start.time)
        chosen = choose(plan, options, start.time, q, u).solver
    except AtwoodError:
        return "the first run cannot start"
    return "" if chosen == "explicit" else f"the solver is {chosen!r}"


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
    batches = _Batches(request, records)
    shared_work(batches.work, pieces, threads, watch)
    return np.flatnonzero([not status for status in records.status])


@dataclass(frozen=True, eq=False)
class _Prepared:
    """Runs that are ready for their first step."""

    runs: NDArray[np.intp]
    state: FloatArray
    parameters: FloatArray | None
    tolerances: FloatArray


class _Batches:
    """Pieces of a sweep, each prepared, run and read out as arrays."""

    def __init__(self, request: SweepRequest, records: Records) -> None:
        self.request, self.records = request, records
        assembly = request.assembly
        self.starts, self.rows = StartRows(request), ParameterRows(request)
        self.needs_reactions = _reads(request, [one.symbol for one in assembly.reactions])
        self._own = threading.local()
        # What threads share is made before they begin.
        found = accelerations_of(assembly)
        assert found is not None
        self.rates = compiled_rates(assembly, found)
        self.watched = assembly.compiled(found.program, vectorized=True)
        self.balance = assembly.balance("reduced")

    def work(self, runs: NDArray[np.intp], stop: threading.Event) -> int:
        """Make the runs of one piece; return how many are done."""
        from atwood.integrators.ensemble.batch import Batch, BatchParameters

        ready = self._prepare(runs)
        if not len(ready.runs):
            return 0
        stepper, own = self._stepper()
        request, options = self.request, self.request.options
        parameters = None
        if ready.parameters is not None:
            parameters = BatchParameters(ready.parameters, own.prologue, own.derived, own.scratch, own)
        begin = request.assembly.flat.t_start
        batch = Batch(
            stepper.batch_places(), begin, request.times, ready.state, ready.tolerances, options.max_steps, parameters
        )
        while not batch.advance():
            if stop.is_set():
                return 0
        counts = batch.counts
        good = (batch.codes == 0) & np.all(np.isfinite(batch.values), axis=(1, 2))
        if options.solver == "auto":
            good &= counts[:, 4] == 0  # what has turned out stiff is made by itself, and may change its solver
        return self._record(ready, batch.values, counts[:, 0], good, batch.seconds)

    def _stepper(self) -> tuple[Any, Any]:
        """Return this thread's session."""
        if not hasattr(self._own, "made"):
            from atwood.integrators.dop853.native import CompiledStepper

            assembly, options = self.request.assembly, self.request.options
            own = self.rates.open()
            self.rates.fill(own, assembly.parameter_values)
            problem = explicit_problem(assembly)
            assert problem is not None
            span = options.t_end - assembly.flat.t_start
            relative = min(options.relative_tolerance, LOOSEST)
            settings = SolverOptions(relative, 1.0, max_step=options.max_step, horizon=span)
            self._own.made = CompiledStepper(replace(problem, compiled=lambda: own.rates), settings), own
        found: tuple[Any, Any] = self._own.made
        return found

    # -- before the first step ------------------------------------------------------------------------------------

    def _prepare(self, runs: NDArray[np.intp]) -> _Prepared:
        parameters, usable = self.rows.read(runs)
        q, u, lengths, found = self.starts.read(runs, parameters)
        usable &= found
        state = np.concatenate([q, u], axis=1)
        usable &= np.all(np.isfinite(state), axis=1)
        t = np.array([[self.request.assembly.flat.t_start]])
        values = self.request.assembly.parameter_values if parameters is None else parameters.T
        with np.errstate(all="ignore"):
            a = self.watched.bind(values)(t, q.T, u.T)[-1].T
            usable &= np.all(np.isfinite(a), axis=1) & self._has_inertia(t, q, u, values, lengths)
            tolerances = self._tolerances(u, a, lengths, values)
        usable &= np.all(np.isfinite(tolerances), axis=1)
        kept = None if parameters is None else parameters[usable]
        return _Prepared(runs[usable], state[usable], kept, tolerances[usable].reshape(-1, state.shape[1]))

    def _has_inertia(
        self, t: FloatArray, q: FloatArray, u: FloatArray, values: FloatArray, lengths: FloatArray
    ) -> NDArray[np.bool_]:
        """Return where nothing can move without inertia, by the measure of `make_plan`."""
        program = self.balance
        n = program.speeds
        if program.mass_product is not None:
            mass = masses_at(self.request.assembly, t, q, u, values)
        else:
            entries = self.request.assembly.compiled(program.program, vectorized=True).bind(values)(t, q.T, u.T)[0]
            mass = np.zeros((len(q), n, n))
            mass[:, program.mass_rows, program.mass_columns] = entries.T
        _, sizes = size_rows(self.request.assembly.reduced, lengths)
        mass *= sizes[:, :, None] * sizes[:, None, :]
        usable = np.all(np.isfinite(mass), axis=(1, 2))
        mass[~usable] = np.eye(n)
        found = np.linalg.eigvalsh(mass)
        good: NDArray[np.bool_] = usable & (found[:, 0] > 1e-14 * np.maximum(found[:, -1], 1e-300))
        return good

    def _tolerances(self, u: FloatArray, a: FloatArray, lengths: FloatArray, values: FloatArray) -> FloatArray:
        """Return the absolute tolerances of each run, as `Plan.tolerances` has them."""
        request, assembly = self.request, self.request.assembly
        coordinate_sizes, sizes = size_rows(assembly.reduced, lengths)
        span = request.options.t_end - assembly.flat.t_start
        times = [np.full_like(u, span), sizes / np.abs(u), np.sqrt(sizes / np.abs(a))]
        symbols = [one.name for one in assembly.parameters]
        if "gravity" in symbols:
            gravity = np.abs(values[symbols.index("gravity")])
            times.append(np.broadcast_to(np.sqrt(lengths / gravity)[:, None], u.shape))
        every = np.concatenate(times, axis=1)
        time = np.min(np.where(every > 0.0, every, np.inf), axis=1)
        relative = min(request.options.relative_tolerance, LOOSEST)
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
        n = len(assembly.reduced.coordinates)
        flat = states[good].reshape(count * moments, states.shape[2]).T
        q, u = kinematic_map_of(assembly, "reduced").normalized(flat[:n]), flat[n:]
        t = np.tile(request.times, count)
        values = assembly.parameter_values
        if ready.parameters is not None:
            values = np.repeat(ready.parameters[good], moments, axis=0).T
        a = np.zeros_like(u)
        reactions = np.zeros((len(assembly.reactions), len(t)))
        if not count:
            return np.zeros((len(request.paths), 0, moments))
        if _reads(request, list(assembly.reduced.accelerations)):
            a = self.watched.bind(values)(t[None, :], q, u)[-1]
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
