"""The runs of a sweep one by one, in threads or in processes, and what is recorded of each."""

from __future__ import annotations

import pickle
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, ResultError, UsageError, suggestion_in_parts
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import find_observables
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.local.flatten import flatten
from atwood.pipeline import simulate, solve_as_asked
from atwood.result.result import Result
from atwood.simulation.problem.options import RunOptions
from atwood.study.sweeps.cases import Cases

_STRUCTURES = 8
"""So many structures are kept at hand; sweeps over counts have several."""

_CHUNKS = 16
"""An executor is given so many pieces of work at least, if there are as many runs."""


@dataclass(frozen=True, eq=False)
class SweepRequest:
    """What is to be run.

    Attributes
    ----------
    assembly
        The first run.
    cases
        All runs.
    paths
        Quantities to keep.
    times
        Output times, s.
    only_end
        Whether only the end of each run is kept, wherever it is.
    options
        How each run is made.
    """

    assembly: Assembly
    cases: Cases
    paths: tuple[str, ...]
    times: FloatArray
    only_end: bool
    options: RunOptions

    @property
    def has_turns(self) -> bool:
        """Whether a quantity counts turns, which needs samples on the way."""
        return any(one.periodic for one in find_observables(self.assembly, self.paths))


@dataclass(eq=False)
class Records:
    """What has become of the runs; each is written once."""

    values: FloatArray
    end_time: FloatArray
    steps: NDArray[np.int64]
    status: list[str]
    messages: dict[int, str] = field(default_factory=dict)
    reassembled: dict[int, str] = field(default_factory=dict)
    batched: int = 0
    seconds: float = 0.0
    lock: threading.Lock = field(default_factory=threading.Lock)

    @classmethod
    def empty(cls, request: SweepRequest) -> Records:
        """Return records of runs that have not been made."""
        count = request.cases.count
        values = np.full((len(request.paths), count, len(request.times)), np.nan)
        return cls(values, np.full(count, np.nan), np.zeros(count, dtype=np.int64), [""] * count)

    def fail(self, run: int, error: AtwoodError) -> None:
        """Record that a run failed, and why."""
        self.status[run], self.messages[run] = "failed", str(error)

    def interrupt(self) -> None:
        """Record that what has not been made will not be."""
        for run, status in enumerate(self.status):
            if not status:
                self.status[run], self.messages[run] = "interrupted", "the sweep was interrupted before"


def expand_paths(assembly: Assembly, quantities: Iterable[str] | None) -> tuple[str, ...]:
    """Return the paths of quantities; the coordinates when none are given, all below a component for its path."""
    known = assembly.observables
    if quantities is None:
        return tuple(one.name for one in assembly.reduced.names if one.name in known) or tuple(known)
    found: list[str] = []
    for path in quantities:
        below = [one for one in known if one.startswith(f"{path}.")]
        if path not in known and not below:
            raise ResultError("there is no such quantity", where=path, advice=suggestion_in_parts(path, known))
        found += [path] if path in known else below
    return tuple(dict.fromkeys(found))


class _Structures:
    """The structures that were met, the latest first."""

    def __init__(self, first: Assembly) -> None:
        self._known = [first]
        self._lock = threading.Lock()
        assert first.source is not None
        self._source = first.source

    def assembly(self, values: Mapping[str, Any], start: Mapping[str, Any]) -> tuple[Assembly, str]:
        """Return the assembly of a run, and why it needed equations of its own, if it did."""
        flat = flatten(self._source.changed(values, start, {}), self._known[0].flat.name)
        with self._lock:
            reasons = []
            for known in self._known:
                found, reason = known.follow(flat, self._source)
                if found is not None:
                    return found, ""
                reasons.append(reason)
            made = self._known[0].with_flat(flat, self._source)
            self._known = [*self._known[: _STRUCTURES - 1], made]
            return made, reasons[0]


def run_one_by_one(
    request: SweepRequest,
    records: Records,
    runs: Sequence[int] | NDArray[np.intp],
    threads: int,
    watch: Callable[[int], object],
) -> None:
    """Make runs, each by itself, as `simulate` makes them."""
    structures = _Structures(request.assembly)

    def work(run: int, _: threading.Event) -> int:
        _run(request, records, structures, run)
        return 1

    shared_work(work, [int(run) for run in runs], threads, watch)


def shared_work(
    work: Callable[[Any, threading.Event], int], pieces: Sequence[Any], threads: int, watch: Callable[[int], object]
) -> None:
    """Do pieces of work in threads; Ctrl-C sets the event that the work is given, and stops all of it."""
    stop = threading.Event()
    if threads == 1 or len(pieces) < 2:
        for piece in pieces:
            watch(work(piece, stop))
        return
    with _closing(ThreadPoolExecutor(min(threads, len(pieces))), stop) as pool:
        for done in as_completed([pool.submit(work, piece, stop) for piece in pieces]):
            watch(done.result())


@contextmanager
def _closing(pool: ThreadPoolExecutor, stop: threading.Event) -> Iterator[ThreadPoolExecutor]:
    try:
        yield pool
    except BaseException:
        stop.set()
        pool.shutdown(cancel_futures=True)
        raise
    pool.shutdown()


