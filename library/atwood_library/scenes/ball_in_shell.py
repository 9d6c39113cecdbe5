"""ball-in-shell: a ball that rolls in a spherical bowl."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.rolling_on_round import RollingOnRound
from atwood_library.parts.ground import Ground
from atwood_library.parts.sphere import Sphere


class BallInShell(Scene):
    """A ball rolls without slipping in a spherical shell, near its bottom or far up.

    In the plane through the middle it swings as a pendulum of the length ``(1 + k) (R - r)`` with ``J = k m r^2``
    (Routh, Advanced Part of a Treatise on Rigid Dynamics, chapter 5). Energy, and its spin about the vertical through
    the contact, which an ellipse of the centre's path turns with, are what is known besides.
    """

    shell: Number = parameter(1.0, unit="m", above=0.0, doc="Radius R of the shell.")
    radius: Number = parameter(0.2, unit="m", above=0.0, doc="Radius r of the ball.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the ball.")
    inclination: Number = parameter(1.0, unit="rad", doc="Angle of the ball from the downward vertical at the start.")
    speed: Number = parameter(1.0, unit="m/s", doc="Speed of its centre around, at the start.")
    spin: Number = parameter(2.0, unit="rad/s", doc="Angular velocity about the normal of the shell at the start.")
    space = "space"
    t_end = 5.0

    ground: Ground = Ground()
    contact: RollingOnRound = RollingOnRound(ground_radius=shell, radius=radius)
    ball: Sphere = Sphere(radius=radius, mass=mass)
    connections = [connect(ground.frame, contact.a), connect(contact.b, ball.frame)]

    def build(self) -> None:
        """Put it into the shell, and let it go round."""
        sine, cosine = math.sin(self.inclination), math.cos(self.inclination)
        reach = self.shell - self.radius
        self.start.update({"ball.position.x": reach * sine, "ball.position.y": 0.0, "ball.velocity.y": self.speed})
        self.start["ball.velocity.x"] = 0.0
        self.guess["ball.position.z"], self.guess["ball.velocity.z"] = -reach * cosine, 0.0
        # v = r w x n with n towards the middle: w = n x v/r + s n
        n = (-sine, 0.0, cosine)
        across = (-n[2] * self.speed / self.radius, 0.0, n[0] * self.speed / self.radius)
        for axis, rolled, normal in zip("xyz", across, n, strict=True):
            kind = self.start if axis == "z" else self.guess
            kind[f"ball.angular_velocity.{axis}"] = rolled + self.spin * normal
        self.start.update({f"ball.{angle}": 0.0 for angle in ("phi", "theta", "psi")})
