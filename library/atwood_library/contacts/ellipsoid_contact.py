"""EllipsoidContact: an ellipsoid, or an ellipse, that cannot pass a plane."""

from __future__ import annotations

from typing import ClassVar

from atwood import Frame, Scalar, Triple, Vector, as_vector, connector, cross, dot, parameter, sqrt
from atwood_library.interfaces.on_plane import OnPlane

__all__ = ["EllipsoidContact"]


class EllipsoidContact(OnPlane):
    """An ellipsoid, in a plane an ellipse, that cannot pass a plane; friction acts on its spin, until it rolls.

    With the plane's normal n in the axes of the body it touches at ``-(a^2 n1, b^2 n2, c^2 n3)/h`` from its centre,
    which is then at the height ``h = sqrt(a^2 n1^2 + b^2 n2^2 + c^2 n3^2)`` (Bondi, Proceedings of the Royal Society A
    405, 1986).
    """

    synonyms: ClassVar[tuple[str, ...]] = ("Egg on table", "Rattleback that slips", "Pebble", "Cam on plane")

    semi_axes: Triple = parameter(
        (0.1, 0.1, 0.1),
        unit="m",
        size=3,
        above=0.0,
        doc="Semi-axes along x, y and z of the body's frame.",
        symbol=("a", "b", "c"),
    )
    body: Frame = connector(Frame, "The frame of the ellipsoid, at its centre.")

    def scaled(self) -> tuple[Vector, Scalar]:
        """Return, in the body's axes, the normal with its components times squared semi-axes, and the height."""
        n, axes = self.body.to_frame(self.normal_in_world()), as_vector(self.semi_axes)
        stretched = Vector(axes.x * axes.x * n.x, axes.y * axes.y * n.y, axes.z * axes.z * n.z)
        return stretched, sqrt(dot(stretched, n))

    def apart(self) -> Scalar:
        """Return the distance of ellipsoid and plane."""
        return dot(self.body.position - self.plane.position, self.normal_in_world()) - self.scaled()[1]

    def material_slip(self) -> Vector:
        """Return the velocity of the body's material at the lowest place past the surface."""
        stretched, height = self.scaled()
        arm = self.body.to_world(stretched / -height)
        of_body = self.body.velocity + cross(self.body.angular_velocity, arm)
        return of_body - self.surface_at(self.body.position + arm)
