"""SurfaceContact: a point that cannot pass a surface, or a curve, where a function of its place is zero."""

from __future__ import annotations

from typing import ClassVar

from atwood import Scalar, Vector, cross, norm
from atwood_library.interfaces.level_surface import LevelSurface
from atwood_library.interfaces.touching import Touching

__all__ = ["SurfaceContact"]


class SurfaceContact(LevelSurface, Touching):
    """A point that stays where ``f(x, y, z) >= 0``, with its place in the axes of a frame that may move.

    The surface, in a plane the curve, may be of any shape: a bead leaves a sphere, a ball is reflected at an ellipse.
    """

    synonyms: ClassVar[tuple[str, ...]] = ("Reflecting curve", "Bead that leaves a sphere", "Obstacle", "Bowl")

    def normal_in_world(self) -> Vector:
        """Return the normal of the surface at the point."""
        return self.unit_normal()

    def directions_in_world(self) -> tuple[Vector, Vector]:
        """Return two directions along the surface.

        In space the first is the x axis turned with the normal from the z axis, the shortest way.
        """
        if not self.in_space:
            n = self.normal_in_world()
            return Vector(n.z, 0.0, -n.x), Vector(0.0, 1.0, 0.0)
        gradient = self.gradient()
        n = gradient / norm(gradient)
        share = 1.0 / (1.0 + n.z)
        first = Vector(1.0 - n.x * n.x * share, -n.x * n.y * share, -n.x)
        second = Vector(-n.x * n.y * share, 1.0 - n.y * n.y * share, -n.y)
        return self.a.to_world(first), self.a.to_world(second)

    def apart(self) -> Scalar:
        """Return the function over the size of its gradient, whose slope on the surface is one."""
        return self.height()

    def material_slip(self) -> Vector:
        """Return the velocity of the point past the surface."""
        of_surface = self.a.velocity + cross(self.a.angular_velocity, self.b.position - self.a.position)
        return self.b.velocity - of_surface
