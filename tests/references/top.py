"""Lagrange's top: a symmetric body with a fixed point on its axis, under gravity; and the motion of its axis.

World: x right, y into the page, z up, gravity along -z. Body z is the axis of symmetry, from the fixed point towards
the centre of mass. Euler angles z-y-z: R_WB = Rz(phi) Ry(theta) Rz(psi), so that theta is the angle of the axis with
the upward vertical and phi its azimuth. Angular velocity in body axes.

With A, C the moments across and along the axis about the fixed point, h = m g l, a = C w_3 / A, b = p_phi / A,
beta = 2 h / A, alpha = (2 T - C w_3^2 + 2 V) / A, the cosine u = cos theta obeys (Goldstein, Poole and Safko,
*Classical Mechanics*, sec. 5.7; Landau and Lifshitz, *Mechanics*, par. 35)

    u'^2 = (1 - u^2) (alpha - beta u) - (b - a u)^2 = beta (u - u1) (u2 - u) (u3 - u),
    u = u1 + (u2 - u1) sn^2(r (t - t0)),   r = sqrt(beta (u3 - u1)) / 2,   m = (u2 - u1) / (u3 - u1),

and the half angles' phases follow from (phi + psi)' = w_3 - a + (a + b) / (1 + u) and
(phi - psi)' = a - w_3 + (b - a) / (1 - u), integrals of the third kind. The orientation is put together from
cos(theta/2) exp(i (phi + psi)/2) and sin(theta/2) exp(i (phi - psi)/2), which stay smooth through the vertical (where
one of the cosine and the sine changes its sign).
"""

import math

import mpmath as mp
import numpy as np

from .jacobi import first_kind, jacobi, quarter_period, third_kind
from .rotations import euler_zyz, from_quaternion, quaternion

DIGITS = 60
SAME = mp.mpf(10) ** -45


