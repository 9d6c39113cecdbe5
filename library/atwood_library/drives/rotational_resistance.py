"""RotationalResistance: a torque against the speed, linear and quadratic in it."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import Component, CoordinateLoad, Scalar, Shaft, connector, force, observable, parameter
from atwood_library.interfaces.along_coordinates import between, push, resistance


class RotationalResistance(Component):
    """A torque against the speed of one angle past another, or past the ground, linear and quadratic in it."""

    synonyms = ("LinearSpeedDependentTorque", "QuadraticSpeedDependentTorque")
    spaces = ("plane", "space")

    linear: float = parameter(0.0, unit="N*m*s/rad", minimum=0.0, doc="Torque for a unit of speed.")
    quadratic: float = parameter(
        0.0, unit="N*m*s^2/rad^2", minimum=0.0, doc="Torque for the square of a unit of speed."
    )
    against: str = parameter("ground", choices=("flange", "ground"), doc="What it acts against.")
    a: Shaft = connector(Shaft, "The angle that it acts against.", when={"against": ("flange",)})
    b: Shaft = connector(Shaft, "The angle that it acts on.")

    @force
    def slow_down(self) -> Iterable[CoordinateLoad]:
        """Return what acts against the speed."""
        yield from push(self, -self.torque())

    @observable(unit="N*m", doc="Torque against the speed.")
    def torque(self) -> Scalar:
        """Return the torque."""
        return resistance(between(self)[1], self.linear, self.quadratic)
