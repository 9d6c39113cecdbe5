"""The runs of a sweep elsewhere: in what takes work by ``submit(function, *arguments)`` and gives a future for it.

The scene goes along once a piece, as bytes, and each worker assembles it once. Pieces take about a second each, by the
time that those before have taken. As long as pieces come back without having waited, more are handed out at once: so
many workers are kept busy as there are, and nobody has to say how many. What a worker had that died is tried again by
itself, in halves if need be, until the runs are found that end their worker.
"""

from __future__ import annotations

import hashlib
import pickle
import threading
import time
import traceback
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor
from contextlib import ExitStack
from queue import SimpleQueue
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arguments import Kind, Refused
from atwood.errors import AtwoodError, UsageError
from atwood.lazy_dataclasses import dataclass, replace
from atwood.study.sweeps.cases import Cases
from atwood.study.sweeps.pieces import PieceSizes, Take, make_runs
from atwood.study.sweeps.runs import DIED, Records, SweepRequest

_SECONDS = 1.0
"""How long a piece should take."""

_AT_ONCE = 4
"""So many pieces are handed out before any came back."""

_POOLS, _DEATHS = 4, 40
"""How many pools may break, and how many workers may die over what was lost before, until it is given up."""


def _submits(value: Any) -> Any:
    if isinstance(value, type) or not callable(getattr(value, "submit", None)):
        raise Refused("Call the class." if isinstance(value, type) else "It has no method submit.")
    return value


EXECUTOR = Kind("an executor: what has submit(function, *arguments) and returns a future", _submits)


def run_elsewhere(request: SweepRequest, left: NDArray[np.intp], executor: Any, take: Take) -> None:
    """Make runs where an executor puts them, and hand over what comes back."""
    job = _Job.of(request, take)
    lost: list[NDArray[np.intp]] = []
    with ExitStack() as pools:
        for _ in range(_POOLS):
            left = _share_out(job, left, executor, lost)
            if not len(left):
                break
            executor = pools.enter_context(_another(executor))  # a pool that lost a worker takes no more work
        lost += [left] if len(left) else []
        _again(job, lost, executor, pools)


@dataclass(frozen=True, eq=False)
class _Job:
    """What all pieces have in common."""

    request: SweepRequest
    packed: bytes
    digest: str
    take: Take

    @classmethod
    def of(cls, request: SweepRequest, take: Take) -> _Job:
        bare = replace(request, cases=Cases((), ()))
        try:
            packed = pickle.dumps(bare)
        except (pickle.PicklingError, TypeError, AttributeError) as error:
            raise UsageError(
                f"the scene cannot be sent to where it is to be run ({error})",
                where=request.assembly.flat.name,
                advice="Functions in it must have a name in a module; or use threads.",
            ) from error
        return cls(request, packed, hashlib.sha256(packed).hexdigest(), take)

    def submit(self, executor: Any, runs: NDArray[np.intp]) -> Any:
        """Hand out a piece; return its future."""
        try:
            return executor.submit(_piece, self.packed, self.digest, self.request.cases.part(runs))
        except BrokenExecutor:
            raise
        except Exception as error:
            advice = "Give one that is open, and whose submit takes a function and its arguments."
            raise UsageError(f"the executor takes no work ({error})", where="executor", advice=advice) from error

    def outcome(self, future: Any) -> tuple[Records, float] | Exception:
        """Return what a piece gave and its time, or how it was lost; raise what its runs cannot be made for."""
        try:
            found = future.result()
        except (ImportError, AttributeError) as error:
            raise _lacking(self.request.assembly.flat.name, error) from error
        except Exception as error:  # whatever an executor says of a worker that is gone
            return error
        if isinstance(found, BaseException):
            raise found
        records, seconds = found
        return records, float(seconds)


def _lacking(scene: str, error: Exception) -> UsageError:
    said = f"a worker lacks what the scene is made of ({error})"
    return UsageError(said, where=scene, advice="Install the same packages, and the modules of its parts, there.")


