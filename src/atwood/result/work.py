"""Work as the integral of power: through the samples of a run, or within each step of the solver."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.clock import Clock, TimeIsUp, check_time
from atwood.lazy_dataclasses import dataclass, replace
from atwood.lazy_modules import scipy
from atwood.result.energy import EnergyLedger, Piece, make_ledger, powers_into
from atwood.result.segment_quantities import quantities_of
from atwood.simulation.run.recorder import SegmentRecord
from atwood.simulation.run.run_record import Run, run_again, times_of_steps

if TYPE_CHECKING:
    from atwood.result.part_energy import PartEnergies


_T = TypeVar("_T")

_CLEAR, _PART = 0.01, 0.1
"""Of the tolerance, and of the drift: an error of the work that is smaller than either of them hides nothing."""

_FALLS = 0.25
"""An integral converges where twice the samples leave less than this share of its error."""

_SUSPECT = 100.0
"""So many tolerances of drift, where samples may be too few to see what the power does, are looked at more closely."""


def integral_of_samples(t: FloatArray, values: FloatArray) -> tuple[FloatArray, float]:
    """Return the integral from the first sample on, of a spline of order up to eight, and its estimated error.

    The error follows from what every second and every fourth sample give, where it falls by that; samples that are too
    few for it tell no more than how far these are apart.
    """
    whole, half, quarter = _spline(t, values), *(_spline(*_thinned(t, values, stride)) for stride in (2, 4))
    if len(t) < 9:
        return whole, float((t[-1] - t[0]) * np.ptp(values)) if len(t) > 1 else 0.0
    last, before = (_apart(_thinned(t, whole, 2)[1], half), _apart(_thinned(*_thinned(t, whole, 2), 2)[1], quarter))
    return whole, last * last / before if len(t) > 16 and last < _FALLS * before else max(last, before)


def _thinned(t: FloatArray, values: FloatArray, stride: int) -> tuple[FloatArray, FloatArray]:
    """Return every so many samples, and the last."""
    kept = np.unique(np.append(np.arange(0, len(t), stride), len(t) - 1))
    return t[kept], values[kept]


def _apart(one: FloatArray, other: FloatArray) -> float:
    return float(np.max(np.abs(one - other), initial=0.0))


def _spline(t: FloatArray, values: FloatArray) -> FloatArray:
    if len(t) < 2:
        return np.zeros(len(t))
    degree = min(7, len(t) - 1)
    degree -= 1 - degree % 2  # an odd degree needs no choice at the ends
    spline = scipy.interpolate.make_interp_spline(t, values, k=degree).antiderivative()
    return np.asarray(spline(t) - spline(t[0]), dtype=float)


def nodes_between(times: FloatArray, count: int) -> FloatArray:
    """Return so many points between each two of the times, in order."""
    from numpy.polynomial import legendre

    middle, half = 0.5 * (times[1:] + times[:-1]), 0.5 * np.diff(times)
    return np.asarray((middle[:, None] + half[:, None] * legendre.leggauss(count)[0]).ravel())


def integral_in_steps(times: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the integral from the first time on, and its estimated error."""
    from numpy.polynomial import legendre

    count, half = values.shape[-1], 0.5 * np.diff(times)
    points, weights = legendre.leggauss(count)
    to_coefficients = (np.arange(count) + 0.5)[:, None] * (legendre.legvander(points, count - 1) * weights[:, None]).T
    coefficients = np.abs(values @ to_coefficients.T)
    sizes, last = np.max(coefficients, axis=-1, initial=0.0), coefficients[..., -1]
    # Gauss' rule errs by the term of twice the order, which follows if the coefficients fall evenly.
    fall = np.divide(last, sizes, out=np.zeros_like(last), where=sizes > 0.0) ** (2.0 * count / (count - 1.0))
    done = np.cumsum(half * (values @ weights), axis=-1)
    return np.concatenate([np.zeros((*done.shape[:-1], 1)), done], axis=-1), (sizes * fall) @ half


def find_ledger(
    run: Run,
    pieces: Sequence[Piece],
    shown: NDArray[np.bool_],
) -> EnergyLedger:
    """Return the ledger of a run.

    Work is integrated through the samples where that is accurate enough to tell the drift, which is mostly so. Where it
    is not, the run is made again to see what it did within its steps, since integrals that follow the steps are as
    accurate as the solver itself. The run's limit of time holds for both together: where it is used up, the samples
    must do, and whatever drift they show may be theirs, which the ledger's uncertainty says.
    """
    return replace(_balanced(run, pieces, shown), source=partial(_by_part, run, shown))


