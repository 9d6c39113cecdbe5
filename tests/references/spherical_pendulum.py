"""The spherical pendulum by elliptic functions, for any start, also through the lowest and the highest point.

World: x right, y into the page, z up; the pivot is the origin. It is the axis of a top without spin: with u = z / l,
b = (x y' - y x') / l^2, alpha = v^2 / l^2 + 2 g u / l. Landau and Lifshitz, *Mechanics*, par. 14, problem 1.
"""

import mpmath as mp
import numpy as np

from .rotations import euler_zyz
from .top import DIGITS, AxisMotion


class SphericalPendulum:
    """Motion of a point mass at a fixed distance from the pivot.

    Parameters
    ----------
    length, gravity
        In m and m/s^2.
    position, velocity
        At t = 0; the position is scaled to the length, and the velocity's part along it is left out, both of which must
        be rounding only.

    Attributes
    ----------
    period
        Of the height z; azimuth_advance is what the azimuth grows by in it (nan for a plane motion).
    z_lowest, z_highest
        Turning heights.
    """

    def __init__(self, length, gravity, position, velocity):
        self.length, self.gravity = float(length), float(gravity)
        with mp.workdps(DIGITS):
            r, v = [mp.mpf(x) for x in position], [mp.mpf(x) for x in velocity]
            size = mp.sqrt(mp.fdot(r, r))
            along, fast = mp.fdot(r, v) / size, mp.sqrt(mp.fdot(v, v))
            if abs(size - length) > 1e-12 * length or abs(along) > 1e-12 * (fast + 1e-300):
                raise ValueError("the start is not on the sphere")
            e = [x / size for x in r]
            w = [(x - along * y) / length for x, y in zip(v, e, strict=True)]
            beta = 2 * mp.mpf(gravity) / mp.mpf(length)
            alpha = mp.fdot(w, w) + beta * e[2]
            b = e[0] * w[1] - e[1] * w[0]
            theta, phi = mp.atan2(mp.hypot(e[0], e[1]), e[2]), mp.atan2(e[1], e[0])
            start = euler_zyz(float(phi), float(theta), 0.0)
            spinless = np.cross([float(x) for x in e], [float(x) for x in w])
            constants = beta, mp.mpf(0), b, alpha, e[2], w[2], mp.mpf(0)
        self.motion = AxisMotion(*constants, start, start.T @ spinless)
        self.period = self.motion.period
        self.azimuth_advance = float("nan") if self.motion.steady else self.motion.advance(self.period)[0]
        self.z_lowest, self.z_highest = self.length * self.motion.lower, self.length * self.motion.upper

    def position(self, t):
        """Shape of t, then 3."""
        return self.length * self.motion.axis(t)

    def velocity(self, t):
        """Shape of t, then 3."""
        return self.length * self.motion.axis_rate(t)

    def tension(self, t, mass=1.0):
        """Force of the rod on the mass towards the pivot: m (v^2 / l - g z / l)."""
        speed_squared = np.sum(self.velocity(t) ** 2, axis=-1)
        return mass * (speed_squared / self.length - self.gravity * self.motion.cos_theta(t))