def _share_out(job: _Job, left: NDArray[np.intp], executor: Any, lost: list[NDArray[np.intp]]) -> NDArray[np.intp]:
    """Hand out pieces and take what comes back; return the runs that are left where the executor broke."""
    sizes, room, is_broken = PieceSizes(_SECONDS), _AT_ONCE, False
    back: SimpleQueue[Any] = SimpleQueue()
    out: dict[Any, tuple[NDArray[np.intp], float]] = {}  # by future, which runs were handed out, and when
    try:
        while out or (len(left) and not is_broken):
            while len(left) and len(out) < room and not is_broken:
                count = sizes.next(len(left), 2 * room)
                try:
                    future = job.submit(executor, left[:count])
                except BrokenExecutor:
                    is_broken = True
                    break
                out[future], left = (left[:count], time.perf_counter()), left[count:]
                future.add_done_callback(back.put)
            if not out:
                break
            future = back.get()
            (runs, since), found = out.pop(future), job.outcome(future)
            if isinstance(found, Exception):
                lost.append(runs)
                is_broken |= isinstance(found, BrokenExecutor)
                continue
            records, seconds = found
            sizes.learn(len(runs), seconds)
            if time.perf_counter() - since < 1.5 * seconds:
                room += 1  # it did not wait for a worker: there are more of them
            job.take(runs, records)
    finally:
        for future in out:
            future.cancel()
    return left


def _another(executor: Any) -> ProcessPoolExecutor:
    """Return a pool of processes in place of one that broke, made as that one was, if that is known."""
    if not isinstance(executor, ProcessPoolExecutor):
        return ProcessPoolExecutor()
    names = {"max_workers": "_max_workers", "mp_context": "_mp_context", "initializer": "_initializer"}
    given = {name: getattr(executor, own, None) for name, own in names.items()}
    return ProcessPoolExecutor(**given, initargs=getattr(executor, "_initargs", ()))


def _again(job: _Job, lost: list[NDArray[np.intp]], executor: Any, pools: ExitStack) -> None:
    """Try again what was lost, each piece by itself, so that it is known which one ends its worker."""
    waiting, deaths = lost[::-1], 0
    while waiting:
        runs, said = waiting.pop(), "workers died"
        if deaths < _DEATHS:
            try:
                future = job.submit(executor, runs)
            except BrokenExecutor:
                executor = pools.enter_context(_another(executor))
                future = job.submit(executor, runs)
            found = job.outcome(future)
            if not isinstance(found, Exception):
                job.take(runs, found[0])
                continue
            deaths, said = deaths + 1, f"{type(found).__name__}: {found}".strip(": ")
            if len(runs) > 1:
                waiting += np.array_split(runs, 2)[::-1]
                continue
        part = Records.empty(replace(job.request, cases=job.request.cases.part(runs)))
        for k in range(len(runs)):
            part.status[k], part.messages[k] = "failed", f"{DIED}, again when it was alone ({said})"
        job.take(runs, part)


# -- in a worker -------------------------------------------------------------------------------------------------------

_KEPT = 4
_requests: dict[str, SweepRequest] = {}
_lock = threading.Lock()


def _request_of(packed: bytes, digest: str) -> SweepRequest:
    """Return what is to be run; the scene is assembled once in a process."""
    with _lock:
        found = _requests.pop(digest, None)
        if found is None:
            try:
                found = pickle.loads(packed)
            except (ImportError, AttributeError) as error:
                raise _lacking("", error) from error
        _requests[digest] = found
        while len(_requests) > _KEPT:
            del _requests[next(iter(_requests))]
        return found


def _piece(packed: bytes, digest: str, cases: Cases) -> tuple[Records, float] | Exception:
    """Make some of the runs of a sweep, somewhere else; an error is returned, so that it is none of the executor's."""
    try:
        part = replace(_request_of(packed, digest), cases=cases)
        records, began = Records.empty(part), time.perf_counter()
        make_runs(part, records, 1, _unwatched)
        return records, time.perf_counter() - began
    except AtwoodError as error:
        return error
    except Exception as error:
        error.add_note(traceback.format_exc())
        return error


def _unwatched(_: int) -> None:
    """Take no note."""
