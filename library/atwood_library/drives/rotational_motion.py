"""RotationalMotion: an angle that follows a function of time."""

from __future__ import annotations

from atwood import (
    Component,
    Number,
    Scalar,
    Shaft,
    connector,
    constraint,
    derivative,
    observable,
    parameter,
    signal,
    state,
)
from atwood_library.interfaces.along_coordinates import between


class RotationalMotion(Component):
    """An angle that follows a function of time, or whose speed does, against another one or the ground.

    It does whatever work is needed. With ``follows="speed"`` the angle begins where the scene starts it; with
    ``follows="acceleration"`` its rate is a state of the part, which the scene starts as ``planned``.
    """

    synonyms = (
        *("Rotational.Sources.Position", "Rotational.Sources.Speed", "Rotational.Sources.Accelerate"),
        *("Rotational.Sources.Move", "Rotational.Components.Fixed"),
        *("Rotational.Sources.ConstantSpeed", "AngleToTorqueAdaptor"),
    )
    spaces = ("plane", "space")

    follows: str = parameter(
        "place", choices=("place", "speed", "acceleration"), doc="What is given: the angle, or one of its rates."
    )
    place: Number = signal(0.0, unit="rad", doc="The angle, a function of time.")
    speed: Number = signal(0.0, unit="rad/s", doc="Its rate, a function of time.")
    acceleration: Number = signal(0.0, unit="rad/s^2", doc="Its second rate, a function of time.")
    planned: Scalar = state(0.0, unit="rad/s", doc="The rate, where the second one is given.")
    against: str = parameter("ground", choices=("flange", "ground"), doc="What it acts against.")
    a: Shaft = connector(Shaft, "The angle that it acts against.", when={"against": ("flange",)})
    b: Shaft = connector(Shaft, "The angle that it acts on.")

    @derivative("planned")
    def planned_rate(self) -> Scalar:
        """Return the second rate that is given."""
        return self.acceleration if self.follows == "acceleration" else 0.0

    @constraint(reaction="torque", unit="N*m", doc="Torque that makes b follow.")
    def follow(self) -> Scalar:
        """Return by how much it is off."""
        angle, rate = between(self)
        if self.follows == "place":
            return angle - self.place
        return rate - (self.speed if self.follows == "speed" else self.planned)

    @observable(unit="W", doc="Power of the drive.")
    def power(self) -> Scalar:
        """Return the power."""
        return self.reaction("torque") * between(self)[1]
