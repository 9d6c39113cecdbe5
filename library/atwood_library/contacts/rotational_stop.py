"""RotationalStop: rigid ends of the play between two angles."""

from __future__ import annotations

from typing import ClassVar

from atwood import Number, Scalar, Shaft, connector, observable, parameter, unilateral
from atwood_library.interfaces.along_coordinates import between
from atwood_library.interfaces.bounds import Bounded

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

    @unilateral(
        reaction="lower_torque",
        unit="N*m",
        restitution="restitution",
        given=["lower"],
        doc="What the lower end exerts on b.",
    )
    def above_lower(self) -> Scalar:
        """Play above the lower end."""
        return between(self)[0] - self.lower

    @unilateral(
        reaction="upper_torque",
        unit="N*m",
        restitution="restitution",
        given=["upper"],
        doc="What the upper end exerts, against b.",
    )
    def below_upper(self) -> Scalar:
        """Play below the upper end."""
        return self.upper - between(self)[0]
