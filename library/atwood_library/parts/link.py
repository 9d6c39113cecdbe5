"""Link: a straight rigid body with a frame at each end."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import (
    BodyInertia,
    Component,
    Frame,
    Number,
    Placement,
    Scalar,
    Vector,
    connector,
    cross,
    inertia,
    joint,
    observable,
    parameter,
)
from atwood_library.interfaces.poles import angle_off_pole, rate_off_pole


class Link(Component):
    """A rigid body with two frames: a at its origin, b at `length` along its x axis.

    Its angle is that of its x axis from the world's, counter-clockwise. Unless said otherwise it is a uniform slender
    rod, with moment of inertia ``m l^2 / 12`` about its centre (Goldstein, section 5.3).
    """

    synonyms = ("BodyShape",)

    length: Number = parameter(1.0, unit="m", above=0.0, doc="Distance from a to b.")
    mass: Number = parameter(1.0, unit="kg", minimum=0.0, doc="Mass.")
    center: Number | None = parameter(
        None,
        unit="m",
        doc="Distance of the centre of mass from a, towards b; half the length if not given.",
        symbol="c",
    )
    moment: Number | None = parameter(
        None, unit="kg*m^2", minimum=0.0, doc="Moment of inertia about the centre of mass; m l^2/12 if not given."
    )
    axial_moment: Number = parameter(
        0.0, unit="kg*m^2", minimum=0.0, doc="Moment of inertia about its own axis, which only space knows."
    )
    a: Frame = connector(Frame, "The frame at the origin of the link.")
    b: Frame = connector(Frame, "The frame at the other end.")

    def center_in_link(self) -> Vector:
        """Return the centre of mass in the axes of frame a."""
        return Vector(0.5 * self.length if self.center is None else self.center, 0.0, 0.0)

    @inertia
    def rigid_body(self) -> Iterable[BodyInertia]:
        """Return the inertia."""
        moment = self.mass * self.length * self.length / 12.0 if self.moment is None else self.moment
        tensor = ((self.axial_moment, 0.0, 0.0), (0.0, moment, 0.0), (0.0, 0.0, moment))
        yield BodyInertia(self.a, self.mass, self.center_in_link(), moment, tensor)

    @joint("a", "b", rigid=True, spaces=("line", "plane", "space"))
    def shape(self) -> Placement:
        """Place b in the axes of a."""
        return Placement(Vector(self.length, 0.0, 0.0), 0.0, axes="a")

    @observable(
        unit="rad",
        doc="Angle of the x axis as seen along y, counter-clockwise.",
        periodic=True,
        rate="angular_velocity",
        spaces=("plane", "space"),
    )
    def angle(self) -> Scalar:
        """Return the angle."""
        if not self.in_space:
            return self.a.angle
        x = self.a.axes[0]
        return angle_off_pole(x.z, x.x)

    @observable(unit="rad/s", doc="Rate of the angle.", spaces=("plane", "space"))
    def angular_velocity(self) -> Scalar:
        """Return the rate of the angle; the rotation is about -y."""
        if not self.in_space:
            return -self.a.angular_velocity.y
        x = self.a.axes[0]
        rate = cross(self.a.angular_velocity, x)
        square = x.x * x.x + x.z * x.z
        return rate_off_pole(x.x * rate.z - x.z * rate.x, square, square)

    @observable(unit="m", doc="Position of the centre of mass in world axes.")
    def position(self) -> Vector:
        """Return the position of the centre of mass."""
        return self.a.position + self.a.to_world(self.center_in_link())

    @observable(unit="m/s", doc="Velocity of the centre of mass in world axes.")
    def velocity(self) -> Vector:
        """Return the velocity of the centre of mass."""
        arm = self.a.to_world(self.center_in_link())
        velocity: Vector = self.a.velocity + cross(self.a.angular_velocity, arm)
        return velocity
