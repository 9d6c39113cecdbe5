"""Rolling without slipping on a horizontal plane: a disc in steady and in any motion, and a ball on a turntable.

World: x right, y into the page, z up; the plane is z = 0. The disc's axis of symmetry is body z, with Euler angles
z-y-z: R_WB = Rz(phi) Ry(theta) Rz(psi), so that theta = pi/2 is upright and theta = 0 flat. Angular velocity in body
axes.

With A, C the moments across and along the axis about the centre, w_3 = psi' + phi' cos theta, the balance of moments
about the contact gives (E. J. Routh, *Advanced Rigid Dynamics*, art. 244; Ju. I. Neimark and N. A. Fufaev, *Dynamics of
Nonholonomic Systems*, ch. I; O. M. O'Reilly, Nonlinear Dynamics 10 (1996) 287)

    (A + m r^2) theta'' = A phi'^2 sin cos - (C + m r^2) phi' w_3 sin - m g r cos,
    A (phi' sin)' = (C w_3 - A phi' cos) theta',
    (C + m r^2) w_3' = m r^2 phi' theta' sin,

and the centre moves with v = -r w_3 e_2 + r theta' e_3, where e_3 is the axis and e_2 = (-sin phi, cos phi, 0).
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from .rotations import euler_zyz


@dataclass(frozen=True)
class RollingDisc:
    """A thin disc (or hoop) of radius r; its moments about the centre across and along the axis.

    `uniform_disc` and `hoop` make the common ones.
    """

    radius: float
    mass: float
    transverse: float
    axial: float
    gravity: float = 9.81

    def steady_spin(self, theta, precession):
        """w_3 of the steady motion with constant theta and phi' = precession: the wheel rolls in a circle."""
        a, c, k, w = self._constants()
        sine, cosine = math.sin(theta), math.cos(theta)
        return cosine * (a * precession**2 * sine - w) / ((c + k) * precession * sine)

    def steady_precession(self, theta, spin):
        """The rates phi' (0, 1 or 2 of them, ascending in size) of the steady motions with given theta and w_3."""
        a, c, k, w = self._constants()
        p, q, r = a * math.sin(theta) * math.cos(theta), -(c + k) * spin * math.sin(theta), -w * math.cos(theta)
        if abs(p) < 1e-15 * a:
            return () if q == 0 else (-r / q,)
        inside = q * q - 4 * p * r
        if inside < 0:
            return ()
        large = -(q + math.copysign(math.sqrt(inside), q)) / 2
        return tuple(sorted((large / p, r / large), key=abs)) if large else (0.0,)

    def circle(self, theta, precession):
        """Radii of the circles in which the centre and the contact move in the steady motion."""
        spin = self.steady_spin(theta, precession)
        centre = self.radius * spin / precession
        return abs(centre), abs(centre - self.radius * math.cos(theta))

    def lean_frequency_squared(self, theta, precession, spin):
        """Square of the frequency of small oscillations of theta about a steady motion; unstable where negative."""
        a, c, k, w = self._constants()
        s, cos = math.sin(theta), math.cos(theta)
        # phi' and w_3 are functions of theta along the motion.
        precession_slope = (c * spin - 2 * a * precession * cos) / (a * s)
        spin_slope = k * precession * s / (c + k)
        push = (
            a * precession**2 * (cos * cos - s * s)
            + 2 * a * precession * precession_slope * s * cos
            - (c + k) * (precession_slope * spin * s + precession * spin_slope * s + precession * spin * cos)
            + w * s
        )
        return -push / (a + k)

    def upright_rolling_threshold(self):
        """Speed of spin above which rolling straight ahead upright is stable: w_3^2 > A m g r / (C (C + m r^2)).

        sqrt(g / (3 r)) for a uniform disc, sqrt(g / (4 r)) for a hoop.
        """
        a, c, k, w = self._constants()
        return math.sqrt(a * w / (c * (c + k)))

    def upright_spinning_threshold(self):
        """Rate phi' above which spinning upright on the spot (like a coin) is stable: phi'^2 > m g r / (A + m r^2)."""
        a, _, k, w = self._constants()
        return math.sqrt(w / (a + k))

    def energy(self, theta, theta_rate, precession, spin):
        """Kinetic and potential energy; the centre is at r sin theta."""
        a, c, k, w = self._constants()
        across = (a + k) * theta_rate**2 + a * (precession * math.sin(theta)) ** 2
        return (across + (c + k) * spin**2) / 2 + w * math.sin(theta)

    def rates(self, state):
        """Rates of (theta, theta', phi', w_3, phi, psi, x, y) with (x, y) below the centre."""
        theta, theta_rate, precession, spin, phi = state[:5]
        a, c, k, w = self._constants()
        s, cos = math.sin(theta), math.cos(theta)
        push = a * precession**2 * s * cos - (c + k) * precession * spin * s - w * cos
        return np.array(
            [
                theta_rate,
                push / (a + k),
                (c * spin - 2 * a * precession * cos) * theta_rate / (a * s),
                k * precession * theta_rate * s / (c + k),
                precession,
                spin - precession * cos,
                self.radius * (spin * math.sin(phi) + theta_rate * s * math.cos(phi)),
                self.radius * (-spin * math.cos(phi) + theta_rate * s * math.sin(phi)),
            ]
        )

    def motion(self, t, angles, rates, centre=(0.0, 0.0)):
        """Any motion, integrated to 1e-13: `RollingMotion` at the times t (ascending, from the start on).

        Parameters
        ----------
        t
            Times, the first of which is the start.
        angles, rates
            (phi, theta, psi) and their rates at the start.
        centre
            (x, y) of the centre at the start.
        """
        t = np.asarray(t, dtype=float)
        phi, theta, psi = angles
        spin = rates[2] + rates[0] * math.cos(theta)
        start = [theta, rates[1], rates[0], spin, phi, psi, *centre]
        done = solve_ivp(
            lambda _, y: self.rates(y), (t[0], t[-1]), start, method="DOP853", t_eval=t, rtol=3e-14, atol=1e-14
        )
        if not done.success:
            raise ValueError(done.message)
        return RollingMotion(self, t, done.y)

    def _constants(self):
        """A, C, m r^2, m g r."""
        square = self.mass * self.radius**2
        return self.transverse, self.axial, square, self.mass * self.gravity * self.radius


