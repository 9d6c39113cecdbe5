"""RackAndPinion: a fixed ratio between the displacement of one joint and the angle of another."""

from __future__ import annotations

from atwood import Component, Number, Scalar, Shaft, Slide, connector, constraint, observable, parameter


class RackAndPinion(Component):
    """An ideal rack and pinion between a joint that slides and one that turns.

    ``displacement = radius * angle + offset``; a negative radius puts the rack on the pinion's other side.
    """

    synonyms = ("IdealGearR2T", "Rack and pinion", "IdealRollingWheel")

    radius: Number = parameter(1.0, unit="m", doc="Displacement of the rack for one radian of the pinion.")
    offset: Number = parameter(0.0, unit="m", doc="Displacement of the rack where the pinion's angle is zero.")
    rack: Slide = connector(Slide, "The displacement of the rack's joint.")
    pinion: Shaft = connector(Shaft, "The angle of the pinion's joint.")

    @constraint(reaction="force", unit="N", doc="Force of the teeth on the rack, along its axis.")
    def mesh(self) -> Scalar:
        """Return by how much displacement and angle are out of their ratio."""
        return self.rack.value - self.radius * self.pinion.value - self.offset

    @observable(unit="N*m", doc="Torque of the teeth on the pinion, about its axis.")
    def torque(self) -> Scalar:
        """Return the torque, which does the opposite work."""
        return -(self.radius * self.reaction("force"))
