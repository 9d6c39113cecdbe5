"""The variational equations of a scene at many states of a motion at once.

Deviations ``z = (ds, du)`` of displacements and speeds from a motion move by ``z' = A(t) z``, with A the derivative of
the equations of motion along the motion (Hairer, Norsett and Wanner, Solving ODEs I, section I.14).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.late import dataclass
from atwood.simulation.dynamics.balance import solve_determined
from atwood.simulation.problem.not_compilable import find_not_compilable
from atwood.theory.linear.variations import LinearScene

__all__ = ["States", "VariationalEquations", "variational_equations"]


@dataclass(frozen=True, eq=False)
class States:
    """States of a motion in generalized coordinates, one column for each time.

    Attributes
    ----------
    time
        s, shape (states,).
    q, u
        Coordinates and speeds, shape (number, states); orientations are quaternions.
    """

    time: FloatArray
    q: FloatArray
    u: FloatArray

    def __len__(self) -> int:
        return len(self.time)

    def __getitem__(self, index: slice | NDArray[np.intp]) -> States:
        return States(self.time[index], self.q[:, index], self.u[:, index])


@dataclass(frozen=True, eq=False)
class VariationalEquations:
    """The variational equations at some states.

    Attributes
    ----------
    matrix
        A, shape (states, displacements and speeds, displacements and speeds).
    mass
        The mass matrix, shape (states, speeds, speeds).
    by_displacement
        The derivative of the independent constraints on positions by displacements, shape (states, rows,
        displacements).
    rate_by_displacement, rate_by_speed
        Of all independent constraints on velocities by displacements and speeds, shape (states, rows, displacements)
        and (states, rows, speeds).
    """

    matrix: FloatArray
    mass: FloatArray
    by_displacement: FloatArray
    rate_by_displacement: FloatArray
    rate_by_speed: FloatArray


def variational_equations(scene: LinearScene, kept: Sequence[int], states: States) -> VariationalEquations:
    """Return the variational equations at some states.

    Parameters
    ----------
    scene
        The scene, whose derivatives are those of its expression graph.
    kept
        Independent constraints.
    states
        Where they are wanted.

    Raises
    ------
    SolveError
        If the forces do not determine the accelerations at one of them.
    """
    e, rows = scene.equations, list(kept)
    n, m, count = len(e.speeds), len(rows), len(states)
    still = _Numbers(scene, states, np.zeros((n, count)), np.zeros((len(e.constraints), count)))
    mass = still.by("force", "a")
    matrix = np.zeros((count, n + m, n + m))
    matrix[:, :n, :n] = mass
    if m:
        matrix[:, :n, n:] = still.by("force", "multipliers")[:, :, rows]
        matrix[:, n:, :n] = still.by("second", "a")[:, rows]
    right = np.concatenate([still.values["force"].T, still.values["second"].T[:, rows]], axis=1)
    t = float(states.time[0])
    solved = solve_determined(matrix, -right, t)
    held = np.zeros((len(e.constraints), count))
    held[rows] = solved[:, n:].T
    now = _Numbers(scene, states, solved[:, :n].T, held)
    basis = scene.tangents.basis(states.q.T)

    def along(name: str) -> FloatArray:
        return np.concatenate([now.by(name, "q") @ basis, now.by(name, "u")], axis=2)

    moved = solve_determined(matrix, -np.concatenate([along("force"), along("second")[:, rows]], axis=1), t)
    moving = (scene.tangents.inverse(states.q.T) @ now.values["rates"].T[:, :, None])[:, :, 0]
    shift = scene.shift(states.q.T, basis, moving, along("rates"))
    holding = [i for i in rows if e.constraints[i].holonomic]
    return VariationalEquations(
        matrix=np.concatenate([shift, moved[:, :n]], axis=1),
        mass=mass,
        by_displacement=now.by("value", "q")[:, holding] @ basis,
        rate_by_displacement=now.by("rate", "q")[:, rows] @ basis,
        rate_by_speed=now.by("rate", "u")[:, rows],
    )


class _Numbers:
    """The groups of expressions of the equations at many states, and their derivatives.

    Parameters
    ----------
    scene, states
        Which scene, and where.
    a, held
        Accelerations and multipliers, shape (number, states).
    """

    def __init__(self, scene: LinearScene, states: States, a: FloatArray, held: FloatArray) -> None:
        program, assembly = scene.derivatives, scene.assembly
        in_python = find_not_compilable(assembly, program)
        kernel = assembly.kernel(program, vectorized=True) if in_python else assembly.columns(program)
        found = kernel(states.time[None, :], states.q, states.u, a, held)
        self._count = len(states)
        self._parts = {part.name: part for part in scene.parts}
        self.values = {group.name: np.asarray(x) for group, x in zip(program.outputs, found, strict=True)}

    def by(self, name: str, symbols: str) -> FloatArray:
        """Return the derivatives of a group as matrices, shape (states, rows, columns)."""
        part = self._parts[name]
        matrix = np.zeros((self._count, part.rows, part.columns[symbols]))
        place = part.places.get(symbols)
        if place is not None:
            matrix[:, list(place.rows), list(place.columns)] = self.values[f"{name} by {symbols}"].T
        return matrix
