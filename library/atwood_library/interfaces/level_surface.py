"""A surface, or in a plane a curve, where a function of place is zero, carried by a frame."""

from __future__ import annotations

from typing import Any

from atwood import Component, Frame, Number, Point, Scalar, Vector, connector, norm, parameter

__all__ = ["LevelSurface"]


class LevelSurface(Component):
    """A surface ``f(x, y, z) = 0`` in the axes of a frame that may move, and a point on it or near it.

    In a plane it is a curve, ``f(x, 0, z) = 0``. Lengths are in units of `scale`.
    """

    function: Any = parameter(
        "z", function_of={"x": "1", "y": "1", "z": "1"}, doc="What is zero there; of place in units of scale."
    )
    scale: Number = parameter(
        1.0, unit="m", above=0.0, unit_length=True, doc="Unit of length of the function.", symbol="a"
    )
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

    def height(self) -> Scalar:
        """Return the function over the size of its gradient, whose slope on the surface is one."""
        r = self.arm()
        return self.scale * self.function(r.x, r.y, r.z) / norm(self.gradient())

    def unit_normal(self) -> Vector:
        """Return the normal of the surface at the point, in world axes."""
        gradient = self.gradient()
        normal: Vector = self.a.to_world(gradient / norm(gradient))
        return normal
