"""mass-spring-chain: two masses and three springs between two walls."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scene, connect, parameter
from atwood_library.forces.spring import Spring
from atwood_library.parts.ground import Ground
from atwood_library.parts.mass_1d import Mass1D


class MassSpringChain(Scene):
    """Two equal masses on a line, joined to each other and to two walls by three equal springs.

    It starts at rest with the first mass out of place, so that both modes of vibration are excited.
    """

    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of each body.")
    stiffness: Number = parameter(10.0, unit="N/m", above=0.0, doc="Stiffness of each spring.")
    spacing: Number = parameter(1.0, unit="m", above=0.0, doc="Natural length of each spring.")
    shift: Number = parameter(0.2, unit="m", doc="How far the first mass starts from its place.")
    space = "line"
    t_end = 5.0

    left: Ground = Ground()
    spring1: Spring = Spring(stiffness=stiffness, natural_length=spacing)
    m1: Mass1D = Mass1D(mass=mass)
    spring2: Spring = Spring(stiffness=stiffness, natural_length=spacing)
    m2: Mass1D = Mass1D(mass=mass)
    spring3: Spring = Spring(stiffness=stiffness, natural_length=spacing)
    right: Ground = Ground()
    connections = [
        connect(left.frame, spring1.a),
        connect(spring1.b, m1.flange),
        connect(m1.flange, spring2.a),
        connect(spring2.b, m2.flange),
        connect(m2.flange, spring3.a),
        connect(spring3.b, right.frame),
    ]
    start = {"m1.displacement": spacing + shift, "m2.displacement": 2.0 * spacing, "m1.speed": 0.0, "m2.speed": 0.0}

    def build(self) -> None:
        """Put the right wall where the springs have their natural lengths."""
        self.right.position = (3.0 * self.spacing, 0.0, 0.0)

    def closed_form(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return the motion as the sum of both modes, of frequencies sqrt(k/m) and sqrt(3k/m) (Goldstein, 6.4)."""
        slow = np.sqrt(self.stiffness / self.mass)
        together, against = np.cos(slow * t), np.cos(np.sqrt(3.0) * slow * t)
        half = 0.5 * self.shift
        return {
            "m1.displacement": self.spacing + half * (together + against),
            "m2.displacement": 2.0 * self.spacing + half * (together - against),
        }
