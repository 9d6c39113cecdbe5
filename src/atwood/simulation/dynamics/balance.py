"""Numbers from the balance of forces: accelerations and multipliers, projection, rank, and columns of full matrices."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen import BoundKernel
from atwood.errors import SolveError
from atwood.forms.accelerations import accelerations_of, is_tree
from atwood.forms.assembly import Assembly, FormName
from atwood.forms.balance_program import BalanceProgram
from atwood.forms.caches import Key
from atwood.forms.loose import balance_now
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.matrices import (
    LARGEST_FULL,
    Matrix,
    from_entries,
    is_best_full,
    is_full,
    least_norm,
    scaled,
    solve_even,
    to_array,
)
from atwood.numerics.newton import Missing, newton
from atwood.numerics.rank import row_scales
from atwood.numerics.sparse import solve_bordered
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.rounding import RowErrors
from atwood.tolerances import tolerances


@dataclass(frozen=True)
class BalanceValues:
    """The balance ``M a + bias = G^T lambda``, ``G a + gamma = 0`` at one state, along the speeds.

    Attributes
    ----------
    inertia
        Mass matrix M, shape (speeds, speeds), or what gives it where it is large and full.
    bias
        Forces that do not depend on accelerations, with the sign of inertia, shape (speeds,).
    value
        Constraints on positions g, shape (constraints,); 0 for those on velocities alone.
    rate
        Constraints on velocities ``G u + g_t``, shape (constraints,).
    gamma
        What the second derivative of the constraints has besides ``G a``, shape (constraints,).
    jacobian
        Constraint Jacobian G along the speeds, shape (constraints, speeds).
    explicit_rate
        Explicit time part g_t of the velocity constraints, shape (constraints,).
    """

    inertia: Matrix | Callable[[], Matrix]
    bias: FloatArray
    value: FloatArray
    rate: FloatArray
    gamma: FloatArray
    jacobian: Matrix
    explicit_rate: FloatArray

    @cached_property
    def mass(self) -> Matrix:
        """The mass matrix."""
        return self.inertia() if callable(self.inertia) else self.inertia


@dataclass(frozen=True)
class ConstraintValues:
    """The constraints at one state: values g, Jacobian G along the speeds, and explicit time part g_t of the rates."""

    value: FloatArray
    jacobian: Matrix
    explicit_rate: FloatArray


class Balance:
    """The balance of forces of a scene in the coordinates of either form, written down when it is first asked for.

    Attributes
    ----------
    kinematic_map
        How the coordinates move with the speeds.
    constraints
        Number of constraints.
    holonomic
        Numbers of those that hold positions.
    """

    def __init__(self, assembly: Assembly, form: FormName) -> None:
        self._assembly, self._form = assembly, form
        self._laws = assembly.in_coordinates(form).constraints
        self.kinematic_map, self.constraints = kinematic_map_of(assembly, form), len(self._laws)
        self.holonomic = np.array([i for i, one in enumerate(self._laws) if one.holonomic], dtype=np.intp)
        self._all = len(self.holonomic) == self.constraints

    @cached_property
    def program(self) -> BalanceProgram:
        """The program, as it is in the present states."""
        return balance_now(self._assembly, self._form)

    @cached_property
    def errors(self) -> RowErrors:
        """How far rounding can take the constraint Jacobian."""
        program = self.program
        places, laws = (program.jacobian_rows, program.jacobian_columns), [one.key[:2] for one in self._laws]
        groups = ("value", "jacobian", "explicit_rate")
        return RowErrors(self._assembly, program.constraints_alone, groups, laws, places, self.kinematic_map)

    @property
    def formulas(self) -> BoundKernel | None:
        """What gives accelerations where a mass matrix is better never made, and formulas without contacts do."""
        assembly = self._assembly
        found = accelerations_of(assembly) if is_wide(assembly, self._form) and not assembly.reduced.contacts else None
        return None if found is None else assembly.kernel(found.program)

    def at(self, t: float, q: FloatArray, u: FloatArray) -> BalanceValues:
        """Return the balance at a state."""
        p = self.program
        mass, bias, value, rate, gamma, entries, explicit_rate = self._assembly.kernel(p.program)([t], q, u)
        full = p.mass_product is not None or is_best_full((p.speeds, p.speeds), len(mass))
        matrix: Any
        if p.mass_product is not None:
            matrix = partial(mass_at, self._assembly, self._form, t, q, u)
        else:
            matrix = from_entries(p.mass_rows, p.mass_columns, mass, (p.speeds, p.speeds), full)
        jacobian = from_entries(p.jacobian_rows, p.jacobian_columns, entries, (p.constraints, p.speeds), full)
        parts = (np.asarray(x, dtype=float) for x in (bias, value, rate, gamma))
        b, v, r, g = parts
        return BalanceValues(matrix, b, v, r, g, jacobian, np.asarray(explicit_rate, dtype=float))

    def constraints_at(self, t: float, q: FloatArray, u: FloatArray) -> ConstraintValues:
        """Return the constraints at a state."""
        p = self.program
        value, entries, explicit_rate = self._assembly.kernel(p.constraints_alone)([t], q, u)
        full = p.mass_product is not None or is_best_full((p.speeds, p.speeds), len(p.mass_rows))
        matrix = from_entries(p.jacobian_rows, p.jacobian_columns, entries, (p.constraints, p.speeds), full)
        return ConstraintValues(np.asarray(value, dtype=float), matrix, np.asarray(explicit_rate, dtype=float))

    def accelerate(
        self,
        t: float,
        q: FloatArray,
        u: FloatArray,
        kept: NDArray[np.intp] | None = None,
        now: BalanceValues | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Return accelerations and multipliers; `now` is the balance there, if it is known."""
        kernel = self.formulas
        if kernel is not None:
            return np.asarray(kernel([t], q, u)[-1], dtype=float), np.zeros(0)
        return solve_balance(self.at(t, q, u) if now is None else now, kept, t)

    def project(
        self, t: float, q: FloatArray, u: FloatArray, scales: FloatArray, iterations: int = 12
    ) -> tuple[FloatArray, FloatArray]:
        """Return the nearest state that fulfils the constraints on position and velocity.

        Orientations come out with coordinates of size one.
        """
        q = self.kinematic_map.normalized(q)
        if not self.constraints:
            return q, u
        errors = self.errors.near(t, q, scales)
        on_positions = errors if self._all else errors[self.holonomic]

        def look(place: FloatArray) -> Missing:
            jacobian, value = self.on_positions(self.constraints_at(t, place, np.zeros_like(u)))
            rows = row_scales(jacobian, scales, on_positions)
            return Missing(value, rows, lambda: jacobian, self.errors.shared(rows, self.holonomic))

        if len(self.holonomic):
            moved = partial(self.kinematic_map.moved, t)
            q, _ = newton(look, moved, q, scales, steps=iterations, met=tolerances.MET, is_even=True)
        now = self.constraints_at(t, q, u)
        rows = row_scales(now.jacobian, scales, errors)
        for _ in range(2):  # the second pass takes out the rounding of the first
            rate = now.jacobian @ u + now.explicit_rate
            u = u - scales * least_norm(scaled(now.jacobian, scales, rows), rate / rows, 1.0)
        return q, u

    def on_positions(self, now: ConstraintValues) -> tuple[FloatArray, FloatArray]:
        """Return Jacobian and values of the constraints on positions."""
        if self._all:
            return now.jacobian, now.value
        return now.jacobian[self.holonomic], now.value[self.holonomic]

    def row_scales(
        self, now: BalanceValues | ConstraintValues, t: float, q: FloatArray, scales: FloatArray
    ) -> FloatArray:
        """Return the size of each constraint at a place; see `atwood.numerics.rank.row_scales`."""
        return row_scales(now.jacobian, scales, self.errors.near(t, q, scales))

    def holding(self, chosen: Sequence[int]) -> list[int]:
        """Return which of some constraints hold positions."""
        return [i for i in chosen if self._all or i in self.holonomic]

    def misses(self, t: float, q: FloatArray, u: FloatArray, scales: FloatArray) -> tuple[float, float]:
        """Return by how much a state misses the constraints on position and on velocity, relative to the scales."""
        if not self.constraints:
            return 0.0, 0.0
        now = self.constraints_at(t, q, u)
        rows, rate = self.row_scales(now, t, q, scales), now.jacobian @ u + now.explicit_rate
        return float(np.max(np.abs(now.value / rows))), float(np.max(np.abs(rate / rows)))


