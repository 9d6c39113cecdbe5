"""The free asymmetric body by elliptic functions and the integral of the third kind.

Euler's equations I_1 w_1' = (I_2 - I_3) w_2 w_3 (and cyclic), angular velocity in body axes, principal moments in any
order. Landau and Lifshitz, *Mechanics*, par. 37; Whittaker, *Analytical Dynamics*, par. 69 to 71.

Let b be the middle axis and a the extreme one about which the angular momentum goes round in the body, c the other:
w_a = A dn, w_b = B sn, w_c = C cn of p (t - t_0), and the plane through axis a and the angular momentum L turns about L
at the rate (2 T - I_a w_a^2) L / (L^2 - I_a^2 w_a^2) = L / I_a + L (I_a - I_c) / (I_a I_c) / (1 - n sn^2).
"""

import math
from fractions import Fraction

import numpy as np

from .jacobi import first_kind, jacobi, quarter_period, third_kind
from .rotations import about


class FreeBody:
    """Motion of a free body about its centre of mass.

    Parameters
    ----------
    moments
        Principal moments of inertia, all different unless the motion is of a symmetric body (two may be equal).
    omega
        Angular velocity in body axes at t = 0. How far it is from the separatrix is computed exactly from the numbers
        that are given: doubles, fractions, or decimals as text ("1.73205" is not the double 1.73205, and next to the
        separatrix that shows).
    orientation
        R_WB at t = 0; the unit matrix unless given.

    Attributes
    ----------
    period
        Of the angular velocity in body axes; infinite on the separatrix, nan for a steady rotation.
    flip_time
        Half of it: from one reversal of the angular velocity about the middle axis to the next.
    energy, momentum
        Kinetic energy and size of the angular momentum.
    mc
        Complementary parameter 1 - k^2 of the elliptic functions; 0 on the separatrix.
    """

    def __init__(self, moments, omega, orientation=None):
        self.given = tuple(moments), tuple(omega)
        self.moments = np.array([float(value) for value in moments])
        self.omega_0 = np.array([float(value) for value in omega])
        self.start = np.eye(3) if orientation is None else np.array(orientation, dtype=float)
        self.energy = 0.5 * float(np.sum(self.moments * self.omega_0**2))
        self.momentum = float(np.linalg.norm(self.moments * self.omega_0))
        self.momentum_world = self.start @ (self.moments * self.omega_0)
        self.steady = self._is_steady()
        self.period = self.flip_time = math.nan
        if not self.steady:
            self._set_up()

    def _is_steady(self):
        i, w = self.moments, self.omega_0
        return not np.any(
            np.array([(i[1] - i[2]) * w[1] * w[2], (i[2] - i[0]) * w[2] * w[0], (i[0] - i[1]) * w[0] * w[1]])
        )

    def _set_up(self):
        low, b, high = np.argsort(self.moments, kind="stable")
        exact = [Fraction(moment) for moment in self.given[0]]
        # The sign of L^2 - 2 T I_b, free of rounding, says which way L goes round.
        parts = {k: exact[k] * (exact[k] - exact[b]) * Fraction(self.given[1][k]) ** 2 for k in (low, high)}
        excess = parts[low] + parts[high]
        a, c = (high, low) if excess > 0 or (excess == 0 and parts[high] != 0) else (low, high)
        ia, ib, ic = self.moments[[a, b, c]]
        wa, wb, wc = self.omega_0[[a, b, c]]
        if a == low:
            excess = -excess
        self.axes = a, b, c
        amplitude_a = math.copysign(math.sqrt(wa**2 + ib * (ib - ic) / (ia * (ia - ic)) * wb**2), wa)
        amplitude_c = math.sqrt(wc**2 + ib * (ib - ia) / (ic * (ic - ia)) * wb**2)
        self.rate = abs(amplitude_a) * math.sqrt((ia - ic) * (ia - ib) / (ib * ic))
        even = 1 if (b - a) % 3 == 1 else -1
        amplitude_b = even * (ic - ia) * amplitude_a * amplitude_c / (ib * self.rate)
        self.amplitudes = amplitude_a, amplitude_b, amplitude_c
        whole = abs(exact[a] * (exact[a] - exact[b])) * Fraction(amplitude_a) ** 2
        self.mc = float(abs(excess) / whole)
        # On the separatrix w_c may be of either sign, and sech is positive.
        if self.mc == 0 and wc < 0:
            self.amplitudes = amplitude_a, -amplitude_b, -amplitude_c
        sn, cn = wb / self.amplitudes[1], wc / self.amplitudes[2]
        size = math.hypot(sn, cn)
        u = first_kind(sn / size, abs(cn) / size, self.mc)
        if cn < 0:
            u = math.copysign(2 * quarter_period(self.mc), sn) - u
        self.phase = u
        self.characteristic = -ia * (ib - ic) / (ic * (ia - ib))
        self.turning = (self.momentum / ia, self.momentum * (ia - ic) / (ia * ic) / self.rate)
        self.period = 4 * quarter_period(self.mc) / self.rate
        self.flip_time = self.period / 2
        self.frame_0 = self.start @ self._frame(self.omega_0)

    def omega(self, t):
        """Angular velocity in body axes: shape of t, then 3."""
        t = np.asarray(t, dtype=float)
        if self.steady:
            return np.broadcast_to(self.omega_0, (*t.shape, 3)).copy()
        sn, cn, dn = jacobi(self.rate * t + self.phase, self.mc)
        out = np.empty((*t.shape, 3))
        for axis, amplitude, shape in zip(self.axes, self.amplitudes, (dn, sn, cn), strict=True):
            out[..., axis] = amplitude * shape
        return out

    def orientation(self, t):
        """R_WB: shape of t, then (3, 3)."""
        t = np.asarray(t, dtype=float)
        if self.steady:
            speed = float(np.linalg.norm(self.omega_0))
            return self.start @ about(self.omega_0 / speed if speed else [0, 0, 1], speed * t)
        steady, swing = self.turning
        u = self.rate * t + self.phase
        angle = steady * t + swing * (
            third_kind(self.characteristic, u, self.mc) - third_kind(self.characteristic, self.phase, self.mc)
        )
        return self.frame_0 @ about([0, 0, 1], angle) @ np.swapaxes(self._frame(self.omega(t)), -1, -2)

    def _frame(self, omega):
        """Columns in body axes: axis a without its part along L, what completes a right-handed frame, and L."""
        a, b, c = self.axes
        momentum = self.moments * omega
        along = momentum / np.linalg.norm(momentum, axis=-1, keepdims=True)
        first = -along[..., a, None] * along
        first[..., a] = along[..., b] ** 2 + along[..., c] ** 2  # 1 - along_a^2 without cancellation
        first /= np.linalg.norm(first, axis=-1, keepdims=True)
        return np.stack([first, np.cross(along, first), along], axis=-1)