class AxisMotion:
    """The motion of the axis and the phases about it, from the constants of the motion.

    Parameters
    ----------
    beta, a, b, alpha
        The constants above; `mpmath` numbers keep what doubles would lose.
    u, u_rate
        cos theta and its rate at t = 0.
    spin
        Angular velocity about the axis, w_3.
    start, omega
        R_WB and angular velocity in body axes at t = 0.
    """

    def __init__(self, beta, a, b, alpha, u, u_rate, spin, start, omega):
        with mp.workdps(DIGITS):
            beta, a, b, alpha, u, u_rate = (mp.mpf(value) for value in (beta, a, b, alpha, u, u_rate))
            if beta <= 0:
                raise ValueError("the weight's moment must be positive: turn the body's axis round")
            lower, upper, third = _roots(beta, a, b, alpha, u, u_rate)
            if upper > third - SAME and abs(u - upper) < SAME and u_rate == 0:
                lower = upper  # upright and left alone: it stays, although the upright position is unstable
            self.gap = float(upper - lower)
            self.steady = upper - lower < SAME
            self.lower, self.upper, self.third = float(lower), float(upper), float(third)
            self.above, self.below = float(1 - lower), float(1 + lower)  # exact next to the poles
            self.above_least, self.below_most = float(1 - upper), float(1 + upper)
            self.through_top = upper == 1
            self.through_bottom = lower == -1
            self.mc = 1.0 if self.steady else float((third - upper) / (third - lower))
            self.rate = float(mp.sqrt(beta * max(third - lower, mp.mpf(0)))) / 2
            self.sigma_rates = float(spin - a), 0.0 if self.through_bottom else float((a + b) / (1 + lower))
            self.delta_rates = float(a - spin), 0.0 if self.through_top else float((b - a) / (1 - lower))
            self.phase = 0.0
            if not self.steady:
                sn, cn = mp.sqrt(max((u - lower) / (upper - lower), 0)), mp.sqrt(max((upper - u) / (upper - lower), 0))
                self.phase = math.copysign(first_kind(float(sn), float(cn), self.mc), float(u_rate))
        self.spin = float(spin)
        self.half_angles_0 = 1.0 + 0j, 1.0 + 0j
        self.half_angles_0 = self._fit(np.asarray(start, dtype=float), np.asarray(omega, dtype=float))

    @property
    def period(self):
        """Time from one lowest position to the next; nan for a steady motion, infinite on the separatrix."""
        return math.nan if self.steady else 2 * quarter_period(self.mc) / self.rate

    def cos_theta(self, t):
        """cos theta, the shape of t."""
        sn, _, _ = self._functions(t)
        return self.lower + self.gap * sn**2

    def advance(self, duration):
        """What phi and psi grow by over a whole number of periods; both nan where the axis passes a vertical."""
        if self.through_top or self.through_bottom:
            return math.nan, math.nan
        sigma, delta = self._phases(np.asarray(float(duration)))
        return float(sigma + delta) / 2, float(sigma - delta) / 2

    def half_angles(self, t):
        """cos(theta/2) exp(i (phi + psi)/2), sin(theta/2) exp(i (phi - psi)/2), and their rates."""
        sn, cn, dn = self._functions(t)
        sigma, delta = self._phases(np.asarray(t, dtype=float))
        u_rate = 2 * self.gap * self.rate * sn * cn * dn
        below, above = self.below + self.gap * sn**2, self.above_least + self.gap * cn**2
        if self.through_bottom:
            size = math.sqrt(self.gap / 2)
            cosine, cosine_rate = size * sn, size * self.rate * cn * dn
        else:
            cosine = np.sqrt(below / 2)
            cosine_rate = u_rate / (4 * cosine)
        if self.through_top:
            size = math.sqrt(self.gap / 2)
            sine, sine_rate = size * cn, -size * self.rate * sn * dn
        else:
            sine = np.sqrt(above / 2)
            sine_rate = -u_rate / (4 * np.where(sine == 0, 1.0, sine))
        sigma_rate = self.sigma_rates[0] + self.sigma_rates[1] * self.below / np.where(below == 0, 1.0, below)
        delta_rate = self.delta_rates[0] + self.delta_rates[1] * self.above / np.where(above == 0, 1.0, above)
        turn_sigma = self.half_angles_0[0] * np.exp(0.5j * sigma)
        turn_delta = self.half_angles_0[1] * np.exp(0.5j * delta)
        return (
            cosine * turn_sigma,
            sine * turn_delta,
            (cosine_rate + 0.5j * sigma_rate * cosine) * turn_sigma,
            (sine_rate + 0.5j * delta_rate * sine) * turn_delta,
        )

    def orientation(self, t):
        """R_WB: shape of t, then (3, 3)."""
        alpha, beta, _, _ = self.half_angles(t)
        return from_quaternion(np.stack([alpha.real, -beta.imag, beta.real, alpha.imag], axis=-1))

    def omega(self, t):
        """Angular velocity in body axes: shape of t, then 3."""
        alpha, beta, alpha_rate, beta_rate = self.half_angles(t)
        # omega = 2 vec(q* q') with q = (Re alpha, -Im beta, Re beta, Im alpha)
        cross = 2 * (alpha * beta_rate.conjugate() - beta.conjugate() * alpha_rate)
        along = 2 * (alpha.conjugate() * alpha_rate - beta.conjugate() * beta_rate).imag
        return np.stack([cross.imag, cross.real, along], axis=-1)

    def axis(self, t):
        """Direction of the body's z axis in the world: shape of t, then 3."""
        alpha, beta, _, _ = self.half_angles(t)
        across = 2 * alpha * beta
        return np.stack([across.real, across.imag, self.cos_theta(t)], axis=-1)

    def axis_rate(self, t):
        """Rate of `axis`."""
        alpha, beta, alpha_rate, beta_rate = self.half_angles(t)
        across = 2 * (alpha_rate * beta + alpha * beta_rate)
        sn, cn, dn = self._functions(t)
        return np.stack([across.real, across.imag, 2 * self.gap * self.rate * sn * cn * dn], axis=-1)

    def _functions(self, t):
        t = np.asarray(t, dtype=float)
        if self.steady:
            return np.zeros_like(t), np.ones_like(t), np.ones_like(t)
        return jacobi(self.rate * t + self.phase, self.mc)

    def _phases(self, t):
        """What phi + psi and phi - psi have grown by since t = 0."""
        sigma, delta = self.sigma_rates[0] * t, self.delta_rates[0] * t
        if self.steady:
            return sigma + self.sigma_rates[1] * t, delta + self.delta_rates[1] * t
        u = self.rate * t + self.phase
        if self.sigma_rates[1]:
            n, rest = -self.gap / self.below, self.below_most / self.below
            grown = third_kind(n, u, self.mc, rest) - third_kind(n, self.phase, self.mc, rest)
            sigma = sigma + self.sigma_rates[1] / self.rate * grown
        if self.delta_rates[1]:
            n, rest = self.gap / self.above, self.above_least / self.above
            grown = third_kind(n, u, self.mc, rest) - third_kind(n, self.phase, self.mc, rest)
            delta = delta + self.delta_rates[1] / self.rate * grown
        return sigma, delta

    def _fit(self, start, omega):
        """The constant phases that give the orientation at t = 0, or where the axis starts vertical, its rate."""
        w, x, y, z = quaternion(start)
        rates = 0.5 * np.array(
            [
                -x * omega[0] - y * omega[1] - z * omega[2],
                w * omega[0] + y * omega[2] - z * omega[1],
                w * omega[1] + z * omega[0] - x * omega[2],
                w * omega[2] + x * omega[1] - y * omega[0],
            ]
        )
        wanted = complex(w, z), complex(y, -x), complex(rates[0], rates[3]), complex(rates[2], -rates[1])
        found = [complex(part) for part in self.half_angles(0.0)]
        phases = []
        for number in (0, 1):
            vertical = abs(found[number]) < 1e-8 and (self.through_bottom, self.through_top)[number]
            at = number + 2 if vertical else number
            phase = wanted[at] / found[at] if found[at] else 1.0 + 0j
            phases.append(phase / abs(phase) if phase else 1.0 + 0j)
        return tuple(phases)


