"""Constraints as sums of waves in one or two unknowns, and the root of one of them on the branch of a position.

To derive the coefficients of a form and to compare it costs many times what the values at some places do, and most
pairs of unknowns of a mechanism in space have none.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.rounding import WAYS, RoughProgram
from atwood.expr import Expression, atan2, cos, jvp, minimum, sin, sqrt, substitute
from atwood.forms.loops.closed_form import Group, Place
from atwood.numerics.matrices import least_squares

if TYPE_CHECKING:
    from atwood.forms.loops.assur_groups import Loops


Vector = Sequence[Expression]

_FAR = 100.0
"""Where the arm that an angle is found from is a tenth of the longest that it can be, it counts as no dead centre."""


def dot(a: Vector, b: Vector) -> Expression:
    """Return the product of two vectors."""
    found: Expression = a[0] * b[0]
    for one, other in zip(a[1:], b[1:], strict=True):
        found = found + one * other
    return found


def total(start: Vector, *terms: tuple[Vector, Expression]) -> list[Expression]:
    """Return a vector and multiples of others."""
    found = list(start)
    for factors, by in terms:
        found = [one + factor * by for one, factor in zip(found, factors, strict=True)]
    return found


def arm_margin(square: Expression, most: Expression) -> Expression:
    """Return how far it is from where an arm vanishes that an angle is found from, given its square and its most."""
    found: Expression = minimum(1.0, _FAR * square / (most * most))
    return found


class Root:
    """The solution of ``p cos x + q sin x = w`` on one of its two branches.

    Parameters
    ----------
    loops
        Whose unknown it is.
    number
        Which coordinate.
    p, q, w
        The coefficients, in terms of what is known.
    x
        The angle, perhaps a sum of coordinates.
    """

    def __init__(self, loops: Loops, number: int, p: Expression, q: Expression, w: Expression, x: Expression) -> None:
        self.w, self.square = w, p * p + q * q
        self.rest = self.square - w * w
        sign = loops.graph.parameter(f"branch:{loops.equations.names[number].name}")
        self.root = sign * sqrt(self.rest)
        self.sign = {sign: p * sin(x) - q * cos(x)}
        self.c = (p * w - q * self.root) / self.square
        self.s = (q * w + p * self.root) / self.square

    def angle(self, direction: Expression) -> Expression:
        """Return the angle, from the direction of (p, q)."""
        beside: Expression = atan2(self.root, self.w)
        return direction + beside


def one_unknown(loops: Loops, ks: tuple[int, ...], unknowns: tuple[int, ...]) -> tuple[Group, ...]:
    """Return the group of one constraint with one unknown; nothing where it is of no known form."""
    (k,), (number,) = ks, unknowns
    if not loops.shapes.may_be(ks, {number: loops.is_angle[number]}):
        return ()
    found = solved_for(loops, loops.values[k], number, ks, (loops.graph.one,))
    return () if found is None else (found,)


def solved_for(
    loops: Loops,
    g: Expression,
    number: int,
    ks: tuple[int, ...],
    along: tuple[Expression, ...],
    size: Expression | None = None,
) -> Group | None:
    """Return the solution of ``g = 0``; None where g is neither a wave in an angle nor of second degree in a length."""
    if loops.is_angle[number]:
        return _angle(loops, g, number, ks, along)
    x = loops.q[number]
    first = jvp([g], {x: 1.0})
    (constant,), (rate,), (bend,) = (at(one, {x: 0.0}) for one in ([g], first, jvp(first, {x: 1.0})))
    if not rate.is_zero and loops.agree([g], [constant + rate * x]):
        return Group((number,), ks, (along,), {x: -(constant / rate)})
    curve, half = 0.5 * bend, 0.5 * rate
    if loops.is_free_place[number]:  # a place on a sphere has no coordinate that does anywhere
        return None
    if curve.is_zero or not loops.agree([g], [constant + (rate + curve * x) * x]):
        return None
    sign = loops.graph.parameter(f"branch:{loops.equations.names[number].name}")
    rest = half * half - curve * constant
    place = (sign * sqrt(rest) - half) / curve
    longest = curve * curve * loops.place.length**2 if size is None else curve * size
    return Group((number,), ks, (along,), {x: place}, (rest / longest,), {sign: curve * x + half})


def _angle(
    loops: Loops, g: Expression, number: int, ks: tuple[int, ...], along: tuple[Expression, ...]
) -> Group | None:
    x = loops.q[number]
    (e,), (p,), (q,) = harmonics([g], x)
    if not loops.agree([g], [e + p * cos(x) + q * sin(x)]):
        return None
    root = Root(loops, number, p, q, -e, x)
    direction, heading = loops.heading(number, p, q)
    angle, turn = root.angle(direction), loops.turn(number)
    places = {cos(x): root.c, sin(x): root.s, x: angle + turn}
    margins = [root.rest / root.square]
    if heading.most is not None and not root.square.is_parametric:
        margins.append(arm_margin(root.square, heading.most))
    return Group((number,), ks, (along,), places, tuple(margins), root.sign, {turn: x - angle}, (heading,))


Wave = tuple[Expression, Expression]
"""Real and imaginary part of the coefficient of ``exp(i (n . angles))``."""


def at(values: Sequence[Expression], place: Mapping[Expression, float]) -> list[Expression]:
    """Return values at a place."""
    return substitute(list(values), place)


def harmonics(
    values: Sequence[Expression], x: Expression
) -> tuple[list[Expression], list[Expression], list[Expression]]:
    """Return e, p and q of values that are ``e + p cos x + q sin x``."""
    first = jvp(values, {x: 1.0})
    second = at(jvp(first, {x: 1.0}), {x: 0.0})
    start = at(values, {x: 0.0})
    return [a + b for a, b in zip(start, second, strict=True)], [-b for b in second], at(first, {x: 0.0})


def waves_of(p: Expression, q: Expression, angles: Sequence[Expression]) -> dict[tuple[int, ...], Wave]:
    """Return the terms ``z exp(i (n . angles))`` of ``p + i q`` with n of -1, 0 and 1, but for those that are zero.

    Whether these are all is for the caller to see (`sum_of_waves`).
    """
    found: dict[tuple[int, ...], Wave] = {(): (p, q)}
    for angle in angles:
        e, c, s = harmonics(list(itertools.chain.from_iterable(found.values())), angle)
        more: dict[tuple[int, ...], Wave] = {}
        for k, orders in enumerate(found):
            re, im = 2 * k, 2 * k + 1
            more[*orders, 0] = e[re], e[im]
            more[*orders, 1] = 0.5 * (c[re] + s[im]), 0.5 * (c[im] - s[re])
            more[*orders, -1] = 0.5 * (c[re] - s[im]), 0.5 * (c[im] + s[re])
        found = {orders: z for orders, z in more.items() if not (z[0].is_zero and z[1].is_zero)}
    return found


def sum_of_waves(
    waves: Mapping[tuple[int, ...], Wave], angles: Sequence[Expression], zero: Expression
) -> tuple[Expression, Expression]:
    """Return p and q from their terms."""
    p = q = zero
    for orders, (re, im) in waves.items():
        turned = zero
        for angle, order in zip(angles, orders, strict=True):
            turned = turned + float(order) * angle
        c, s = cos(turned), sin(turned)
        p, q = p + re * c - im * s, q + re * s + im * c
    return p, q


_LEFT = 1e-6
"""What a form may leave of the largest value: far more than rounding, which is looked at when formulas are compared."""


class ConstraintShapes:
    """The values of constraints where two unknowns vary.

    Parameters
    ----------
    values
        The constraints.
    coordinates
        Their unknowns.
    place
        Values of the parameters, and the length of the scene.
    elsewhere
        Values of time and of all coordinates, at which those that do not vary stay.
    """

    def __init__(
        self,
        values: Sequence[Expression],
        coordinates: Sequence[Expression],
        place: Place,
        elsewhere: Mapping[Expression, float],
    ) -> None:
        self._values, self._place = values, place
        self._rows = {one: k for k, one in enumerate(elsewhere)}
        self._at = np.repeat(np.array(list(elsewhere.values()))[:, None], WAYS, axis=1)
        self._coordinates = coordinates
        self._places = {one: k for k, one in enumerate(place.parameters)}
        self._parameters = np.array(list(place.parameters.values()))
        self._programs: dict[tuple[int, ...], RoughProgram] = {}
        random = np.random.default_rng(1)
        self._shares = random.uniform(-1.0, 1.0, (2, WAYS))

    def may_be(self, ks: tuple[int, ...], unknowns: Mapping[int, bool], nested: float = 0.0) -> bool:
        """Return whether constraints may be sums of a constant and of first harmonics, or powers, of each unknown.

        One length may stand in second degree; beside one angle, also in products with its harmonics.
        """
        at, basis, moved = self._at.copy(), [np.ones(WAYS)], []
        for share, is_angle in zip(self._shares, unknowns.values(), strict=False):
            moved.append(np.pi * share if is_angle else self._place.length * share)
            basis += [np.cos(moved[-1]), np.sin(moved[-1])] if is_angle else [moved[-1] / self._place.length]
        if len(basis) == 2:
            basis.append(basis[1] ** 2)
        elif len(basis) == 4:  # an angle and a length, in whichever order
            waves, length = (basis[1:3], basis[3]) if next(iter(unknowns.values())) else (basis[2:], basis[1])
            basis += [length * wave for wave in waves]
        if nested:
            moved[0] = moved[0] - nested * moved[1]
        for number, values in zip(unknowns, moved, strict=True):
            at[self._rows[self._coordinates[number]]] = values
        found = self._program(ks)(self._parameters, at)
        return _is_combination(found, np.array(basis))

    def turns_about(self, ks: tuple[int, ...], number: int, others: Sequence[int]) -> bool:
        """Return whether an angle may turn three constraints about an axis that does not depend on other unknowns."""
        axes = []
        for share in (0.3, -0.4):
            at = self._at.copy()
            for other in others:
                at[self._rows[self._coordinates[other]]] = share * self._place.length
            angle = np.pi * self._shares[0]
            at[self._rows[self._coordinates[number]]] = angle
            found = self._program(ks)(self._parameters, at)
            basis = np.array([np.ones(WAYS), np.cos(angle), np.sin(angle)])
            if not np.all(np.isfinite(found)):
                return True
            if not _is_combination(found, basis):
                return False
            _, p, q = least_squares(basis.T, found.T)
            axes.append(np.cross(p, q) / max(float(p @ p), np.finfo(float).tiny))
        return bool(np.max(np.abs(axes[0] - axes[1])) <= _LEFT)

    def _program(self, ks: tuple[int, ...]) -> RoughProgram:
        if ks not in self._programs:
            self._programs[ks] = RoughProgram((self._places, self._rows), [self._values[k] for k in ks])
        return self._programs[ks]


def _is_combination(values: FloatArray, basis: FloatArray) -> bool:
    """Return whether rows are combinations of others; True where they have no value, which formulas may have."""
    if not np.all(np.isfinite(values)):
        return True
    weights = least_squares(basis.T, values.T)
    left = values - (basis.T @ weights).T
    return bool(np.max(np.abs(left)) <= _LEFT * np.max(np.abs(values)))
