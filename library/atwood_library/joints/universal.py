"""Universal: a cross of two hinges."""

from __future__ import annotations

import math

from atwood import (
    Frame,
    ParameterError,
    Placement,
    Scalar,
    Shaft,
    Triple,
    Vector,
    as_vector,
    atan2,
    connector,
    constraint,
    cross,
    dot,
    joint,
    observable,
    parameter,
    turn,
)
from atwood_library.interfaces.loaded_cross import LoadedCross


class Universal(LoadedCross):
    """A universal joint (Hooke, Cardan): frame b turns about `axis_a` of frame a, and then about its own `axis_b`.

    The two axes meet at a right angle in a cross. Its `force` is what it exerts on frame b, `cross_torque` the torque
    on frame b about the common normal of the axes. Each hinge can carry a spring, a damper, a motor and stops. A part
    of space.
    """

    synonyms = (
        *("Hooke's joint", "Cardan joint", "U-joint", "Universal joint"),
        *("MultiBody.Joints.Constraints.Universal", "UniversalSpherical", "JointUPS", "JointUSR"),
        "JointUSP",
    )
    spaces = ("space",)

    axis_a: Triple = parameter((1.0, 0.0, 0.0), direction=True, doc="First axis, in frame a.")
    axis_b: Triple = parameter((0.0, 1.0, 0.0), direction=True, doc="Second axis, in frame b.")
    a: Frame = connector(Frame, "The frame that carries the joint.")
    b: Frame = connector(Frame, "The frame that moves.")
    shaft_a: Shaft = connector(Shaft, "The angle of the cross, where gears take hold of it.", of="angle_a")
    shaft_b: Shaft = connector(Shaft, "The angle from the cross, where gears take hold of it.", of="angle_b")

    def check_values(self) -> None:
        """Refuse axes that are not square to each other while the frames are not turned."""
        cosine = abs(float(dot(as_vector(self.axis_a), as_vector(self.axis_b))))
        if cosine > 1e-9:
            angle = math.degrees(math.acos(min(cosine, 1.0)))
            what = "parallel" if angle < 1e-3 else f"at {angle:.3g} degrees"
            raise ParameterError(
                f"the two axes of a universal joint are square to each other; these are {what} while its frames are "
                "turned alike",
                where=f"{self.path}.axis_b",
                advice="Give an axis_b square to axis_a, and turn frame b with a Weld where it is mounted askew.",
            )

    @constraint(reaction="force", unit="N", doc="Force exerted on frame b, in world axes.")
    def coincidence(self) -> Vector:
        """Return the distance of the two frames."""
        return self.b.position - self.a.position

    @constraint(
        reaction="cross_torque",
        unit="N*m",
        doc="Torque on frame b about the common normal of the axes (first, second, normal are right-handed).",
        spaces=("space",),
    )
    def squareness(self) -> Scalar:
        """Return minus the cosine between the axes."""
        return -dot(self.a.to_world(as_vector(self.axis_a)), self.b.to_world(as_vector(self.axis_b)))

    @joint("a", "b", coordinates=("angle_a", "angle_b"), solves=("coincidence", "squareness"), spaces=("space",))
    def turn_twice(self, angle_a: Scalar, angle_b: Scalar) -> Placement:
        """Place b at a, turned about both axes."""
        rotation = turn(as_vector(self.axis_a), angle_a).then(as_vector(self.axis_b), angle_b)
        return Placement(Vector(0.0, 0.0, 0.0), rotation, axes="a")

    @observable(unit="rad", doc="Angle of the cross from frame a.", periodic=True, rate="rate_a", spaces=("space",))
    def angle_a(self) -> Scalar:
        """Return the angle about the first axis: of the second axis from where it is without a turn."""
        first, second = as_vector(self.axis_a), as_vector(self.axis_b)
        now = self.b.to_world(second)
        return atan2(dot(now, self.a.to_world(cross(first, second))), dot(now, self.a.to_world(second)))

    @observable(unit="rad", doc="Angle of frame b from the cross.", periodic=True, rate="rate_b", spaces=("space",))
    def angle_b(self) -> Scalar:
        """Return the angle about the second axis: of frame b from the first axis."""
        first, second = as_vector(self.axis_a), as_vector(self.axis_b)
        now = self.a.to_world(first)
        return atan2(dot(now, self.b.to_world(cross(first, second))), dot(now, self.b.to_world(first)))

    @observable(unit="rad/s", doc="Rate of the angle of the cross from frame a.", spaces=("space",))
    def rate_a(self) -> Scalar:
        """Return the relative angular velocity along the first axis."""
        spin = self.b.angular_velocity - self.a.angular_velocity
        return dot(spin, self.a.to_world(as_vector(self.axis_a)))

    @observable(unit="rad/s", doc="Rate of the angle of frame b from the cross.", spaces=("space",))
    def rate_b(self) -> Scalar:
        """Return the relative angular velocity along the second axis."""
        spin = self.b.angular_velocity - self.a.angular_velocity
        return dot(spin, self.b.to_world(as_vector(self.axis_b)))