def _by_part(run: Run, shown: NDArray[np.bool_], exchanged: float) -> PartEnergies:
    from atwood.result.part_work import find_part_energies  # which few runs need

    return find_part_energies(run, shown, exchanged)


def ledger_of_samples(pieces: Sequence[Piece], shown: NDArray[np.bool_]) -> EnergyLedger:
    """Return the ledger of a run as far as its samples tell; arguments as of `find_ledger`."""
    known = [
        (np.zeros(len(one.time)), 0.0) if one.power is None else integral_of_samples(one.time, one.power)
        for one in pieces
    ]
    return make_ledger(pieces, [one for one, _ in known], sum(error for _, error in known), shown)


def _balanced(run: Run, pieces: Sequence[Piece], shown: NDArray[np.bool_]) -> EnergyLedger:
    ledger = ledger_of_samples(pieces, shown)
    if all(one.power is None for one in pieces):
        return ledger
    unsure = ledger.uncertainty - 2.0 * max(one.rounding for one in pieces)
    rtol, methods = run.options.relative_tolerance, [one.method for one in run.choices]
    hidden = unsure > max(_CLEAR * rtol, _PART * ledger.max_drift) * ledger.exchanged
    few = run.statistics.steps > min(one.steps_seen for one in methods) * sum(len(one.time) for one in pieces)
    if not (hidden or (few and ledger.max_drift > _SUSPECT * rtol)):
        return ledger
    found = in_its_time(run, lambda: _work_in_steps(run, pieces, nodes_in_steps(run)))
    if found is None:
        return replace(ledger, uncertainty=max(ledger.uncertainty, 2.0 * ledger.max_drift * ledger.exchanged))
    work, unsure, swing = found
    return make_ledger(pieces, work, unsure, shown, swing)


def in_its_time(run: Run, look: Callable[[], _T | None]) -> _T | None:
    """Return what is found along a run in what is left of its limit of time; None where that does not do."""
    limit = run.options.max_seconds
    with suppress(TimeIsUp), Clock(None if limit is None else limit - sum(run.timings.values())).kept():
        check_time()
        return look()
    return None


def _work_in_steps(run: Run, pieces: Sequence[Piece], count: int) -> tuple[list[FloatArray], float, float] | None:
    """Return the work at all samples, integrated in each step, its estimated error, and its range at all steps."""
    found = samples_in_steps(run, [one.time for one in pieces], count)
    if found is None:
        return None
    work, unsure, swing = [], 0.0, 0.0
    powers = powers_into(quantities_of(one.segment for one in found))
    for one, piece, power in zip(found, pieces, powers, strict=True):
        rows = np.zeros((len(one.grid) - 1, count)) if power is None else power[one.places].reshape(-1, count)
        done, error = integral_in_steps(one.grid, rows)
        work.append(done[np.searchsorted(one.grid, piece.time)])
        unsure, swing = unsure + float(error), max(swing, float(np.ptp(done)))
    return work, unsure, swing


@dataclass(frozen=True, eq=False)
class StepSamples:
    """States within the steps of a segment.

    Attributes
    ----------
    segment
        The segment, with more samples.
    grid
        The times of its steps and of its own samples.
    places
        The samples of `segment` at the points of Gauss and Legendre between each two of these times.
    """

    segment: SegmentRecord
    grid: FloatArray
    places: NDArray[np.intp]


def nodes_in_steps(run: Run) -> int:
    """Return in how many points powers are integrated in a step of a run."""
    return max(one.method.nodes_in_step for one in run.choices)


def samples_in_steps(run: Run, times: Sequence[FloatArray], count: int) -> list[StepSamples] | None:
    """Return states within the steps of a run, for which it is made again; None if it comes out otherwise."""
    steps = times_of_steps(run)
    grids = [joined_times(one, steps) for one in times]
    nodes = [nodes_between(grid, count) for grid in grids]
    again = run_again(run, np.concatenate(nodes))
    if again is None:
        return None
    found = []
    for segment, grid, wanted in zip(again.segments, grids, nodes, strict=True):
        places = np.minimum(np.searchsorted(segment.time, wanted), len(segment.time) - 1)
        if not np.array_equal(segment.time[places], wanted):
            return None
        found.append(StepSamples(segment, grid, places))
    return found


def joined_times(t: FloatArray, steps: FloatArray) -> FloatArray:
    """Return sample times together with the times of steps between them, as far as these are told from each other."""
    inside = steps[(steps > t[0]) & (steps < t[-1])]
    places = np.searchsorted(t, inside)
    near = np.minimum(inside - t[places - 1], t[places] - inside)
    return np.union1d(t, inside[near > 1e3 * np.spacing(np.max(np.abs(t)))])
