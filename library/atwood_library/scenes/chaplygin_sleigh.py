"""chaplygin-sleigh: a sleigh on one blade, seen from above."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.blade import Blade
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody


class ChaplyginSleigh(Scene):
    """A sleigh slides on level ice on one blade, with its centre of mass ahead of it by a.

    It comes to go straight on, whichever way it starts: ``v' = a w^2`` and ``w' = -m a v w/(J + m a^2)``, so that v
    goes as a hyperbolic tangent (Neimark and Fufaev, Dynamics of Nonholonomic Systems, chapter 2). Energy is kept.
    """

    mass: Number = parameter(2.0, unit="kg", above=0.0, doc="Mass m.")
    inertia: Number = parameter(0.5, unit="kg*m^2", above=0.0, doc="Moment of inertia J about the centre of mass.")
    ahead: Number = parameter(0.4, unit="m", above=0.0, doc="Distance a of the centre of mass ahead of the blade.")
    speed: Number = parameter(-1.0, unit="m/s", doc="Speed v along the blade at the start.")
    spin: Number = parameter(1.5, unit="rad/s", doc="Angular velocity w at the start, counter-clockwise.")
    gravity = 0.0
    t_end = 5.0

    ice: Ground = Ground()
    sleigh: RigidBody = RigidBody(mass=mass)
    blade: Blade = Blade()
    connections = [connect(ice.frame, blade.a), connect(blade.b, sleigh.frame)]
    start = {"blade.speed": speed}

    def build(self) -> None:
        """Put the centre of mass ahead, and start."""
        self.set("sleigh.center", (self.ahead, 0.0, 0.0))
        self.set("sleigh.moments", (0.0, self.inertia, 0.0))
        self.start.update({"sleigh.position.x": self.ahead, "sleigh.position.z": 0.0})
        self.start["sleigh.velocity.z"] = self.ahead * self.spin

    def closed_form(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return speed and turning."""
        whole = self.inertia + self.mass * self.ahead**2
        energy = 0.5 * self.mass * self.speed**2 + 0.5 * whole * self.spin**2
        last, most = math.sqrt(2.0 * energy / self.mass), math.sqrt(2.0 * energy / whole)
        rate = self.ahead * most**2 / last
        s = rate * t + math.atanh(self.speed / last)
        return {"blade.speed": last * np.tanh(s), "sleigh.angular_speed": math.copysign(most, self.spin) / np.cosh(s)}
