"""Rates and accelerations of a mechanism and its projection onto constraints, as functions for embedded pairs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from atwood.codegen.llvm.build import build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.codegen.routines.kernels import call_kernel, place_of
from atwood.codegen.routines.kinds import ADDRESS, CODE, NUMBER
from atwood.codegen.routines.language import Routine
from atwood.codegen.routines.source import RoutineSource
from atwood.errors import UnsupportedError
from atwood.expr.core.program import Program
from atwood.integrators.explicit_problem import MET, STEPS, CompiledRates


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


class CompiledConstraints:
    """Accelerations and projections as compiled functions, for any parameter values.

    Parameters
    ----------
    accelerations, projection
        See `atwood.forms.constrained.programs.ConstrainedProgram`.

    Raises
    ------
    UnsupportedError
        If a program calls functions in Python.
    """

    def __init__(self, accelerations: Program, projection: Program) -> None:
        for program in (accelerations, projection):
            if any(node.operation == "external" for node in program.nodes):
                raise UnsupportedError(
                    "a program that calls functions in Python has no compiled rates", where=program.name
                )
        parts = [Part("kernel", accelerations), Part("nearer", projection)]
        _, q, u = (len(group.symbols) for group in accelerations.inputs)
        self.programs, self.room = (accelerations, projection), q + 2 * u
        routines = rates_source(q, u, given=len(accelerations.outputs) == 2, projects=True)
        self._built = build_code(parts, default_options(parts), exports=["rates", "project"], routines=routines)

    def bind(self, parameter_values: ArrayLike, projects: bool = True) -> Callable[[], CompiledRates]:
        """Compute once what depends on parameters alone; return what gives each session functions of its own.

        Parameters
        ----------
        parameter_values
            The values in the order of the programs' parameters.
        projects
            Whether there are constraints to be met.
        """
        addresses, room = self._built.code.addresses, 5 + self._built.scratch
        named = zip(("kernel", "nearer"), self.programs, strict=True)
        derived = [self._built.derive(name, program, parameter_values)[0] for name, program in named]

        def rates() -> CompiledRates:
            # The pointers to derived values, scratch and room of each function, and then scratch and room themselves.
            own = np.empty(room + self.room)
            data = own.ctypes.data
            first, second = (one.ctypes.data for one in derived)
            own[:5].view(np.uint64)[:] = first, data + 40, second, data + 40, data + 8 * room
            keep = (self._built, derived, own)
            project = addresses["project"] if projects else 0
            return CompiledRates(addresses["rates"], data, keep, project, data + 16)

        return rates
