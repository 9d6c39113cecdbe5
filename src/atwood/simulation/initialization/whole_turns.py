"""Whole turns at the start: joints whose angles nothing is said of are not wound up by the way to the start."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.forms.assembly import Assembly
from atwood.forms.places import to_maximal
from atwood.mechanics.dynamics.equations import Equations
from atwood.numerics.independence import row_sizes
from atwood.simulation.initialization.system import System
from atwood.simulation.initialization.targets import Target
from atwood.tolerances import tolerances

__all__ = ["unwound"]


_TURN = 2.0 * np.pi


def unwound(
    assembly: Assembly,
    equations: Equations,
    targets: Sequence[Target],
    constrained: bool,
    scales: FloatArray,
    length: float,
    t: float,
    near: FloatArray,
    q: FloatArray,
) -> FloatArray:
    """Return the same place with the angles of joints, which count turns, within half a turn of what is said of them.

    Newton's method may go round on its way, and a spring on the joint would begin wound up. A turn is taken back if no
    body stands otherwise without it, and what is said holds as before.

    Parameters
    ----------
    assembly, equations
        The scene.
    targets
        What is said of positions.
    constrained
        Whether the constraints are to hold as before; else bodies are only where they are said to be by now.
    scales
        Size of a displacement along each speed.
    length
        Extent of the scene, m.
    t
        Time of the start, s.
    near
        What is said of the coordinates themselves; zero where nothing is.
    q
        Coordinates of the start.
    """
    if not assembly.mechanism.space.is_spatial:  # in a plane angles are absolute, and not those of joints
        return q
    of_charts = {number for orientation in equations.orientation_coordinates for number in orientation.coordinates}
    whole = np.round((q - near) / _TURN)
    wound = [i for i, one in enumerate(equations.names) if one.unit == "rad" and i not in of_charts and whole[i] != 0.0]
    if not wound:
        return q
    system = System(assembly, equations, targets, constrained)
    still = np.zeros_like(scales)
    before, matrix = system.at(t, q, still)
    allowed = tolerances.CLOSED * row_sizes(matrix, scales)
    places = _places(assembly, t, q, length)
    for i in wound:
        trial = q.copy()
        trial[i] -= whole[i] * _TURN
        is_met = np.all(np.abs(system.at(t, trial, still)[0] - before) <= allowed)
        if is_met and np.max(np.abs(_places(assembly, t, trial, length) - places)) <= tolerances.CLOSED:
            q = trial
    return q


def _places(assembly: Assembly, t: float, q: FloatArray, length: float) -> FloatArray:
    """Return where bodies are, by the scene's extent, and how they are turned, the same after whole turns."""
    forest = assembly.maximal.forest
    given = assembly.kernel(to_maximal(assembly, "regular"))([t], q, np.zeros(len(assembly.regular.speeds)))[0]
    found = np.asarray(given, dtype=float)
    rotations = [
        np.outer(v, v).ravel() / (v @ v)
        for v in (found[list(one.coordinates)] for one in forest.orientation_coordinates)
    ]
    of_charts = [number for one in forest.orientation_coordinates for number in one.coordinates]
    counted = [number for number, _ in forest.counted.values()]
    return np.concatenate([np.delete(found, [*of_charts, *counted]) / length, *rotations])
