"""Rolling: what bodies that roll on a plane without slipping have in common."""

from __future__ import annotations

from typing import ClassVar

from atwood import (
    FREE,
    Component,
    Frame,
    Number,
    Placement,
    Scalar,
    Triple,
    Vector,
    as_vector,
    connector,
    constraint,
    cross,
    dot,
    joint,
    normals,
    observable,
    parameter,
)
from atwood_library.interfaces.bearings import rate_along

__all__ = ["Rolling"]


class Rolling(Component):
    """A body that touches a plane in one point and does not slip there; subclasses say where that point is.

    Touching holds positions, and not slipping holds velocities: the body's material at the contact moves as the
    plane's does (Goldstein, section 1.3; Neimark and Fufaev, Dynamics of Nonholonomic Systems, chapter 1). The plane
    may itself move. Nothing keeps the body from pulling: a negative `normal_force` says that it would lift off.
    """

    spaces: ClassVar[tuple[str, ...]] = ("plane", "space")

    radius: Number = parameter(1.0, unit="m", above=0.0, doc="Radius.")
    normal: Triple = parameter((0.0, 0.0, 1.0), direction=True, doc="Normal of the plane in frame a, towards the body.")
    a: Frame = connector(Frame, "The frame that carries the plane; its origin is in it.")
    b: Frame = connector(Frame, "The frame of what rolls, at its centre.")

    def normal_in_world(self) -> Vector:
        """Return the normal of the plane in world axes."""
        return self.a.to_world(as_vector(self.normal))

    def directions(self) -> tuple[Vector, Vector]:
        """Return the two directions of the plane in frame a; in a plane scene the first one is to the right."""
        n = as_vector(self.normal)
        if self.in_space:
            return normals(n)
        return Vector(n.z, 0.0, -n.x), Vector(0.0, 1.0, 0.0)

    def height(self) -> Scalar:
        """Return the height of the centre above the plane while it touches, m."""
        raise NotImplementedError

    def to_center(self) -> Vector:
        """Return the vector from the contact to the centre in world axes, m."""
        raise NotImplementedError

    def slip(self) -> Vector:
        """Return the velocity of the body's material at the contact, less that of the plane's."""
        arm = self.to_center()
        of_body = self.b.velocity - cross(self.b.angular_velocity, arm)
        of_plane = self.a.velocity + cross(self.a.angular_velocity, self.b.position - arm - self.a.position)
        return of_body - of_plane

    @constraint(
        reaction="normal_force",
        unit="N",
        doc="Force on the body along the normal, at the contact; negative when pulled.",
        spaces=("plane", "space"),
    )
    def touching(self) -> Scalar:
        """Return the distance of body and plane."""
        return dot(self.b.position - self.a.position, self.normal_in_world()) - self.height()

    @constraint(
        reaction=("friction_1", "friction_2"),
        unit="N",
        doc="Force on the body along a direction of the plane, at the contact.",
        spaces=("space",),
    )
    def rolling(self) -> tuple[Scalar, Scalar]:
        """Return the velocity of slipping along the two directions of the plane."""
        slip = self.slip()
        first, second = self.directions()
        return dot(slip, self.a.to_world(first)), dot(slip, self.a.to_world(second))

    @constraint(
        reaction="friction",
        unit="N",
        doc="Force on the body along the line, at the contact; to the right of the normal.",
        spaces=("plane",),
    )
    def rolling_on_line(self) -> Scalar:
        """Return the velocity of slipping along the line."""
        return dot(self.slip(), self.a.to_world(self.directions()[0]))

    @joint("a", "b", coordinates=("displacement_1", "displacement_2"), solves=("touching",), spaces=("space",))
    def lie(self, displacement_1: Scalar, displacement_2: Scalar) -> Placement:
        """Place the centre above the plane, as high as the body's turn says."""
        first, second = self.directions()
        up = as_vector(self.normal) * self.height()
        return Placement(first * displacement_1 + second * displacement_2 + up, FREE, axes="a")

    @joint("a", "b", coordinates=("displacement",), solves=("touching",), spaces=("plane",))
    def lie_on_line(self, displacement: Scalar) -> Placement:
        """Place the centre above the line."""
        return Placement(self.directions()[0] * displacement + as_vector(self.normal) * self.height(), axes="a")

    @observable(
        unit="m", doc="Displacement of the centre along the line, to the right of the normal.", spaces=("plane",)
    )
    def displacement(self) -> Scalar:
        """Return the displacement."""
        return dot(self.b.position - self.a.position, self.a.to_world(self.directions()[0]))

    @observable(unit="m", doc="Displacement of the centre along the first direction of the plane.", spaces=("space",))
    def displacement_1(self) -> Scalar:
        """Return the displacement."""
        return dot(self.b.position - self.a.position, self.a.to_world(self.directions()[0]))

    @observable(unit="m", doc="Displacement of the centre along the second direction of the plane.", spaces=("space",))
    def displacement_2(self) -> Scalar:
        """Return the displacement."""
        return dot(self.b.position - self.a.position, self.a.to_world(self.directions()[1]))

    @observable(unit="m/s", doc="Rate of the displacement along the line.", spaces=("plane",))
    def speed(self) -> Scalar:
        """Return the velocity along the line."""
        return rate_along(self.a, self.b, self.directions()[0])

    @observable(unit="m/s", doc="Rate of the displacement along the first direction.", spaces=("space",))
    def speed_1(self) -> Scalar:
        """Return the velocity along the first direction."""
        return rate_along(self.a, self.b, self.directions()[0])

    @observable(unit="m/s", doc="Rate of the displacement along the second direction.", spaces=("space",))
    def speed_2(self) -> Scalar:
        """Return the velocity along the second direction."""
        return rate_along(self.a, self.b, self.directions()[1])

    @observable(unit="m", doc="Position of the contact in world axes.", spaces=("plane", "space"))
    def contact(self) -> Vector:
        """Return the position of the contact."""
        return self.b.position - self.to_center()

    @observable(
        unit="N", doc="Force of the plane on the body, at the contact, in world axes.", spaces=("plane", "space")
    )
    def force(self) -> Vector:
        """Return the force at the contact: the normal force and friction."""
        first, second = self.directions()
        pressed: Vector = self.normal_in_world() * self.reaction("normal_force")
        one, other = self.reaction("friction_1" if self.in_space else "friction"), 0.0
        if self.in_space:
            other = self.reaction("friction_2")
        whole: Vector = pressed + self.a.to_world(first) * one + self.a.to_world(second) * other
        return whole
