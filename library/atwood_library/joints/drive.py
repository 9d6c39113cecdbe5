"""Drive: a prescribed displacement between two frames."""

from __future__ import annotations

from atwood import (
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
    joint,
    observable,
    parameter,
    signal,
)
from atwood_library.interfaces.bearings import frames_parallel


class Drive(Component):
    """A drive that moves frame b along an axis of frame a, as a given function of time (a rheonomous constraint).

    It does whatever work is needed; its `force` and `torque` are what it exerts on frame b.
    """

    synonyms = ("Rheonomic constraint", "Prismatic with prescribed motion", "Actuator")

    axis: Triple = parameter((1.0, 0.0, 0.0), direction=True, doc="Direction of the motion in frame a.")
    motion: Number = signal(0.0, unit="m", doc="Displacement of frame b along the axis, a function of time.")
    a: Frame = connector(Frame, "The frame that carries the drive.")
    b: Frame = connector(Frame, "The frame that is moved.")

    @constraint(reaction="force", unit="N", doc="Force exerted on frame b, in world axes.")
    def track(self) -> Vector:
        """Return the distance of frame b from where it should be."""
        return self.b.position - self.a.position - self.a.to_world(as_vector(self.axis) * self.motion)

    @constraint(reaction="torque", unit="N*m", doc="Torque on frame b, counter-clockwise.", spaces=("line", "plane"))
    def lock(self) -> Scalar:
        """Return the angle between the frames."""
        return self.b.angle - self.a.angle

    @constraint(
        reaction=("lock_1", "lock_2", "lock_3"),
        unit="N*m",
        doc="Multiplier of the guide: torque on frame b about an axis of frame a.",
        spaces=("space",),
    )
    def lock_in_space(self) -> tuple[Scalar, Scalar, Scalar]:
        """Return by how much the frames are turned against each other."""
        return frames_parallel(self.a, self.b)

    @joint("a", "b", solves=("track", "lock"), spaces=("line", "plane"))
    def move(self) -> Placement:
        """Place b as prescribed."""
        return Placement(as_vector(self.axis) * self.motion, 0.0, axes="a")

    @joint("a", "b", solves=("track", "lock_in_space"), spaces=("space",))
    def move_in_space(self) -> Placement:
        """Place b as prescribed."""
        return Placement(as_vector(self.axis) * self.motion, 0.0, axes="a")

    @observable(unit="m", doc="Prescribed displacement.")
    def displacement(self) -> Scalar:
        """Return the prescribed displacement."""
        return self.motion
