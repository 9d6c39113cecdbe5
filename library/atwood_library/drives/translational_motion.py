"""TranslationalMotion: a displacement that follows a function of time."""

from __future__ import annotations

from atwood import Component, Scalar, Slide, connector, constraint, observable, parameter, signal
from atwood_library.interfaces.along_coordinates import between


class TranslationalMotion(Component):
    """A displacement that follows a function of time, or whose speed does, against another one or the ground.

    It does whatever work is needed. With ``follows="speed"`` the displacement begins where the scene starts it.
    """

    synonyms = (
        "Translational.Sources.Position",
        "Translational.Sources.Speed",
        "Translational.Sources.Move",
        "ConstantSpeed",
    )

    follows: str = parameter("place", choices=("place", "speed"), doc="What is given: the displacement, or its rate.")
    place: float = signal(0.0, unit="m", doc="The displacement, a function of time.")
    speed: float = signal(0.0, unit="m/s", doc="Its rate, a function of time.")
    against: str = parameter("ground", choices=("flange", "ground"), doc="What it acts against.")
    a: Slide = connector(Slide, "The displacement that it acts against.", when={"against": ("flange",)})
    b: Slide = connector(Slide, "The displacement that it acts on.")

    @constraint(reaction="force", unit="N", doc="Force that makes b follow.")
    def follow(self) -> Scalar:
        """Return by how much it is off."""
        displacement, rate = between(self)
        return displacement - self.place if self.follows == "place" else rate - self.speed

    @observable(unit="W", doc="Power of the drive.")
    def power(self) -> Scalar:
        """Return the power."""
        return self.reaction("force") * between(self)[1]
