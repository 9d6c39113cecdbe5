"""One equation for one unknown coordinate, an angle or a length, on the branch of a position."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from atwood.expr import Expression, atan2, cos, jvp, minimum, sin, sqrt
from atwood.forms.loops.branches import Group
from atwood.forms.loops.harmonics import at, harmonics

if TYPE_CHECKING:
    from atwood.forms.loops.assur_groups import Loops

__all__ = ["Root", "Vector", "arm_margin", "dot", "one_unknown", "solved_for", "total"]

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
    """Return the group of one constraint with one unknown; nothing where it is of no known form.

    Parameters
    ----------
    loops
        The loops.
    ks, unknowns
        Numbers of the constraint and of the coordinate.
    """
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
    """Return the solution of ``g = 0``; None where g is neither a wave in an angle nor of second degree in a length.

    Parameters
    ----------
    loops
        The loops.
    g
        What is zero.
    number
        The unknown coordinate.
    ks, along
        Constraints, and by what to multiply them for the speed of the unknown.
    size
        For an equation of second degree, what the square of its root is compared with; the scene's extent if not given.
    """
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