def balance_of(assembly: Assembly, form: FormName) -> Balance:
    """Return the balance of forces of a scene in the coordinates of either form."""
    return assembly.kept.get(_BALANCES[form], lambda: Balance(assembly, form))


def is_wide(assembly: Assembly, form: FormName) -> bool:
    """Return whether a mass matrix is better never made: one of a large tree, or that is large and full."""
    if form != "reduced" or len(assembly.reduced.speeds) <= LARGEST_FULL:
        return False
    return is_tree(assembly) or balance_now(assembly, form).mass_product is not None


def solve_balance(now: BalanceValues, kept: NDArray[np.intp] | None, t: float) -> tuple[FloatArray, FloatArray]:
    """Return accelerations and multipliers of a balance; see `Balance.accelerate`."""
    n = len(now.bias)
    jacobian = now.jacobian if kept is None else now.jacobian[kept]
    gamma = now.gamma if kept is None else now.gamma[kept]
    if not is_full(now.mass):
        solved = solve_bordered(now.mass, jacobian, now.bias, gamma)
        if solved is None:
            raise _undetermined(t)
        return solved
    solution = solve_determined(bordered(now.mass, jacobian), np.concatenate([-now.bias, -gamma]), t)
    return solution[:n], solution[n:]


def bordered(mass: FloatArray, jacobian: FloatArray) -> FloatArray:
    """Return the matrix of balances of forces, for accelerations and then multipliers, of one state or of many."""
    n, m = mass.shape[-1], jacobian.shape[-2]
    matrix = np.zeros((*mass.shape[:-2], n + m, n + m))
    matrix[..., :n, :n] = mass
    matrix[..., :n, n:] = -np.swapaxes(jacobian, -1, -2)
    matrix[..., n:, :n] = jacobian
    return matrix


