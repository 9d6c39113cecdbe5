"""Processes that make trials: one that hangs or dies is replaced, and that is a finding."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from .kinds import run_trial
from .trial import Finding, Trial

RENEWED_AFTER = 500
"""Trials after which a worker is replaced, so that hours of trials need no more memory than minutes."""


_PATIENCE = 10.0
"""A trial may take so many times its limit by the clock, however little of it the processor was there for it."""


@dataclass(frozen=True)
class Done:
    """One trial that has been made, with the seconds of the processor that it took."""

    kind: str
    seed: int
    trial: Trial
    seconds: float


@dataclass
class _Worker:
    process: Any
    pipe: Connection
    job: tuple[str, int] | None = None
    since: float = 0.0
    used: float = 0.0
    count: int = 0

    def spent(self) -> tuple[float, float]:
        """Return the seconds since its job began: by the clock, and of the processor."""
        seconds = time.monotonic() - self.since
        used = _processor_time(self.process.pid)
        return seconds, seconds if used is None else used - self.used


def _processor_time(pid: int) -> float | None:
    """Return the seconds that the processor has worked for a process, if the system tells."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _work(pipe: Connection) -> None:
    os.nice(10)
    os.environ["ATWOOD_CACHE"] = "0"  # no two trials are alike: entries would only push out those of other work
    with contextlib.suppress(EOFError, KeyboardInterrupt):
        while True:
            kind, seed = pipe.recv()
            pipe.send(run_trial(kind, seed))


def _hire() -> _Worker:
    # Not forked: threads of the linear algebra and of the solvers do not live through that.
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_work, args=(theirs,), daemon=True)
    process.start()
    theirs.close()
    return _Worker(process, ours)


def _dismiss(worker: _Worker) -> None:
    worker.pipe.close()
    worker.process.kill()
    worker.process.join()


def make_trials(jobs: Iterable[tuple[str, int]], workers: int, limit: float) -> Iterator[Done]:
    """Make trials in several processes and yield each when it is done.

    Parameters
    ----------
    jobs
        Kind and seed of each.
    workers
        How many processes.
    limit
        Seconds of the processor after which a trial counts as a hang and its process is ended.
    """
    todo = iter(jobs)
    busy: list[_Worker] = []
    idle = [_hire() for _ in range(workers)]
    try:
        while True:
            while idle and (job := next(todo, None)) is not None:
                worker = idle.pop()
                if worker.count >= RENEWED_AFTER:
                    _dismiss(worker)
                    worker = _hire()
                worker.job, worker.since, worker.count = job, time.monotonic(), worker.count + 1
                worker.used = _processor_time(worker.process.pid) or 0.0
                worker.pipe.send(job)
                busy.append(worker)
            if not busy:
                return
            ready = wait([worker.pipe for worker in busy], timeout=0.5)
            for worker in list(busy):
                done = _look(worker, worker.pipe in ready, limit)
                if done is not None:
                    busy.remove(worker)
                    idle.append(worker if worker.job is None else _hire())
                    yield done
    finally:
        for worker in busy + idle:
            _dismiss(worker)


def _look(worker: _Worker, is_ready: bool, limit: float) -> Done | None:
    """Return what a worker has done, if anything; its job stays where it must be replaced."""
    assert worker.job is not None
    kind, seed = worker.job
    seconds, used = worker.spent()
    if is_ready:
        try:
            trial, seconds = worker.pipe.recv()
        except (EOFError, OSError):
            worker.process.join()
            trial = Trial(("died",), (Finding("crash", f"the process died with {worker.process.exitcode}"),))
            _dismiss(worker)
            return Done(kind, seed, trial, used)
        worker.job = None
        return Done(kind, seed, trial, seconds)
    if used > limit or seconds > _PATIENCE * limit:
        _dismiss(worker)
        return Done(kind, seed, Trial(("hung",), (Finding("hang", f"no end within {limit:g} s"),)), used)
    return None
