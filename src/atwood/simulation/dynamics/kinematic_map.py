"""Coordinates that are not integrals of speeds: how they move with the speeds, in numbers.

Most coordinates have a speed of their own. Orientations in space have three speeds and four coordinates, whose common
factor means nothing. What is small or near is therefore measured along the speeds: a displacement is what the speeds
would do in a unit of time.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from atwood.arrays import BoolArray, FloatArray
from atwood.codegen import BoundKernel
from atwood.expr import Program
from atwood.forms.assembly import Assembly, Coordinates
from atwood.forms.balance_program import RatesProgram
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.kinematics.orientation import quaternion_product
from atwood.numerics.matrices import Matrix, from_entries, is_full, least_squares, to_array
from atwood.numerics.sparse import csr_of


class KinematicMap:
    """How the coordinates of one form move: ``q' = B u + b``.

    Parameters
    ----------
    program
        The rates as a program.
    kernel
        Gives the same, ready to run on one state or, vectorized, on many.
    """

    def __init__(self, program: RatesProgram, kernel: Callable[[Program, bool], BoundKernel]) -> None:
        self.program, self._kernel = program, kernel
        self._last: tuple[tuple[float, bytes] | None, Matrix] = (None, np.zeros((0, 0)))
        homogeneous = [orientation for orientation in program.orientation_coordinates if orientation.is_homogeneous]
        self._homogeneous = [np.asarray(orientation.coordinates, dtype=np.intp) for orientation in homogeneous]
        self._kinds = [orientation.kind for orientation in homogeneous]
        # Those with equally many coordinates are worked on together, shape (orientations, coordinates).
        counts = sorted({len(one) for one in self._homogeneous})
        self._alike = [np.array([one for one in self._homogeneous if len(one) == count]) for count in counts]

    @property
    def is_plain(self) -> bool:
        """Whether the rates are the speeds."""
        return self.program.program is None

    @property
    def has_homogeneous(self) -> bool:
        """Whether there are coordinates whose size means nothing."""
        return bool(self._homogeneous)

    @property
    def has_singular_coordinates(self) -> bool:
        """Whether there are orientation coordinates that are singular somewhere, and are switched before."""
        return not all(orientation.is_homogeneous for orientation in self.program.orientation_coordinates)

    def rates(self, t: float, q: FloatArray, u: FloatArray) -> FloatArray:
        """Return the derivatives of the coordinates."""
        program = self.program.program
        return u if program is None else np.asarray(self._kernel(program, False)([t], q, u)[0], dtype=float)

    def rates_each(self, t: FloatArray, q: FloatArray, u: FloatArray) -> FloatArray:
        """Do the same for many states, of shape (states,) and (number, states)."""
        program = self.program.program
        return u if program is None else np.asarray(self._kernel(program, True)(t[None, :], q, u)[0])

    def matrix(self, t: float, q: FloatArray) -> Matrix:
        """Return B, of shape (coordinates, speeds): not to be changed, since the last one is known."""
        made, key = self.program, (t, q.tobytes())
        if made.program is None:
            return np.eye(len(q))
        if self._last[0] != key:
            entries = self._kernel(made.program, False)([t], q, np.zeros(made.speeds))[1]
            self._last = key, from_entries(made.rows, made.columns, entries, (made.coordinates, made.speeds))
        return self._last[1]

    def reach(self, t: float, q: FloatArray) -> Matrix:
        """Return B with each coordinate of an orientation moved as any of them: whichever shows it, all of it turns."""
        matrix = self.matrix(t, q).copy()
        orientations = [list(one.coordinates) for one in self.program.orientation_coordinates]
        if is_full(matrix):
            for one in orientations:
                matrix[one] = np.max(np.abs(matrix[one]), axis=0)
            return matrix
        count = matrix.shape[0]
        first = np.arange(count)
        for one in orientations:
            first[one] = one[0]
        return (csr_of(first, np.arange(count), np.ones(count), (count, count)) @ abs(matrix))[first]

    def moved(self, t: float, q: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return coordinates after a small displacement along the speeds; exact to its first order."""
        if self.is_plain:
            return q + displacement
        return self.normalized(q + self.matrix(t, q) @ displacement)

    def moved_each(self, t: FloatArray, q: FloatArray, displacements: FloatArray) -> FloatArray:
        """Do the same for many states, of shape (states,) and (number, states)."""
        made = self.program
        if made.program is None:
            return q + displacements
        entries = self._kernel(made.program, True)(t[None, :], q, np.zeros_like(displacements))[1]
        matrix = np.zeros((len(t), made.coordinates, made.speeds))
        matrix[:, made.rows, made.columns] = entries.T
        return self.normalized(q + np.einsum("sij,js->is", matrix, displacements))

    def difference(self, t: float, q: FloatArray, other: FloatArray) -> FloatArray:
        """Return the displacement that leads from one place to another near by, exact to its first order."""
        if self.is_plain:
            return other - q
        target = other.copy()
        for orientation, kind in zip(self._homogeneous, self._kinds, strict=True):
            target[orientation] *= float(np.linalg.norm(q[orientation])) / float(np.linalg.norm(other[orientation]))
            if (
                kind == "quaternion" and q[orientation] @ other[orientation] < 0.0
            ):  # either sign is the same orientation
                target[orientation] *= -1.0
        return least_squares(to_array(self.matrix(t, q)), target - q)

    def normalized(self, q: FloatArray) -> FloatArray:
        """Return coordinates with orientations of size one: one state, or many of shape (coordinates, samples)."""
        if not self._homogeneous:
            return q
        q = np.array(q, dtype=float)
        for alike in self._alike:
            found = q[alike]
            q[alike] = found / np.sqrt(np.sum(found**2, axis=1))[:, None]
        return q

    def needs_normalization(self, q: FloatArray) -> BoolArray:
        """Return whether the size of an orientation has gone far from one, where tolerances mean something else.

        Of one state, or of each of many of shape (coordinates, states).
        """
        squares = np.concatenate([np.sum(q[alike] ** 2, axis=1) for alike in self._alike or [np.zeros((0, 1), int)]])
        return np.asarray(~((squares > 0.25) & (squares < 4.0)).all(axis=0))


