"""FrameSensor: how a point moves as seen from a frame, and the forces that an observer there finds."""

from __future__ import annotations

from atwood import Component, Frame, Point, Vector, connector, cross, observable

_SPACES = ("plane", "space")


class FrameSensor(Component):
    """Measures the motion of a point as seen from a frame that may move and turn, in the axes of that frame.

    For the observer the mass of the body that the point is on obeys ``m a' = F + F_translation + F_Euler + F_Coriolis +
    F_centrifugal`` with the acceleration a' that is seen (Goldstein, section 4.10), where F is the force that acts on
    it: ``m a`` with its acceleration against the world. The point is meant to be the body's centre of mass.
    """

    synonyms = (
        *("RelativeSensor", "Fictitious forces", "Coriolis force", "Centrifugal force"),
        *("Rotating frame", "AbsoluteAngularVelocity", "RelativeAngularVelocity"),
    )
    spaces = _SPACES

    frame: Frame = connector(Frame, "The frame of the observer.")
    point: Point = connector(Point, "The point that is measured.")

    def arm(self) -> Vector:
        """Return the way from the origin of the frame to the point, in world axes."""
        arm: Vector = self.point.position - self.frame.position
        return arm

    def velocity_in_world(self) -> Vector:
        """Return the velocity that is seen, in world axes."""
        carried = self.frame.velocity + cross(self.frame.angular_velocity, self.arm())
        seen: Vector = self.point.velocity - carried
        return seen

    def fictitious(self) -> tuple[Vector, Vector, Vector, Vector]:
        """Return translational, Euler, Coriolis and centrifugal accelerations, in world axes."""
        omega, arm = self.frame.angular_velocity, self.arm()
        return (
            self.frame.acceleration * -1.0,
            cross(self.frame.angular_acceleration, arm) * -1.0,
            cross(omega, self.velocity_in_world()) * -2.0,
            cross(omega, cross(omega, arm)) * -1.0,
        )

    def as_force(self, acceleration: Vector) -> Vector:
        """Return mass times an acceleration, in the axes of the frame."""
        return self.frame.to_frame(acceleration * self.point.mass)

    @observable(unit="m", doc="Position of the point in the axes of the frame.", spaces=_SPACES)
    def position(self) -> Vector:
        """Return the position."""
        return self.frame.to_frame(self.arm())

    @observable(unit="m/s", doc="Velocity of the point as seen from the frame, in its axes.", spaces=_SPACES)
    def velocity(self) -> Vector:
        """Return the velocity less that of the frame's own points."""
        return self.frame.to_frame(self.velocity_in_world())

    @observable(unit="m/s^2", doc="Acceleration of the point as seen from the frame, in its axes.", spaces=_SPACES)
    def acceleration(self) -> Vector:
        """Return the acceleration with all that the frame's motion adds."""
        translation, euler, coriolis, centrifugal = self.fictitious()
        return self.frame.to_frame(self.point.acceleration + translation + euler + coriolis + centrifugal)

    @observable(unit="N", doc="Force on the body of the point, in the axes of the frame.", spaces=_SPACES)
    def force(self) -> Vector:
        """Return mass times acceleration against the world."""
        return self.as_force(self.point.acceleration)

    @observable(unit="N", doc="Force because the frame's origin is accelerated, in its axes.", spaces=_SPACES)
    def translational_force(self) -> Vector:
        """Return ``-m a0``."""
        return self.as_force(self.fictitious()[0])

    @observable(unit="N", doc="Force because the frame turns ever faster, in its axes.", spaces=_SPACES)
    def euler_force(self) -> Vector:
        """Return ``-m omega' x r``."""
        return self.as_force(self.fictitious()[1])

    @observable(unit="N", doc="Force because the point moves in a frame that turns, in its axes.", spaces=_SPACES)
    def coriolis_force(self) -> Vector:
        """Return ``-2 m omega x v'``."""
        return self.as_force(self.fictitious()[2])

    @observable(unit="N", doc="Force away from the axis about which the frame turns, in its axes.", spaces=_SPACES)
    def centrifugal_force(self) -> Vector:
        """Return ``-m omega x (omega x r)``."""
        return self.as_force(self.fictitious()[3])
