"""Flyball governors: Watt's, with its equilibrium and frequency, and the stiff one of the IFToMM benchmark library.

World: x right, y into the page, z up; the shaft turns about z.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


@dataclass(frozen=True)
class WattGovernor:
    """Two balls on massless arms that hinge on a turning shaft, with a sleeve hung on two links.

    Angle theta of the arms from the downward vertical. Balls of mass `ball` at `arm` from hinges that are `offset` off
    the shaft's axis; links of length `link` from points at the same distance `link` down the arms to a sleeve of mass
    `sleeve` at the offset, so that the sleeve is 2 link cos(theta) below the hinges; a shaft of moment `shaft` about
    its axis. Without a sleeve `link` is arbitrary.

    T = m l^2 theta'^2 + m (e + l sin)^2 O^2 + J O^2 / 2 + M (2 a sin theta')^2 / 2,   V = -2 (m l + M a) g cos.
    """

    ball: float
    arm: float
    offset: float = 0.0
    sleeve: float = 0.0
    link: float = 0.0
    shaft: float = 0.0
    gravity: float = 9.81

    def speed(self, theta):
        """Speed of the shaft at which theta is an equilibrium: O^2 = (m l + M a) g tan / (m l (e + l sin))."""
        weight = (self.ball * self.arm + self.sleeve * self.link) * self.gravity
        return math.sqrt(weight * math.tan(theta) / (self.ball * self.arm * (self.offset + self.arm * math.sin(theta))))

    def lift_off_speed(self):
        """Without an offset: the speed above which the arms leave the vertical."""
        weight = (self.ball * self.arm + self.sleeve * self.link) * self.gravity
        return math.sqrt(weight / self.ball) / self.arm

    def equilibrium(self, speed):
        """The stable angle at a given speed of the shaft."""
        if self.offset == 0 and speed <= self.lift_off_speed():
            return 0.0

        def torque(theta):  # that of the balls less that of the weight, over the cosine
            weight = (self.ball * self.arm + self.sleeve * self.link) * self.gravity
            return self.ball * self.arm * speed**2 * (self.offset + self.arm * math.sin(theta)) - weight * math.tan(
                theta
            )

        # Next to zero the torque is outward, next to a right angle inward.
        low = 1e-9 if self.offset == 0 else 0.0
        return brentq(torque, low, math.pi / 2 - 1e-12, xtol=1e-16, rtol=1e-15)

    def frequency(self, theta, free_shaft=False, speed=None):
        """Angular frequency of small oscillations about the equilibrium theta.

        The shaft is driven at constant speed, or free to change it (its angular momentum is then constant). The speed
        has to be given for arms that hang straight down, where every one is an equilibrium's."""
        speed = self.speed(theta) if speed is None else speed
        s, c = math.sin(theta), math.cos(theta)
        inertia = 2 * self.ball * self.arm**2 + self.sleeve * (2 * self.link * s) ** 2
        reach = self.offset + self.arm * s
        weight = 2 * (self.ball * self.arm + self.sleeve * self.link) * self.gravity
        moment_slope = 4 * self.ball * reach * self.arm * c  # of the moment about the shaft, by theta
        moment_curve = 4 * self.ball * self.arm * (self.arm * c * c - reach * s)
        stiffness = weight * c - moment_curve * speed**2 / 2
        if free_shaft:
            stiffness += moment_slope**2 * speed**2 / (self.shaft + 2 * self.ball * reach**2)
        return math.sqrt(stiffness / inertia)

    def acceleration(self, theta, theta_rate, speed):
        """theta'' at a given speed of the shaft."""
        s, c = math.sin(theta), math.cos(theta)
        inertia = 2 * self.ball * self.arm**2 + self.sleeve * (2 * self.link * s) ** 2
        weight = 2 * (self.ball * self.arm + self.sleeve * self.link) * self.gravity
        push = 2 * self.ball * (self.offset + self.arm * s) * self.arm * c * speed**2 - weight * s
        return (push - self.sleeve * 4 * self.link**2 * s * c * theta_rate**2) / inertia


@dataclass(frozen=True)
class StiffGovernor:
    """The stiff flyball governor of the IFToMM library (problem A05), with its standard values.

    A shaft turns freely about z, its top at z = 1. A slider (height s of its centre) moves along it and turns with it.
    Two uniform square rods hinge at (+-offset, 0, 1) and carry point masses at their ends; beta is their angle below
    the horizontal. Stiff spring-dampers join the rods' middles with the slider's points (+-offset, 0, s)."""

    density: float = 3000.0
    rod_length: float = 1.0
    rod_width: float = 0.01
    slider_edge: float = 0.1
    ball: float = 5.0
    offset: float = 0.05
    stiffness: float = 8e5
    damping: float = 4e4
    free_length: float = 0.5
    gravity: float = 9.81

    def moment(self, beta):
        """Moment of inertia about the shaft, and its derivative by beta."""
        l, w, e = self.rod_length, self.rod_width, self.offset
        rod, slider = self.density * l * w * w, self.density * self.slider_edge**3
        across, along = rod * (l * l + w * w) / 12, rod * w * w / 6
        c, s = math.cos(beta), math.sin(beta)
        fixed = along + slider * self.slider_edge**2 / 6  # the shaft is a rod that stands upright
        arms = rod * (e + l / 2 * c) ** 2 + across * c * c + along * s * s + self.ball * (e + l * c) ** 2
        slope = -rod * (e + l / 2 * c) * l * s - 2 * (across - along) * c * s - 2 * self.ball * (e + l * c) * l * s
        return fixed + 2 * arms, 2 * slope

    def rates(self, state, momentum):
        """Rates of (s, beta, s', beta', phi) at a given angular momentum about the shaft."""
        height, beta, height_rate, beta_rate = state[:4]
        l = self.rod_length
        rod = self.density * l * self.rod_width**2
        slider = self.density * self.slider_edge**3
        moment, slope = self.moment(beta)
        c, s = math.cos(beta), math.sin(beta)
        rise = 1 - l / 2 * s - height
        length = math.hypot(l / 2 * c, rise)
        by_height, by_beta = -rise / length, -(l / 2) * c * (l / 2 * s + rise) / length
        stretch_rate = by_height * height_rate + by_beta * beta_rate
        force = 2 * (self.stiffness * (length - self.free_length) + self.damping * stretch_rate)
        inertia = 2 * (rod * (l * l / 4 + (l * l + self.rod_width**2) / 12) + self.ball * l * l)
        weight = 2 * (rod * l / 2 + self.ball * l) * self.gravity * c
        spin = momentum / moment
        return np.array(
            [
                height_rate,
                beta_rate,
                -force * by_height / slider - self.gravity,
                (weight - force * by_beta + spin**2 * slope / 2) / inertia,
                spin,
            ]
        )

    def motion(self, t, height=0.5, beta=math.pi / 6, shaft_speed=2 * math.pi):
        """(s, beta, s', beta', shaft speed), shape (n, 5), at the times t, from rest but for the spinning."""
        momentum = self.moment(beta)[0] * shaft_speed
        t = np.asarray(t, dtype=float)
        start = [height, beta, 0.0, 0.0, 0.0]
        done = solve_ivp(
            lambda _, y: self.rates(y, momentum), (0, t[-1]), start, method="DOP853", t_eval=t, rtol=1e-13, atol=1e-15
        )
        speeds = [momentum / self.moment(value)[0] for value in done.y[1]]
        return np.column_stack([done.y[:4].T, speeds])
