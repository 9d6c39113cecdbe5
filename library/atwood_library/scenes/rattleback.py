"""rattleback: a stone that turns one way only."""

from __future__ import annotations

import math

from atwood import Number, Scene, Triple, connect, parameter
from atwood_library.joints.rolling_ellipsoid import RollingEllipsoid
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody


class Rattleback(Scene):
    """Half an ellipsoid rocks and rolls on a table; its principal axes are turned against those of the ellipsoid.

    Spun the wrong way it begins to rattle, stops and turns the other way (Bondi, Proceedings of the Royal Society A
    405, 1986; Kane and Levinson, International Journal of Non-Linear Mechanics 17, 1982). It rolls without slipping,
    and energy is kept.
    """

    semi_axes: Triple = parameter((0.2, 0.03, 0.02), unit="m", size=3, doc="Semi-axes of the ellipsoid.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass.")
    moments: Triple = parameter(
        (2e-4, 1.6e-3, 1.7e-3), unit="kg*m^2", size=3, doc="Principal moments of inertia about the centre of mass."
    )
    skew: Number = parameter(
        math.radians(-5.0), unit="rad", doc="Angle of the principal axes from those of the ellipsoid."
    )
    depth: Number = parameter(0.01, unit="m", doc="Depth of the centre of mass below the centre of the ellipsoid.")
    spin: Number = parameter(-5.0, unit="rad/s", doc="Angular velocity about the vertical at the start.")
    rattle: Number = parameter(0.01, unit="rad/s", doc="Angular velocity across at the start.")
    space = "space"
    t_end = 3.0

    table: Ground = Ground()
    contact: RollingEllipsoid = RollingEllipsoid()
    stone: RigidBody = RigidBody(mass=mass)
    connections = [connect(table.frame, contact.a), connect(contact.b, stone.frame)]

    def build(self) -> None:
        """Turn the principal axes, and spin the stone."""
        c, s = math.cos(self.skew), math.sin(self.skew)
        x, y, z = self.moments
        self.set("contact.semi_axes", self.semi_axes)
        self.set("stone.center", (0.0, 0.0, -self.depth))
        self.set("stone.moments", (c * c * x + s * s * y, s * s * x + c * c * y, z))
        self.set("stone.products", (c * s * (x - y), 0.0, 0.0))
        self.start.update({f"stone.{angle}": 0.0 for angle in ("phi", "theta", "psi")})
        self.start.update({"stone.spin.x": self.rattle, "stone.spin.y": self.rattle, "stone.spin.z": self.spin})
        self.start.update({"contact.displacement_1": 0.0, "contact.displacement_2": 0.0})
