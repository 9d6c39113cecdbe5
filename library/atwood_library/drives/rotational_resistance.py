"""RotationalResistance: a torque against the speed, as a function of it."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import Component, CoordinateLoad, Number, Scalar, Shaft, connector, force, observable, parameter, signal
from atwood_library.interfaces.along_coordinates import between, push, resistance


class RotationalResistance(Component):
    """A torque against the speed of one angle past another, or past the ground, as a function of the speed v.

    It is ``level (linear v + quadratic v |v| + constant v/|v| + power/v)``. Below `smooth_below` the last two are
    proportional to the speed, and meet there what they are above it: they slow down and hold nothing, as dry friction
    would. The input `level` is a command or a load.
    """

    synonyms = (
        *("LinearSpeedDependentTorque", "QuadraticSpeedDependentTorque"),
        *("InverseSpeedDependentTorque", "SignTorque", "Rotational.Sources.EddyCurrentTorque"),
    )
    spaces = ("plane", "space")

    linear: Number = parameter(0.0, unit="N*m*s/rad", minimum=0.0, doc="Torque for a unit of speed.", symbol="b")
    quadratic: Number = parameter(
        0.0,
        unit="N*m*s^2/rad^2",
        minimum=0.0,
        doc="Torque for the square of a unit of speed.",
        symbol="b_2",
    )
    constant: Number = parameter(0.0, unit="N*m", minimum=0.0, doc="Torque at any speed.", symbol="M_0")
    power: Number = parameter(0.0, unit="W", minimum=0.0, doc="Power that is taken at any speed.", symbol="P")
    smooth_below: Number = parameter(
        1e-3,
        unit="rad/s",
        above=0.0,
        doc="Speed below which what does not vanish with the speed is proportional to it.",
    )
    level: Number = signal(1.0, doc="What all of it is multiplied by.")
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
        return resistance(self, between(self)[1])
