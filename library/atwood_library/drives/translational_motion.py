"""TranslationalMotion: a displacement that follows a function of time."""

from __future__ import annotations

from atwood import (
    Component,
    Number,
    Scalar,
    Slide,
    connector,
    constraint,
    derivative,
    observable,
    parameter,
    signal,
    state,
)
from atwood_library.interfaces.along_coordinates import between


class TranslationalMotion(Component):
    """A displacement that follows a function of time, or whose speed does, against another one or the ground.

    It does whatever work is needed. With ``follows="speed"`` the displacement begins where the scene starts it; with
    ``follows="acceleration"`` its rate is a state of the part, which the scene starts as ``planned``.
    """

    synonyms = (
        *("Translational.Sources.Position", "Translational.Sources.Speed"),
        *("Translational.Sources.Accelerate", "Translational.Sources.Move"),
        *("Translational.Components.Fixed", "Translational.Sources.ConstantSpeed"),
        "PositionToForceAdaptor",
    )

    follows: str = parameter(
        "place", choices=("place", "speed", "acceleration"), doc="What is given: the displacement, or one of its rates."
    )
    place: Number = signal(0.0, unit="m", doc="The displacement, a function of time.")
    speed: Number = signal(0.0, unit="m/s", doc="Its rate, a function of time.")
    acceleration: Number = signal(0.0, unit="m/s^2", doc="Its second rate, a function of time.")
    planned: Scalar = state(0.0, unit="m/s", doc="The rate, where the second one is given.")
    against: str = parameter("ground", choices=("flange", "ground"), doc="What it acts against.")
    a: Slide = connector(Slide, "The displacement that it acts against.", when={"against": ("flange",)})
    b: Slide = connector(Slide, "The displacement that it acts on.")

    @derivative("planned")
    def planned_rate(self) -> Scalar:
        """Return the second rate that is given."""
        return self.acceleration if self.follows == "acceleration" else 0.0

    @constraint(reaction="force", unit="N", doc="Force that makes b follow.")
    def follow(self) -> Scalar:
        """Return by how much it is off."""
        displacement, rate = between(self)
        if self.follows == "place":
            return displacement - self.place
        return rate - (self.speed if self.follows == "speed" else self.planned)

    @observable(unit="W", doc="Power of the drive.")
    def power(self) -> Scalar:
        """Return the power."""
        return self.reaction("force") * between(self)[1]
