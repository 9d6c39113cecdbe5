"""LoadedSlide: what a joint can carry along its axis: a spring, a damper, an actuator and stops.

All of them are absent, and cost nothing, while their parameters are zero or not given.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from atwood import (
    Component,
    Load,
    Number,
    Scalar,
    dissipation,
    force,
    is_zero,
    parameter,
    potential,
    signal,
)
from atwood_library.interfaces.loads import (
    check_stops,
    damper_function,
    elastic_energy,
    push_apart,
    rigid_stops,
    stop_restitution,
    stops_of,
)


class LoadedSlide(Component):
    """A joint between frames a and b with the observables `displacement` and `speed`, which can carry loads."""

    stiffness: Number = parameter(0.0, unit="N/m", minimum=0.0, doc="Force of the spring for one metre.")
    natural_length: Number = parameter(0.0, unit="m", doc="Displacement at which the spring has no force.")
    damping: Number = parameter(0.0, unit="N*s/m", minimum=0.0, doc="Force of the damper for one metre a second.")
    stop_stiffness: Number = parameter(
        0.0, unit="N/m", minimum=0.0, doc="Force of a stop for one metre beyond it.", symbol="k_s"
    )
    lower_stop: Number | None = parameter(
        None,
        unit="m",
        doc="Displacement below which a stop acts; none if not given.",
        symbol="x_min",
    )
    upper_stop: Number | None = parameter(
        None,
        unit="m",
        doc="Displacement above which a stop acts; none if not given.",
        symbol="x_max",
    )
    stop_restitution: Number | None = stop_restitution()
    actuator: Number = signal(0.0, unit="N", doc="Force of the actuator on frame b, and against frame a.")

    def check_values(self) -> None:
        """Refuse stops that are rigid and elastic, and those that are nowhere."""
        super().check_values()
        check_stops(self, self.stop_stiffness, self.stop_restitution, self.lower_stop, self.upper_stop)

    @potential
    def spring_energy(self) -> Scalar:
        """Return the energy in the spring and in the stops."""
        joint: Any = self
        stops = stops_of(self.stop_stiffness, self.stop_restitution, self.lower_stop, self.upper_stop)
        return elastic_energy(joint.displacement, (self.stiffness, self.natural_length), stops)

    above_lower_stop, below_upper_stop = rigid_stops(
        lambda joint: joint.displacement(),
        ("lower_stop", "upper_stop"),
        "stop_restitution",
        unit="N",
        doc="Displacement {way} the {end} stop.",
        reaction_doc="Force of the {end} stop, where it is rigid.",
        spaces=("line", "plane", "space"),
    )

    @dissipation
    def damper_function(self) -> Scalar:
        """Return half the power of the damper."""
        joint: Any = self
        return damper_function(lambda: (joint.speed(),), self.damping)

    @force
    def actuator_force(self) -> Iterable[Load]:
        """Return the force of the actuator on both frames, at the place of frame b."""
        if is_zero(self.actuator):
            return
        joint: Any = self
        yield from push_apart(joint.a, joint.b, joint.axis_in_world() * self.actuator)
