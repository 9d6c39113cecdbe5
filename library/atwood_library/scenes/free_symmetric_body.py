"""free-symmetric-body: a symmetric body on which nothing acts."""

from __future__ import annotations

import math

from atwood import Number, Scene, parameter
from atwood_library.parts.rigid_body import RigidBody


class FreeSymmetricBody(Scene):
    """A body with an axis of symmetry that turns freely: its axis goes round the constant angular momentum.

    In the axes of the body its angular velocity goes round the axis of symmetry at the rate ``(I3 - I1) w3/I1``; seen
    from outside the axis goes round the vertical at ``I3 w3/(I1 cos theta)`` (Goldstein, section 5.6). It starts with
    its angular momentum upwards.
    """

    across: Number = parameter(1.0, unit="kg*m^2", above=0.0, doc="Moment of inertia I1 across the axis of symmetry.")
    along: Number = parameter(1.6, unit="kg*m^2", above=0.0, doc="Moment of inertia I3 about the axis of symmetry.")
    spin: Number = parameter(3.0, unit="rad/s", doc="Angular velocity w3 about the axis of symmetry.")
    inclination: Number = parameter(
        0.5, unit="rad", above=0.0, maximum=1.5, doc="Angle theta of the axis from the angular momentum."
    )
    space = "space"
    gravity = 0.0
    t_end = 10.0

    body: RigidBody = RigidBody()

    def build(self) -> None:
        """Set it spinning."""
        self.set("body.moments", (self.across, self.across, self.along))
        self.start.update({"body.phi": 0.0, "body.theta": self.inclination, "body.psi": 0.0})
        # the angular momentum L is upwards: in the body -L sin(theta) along x and L cos(theta) along z
        turning = self.along * self.spin / math.cos(self.inclination)
        self.start.update({"body.spin.x": -turning * math.sin(self.inclination) / self.across, "body.spin.y": 0.0})
        self.start["body.spin.z"] = self.spin

    def rates(self) -> tuple[float, float]:
        """Return the rate of the angular velocity in the body, and that of the axis seen from outside, rad/s."""
        return (
            (self.along - self.across) * self.spin / self.across,
            self.along * self.spin / (self.across * math.cos(self.inclination)),
        )
