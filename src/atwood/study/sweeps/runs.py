"""The runs of a sweep one by one, in threads, and what is recorded of each."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
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

DIED = "the worker that had it died"
"""What is said of a run that ended its worker, before what else is said."""


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

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "lock"}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        self.__dict__.update(state, lock=threading.Lock())

    @classmethod
    def empty(cls, request: SweepRequest) -> Records:
        """Return records of runs that have not been made."""
        count = request.cases.count
        values = np.full((len(request.paths), count, len(request.times)), np.nan)
        return cls(values, np.full(count, np.nan), np.zeros(count, dtype=np.int64), [""] * count)

    def fail(self, run: int, error: AtwoodError) -> None:
        """Record that a run failed, and why."""
        self.status[run], self.messages[run] = "failed", str(error)

    def take(self, runs: NDArray[np.intp], part: Records) -> None:
        """Record what runs gave that were recorded by themselves."""
        self.values[:, runs] = part.values
        self.note(runs, part)

    def note(self, runs: NDArray[np.intp], part: Records) -> None:
        """Record all but the values of such runs."""
        self.end_time[runs], self.steps[runs] = part.end_time, part.steps
        for run, status in zip(runs.tolist(), part.status, strict=True):
            self.status[run] = status
        self.messages |= {int(runs[k]): text for k, text in part.messages.items()}
        self.reassembled |= {int(runs[k]): text for k, text in part.reassembled.items()}
        self.batched += part.batched
        self.seconds += part.seconds

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
