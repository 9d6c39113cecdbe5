"""A stretch of a run and its steps taken back, in machine code; see `atwood.study.sensitivities.backward`."""

from __future__ import annotations

import ctypes
from ctypes import c_int, c_int64, c_void_p

import numpy as np

from atwood.arrays import FloatArray, IndexArray
from atwood.codegen.llvm.build import build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.errors import SolveError
from atwood.expr import Expression, InputGroup, OutputGroup, Program, depends_on, vjp
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.program import state_groups
from atwood.forms.quantities import coordinate_program
from atwood.integrators.protocol import StepGuard
from atwood.lazy_dataclasses import dataclass
from atwood.study.sensitivities.augmented import Augmented
from atwood.study.sensitivities.backward import HEAD, backward_source, room_of

_PULLED: Key[_Code] = Key("a motion and its steps taken back")
_READ: Key[Program] = Key("quantities with their gradients")

_AHEAD = ctypes.CFUNCTYPE(c_int, c_int64, *[c_void_p] * 6)
_BACK = ctypes.CFUNCTYPE(c_int, c_int64, *[c_void_p] * 9)


def _cotangents(program: Program, outputs: list[Expression], name: str, wrt: tuple[Expression, ...]) -> Program:
    """Return a program of (t, q, u, cotangents) with those of q, u and parameters."""
    graph, groups = program.graph, program.inputs
    state = (*groups[1].symbols, *groups[2].symbols)
    weights = tuple(graph.symbol(f"cotangent {k} of {name}") for k in range(len(outputs)))
    found = vjp(outputs, weights, [*state, *wrt])
    n = len(state)
    results = OutputGroup("state", tuple(found[:n])), OutputGroup("parameters", tuple(found[n:]))
    return Program(name, (*groups, InputGroup("cotangents", weights)), program.parameters, results)


class _Code:
    """Machine code of a motion and its steps taken back, for any values of parameters."""

    def __init__(self, augmented: Augmented, parameters: tuple[Expression, ...]) -> None:
        program, projection = augmented.plain.accelerations, augmented.plain.projection
        _, q, u = (group.symbols for group in program.inputs)
        given = len(program.outputs) == 2
        results = [e for group in program.outputs for e in group.expressions]
        rates = results if given else [*u, *results]
        nearer = [] if projection is None else [e for group in projection.outputs[:2] for e in group.expressions]
        self.wrt = tuple(one for one in parameters if depends_on([*rates, *nearer], [one]))
        self.programs = {"kernel": program, "pull": _cotangents(program, rates, "rates taken back", self.wrt)}
        if projection is not None:
            pulled = _cotangents(projection, nearer, "projection taken back", self.wrt)
            self.programs |= {"nearer": projection, "pull_nearer": pulled}
        self.numbers = [k for k, one in enumerate(parameters) if one in set(self.wrt)]
        parts = [Part(name, one) for name, one in self.programs.items()]
        routines = backward_source(len(q), len(u), given, projection is not None, len(self.wrt))
        exports = ["record", "ahead", "back"]
        self.built = build_code(parts, default_options(parts), exports=exports, routines=routines)
        self.room = room_of(len(q), len(u), len(self.wrt))


@dataclass(frozen=True, eq=False)
class Recorded:
    """The steps of a stretch, and its output times.

    Attributes
    ----------
    times, states
        Where each step begins, and the state there.
    outputs
        Output times, of which the last is the end, and which step each is within.
    within
        The numbers of these steps.
    ends
        The states at the output times.
    """

    times: FloatArray
    states: FloatArray
    outputs: FloatArray
    within: IndexArray
    ends: FloatArray


