"""LoadedPlate: what something that slides on a plane can carry."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from atwood import (
    Component,
    Load,
    Number,
    Scalar,
    Vector,
    as_vector,
    dissipation,
    dot,
    force,
    is_zero,
    normals,
    observable,
    parameter,
    potential,
    signal,
)
from atwood_library.interfaces.bearings import rate_along
from atwood_library.interfaces.loads import beyond_rim, damper_function, push_apart


class LoadedPlate(Component):
    """A joint between a and b with two displacements on a plane of frame a through its origin, with normal `axis`.

    The spring pulls towards the origin, the damper against the motion over the plane, and the stop is a round rim.
    """

    stiffness: Number = parameter(0.0, unit="N/m", minimum=0.0, doc="Force of the spring a metre from the origin.")
    damping: Number = parameter(0.0, unit="N*s/m", minimum=0.0, doc="Force of the damper for one metre a second.")
    stop_stiffness: Number = parameter(
        0.0, unit="N/m", minimum=0.0, doc="Force of the rim for one metre beyond it.", symbol="k_s"
    )
    rim: Number | None = parameter(
        None, unit="m", above=0.0, doc="Distance from the origin at which the stop acts; none if not given."
    )
    actuator_1: Number = signal(0.0, unit="N", doc="Force on b along the first direction of the plane, and against a.")
    actuator_2: Number = signal(0.0, unit="N", doc="Force on b along the second direction of the plane, and against a.")

    @potential
    def spring_energy(self) -> Scalar:
        """Return the energy in the spring and in the rim."""
        joint: Any = self
        if is_zero(self.stiffness) and self.rim is None:
            return 0.0
        arm = Vector(joint.displacement_1(), joint.displacement_2(), 0.0)
        spring: Scalar = 0.5 * self.stiffness * dot(arm, arm)
        return spring + beyond_rim(arm, self.stop_stiffness, self.rim)

    @dissipation
    def damper_function(self) -> Scalar:
        """Return half the power of the damper."""
        joint: Any = self
        return damper_function(lambda: (joint.speed_1(), joint.speed_2()), self.damping)

    @force
    def actuator_force(self) -> Iterable[Load]:
        """Return the force of the actuators on both, at the place of b."""
        if is_zero(self.actuator_1) and is_zero(self.actuator_2):
            return
        joint: Any = self
        first, second = normals(as_vector(joint.axis))
        push = joint.a.to_world(first * self.actuator_1 + second * self.actuator_2)
        yield from push_apart(joint.a, joint.b, push)

    @observable(unit="m", doc="Displacement along the first direction of the plane.", rate="speed_1", spaces=("space",))
    def displacement_1(self) -> Scalar:
        """Return the displacement."""
        joint: Any = self
        return dot(joint.b.position - joint.a.position, joint.a.to_world(normals(as_vector(joint.axis))[0]))

    @observable(
        unit="m", doc="Displacement along the second direction of the plane.", rate="speed_2", spaces=("space",)
    )
    def displacement_2(self) -> Scalar:
        """Return the displacement."""
        joint: Any = self
        return dot(joint.b.position - joint.a.position, joint.a.to_world(normals(as_vector(joint.axis))[1]))

    @observable(unit="m/s", doc="Rate of the first displacement.", spaces=("space",))
    def speed_1(self) -> Scalar:
        """Return the rate, as seen from frame a."""
        joint: Any = self
        return rate_along(joint.a, joint.b, normals(as_vector(joint.axis))[0])

    @observable(unit="m/s", doc="Rate of the second displacement.", spaces=("space",))
    def speed_2(self) -> Scalar:
        """Return the rate, as seen from frame a."""
        joint: Any = self
        return rate_along(joint.a, joint.b, normals(as_vector(joint.axis))[1])
