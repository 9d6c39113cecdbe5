"""Parts of a user's own with inertia that changes, and Lagrangians."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import (
    BodyInertia,
    Component,
    Frame,
    Point,
    PointInertia,
    Scalar,
    Shaft,
    Vector,
    connector,
    cos,
    cross,
    dot,
    inertia,
    lagrangian,
    observable,
    parameter,
    signal,
    sin,
)


class LeakingBucket(Component):
    """A mass from which a part runs out, with the velocity that the bucket has."""

    mass: float = signal(1.0, unit="kg", doc="Mass that is left.")
    point: Point = connector(Point, "The bucket.")

    @inertia
    def matter(self) -> Iterable[PointInertia]:
        """Return the mass."""
        return [PointInertia([self.point], [[self.mass]])]


class BurningBody(Component):
    """A rigid body whose mass and moments of inertia shrink in proportion."""

    share: float = signal(1.0, doc="How much of it is left.")
    arm: float = parameter(0.3, unit="m", doc="Its centre of mass along x of its frame.")
    frame: Frame = connector(Frame, "The frame.")

    @inertia
    def matter(self) -> Iterable[BodyInertia]:
        """Return the inertia."""
        m, j = 2.0 * self.share, 0.1 * self.share
        tensor = ((0.08 * self.share, 0.0, 0.0), (0.0, j, 0.0), (0.0, 0.0, 0.15 * self.share))
        return [BodyInertia(self.frame, m, Vector(self.arm, 0.0, 0.0), j, tensor)]


class LagrangianPoint(Component):
    """A point mass, said as a Lagrangian with the potential of its weight."""

    mass: float = parameter(1.0, unit="kg", above=0.0, doc="Mass.")
    gravity: float = parameter(9.81, unit="m/s^2", doc="Free fall.")
    charge: float = parameter(0.0, unit="C", doc="Charge.")
    field: float = parameter(0.0, unit="T", doc="Magnetic flux density along y.")
    point: Point = connector(Point, "The point.")

    @lagrangian
    def motion(self) -> Scalar:
        """Return ``m v^2/2 - m g z + q A . v``, with ``A = B x r / 2``."""
        r, v = self.point.position, self.point.velocity
        potential = cross(Vector(0.0, self.field, 0.0), r) * 0.5
        return self.mass * (0.5 * dot(v, v) - self.gravity * r.z) + self.charge * dot(potential, v)


class LagrangianBody(Component):
    """A rigid body in a plane or in space, said as a Lagrangian."""

    gravity: float = parameter(9.81, unit="m/s^2", doc="Free fall.")
    frame: Frame = connector(Frame, "The frame.")

    @lagrangian
    def motion(self) -> Scalar:
        """Return the Lagrangian of 2 kg at 0.3 m along x, with three moments of inertia."""
        arm = self.frame.to_world(Vector(0.3, 0.0, 0.0))
        w = self.frame.to_frame(self.frame.angular_velocity)
        v = self.frame.velocity + cross(self.frame.angular_velocity, arm)
        turning = 0.16 * w.x * w.x + 0.2 * w.y * w.y + 0.3 * w.z * w.z
        return dot(v, v) + 0.5 * turning - 2.0 * self.gravity * (self.frame.position + arm).z

    @observable(unit="rad/s", doc="Angular velocity, in world axes.")
    def angular_velocity(self) -> Vector:
        """Return the angular velocity."""
        return self.frame.angular_velocity


class CrankInertia(Component):
    """A moment of inertia that depends on the angle of a hinge, as of a crank with a piston."""

    base: float = parameter(0.5, unit="kg*m^2", above=0.0, doc="Mean moment of inertia.")
    swing: float = parameter(0.2, unit="kg*m^2", doc="By how much it changes.")
    a: Shaft = connector(Shaft, "The hinge.")

    @lagrangian
    def motion(self) -> Scalar:
        """Return the kinetic energy."""
        return 0.5 * (self.base + self.swing * cos(2.0 * self.a.value)) * self.a.rate * self.a.rate


class Drum(Component):
    """A moment of inertia that grows with every turn of a hinge, as of a drum that winds up a rope."""

    base: float = parameter(0.5, unit="kg*m^2", above=0.0, doc="Moment of inertia at angle zero.")
    growth: float = parameter(0.01, unit="kg*m^2/rad", doc="By how much it grows.")
    a: Shaft = connector(Shaft, "The hinge.")

    @lagrangian
    def motion(self) -> Scalar:
        """Return the kinetic energy."""
        return 0.5 * (self.base + self.growth * self.a.value) * self.a.rate * self.a.rate


class PumpedPoint(Component):
    """A point mass with a Lagrangian that depends on time: mass comes to it from rest."""

    point: Point = connector(Point, "The point.")

    @lagrangian
    def motion(self) -> Scalar:
        """Return the kinetic energy."""
        return 0.5 * (1.0 + 0.5 * sin(self.time)) * dot(self.point.velocity, self.point.velocity)
