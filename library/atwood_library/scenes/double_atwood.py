"""double-atwood: a rope over a moving pulley that hangs on a rope over a fixed one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scene, connect, parameter
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.ropes.pulley import Pulley
from atwood_library.ropes.rope import Rope


class DoubleAtwood(Scene):
    """Atwood's machine with a second one in the place of a mass: m1 against a moving pulley with m2 and m3."""

    mass1: Number = parameter(4.0, unit="kg", above=0.0, doc="Mass against the moving pulley.")
    mass2: Number = parameter(3.0, unit="kg", above=0.0, doc="First mass on the moving pulley.")
    mass3: Number = parameter(1.0, unit="kg", above=0.0, doc="Second mass on the moving pulley.")
    length1: Number = parameter(10.0, unit="m", above=0.0, doc="Length of the rope over the fixed pulley.")
    length2: Number = parameter(24.0, unit="m", above=0.0, doc="Length of the rope over the moving pulley.")
    space = "line"
    line_axis = (0.0, 0.0, 1.0)
    t_end = 2.0

    ground: Ground = Ground()
    pulley1: Pulley = Pulley()
    rope1: Rope = Rope(pulleys=1, length=length1)
    m1: PointMass = PointMass(mass=mass1)
    pulley2: Pulley = Pulley()
    rope2: Rope = Rope(pulleys=1, length=length2)
    m2: PointMass = PointMass(mass=mass2)
    m3: PointMass = PointMass(mass=mass3)
    connections = [
        connect(ground.frame, pulley1.center),
        connect(rope1.a, m1.point),
        connect(rope1.over[0], pulley1.groove),
        connect(rope1.b, pulley2.center),
        connect(rope2.a, m2.point),
        connect(rope2.over[0], pulley2.groove),
        connect(rope2.b, m3.point),
    ]
    start = {
        "m1.position.z": -0.5 * length1,
        "m2.position.z": -0.5 * (length1 + length2),
        "m1.velocity.z": 0.0,
        "m2.velocity.z": 0.0,
    }
    guess = {"pulley2.position.z": -0.5 * length1, "m3.position.z": -0.5 * (length1 + length2)}

    def closed_form(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return the motion with constant accelerations, from the balance of each mass and of the moving pulley."""
        m1, m2, m3, g = self.mass1, self.mass2, self.mass3, self.gravity
        whole = m1 * (m2 + m3) + 4.0 * m2 * m3
        down1 = (m1 * (m2 + m3) - 4.0 * m2 * m3) / whole * g
        down2 = 2.0 * m1 * (m2 - m3) / whole * g - down1
        down3 = -2.0 * m1 * (m2 - m3) / whole * g - down1
        upper, lower = -0.5 * self.length1, -0.5 * (self.length1 + self.length2)
        fall = 0.5 * t**2
        tension = m1 * (g - down1)
        return {
            "m1.position.z": upper - down1 * fall,
            "m2.position.z": lower - down2 * fall,
            "m3.position.z": lower - down3 * fall,
            "pulley2.position.z": upper + down1 * fall,
            "rope1.tension": np.full_like(t, tension),
            "rope2.tension": np.full_like(t, 0.5 * tension),
        }