_BALANCES: dict[FormName, Key[Balance]] = {"reduced": Key("reduced balance"), "dae": Key("balance of the dae form")}

LIGHT = 1e-12
"""A body that is lighter than the heaviest one by more is rounding of its mass matrix."""


def even_balance(now: BalanceValues, sizes: FloatArray, rows: FloatArray) -> tuple[FloatArray, float]:
    """Return the same matrix in displacements of the scene's size, with masses as shares of the largest, which follows.

    Solved by least norm up to `LIGHT`, what is small beside the rest is small in truth, and not in its unit.
    """
    mass = sizes[:, None] * to_array(now.mass) * sizes
    unit = float(np.max(np.abs(mass), initial=0.0)) or 1.0
    return bordered(mass / unit, to_array(scaled(now.jacobian, sizes, rows))), unit


def solve_determined(matrix: FloatArray, right: FloatArray, t: float) -> FloatArray:
    """Solve a balance of forces; see `solve_even`."""
    try:
        solution = solve_even(matrix, right)
    except np.linalg.LinAlgError:
        raise _undetermined(t) from None
    if not np.all(np.isfinite(solution)):
        raise _undetermined(t)
    return solution


def _undetermined(t: float) -> SolveError:
    return SolveError(
        f"at t = {t:.6g} the forces do not determine the accelerations",
        advice="Something without mass is free to move here, or the mechanism is in a singular position.",
    )


_CHUNK = 128
"""Columns that are worked on at once."""


def columns_of(kernel: BoundKernel, size: int, *groups: Any) -> FloatArray:
    """Return the matrix of which a program gives the product with a direction, its last input."""
    state = [np.asarray(group, dtype=float)[:, None] for group in groups]
    found = np.empty((size, size))
    for i in range(0, size, _CHUNK):
        found[:, i : i + _CHUNK] = kernel(*state, np.eye(size, min(_CHUNK, size - i), -i))[0]
    return found


def mass_at(assembly: Assembly, form: FormName, t: float, q: FloatArray, u: FloatArray) -> FloatArray:
    """Return a mass matrix that is not written out, at one state."""
    program = balance_now(assembly, form)
    assert program.mass_product is not None
    return columns_of(assembly.kernel(program.mass_product, vectorized=True), program.speeds, [t], q, u)


def masses_at(assembly: Assembly, t: FloatArray, q: FloatArray, u: FloatArray, values: FloatArray) -> FloatArray:
    """Return mass matrices in generalized coordinates that are not written out, shape (states, number, number)."""
    program = assembly.balance("reduced")
    assert program.mass_product is not None
    code = assembly.compiled(program.mass_product, vectorized=True)
    times = np.broadcast_to(np.ravel(t), (len(q),))
    found = np.empty((len(q), program.speeds, program.speeds))
    for i in range(len(q)):
        kernel = code.bind(values if values.ndim == 1 else values[:, i])
        found[i] = columns_of(kernel, program.speeds, times[i : i + 1], q[i], u[i])
    return found
