"""VertexContact: a place of a body that cannot pass a plane."""

from __future__ import annotations

from typing import ClassVar

from atwood import Frame, Scalar, Triple, Vector, as_vector, connector, cross, dot, parameter
from atwood_library.interfaces.on_plane import OnPlane

__all__ = ["VertexContact"]


class VertexContact(OnPlane):
    """A place that is fixed in a body, as a corner or the foot of a ladder, and cannot pass a plane."""

    synonyms: ClassVar[tuple[str, ...]] = ("Corner contact", "Foot", "Edge")

    place: Triple = parameter((0.0, 0.0, 0.0), unit="m", size=3, doc="The place in the axes of the body's frame.")
    body: Frame = connector(Frame, "The frame of the body.")

    def arm(self) -> Vector:
        """Return the place, from the frame's origin, in world axes."""
        return self.body.to_world(as_vector(self.place))

    def apart(self) -> Scalar:
        """Return the distance of the place and the plane."""
        return dot(self.body.position + self.arm() - self.plane.position, self.normal_in_world())

    def material_slip(self) -> Vector:
        """Return the velocity of the body at that place past the surface."""
        arm = self.arm()
        of_body = self.body.velocity + cross(self.body.angular_velocity, arm)
        return of_body - self.surface_at(self.body.position + arm)
