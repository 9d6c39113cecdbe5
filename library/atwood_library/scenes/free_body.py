"""free-body: an asymmetric body on which nothing acts."""

from __future__ import annotations

from atwood import Scene, Triple, parameter
from atwood_library.parts.rigid_body import RigidBody


class FreeBody(Scene):
    """An asymmetric rigid body without forces: Euler's top (Goldstein, section 5.6)."""

    moments: Triple = parameter((1.0, 2.0, 3.0), unit="kg*m^2", size=3, doc="Principal moments of inertia.")
    spin: Triple = parameter(
        (1.0, 0.0, 1.0), unit="rad/s", size=3, doc="Angular velocity at the start, in the axes of the body."
    )
    space = "space"
    gravity = 0.0
    t_end = 10.0

    body: RigidBody = RigidBody(moments=moments)

    def build(self) -> None:
        """Set it spinning."""
        for axis, value in zip("xyz", self.spin, strict=True):
            self.start[f"body.spin.{axis}"] = value
