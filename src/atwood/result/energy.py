"""The energy of a run: kinetic, potential, and the work that was put in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["EnergyLedger", "make_ledger"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EnergyLedger:
    """Energies at the output times, J.

    Attributes
    ----------
    kinetic, potential
        Kinetic and potential energy.
    work
        Work of drives, inputs and dampers since the start, and what impacts took away.
    max_drift
        Largest deviation of kinetic plus potential energy less work from its start, relative to the largest kinetic
        energy plus the range of the potential energy.
    """

    kinetic: FloatArray
    potential: FloatArray
    work: FloatArray
    max_drift: float

    @property
    def total(self) -> FloatArray:
        """Kinetic plus potential energy."""
        return self.kinetic + self.potential


def make_ledger(
    times: Sequence[FloatArray],
    kinetic: Sequence[FloatArray],
    potential: Sequence[FloatArray],
    power: Sequence[FloatArray | None],
    impacts: Sequence[bool],
    switched: Sequence[FloatArray | None],
    time_events: Sequence[bool],
    shown: NDArray[np.bool_],
) -> EnergyLedger:
    """Return the ledger of a run from samples of each of its segments.

    Parameters
    ----------
    times, kinetic, potential
        Samples.
    power
        Power put in, W; None where there is none.
    impacts
        For each segment, whether it began with an impact, which takes energy away.
    switched
        Samples of the potential energy that is there in some modes only, which counts as work when such a mode is
        entered or left; None where there is none. If other energy jumps at a change of mode, that is drift.
    time_events
        For each segment, whether it began at a time event. Energy that jumps there is work: of an input that a
        potential reads, or of drives whose speed jumps.
    shown
        Which of all samples are outputs.
    """
    work, carried = [], 0.0
    for i, (t, p) in enumerate(zip(times, power, strict=True)):
        if time_events[i]:
            carried += float(kinetic[i][0] + potential[i][0] - kinetic[i - 1][-1] - potential[i - 1][-1])
        elif impacts[i]:
            carried += min(0.0, float(kinetic[i][0] - kinetic[i - 1][-1]))
        if i and not time_events[i]:
            after, before = switched[i], switched[i - 1]
            carried += (0.0 if after is None else float(after[0])) - (0.0 if before is None else float(before[-1]))
        work.append(carried + (np.zeros(len(t)) if p is None else _integral(t, p)))
        carried = float(work[-1][-1])
    t_all, v_all, w_all = (np.concatenate(list(x)) for x in (kinetic, potential, work))
    balance = t_all + v_all - w_all
    size = float(np.max(np.abs(t_all)) + np.ptp(v_all))
    drift = float(np.max(np.abs(balance - balance[0])))
    return EnergyLedger(t_all[shown], v_all[shown], w_all[shown], drift / size if size > 0.0 else drift)


def _integral(t: FloatArray, values: FloatArray) -> FloatArray:
    """Return the integral from the first sample on, of a spline of order up to eight through the samples."""
    if len(t) < 2:
        return np.zeros(len(t))
    from scipy.interpolate import make_interp_spline

    degree = min(7, len(t) - 1)
    degree -= 1 - degree % 2  # an odd degree needs no choice at the ends
    spline = make_interp_spline(t, values, k=degree).antiderivative()
    integral: FloatArray = np.asarray(spline(t) - spline(t[0]), dtype=float)
    return integral
