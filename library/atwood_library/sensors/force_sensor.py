"""ForceSensor: the force and the torque that pass through a rigid connection."""

from __future__ import annotations

from atwood import Component, Frame, Placement, Vector, connector, joint


class ForceSensor(Component):
    """Joins two frames rigidly and measures what passes between them.

    Its `force` and `torque` are what is exerted on frame b and everything that hangs on it.
    """

    synonyms = ("CutForceAndTorque", "CutForce", "CutTorque")

    a: Frame = connector(Frame, "One side.")
    b: Frame = connector(Frame, "The other side.")

    @joint("a", "b", rigid=True, spaces=("line", "plane", "space"), reaction="exerted on frame b")
    def cut(self) -> Placement:
        """Place b at a."""
        return Placement(Vector(0.0, 0.0, 0.0), 0.0)
