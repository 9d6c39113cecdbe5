"""The balance of forces of a scene, and how its coordinates move with its speeds, as programs."""

from __future__ import annotations

from collections.abc import Collection
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from atwood.expr import Expression, OutputGroup, Program, SparseMatrix, jacobian, jvp, substitute
from atwood.forms.program import directions, is_too_long, rates_are_speeds, state_groups
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.dynamics.equations import Equations
from atwood.topology.orientation_coordinates import OrientationCoordinates


@dataclass(frozen=True)
class BalanceProgram:
    """The balance of forces ``M a + bias = G^T lambda``, ``G a + gamma = 0`` at a position and velocity.

    Attributes
    ----------
    program
        Program of (t, q, u) with the entries of M, bias, the constraints' values, rates and gamma, the entries of G,
        and the rates' part that is not linear in the speeds. M and G belong to the speeds. The value of a constraint
        on velocities alone is zero.
    mass_rows, mass_columns, jacobian_rows, jacobian_columns
        Where the entries of M and G are.
    speeds
        Number of speeds.
    constraints
        Number of constraints.
    holonomic
        Numbers of the constraints that hold positions.
    mass_product
        Where the mass matrix is full and too long to be written out: the program of (t, q, u, direction) with its
        product with a direction; `program` then has no entries of it.
    """

    program: Program
    mass_rows: NDArray[np.intp]
    mass_columns: NDArray[np.intp]
    jacobian_rows: NDArray[np.intp]
    jacobian_columns: NDArray[np.intp]
    speeds: int
    constraints: int
    holonomic: tuple[int, ...]
    mass_product: Program | None = None

    @cached_property
    def constraints_alone(self) -> Program:
        """The program of the constraints' values, slopes and drifts, without masses and forces.

        Positions are looked at without speeds, where a force in the direction of a velocity has no value.
        """
        groups = {group.name: group for group in self.program.outputs}
        outputs = tuple(groups[name] for name in ("value", "jacobian", "explicit_rate"))
        return replace(self.program, name=f"{self.program.name} of constraints", outputs=outputs)


@dataclass(frozen=True)
class RatesProgram:
    """How coordinates move with the speeds: ``q' = B(q, t) u + b(q, t)``; states of parts do not move with these.

    Attributes
    ----------
    program
        Program of (t, q, u) with the rates and the entries of B; None if the rates are the speeds.
    rows, columns
        Where the entries of B are.
    coordinates, speeds
        Number of coordinates and of speeds.
    orientation_coordinates
        Coordinates that stand for an orientation together.
    """

    program: Program | None
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    coordinates: int
    speeds: int
    orientation_coordinates: tuple[OrientationCoordinates, ...]


def balance_program(name: str, equations: Equations, parameters: Collection[Expression]) -> BalanceProgram:
    """Return the balance of forces of a set of equations."""
    at_rest, start = dict.fromkeys(equations.accelerations, 0.0), len(equations.graph)
    inputs, known = state_groups(equations), tuple(parameters)
    mass, product = SparseMatrix((), (), ()), None
    if equations.forest.form == "reduced" and is_too_long(equations.rows, equations.accelerations):
        along = directions(equations.accelerations)
        moved = jvp(list(equations.rows), dict(zip(equations.accelerations, along.symbols, strict=True)))
        groups = (*inputs, along)
        product = Program(f"{name} mass", groups, known, (OutputGroup("product", tuple(moved)),))
    else:
        mass = jacobian(list(equations.rows), list(equations.accelerations))
    rates = [one.rate for one in equations.constraints]
    values = [one.value for one in equations.constraints]
    constraint_jacobian = jacobian(rates, list(equations.speeds))
    still = dict.fromkeys(equations.speeds, 0.0)
    outputs = (
        OutputGroup("mass", tuple(mass.entries)),
        OutputGroup("bias", tuple(substitute(list(equations.rows), at_rest))),
        OutputGroup("value", tuple(equations.graph.zero if v is None else v for v in values)),
        OutputGroup("rate", tuple(rates)),
        OutputGroup("gamma", tuple(substitute([one.second for one in equations.constraints], at_rest))),
        OutputGroup("jacobian", tuple(constraint_jacobian.entries)),
        OutputGroup("explicit_rate", tuple(substitute(rates, still))),
    )
    equations.graph.forget(start)
    return BalanceProgram(
        Program(f"{name} balance", inputs, known, outputs),
        np.asarray(mass.rows, dtype=np.intp),
        np.asarray(mass.columns, dtype=np.intp),
        np.asarray(constraint_jacobian.rows, dtype=np.intp),
        np.asarray(constraint_jacobian.columns, dtype=np.intp),
        len(equations.speeds),
        len(equations.constraints),
        tuple(i for i, one in enumerate(equations.constraints) if one.holonomic),
        product,
    )


def rates_program(name: str, equations: Equations, parameters: Collection[Expression]) -> RatesProgram:
    """Return how the coordinates of a set of equations move with its speeds."""
    sizes = (len(equations.coordinates), len(equations.speeds))
    if rates_are_speeds(equations):
        everyone = np.arange(sizes[0], dtype=np.intp)
        return RatesProgram(None, everyone, everyone, *sizes, equations.orientation_coordinates)
    tangent = jacobian(list(equations.rates[: equations.placing]), list(equations.speeds))
    outputs = (OutputGroup("rates", equations.rates), OutputGroup("matrix", tuple(tangent.entries)))
    return RatesProgram(
        Program(f"{name} rates", state_groups(equations), tuple(parameters), outputs),
        np.asarray(tangent.rows, dtype=np.intp),
        np.asarray(tangent.columns, dtype=np.intp),
        *sizes,
        equations.orientation_coordinates,
    )
