"""Bricard's mechanism as in problem A04 of the IFToMM library: six revolute joints in a loop, redundant everywhere.

World axes of the benchmark: gravity along -y. The ground carries J1 at (0, 0, 0), axis y, and J6 at (0, 0, 1), axis x;
five rods of length 1 join J1 to J6 by J2 (axis z), J3 (x), J4 (y), J5 (z). The joints turn by (a, b, a, b, a, b) with
(1 + sin a) (1 + sin b) = 1, each rod against the one before it, and a runs over [0, pi] and back when the mechanism is
let go from rest at a = 0. With everything a function of a, d'Alembert's principle is one equation,

    M a'' + N a'^2 = -dV/da,   M = sum of m v.v + w.I w,   N = sum of m v.c + w.I e  (= M_a / 2),

where v, w are velocities and c, e accelerations at a' = 1, a'' = 0.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad, solve_ivp

from .rotations import about

AXES = ([0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1])
"""Axes of J1 to J5 at a = 0."""

RODS = ([1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0], [-1.0, 0, 0], [0, 1.0, 0])
"""Rods from joint to joint at a = 0."""


def partner(a):
    """The other angle b, in [-pi/2, pi/2], and its first two derivatives by a; a in [-pi/6, 7 pi/6]."""
    lift = 1 + math.sin(a)
    sine = 1 / lift - 1
    b = math.asin(sine)
    slope = -math.cos(a) / lift**2 / math.cos(b)
    curve = math.sin(a) / lift**2 + 2 * math.cos(a) ** 2 / lift**3
    return b, slope, (curve + sine * slope**2) / math.cos(b)


def chain(a):
    """The rods at angle a, from J1 on.

    Returns
    -------
    joints : (6, 3)
        Positions of J1 to J6.
    centres, velocities, accelerations : (5, 3)
        Of the rods' centres, at a' = 1, a'' = 0.
    omegas, spins_up : (5, 3)
        Angular velocities and accelerations of the rods.
    turns : (5, 3, 3)
        Their orientations R_WB against the position a = 0.
    """
    b, slope, curve = partner(a)
    turn, w, e = np.eye(3), np.zeros(3), np.zeros(3)
    p, v, c = np.zeros(3), np.zeros(3), np.zeros(3)
    rows = []
    joints = [p]
    for number in range(5):
        axis = turn @ np.array(AXES[number], dtype=float)
        angle, rate, rate_up = (a, 1.0, 0.0) if number % 2 == 0 else (b, slope, curve)
        e = e + axis * rate_up + np.cross(w, axis) * rate
        w = w + axis * rate
        turn = turn @ about(AXES[number], angle)
        rod = turn @ np.array(RODS[number])
        v_rod, c_rod = np.cross(w, rod), np.cross(e, rod) + np.cross(w, np.cross(w, rod))
        rows.append((p + rod / 2, v + v_rod / 2, c + c_rod / 2, w, e, turn))
        p, v, c = p + rod, v + v_rod, c + c_rod
        joints.append(p)
    return np.array(joints), *(np.array(column) for column in zip(*rows, strict=True))


@dataclass(frozen=True)
class Bricard:
    """The mechanism with rods of given mass and square section (length 1)."""

    mass: float = 1.0
    section: float = 0.1
    gravity: float = 9.81

    def coefficients(self, a):
        """M, N, V and dV/da."""
        _, centres, v, c, w, e, turns = chain(a)
        across, along = self.mass * (1 + self.section**2) / 12, self.mass * self.section**2 / 6
        m = n = 0.0
        for k, rod in enumerate(RODS):
            d = turns[k] @ np.array(rod)
            m += self.mass * v[k] @ v[k] + across * w[k] @ w[k] + (along - across) * (w[k] @ d) ** 2
            n += self.mass * v[k] @ c[k] + across * w[k] @ e[k] + (along - across) * (w[k] @ d) * (e[k] @ d)
        weight = self.mass * self.gravity
        return m, n, weight * float(np.sum(centres[:, 1])), weight * float(np.sum(v[:, 1]))

    def rate(self, a):
        """Size of a' at the angle a after a start from rest at a = 0."""
        m, _, height, _ = self.coefficients(a)
        return math.sqrt(max(2 * (self.coefficients(0.0)[2] - height) / m, 0.0))

    def period(self):
        """Time for a to run from 0 to pi and back."""

        def slowness(x):  # a = pi/2 (1 - cos x) takes the square roots out of the ends
            return math.pi / 2 * math.sin(x) / self.rate(math.pi / 2 * (1 - math.cos(x)))

        return 2 * quad(slowness, 0, math.pi, epsabs=0, epsrel=1e-10, limit=200)[0]

    def motion(self, t, a=0.0, a_rate=0.0):
        """(a, b, a', b') at the times t, shape (n, 4)."""
        t = np.asarray(t, dtype=float)

        def rates(_, y):
            m, n, _, slope = self.coefficients(y[0])
            return [y[1], -(slope + n * y[1] ** 2) / m]

        done = solve_ivp(rates, (0, t[-1]), [a, a_rate], method="DOP853", t_eval=t, rtol=1e-13, atol=1e-14)
        rows = []
        for angle, rate in done.y.T:
            b, slope, _ = partner(angle)
            rows.append([angle, b, rate, slope * rate])
        return np.array(rows)


def joint_3(a, a_rate):
    """Position ((1 + sin b) cos a, -cos b, -(1 + sin b) sin a) of J3, from the chain, and its velocity."""
    joints, _, v, _, w, _, turns = chain(a)
    half = turns[1] @ np.array(RODS[1]) / 2
    return joints[2], a_rate * (v[1] + np.cross(w[1], half))
