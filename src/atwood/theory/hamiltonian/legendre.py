"""The Legendre transform of a scene in numbers: momenta, velocities, H and its derivatives, for scenes of any size.

With ``p = dL/dq'`` and ``H(q, p, t) = p q' - L`` (Goldstein, equations 8.2 and 8.15) the derivatives of H follow from
those of L at the same state, ``dH/dq = -dL/dq``, ``dH/dp = q'``, ``dH/dt = -dL/dt`` (equations 8.18 and 8.19). So
only L is differentiated, and nothing but a linear system is solved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError, SolveError
from atwood.expr import Expression, InputGroup, OutputGroup, Program, depends_on, jacobian, jvp, substitute, vjp
from atwood.forms.assembly import Assembly
from atwood.forms.kept import Key
from atwood.forms.lagrangian import Lagrangian
from atwood.theory.dynamics.functions import Function, Numbers, as_numbers, shape_of_states

__all__ = ["LegendreTransform"]

_PROGRAM: Key[Program] = Key("program of the Legendre transformation")

_NEWTON, _CONVERGED = 50, 1e-13
"""So many steps at most, and the change relative to the size of the velocities at which they end."""


class LegendreTransform:
    """The Legendre transform of a scene whose coordinates are free, as functions of numbers.

    States are arrays of n numbers, or of many states with a row each.

    Parameters
    ----------
    assembly
        The scene.
    found
        Its Lagrangian, in which every velocity is the derivative of a coordinate.
    """

    def __init__(self, assembly: Assembly, found: Lagrangian) -> None:
        self.assembly, self.lagrangian = assembly, found
        # Velocities may stand in another order than the coordinates of which they are the derivatives.
        places = [place for place in found.moves if place is not None]
        order = sorted(range(len(places)), key=places.__getitem__)
        self.velocity_symbols = tuple(found.velocities[k] for k in order)
        self.force_order = tuple(order)

    @property
    def size(self) -> int:
        """The number n of coordinates."""
        return len(self.lagrangian.coordinates)

    def momenta(self, q: Numbers, v: Numbers, t: float | None = None) -> FloatArray:
        """Return ``p = dL/dq'`` at coordinates and velocities."""
        return self._momenta(t, (q, v), None)

    def lagrange_function(self, q: Numbers, v: Numbers, t: float | None = None) -> FloatArray:
        """Return L, J; shape () or (states,)."""
        return self._value(t, (q, v), None)[..., 0]

    def forces(self, q: Numbers, v: Numbers, t: float | None = None) -> FloatArray:
        """Return the generalized forces that L does not give: loads, less the derivatives of the Rayleigh function."""
        return self._forces(t, (q, v), None)

    def energies(self, q: Numbers, v: Numbers, t: float | None = None) -> FloatArray:
        """Return T and V, J; shape (2,) or (states, 2)."""
        return self._energies(t, (q, v), None)

    def coordinate_gradient(self, q: Numbers, v: Numbers, t: float | None = None) -> FloatArray:
        """Return ``dL/dq`` at coordinates and velocities."""
        return self._slopes(t, (q, v), None)

    def time_derivative(self, q: Numbers, v: Numbers, t: float | None = None) -> FloatArray:
        """Return ``dL/dt`` at coordinates and velocities; shape () or (states,)."""
        return self._rate(t, (q, v), None)[..., 0]

    def mass_matrix(self, q: Numbers, v: Numbers = None, t: float | None = None) -> FloatArray:
        """Return ``d2L/dq'2``, shape (n, n), or (states, n, n); velocities where it depends on them."""
        n, name = self.size, self.assembly.flat.name
        coordinates = as_numbers(q, n, "q", name)
        still = np.zeros(n) if v is None else as_numbers(v, n, "v", name)
        if self.has_moving_mass:
            return self._hessian(t, (coordinates, np.broadcast_to(still, coordinates.shape)), None)
        shape = (*coordinates.shape[:-1], n, n)
        units = np.broadcast_to(np.eye(n), shape)
        columns = self._columns(t, (np.broadcast_to(coordinates[..., None, :], shape), units), None)
        return np.asarray(0.5 * (columns + np.swapaxes(columns, -1, -2)))

    def velocities(self, q: Numbers, p: Numbers, t: float | None = None) -> FloatArray:
        """Return the velocities with given momenta.

        Raises
        ------
        SolveError
            If the momenta do not determine them.
        """
        q, p = (as_numbers(one, self.size, letter, self.assembly.flat.name) for one, letter in ((q, "q"), (p, "p")))
        shape = (*shape_of_states((q, p), "qp", self.assembly.flat.name), self.size)
        q, p = np.broadcast_to(q, shape), np.broadcast_to(p, shape)
        v = np.zeros(q.shape)
        if not self.has_moving_mass:
            return self._solved(self.mass_matrix(q, t=t), p - self.momenta(q, v, t))
        for _ in range(_NEWTON):
            step = self._solved(self.mass_matrix(q, v, t), p - self.momenta(q, v, t))
            # Where a velocity has a bound, as that of light, a full step may lead beyond it: then a shorter one is.
            for _ in range(_NEWTON):
                tried = self._tried(q, v + step, t)
                if tried is not None:
                    break
                step = 0.5 * step
            v = v + step
            if np.all(np.abs(step) <= _CONVERGED * np.max(np.abs(v), axis=-1, keepdims=True)):
                return v
        raise SolveError("its momenta do not determine its velocities here", where=self.assembly.flat.name)

    def value(self, q: Numbers, p: Numbers, t: float | None = None) -> FloatArray:
        """Return H, J; shape () or (states,)."""
        v = self.velocities(q, p, t)
        return np.asarray(np.sum(np.asarray(p, dtype=float) * v, axis=-1) - self.lagrange_function(q, v, t))

    # -- programs -------------------------------------------------------------------------------------------------

    @cached_property
    def has_moving_mass(self) -> bool:
        """Whether L is not quadratic in the velocities."""
        return any(depends_on(one, self.velocity_symbols) for one in self._inertia)

    @cached_property
    def _inertia(self) -> list[Expression]:
        """The second derivatives of L along one direction of velocities, which tell whether they depend on these."""
        graph = self.lagrangian.graph
        along: dict[Expression, Expression | float] = {
            v: graph.symbol(f"direction:{v.name}") for v in self.velocity_symbols
        }
        return jvp(self.momentum_expressions, along)

    @cached_property
    def momentum_expressions(self) -> list[Expression]:
        """The momenta as expressions of coordinates and velocities, in the order of the coordinates."""
        found = self.lagrangian
        return vjp([found.lagrangian], [found.graph.one], list(self.velocity_symbols))

    def _function(self, name: str, expressions: Callable[[], Sequence[Expression]], shape: tuple[int, ...]) -> Function:
        found = self.lagrangian
        inputs = (
            InputGroup("t", (found.time,)),
            InputGroup("q", found.coordinates),
            InputGroup("v", self.velocity_symbols),
        )

        def make() -> Program:
            outputs = (OutputGroup(name, tuple(expressions())),)
            return Program(f"{self.assembly.flat.name} {name}", inputs, self.assembly.parameters, outputs)

        program = self.assembly.shared.get(_PROGRAM, make, self.assembly.orientation.kind, name)
        return Function(self.assembly, program, shape)

    @cached_property
    def _momenta(self) -> Function:
        return self._function("momenta", lambda: self.momentum_expressions, (self.size,))

    @cached_property
    def _value(self) -> Function:
        return self._function("Lagrangian", lambda: [self.lagrangian.lagrangian], (1,))

    @cached_property
    def _energies(self) -> Function:
        return self._function("energies", lambda: [self.lagrangian.kinetic, self.lagrangian.potential], (2,))

    @cached_property
    def _slopes(self) -> Function:
        found = self.lagrangian
        return self._function(
            "dL/dq", lambda: vjp([found.lagrangian], [found.graph.one], list(found.coordinates)), (self.size,)
        )

    @cached_property
    def _rate(self) -> Function:
        return self._function("dL/dt", lambda: jvp([self.lagrangian.lagrangian], {self.lagrangian.time: 1.0}), (1,))

    @cached_property
    def _forces(self) -> Function:
        return self._function("other forces", lambda: self.force_expressions, (self.size,))

    @cached_property
    def force_expressions(self) -> tuple[Expression, ...]:
        """The forces of `forces`, as expressions."""
        found = self.lagrangian
        losses = vjp([found.rayleigh], [found.graph.one], list(self.velocity_symbols))
        return tuple(found.forces[k] - loss for k, loss in zip(self.force_order, losses, strict=True))

    @cached_property
    def _columns(self) -> Function:
        """The product of the mass matrix with a direction, which stands in the place of the velocities."""
        graph = self.lagrangian.graph
        back: dict[Expression, Expression | float] = {
            graph.symbol(f"direction:{v.name}"): v for v in self.velocity_symbols
        }
        return self._function("columns", lambda: substitute(self._inertia, back), (self.size,))

    @cached_property
    def _hessian(self) -> Function:
        n, graph = self.size, self.lagrangian.graph

        def entries() -> list[Expression]:
            found = jacobian(self.momentum_expressions, list(self.velocity_symbols))
            values = [graph.zero] * (n * n)
            for row, column, entry in zip(found.rows, found.columns, found.entries, strict=True):
                values[row * n + column] = entry
            return values

        return self._function("mass matrix", entries, (n, n))

    # -- numbers --------------------------------------------------------------------------------------------------

    def _tried(self, q: FloatArray, v: FloatArray, t: float | None) -> FloatArray | None:
        """Return the momenta at velocities, None where there are none."""
        try:
            return self.momenta(q, v, t)
        except KernelEvaluationError:
            return None

    def _solved(self, mass: FloatArray, right: FloatArray) -> FloatArray:
        try:
            found = np.linalg.solve(mass, right[..., None])[..., 0]
        except np.linalg.LinAlgError:
            found = np.full(right.shape, np.nan)
        if not np.all(np.isfinite(found)):
            raise SolveError(
                "its mass matrix is singular at this place, so that momenta do not determine velocities",
                where=self.assembly.flat.name,
                advice="The coordinates are singular there, as angles at a pole are; take another place.",
            )
        return np.asarray(found)
