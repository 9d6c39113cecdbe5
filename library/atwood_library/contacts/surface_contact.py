"""SurfaceContact: a point that cannot pass a surface, or a curve, where a function of its place is zero."""

from __future__ import annotations

from typing import Any, ClassVar

from atwood import Frame, Number, Point, Scalar, Vector, connector, cross, norm, parameter
from atwood_library.interfaces.touching import Touching

__all__ = ["SurfaceContact"]


class SurfaceContact(Touching):
    """A point that stays where ``f(x, y, z) >= 0``, with its place in the axes of a frame that may move.

    The surface, in a plane the curve, may be of any shape: a bead leaves a sphere, a ball is reflected at an ellipse.
    """

    synonyms: ClassVar[tuple[str, ...]] = ("Reflecting curve", "Bead that leaves a sphere", "Obstacle", "Bowl")

    function: Any = parameter(
        "z", function_of={"x": "1", "y": "1", "z": "1"}, doc="What is not negative; of place in units of scale."
    )
    scale: Number = parameter(1.0, unit="m", above=0.0, doc="Unit of length of the function.", symbol="a")
    a: Frame = connector(Frame, "The frame that carries the surface.")
    b: Point = connector(Point, "The point.")

    def arm(self) -> Vector:
        """Return where the point is, in the axes of frame a and in units of scale."""
        arm: Vector = self.a.to_frame(self.b.position - self.a.position) / self.scale
        return arm

    def gradient(self) -> Vector:
        """Return the gradient of the function; in a plane, only what lies there."""
        r = self.arm()
        x, y, z = (self.function.derivative(axis)(r.x, r.y, r.z) for axis in "xyz")
        return Vector(x, y if self.in_space else 0.0, z)

    def normal_in_world(self) -> Vector:
        """Return the normal of the surface at the point."""
        gradient = self.gradient()
        normal: Vector = self.a.to_world(gradient / norm(gradient))
        return normal

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
        r = self.arm()
        return self.scale * self.function(r.x, r.y, r.z) / norm(self.gradient())

    def material_slip(self) -> Vector:
        """Return the velocity of the point past the surface."""
        of_surface = self.a.velocity + cross(self.a.angular_velocity, self.b.position - self.a.position)
        return self.b.velocity - of_surface