@dataclass(frozen=True, eq=False)
class RollingMotion:
    """States (8, n) of a rolling disc at times (n,): see `RollingDisc.rates`."""

    disc: RollingDisc
    time: np.ndarray
    states: np.ndarray

    @property
    def orientation(self):
        """R_WB, shape (n, 3, 3)."""
        return euler_zyz(self.states[4], self.states[0], self.states[5])

    @property
    def omega(self):
        """Angular velocity in body axes, shape (n, 3)."""
        theta, theta_rate, precession, spin, _, psi = self.states[:6]
        lean = -precession * np.sin(theta)
        return np.stack(
            [
                lean * np.cos(psi) + theta_rate * np.sin(psi),
                -lean * np.sin(psi) + theta_rate * np.cos(psi),
                spin,
            ],
            axis=-1,
        )

    @property
    def centre(self):
        """Position of the centre, shape (n, 3)."""
        return np.stack([self.states[6], self.states[7], self.disc.radius * np.sin(self.states[0])], axis=-1)

    @property
    def contact(self):
        """Position of the contact, shape (n, 3), with z = 0."""
        theta, phi = self.states[0], self.states[4]
        down = np.stack([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), -np.sin(theta)], axis=-1)
        return self.centre + self.disc.radius * down

    @property
    def energy(self):
        """Total energy, shape (n,)."""
        return np.array([self.disc.energy(*column[:4]) for column in self.states.T])


def uniform_disc(radius, mass, gravity=9.81):
    """A thin uniform disc: C = m r^2 / 2, A = C / 2."""
    return RollingDisc(radius, mass, mass * radius**2 / 4, mass * radius**2 / 2, gravity)


def hoop(radius, mass, gravity=9.81):
    """A thin hoop: C = m r^2, A = C / 2."""
    return RollingDisc(radius, mass, mass * radius**2 / 2, mass * radius**2, gravity)


class TurntableBall:
    """A ball that rolls on a level table that turns at a constant rate about the vertical through the origin.

    Its centre moves in a circle at the rate O I / (I + m r^2), 2/7 of the table's for a uniform ball, wherever it
    starts (S. Earnshaw, *Dynamics* (1844); K. Weltner, Am. J. Phys. 47 (1979) 984).

    Parameters
    ----------
    radius, mass, moment
        Of the ball; moment of inertia about its centre.
    rate
        Of the table, O in rad/s.
    position, velocity
        (x, y) of the centre and its rate at t = 0, seen from outside.
    spin
        Angular velocity about the vertical, which stays.
    """

    def __init__(self, radius, mass, moment, rate, position, velocity, spin=0.0):
        self.radius, self.rate, self.spin = float(radius), float(rate), float(spin)
        self.circling = rate * moment / (moment + mass * radius**2)
        self.velocity_0 = complex(*velocity)
        self.middle = complex(*position) + 1j * self.velocity_0 / self.circling

    def position(self, t):
        """(x, y) of the centre: shape of t, then 2."""
        z = self.middle - 1j * self.velocity_0 / self.circling * np.exp(1j * self.circling * np.asarray(t, dtype=float))
        return np.stack([z.real, z.imag], axis=-1)

    def velocity(self, t):
        """(x', y') of the centre."""
        v = self.velocity_0 * np.exp(1j * self.circling * np.asarray(t, dtype=float))
        return np.stack([v.real, v.imag], axis=-1)

    def omega_world(self, t):
        """Angular velocity in world axes, from v - r w x e_z = O e_z x p: shape of t, then 3."""
        v, p = self.velocity(t), self.position(t)
        slip = v - self.rate * np.stack([-p[..., 1], p[..., 0]], axis=-1)
        return np.stack([-slip[..., 1], slip[..., 0], np.full(slip.shape[:-1], self.spin * self.radius)], axis=-1) / (
            self.radius
        )
