"""Planar: a plate on a table."""

from __future__ import annotations

from atwood import Placement, Scalar, as_vector, constraint, dot, joint, normals, turn
from atwood_library.interfaces.loaded_plate import LoadedPlate
from atwood_library.interfaces.loaded_twist import LoadedTwist
from atwood_library.interfaces.parallel_axes import ParallelAxes


class Planar(ParallelAxes, LoadedPlate, LoadedTwist):
    """A plate on a table: frame b slides on a plane through frame a, and turns about its normal. A part of space.

    Displacements are along the two directions that make a right-handed set with the normal. It can carry a
    spring to the origin, dampers, actuators, a rim, and whatever acts on the angle.
    """

    synonyms = ("Planar joint",)

    @constraint(
        reaction="normal_force",
        unit="N",
        doc="Force on frame b along the normal; negative when pulled.",
        spaces=("space",),
    )
    def contact(self) -> Scalar:
        """Return the height above the plane."""
        return dot(self.b.position - self.a.position, self.axis_in_world())

    @joint(
        "a",
        "b",
        coordinates=("displacement_1", "displacement_2", "angle"),
        solves=("contact", "bearing"),
        spaces=("space",),
    )
    def lie(self, displacement_1: Scalar, displacement_2: Scalar, angle: Scalar) -> Placement:
        """Place b on the plane, turned about the normal."""
        axis = as_vector(self.axis)
        first, second = normals(axis)
        return Placement(first * displacement_1 + second * displacement_2, turn(axis, angle), axes="a")
