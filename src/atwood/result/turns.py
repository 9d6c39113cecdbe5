"""Angles that count their turns, where samples are too far apart to see them.

A quantity that is known within one turn, such as the angle of a rod whose ends are the coordinates, or an Euler angle
of a quaternion, is continued by its rate from sample to sample. Where the rate changes by much in between, the run is
made again with more samples.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.result.segment_quantities import quantities_of, values_along
from atwood.simulation.run.recorder import SegmentRecord
from atwood.simulation.run.run_record import Run, places_among, run_again

_CHANGE = 1.0
"""rad: rates may change so much times the distance of samples, or an angle is not continued by them."""

_FIRST = 4
"""Where rates at samples say little of those in between, there are so many times the samples, to begin with."""

_MOST = 2_000_000
"""More samples than these are not taken."""

_ENDS = (0.02, 0.98)
"""Shares of the samples between which rates are compared: beside a pole of Euler angles some are as large as may be."""


class TurnCounter:
    """Continues the angles of one run; what it was made again for is kept.

    Parameters
    ----------
    run
        The run.
    """

    def __init__(self, run: Run) -> None:
        self._run, self._observables = run, run.assembly.observables
        self._said = {**run.assembly.flat.guess, **run.assembly.flat.start}
        self._finer: dict[int, Run | None] = {}

    def needed(self, paths: Iterable[str]) -> tuple[str, ...]:
        """Return what turns of some quantities are counted by, besides themselves, by path."""
        found: list[str] = []
        for one in (self._observables[path] for path in paths):
            if one.periodic:
                beside = (*one.sharing, *(self._observables[path].rate for path in one.sharing[:2]))
                found += [path for path in (one.rate, *beside) if path]
        return tuple(dict.fromkeys(found))

    def counted(self, path: str, raw: Mapping[str, FloatArray], time: FloatArray) -> FloatArray:
        """Return a quantity at all samples without jumps by whole turns."""
        start, rate = self._said.get(path), self._observables[path].rate
        values = self._across_poles(path, raw, time)
        if not rate:
            return unwrap(values, start)
        spans = np.diff(time)
        longest = float(np.max(spans, initial=0.0))
        often = max(one.method.steps_unseen for one in self._run.choices)
        factor = max(_parts_of(raw[rate], longest), _FIRST if self._run.statistics.steps > often * len(time) else 1)
        while factor > 1:
            finer = self._finely(factor, time)
            if finer is None:
                warnings.warn(
                    f"{self._run.assembly.flat.name}: {path} may be counted wrong by whole turns, since its samples "
                    "are too far apart; give simulate() more samples",
                    stacklevel=4,
                )
                break
            fine_time, fine = _read(finer.segments, (path, *self.needed((path,))))
            more = factor * _parts_of(fine[rate], longest / factor)
            if more > factor and more * len(time) <= _MOST:
                factor = more
                continue
            whole = unwrap(self._across_poles(path, fine, fine_time), start, fine_time, fine[rate])
            return whole[_places(self._run.segments, finer.segments)]
        return unwrap(values, start, time, raw[rate])

    def _across_poles(self, path: str, raw: Mapping[str, FloatArray], time: FloatArray) -> FloatArray:
        """Return an angle that at a pole has a value only together with another: their difference stays, or their sum.

        The other combination is what the state says, within a turn, and goes on by its rate.
        """
        sharing = self._observables[path].sharing
        if not sharing or not np.any(raw[sharing[2]]):
            return raw[path]
        both, signs = np.array([raw[one] for one in sharing[:2]]), np.sign(raw[sharing[2]])
        rates = np.array([raw[self._observables[one].rate] for one in sharing[:2]])
        said = np.array([self._said.get(one, 0.0) for one in sharing[:2]])
        for i in np.flatnonzero(signs):
            if not i and not any(one in self._said for one in sharing[:2]):
                continue
            ways = np.array([[1.0, signs[i]], [1.0, -signs[i]]])
            expected, kept = ways @ (both[:, i - 1] if i else said)
            if i:
                step = 0.5 * (time[i] - time[i - 1]) * float(ways[0] @ (rates[:, i] + rates[:, i - 1]))
                expected += step if np.isfinite(step) else 0.0
            whole = ways[0] @ both[:, i]
            whole += 2.0 * np.pi * np.round((expected - whole) / (2.0 * np.pi))
            both[:, i] = 0.5 * (ways.T @ np.array([whole, kept]))
        return np.asarray(both[sharing.index(path)])

    def _finely(self, factor: int, time: FloatArray) -> Run | None:
        """Return the same run with so many times the samples; None if there is none."""
        if factor * len(time) > _MOST:
            return None
        if factor not in self._finer:
            inside = np.arange(1, factor) / factor
            steps = np.diff(time)
            between = (time[:-1, None] + steps[:, None] * inside)[steps > 0.0].ravel()
            self._finer[factor] = run_again(self._run, np.unique(between))
        return self._finer[factor]


def _parts_of(rates: FloatArray, span: float) -> int:
    """Return into how many parts samples that lie a span apart are to be cut: a power of two."""
    known = rates[np.isfinite(rates)]
    if not len(known):
        return 1
    low, high = np.quantile(known, _ENDS)
    change = float(high - low) * span / _CHANGE
    return 1 if change <= np.pi else 1 << int(np.ceil(np.log2(change)))


def _read(segments: Sequence[SegmentRecord], paths: tuple[str, ...]) -> tuple[FloatArray, dict[str, FloatArray]]:
    pieces = values_along(quantities_of(segments), paths)
    return np.concatenate([segment.time for segment in segments]), dict(zip(paths, pieces, strict=True))


def _places(own: Sequence[SegmentRecord], finer: Sequence[SegmentRecord]) -> list[int]:
    """Return where the samples of a run stand among those of the finer one."""
    found, before = list[int](), 0
    for one, other in zip(own, finer, strict=True):
        found += (before + places_among(one.time, other.time)).tolist()
        before += len(other.time)
    return found


def unwrap(
    values: NDArray[np.float64],
    start: float | None,
    time: NDArray[np.float64] | None = None,
    rate: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Return an angle without jumps by whole turns.

    With its rate at the samples, also more than half a turn from sample to sample is counted.
    """
    if not len(values):
        return values
    steps = np.diff(values)
    steps = np.where(np.isnan(steps), steps, np.remainder(steps + np.pi, 2.0 * np.pi) - np.pi)
    if time is not None and rate is not None:
        spans = np.diff(time)
        with np.errstate(invalid="ignore"):
            expected = 0.5 * (rate[1:] + rate[:-1]) * spans
            # Where the rate jumps, as near the pole of Euler angles, it says nothing of what lies between.
            is_steady = np.isfinite(expected) & (np.abs(np.diff(rate)) * spans < np.pi)
        steps = steps + 2.0 * np.pi * np.where(is_steady, np.round((expected - steps) / (2.0 * np.pi)), 0.0)
    smooth: NDArray[np.float64] = values[0] + np.concatenate([[0.0], np.cumsum(steps)])
    if start is not None:
        smooth = smooth + 2.0 * np.pi * np.round((start - smooth[0]) / (2.0 * np.pi))
    return smooth
