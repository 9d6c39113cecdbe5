"""ForceSensor: the force and the torque that pass through a rigid connection."""

from __future__ import annotations

from atwood import Frame, Placement, Vector, connector, joint, observable
from atwood_library.interfaces.resolved import Resolved


class ForceSensor(Resolved):
    """Joins two frames rigidly and measures what passes between them.

    Its `force` and `torque` are what is exerted on frame b and everything that hangs on it, in world axes;
    `resolved_force` and `resolved_torque` are the same in the axes that are asked for.
    """

    synonyms = ("CutForceAndTorque", "CutForce", "CutTorque", "MultiBody.Sensors.Power", "Load cell")

    a: Frame = connector(Frame, "One side.")
    b: Frame = connector(Frame, "The other side.")

    @joint("a", "b", rigid=True, spaces=("line", "plane", "space"), reaction="exerted on frame b")
    def cut(self) -> Placement:
        """Place b at a."""
        return Placement(Vector(0.0, 0.0, 0.0), 0.0)

    @observable(unit="N", doc="Force exerted on frame b, in the axes that are asked for.", spaces=("plane", "space"))
    def resolved_force(self) -> Vector:
        """Return the force."""
        y = self.reaction("force.y") if self.in_space else 0.0
        return self.resolved(Vector(self.reaction("force.x"), y, self.reaction("force.z")))

    @observable(unit="N*m", doc="Torque exerted on frame b, in the axes that are asked for.", spaces=("space",))
    def resolved_torque(self) -> Vector:
        """Return the torque."""
        return self.resolved(Vector(*(self.reaction(f"torque.{axis}") for axis in "xyz")))
