"""PlanetaryGear: sun, ring and carrier of an epicyclic gear, without its planets."""

from __future__ import annotations

from atwood import Component, Number, Scalar, Shaft, connector, constraint, observable, parameter


class PlanetaryGear(Component):
    """An ideal epicyclic gear whose sun, ring and carrier turn about one axis, against the same frame.

    Willis's equation: seen from the carrier, the sun turns ``-ratio`` times as fast as the ring,
    ``(sun - carrier) + ratio * (ring - carrier) = offset`` (Shigley, Mechanical Engineering Design, planetary gear
    trains). Planets that have inertia are bodies of their own: hinges on the carrier, with a `Gear` for each mesh.
    """

    synonyms = ("IdealPlanetary", "Epicyclic gear")

    ratio: Number = parameter(2.0, above=0.0, doc="Teeth of the ring over teeth of the sun.")
    offset: Number = parameter(0.0, unit="rad", doc="Angle of the sun where carrier and ring are at zero.")
    sun: Shaft = connector(Shaft, "The angle of the sun's joint.")
    carrier: Shaft = connector(Shaft, "The angle of the carrier's joint.")
    ring: Shaft = connector(Shaft, "The angle of the ring's joint.")

    @constraint(reaction="sun_torque", unit="N*m", doc="Torque of the gear on the sun, about its axis.")
    def mesh(self) -> Scalar:
        """Return by how much Willis's equation is missed."""
        total = self.sun.value + self.ratio * self.ring.value
        return total - (1.0 + self.ratio) * self.carrier.value - self.offset

    @observable(unit="N*m", doc="Torque of the gear on the ring, about its axis.")
    def ring_torque(self) -> Scalar:
        """Return the torque on the ring."""
        return self.ratio * self.reaction("sun_torque")

    @observable(unit="N*m", doc="Torque of the gear on the carrier, about its axis.")
    def carrier_torque(self) -> Scalar:
        """Return the torque on the carrier: the three add up to zero."""
        return -((1.0 + self.ratio) * self.reaction("sun_torque"))
