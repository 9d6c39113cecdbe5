"""Foucault's pendulum, seen from the turning Earth.

World frame W turns with the Earth: x east, y north, z up (any right-handed frame with z up will do for the small
oscillation). Rate of turning about the vertical: O_z = O sin(latitude).

Small oscillation, centrifugal force left out except that of O_z on the frequency, with s = x + i y (Landau and
Lifshitz, *Mechanics*, par. 39, problem 3):

    s'' + 2 i O_z s' + w0^2 s = 0,   s = exp(-i O_z t) (c cos(w t) + d sin(w t)),   w^2 = w0^2 + O_z^2.
"""

import math

import numpy as np

from .rotations import about_z
from .spherical_pendulum import SphericalPendulum


class SmallFoucault:
    """The linear equation above, exactly.

    Parameters
    ----------
    frequency
        w0 = sqrt(g / l) in rad/s.
    rate
        O_z = O sin(latitude) in rad/s.
    position, velocity
        (x, y) and its rate in the turning frame at t = 0.

    Attributes
    ----------
    turning_rate
        Rate of the plane of oscillation: -O_z, clockwise from above in the north.
    """

    def __init__(self, frequency, rate, position, velocity=(0.0, 0.0)):
        self.frequency = math.hypot(frequency, rate)
        self.rate = float(rate)
        self.turning_rate = -float(rate)
        self.start = complex(*position)
        self.sine = (complex(*velocity) + 1j * rate * self.start) / self.frequency

    def position(self, t):
        """(x, y): shape of t, then 2."""
        t = np.asarray(t, dtype=float)
        swing = self.start * np.cos(self.frequency * t) + self.sine * np.sin(self.frequency * t)
        s = np.exp(-1j * self.rate * t) * swing
        return np.stack([s.real, s.imag], axis=-1)

    def velocity(self, t):
        """(x', y'): shape of t, then 2."""
        t = np.asarray(t, dtype=float)
        c, s = np.cos(self.frequency * t), np.sin(self.frequency * t)
        swing, swing_rate = self.start * c + self.sine * s, self.frequency * (self.sine * c - self.start * s)
        v = np.exp(-1j * self.rate * t) * (swing_rate - 1j * self.rate * swing)
        return np.stack([v.real, v.imag], axis=-1)


class PolarFoucault:
    """Any oscillation of a pendulum whose support turns about the vertical through it, at rate O_z (at a pole).

    Seen from outside it is a spherical pendulum under g, so that the answer is exact for every amplitude; the turning
    frame has both its Coriolis and its centrifugal force, and `gravity` is the attraction alone.

    Parameters
    ----------
    length, gravity, rate
        In m, m/s^2, rad/s.
    position, velocity
        In the turning frame at t = 0, shape (3,); the pivot is the origin.
    """

    def __init__(self, length, gravity, rate, position, velocity):
        position, velocity = np.asarray(position, dtype=float), np.asarray(velocity, dtype=float)
        self.rate = float(rate)
        self.outside = SphericalPendulum(
            length, gravity, position, velocity + self.rate * np.cross([0.0, 0, 1], position)
        )

    def position(self, t):
        """In the turning frame: shape of t, then 3."""
        return self._turned(t, self.outside.position(t))

    def velocity(self, t):
        """In the turning frame: shape of t, then 3."""
        position = self.outside.position(t)
        return self._turned(t, self.outside.velocity(t) - self.rate * np.cross([0.0, 0, 1], position))

    def _turned(self, t, vector):
        return np.einsum("...ij,...j->...i", about_z(-self.rate * np.asarray(t, dtype=float)), vector)


def coriolis_acceleration(rotation_rate, latitude, velocity):
    """-2 O x v in the frame x east, y north, z up, for O along the Earth's axis; latitude in rad."""
    earth = rotation_rate * np.array([0.0, math.cos(latitude), math.sin(latitude)])
    return -2 * np.cross(earth, velocity)
