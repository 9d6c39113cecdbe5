"""Solid: what all rigid bodies have in common: a frame, an inertia, and what can be read of their motion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from atwood import (
    BodyInertia,
    Component,
    Frame,
    Scalar,
    Vector,
    connector,
    cross,
    dot,
    inertia,
    observable,
)
from atwood_library.interfaces.euler_angles import EulerAngles, restated_angles

__all__ = ["Solid", "Tensor"]

Tensor = tuple[tuple[Scalar, Scalar, Scalar], tuple[Scalar, Scalar, Scalar], tuple[Scalar, Scalar, Scalar]]
"""An inertia tensor, row by row, kg m^2."""


class Solid(Component):
    """A rigid body; subclasses say its mass, its centre of mass and its inertia tensor in the axes of its frame.

    Its orientation is reported as the three axes of its frame and as Euler angles in the z-y-z convention: phi about z,
    theta about the new y, psi about the new z. Where theta is zero, within 1e-12 rad, only phi + psi has a value, and
    where it is half a turn only phi - psi: at the start of a run, if it does not say them, phi is zero and psi is what
    there is, and along it the other combination stays what it was before. There the rates have values as long as the
    axis stays; where it just passes they have none.
    """

    frame: Frame = connector(Frame, "The frame that everything about the body is given in.")

    def total_mass(self) -> Scalar:
        """Return the mass, kg."""
        raise NotImplementedError

    def center_of_mass(self) -> Vector:
        """Return the centre of mass in the axes of the frame, m."""
        return Vector(0.0, 0.0, 0.0)

    def tensor(self) -> Tensor:
        """Return the inertia tensor about the centre of mass in the axes of the frame, kg m^2."""
        raise NotImplementedError

    def center_in_world(self) -> Vector:
        """Return the centre of mass from the frame, in world axes."""
        return self.frame.to_world(self.center_of_mass())

    def restate_start(self, given: Mapping[str, float], space: str) -> dict[str, float]:
        """Return start values with Euler angles said as the axes that they stand for; those not given are zero."""
        if space != "space":
            return dict(given)
        return restated_angles(given, "zyz", ("phi", "theta", "psi"), ("x_axis", "z_axis"))

    def euler_angles(self) -> EulerAngles:
        """Return the Euler angles of the frame in world axes."""
        world = Vector(1.0, 0.0, 0.0), Vector(0.0, 1.0, 0.0), Vector(0.0, 0.0, 1.0)
        return EulerAngles("zyz", world, self.frame.axes, self.frame.angular_velocity)

    @inertia
    def rigid_body(self) -> Iterable[BodyInertia]:
        """Return the inertia; in a plane only the moment about its normal, y, counts."""
        tensor = self.tensor()
        yield BodyInertia(self.frame, self.total_mass(), self.center_of_mass(), tensor[1][1], tensor)

    @observable(unit="m", doc="Position of the centre of mass in world axes.")
    def position(self) -> Vector:
        """Return the position of the centre of mass."""
        return self.frame.position + self.center_in_world()

    @observable(unit="m/s", doc="Velocity of the centre of mass in world axes.")
    def velocity(self) -> Vector:
        """Return the velocity of the centre of mass."""
        swing: Vector = self.frame.velocity + cross(self.frame.angular_velocity, self.center_in_world())
        return swing

    @observable(unit="rad", doc="Angle in the plane, counter-clockwise.", spaces=("plane",))
    def angle(self) -> Scalar:
        """Return the angle."""
        return self.frame.angle

    @observable(unit="rad/s", doc="Rate of the angle in the plane, counter-clockwise.", spaces=("plane",))
    def angular_speed(self) -> Scalar:
        """Return the rate of the angle; the rotation is about -y."""
        return -self.frame.angular_velocity.y

    @observable(unit="rad/s", doc="Angular velocity in world axes.", spaces=("plane", "space"))
    def angular_velocity(self) -> Vector:
        """Return the angular velocity."""
        return self.frame.angular_velocity

    @observable(unit="rad/s", doc="Angular velocity in the axes of the frame.", spaces=("space",))
    def spin(self) -> Vector:
        """Return the angular velocity along the frame's own axes."""
        return self.frame.spin

    @observable(unit="kg*m^2/s", doc="Angular momentum about the centre of mass, in world axes.", spaces=("space",))
    def angular_momentum(self) -> Vector:
        """Return the angular momentum."""
        spin = self.spin()
        return self.frame.to_world(Vector(*(dot(Vector(*row), spin) for row in self.tensor())))

    @observable(unit="1", doc="The frame's x axis in world axes.", spaces=("space",))
    def x_axis(self) -> Vector:
        """Return the axis."""
        return self.frame.axes[0]

    @observable(unit="1", doc="The frame's y axis in world axes.", spaces=("space",))
    def y_axis(self) -> Vector:
        """Return the axis."""
        return self.frame.axes[1]

    @observable(unit="1", doc="The frame's z axis in world axes.", spaces=("space",))
    def z_axis(self) -> Vector:
        """Return the axis."""
        return self.frame.axes[2]

    @observable(
        unit="rad",
        doc="First Euler angle, about the world's z axis.",
        periodic=True,
        rate="phi_rate",
        pole="pole",
        spaces=("space",),
    )
    def phi(self) -> Scalar:
        """Return the azimuth of the frame's z axis (Goldstein, section 4.4, in the z-y-z convention)."""
        return self.euler_angles().first()

    @observable(unit="rad", doc="Second Euler angle, of the frame's z axis from the world's.", spaces=("space",))
    def theta(self) -> Scalar:
        """Return the angle between the two z axes."""
        return self.euler_angles().second()

    @observable(
        unit="rad",
        doc="Third Euler angle, about the frame's z axis.",
        periodic=True,
        rate="psi_rate",
        pole="pole",
        spaces=("space",),
    )
    def psi(self) -> Scalar:
        """Return the angle about the frame's own z axis."""
        return self.euler_angles().last()

    @observable(unit="1", doc="At a pole, the sign with which psi is added to phi; else zero.", spaces=("space",))
    def pole(self) -> Scalar:
        """Return the sign, which is there the cosine between the first and the third axis."""
        return self.euler_angles().pole()

    @observable(unit="rad/s", doc="Rate of phi (precession).", spaces=("space",))
    def phi_rate(self) -> Scalar:
        """Return the rate of the first Euler angle (Goldstein, section 4.9, in the z-y-z convention)."""
        return self.euler_angles().rates()[0]

    @observable(unit="rad/s", doc="Rate of theta (nutation).", spaces=("space",))
    def theta_rate(self) -> Scalar:
        """Return the rate of the second Euler angle."""
        return self.euler_angles().rates()[1]

    @observable(unit="rad/s", doc="Rate of psi (spin).", spaces=("space",))
    def psi_rate(self) -> Scalar:
        """Return the rate of the third Euler angle."""
        return self.euler_angles().rates()[2]

    @observable(unit="J", doc="Energy of turning about the centre of mass.", spaces=("space",))
    def turning_energy(self) -> Scalar:
        """Return half the scalar product of angular velocity and angular momentum."""
        return 0.5 * dot(self.frame.angular_velocity, self.angular_momentum())
