"""Solid: what all rigid bodies have in common: a frame, an inertia, and what can be read of their motion."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from atwood import (
    BodyInertia,
    Component,
    Frame,
    Scalar,
    Vector,
    atan2,
    connector,
    cross,
    dot,
    inertia,
    observable,
    sqrt,
)
from atwood_library.interfaces.poles import angle_off_pole, rate_off_pole

__all__ = ["Solid", "Tensor"]

Tensor = tuple[tuple[Scalar, Scalar, Scalar], tuple[Scalar, Scalar, Scalar], tuple[Scalar, Scalar, Scalar]]
"""An inertia tensor, row by row, kg m^2."""


class Solid(Component):
    """A rigid body; subclasses say its mass, its centre of mass and its inertia tensor in the axes of its frame.

    Its orientation is reported as the three axes of its frame and as Euler angles in the z-y-z convention: phi about z,
    theta about the new y, psi about the new z. Where theta is zero or half a turn, within 1e-10 rad, phi and psi are
    zero and the three rates have no value.
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
        said = dict(given)
        if space != "space" or not {"phi", "theta", "psi"} & said.keys():
            return said
        phi, theta, psi = (said.pop(name, 0.0) for name in ("phi", "theta", "psi"))
        (sa, ca), (sb, cb), (sc, cc) = ((math.sin(angle), math.cos(angle)) for angle in (phi, theta, psi))
        x_axis = (ca * cb * cc - sa * sc, sa * cb * cc + ca * sc, -sb * cc)
        z_axis = (ca * sb, sa * sb, cb)
        said.update({f"x_axis.{axis}": value for axis, value in zip("xyz", x_axis, strict=True)})
        said.update({f"z_axis.{axis}": value for axis, value in zip("xyz", z_axis, strict=True)})
        return said

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
        spaces=("space",),
    )
    def phi(self) -> Scalar:
        """Return the azimuth of the frame's z axis (Goldstein, section 4.4, in the z-y-z convention)."""
        z = self.frame.axes[2]
        return angle_off_pole(z.y, z.x)

    @observable(unit="rad", doc="Second Euler angle, of the frame's z axis from the world's.", spaces=("space",))
    def theta(self) -> Scalar:
        """Return the angle between the two z axes."""
        z = self.frame.axes[2]
        return atan2(sqrt(z.x * z.x + z.y * z.y), z.z)

    @observable(
        unit="rad",
        doc="Third Euler angle, about the frame's z axis.",
        periodic=True,
        rate="psi_rate",
        spaces=("space",),
    )
    def psi(self) -> Scalar:
        """Return the angle about the frame's own z axis."""
        x, y, _ = self.frame.axes
        return angle_off_pole(y.z, -x.z)

    @observable(unit="rad/s", doc="Rate of phi (precession).", spaces=("space",))
    def phi_rate(self) -> Scalar:
        """Return the rate of the first Euler angle (Goldstein, section 4.9, in the z-y-z convention)."""
        (x, y, _), w = self.frame.axes, self.spin()
        square = x.z * x.z + y.z * y.z
        return rate_off_pole(w.x * x.z + w.y * y.z, square, square)

    @observable(unit="rad/s", doc="Rate of theta (nutation).", spaces=("space",))
    def theta_rate(self) -> Scalar:
        """Return the rate of the second Euler angle."""
        (x, y, _), w = self.frame.axes, self.spin()
        square = x.z * x.z + y.z * y.z
        return rate_off_pole(w.x * y.z - w.y * x.z, sqrt(square), square)

    @observable(unit="rad/s", doc="Rate of psi (spin).", spaces=("space",))
    def psi_rate(self) -> Scalar:
        """Return the rate of the third Euler angle."""
        return self.spin().z - self.phi_rate() * self.frame.axes[2].z

    @observable(unit="J", doc="Energy of turning about the centre of mass.", spaces=("space",))
    def turning_energy(self) -> Scalar:
        """Return half the scalar product of angular velocity and angular momentum."""
        return 0.5 * dot(self.frame.angular_velocity, self.angular_momentum())
