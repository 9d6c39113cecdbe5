"""RotationalMotion: an angle that follows a function of time."""

from __future__ import annotations

from atwood import Component, Scalar, Shaft, connector, constraint, observable, parameter, signal
from atwood_library.interfaces.along_coordinates import between


class RotationalMotion(Component):
    """An angle that follows a function of time, or whose speed does, against another one or the ground.

    It does whatever work is needed. With ``follows="speed"`` the angle begins where the scene starts it.
    """

    synonyms = ("Rotational.Sources.Position", "Rotational.Sources.Speed", "Rotational.Sources.Move", "ConstantSpeed")
    spaces = ("plane", "space")

    follows: str = parameter("place", choices=("place", "speed"), doc="What is given: the angle, or its rate.")
    place: float = signal(0.0, unit="rad", doc="The angle, a function of time.")
    speed: float = signal(0.0, unit="rad/s", doc="Its rate, a function of time.")
    against: str = parameter("ground", choices=("flange", "ground"), doc="What it acts against.")
    a: Shaft = connector(Shaft, "The angle that it acts against.", when={"against": ("flange",)})
    b: Shaft = connector(Shaft, "The angle that it acts on.")

    @constraint(reaction="torque", unit="N*m", doc="Torque that makes b follow.")
    def follow(self) -> Scalar:
        """Return by how much it is off."""
        angle, rate = between(self)
        return angle - self.place if self.follows == "place" else rate - self.speed

    @observable(unit="W", doc="Power of the drive.")
    def power(self) -> Scalar:
        """Return the power."""
        return self.reaction("torque") * between(self)[1]
