"""TranslationalCoupling: two displacements joined rigidly, and what passes between them."""

from __future__ import annotations

from atwood import Component, Number, Scalar, Slide, connector, constraint, observable, parameter


class TranslationalCoupling(Component):
    """Two displacements joined rigidly, as flanges bolted together; it measures the force and the power that pass."""

    synonyms = (
        *("Translational.Sensors.ForceSensor", "Translational.Sensors.PowerSensor", "Force cell"),
        *("Flange connection", "Translational.Components.Rod"),
    )

    offset: Number = parameter(0.0, unit="m", doc="By how much b is ahead of a.")
    a: Slide = connector(Slide, "One displacement.")
    b: Slide = connector(Slide, "The other displacement.")

    @constraint(reaction="force", unit="N", doc="Force that a exerts on b.")
    def joined(self) -> Scalar:
        """Return by how much they are off."""
        return self.b.value - self.a.value - self.offset

    @observable(unit="W", doc="Power that passes from a to b.")
    def power(self) -> Scalar:
        """Return the power."""
        return self.reaction("force") * self.b.rate
