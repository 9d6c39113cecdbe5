"""simple-pendulum: a bob on a massless rod."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scene, connect, parameter
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rod import Rod


class SimplePendulum(Scene):
    """A bob on a massless rod, released at rest from an angle."""

    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the rod.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the bob.")
    release_angle: Number = parameter(1.0, unit="rad", doc="Angle at the start.")
    t_end = 5.0

    ground: Ground = Ground()
    rod: Rod = Rod(length=length)
    bob: PointMass = PointMass(mass=mass)
    connections = [connect(ground.frame, rod.a), connect(rod.b, bob.point)]
    start = {"rod.angle": release_angle, "rod.angular_velocity": 0.0}

    def closed_form(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return the motion by Jacobi's elliptic functions: ``theta = 2 asin(k cd(w t))`` (Landau and Lifshitz, 11)."""
        from scipy.special import ellipj

        w, k = np.sqrt(self.gravity / self.length), np.sin(self.release_angle / 2.0)
        sn, cn, dn, _ = ellipj(w * t, k * k)
        angle = 2.0 * np.arcsin(k * cn / dn)
        rate = -2.0 * k * w * np.sqrt(1.0 - k * k) * sn / dn
        tension = self.mass * (self.gravity * np.cos(angle) + self.length * rate**2)
        return {"rod.angle": angle, "rod.angular_velocity": rate, "rod.tension": tension}
