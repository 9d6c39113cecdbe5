"""RotationalGap: play between two angles, with elastic contacts at both ends."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import (
    Component,
    CoordinateLoad,
    ParameterError,
    Scalar,
    Shaft,
    connector,
    event,
    force,
    observable,
    parameter,
    potential,
)
from atwood_library.interfaces.along_coordinates import between, gap_contact, push


class RotationalGap(Component):
    """Play between two angles, or from one to the ground, with elastic and damped contacts at both ends.

    Within the play nothing acts. In contact the damper pushes at most as much as the spring, and nothing pulls. Where a
    contact begins and ends is found exactly.
    """

    synonyms = (
        *("ElastoBacklash", "ElastoBacklash2", "Backlash", "Stop"),
        "Rotational.Components.ElastoBacklash",
    )
    modes = ("apart", "upper", "lower")
    spaces = ("plane", "space")

    stiffness: float = parameter(1e4, unit="N*m/rad", above=0.0, doc="Torque for a unit beyond the play.")
    damping: float = parameter(0.0, unit="N*m*s/rad", minimum=0.0, doc="Torque for a unit of the rate in contact.")
    ends: str = parameter("both", choices=("both", "upper", "lower"), doc="Where the play ends.")
    lower: float = parameter(-0.5, unit="rad", doc="Where it ends below.")
    upper: float = parameter(0.5, unit="rad", doc="Where it ends above.")
    against: str = parameter("flange", choices=("flange", "ground"), doc="What it acts against.")
    a: Shaft = connector(Shaft, "The angle that it acts against.", when={"against": ("flange",)})
    b: Shaft = connector(Shaft, "The angle that it acts on.")

    def check_values(self) -> None:
        """Refuse ends the wrong way round."""
        if not self.lower < self.upper:
            raise ParameterError(
                f"the lower end {self.lower:g} is not below the upper one, {self.upper:g}", where=f"{self.path}.lower"
            )

    def beyond(self, end: float) -> Scalar:
        """Return by how much b is beyond an end of the play."""
        return between(self)[0] - end

    @potential(modes=("upper",))
    def upper_energy(self) -> Scalar:
        """Return the energy of the upper contact."""
        return 0.5 * self.stiffness * self.beyond(self.upper) ** 2

    @potential(modes=("lower",))
    def lower_energy(self) -> Scalar:
        """Return the energy of the lower contact."""
        return 0.5 * self.stiffness * self.beyond(self.lower) ** 2

    @force(modes=("upper",))
    def upper_damping(self) -> Iterable[CoordinateLoad]:
        """Return the damping of the upper contact."""
        yield from push(self, -gap_contact(self.beyond(self.upper), between(self)[1], self.damping, self.stiffness))

    @force(modes=("lower",))
    def lower_damping(self) -> Iterable[CoordinateLoad]:
        """Return the damping of the lower contact."""
        depth, rate = -self.beyond(self.lower), -between(self)[1]
        yield from push(self, gap_contact(depth, rate, self.damping, self.stiffness))

    @event(modes=("apart",), direction=1, unit="rad", target="upper", message="it touches above")
    def touches_above(self) -> Scalar:
        """Return by how much it is beyond the upper end."""
        return self.lower - self.upper if self.ends == "lower" else self.beyond(self.upper)

    @event(modes=("apart",), direction=-1, unit="rad", target="lower", message="it touches below")
    def touches_below(self) -> Scalar:
        """Return by how much it is above the lower end."""
        return self.upper - self.lower if self.ends == "upper" else self.beyond(self.lower)

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