def reference_coordinates(equations: Equations) -> FloatArray:
    """Return coordinates of zero, with orientations that are not turned."""
    q = np.zeros(len(equations.coordinates))
    for orientation in equations.orientation_coordinates:
        q[list(orientation.coordinates)] = orientation.reference
    return q


def best_rough_orientation(equations: Equations, far_off: Callable[[FloatArray], float], q: FloatArray) -> FloatArray:
    """Return coordinates with each orientation the best of some that cover all of them evenly."""
    best, least = q, far_off(q)
    for orientation in equations.orientation_coordinates:
        if orientation.kind != "quaternion" or least == 0.0:
            continue
        start = best
        for candidate in orientations():
            trial = start.copy()
            trial[list(orientation.coordinates)] = candidate
            size = far_off(trial)
            if size < 0.999 * least:
                best, least = trial, size
    return best


@cache
def orientations() -> tuple[tuple[float, ...], ...]:
    """Return quaternions that cover all orientations: the 24 turns of a cube, each also turned a little askew."""
    square = [tuple(1.0 if i == k else 0.0 for i in range(4)) for k in range(4)]
    halves = [(0.5, a, b, c) for a in (0.5, -0.5) for b in (0.5, -0.5) for c in (0.5, -0.5)]
    r = 0.5**0.5
    edges = [
        tuple(r if i == a else sign * r if i == b else 0.0 for i in range(4))
        for a in range(4)
        for b in range(a + 1, 4)
        for sign in (1.0, -1.0)
    ]
    cube = np.array([*square, *halves, *edges])
    askew = np.array([0.95, 0.21, 0.15, 0.17]) / np.linalg.norm([0.95, 0.21, 0.15, 0.17])
    turned = np.stack(quaternion_product([*cube.T], [*askew]), axis=1)
    return tuple(tuple(float(value) for value in row) for row in (*cube, *turned))


def kinematic_map_of(assembly: Assembly, form: Coordinates) -> KinematicMap:
    """Return how the coordinates of a scene move."""
    return KinematicMap(assembly.rates(form), assembly.kernel)
