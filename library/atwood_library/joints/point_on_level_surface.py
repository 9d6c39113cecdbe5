"""PointOnLevelSurface: a point on the surface, or the curve, where a function of its place is zero."""

from __future__ import annotations

from typing import Any

from atwood import (
    Component,
    Frame,
    Number,
    Outline,
    Point,
    Scalar,
    Vector,
    connector,
    constraint,
    norm,
    observable,
    parameter,
)


class PointOnLevelSurface(Component):
    """A point that stays where ``f(x, y, z) = 0``, with its place in the axes of a frame that may move.

    In space that is a surface, in a plane a curve, ``f(x, 0, z) = 0``. Lengths are in units of `scale`. It is a
    constraint without coordinates of its own, and so takes no state away; its force is along the gradient of f.
    """

    synonyms = ("Implicit surface", "Implicit curve")
    spaces = ("plane", "space")

    function: Any = parameter(
        "z", function_of={"x": "1", "y": "1", "z": "1"}, doc="What is zero there; of place in units of scale."
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

    def outline(self) -> Outline:
        """Return what it looks like: the way of the point on the surface."""
        return Outline.path("b")

    @constraint(
        reaction="normal_force",
        unit="N",
        doc="Force on the point towards where the function is positive.",
        spaces=("plane", "space"),
    )
    def on_surface(self) -> Scalar:
        """Return the function over the size of its gradient, whose slope on the surface is one."""
        r = self.arm()
        return self.scale * self.function(r.x, r.y, r.z) / norm(self.gradient())

    @observable(unit="1", doc="Normal of the surface at the point, in world axes.", spaces=("plane", "space"))
    def normal(self) -> Vector:
        """Return the normal."""
        gradient = self.gradient()
        normal: Vector = self.a.to_world(gradient / norm(gradient))
        return normal
