"""Slider: a straight guide between two frames."""

from __future__ import annotations

from atwood import (
    Frame,
    Placement,
    Scalar,
    Slide,
    Triple,
    Vector,
    as_vector,
    connector,
    constraint,
    dot,
    joint,
    normals,
    observable,
    parameter,
)
from atwood_library.interfaces.bearings import frames_parallel, rate_along, sideways, unturned_torque
from atwood_library.interfaces.loaded_slide import LoadedSlide


class Slider(LoadedSlide):
    """A guide: frame b moves along an axis of frame a and does not turn against it (a prismatic joint).

    What it exerts on frame b is in a plane `side_force`, along the axis turned by a quarter turn, and `torque`,
    counter-clockwise; in space the vectors `guide_force` and `guide_torque`, in world axes. It can carry a spring, a
    damper, an actuator and stops.
    """

    synonyms = (
        *("Prismatic", "Prismatic joint", "Guide", "MultiBody.Joints.Constraints.Prismatic"),
        *("JointUPS", "JointUSP", "JointSSP", "JointRRP"),
    )

    axis: Triple = parameter(
        (1.0, 0.0, 0.0),
        direction=True,
        doc="Direction of the guide in frame a.",
    )
    a: Frame = connector(Frame, "The frame that carries the guide.")
    b: Frame = connector(Frame, "The frame that slides.")
    carriage: Slide = connector(Slide, "The displacement, where gears take hold of it.", of="displacement")

    def normal(self) -> Vector:
        """Return, in a plane, the axis turned counter-clockwise by a quarter turn, in the axes of frame a."""
        axis = as_vector(self.axis)
        return Vector(-axis.z, 0.0, axis.x)

    def axis_in_world(self) -> Vector:
        """Return the direction of the guide in world axes."""
        return self.a.to_world(as_vector(self.axis))

    @constraint(
        reaction="side_force",
        unit="N",
        doc="Force exerted on frame b, along the axis turned by a quarter turn.",
        spaces=("line", "plane"),
    )
    def guide(self) -> Scalar:
        """Return the distance from the axis."""
        return dot(self.b.position - self.a.position, self.a.to_world(self.normal()))

    @constraint(
        reaction="torque", unit="N*m", doc="Torque exerted on frame b, counter-clockwise.", spaces=("line", "plane")
    )
    def lock(self) -> Scalar:
        """Return the angle between the frames."""
        return self.b.angle - self.a.angle

    @constraint(
        reaction=("guide_1", "guide_2"),
        unit="N",
        doc="Multiplier of the guide: force on frame b along a normal of the axis.",
        spaces=("space",),
    )
    def guide_in_space(self) -> tuple[Scalar, Scalar]:
        """Return the distance from the axis along its two normals."""
        return sideways(self.a, self.b, as_vector(self.axis))

    @constraint(
        reaction=("lock_1", "lock_2", "lock_3"),
        unit="N*m",
        doc="Multiplier of the guide: torque on frame b about an axis of frame a.",
        spaces=("space",),
    )
    def lock_in_space(self) -> tuple[Scalar, Scalar, Scalar]:
        """Return by how much the frames are turned against each other."""
        return frames_parallel(self.a, self.b)

    @joint("a", "b", coordinates=("displacement",), solves=("guide", "lock"), spaces=("line", "plane"))
    def slide(self, displacement: Scalar) -> Placement:
        """Place b along the axis."""
        return Placement(as_vector(self.axis) * displacement, 0.0, axes="a")

    @joint("a", "b", coordinates=("displacement",), solves=("guide_in_space", "lock_in_space"), spaces=("space",))
    def slide_in_space(self, displacement: Scalar) -> Placement:
        """Place b along the axis."""
        return Placement(as_vector(self.axis) * displacement, 0.0, axes="a")

    @observable(unit="m", doc="Distance of frame b from frame a along the axis.", rate="speed")
    def displacement(self) -> Scalar:
        """Return the displacement."""
        return dot(self.b.position - self.a.position, self.a.to_world(as_vector(self.axis)))

    @observable(unit="m/s", doc="Rate of the displacement.")
    def speed(self) -> Scalar:
        """Return the rate of the displacement, as seen from frame a."""
        return rate_along(self.a, self.b, as_vector(self.axis))

    @observable(unit="N", doc="Force of the guide on frame b, in world axes.", spaces=("space",))
    def guide_force(self) -> Vector:
        """Return the force of the guide."""
        first, second = normals(as_vector(self.axis))
        along = self.a.to_world(first) * self.reaction("guide_1")
        total: Vector = along + self.a.to_world(second) * self.reaction("guide_2")
        return total

    @observable(unit="N*m", doc="Torque of the guide on frame b, in world axes.", spaces=("space",))
    def guide_torque(self) -> Vector:
        """Return the torque of the guide."""
        reactions = self.reaction("lock_1"), self.reaction("lock_2"), self.reaction("lock_3")
        return unturned_torque(self.a, reactions)
