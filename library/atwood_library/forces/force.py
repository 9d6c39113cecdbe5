"""Force: an applied force in a given direction."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import (
    Component,
    Frame,
    Load,
    Number,
    Point,
    Scalar,
    Triple,
    Vector,
    as_vector,
    connector,
    force,
    observable,
    parameter,
    signal,
)


class Force(Component):
    """A force on a point, in a direction that is fixed in the world or in a frame, as a given function of time.

    With ``resolved_in="world"`` it acts at `point`, and its direction is fixed in the world. With ``"body"`` it acts at
    `frame`, and its direction turns with it (a thruster). With ``"other"`` it acts at `point`, and its direction is
    fixed in the frame `other`, on which it does not act.
    """

    synonyms = ("WorldForce", "Applied force", "Thruster", "WorldForceAndTorque", "ForceAndTorque")

    direction: Triple = parameter((1.0, 0.0, 0.0), direction=True, doc="Direction, in the axes that it is resolved in.")
    resolved_in: str = parameter(
        "world", choices=("world", "body", "other"), doc="The axes in which the direction is given."
    )
    value: Number = signal(0.0, unit="N", doc="Force along the direction, a function of time.")
    point: Point = connector(Point, "Where the force acts.", when={"resolved_in": ("world", "other")})
    frame: Frame = connector(Frame, "Where the force acts, and what it turns with.", when={"resolved_in": ("body",)})
    other: Frame = connector(Frame, "The frame that the direction is given in.", when={"resolved_in": ("other",)})

    def place(self) -> Point:
        """Return where it acts."""
        return self.frame if self.resolved_in == "body" else self.point

    def in_world(self) -> Vector:
        """Return the direction in world axes."""
        direction = as_vector(self.direction)
        if self.resolved_in == "world":
            return direction
        return (self.frame if self.resolved_in == "body" else self.other).to_world(direction)

    @force
    def applied_force(self) -> Iterable[Load]:
        """Return the load."""
        yield Load(self.place(), self.in_world() * self.value)

    @observable(unit="N", doc="Force along the direction.")
    def force(self) -> Scalar:
        """Return the force."""
        return self.value

    @observable(unit="N", doc="Force in world axes.")
    def force_in_world(self) -> Vector:
        """Return the force as a vector."""
        return self.in_world() * self.value

    @observable(unit="m", doc="Where it acts.")
    def position(self) -> Vector:
        """Return the position."""
        return self.place().position
