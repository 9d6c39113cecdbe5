"""Euler angles of any sequence of axes, with what is left of them at their poles.

Where the first and the third axis of the turns are parallel, only the sum or the difference of the first and the third
angle has a value. By itself a state then gives it to the third angle, and the first is zero. Along a run both are
continued (see ``observable(pole=)`` of `atwood`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import permutations

from atwood import Scalar, Vector, atan2, cross, dot, select, sqrt

__all__ = ["CONVENTIONS", "EulerAngles", "restated_angles"]

CONVENTIONS = tuple(
    first + second + third for first, second in permutations("xyz", 2) for third in "xyz" if third != second
)
"""The twelve sequences of axes."""

NEARNESS = 1e-24
"""Square of the distance from a pole below which it is taken to be zero: 1e-12 rad, ten thousand roundings."""

Axes = tuple[Vector, Vector, Vector]


def _sequence(convention: str) -> tuple[str, str, str, bool, float]:
    """Return the first two axes and the one that is left, whether the first comes again, and the sense of the three."""
    i, j, last = tuple(convention)
    k = next(axis for axis in "xyz" if axis not in (i, j))
    return i, j, k, last == i, 1.0 if (i + j + k) in ("xyz", "yzx", "zxy") else -1.0


class EulerAngles:
    """How axes b are turned against axes a, by three turns of which each is about an axis that those before it made.

    The second axis after the first turn is the line of nodes. It is a unit vector that is perpendicular to the first
    and the third axis, whichever it is at a pole; so the first and the third angle, measured to it and from it, always
    make the same orientation together (Goldstein, section 4.4).

    Parameters
    ----------
    convention
        Names of the three axes, such as ``"zyz"``.
    a, b
        The axes, in world axes.
    spin
        Angular velocity of b against a, in world axes, rad/s.
    """

    def __init__(self, convention: str, a: Axes, b: Axes, spin: Vector) -> None:
        i, j, k, self.again, self.sense = _sequence(convention)
        self.a = {name: a["xyz".index(name)] for name in (i, j, k)}
        self.b = {name: b["xyz".index(name)] for name in (i, j, k)}
        self.i, self.j, self.k, self.spin = i, j, k, spin
        self.third = self.b[convention[2]]
        across, along = dot(self.a[j], self.third), dot(self.a[k], self.third)
        self.square = across * across + along * along
        self.cosine = dot(self.a[i], self.third)
        sine, cosine = (across, -self.sense * along) if self.again else (-self.sense * across, along)
        self.first_turn = sine, select(self.square > NEARNESS, cosine, 1.0)

    def first(self) -> Scalar:
        """Return the first angle, within half a turn; it has a derivative at the pole, too."""
        return atan2(*self.first_turn)

    def second(self) -> Scalar:
        """Return the second angle: 0 to half a turn where the first axis comes again, else a quarter either way."""
        across = sqrt(self.square)
        return atan2(across, self.cosine) if self.again else atan2(self.sense * self.cosine, across)

    def last(self) -> Scalar:
        """Return the third angle, within half a turn, from the line of nodes on."""
        sine, cosine = self.first_turn
        nodes = self.a[self.j] * cosine + self.a[self.k] * (self.sense * sine)
        off = -dot(nodes, self.b[self.k]) if self.again else dot(nodes, self.b[self.i])
        return atan2(self.sense * off, dot(nodes, self.b[self.j]))

    def pole(self) -> Scalar:
        """Return 1 where only the sum of the first and third angle has a value, -1 only the difference, 0 elsewhere."""
        return select(self.square > NEARNESS, 0.0, self.cosine)

    def rates(self) -> tuple[Scalar, Scalar, Scalar]:
        """Return the rates of the three angles, rad/s (Goldstein, section 4.9).

        At a pole the first and the third rate share the turn about their common axis evenly, so that the other
        combination of the angles stays as it is, and the second angle, which is smallest or largest there, rests.
        """
        first, third, spin = self.a[self.i], self.third, self.spin
        normal = cross(first, third)
        off = select(self.square > NEARNESS, 1.0, 0.0)

        def quotient(numerator: Scalar, denominator: Scalar, at_pole: Scalar) -> Scalar:
            return (numerator * off + at_pole * (1.0 - off)) / (denominator * off + (1.0 - off))

        sign = 1.0 if self.again else -self.sense
        return (
            quotient(dot(spin, cross(third, normal)), self.square, 0.5 * dot(spin, first)),
            quotient(sign * dot(spin, normal), sqrt(self.square), 0.0),
            quotient(dot(spin, cross(normal, first)), self.square, 0.5 * dot(spin, third)),
        )


def restated_angles(
    given: Mapping[str, float], convention: str, names: tuple[str, str, str], axes: tuple[str, str]
) -> dict[str, float]:
    """Return start values with Euler angles said as two axes that they stand for; those not given are zero.

    The axes have a derivative everywhere, the angles have none at their poles.

    Parameters
    ----------
    given
        Start values by name.
    convention
        The axes of the turns, in order.
    names
        What the three angles are called.
    axes
        What the x and the z axis of b, in axes a, are called.
    """
    said = dict(given)
    if not set(names) & said.keys():
        return said
    turned = [Vector(1.0, 0.0, 0.0), Vector(0.0, 0.0, 1.0)]
    for axis, name in zip(reversed(convention), reversed(names), strict=True):
        angle, about = said.pop(name, 0.0), "xyz".index(axis)
        unit = Vector(*(float(n == about) for n in range(3)))
        turned = [
            one * math.cos(angle) + cross(unit, one) * math.sin(angle) + unit * (one[about] * (1.0 - math.cos(angle)))
            for one in turned
        ]
    for name, one in zip(axes, turned, strict=True):
        said.update({f"{name}.{axis}": float(one[n]) for n, axis in enumerate("xyz")})
    return said
