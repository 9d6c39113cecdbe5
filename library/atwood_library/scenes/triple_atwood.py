"""triple-atwood: two Atwood machines that hang on a third one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scene, connect, parameter
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.ropes.pulley import Pulley
from atwood_library.ropes.rope import Rope


class TripleAtwood(Scene):
    """A rope over a fixed pulley carries a pulley on each side, each with a rope and two masses.

    It has three degrees of freedom. The tension of a lower rope is ``2 g' m m'/(m + m') = mu g'/2`` in the acceleration
    g' that is felt on its pulley, with the mass ``mu = 4 m m'/(m + m')`` that it stands for, so that the upper machine
    moves as with two such masses.
    """

    mass1: Number = parameter(3.0, unit="kg", above=0.0, doc="First mass on the left.")
    mass2: Number = parameter(2.0, unit="kg", above=0.0, doc="Second mass on the left.")
    mass3: Number = parameter(2.5, unit="kg", above=0.0, doc="First mass on the right.")
    mass4: Number = parameter(1.0, unit="kg", above=0.0, doc="Second mass on the right.")
    space = "line"
    line_axis = (0.0, 0.0, 1.0)
    t_end = 1.0

    ground: Ground = Ground()
    top: Pulley = Pulley()
    left: Pulley = Pulley()
    right: Pulley = Pulley()
    upper: Rope = Rope(pulleys=1, length=20.0)
    lower_left: Rope = Rope(pulleys=1, length=20.0)
    lower_right: Rope = Rope(pulleys=1, length=20.0)
    m1: PointMass = PointMass(mass=mass1)
    m2: PointMass = PointMass(mass=mass2)
    m3: PointMass = PointMass(mass=mass3)
    m4: PointMass = PointMass(mass=mass4)
    connections = [
        connect(ground.frame, top.center),
        connect(upper.a, left.center),
        connect(upper.over[0], top.groove),
        connect(upper.b, right.center),
        connect(lower_left.a, m1.point),
        connect(lower_left.over[0], left.groove),
        connect(lower_left.b, m2.point),
        connect(lower_right.a, m3.point),
        connect(lower_right.over[0], right.groove),
        connect(lower_right.b, m4.point),
    ]
    start = {
        "left.position.z": -10.0,
        "left.velocity.z": 0.0,
        "m1.position.z": -20.0,
        "m1.velocity.z": 0.0,
        "m3.position.z": -20.0,
        "m3.velocity.z": 0.0,
    }
    guess = {"right.position.z": -10.0, "m2.position.z": -20.0, "m4.position.z": -20.0}

    def closed_form(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return the motion with constant accelerations."""
        g, (m1, m2, m3, m4) = self.gravity, (self.mass1, self.mass2, self.mass3, self.mass4)
        left, right = 4.0 * m1 * m2 / (m1 + m2), 4.0 * m3 * m4 / (m3 + m4)
        down = (left - right) / (left + right) * g  # of the left pulley
        first = down + (m1 - m2) / (m1 + m2) * (g - down)
        third = -down + (m3 - m4) / (m3 + m4) * (g + down)
        return {
            "left.position.z": -10.0 - 0.5 * down * t**2,
            "m1.position.z": -20.0 - 0.5 * first * t**2,
            "m3.position.z": -20.0 - 0.5 * third * t**2,
            "upper.tension": np.full_like(t, 2.0 * left * right / (left + right) * g),
        }
