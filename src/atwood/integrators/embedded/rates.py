"""Rates and accelerations of a mechanism and its projection onto constraints, as functions for embedded pairs."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from contextlib import suppress
from ctypes import c_void_p

import numpy as np
from numpy.typing import ArrayLike

from atwood.arrays import FloatArray
from atwood.clock import TimeIsUp
from atwood.codegen.llvm.build import Built, RoutineSource, build_tiers
from atwood.codegen.llvm.module import Part
from atwood.codegen.routines import ADDRESS, CODE, NUMBER, Routine, call_kernel, place_of
from atwood.errors import UnsupportedError
from atwood.expr.core.program import Program
from atwood.integrators.protocol import MET, STEPS, CompiledRates
from atwood.lazy_dataclasses import dataclass

_PROLOGUE = ctypes.CFUNCTYPE(None, *[c_void_p] * 3)

_STARTS = 10
"""What was started so often will be started again."""


def rates_source(coordinates: int, speeds: int, given: bool, projects: bool = False) -> RoutineSource:
    """Return what writes ``rates``, and ``project`` where there are constraints."""
    files = ("integrators/protocol.py",)
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
            if any(node.operation == "external" for node in one.nodes):
                raise UnsupportedError("a program that calls functions in Python has no compiled rates", where=one.name)
        parts = [Part(name, one) for name, one in self._programs.items()]
        _, q, u = (len(group.symbols) for group in program.inputs)
        given, projects = len(program.outputs) == 2, projection is not None
        self._room = q + 2 * u if projects else 0
        routines = rates_source(q, u, given, projects)
        exports = ["rates", "project"] if projects else ["rates"]
        tiers = build_tiers(parts, is_brief, exports, routines)
        self._built, self._better, self._cost = tiers.quick, tiers.better, tiers.cost
        self._left, self._lock = self._cost, threading.Lock()

    def bind(self, parameter_values: ArrayLike, projects: bool = True) -> Callable[[], CompiledRates]:
        """Return what gives each session functions of its own, with these parameters."""

        def rates() -> CompiledRates:
            own = self.open(projects)
            self.fill(own, parameter_values)
            return own.rates

        return rates

    def open(self, projects: bool = True) -> OwnRates:
        """Return rates of a session whose parameters can be changed between its runs."""
        # The pointers to derived values, scratch and room of each function; then scratch, room and the derived values.
        head, counts = 5 if self._room else 2, [len(one.prologue) for one in self._programs.values()]
        room = head + self._built.scratch
        own = np.empty(room + self._room + sum(counts))
        data, places, end = own.ctypes.data, [], room + self._room
        for count in counts:
            places.append(data + 8 * end)
            end += count
        scratch = data + 8 * head
        pointers = [place for one in places for place in (one, scratch)]
        own[:head].view(np.uint64)[:] = [*pointers, data + 8 * room][:head]
        built = self._built
        rates = self._at(data, (built, own), projects)
        prologues = tuple(built.code.addresses[f"{name}_prologue"] for name in self._programs)
        return OwnRates(rates, prologues, places[0], scratch, tuple(places))

    def _at(self, data: int, kept: tuple[Built, FloatArray], projects: bool) -> CompiledRates:
        """Return the present code with the data of a session; it keeps the code whose prologues fill that."""
        built, quick = self._built, self._better is not None
        project = built.code.addresses["project"] if projects and self._room else 0

        def faster(seconds: float) -> CompiledRates | None:
            self._spend(seconds)
            return None if self._built is built else self._at(data, kept, projects)

        return CompiledRates(
            built.code.addresses["rates"],
            data,
            (built, *kept),
            project,
            data + 16 if project else 0,
            faster if quick else None,
        )

    def _spend(self, seconds: float) -> None:
        """Take note of steps or a start; compile what is faster once it has run for as long as that takes, or often."""
        self._left -= seconds or self._cost / _STARTS
        if self._left <= 0.0:
            with suppress(TimeIsUp):
                self.at_its_best()

    def at_its_best(self) -> CompiledAccelerations:
        """Return this with the code that suits many runs, or a long one."""
        with self._lock:
            better, self._better = self._better, None
            if better is not None:
                self._built = better()
        return self

    def fill(self, own: OwnRates, parameter_values: ArrayLike) -> None:
        """Give rates of a session their parameters, by the code that they were opened with."""
        values = np.array(parameter_values, dtype=np.float64)
        for prologue, place in zip(own.prologues, own.places, strict=True):
            _PROLOGUE(prologue)(values.ctypes.data, place, own.scratch)


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
