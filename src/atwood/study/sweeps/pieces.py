"""The runs of a sweep piece by piece: how large each is, and where its runs are made."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from atwood.lazy_dataclasses import dataclass, replace
from atwood.study.sweeps.batch import run_batches, why_not_batched
from atwood.study.sweeps.runs import Records, SweepRequest, run_one_by_one

Take: TypeAlias = Callable[[NDArray[np.intp], Records], object]
"""What is called with the runs of a piece and what they gave."""

_FIRST, _GROWTH = 64, 8
"""Runs of the first piece, before any time is known, and how many times larger than the one before a piece may be."""

_LEAST_SECONDS = 0.2
"""Pieces of the end are smaller, so that all workers end at about one time, but none takes less."""


def make_runs(request: SweepRequest, records: Records, threads: int, watch: Callable[[int], object]) -> str:
    """Make all runs in this process; return why they were made one by one, if that was so for all."""
    reason = why_not_batched(request)
    left = np.arange(request.cases.count) if reason else run_batches(request, records, threads, watch)
    run_one_by_one(request, records, left, threads, watch)
    return reason


@dataclass
class PieceSizes:
    """How many runs a piece has, by the time that runs have taken.

    Attributes
    ----------
    seconds
        How long a piece should take.
    each
        Time that a run takes, s; nan before it is known.
    largest
        Runs of the largest piece so far.
    """

    seconds: float
    each: float = float("nan")
    largest: int = 0

    def learn(self, runs: int, seconds: float) -> None:
        """Take note of a piece: the last one counts, since the first ones compile."""
        if runs >= min(self.largest, _FIRST):
            self.each = seconds / runs

    def next(self, left: int, share: int) -> int:
        """Return the runs of the next piece, so that what is left makes about `share` pieces at least."""
        wanted, least = _FIRST, 1
        if not np.isnan(self.each):
            wanted, least = (max(1, int(span / max(self.each, 1e-9))) for span in (self.seconds, _LEAST_SECONDS))
        found = min(left, wanted, max(_FIRST, _GROWTH * self.largest), max(least, -(-left // share)))
        self.largest = max(self.largest, found)
        return found


_STORED_SECONDS = 2.0
"""How much time is lost at most, about, where a sweep with a store is cut off."""


def make_pieces(
    request: SweepRequest, left: NDArray[np.intp], threads: int, take: Take, watch: Callable[[int], object]
) -> None:
    """Make runs in this process, a piece after the other, and hand each over; what Ctrl-C leaves half done, too."""
    for piece, sizes in _pieces(left, _STORED_SECONDS):
        part = replace(request, cases=request.cases.part(piece))
        records, began = Records.empty(part), time.perf_counter()
        try:
            make_runs(part, records, threads, watch)
        except KeyboardInterrupt:
            records.interrupt()
            take(piece, records)
            raise
        sizes.learn(len(piece), time.perf_counter() - began)
        take(piece, records)


def _pieces(left: NDArray[np.intp], seconds: float) -> Iterator[tuple[NDArray[np.intp], PieceSizes]]:
    sizes = PieceSizes(seconds)
    while len(left):
        count = sizes.next(len(left), 1)
        yield left[:count], sizes
        left = left[count:]
