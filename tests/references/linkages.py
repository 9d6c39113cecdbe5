"""Positions and rates of spatial linkages in closed form: universal joint, slider-crank."""

import math

import numpy as np


def universal_joint(angle, bend):
    """Angle of the driven shaft of a universal (Cardan, Hooke) joint, its ratio of speeds, and that ratio's slope.

    tan(out) = cos(bend) tan(in), with out counted on through the turns, and

        d out / d in = cos(bend) / (1 - sin(bend)^2 sin(in)^2),

    for angles counted from the position in which the driving fork's arm of the cross is at right angles to the plane
    of the two shafts; counted from a quarter turn later, tan(out) = tan(in) / cos(bend). The driving torque is the
    driven one times the ratio. C. E. Wilson and J. P. Sadler, *Kinematics and Dynamics of Machinery*, sec. on
    universal joints.

    Parameters
    ----------
    angle
        Of the driving shaft in rad, any shape.
    bend
        Between the shafts in rad.

    Returns
    -------
    out, ratio, jacobian
        Angle of the driven shaft; d out / d in; d^2 out / d in^2.
    """
    angle = np.asarray(angle, dtype=float)
    turns = np.round(angle / math.pi)
    rest = angle - turns * math.pi
    out = turns * math.pi + np.arctan2(math.cos(bend) * np.sin(rest), np.cos(rest))
    below = np.cos(angle) ** 2 + (math.cos(bend) * np.sin(angle)) ** 2
    ratio = math.cos(bend) / below
    return out, ratio, ratio * math.sin(bend) ** 2 * np.sin(2 * angle) / below


class SpatialSliderCrank:
    """A crank about any axis, a rod with spherical ends (or one spherical, one universal), a slider on any line.

    With the crank pin P = C + r (cos(a) u + sin(a) v) and the slider S = O + s d, |S - P| = l has the two solutions
    s = k +- sqrt(k^2 - |P - O|^2 + l^2), k = d . (P - O): the modes of assembly.

    Parameters
    ----------
    crank_centre, crank_axis, crank_zero
        C; the axis of turning; the direction of the pin at angle zero, at right angles to the axis.
    crank_length, rod_length
        r and l in m.
    slider_origin, slider_direction
        O and d.
    branch
        +1 or -1, the sign of the root.
    """

    def __init__(
        self,
        crank_centre,
        crank_axis,
        crank_zero,
        crank_length,
        rod_length,
        slider_origin,
        slider_direction,
        branch=1,
    ):
        axis, zero = np.asarray(crank_axis, dtype=float), np.asarray(crank_zero, dtype=float)
        self.centre, self.origin = np.asarray(crank_centre, dtype=float), np.asarray(slider_origin, dtype=float)
        self.cos_direction = zero / np.linalg.norm(zero)
        self.sin_direction = np.cross(axis / np.linalg.norm(axis), self.cos_direction)
        direction = np.asarray(slider_direction, dtype=float)
        self.direction = direction / np.linalg.norm(direction)
        self.crank_length, self.rod_length, self.branch = float(crank_length), float(rod_length), branch

    def pin(self, angle):
        """Position of the crank pin and its first two derivatives by the angle: shape of the angle, then 3."""
        angle = np.asarray(angle, dtype=float)[..., None]
        across = self.crank_length * (np.cos(angle) * self.cos_direction + np.sin(angle) * self.sin_direction)
        along = self.crank_length * (np.cos(angle) * self.sin_direction - np.sin(angle) * self.cos_direction)
        return self.centre + across, along, -across

    def slider(self, angle):
        """Position s of the slider along its line and its first two derivatives by the angle; nan out of reach."""
        pin, pin_1, pin_2 = self.pin(angle)
        offset = pin - self.origin
        k, k_1, k_2 = offset @ self.direction, pin_1 @ self.direction, pin_2 @ self.direction
        square = k**2 - np.sum(offset**2, axis=-1) + self.rod_length**2
        half_1 = k * k_1 - np.sum(offset * pin_1, axis=-1)
        half_2 = k_1**2 + k * k_2 - np.sum(pin_1**2, axis=-1) - np.sum(offset * pin_2, axis=-1)
        root = np.sqrt(np.where(square >= 0, square, np.nan))
        s = k + self.branch * root
        s_1 = k_1 + self.branch * half_1 / root
        s_2 = k_2 + self.branch * (half_2 - half_1**2 / root**2) / root
        return s, s_1, s_2

    def slider_point(self, angle):
        """Position of the slider: shape of the angle, then 3."""
        return self.origin + np.asarray(self.slider(angle)[0])[..., None] * self.direction
