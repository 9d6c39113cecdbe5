"""EnergySensor: the energy of the model that it is placed in."""

from __future__ import annotations

from atwood import Component, Scalar, observable


class EnergySensor(Component):
    """Measures the energy of all parts of the model that it is placed in."""

    @observable(unit="J", doc="Kinetic energy of the model.")
    def kinetic(self) -> Scalar:
        """Return the kinetic energy."""
        return self.total_around("kinetic")

    @observable(unit="J", doc="Potential energy of the model, weight and springs.")
    def potential(self) -> Scalar:
        """Return the potential energy."""
        return self.total_around("potential")

    @observable(unit="J", doc="Kinetic and potential energy of the model.")
    def total(self) -> Scalar:
        """Return the energy."""
        return self.total_around("kinetic") + self.total_around("potential")
