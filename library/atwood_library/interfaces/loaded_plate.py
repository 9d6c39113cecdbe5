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
    unilateral,
)
from atwood_library.interfaces.bearings import rate_along
from atwood_library.interfaces.loads import (
    check_stops,
    damper_function,
    elastic_stop,
    past_rim,
    push_apart,
    stop_restitution,
)


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
    stop_restitution: Number | None = stop_restitution()
    actuator_1: Number = signal(0.0, unit="N", doc="Force on b along the first direction of the plane, and against a.")
    actuator_2: Number = signal(0.0, unit="N", doc="Force on b along the second direction of the plane, and against a.")

    def check_values(self) -> None:
        """Refuse a rim that is rigid and elastic, and one that is nowhere."""
        super().check_values()
        check_stops(self, self.stop_stiffness, self.stop_restitution, self.rim)

    @potential
    def spring_energy(self) -> Scalar:
        """Return the energy in the spring and in the rim."""
        energy: Scalar = 0.0
        if not is_zero(self.stiffness):
            arm = self._arm()
            energy = 0.5 * self.stiffness * dot(arm, arm)
        if self.rim is not None and self.stop_restitution is None:
            energy = energy + elastic_stop(past_rim(self._arm(), self.rim), self.stop_stiffness)
        return energy

    @unilateral(
        reaction="rim_force",
        unit="N",
        restitution="stop_restitution",
        given=("rim", "stop_restitution"),
        doc="Force of the rim, where it is rigid.",
        spaces=("space",),
    )
    def within_rim(self) -> Scalar:
        """Return how far it is within the rim."""
        assert self.rim is not None
        return -past_rim(self._arm(), self.rim)

    def _arm(self) -> Vector:
        return Vector(self.displacement_1(), self.displacement_2(), 0.0)

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
