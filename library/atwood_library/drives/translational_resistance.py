"""TranslationalResistance: a force against the speed, as a function of it."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import Component, CoordinateLoad, Number, Scalar, Slide, connector, force, observable, parameter, signal
from atwood_library.interfaces.along_coordinates import between, push, resistance


class TranslationalResistance(Component):
    """A force against the speed of one displacement past another, or past the ground, as a function of the speed v.

    It is ``level (linear v + quadratic v |v| + constant v/|v| + power/v)``. Below `smooth_below` the last two are
    proportional to the speed, and meet there what they are above it: they slow down and hold nothing, as dry friction
    would. The input `level` is a command or a load.
    """

    synonyms = (
        *("LinearSpeedDependentForce", "QuadraticSpeedDependentForce", "InverseSpeedDependentForce"),
        *("SignForce", "RollingResistance", "Translational.Sources.EddyCurrentForce"),
    )

    linear: Number = parameter(0.0, unit="N*s/m", minimum=0.0, doc="Force for a unit of speed.", symbol="b")
    quadratic: Number = parameter(
        0.0, unit="N*s^2/m^2", minimum=0.0, doc="Force for the square of a unit of speed.", symbol="b_2"
    )
    constant: Number = parameter(0.0, unit="N", minimum=0.0, doc="Force at any speed.", symbol="F_0")
    power: Number = parameter(0.0, unit="W", minimum=0.0, doc="Power that is taken at any speed.", symbol="P")
    smooth_below: Number = parameter(
        1e-3, unit="m/s", above=0.0, doc="Speed below which what does not vanish with the speed is proportional to it."
    )
    level: Number = signal(1.0, doc="What all of it is multiplied by.")
    against: str = parameter("ground", choices=("flange", "ground"), doc="What it acts against.")
    a: Slide = connector(Slide, "The displacement that it acts against.", when={"against": ("flange",)})
    b: Slide = connector(Slide, "The displacement that it acts on.")

    @force
    def slow_down(self) -> Iterable[CoordinateLoad]:
        """Return what acts against the speed."""
        yield from push(self, -self.force())

    @observable(unit="N", doc="Force against the speed.")
    def force(self) -> Scalar:
        """Return the force."""
        return resistance(self, between(self)[1])
