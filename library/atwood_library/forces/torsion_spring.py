"""TorsionSpring: a linear torsion spring."""

from __future__ import annotations

import math

from atwood import Number, Scalar, as_vector, event, is_zero, observable, parameter, potential
from atwood_library.interfaces.bearings import twist_cosine
from atwood_library.interfaces.twisted import Twisted

_NEARLY_HALF_A_TURN = math.cos(0.999 * math.pi)


class TorsionSpring(Twisted):
    """A massless torsion spring between two frames, linear in the angle between them about an axis.

    Potential energy ``1/2 c (phi - phi0)^2``. It acts on the orientations only; a joint keeps the frames together.

    In space the angle is the twist about the axis. Where both frames share the axis, as on a hinge, that is the angle
    between them; where frame b is bent away, it is what is left when the shortest turn that bends the axis is taken
    off, and the torque on b is about ``(n_a + n_b)/(1 + n_a . n_b)``, with the axis in both frames. Orientations tell
    it within half a turn either way, where the run stops; the spring of a `Pivot` counts turns.
    """

    synonyms = ("Rotational spring", "Torsional spring")

    stiffness: Number = parameter(1.0, unit="N*m/rad", minimum=0.0, doc="Torque for a twist by one radian.")
    natural_angle: Number = parameter(0.0, unit="rad", doc="Angle without torque.", symbol="theta_0")

    @potential
    def elastic_energy(self) -> Scalar:
        """Return the elastic energy."""
        twist = self.twist() - self.natural_angle
        return 0.5 * self.stiffness * twist * twist

    @event(direction=-1, target="stop", message="the twist has come to half a turn", spaces=("space",))
    def comes_to_half_a_turn(self) -> Scalar:
        """Return how far the cosine of the twist is from that of (nearly) half a turn."""
        if is_zero(self.stiffness):
            return 1.0
        return twist_cosine(self.a, self.b, as_vector(self.axis)) - _NEARLY_HALF_A_TURN

    @observable(
        unit="rad",
        doc="Angle of frame b from frame a about the axis.",
        periodic=True,
        rate="rate",
        spaces=("plane", "space"),
    )
    def angle(self) -> Scalar:
        """Return the angle."""
        return self.twist()

    @observable(unit="rad/s", doc="Rate of the angle.", spaces=("plane", "space"))
    def rate(self) -> Scalar:
        """Return the rate of the angle."""
        return self.twisting()

    @observable(unit="N*m", doc="Torque on frame b about the axis.", spaces=("plane", "space"))
    def torque(self) -> Scalar:
        """Return the torque on frame b."""
        return -(self.stiffness * (self.twist() - self.natural_angle))
