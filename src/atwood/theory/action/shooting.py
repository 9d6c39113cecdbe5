"""Motions of a scene from one place with many velocities, for those that end where they should."""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, StartError, UnsupportedError
from atwood.forms.assembly import Assembly
from atwood.forms.program import rates_are_speeds
from atwood.integrators.methods import EXPLICIT, Task
from atwood.integrators.protocol import SolverOptions, Status
from atwood.simulation.problem.explicit_scene import explicit_problem
from atwood.simulation.problem.preparation import make_plan

__all__ = ["Shooter", "refuse_tied"]

_RELATIVE, _ABSOLUTE = 1e-12, 1e-13
"""Of the explicit method, the second as a share of the scene's sizes."""

_DIFFERENCE = 1e-5
"""Of the size of a velocity: with steps of the method as accurate as above, derivatives err by some 1e-8."""


def refuse_tied(assembly: Assembly) -> None:
    """Refuse a scene whose ends are not those of free coordinates, or whose equations switch.

    Parameters
    ----------
    assembly
        The scene.

    Raises
    ------
    UnsupportedError
        If it is so.
    """
    name, equations = assembly.flat.name, assembly.own_equations
    if assembly.form == "dae" or equations.constraints or not rates_are_speeds(equations):
        raise UnsupportedError(
            "its ends are not those of free coordinates: closed loops, rolling, or bodies in space",
            where=name,
            advice="Describe it by as many coordinates as it has degrees of freedom.",
        )
    if assembly.modes or assembly.relations or equations.states:
        raise UnsupportedError(
            "its equations change on the way, by modes or by the clock, or parts have states of their own",
            where=name,
            advice="Take the scene without the parts that switch.",
        )


class Shooter:
    """Runs a scene from a place with velocities that are given.

    Parameters
    ----------
    assembly
        The scene.
    place
        Coordinates at the start.
    length
        Extent of the scene, m.
    begin, end
        s.
    """

    def __init__(self, assembly: Assembly, place: FloatArray, length: float, begin: float, end: float) -> None:
        refuse_tied(assembly)
        problem = explicit_problem(assembly)
        assert problem is not None
        self.place, self.begin, self.end, self.size = place, begin, end, len(place)
        self.names = tuple(one.name for one in assembly.own_equations.names)
        still = np.zeros(self.size)
        plan = make_plan(assembly, begin, place, still, length, end - begin)
        self.sizes, self.time = plan.coordinate_sizes, plan.scales.time
        both = np.concatenate([self.sizes, self.sizes / self.time])
        options = SolverOptions(_RELATIVE, _ABSOLUTE * both, horizon=end - begin)
        self._session = EXPLICIT.open(Task(options, begin, np.concatenate([place, still]), end=end, explicit=problem))

    def at(self, velocity: FloatArray, times: FloatArray) -> FloatArray:
        """Return coordinates and velocities at times, a row each; nan from where there are none."""
        found = np.full((len(times), 2 * self.size), np.nan)
        try:
            self._session.reinitialize(self.begin, np.concatenate([self.place, velocity]))
            rows, _, ended = self._session.sample(times)
        except (StartError, AtwoodError):
            return found
        if ended.status in (Status.REACHED, Status.FAILED):
            found[: len(rows)] = rows
        return found

    def arrival(self, velocity: FloatArray) -> FloatArray:
        """Return the coordinates at the end."""
        return self.at(velocity, np.array([self.end]))[0, : self.size]

    def fields(self, velocity: FloatArray, times: FloatArray) -> FloatArray:
        """Return the derivatives of coordinates at times by the velocities at the start, shape (times, n, n)."""
        found = np.empty((len(times), self.size, self.size))
        pace = max(float(np.max(np.abs(velocity) / self.sizes)), 1.0 / self.time)
        for k in range(self.size):
            step = np.zeros(self.size)
            step[k] = _DIFFERENCE * self.sizes[k] * pace
            ahead, behind = self.at(velocity + step, times), self.at(velocity - step, times)
            found[:, :, k] = (ahead - behind)[:, : self.size] / (2.0 * step[k])
        return found
