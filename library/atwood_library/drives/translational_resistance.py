"""TranslationalResistance: a force against the speed, linear and quadratic in it."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import Component, CoordinateLoad, Scalar, Slide, connector, force, observable, parameter
from atwood_library.interfaces.along_coordinates import between, push, resistance


class TranslationalResistance(Component):
    """A force against the speed of one displacement past another, or past the ground, linear and quadratic in it."""

    synonyms = ("LinearSpeedDependentForce", "QuadraticSpeedDependentForce")

    linear: float = parameter(0.0, unit="N*s/m", minimum=0.0, doc="Force for a unit of speed.")
    quadratic: float = parameter(0.0, unit="N*s^2/m^2", minimum=0.0, doc="Force for the square of a unit of speed.")
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
        return resistance(between(self)[1], self.linear, self.quadratic)
