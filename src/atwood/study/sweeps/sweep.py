"""Sweeps: one scene with many parameters and starts, assembled and compiled once."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arguments import BY_PATH, FILE, one_of, optional, takes, whole
from atwood.errors import AtwoodError, TopologyError
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import find_observables
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.compose.composite import Model, owner_of
from atwood.model.declare.connectors import PATHS
from atwood.pipeline import SCENE, assembly_of, scene_of
from atwood.progress import told
from atwood.ranges import values_of
from atwood.simulation.problem.arguments import (
    ACCURACY,
    CONDITIONS,
    FORM,
    LEVEL,
    LIMITS,
    NAME,
    OUTPUTS,
    PROGRESS,
    RTOL,
    SOLVER,
    T_END,
    check_span,
    refuse_two_accuracies,
)
from atwood.simulation.problem.conditions import condition_functions, conditions_of
from atwood.simulation.problem.options import RunOptions, sample_times
from atwood.simulation.run.choice import check_solver
from atwood.simulation.run.stall_diagnosis import allowed
from atwood.study.sweeps.batch import why_not_batched
from atwood.study.sweeps.cases import COMBINATIONS, Cases, make_cases
from atwood.study.sweeps.designs import DESIGN, RUNS, SEED, sampled
from atwood.study.sweeps.executors import EXECUTOR, run_elsewhere
from atwood.study.sweeps.pieces import make_pieces, make_runs
from atwood.study.sweeps.result import Sweep, SweepStatistics
from atwood.study.sweeps.runs import Records, SweepRequest, expand_paths
from atwood.study.sweeps.store import Store, open_store
from atwood.tolerances import tolerances

_TRIALS = 20
"""If none of so many runs can be assembled, none is tried."""


_VALUES = optional(replace(BY_PATH, word="PATH=VALUES", typed=values_of))


@takes(
    scene=SCENE,
    vary=_VALUES,
    start=_VALUES,
    combine=one_of(COMBINATIONS),
    design=DESIGN,
    runs=RUNS,
    seed=SEED,
    quantities=PATHS,
    t_end=T_END,
    outputs=optional(OUTPUTS),
    form=optional(FORM),
    level=optional(LEVEL),
    rtol=RTOL,
    solver=SOLVER,
    threads=optional(whole("a whole number of threads, 1 to 1024", 1, 1024)),
    executor=optional(EXECUTOR),
    store=optional(replace(FILE, what="the path of a folder, as text or a Path", word="FOLDER")),
    progress=PROGRESS,
    name=NAME,
    accuracy=ACCURACY,
    until=CONDITIONS,
    **LIMITS,
)
def sweep(
    scene: Model | Assembly,
    vary: Mapping[str, Any] | None = None,
    *,
    start: Mapping[str, Any] | None = None,
    combine: str = "grid",
    design: str | None = None,
    runs: int | None = None,
    seed: int = 0,
    quantities: Iterable[str] | None = None,
    t_end: float | str | None = None,
    outputs: Any = None,
    form: str | None = None,
    level: str | None = None,
    rtol: float = tolerances.RTOL,
    solver: str = "auto",
    max_steps: int | None = None,
    max_seconds: float | None = None,
    threads: int | None = None,
    executor: Any = None,
    store: str | os.PathLike[str] | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
    name: str | None = None,
    accuracy: float | None = None,
    until: Any = None,
) -> Sweep:
    """Run a scene with many values of its parameters and of its start.

    Equations and machine code are made once for all runs that share a structure. Scenes in the reduced form, whose
    closed loops (if any) formulas solve, are run many at a time in machine code, also with stops and other events; all
    others one by one, with the same answers. A run that fails stays in the sweep, with the reason.

    Parameters
    ----------
    scene
        The scene, or an assembly of it; what contradicts that is refused.
    vary
        Values of parameters by path: lists of numbers in SI units or of text with units, or arrays of one dimension
        (``numpy.linspace``, the columns of a sample of `scipy.stats.qmc`). Or distributions of `scipy.stats`, in SI
        units, such as ``scipy.stats.norm(1.0, 0.05)``: then `runs` says how often they are sampled. On a command line
        these are ``normal(MEAN,SD)``, ``uniform(LOW,HIGH)``, ``triangular(LOW,MODE,HIGH)`` or
        ``lognormal(MEDIAN,SIGMA)``.
    start
        The same for start values.
    combine
        ``"grid"``: every value with every other. ``"list"``: the first of each, the second of each, and so on.
    design
        How distributions are sampled: ``"sobol"`` (evenly, the usual one), ``"latin"`` (a Latin hypercube),
        ``"random"``, or ``"saltelli"``, which `Sweep.sobol_indices` needs.
    runs
        How many runs there are of distributions; for ``"saltelli"`` a multiple of two more than what is varied.
    seed
        Of the samples: the same seed gives the same runs.
    quantities
        What to keep of each run, by path; a path of a component stands for all below it. The coordinates when not
        given.
    t_end
        Time of the end, s; the scene's own if not given.
    outputs
        Number of output times, evenly spread, or the times themselves, s. When not given only the end is kept: the
        state at `t_end`, or where an event stopped the run.
    form, level, rtol, solver, max_steps, max_seconds
        As for `simulate`; limits are those of each run.
    threads
        How many threads share the work; as many as there are processors when not given.
    executor
        Where to run instead: anything with ``submit(function, *arguments)`` that returns a future, such as those of
        `concurrent.futures`, loky, ``dask.distributed.Client.get_executor()`` or mpi4py. The scene must then be
        picklable. What a worker had that died is tried again; runs that end their worker again fail, by number.
    store
        A folder for the results, as they come. The same call goes on where it was cut off, and gives the same numbers
        to the bit; of another scene, or with other values, it is refused. Quantities are then read from disk as they
        are needed, so that there may be more than memory holds.
    progress
        Called with the number of runs done, and of how many; True for a line on standard error.
    name
        What to call the scene.
    accuracy
        The largest error of the motion of each run, as for `simulate`, in place of `rtol`; `Sweep.messages` says which
        runs did not reach it. Such runs are made one by one, each about four times.
    until
        Where each run stops: a condition in words, as for `simulate`, or several.

    Returns
    -------
    Sweep
        Values, quantities, and how each run went.

    Raises
    ------
    AtwoodError
        If there is no such parameter, start value or quantity, or a value is not admissible.
    """
    began = time.perf_counter()
    check_solver(solver)
    refuse_two_accuracies(accuracy, rtol, None, None)
    assembly = assembly_of(scene, name, form=form, level=level)
    source = scene_of(assembly)
    vary, start, design_of = sampled(vary, start, design, runs, seed)
    cases = make_cases(source, vary, start, "list" if design_of else combine)
    first = _first(assembly, cases)
    end = assembly.flat.t_end if t_end is None else float(t_end)
    stops = conditions_of(until, None)
    condition_functions(first, stops)  # what cannot be read is told at once
    options = RunOptions(end, rtol, max_steps=max_steps, max_seconds=max_seconds, solver=solver, accuracy=accuracy)
    request = SweepRequest(
        first,
        cases,
        expand_paths(first, quantities),
        _times(first, end, outputs),
        outputs is None,
        allowed(replace(options, conditions=stops)),
    )
    records = Records.empty(request)
    opened = None if store is None else open_store(Path(store), request)
    if opened is not None:
        records.values = opened.values
        opened.take_up(records)
    count, reason = _threads(threads), ""
    with told(progress, first.flat.name, lambda done, of: (done / of, f"{done} of {of} runs")) as called:
        try:
            reason = _made(request, records, count, executor, opened, called)
        except KeyboardInterrupt:
            records.interrupt()
    return _finished(request, records, reason, count if executor is None else 0, time.perf_counter() - began, design_of)


def _made(
    request: SweepRequest,
    records: Records,
    threads: int,
    executor: Any,
    store: Store | None,
    progress: Callable[[int, int], object] | None,
) -> str:
    """Make all runs that are not recorded yet; return why they were made one by one, if that was so for all."""
    left = np.flatnonzero([not status for status in records.status])
    watch = _Progress(progress, request.cases.count, request.cases.count - len(left))

    def take(runs: NDArray[np.intp], part: Records) -> None:
        records.take(runs, part)
        if store is not None:
            store.keep(runs, part)

    def take_and_tell(runs: NDArray[np.intp], part: Records) -> None:
        take(runs, part)
        watch.count(len(runs))

    if executor is not None:
        run_elsewhere(request, left, executor, take_and_tell)
    elif store is not None:
        make_pieces(request, left, threads, take, watch.count)
    else:
        return make_runs(request, records, threads, watch.count)
    return why_not_batched(request)


def _first(assembly: Assembly, cases: Cases) -> Assembly:
    """Return the assembly of the first run that can be assembled."""
    problem: AtwoodError | None = None
    for run in range(min(cases.count, _TRIALS)):
        values, start = cases.of(run)
        try:
            return assembly.with_values(values, start=start)
        except TopologyError as error:  # this run will be reported; the others may hold together
            problem = problem or error
    assert problem is not None
    raise problem


def _times(assembly: Assembly, end: float, outputs: Any) -> Any:
    """Return the output times."""
    begin = assembly.flat.t_start
    check_span(begin, end)
    if outputs is None:
        return np.array([end])
    found = sample_times(begin, RunOptions(end, outputs=outputs, samples=1))
    return found.times[found.shown]


def _threads(asked: int | None) -> int:
    if asked is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return asked


@dataclass
class _Progress:
    """Counts the runs that are done."""

    progress: Callable[[int, int], object] | None
    of: int
    done: int = 0

    def count(self, more: int) -> None:
        """Take note of runs that are done."""
        self.done += more
        if self.progress is not None:
            self.progress(self.done, self.of)


def _finished(request: SweepRequest, records: Records, reason: str, threads: int, wall: float, design: str) -> Sweep:
    first, cases = request.assembly, request.cases
    observables = {one.path: one for one in find_observables(first, request.paths)}
    columns = [(axis, cases.column(k)) for k, axis in enumerate(cases.axes)]
    return Sweep(
        scene=first.flat.name,
        form=first.form,
        level=first.level,
        rtol=request.options.relative_tolerance,
        time=request.times,
        end_time=records.end_time,
        parameters={axis.path: column for axis, column in columns if not axis.is_start},
        start={axis.path: column for axis, column in columns if axis.is_start},
        shape=cases.shape,
        design=design,
        quantities={path: records.values[k] for k, path in enumerate(request.paths)},
        units={
            **{axis.path: _unit(first, axis.path, axis.is_start) for axis in cases.axes},
            **{path: one.unit for path, one in observables.items()},
        },
        meanings={path: one.doc for path, one in observables.items()},
        status=tuple(records.status),
        messages=dict(sorted(records.messages.items())),
        steps=records.steps,
        statistics=SweepStatistics(
            runs=cases.count,
            failed=sum(one not in ("finished", "stopped") for one in records.status),
            batched=records.batched,
            why_single=reason,
            reassembled=dict(records.reassembled),
            threads=threads,
            solver_seconds=records.seconds,
            wall_seconds=wall,
        ),
    )


def _unit(assembly: Assembly, path: str, is_start: bool) -> str:
    """Return the SI unit of what is varied."""
    if is_start:
        return assembly.start_observables[path].unit
    part, name = owner_of(scene_of(assembly), path)
    return str(part._field(name).unit.text)