def _roots(beta, a, b, alpha, u, u_rate):
    """The three roots of beta u^3 - (alpha + a^2) u^2 + (2 a b - beta) u + alpha - b^2, ascending."""
    if a == 0 and b == 0:
        roots = [mp.mpf(-1), mp.mpf(1), alpha / beta]
    elif b in (a, -a):
        # A vertical axis is a root, which is divided out so that it is met exactly.
        side = mp.mpf(1) if b == a else mp.mpf(-1)
        roots = [side, *_quadratic(beta, side * beta - alpha - a * a, side * (a * a - alpha))]
    elif u_rate == 0:
        linear = beta * u - alpha - a * a
        roots = [u, *_quadratic(beta, linear, linear * u + 2 * a * b - beta)]
    else:
        roots = mp.polyroots([beta, -alpha - a * a, 2 * a * b - beta, alpha - b * b], maxsteps=500, extraprec=300)
        roots = [mp.re(root) for root in roots]
    snapped = [next((value for value in (mp.mpf(1), mp.mpf(-1)) if abs(root - value) < SAME), root) for root in roots]
    return sorted(snapped)


def _quadratic(p, q, r):
    """The roots of p x^2 + q x + r, which are real but for rounding."""
    root = mp.sqrt(max(q * q - 4 * p * r, mp.mpf(0)))
    return [(-q - root) / (2 * p), (-q + root) / (2 * p)]


class LagrangeTop(AxisMotion):
    """Motion of Lagrange's top about its fixed point.

    Parameters
    ----------
    transverse, axial
        Moments of inertia across and along the axis, about the fixed point.
    weight_moment
        m g l, positive.
    angles, rates
        (phi, theta, psi) and their rates at t = 0; theta may be 0 or pi (then the rate of theta moves the axis towards
        azimuth phi).

    Attributes
    ----------
    period
        Nutation period, the elliptic integral 2 K / r.
    energy, p_phi, p_psi
        The constants of the motion; energy with V = m g l cos theta.
    precession, spin_advance
        What phi and psi grow by in a nutation period; nan where the axis passes the vertical.
    lower, upper
        The turning values of cos theta.
    """

    def __init__(self, transverse, axial, weight_moment, angles, rates):
        with mp.workdps(DIGITS):
            moment_a, moment_c, weight = mp.mpf(transverse), mp.mpf(axial), mp.mpf(weight_moment)
            phi_rate, theta_rate, psi_rate = (mp.mpf(rate) for rate in rates)
            theta = mp.mpf(angles[1])
            u, sine = mp.cos(theta), mp.sin(theta)
            if theta == math.pi:  # the double is meant for the number
                u, sine = mp.mpf(-1), mp.mpf(0)
            spin = psi_rate + phi_rate * u
            a = moment_c * spin / moment_a
            b = phi_rate * sine**2 + a * u
            beta = 2 * weight / moment_a
            alpha = theta_rate**2 + phi_rate**2 * sine**2 + beta * u
            constants = beta, a, b, alpha, u, -theta_rate * sine, spin
        psi = float(angles[2])
        omega = [
            -float(phi_rate * sine) * math.cos(psi) + float(theta_rate) * math.sin(psi),
            float(phi_rate * sine) * math.sin(psi) + float(theta_rate) * math.cos(psi),
            float(spin),
        ]
        self.transverse, self.axial, self.weight_moment = float(transverse), float(axial), float(weight_moment)
        self.energy = float((moment_a * alpha + moment_c * spin**2) / 2)
        self.p_phi, self.p_psi = float(moment_a * b), float(moment_c * spin)
        super().__init__(*constants, euler_zyz(*(float(angle) for angle in angles)), omega)
        self.precession, self.spin_advance = (math.nan,) * 2 if self.steady else self.advance(self.period)


def steady_precession_rates(transverse, axial, weight_moment, theta, spin):
    """The slow and the fast rate phi' at which the top precesses at constant theta with w_3 = spin.

    Roots of A cos(theta) phi'^2 - C w_3 phi' + m g l = 0 (Goldstein, sec. 5.7); an empty tuple where the spin is too
    small, one rate where the axis is horizontal. The smaller root is computed without cancellation.
    """
    quadratic, linear = transverse * math.cos(theta), axial * spin
    if abs(quadratic) < 1e-15 * transverse:
        return (weight_moment / linear,)
    inside = linear**2 - 4 * quadratic * weight_moment
    if inside < 0:
        return ()
    large = (linear + math.copysign(math.sqrt(inside), linear)) / 2
    return tuple(sorted((weight_moment / large, large / quadratic), key=abs))


def sleeping_spin(transverse, axial, weight_moment):
    """The w_3 above which the upright top is stable: C^2 w_3^2 = 4 A m g l."""
    return 2 * math.sqrt(transverse * weight_moment) / axial
