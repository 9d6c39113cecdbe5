"""Rates of a mechanism and its projection onto constraints, as functions that an explicit method calls."""

from __future__ import annotations

from atwood.codegen.routines.kernels import call_kernel, place_of
from atwood.codegen.routines.kinds import ADDRESS, CODE, NUMBER
from atwood.codegen.routines.language import Routine
from atwood.codegen.routines.source import RoutineSource
from atwood.integrators.explicit_problem import MET, STEPS

__all__ = ["rates_source", "write_routines"]


def rates_source(coordinates: int, speeds: int, given: bool, projects: bool = False) -> RoutineSource:
    """Return what writes ``rates``, and ``project`` where there are constraints.

    Parameters
    ----------
    coordinates, speeds
        Their numbers.
    given
        Whether the program ``kernel`` gives the rates of both, or the speeds are the rates of the coordinates.
    projects
        Whether the program ``nearer`` takes a step onto the constraints.
    """
    files = ("integrators/explicit_problem.py",)
    return RoutineSource("integrators.embedded.rates", files, (coordinates, speeds, given, projects))


def write_routines(coordinates: int, speeds: int, given: bool, projects: bool) -> list[Routine]:
    """Write the routines; see `rates_source`."""
    written = [_rates(coordinates, speeds, given)]
    return [*written, _project(coordinates, speeds)] if projects else written


def _rates(coordinates: int, speeds: int, given: bool) -> Routine:
    """Write ``(q', u')`` from ``(q, u)``; the data: derived values and scratch."""
    arguments = {"t": NUMBER, "y": ADDRESS, "yp": ADDRESS, "data": ADDRESS}
    r = Routine("rates", arguments, exported=True)
    t, y, yp, data = r.arguments
    u, accelerations = y.at(coordinates), yp.at(coordinates)
    if not given:
        r.copy(yp, u, speeds)
    outputs = [yp, accelerations] if given else [accelerations]
    derived, scratch = (data.read(k, ADDRESS) for k in range(2))
    r.give(call_kernel(r, "kernel", [place_of(r, t), y, u], derived, scratch, outputs))
    return r


def _project(coordinates: int, speeds: int) -> Routine:
    """Take steps of Newton's method until one moves nothing; 1 where none does.

    The data: derived values, scratch, and room for the results of a step.
    """
    r = Routine("project", {"t": NUMBER, "y": ADDRESS, "data": ADDRESS}, exported=True)
    t, y, data = r.arguments
    derived, scratch, room = (data.read(k, ADDRESS) for k in range(3))
    moved = room.at(coordinates + speeds)
    time = place_of(r, t)
    with r.count(STEPS):
        inputs, outputs = [time, y, y.at(coordinates)], [room, room.at(coordinates), moved]
        with r.when(call_kernel(r, "nearer", inputs, derived, scratch, outputs) != 0):
            r.give(1)
        r.copy(y, room, coordinates + speeds)
        largest = r.variable(0.0)
        with r.count(speeds) as i:
            largest.now = r.most(r.size(moved[i]), largest.now)
        with r.when(largest.now <= MET):
            r.give(0)
    r.give(r.value(1, CODE))
    return r
