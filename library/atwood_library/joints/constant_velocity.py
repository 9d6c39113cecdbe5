"""ConstantVelocity: a homokinetic joint."""

from __future__ import annotations

from atwood import FREE, Frame, Placement, Scalar, Vector, connector, constraint, dot, joint
from atwood_library.interfaces.loaded_ball import LoadedBall


class ConstantVelocity(LoadedBall):
    """A constant-velocity joint between two shafts along z: they bend against each other and turn equally fast.

    Bent about any axis square to both shafts, frame b is frame a turned by that bend alone. Its `force` is what it
    exerts on frame b, `shaft_torque` the torque that it passes on. It can carry a spring, a damper and
    motors against the bend, and a cone as a stop. A part of space.
    """

    synonyms = ("Constant velocity joint", "Homokinetic joint", "Rzeppa joint")
    spaces = ("space",)

    a: Frame = connector(Frame, "The frame that carries the joint.")
    b: Frame = connector(Frame, "The frame that moves.")

    @constraint(reaction="force", unit="N", doc="Force exerted on frame b, in world axes.")
    def coincidence(self) -> Vector:
        """Return the distance of the two frames."""
        return self.b.position - self.a.position

    @constraint(
        reaction="shaft_torque", unit="N*m", doc="Torque on frame b, about the mean of the shafts.", spaces=("space",)
    )
    def no_twist(self) -> Scalar:
        """Return by how much b is twisted beyond the bend: half the antisymmetric part of the two turned axes."""
        return 0.5 * (dot(self.a.axes[1], self.b.axes[0]) - dot(self.a.axes[0], self.b.axes[1]))

    @joint("a", "b", solves=("coincidence",), spaces=("space",))
    def meet(self) -> Placement:
        """Place b at a."""
        return Placement(Vector(0.0, 0.0, 0.0), FREE)
