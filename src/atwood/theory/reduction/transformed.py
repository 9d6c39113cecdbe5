"""Scenes in other coordinates, in numbers: the parts of their Lagrangian, and their start."""

from __future__ import annotations

from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import StartError, UnsupportedError
from atwood.simulation.dynamics.orientation_coordinates import from_regular
from atwood.simulation.initialization.start import find_start
from atwood.theory.hamiltonian.points import PointTransformation
from atwood.theory.reduction.parts import Parts, PartsAt

__all__ = ["start_in", "transformed_parts"]

_TRIALS = 60
"""Starts of Newton's method for the new coordinates."""


def transformed_parts(given: PointTransformation, along: int) -> PartsAt:
    """Return what gives the parts of a Lagrangian in new coordinates at places; see `parts_of`.

    Parameters
    ----------
    given
        The scene in new coordinates.
    along
        Number of the coordinate by which they are differentiated.

    Raises
    ------
    UnsupportedError
        If L depends on time, or is of higher degree in the velocities.
    """
    import sympy

    name = given.source.name
    whole = given.lagrangian.xreplace(given.source.values)
    if whole.has(sympy.Symbol("t")):
        raise UnsupportedError("its Lagrangian depends on time in these coordinates", where=name)
    still = dict.fromkeys(given.velocities, sympy.Integer(0))
    momenta = [whole.diff(one) for one in given.velocities]
    mass = [one.diff(other) for one in momenta for other in given.velocities]
    if any(one.has(*given.velocities) for one in mass):
        raise UnsupportedError("its Lagrangian is of higher degree in the velocities", where=name)
    values = [*mass, *(one.xreplace(still) for one in momenta), -whole.xreplace(still)]
    slopes = [one.diff(given.coordinates[along]) for one in values]
    function = sympy.lambdify(given.coordinates, [*values, *slopes], "numpy")
    n = len(given.coordinates)

    def at(q: FloatArray) -> Parts:
        with np.errstate(all="ignore"):
            found = [np.broadcast_to(np.asarray(one, dtype=float), q.shape[1]) for one in function(*q)]
        rows = np.array(found).reshape(2, n * n + n + 1, -1)
        made = [(one[: n * n].reshape(n, n, -1), one[n * n : -1], one[-1]) for one in rows]
        return Parts(*made[0], *made[1])

    return at


def start_in(given: PointTransformation) -> tuple[float, FloatArray, FloatArray]:
    """Return time, new coordinates and their derivatives where a scene starts.

    Raises
    ------
    StartError
        If no new coordinates are found that the start has.
    """
    import sympy
    from scipy.optimize import least_squares

    h = given.source
    start = find_start(h.assembly)
    q = from_regular(h.assembly, start.coordinates)
    v = h.velocities_at(q, h.start()[1], start.time)
    t = sympy.Symbol("t")
    old = [one.xreplace(h.values) for one in given.old.values()]
    by_new = [[one.diff(x) for x in given.coordinates] for one in old]
    symbols = (*given.coordinates, t)
    place, slope, explicit = (
        sympy.lambdify(symbols, what, "numpy") for what in (old, by_new, [one.diff(t) for one in old])
    )

    def missing(x: Any) -> FloatArray:
        return np.asarray(place(*x, start.time), dtype=float) - q

    random = np.random.default_rng(11)
    for trial in range(_TRIALS):
        guess = start.length * random.uniform(0.1, 2.0, len(q)) if trial else np.abs(q) + 0.1 * start.length
        with np.errstate(all="ignore"):
            found = least_squares(missing, guess, xtol=3e-16, ftol=3e-16, gtol=3e-16)
        is_met = np.max(np.abs(found.fun)) <= 1e-13 * (np.max(np.abs(q)) + start.length)
        if is_met and all(x > 0.0 or not one.is_positive for x, one in zip(found.x, given.coordinates, strict=True)):
            matrix = np.array(slope(*found.x, start.time), dtype=float)
            own = np.asarray(explicit(*found.x, start.time), dtype=float)
            return start.time, found.x, np.linalg.solve(matrix, v - own)
    raise StartError("its start is at no values of the new coordinates that are found", where=h.name)
