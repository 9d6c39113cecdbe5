"""Pivot: a hinge between two frames."""

from __future__ import annotations

from atwood import Component, Frame, Placement, Scalar, Vector, connector, constraint, joint, observable


class Pivot(Component):
    """A hinge: the two frames share their position and turn freely against each other.

    Its `force` is what it exerts on frame b, in world axes.
    """

    a: Frame = connector(Frame, "The frame that the angle is measured from.")
    b: Frame = connector(Frame, "The frame that turns.")

    @constraint(reaction="force", unit="N", doc="Force exerted on frame b, in world axes.")
    def coincidence(self) -> Vector:
        """Return the distance of the two frames."""
        return self.b.position - self.a.position

    @joint("a", "b", coordinates=("angle",), solves=("coincidence",))
    def turn(self, angle: Scalar) -> Placement:
        """Place b at a, turned."""
        return Placement(Vector(0.0, 0.0, 0.0), angle)

    @joint("a", "b", solves=("coincidence",), spaces=("line",))
    def meet(self) -> Placement:
        """Place b at a; nothing turns on a line."""
        return Placement(Vector(0.0, 0.0, 0.0), 0.0)

    @observable(unit="rad", doc="Angle of frame b from frame a, counter-clockwise.", spaces=("plane",))
    def angle(self) -> Scalar:
        """Return the angle."""
        return self.b.angle - self.a.angle

    @observable(unit="rad/s", doc="Rate of the angle.", spaces=("plane",))
    def angular_velocity(self) -> Scalar:
        """Return the rate of the angle; the rotation is about -y."""
        return self.a.angular_velocity.y - self.b.angular_velocity.y
