"""PointContact: a point that cannot pass a plane."""

from __future__ import annotations

from typing import ClassVar

from atwood import Number, Point, Scalar, Vector, connector, dot, parameter
from atwood_library.interfaces.on_plane import OnPlane

__all__ = ["PointContact"]


class PointContact(OnPlane):
    """A point, or the centre of a smooth ball, that cannot pass a plane, with dry friction where it touches."""

    synonyms: ClassVar[tuple[str, ...]] = (
        "Contact",
        "Impact",
        "Floor",
        "Wall",
        "Unilateral constraint",
        "Support",
        "Belt",
    )

    radius: Number = parameter(0.0, unit="m", minimum=0.0, doc="Radius of a smooth ball about the point.")
    point: Point = connector(Point, "What touches it.")

    def apart(self) -> Scalar:
        """Return the distance of point and plane."""
        return dot(self.point.position - self.plane.position, self.normal_in_world()) - self.radius

    def material_slip(self) -> Vector:
        """Return the velocity of the point past the surface."""
        touching = self.point.position - self.normal_in_world() * self.radius
        return self.point.velocity - self.surface_at(touching)
