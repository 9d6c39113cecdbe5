"""RotationalGap: play between two angles, with elastic contacts at both ends."""

from __future__ import annotations

from atwood import (
    Number,
    Scalar,
    Shaft,
    connector,
    event,
    observable,
    parameter,
)
from atwood_library.interfaces.along_coordinates import between
from atwood_library.interfaces.gap import Gap


class RotationalGap(Gap):
    """Play between two angles, or from one to the ground, with elastic and damped contacts at both ends.

    Within the play nothing acts. In contact the damper pushes at most as much as the spring, and nothing pulls. Where a
    contact begins and ends is found exactly.
    """

    synonyms = (
        *("ElastoBacklash", "ElastoBacklash2", "Elastic backlash", "Elastic stop"),
        "Rotational.Components.ElastoBacklash",
    )
    spaces = ("plane", "space")

    stiffness: Number = parameter(1e4, unit="N*m/rad", above=0.0, doc="Torque for a unit beyond the play.")
    damping: Number = parameter(0.0, unit="N*m*s/rad", minimum=0.0, doc="Torque for a unit of the rate in contact.")
    ends: str = parameter("both", choices=("both", "upper", "lower"), doc="Where the play ends.")
    lower: Number = parameter(-0.5, unit="rad", doc="Where it ends below.", symbol="theta_min")
    upper: Number = parameter(0.5, unit="rad", doc="Where it ends above.", symbol="theta_max")
    against: str = parameter("flange", choices=("flange", "ground"), doc="What it acts against.")
    a: Shaft = connector(Shaft, "The angle that it acts against.", when={"against": ("flange",)})
    b: Shaft = connector(Shaft, "The angle that it acts on.")

    @event(modes=("apart",), direction=1, unit="rad", target="upper", message="it touches above")
    def touches_above(self) -> Scalar:
        """Return by how much it is beyond the upper end."""
        return self.above_upper_end()

    @event(modes=("apart",), direction=-1, unit="rad", target="lower", message="it touches below")
    def touches_below(self) -> Scalar:
        """Return by how much it is above the lower end."""
        return self.above_lower_end()

    @event(modes=("upper",), direction=-1, unit="rad", target="apart", message="it lets go above")
    def lets_go_above(self) -> Scalar:
        """Return by how much it is beyond the upper end."""
        return self.beyond(self.upper)

    @event(modes=("lower",), direction=1, unit="rad", target="apart", message="it lets go below")
    def lets_go_below(self) -> Scalar:
        """Return by how much it is above the lower end."""
        return self.beyond(self.lower)

    @observable(unit="rad", doc="By how much b is ahead of a.")
    def extension(self) -> Scalar:
        """Return the extension."""
        return between(self)[0]
