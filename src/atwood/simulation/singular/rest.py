"""Whether a motion comes to rest where it is singular: which way it goes on from there is not determined.

A motion that reaches the place with little speed would turn back a little before or behind it for another energy. So
it is told apart from one that passes, and from one that turns back clearly, by more than what its errors can change.
"""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.simulation.problem.problem import Plan
from atwood.simulation.singular.collocation import Arc
from atwood.simulation.singular.rank_measure import RankMeasure

__all__ = ["is_slow", "rests_at", "slowest"]

_ENERGIES, _PLACES = 30.0, 300.0
"""Times the tolerance: what a run's errors may change, of energies and of places, relative to their sizes."""

_LEAST = 1e-7
"""At tighter tolerances the same; rank is judged to be lost within 1e-5."""


def is_slow(plan: Plan, arc: Arc, t: float, fastest: float, tolerance: float) -> bool:
    """Return whether a motion has so little energy at a time that errors could have it turn back.

    Parameters
    ----------
    plan
        The scene in its mode.
    arc
        The motion.
    t
        When.
    fastest
        The largest speed about then, in units of the scene's sizes; those of the arc count too.
    tolerance
        The relative tolerance of the run.
    """
    here, *ends = np.max(np.abs(arc.at(np.array([t, arc.start, arc.end]))[1]) / plan.sizes[:, None], axis=0).tolist()
    return bool(here**2 < max(_ENERGIES * tolerance, _LEAST) * max(fastest, *ends) ** 2)


def slowest(t: FloatArray, speeds: FloatArray, sizes: FloatArray) -> float | None:
    """Return when a motion is slowest between some times; None where it is at their ends.

    Parameters
    ----------
    t, speeds
        Times equally far from each other, and speeds of shape (number, times).
    sizes
        The size of each speed.
    """
    square = np.sum((speeds / sizes[:, None]) ** 2, axis=0)
    least = int(np.argmin(square))
    if least in (0, len(t) - 1):
        return None
    before, here, after = square[least - 1 : least + 2].tolist()
    bend = before - 2.0 * here + after
    share = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    return float(t[least] + share * (t[1] - t[0]))


def rests_at(plan: Plan, measure: RankMeasure, arc: Arc, far: float, fastest: float, tolerance: float) -> float | None:
    """Return when an arc comes to rest so close to a singular position that errors decide on what follows; else None.

    Parameters
    ----------
    plan
        The scene in its mode.
    measure
        How near states are to a singular position.
    arc
        A motion.
    far
        The measure elsewhere.
    fastest
        See `is_slow`.
    tolerance
        The relative tolerance of the run.
    """
    times = np.linspace(arc.start, arc.end, 65)
    rest = slowest(times, arc.at(times)[1], plan.sizes)
    if rest is None:
        return None
    near = measure.at(np.array([rest]), arc.at(np.array([rest]))[0])[0] < max(_PLACES * tolerance, _LEAST) * far
    return rest if near and is_slow(plan, arc, rest, fastest, tolerance) else None