class PlateSeparatrix:
    """The separatrix of a plane plate, I_3 = I_1 + I_2 with I_1 < I_2, in elementary functions.

    With O the speed about the middle axis that is approached for t -> +-infinity, p = O sqrt((I_2 - I_1)/(I_2 + I_1)):

        w_1 = O sech(p t),   w_2 = O tanh(p t),   w_3 = p sech(p t),

    since then w_1' = -w_2 w_3, w_2' = w_3 w_1 and (I_1 + I_2) w_3' = (I_1 - I_2) w_1 w_2 hold. The angular momentum is
    L = I_2 O, and the plane through axis 1 and L has turned about L by O t - arctan(sqrt(I_1^2/(I_2^2 - I_1^2)) tanh(p
    t)). At t = 0 the body's axes are those of `orientation`, and L lies in its 1-3 plane.

    With (I_1, I_2) = (3, 5) and O = 2, p = 1: doubles that lie exactly on the separatrix, omega = (2, 0, 1) at t = 0.
    An error e grows like e exp(p t).
    """

    def __init__(self, moment_1, moment_2, speed, orientation=None):
        self.moments = np.array([moment_1, moment_2, moment_1 + moment_2], dtype=float)
        self.speed = float(speed)
        self.rate = self.speed * math.sqrt((moment_2 - moment_1) / (moment_2 + moment_1))
        self.start = np.eye(3) if orientation is None else np.array(orientation, dtype=float)

    def omega(self, t):
        """Angular velocity in body axes: shape of t, then 3."""
        t = np.asarray(t, dtype=float)
        sech, tanh = 1 / np.cosh(self.rate * t), np.tanh(self.rate * t)
        return np.stack([self.speed * sech, self.speed * tanh, self.rate * sech], axis=-1)

    def orientation(self, t):
        """R_WB: shape of t, then (3, 3)."""
        t = np.asarray(t, dtype=float)
        i1, i2 = self.moments[:2]
        slope = i1 / math.sqrt((i2 - i1) * (i2 + i1))
        angle = self.speed * t - np.arctan(slope * np.tanh(self.rate * t))
        turned = about([0, 0, 1], angle) @ np.swapaxes(self._frame(t), -1, -2)
        return self.start @ self._frame(np.array(0.0)) @ turned

    def _frame(self, t):
        along = self.moments * self.omega(t) / (self.moments[1] * self.speed)
        first = -along[..., 0, None] * along
        first[..., 0] = along[..., 1] ** 2 + along[..., 2] ** 2
        first /= np.linalg.norm(first, axis=-1, keepdims=True)
        return np.stack([first, np.cross(along, first), along], axis=-1)
