"""The methods of Gauss as machine code: no Python runs between outputs.

Hamilton's equations of a scene, as methods of equal steps are given them.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from ctypes import c_double, c_void_p
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import RoutineSource, build_code, default_options
from atwood.codegen.llvm.module import CodeOptions, Part
from atwood.errors import KernelEvaluationError, SolveError
from atwood.expr import Program
from atwood.integrators.protocol import CompiledRates, SolverOptions, State, StepGuard
from atwood.integrators.stepper import Outcome, Stepper, bind_functions
from atwood.integrators.symplectic.fixed_steps import FIELDS, FILES, Layout
from atwood.lazy_dataclasses import dataclass

_CALM, _SHORTEST = 8, 1e-12
"""After so many good steps one that was divided is made longer again; none is shorter than such a share."""
_UNSEEN = 4
_HALVINGS, _LOOKED_AT, _CLOSE = 60, 40, 0.2
"""So many steps are tried, on so many steps of the motion each, until an error is so near to what is allowed."""


_SHAPES: dict[str, tuple[Any, ...]] = {
    "begin": (),
    "trial": (c_double, c_double, c_void_p, c_void_p),
    "speeds": (c_double, c_void_p, c_void_p),
}

_LARGE = 3_000
"""Equations of more nodes are compiled with less effort."""


class CompiledMethod:
    """Hamilton's equations with the fixed steps of a method, for any parameter values and any step.

    Parameters
    ----------
    routines
        What writes the steps.
    programs
        What they call, by its name there.
    order
        Of the method.
    layout
        Of a session's array.
    level
        How much effort the compiler takes.
    """

    def __init__(
        self,
        routines: RoutineSource,
        programs: Mapping[str, Program],
        order: int,
        layout: Layout,
        level: int = 2,
    ) -> None:
        self.order, self.layout, self._programs = order, layout, programs
        parts = [Part(part, one) for part, one in programs.items()]
        exports = ("run", "interpolate", "sample", *_SHAPES)
        self._built = build_code(parts, CodeOptions(level=level), exports=exports, routines=routines)
        self.functions = bind_functions(self._built, **_SHAPES)

    def memory(self, parameter_values: FloatArray) -> tuple[FloatArray, tuple[object, ...]]:
        """Return the array of a session, and what it leads to."""
        found = [self._built.derive(name, one, parameter_values) for name, one in self._programs.items()]
        memory = np.zeros(self.layout.places["end"])
        addresses, places = memory.view(np.int64), list(FIELDS)
        for name, (derived, scratch) in zip(("derived", "derived_2"), found, strict=False):
            addresses[places.index(name)] = derived.ctypes.data
            addresses[places.index("scratch")] = scratch.ctypes.data
        return memory, (self._built, found)


def compiled_gauss(equations: Program, speeds: int, order: int) -> CompiledMethod:
    """Return Hamilton's equations with the steps of a method of Gauss.

    Parameters
    ----------
    equations
        Program of (t, q, p), or of (t, q, p, u), with q' and p', and with the speeds where these are not q'.
    speeds
        How many speeds there are.
    order
        Of the method, one of `atwood.integrators.symplectic.gauss.ORDERS`.
    """
    n, usual = len(equations.inputs[1].symbols), default_options([Part("kernel", equations)]).level
    layout = Layout(n, speeds, order // 2, len(equations.outputs) > 2, len(equations.inputs) > 3)
    level = max(2, usual) if equations.size < _LARGE else usual
    routines = RoutineSource("integrators.symplectic.gauss", FILES, (layout, order))
    return CompiledMethod(routines, {"kernel": equations}, order, layout, level)


class GaussStepper(Stepper):
    """Takes the steps of a method of Gauss or a composition, all equally long; outputs are steps of their own.

    The state that it is given and gives is (q, u); what it integrates is (q, p).

    Parameters
    ----------
    compiled
        The method.
    parameter_values
        Values of the parameters of its equations.
    momenta
        ``momenta(t, q, u)``: what p is there.
    rates
        The rates of (q, u), which events and outputs read.
    step
        The step, s.
    sizes
        How large coordinates and momenta are in the scene.
    guard
        What judges steps. One that is not good is divided where that is allowed (`vary_step`), and told of elsewhere.
    """

    _fields = FIELDS

    def __init__(
        self,
        compiled: CompiledMethod,
        parameter_values: FloatArray,
        momenta: Callable[[float, FloatArray, FloatArray], FloatArray],
        rates: CompiledRates,
        step: float,
        sizes: FloatArray,
        guard: StepGuard | None = None,
    ) -> None:
        self._compiled, self._momenta = compiled, momenta
        layout, self._functions = compiled.layout, compiled.functions
        self._memory, kept = compiled.memory(parameter_values)
        self._keep = kept, rates, guard
        self._begin_at(self._memory, rates=rates.function, rates_data=rates.data, step=step)
        if guard is not None:
            self._set(guard=guard.function, guard_data=guard.data)
        self._groups, self._size = layout.places, layout.width
        self._y = self._group("y", layout.size)
        self._group("per_size", layout.size)[:] = 1.0 / sizes
        self._values = np.empty((2, layout.width))
        y, yp = (one.ctypes.data for one in self._values)
        self._outputs = y, yp
        self._longest, self._good = 0.0, 0

    def _group(self, name: str, size: int) -> FloatArray:
        """Return so many numbers of the session from the begin of a group on."""
        return self._memory[self._groups[name] : self._groups[name] + size]

    @property
    def step(self) -> float:
        """The step, s."""
        return self._number("step")

    def choose_step(self, t: float, y: FloatArray, end: float, options: SolverOptions) -> None:
        """Find a step that is accurate enough from a start, and let steps be shorter than it where they need to be."""
        absolute = np.broadcast_to(np.asarray(options.absolute_tolerances, dtype=float), y.shape)
        longest = self.find_step(t, y, end, absolute, options.relative_tolerance)
        if options.max_step is not None and options.max_step < longest:
            self.take_step(options.max_step)
        self.vary_step()

    def take_step(self, step: float) -> None:
        """Take steps of another length from the next start on."""
        self._set(step=step)

    def vary_step(self) -> None:
        """Let steps be shorter than now where they would pass over something."""
        self._longest = self.step

    def start(self, t: float, y: FloatArray) -> bool:
        """Start anew from a state; return whether its equations have a value there."""
        layout = self._compiled.layout
        n, m = layout.coordinates, layout.speeds
        q, u = y[:n], y[n:]
        self._y[:n], self._y[n:] = q, self._momenta(t, q, u)
        for area in ("main", "aside"):
            self._group(f"{area}.U", layout.stages * m)[:] = np.tile(u, layout.stages)
        self._set(t=t)
        return bool(np.isfinite(self._y).all()) and self._call("begin") == 0

    def _go_on(self, last: int, function: str, *arguments: int) -> int | None:
        """Take steps, one by one while they are divided; None where the last one was divided or told of."""
        before, is_divided = self._count("steps"), self.step < self._longest
        code = super()._go_on(min(last, before + 1) if is_divided else last, function, *arguments)
        if code in (Outcome.TOO_SMALL, _UNSEEN):
            self._divide(code == _UNSEEN)
            return None
        if is_divided and self._count("steps") > before:
            self._good += 1
            if self._good >= _CALM:
                self._change_step(min(2.0 * self.step, self._longest))
        return None if code == Outcome.USED_UP and self._count("steps") < last else code

    def _divide(self, is_unseen: bool) -> None:
        """Take shorter steps from where the last one began, which failed or may have passed over something."""
        if self._longest and self.step > _SHORTEST * self._longest:
            if is_unseen:
                self._y[:] = self._group("y_old", len(self._y))
                self._set(t=self._number("t_old"))
                self._set(steps=self._count("steps") - 1, failures=self._count("failures") + 1)
            self._change_step(0.5 * self.step)
        elif not is_unseen:
            raise KernelEvaluationError(
                f"the equations of a step of {self.step:.3g} s have no solution that iteration finds: give a smaller "
                "step"
            )
        elif not self._longest:
            self._set(guard=0)
            warnings.warn(
                f"at t = {self._number('t_old'):.6g} a law may change by more within a step of {self.step:.3g} s than "
                "the method sees: give a smaller step, or none",
                stacklevel=2,
            )

    def _change_step(self, step: float) -> None:
        self._good = 0
        self.take_step(step)
        self._call("begin")

    def state(self) -> State:
        """Return time, values and rates at the end of the last step."""
        return self.interpolate(self._number("t"))

    def _no_interpolation(self, t: float) -> KernelEvaluationError:
        """Return the error of a time to which there is no step, by which values within one are found."""
        return KernelEvaluationError(f"there is no step to t = {t:.9g} within one that there is")

    def find_step(self, t: float, y: FloatArray, end: float, tolerances: FloatArray, relative: float) -> float:
        """Return a step whose error is within tolerances along the first steps of a motion, and take it from here on.

        The error is that of a step against two of half its length.
        """
        step, best, too_long = (end - t) / 4.0, 0.0, np.inf
        order = self._compiled.order
        for _ in range(_HALVINGS):
            error = self._error(t, y, min(step, end - t), end, tolerances, relative)
            factor = 0.9 * max(error, 1e-300) ** (-1.0 / (order + 1)) if np.isfinite(error) else 0.6
            if error <= 1.0:
                best = step
                step *= min(2.0, factor)
                if error > _CLOSE or step > min(0.95 * too_long, end - t):
                    break
            else:
                too_long = step
                step = max(step * min(0.9, max(0.1, factor)), 0.5 * (best + step) if best else 0.0)
        if best:
            self.take_step(best)
            return best
        raise SolveError(f"no step is as accurate as asked for from t = {t:.9g} on", advice="Give a step, or rtol.")

    def _error(
        self, t: float, y: FloatArray, step: float, end: float, tolerances: FloatArray, relative: float
    ) -> float:
        """Return the largest error of the first steps, in units of the tolerances; infinite where there is none."""
        self.take_step(step)
        if not self.start(t, y):
            raise KernelEvaluationError(f"the equations have no value at t = {t:.9g}")
        here, worst = self._y.copy(), 0.0
        whole, half, other = np.empty((3, len(here)))
        for k in range(_LOOKED_AT):
            now = t + k * step
            if now >= end or worst > 1e3:
                break
            middle, short = now + 0.5 * step, 0.5 * step
            parts = ((now, step, here, whole), (now, short, here, half), (middle, short, half, other))
            for begin, length, source, target in parts:
                if self._call("trial", begin, length, source.ctypes.data, target.ctypes.data):
                    return np.inf
            ends = []
            for one in (whole, other):
                found = np.empty(self._size)
                if self._call("speeds", now + step, one.ctypes.data, found.ctypes.data):
                    return np.inf
                ends.append(found)
            allowed = tolerances + relative * np.abs(ends[1])
            worst = max(worst, float(np.max(np.abs(ends[0] - ends[1]) / allowed)))
            here = other.copy()
        return worst


@dataclass(frozen=True, eq=False)
class Hamiltonian:
    """Hamilton's equations, with what a run with equal steps was asked for.

    Attributes
    ----------
    name
        Of the scene.
    equations
        Program of (t, q, p), or of (t, q, p, u), with q' and p', and with the speeds where these are not q'.
    separated
        Returns the programs of the forces (t, q) and of the velocities p where H is T(p) + V(q, t); else None.
    speeds
        How many speeds there are.
    values
        Values of the parameters.
    momenta
        ``momenta(t, q, u)``: what p is there.
    sizes
        How large coordinates and momenta are in the scene.
    order, step
        What was asked for; None where that is to be chosen.
    compiled
        ``compiled(make, *key)``: a method as machine code, made at most once for all scenes of one structure.
    """

    name: str
    equations: Program
    separated: Callable[[], tuple[Program, Program] | None]
    speeds: int
    values: FloatArray
    momenta: Callable[[float, FloatArray, FloatArray], FloatArray]
    sizes: FloatArray
    order: int | None
    step: float | None
    compiled: Callable[..., Any]
