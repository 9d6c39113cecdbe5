"""Small displacements of a configuration: along each coordinate, and as rotations where coordinates are orientations.

The tangent of a quaternion is the small rotation of the body in its own axes, so that three numbers stand for it and
its size, which means nothing, does not appear. ``dq = N(q) ds`` with N block by block; N is linear in q.
"""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.late import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.topology.orientation_coordinates import OrientationCoordinates

__all__ = ["Tangents", "find_tangents"]


@dataclass(frozen=True)
class Tangents:
    """The displacements of a configuration.

    Attributes
    ----------
    coordinates
        Number of coordinates.
    names, units
        Of each displacement: the coordinate's name, or that of a small rotation, such as ``body.rotation.x``.
    plain
        For each coordinate that is displaced by itself: its number, and that of the displacement.
    orientation_coordinates
        The orientations, each with the numbers of its displacements.
    """

    coordinates: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    plain: tuple[tuple[int, int], ...]
    orientation_coordinates: tuple[tuple[OrientationCoordinates, tuple[int, ...]], ...]

    def __len__(self) -> int:
        return len(self.names)

    def basis(self, q: FloatArray) -> FloatArray:
        """Return N(q), shape (..., coordinates, displacements) for coordinates of shape (..., coordinates)."""
        found = np.zeros((*q.shape[:-1], self.coordinates, len(self)))
        for i, k in self.plain:
            found[..., i, k] = 1.0
        for orientation, numbers in self.orientation_coordinates:
            rows, columns = np.ix_(orientation.coordinates, numbers)
            found[..., rows, columns] = _block(q[..., list(orientation.coordinates)])
        return found

    def inverse(self, q: FloatArray) -> FloatArray:
        """Return the left inverse of N(q), shape (..., displacements, coordinates)."""
        found = np.zeros((*q.shape[:-1], len(self), self.coordinates))
        for i, k in self.plain:
            found[..., k, i] = 1.0
        for orientation, numbers in self.orientation_coordinates:
            own = q[..., list(orientation.coordinates)]
            scale = (4.0 if own.shape[-1] == 4 else 1.0) / np.sum(own * own, axis=-1)
            rows, columns = np.ix_(numbers, orientation.coordinates)
            found[..., rows, columns] = scale[..., None, None] * np.swapaxes(_block(own), -1, -2)
        return found

    def moved(self, q: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return coordinates after a displacement, orientations turned by its whole angle."""
        found = q.copy()
        for i, k in self.plain:
            found[i] += displacement[k]
        for orientation, numbers in self.orientation_coordinates:
            own, by = q[list(orientation.coordinates)], displacement[list(numbers)]
            angle = float(np.linalg.norm(by))
            half = 0.5 * angle if len(own) == 4 else angle
            step = _block(own) @ by * (np.sinc(half / np.pi) if angle else 1.0)
            found[list(orientation.coordinates)] = np.cos(half) * own + step
        return found


def _block(own: FloatArray) -> FloatArray:
    """Return the derivative of the coordinates of an orientation by a small rotation in the body's axes."""
    parts = np.moveaxis(own, -1, 0)
    if len(parts) == 2:  # cosine and sine
        return np.stack([-parts[1], parts[0]], axis=-1)[..., None]
    w, x, y, z = parts
    rows = [[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]]
    return 0.5 * np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def find_tangents(equations: Equations) -> Tangents:
    """Return the displacements of the coordinates of a set of equations, whose orientations are quaternions."""
    of_orientation = {orientation.coordinates[0]: orientation for orientation in equations.orientation_coordinates}
    inside = {i for orientation in equations.orientation_coordinates for i in orientation.coordinates}
    names: list[str] = []
    units: list[str] = []
    plain: list[tuple[int, int]] = []
    orientation_coordinates: list[tuple[OrientationCoordinates, tuple[int, ...]]] = []
    for i, one in enumerate(equations.names):
        if i not in inside:
            plain.append((i, len(names)))
            names.append(one.name)
            units.append(one.unit)
        elif i in of_orientation:
            orientation = of_orientation[i]
            axes = ("x", "y", "z") if orientation.kind == "quaternion" else ("",)
            orientation_coordinates.append((orientation, tuple(range(len(names), len(names) + len(axes)))))
            names += [f"{orientation.body}.rotation{'.' * bool(axis)}{axis}" for axis in axes]
            units += ["rad"] * len(axes)
    return Tangents(len(equations.names), tuple(names), tuple(units), tuple(plain), tuple(orientation_coordinates))
