"""RotationalSource: a given torque on an angle."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from atwood import Component, CoordinateLoad, Number, Scalar, Shaft, connector, force, observable, parameter, signal
from atwood_library.interfaces.along_coordinates import between, push


class RotationalSource(Component):
    """A given torque on an angle, with its reaction on another one or on the ground: a motor without inertia.

    It is the input `value`, and what a law says: a function of the angle x, of its rate v and of the time.
    """

    synonyms = (
        *("Rotational.Sources.Torque", "Torque source", "Torque2", "ConstantTorque", "Ideal motor", "Nonlinear spring"),
        *("Rotational.Sources.TorqueStep", "TorqueToAngleAdaptor"),
    )
    spaces = ("plane", "space")

    value: Number = signal(0.0, unit="N*m", doc="The torque, positive where it makes b grow.")
    law: Any = parameter(
        0.0,
        unit="N*m",
        function_of={"x": "rad", "v": "rad/s", "t": "s"},
        doc="A function of angle, rate and time, besides: '-2*x**3 - 0.1*v'.",
    )
    against: str = parameter("ground", choices=("flange", "ground"), doc="What it acts against.")
    a: Shaft = connector(Shaft, "The angle that it acts against.", when={"against": ("flange",)})
    b: Shaft = connector(Shaft, "The angle that it acts on.")

    @force
    def act(self) -> Iterable[CoordinateLoad]:
        """Return the torque."""
        yield from push(self, self.torque())

    @observable(unit="N*m", doc="The torque.")
    def torque(self) -> Scalar:
        """Return the torque."""
        return self.value if self.law.is_zero else self.value + self.law(*between(self), self.time)

    @observable(unit="W", doc="Power of the torque.")
    def power(self) -> Scalar:
        """Return the power."""
        return self.torque() * between(self)[1]
