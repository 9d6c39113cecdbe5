"""TranslationalSource: a given force on a displacement."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from atwood import Component, CoordinateLoad, Number, Scalar, Slide, connector, force, observable, parameter, signal
from atwood_library.interfaces.along_coordinates import between, push


class TranslationalSource(Component):
    """A given force on a displacement, with its reaction on another one or on the ground: an actuator.

    It is the input `value`, and what a law says: a function of the displacement x, of its rate v and of the time.
    """

    synonyms = (
        *("Translational.Sources.Force", "Force source", "Force2", "ConstantForce", "Ideal motor", "Nonlinear spring"),
        *("Translational.Sources.ForceStep", "ForceToPositionAdaptor"),
    )

    value: Number = signal(0.0, unit="N", doc="The force, positive where it makes b grow.")
    law: Any = parameter(
        0.0,
        unit="N",
        function_of={"x": "m", "v": "m/s", "t": "s"},
        doc="A function of displacement, rate and time, besides: '-2*x**3 - 0.1*v'.",
    )
    against: str = parameter("ground", choices=("flange", "ground"), doc="What it acts against.")
    a: Slide = connector(Slide, "The displacement that it acts against.", when={"against": ("flange",)})
    b: Slide = connector(Slide, "The displacement that it acts on.")

    @force
    def act(self) -> Iterable[CoordinateLoad]:
        """Return the force."""
        yield from push(self, self.force())

    @observable(unit="N", doc="The force.")
    def force(self) -> Scalar:
        """Return the force."""
        return self.value if self.law.is_zero else self.value + self.law(*between(self), self.time)

    @observable(unit="W", doc="Power of the force.")
    def power(self) -> Scalar:
        """Return the power."""
        return self.force() * between(self)[1]
