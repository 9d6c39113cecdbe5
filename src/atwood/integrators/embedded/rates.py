"""Rates and accelerations of a mechanism and its projection onto constraints, as functions for embedded pairs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from atwood.arrays import FloatArray, address_of
from atwood.codegen.llvm.build import Built, RoutineSource, prologue_at
from atwood.codegen.llvm.module import Part
from atwood.codegen.llvm.tiers import Tiers
from atwood.codegen.routines import ADDRESS, CODE, INTEGER, NUMBER, Routine, Value, call_kernel, place_of
from atwood.errors import UnsupportedError
from atwood.expr.core.program import Program
from atwood.integrators.protocol import MET, STEPS, CompiledRates
from atwood.lazy_dataclasses import dataclass


def rates_source(coordinates: int | None, speeds: int | None, given: bool, projects: bool = False) -> RoutineSource:
    """Return what writes ``rates``, and ``project`` where there are constraints; without numbers these are data."""
    files = ("integrators/protocol.py",)
    return RoutineSource("integrators.embedded.rates", files, (coordinates, speeds, given, projects))


def write_routines(coordinates: int | None, speeds: int | None, given: bool, projects: bool) -> list[Routine]:
    """Write the routines; see `rates_source`."""
    written = [_rates(coordinates, speeds, given)]
    return [*written, _project(coordinates, speeds)] if projects else written


_HEAD = 7
"""The data of a session begin with: the pointers to derived values and scratch of both functions, that to room for the
results of a projection, and the numbers of coordinates and of speeds."""


def _rates(coordinates: int | None, speeds: int | None, given: bool) -> Routine:
    """Write ``(q', u')`` from ``(q, u)``."""
    arguments = {"t": NUMBER, "y": ADDRESS, "yp": ADDRESS, "data": ADDRESS}
    r = Routine("rates", arguments, exported=True)
    t, y, yp, data = r.arguments
    first, last = _counts(data, 5, coordinates, speeds)
    u, accelerations = y.at(first), yp.at(first)
    if not given:
        r.copy(yp, u, last)
    outputs = [yp, accelerations] if given else [accelerations]
    derived, scratch = (data.read(k, ADDRESS) for k in range(2))
    r.give(call_kernel(r, "kernel", [place_of(r, t), y, u], derived, scratch, outputs))
    return r


def _counts(data: Value, place: int, *known: int | None) -> tuple[Value | int, ...]:
    return tuple(data.read(place + k, INTEGER) if one is None else one for k, one in enumerate(known))


def _project(coordinates: int | None, speeds: int | None) -> Routine:
    """Take steps of Newton's method until one moves nothing; 1 where none does.

    The data begin with the derived values of this function.
    """
    r = Routine("project", {"t": NUMBER, "y": ADDRESS, "data": ADDRESS}, exported=True)
    t, y, data = r.arguments
    derived, scratch, room = (data.read(k, ADDRESS) for k in range(3))
    first, last = _counts(data, 3, coordinates, speeds)
    total = first + last
    moved = room.at(total)
    time = place_of(r, t)
    with r.count(STEPS):
        inputs, outputs = [time, y, y.at(first)], [room, room.at(first), moved]
        r.give_if(call_kernel(r, "nearer", inputs, derived, scratch, outputs) != 0, 1)
        r.copy(y, room, total)
        largest = r.variable(0.0)
        with r.count(last) as i:
            largest.now = r.most(r.size(moved[i]), largest.now)
        r.give_if(largest.now <= MET, 0)
    r.give(r.value(1, CODE))
    return r


class CompiledAccelerations:
    """Accelerations as a compiled right-hand side, with a projection onto constraints or without, for any parameters.

    Parameters
    ----------
    program
        A program of (t, q, u) with the accelerations, and before them the rates of the coordinates unless these are
        the speeds.
    projection
        A step onto the constraints; see `atwood.forms.constrained.ConstrainedProgram`.
    is_brief
        Whether it is run for short stretches at a time.

    Raises
    ------
    UnsupportedError
        If a program calls functions in Python.
    """

    def __init__(self, program: Program, projection: Program | None = None, is_brief: bool = False) -> None:
        self._programs = {"kernel": program} | ({} if projection is None else {"nearer": projection})
        for one in self._programs.values():
            if one.calls_python:
                raise UnsupportedError("a program that calls functions in Python has no compiled rates", where=one.name)
        parts = [Part(name, one) for name, one in self._programs.items()]
        _, q, u = (len(group.symbols) for group in program.inputs)
        given, projects = len(program.outputs) == 2, projection is not None
        self._room = q + 2 * u if projects else 0
        exports = ["rates", "project"] if projects else ["rates"]
        routines, of_tapes = (rates_source(n, m, given, projects) for n, m in ((q, u), (None, None)))
        self.tiers, self._counts = Tiers(parts, exports, routines, is_brief, of_tapes), (q, u)

    def bind(self, parameter_values: ArrayLike, projects: bool = True) -> Callable[[], CompiledRates]:
        """Return what gives each session functions of its own, with these parameters."""

        def rates() -> CompiledRates:
            own = self.open(projects)
            self.fill(own, parameter_values)
            return own.rates

        return rates

    def open(self, projects: bool = True) -> OwnRates:
        """Return rates of a session whose parameters can be changed between its runs."""
        counts = [len(one.prologue) for one in self._programs.values()]
        built = self.tiers.now
        room = _HEAD + built.scratch
        own = np.empty(room + self._room + sum(counts))
        data, places, end = own.ctypes.data, [], room + self._room
        for count in counts:
            places.append(data + 8 * end)
            end += count
        scratch = data + 8 * _HEAD
        pointers = [place for one in (places[0], places[-1]) for place in (one, scratch)]
        own[:_HEAD].view(np.uint64)[:] = [*pointers, data + 8 * room, *self._counts]
        rates = self._at(data, (built, own), projects)
        prologues = tuple(built.code.addresses[f"{name}_prologue"] for name in self._programs)
        return OwnRates(rates, prologues, places[0], scratch, tuple(places))

    def _at(self, data: int, kept: tuple[Built, FloatArray], projects: bool) -> CompiledRates:
        """Return the present code with the data of a session; it keeps the code whose prologues fill that."""
        built, quick = self.tiers.now, self.tiers.has_better
        project = built.code.addresses["project"] if projects and self._room else 0

        def faster(seconds: float) -> CompiledRates | None:
            return None if self.tiers.spend(seconds) is built else self._at(data, kept, projects)

        return CompiledRates(
            built.code.addresses["rates"],
            data,
            (built, *kept),
            project,
            data + 16 if project else 0,
            faster if quick else None,
        )

    def at_its_best(self) -> CompiledAccelerations:
        """Return this with the code that suits many runs, or a long one."""
        self.tiers.at_its_best()
        return self

    def fill(self, own: OwnRates, parameter_values: ArrayLike) -> None:
        """Give rates of a session their parameters, by the code that they were opened with."""
        values = np.array(parameter_values, dtype=np.float64)
        given = address_of(values)
        for prologue, place in zip(own.prologues, own.places, strict=True):
            prologue_at(prologue)(given, place, own.scratch)


@dataclass(frozen=True)
class OwnRates:
    """Compiled rates with a place for their parameters.

    Attributes
    ----------
    rates
        The rates; they have values once the prologue was called.
    prologues
        Addresses of the functions that compute what depends on parameters alone, of the rates and of the projection.
    derived, scratch
        Arrays of the first of them.
    places
        Where that is kept of both.
    """

    rates: CompiledRates
    prologues: tuple[int, ...]
    derived: int
    scratch: int
    places: tuple[int, ...]
