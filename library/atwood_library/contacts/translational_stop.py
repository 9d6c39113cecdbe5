"""TranslationalStop: rigid ends of the play between two displacements."""

from __future__ import annotations

from typing import ClassVar

from atwood import Number, Scalar, Slide, connector, observable, parameter
from atwood_library.interfaces.along_coordinates import between
from atwood_library.interfaces.bounds import Bounded
from atwood_library.interfaces.loads import rigid_stops

__all__ = ["TranslationalStop"]


class TranslationalStop(Bounded):
    """Rigid ends of the play between two displacements, or from one to the ground: backlash, a hard stop.

    Nothing goes beyond an end. Where one is reached with a speed velocities jump.
    """

    synonyms: ClassVar[tuple[str, ...]] = ("Hard stop", "Stop", "MassWithStopAndFriction")

    lower: Number = parameter(None, unit="m", doc="Where it ends below; nowhere if not given.")
    upper: Number = parameter(None, unit="m", doc="Where it ends above; nowhere if not given.")
    restitution: Number = parameter(
        0.0, minimum=0.0, maximum=1.0, doc="Share of the speed with which an end is reached that is left after it."
    )
    against: str = parameter("flange", choices=("flange", "ground"), doc="What it acts against.")
    a: Slide = connector(Slide, "The displacement that it acts against.", when={"against": ("flange",)})
    b: Slide = connector(Slide, "The displacement that it acts on.")

    @observable(unit="m", doc="By how much b is ahead of a.")
    def extension(self) -> Scalar:
        """Return the extension."""
        return between(self)[0]

    above_lower, below_upper = rigid_stops(
        lambda part: between(part)[0],
        ("lower", "upper"),
        "restitution",
        unit="N",
        doc="Play {way} the {end} end.",
        reaction_doc="What the {end} end exerts on b, away from it.",
        spaces=("line", "plane", "space"),
    )