class Pulled:
    """What integrates a scene in one mode, and takes cotangents back.

    Parameters
    ----------
    augmented
        The same without derivatives.
    """

    def __init__(self, augmented: Augmented) -> None:
        assembly = augmented.plan.assembly
        self.augmented, parameters = augmented, tuple(assembly.parameters)
        plain = augmented.plain
        about = plain.accelerations, plain.projection
        self.code = assembly.shared.get(_PULLED, lambda: _Code(augmented, parameters), *about)
        values, self._keep = augmented.values, []
        scratch = np.empty(self.code.built.scratch)
        self._data = np.zeros(HEAD, dtype=np.uint64)
        for place, name in enumerate(("kernel", "nearer", "pull", "pull_nearer")):
            if name in self.code.programs:
                derived, _ = self.code.built.derive(name, self.code.programs[name], values)
                self._keep.append(derived)
                self._data[place] = derived.ctypes.data
        self._data[HEAD - 1] = scratch.ctypes.data
        self._work = np.empty(self.code.room)
        self._keep.append(scratch)

    def run(
        self, t: float, y: FloatArray, times: FloatArray, rtol: float, max_steps: int | None, room: int
    ) -> Recorded:
        """Integrate over some times, of which the last is the end; `room` is for the steps that it may take."""
        n = len(y)
        while True:
            begins, states = np.empty(room), np.empty((room, n))
            data = np.array([0, room, begins.ctypes.data, states.ctypes.data], dtype=np.int64)
            address = self.code.built.code.addresses["record"]
            guard = StepGuard(address, data.ctypes.data, _never, (self.code.built, data, begins, states))
            self.augmented.steps_of(t, y, times[-1:], rtol, max_steps, guard)
            count = int(data[0])
            if count <= room:
                break
            room = count
        begins, states = begins[:count].copy(), states[:count].copy()
        within = np.searchsorted(begins, times, side="left") - 1
        ends = np.empty((len(times), n))
        steps, rows = times - begins[within], np.ascontiguousarray(states[within])
        call, from_ = _AHEAD(self.code.built.code.addresses["ahead"]), np.ascontiguousarray(begins[within])
        if call(len(times), *(one.ctypes.data for one in (from_, steps, rows, ends, self._work, self._data))) != 0:
            raise SolveError("a step has no finite value", where=self.augmented.plan.assembly.flat.name)
        return Recorded(begins, states, times, within, ends)

    def back(self, made: Recorded, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the cotangents of the state at the begin, and of the parameters.

        Parameters
        ----------
        made
            The stretch.
        weights
            Cotangents of the states at its output times, shape (outputs, n).
        """
        used = np.flatnonzero(np.any(weights != 0.0, axis=1))
        n, parameters = weights.shape[1], self.augmented.plan.assembly.parameters
        adjoint, gradient = np.zeros(n), np.zeros(len(self.code.wrt))
        last = int(made.within[used[-1]]) if len(used) else 0
        # From the last step to the first: outputs that begin with its state, and then the step that leads there.
        keys = np.concatenate([2 * made.within[used] + 1, 2 * np.arange(1, last + 1)])
        order = np.argsort(-keys, kind="stable")
        rows = np.concatenate([made.within[used], np.arange(last)])[order]
        places = np.concatenate([used, np.full(last, -1)])[order]
        spans = np.concatenate([made.outputs[used] - made.times[made.within[used]], np.diff(made.times[: last + 1])])
        lines = np.ascontiguousarray(np.array([rows, places], dtype=np.int64).T)
        times, steps = made.times[rows], spans[order]
        given = (times, steps, lines, made.states, np.ascontiguousarray(weights), adjoint, gradient)
        call = _BACK(self.code.built.code.addresses["back"])
        if call(len(rows), *(one.ctypes.data for one in (*given, self._work, self._data))) != 0:
            raise SolveError("a derivative has no finite value", where=self.augmented.plan.assembly.flat.name)
        every = np.zeros(len(parameters))
        every[self.code.numbers] = gradient
        return adjoint, every

    def tangent(self, t: float, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what a step onto the constraints does to changes of a state on them, and to those of parameters."""
        n, plan = len(y), self.augmented.plan
        slopes = np.zeros((n, len(plan.assembly.parameters)))
        if "pull_nearer" not in self.code.programs:
            return np.eye(n), slopes
        kernel = plan.assembly.compiled(self.code.programs["pull_nearer"], vectorized=True).bind(self.augmented.values)
        q, u = np.split(np.repeat(y[:, None], n, axis=1), [self.augmented.split[0]])
        found, own = kernel(np.full((1, n), t), q, u, np.eye(n))
        slopes[:, self.code.numbers] = np.broadcast_to(own, (len(self.code.wrt), n)).T
        return np.broadcast_to(found, (n, n)).T.copy(), slopes


def _never(*_: object) -> bool:
    raise NotImplementedError  # steps call machine code alone


def read(assembly: Assembly, expressions: tuple[Expression, ...]) -> Program:
    """Return a program of (t, q, u, weights): values, and gradients of their weighted sum by state and parameters."""

    def make() -> Program:
        groups, graph = state_groups(assembly.own_equations), assembly.own_equations.graph
        weights = tuple(graph.symbol(f"weight {k}") for k in range(len(expressions)))
        state = [symbol for one in groups[1:] for symbol in one.symbols]
        found = vjp(expressions, weights, [*state, *assembly.parameters])
        own = {"values": expressions, "state": found[: len(state)], "parameters": found[len(state) :]}
        return coordinate_program(assembly, "gradients", assembly.own_equations, own, weights=weights)

    return assembly.shared.get(_READ, make, expressions)
