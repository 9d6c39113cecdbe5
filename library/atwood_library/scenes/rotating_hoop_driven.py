"""rotating-hoop-driven: a bead on a hoop that is turned about the vertical at a constant rate."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.point_on_circle import PointOnCircle
from atwood_library.joints.rotary_drive import RotaryDrive
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.sources.ramp import Ramp


class RotatingHoopDriven(Scene):
    """A bead slides on a hoop that is turned about its vertical diameter at a constant rate.

    The angle is that from the upward vertical. Energy is not kept, since the drive does work; Jacobi's integral
    ``m a^2 (theta'^2 - omega^2 sin^2 theta)/2 + m g a cos theta`` is (Goldstein, section 2.7). Where ``omega^2 > g/a``
    the bead rests at ``cos theta = -g/(omega^2 a)``.
    """

    radius: Number = parameter(1.0, unit="m", above=0.0, doc="Radius of the hoop.", symbol="a")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the bead.")
    rate: Number = parameter(5.0, unit="rad/s", doc="Rate of the hoop about the vertical.", symbol="omega")
    inclination: Number = parameter(
        2.0 * math.pi / 3.0, unit="rad", doc="Angle of the bead from the upward vertical at the start."
    )
    space = "space"
    t_end = 5.0

    ground: Ground = Ground()
    clock: Ramp = Ramp(slope=rate)
    drive: RotaryDrive = RotaryDrive(axis=(0.0, 0.0, 1.0))
    hoop: PointOnCircle = PointOnCircle(axis=(0.0, 1.0, 0.0), radius=radius)
    bead: PointMass = PointMass(mass=mass)
    connections = [
        connect(clock.output("value"), drive.input("rotation")),
        connect(ground.frame, drive.a),
        connect(drive.b, hoop.a),
        connect(hoop.b, bead.point),
    ]
    start = {"hoop.angle": inclination, "hoop.angular_velocity": 0.0}
