"""Gap: play between two coordinates of one kind, with elastic and damped contacts at both ends."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import Component, CoordinateLoad, ParameterError, Scalar, force, potential
from atwood_library.interfaces.along_coordinates import between, gap_contact, push


class Gap(Component):
    """Play between two coordinates, or from one to the ground.

    Within the play nothing acts. In contact the damper pushes at most as much as the spring, and nothing pulls. What
    inherits has the connectors, the quantities with their units, and the events at which contacts begin and end.
    """

    modes = ("apart", "upper", "lower")

    stiffness: float
    damping: float
    lower: float
    upper: float
    ends: str

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

    def above_upper_end(self) -> Scalar:
        """Return by how much b is beyond the upper end; a negative constant where there is none."""
        return self.lower - self.upper if self.ends == "lower" else self.beyond(self.upper)

    def above_lower_end(self) -> Scalar:
        """Return by how much b is above the lower end; a positive constant where there is none."""
        return self.upper - self.lower if self.ends == "upper" else self.beyond(self.lower)
