"""The plane pendulum, swinging or going round, and the row of four-bars that moves like one."""

import math

import numpy as np

from .jacobi import amplitude, first_kind, jacobi, quarter_period


class PlanePendulum:
    """b'' = -kappa sin b, with b from hanging: Whittaker, *Analytical Dynamics*, par. 44.

    With k^2 = b'^2 / (4 kappa) + sin^2(b/2): sin(b/2) = k sn(sqrt(kappa) (t - t0) | k^2) for k < 1, and
    b/2 = am(k sqrt(kappa) (t - t0) | 1/k^2) for k > 1.

    Attributes
    ----------
    goes_round
        Whether it turns over.
    period
        Of a swing, or the time of one turn.
    """

    def __init__(self, kappa, angle, rate):
        self.root = math.sqrt(kappa)
        half_sine, half_cosine, half_rate = math.sin(angle / 2), math.cos(angle / 2), rate / 2
        # k'^2 and k^2 without cancellation next to the upright position.
        excess = (half_rate / self.root - half_cosine) * (half_rate / self.root + half_cosine)  # k^2 - 1
        square = (half_rate / self.root) ** 2 + half_sine**2
        self.goes_round = excess > 0
        self.size = math.sqrt(square)
        self.turns = round(angle / (2 * math.pi))
        if self.goes_round:
            self.mc = excess / square
            self.speed = math.copysign(self.size * self.root, rate)
            rest = angle / 2 - math.pi * self.turns
            self.phase = math.copysign(1, rate) * first_kind(math.sin(rest), math.cos(rest), self.mc)
            self.period = 2 * quarter_period(self.mc) / abs(self.speed)
        else:
            self.mc = -excess
            self.speed = self.root
            rest = angle - 2 * math.pi * self.turns
            sn, cn = math.sin(rest / 2) / self.size if self.size else 0.0, half_rate / (self.size * self.root or 1.0)
            u = first_kind(sn / math.hypot(sn, cn), abs(cn) / math.hypot(sn, cn), self.mc) if self.size else 0.0
            self.phase = u if cn >= 0 else math.copysign(2 * quarter_period(self.mc), sn) - u
            self.period = 4 * quarter_period(self.mc) / self.speed

    def angle(self, t):
        """b, counted on through the turns: the shape of t."""
        if self.goes_round:
            u = abs(self.speed) * np.asarray(t, dtype=float) + self.phase
            return 2 * math.pi * self.turns + math.copysign(2, self.speed) * amplitude(u, self.mc)
        sn, _, _ = jacobi(self.speed * np.asarray(t, dtype=float) + self.phase, self.mc)
        return 2 * math.pi * self.turns + 2 * np.arcsin(self.size * sn)

    def rate(self, t):
        """b': the shape of t."""
        if self.goes_round:
            _, _, dn = jacobi(abs(self.speed) * np.asarray(t, dtype=float) + self.phase, self.mc)
            return 2 * self.speed * dn
        _, cn, _ = jacobi(self.speed * np.asarray(t, dtype=float) + self.phase, self.mc)
        return 2 * self.size * self.root * cn


class FourBarRow(PlanePendulum):
    """N parallelograms in a row (IFToMM A02): N + 1 cranks and N couplers, all uniform rods of one length and mass.

    While the couplers stay level every crank has the same angle a from upright, clockwise as seen on the page, and
    a'' = kappa sin a with kappa = (g / l) (N + (N + 1)/2) / (N + (N + 1)/3). All bars are in line at a = pi/2 and
    3 pi/2: singular, and passed through.
    """

    def __init__(self, windows, angle=0.0, rate=1.0, length=1.0, gravity=9.81):
        cranks = windows + 1
        self.kappa = gravity / length * (windows + cranks / 2) / (windows + cranks / 3)
        super().__init__(self.kappa, angle - math.pi, rate)

    def crank_angle(self, t):
        """a, counted on through the turns."""
        return self.angle(t) + math.pi
