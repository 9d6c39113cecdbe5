"""WoundRope: a rope whose one end is wound on a drum."""

from __future__ import annotations

from atwood import (
    Component,
    Frame,
    Number,
    Point,
    Scalar,
    Triple,
    Vector,
    as_vector,
    atan2,
    connector,
    constraint,
    cross,
    dot,
    event,
    observable,
    parameter,
    sqrt,
)


class WoundRope(Component):
    """A rope from a point to a drum on which it is wound without slipping: one side of a heavy pulley.

    Two of them, wound either way on one wheel, are a rope over a pulley: the tensions differ as the wheel's inertia
    asks, the angle of contact changes as the ends move, and so do the points where the rope leaves the wheel. With an
    axle that is driven it is a winch. Lengths are those of the straight piece and of what is on the drum: with the
    distance d of the point from the axis, ``sqrt(d^2 - R^2) + R (turn of the drum - direction of the tangent point)``.
    It unwinds as the drum turns counter-clockwise, or clockwise.
    """

    synonyms = ("Winch", "Drum", "Pulley with inertia", "Rope on a wheel")
    spaces = ("plane",)

    radius: Number = parameter(0.1, unit="m", above=0.0, doc="Radius of the drum.")
    length: Number = parameter(
        1.0,
        unit="m",
        doc="Length of the straight piece where the drum's angle is zero and the rope leaves along the direction.",
    )
    direction: Triple = parameter(
        (0.0, 0.0, -1.0), direction=True, doc="About where the rope leaves to, in world axes; within half a turn."
    )
    unwinds: str = parameter(
        "counter-clockwise", choices=("counter-clockwise", "clockwise"), doc="How the drum turns to let the rope out."
    )
    drum: Frame = connector(Frame, "The frame of the drum, on its axis.")
    end: Point = connector(Point, "The end of the rope.")

    def sense(self) -> float:
        """Return +1 where turning counter-clockwise lets the rope out."""
        return 1.0 if self.unwinds == "counter-clockwise" else -1.0

    def arm(self) -> Vector:
        """Return the way from the axis to the end."""
        arm: Vector = self.end.position - self.drum.position
        return arm

    @observable(unit="m", doc="Length of the straight piece.", spaces=("plane",))
    def straight(self) -> Scalar:
        """Return the length of the tangent."""
        return sqrt(dot(self.arm(), self.arm()) - self.radius * self.radius)

    @observable(
        unit="rad",
        doc="Direction of the straight piece from its direction at zero, counter-clockwise.",
        spaces=("plane",),
    )
    def swing(self) -> Scalar:
        """Return the angle of the tangent: that of the arm, and that between arm and tangent."""
        arm, along = self.arm(), as_vector(self.direction)
        return angle_from(along, arm) + atan2(self.sense() * self.radius, self.straight())

    @constraint(reaction="tension", unit="N", sign=-1.0, doc="Tension of the rope.", spaces=("plane",))
    def fixed_length(self) -> Scalar:
        """Return by how much the rope is longer than it is."""
        wound = self.sense() * self.radius * (self.drum.angle - self.swing())
        return self.straight() - wound - self.length

    @event(direction=-1, unit="N", target="stop", message="the rope has gone slack", spaces=("plane",))
    def goes_slack(self) -> Scalar:
        """Return the tension."""
        return self.reaction("tension")


def angle_from(along: Vector, arm: Vector) -> Scalar:
    """Return the angle of an arm from a direction, counter-clockwise as seen on the page."""
    return atan2(-1.0 * cross(along, arm).y, dot(along, arm))
