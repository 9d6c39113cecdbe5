"""RollingOnRound: a ball that rolls on, or in, a cylinder or a sphere."""

from __future__ import annotations

from atwood import (
    Component,
    Frame,
    Number,
    Outline,
    Scalar,
    Triple,
    Vector,
    as_vector,
    connector,
    constraint,
    cross,
    dot,
    normals,
    observable,
    parameter,
    sqrt,
)


class RollingOnRound(Component):
    """A ball rolls without slipping on a cylinder or a sphere, outside or inside, which may itself move.

    Its centre stays at the distance ``R + r`` from the middle of what it rolls on, or ``R - r`` inside. In a plane it
    is a disc on a circle. Friction is along two directions that come from those at the `pole` by the shortest turn, so
    that only where the ball is on the opposite side are they not known; the pole of a bowl is its lowest place.
    """

    synonyms = ("Rolling inside a sphere", "Rolling on a cylinder", "Ball in a bowl")
    spaces = ("plane", "space")

    shape: str = parameter("sphere", choices=("sphere", "cylinder"), doc="What it rolls on; in a plane a circle.")
    rolls: str = parameter("inside", choices=("inside", "outside"), doc="Whether it rolls in it or on it.")
    ground_radius: Number = parameter(1.0, unit="m", above=0.0, doc="Radius R of what it rolls on.", symbol="R")
    radius: Number = parameter(0.1, unit="m", above=0.0, doc="Radius r of the ball.")
    axis: Triple = parameter(
        (0.0, 1.0, 0.0), turning=True, doc="Axis of a cylinder, in frame a; in a plane its normal."
    )
    pole: Triple = parameter(
        (0.0, 0.0, 1.0), direction=True, doc="Direction, in frame a, from the contact to the ball near which it rolls."
    )
    a: Frame = connector(Frame, "The frame in the middle of what it rolls on.")
    b: Frame = connector(Frame, "The frame of the ball, at its centre.")

    def outline(self) -> Outline:
        """Return what it looks like: the way of the ball's centre."""
        return Outline.path("b")

    def arm(self) -> Vector:
        """Return the way from the middle, or from the axis, to the centre of the ball, in world axes."""
        arm: Vector = self.b.position - self.a.position
        if self.shape == "sphere" or not self.in_space:
            return arm
        axis = self.a.to_world(as_vector(self.axis))
        across: Vector = arm - axis * dot(arm, axis)
        return across

    def reach(self) -> Scalar:
        """Return how far the centre is from the middle."""
        return self.ground_radius - self.radius if self.rolls == "inside" else self.ground_radius + self.radius

    def normal(self) -> Vector:
        """Return the direction from the contact to the centre, in world axes."""
        arm = self.arm()
        size = sqrt(dot(arm, arm))
        unit: Vector = arm * ((-1.0 if self.rolls == "inside" else 1.0) / size)
        return unit

    def directions(self) -> tuple[Vector, Vector]:
        """Return two directions across the normal: those across the pole, turned with it into the normal."""
        n, pole = self.normal(), self.a.to_world(as_vector(self.pole))
        if not self.in_space:
            return Vector(n.z, 0.0, -1.0 * n.x), Vector(0.0, 1.0, 0.0)
        first, second = normals(as_vector(self.pole))
        middle, share = n + pole, 1.0 + dot(n, pole)
        one, two = (e - middle * (dot(n, e) / share) for e in (self.a.to_world(first), self.a.to_world(second)))
        return one, two

    def slip(self) -> Vector:
        """Return the velocity of the ball's material at the contact, less that of what it rolls on."""
        arm = self.normal() * self.radius
        of_ball = self.b.velocity - cross(self.b.angular_velocity, arm)
        of_ground = self.a.velocity + cross(self.a.angular_velocity, self.b.position - arm - self.a.position)
        return of_ball - of_ground

    @constraint(
        reaction="normal_force",
        unit="N",
        doc="Force on the ball at the contact, towards its centre; negative when pulled.",
        sign=1.0,
        spaces=("plane", "space"),
    )
    def touching(self) -> Scalar:
        """Return ``(d^2 - D^2)/(2 D)`` with the distance d and what it should be, towards the ball."""
        arm, reach = self.arm(), self.reach()
        return (dot(arm, arm) * (0.5 / reach) - 0.5 * reach) * (-1.0 if self.rolls == "inside" else 1.0)

    @constraint(
        reaction=("friction_1", "friction_2"),
        unit="N",
        doc="Force on the ball along a direction of the surface, at the contact.",
        spaces=("space",),
    )
    def rolling(self) -> tuple[Scalar, Scalar]:
        """Return the velocity of slipping along the two directions."""
        slip, (first, second) = self.slip(), self.directions()
        return dot(slip, first), dot(slip, second)

    @constraint(
        reaction="friction",
        unit="N",
        doc="Force on the ball along the circle, at the contact; to the right of the normal.",
        spaces=("plane",),
    )
    def rolling_in_plane(self) -> Scalar:
        """Return the velocity of slipping."""
        return dot(self.slip(), self.directions()[0])

    @observable(unit="m", doc="Position of the contact in world axes.", spaces=("plane", "space"))
    def contact(self) -> Vector:
        """Return the position of the contact."""
        return self.b.position - self.normal() * self.radius
