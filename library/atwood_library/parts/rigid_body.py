"""RigidBody: a body given by its mass, its centre of mass and its inertia."""

from __future__ import annotations

from typing import Self

from atwood import Number, Scalar, Triple, Vector, as_vector, parameter
from atwood.solids import MassProperties
from atwood_library.interfaces.solid import Solid, Tensor


class RigidBody(Solid):
    """A rigid body: its mass, where its centre of mass is, and its inertia tensor there, in the axes of its frame.

    In space it moves by Newton's and Euler's equations (Goldstein, section 5.5); in a plane only the moment about the
    plane's normal, y, counts. `RigidBody.of` takes what `atwood.solids` works out of shapes and meshes.
    """

    synonyms = ("Body",)

    mass: Number = parameter(1.0, unit="kg", minimum=0.0, doc="Mass.")
    center: Triple = parameter((0.0, 0.0, 0.0), unit="m", size=3, doc="Centre of mass in the axes of the frame.")
    moments: Triple = parameter(
        (0.0, 0.0, 0.0),
        unit="kg*m^2",
        size=3,
        minimum=0.0,
        doc="Moments of inertia Jxx, Jyy, Jzz about the centre of mass; in a plane Jyy alone will do.",
    )
    products: Triple = parameter(
        (0.0, 0.0, 0.0),
        unit="kg*m^2",
        size=3,
        doc="Entries Jxy, Jxz, Jyz of the inertia tensor; the products of inertia with a minus sign.",
    )

    @classmethod
    def of(cls, solid: MassProperties) -> Self:
        """Return a body with the mass properties of a solid.

        Parameters
        ----------
        solid
            From a shape, a mesh, or several of them composed; see `atwood.solids`.
        """
        j = [[float(entry) for entry in row] for row in solid.inertia]
        return cls(
            mass=solid.mass,
            center=(float(solid.centre[0]), float(solid.centre[1]), float(solid.centre[2])),
            moments=(j[0][0], j[1][1], j[2][2]),
            products=(j[0][1], j[0][2], j[1][2]),
        )

    def total_mass(self) -> Scalar:
        """Return the mass."""
        return self.mass

    def center_of_mass(self) -> Vector:
        """Return the centre of mass in the axes of the frame."""
        return as_vector(self.center)

    def tensor(self) -> Tensor:
        """Return the inertia tensor."""
        j, p = as_vector(self.moments), as_vector(self.products)
        return (j.x, p.x, p.y), (p.x, j.y, p.z), (p.y, p.z, j.z)
