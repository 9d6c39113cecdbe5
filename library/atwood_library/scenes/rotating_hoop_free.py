"""rotating-hoop-free: a bead on a hoop that turns freely about the vertical."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.point_on_circle import PointOnCircle
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rigid_body import RigidBody


class RotatingHoopFree(Scene):
    """A bead slides on a hoop that turns freely about its vertical diameter.

    Energy and the angular momentum ``(I + m a^2 sin^2 theta) phi'`` about the vertical are kept. Without inertia of the
    hoop it is a spherical pendulum, in its angles (Goldstein, section 2.6). The angle theta is that from the upward
    vertical.
    """

    radius: Number = parameter(1.0, unit="m", above=0.0, doc="Radius of the hoop.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the bead.")
    inertia: Number = parameter(
        0.0, unit="kg*m^2", minimum=0.0, doc="Moment of inertia of the hoop about its vertical diameter."
    )
    inclination: Number = parameter(
        2.0 * math.pi / 3.0, unit="rad", doc="Angle of the bead from the upward vertical at the start."
    )
    rate: Number = parameter(2.0, unit="rad/s", doc="Rate of the hoop about the vertical at the start.")
    space = "space"
    t_end = 5.0

    ground: Ground = Ground()
    axle: Pivot = Pivot(axis=(0.0, 0.0, 1.0))
    wheel: RigidBody = RigidBody(mass=0.0)
    hoop: PointOnCircle = PointOnCircle(axis=(0.0, 1.0, 0.0), radius=radius)
    bead: PointMass = PointMass(mass=mass)
    connections = [
        connect(ground.frame, axle.a),
        connect(axle.b, wheel.frame),
        connect(wheel.frame, hoop.a),
        connect(hoop.b, bead.point),
    ]
    start = {
        "hoop.angle": inclination,
        "hoop.angular_velocity": 0.0,
        "axle.angle": 0.0,
        "axle.angular_velocity": rate,
    }

    def build(self) -> None:
        """Give the hoop the inertia of a thin ring."""
        self.set("wheel.moments", (self.inertia, 2.0 * self.inertia, self.inertia))
