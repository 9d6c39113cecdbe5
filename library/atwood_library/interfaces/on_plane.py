"""A contact with a plane that a frame carries: its normal, its directions, and how fast its surface moves."""

from __future__ import annotations

from atwood import Frame, Number, Triple, Vector, as_vector, connector, cross, normals, parameter
from atwood_library.interfaces.touching import Touching

__all__ = ["OnPlane"]


class OnPlane(Touching):
    """A contact with a plane. The plane may move, and its surface may run over it, as a belt does."""

    normal: Triple = parameter(
        (0.0, 0.0, 1.0), direction=True, doc="Normal of the plane in its frame, towards what touches it."
    )
    surface_velocity: Number = parameter(
        0.0, unit="m/s", doc="Velocity of the surface over the plane, along the first direction of the slip."
    )
    plane: Frame = connector(Frame, "The frame that carries the plane; its origin is in it.")

    def normal_in_world(self) -> Vector:
        """Return the normal of the plane in world axes."""
        return self.plane.to_world(as_vector(self.normal))

    def directions_in_world(self) -> tuple[Vector, Vector]:
        """Return two directions of the plane in world axes."""
        n = as_vector(self.normal)
        first, second = normals(n) if self.in_space else (Vector(n.z, 0.0, -n.x), Vector(0.0, 1.0, 0.0))
        return self.plane.to_world(first), self.plane.to_world(second)

    def surface_at(self, place: Vector) -> Vector:
        """Return the velocity of the surface at a place, both in world axes."""
        of_plane = self.plane.velocity + cross(self.plane.angular_velocity, place - self.plane.position)
        return of_plane + self.directions_in_world()[0] * self.surface_velocity
