"""RotationalStop: rigid ends of the play between two angles."""

from __future__ import annotations

from typing import ClassVar

from atwood import Number, Scalar, Shaft, connector, observable, parameter
from atwood_library.interfaces.along_coordinates import between
from atwood_library.interfaces.bounds import Bounded
from atwood_library.interfaces.loads import rigid_stops

__all__ = ["RotationalStop"]


class RotationalStop(Bounded):
    """Rigid ends of the play between two angles, or from one to the ground: backlash, a hard stop.

    Nothing goes beyond an end. Where one is reached with a speed velocities jump.
    """

    synonyms: ClassVar[tuple[str, ...]] = ("Backlash", "Play", "Rigid backlash")
    spaces: ClassVar[tuple[str, ...]] = ("plane", "space")

    lower: Number = parameter(None, unit="rad", doc="Where it ends below; nowhere if not given.")
    upper: Number = parameter(None, unit="rad", doc="Where it ends above; nowhere if not given.")
    restitution: Number = parameter(
        0.0, minimum=0.0, maximum=1.0, doc="Share of the speed with which an end is reached that is left after it."
    )
    against: str = parameter("flange", choices=("flange", "ground"), doc="What it acts against.")
    a: Shaft = connector(Shaft, "The angle that it acts against.", when={"against": ("flange",)})
    b: Shaft = connector(Shaft, "The angle that it acts on.")

    @observable(unit="rad", doc="By how much b is ahead of a.")
    def extension(self) -> Scalar:
        """Return the extension."""
        return between(self)[0]

    above_lower, below_upper = rigid_stops(
        lambda part: between(part)[0],
        ("lower", "upper"),
        "restitution",
        unit="N*m",
        doc="Play {way} the {end} end.",
        reaction_doc="What the {end} end exerts on b, away from it.",
    )