def _run(request: SweepRequest, records: Records, structures: _Structures, run: int) -> None:
    try:
        assembly, reason = structures.assembly(*request.cases.of(run))
        if reason:
            records.reassembled[run] = reason
        result, said = _simulated(request, assembly)
    except UsageError:  # what was asked for makes no sense, for this run and all others
        raise
    except AtwoodError as error:
        records.fail(run, error)
        before = getattr(error, "run", None)
        if before is not None:
            _take(request, records, run, Result(before))
        return
    records.status[run] = result.status
    if result.message or said:
        records.messages[run] = result.message or said
    if result.status == "interrupted":
        raise KeyboardInterrupt
    if not result.run.segments:  # there was no time to find its start
        return
    try:
        _take(request, records, run, result)
    except AtwoodError as error:
        records.fail(run, error)


def _simulated(request: SweepRequest, assembly: Assembly) -> tuple[Result, str]:
    """Return a run, and what is to be said of it where it is less accurate than was asked."""
    # Angles count their turns, and a drifting form is brought back, at samples on the way.
    samples = 400 if request.has_turns or assembly.level == "index1-projected" else 1
    outputs = 2 if request.only_end else request.times
    options = replace(request.options, outputs=outputs, samples=samples)
    if options.accuracy is not None or options.conditions:
        return solve_as_asked(assembly, options)
    asked = {"max_steps": options.max_steps, "max_seconds": options.max_seconds, "solver": options.solver}
    given: dict[str, Any] = {"rtol": options.relative_tolerance, "outputs": outputs, "samples": samples, **asked}
    return simulate(assembly, t_end=options.t_end, **given), ""


def _take(request: SweepRequest, records: Records, run: int, result: Result) -> None:
    """Record what a run gave at the output times that it reached."""
    statistics = result.statistics
    records.steps[run] = statistics.steps
    with records.lock:
        records.seconds += statistics.seconds
    records.end_time[run] = result.run.segments[-1].time[-1]  # which may be between two outputs
    has_end = records.status[run] in ("finished", "stopped")
    table = result.table(request.paths)
    for k, path in enumerate(request.paths):
        if request.only_end:
            records.values[k, run, -1] = table[path][-1] if has_end else np.nan
            continue
        # After an event there are two states at one time: the later one counts.
        places = np.searchsorted(result.time, request.times, side="right") - 1
        reached = (places >= 0) & (result.time[np.maximum(places, 0)] == request.times)
        records.values[k, run, reached] = table[path][places[reached]]


# -- processes -----------------------------------------------------------------------------------------------------


def run_in_processes(
    request: SweepRequest, records: Records, executor: Executor, watch: Callable[[int], object]
) -> None:
    """Make runs where an executor puts them."""
    pieces = np.array_split(np.arange(request.cases.count), min(request.cases.count, _CHUNKS))
    waiting: dict[Future[Any], NDArray[np.intp]] = {}
    try:
        for runs in pieces:
            waiting[executor.submit(_piece, *_packed(request, runs))] = runs
        for done in as_completed(waiting):
            _merge(records, waiting[done], done.result())
            watch(len(waiting[done]))
    except (pickle.PicklingError, TypeError, AttributeError) as error:
        raise UsageError(
            f"the scene cannot be sent to where it is to be run ({error})",
            where=request.assembly.flat.name,
            advice="Functions in it must have a name in a module; or use threads.",
        ) from error
    finally:
        for future in waiting:
            future.cancel()


def _packed(request: SweepRequest, runs: NDArray[np.intp]) -> tuple[Any, ...]:
    assembly, options = request.assembly, request.options
    assert assembly.source is not None
    axes = [
        (axis.path, axis.is_start, [axis.given[k] for k in places[runs]])
        for axis, places in zip(request.cases.axes, request.cases.places, strict=True)
    ]
    given = {
        "quantities": request.paths,
        "t_end": options.t_end,
        "outputs": None if request.only_end else request.times,
        "form": assembly.form,
        "level": assembly.level or "ggl",
        "rtol": options.relative_tolerance,
        "solver": options.solver,
        "max_steps": options.max_steps,
        "max_seconds": options.max_seconds,
        "accuracy": options.accuracy,
        "name": assembly.flat.name,
    }
    return assembly.source.scene, axes, given


def _piece(scene: Any, axes: Sequence[tuple[str, bool, list[Any]]], given: Mapping[str, Any]) -> Any:
    """Make some of the runs of a sweep, somewhere else."""
    from atwood.study.sweeps.sweep import sweep

    values = [{path: column for path, is_start, column in axes if is_start is kind} for kind in (False, True)]
    return sweep(scene, values[0], start=values[1], combine="list", threads=1, **given)


def _merge(records: Records, runs: NDArray[np.intp], part: Any) -> None:
    for k, path in enumerate(part.paths):
        records.values[k, runs] = part.quantities[path]
    records.end_time[runs], records.steps[runs] = part.end_time, part.steps
    for k, run in enumerate(runs.tolist()):
        records.status[run] = part.status[k]
        if k in part.messages:
            records.messages[run] = part.messages[k]
        if k in part.statistics.reassembled:
            records.reassembled[run] = part.statistics.reassembled[k]
    records.batched += part.statistics.batched
    records.seconds += part.statistics.solver_seconds
