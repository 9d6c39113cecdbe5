"""atwood: two masses on a rope over a fixed pulley."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scene, connect, parameter
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.ropes.pulley import Pulley
from atwood_library.ropes.rope import Rope


class Atwood(Scene):
    """Two masses on a rope over a fixed ideal pulley, released at rest (Atwood's machine)."""

    mass1: Number = parameter(2.0, unit="kg", above=0.0, doc="Mass on one side.")
    mass2: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass on the other side.")
    rope_length: Number = parameter(4.0, unit="m", above=0.0, doc="Length of the rope; half hangs on each side.")
    space = "line"
    line_axis = (0.0, 0.0, 1.0)
    t_end = 1.0

    ground: Ground = Ground()
    pulley: Pulley = Pulley()
    rope: Rope = Rope(pulleys=1, length=rope_length)
    m1: PointMass = PointMass(mass=mass1)
    m2: PointMass = PointMass(mass=mass2)
    start = {"m1.position.z": -0.5 * rope_length, "m1.velocity.z": 0.0}
    guess = {"m2.position.z": -0.5 * rope_length}
    connections = [
        connect(ground.frame, pulley.center),
        connect(rope.a, m1.point),
        connect(rope.over[0], pulley.groove),
        connect(rope.b, m2.point),
    ]

    def closed_form(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return the motion with constant acceleration ``(m1 - m2)/(m1 + m2) g`` of m1 downwards."""
        m1, m2, g = self.mass1, self.mass2, self.gravity
        a = (m1 - m2) / (m1 + m2) * g
        z = -0.5 * self.rope_length
        tension = np.full_like(t, 2.0 * m1 * m2 / (m1 + m2) * g)
        return {"m1.position.z": z - 0.5 * a * t**2, "m2.position.z": z + 0.5 * a * t**2, "rope.tension": tension}
