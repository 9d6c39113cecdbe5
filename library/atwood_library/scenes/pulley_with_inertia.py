"""pulley-with-inertia: Atwood's machine with a wheel that has to be turned."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scene, connect, parameter
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.ropes.pulley import Pulley
from atwood_library.ropes.rope import Rope


class PulleyWithInertia(Scene):
    """Two masses on a rope over a wheel that has inertia and does not let the rope slip.

    The acceleration is ``(m1 - m2) g/(m1 + m2 + J/R^2)``, and the tensions on the two sides differ. Where the ends
    swing aside, `WoundRope` has the wheel's radius and the points where the rope leaves it.
    """

    mass1: Number = parameter(2.0, unit="kg", above=0.0, doc="Mass on one side.")
    mass2: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass on the other side.")
    inertia: Number = parameter(0.03, unit="kg*m^2", minimum=0.0, doc="Moment of inertia J of the wheel.")
    radius: Number = parameter(0.2, unit="m", above=0.0, doc="Radius R of the wheel.")
    space = "line"
    line_axis = (0.0, 0.0, 1.0)
    t_end = 1.0

    ground: Ground = Ground()
    pulley: Pulley = Pulley()
    rope: Rope = Rope(pulleys=1, length=10.0, pulley_inertia=inertia / radius**2)
    m1: PointMass = PointMass(mass=mass1)
    m2: PointMass = PointMass(mass=mass2)
    start = {"m1.position.z": -5.0, "m1.velocity.z": 0.0}
    guess = {"m2.position.z": -5.0}
    connections = [
        connect(ground.frame, pulley.center),
        connect(rope.a, m1.point),
        connect(rope.over[0], pulley.groove),
        connect(rope.b, m2.point),
    ]

    def closed_form(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return the motion with constant acceleration."""
        m1, m2, g = self.mass1, self.mass2, self.gravity
        a = (m1 - m2) * g / (m1 + m2 + self.inertia / self.radius**2)
        return {
            "m1.position.z": -5.0 - 0.5 * a * t**2,
            "rope.tension_a": np.full_like(t, m1 * (g - a)),
            "rope.tension": np.full_like(t, m2 * (g + a)),
        }
