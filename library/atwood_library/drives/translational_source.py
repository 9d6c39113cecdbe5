"""TranslationalSource: a given force on a displacement."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import Component, CoordinateLoad, Scalar, Slide, connector, force, observable, parameter, signal
from atwood_library.interfaces.along_coordinates import between, push


class TranslationalSource(Component):
    """A given force on a displacement, with its reaction on another one or on the ground: an actuator."""

    synonyms = (
        *("Translational.Sources.Force", "Force source", "Force2", "ConstantForce", "Ideal motor"),
        *("Translational.Sources.ForceStep", "ForceToPositionAdaptor"),
    )

    value: float = signal(0.0, unit="N", doc="The force, positive where it makes b grow.")
    against: str = parameter("ground", choices=("flange", "ground"), doc="What it acts against.")
    a: Slide = connector(Slide, "The displacement that it acts against.", when={"against": ("flange",)})
    b: Slide = connector(Slide, "The displacement that it acts on.")

    @force
    def act(self) -> Iterable[CoordinateLoad]:
        """Return the force."""
        yield from push(self, self.value)

    @observable(unit="N", doc="The force.")
    def force(self) -> Scalar:
        """Return the force."""
        return self.value

    @observable(unit="W", doc="Power of the force.")
    def power(self) -> Scalar:
        """Return the power."""
        return self.value * between(self)[1]
