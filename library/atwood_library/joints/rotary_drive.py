"""RotaryDrive: a prescribed rotation between two frames."""

from __future__ import annotations

from atwood import (
    Component,
    Frame,
    Placement,
    Scalar,
    Vector,
    connector,
    constraint,
    joint,
    observable,
    signal,
)


class RotaryDrive(Component):
    """A hinge whose angle is a given function of time: a motor that turns exactly as told.

    Its `force` and `torque` are what it exerts on frame b.
    """

    rotation: float = signal(0.0, unit="rad", doc="Angle of frame b from frame a, a function of time.")
    a: Frame = connector(Frame, "The frame that carries the motor.")
    b: Frame = connector(Frame, "The frame that is turned.")

    @constraint(reaction="force", unit="N", doc="Force exerted on frame b, in world axes.")
    def coincidence(self) -> Vector:
        """Return the distance of the two frames."""
        return self.b.position - self.a.position

    @constraint(reaction="torque", unit="N*m", doc="Torque exerted on frame b, counter-clockwise.")
    def track(self) -> Scalar:
        """Return the deviation of the angle."""
        return self.b.angle - self.a.angle - self.rotation

    @joint("a", "b", solves=("coincidence", "track"), spaces=("plane",))
    def turn(self) -> Placement:
        """Place b at a, turned as prescribed."""
        return Placement(Vector(0.0, 0.0, 0.0), self.rotation)

    @observable(unit="rad", doc="Prescribed angle.", spaces=("plane",))
    def angle(self) -> Scalar:
        """Return the prescribed angle."""
        return self.rotation
