"""The constraints of a ball with three unknown coordinates, of which two are the angles of a cross.

These are the assemblies of a universal joint, a ball and one joint more (USR, USP and UPS in Modelica's names). From
the cross, with its axis a, to the ball is ``w = a (z + t) + P cos x + Q sin x``, where x is the angle about a, and P, Q
and z depend on the other angle y and perhaps on the length s of the leg; t is constant. The ball is to be at V, seen
from the cross. All of it may turn with what the cross is on. What does not depend on the angles leaves three equations,
each with one unknown more:

- ``w^2 = V^2``, for the length of the leg, or for the coordinate on which V depends,
- ``z + t = a . V``, for the angle y,
- ``P cos x + Q sin x = V - a (a . V)``, for the angle x.

Their rates, along V, along a and along the circle about a, have the speeds in the same order.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from atwood.expr import Expression, cos, evaluate, jvp, sin, substitute
from atwood.forms.loops.branches import Group
from atwood.forms.loops.roots import Vector, at, dot, harmonics, solved_for, total
from atwood.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from atwood.forms.loops.assur_groups import Loops


_QUARTERS = (0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi)

_LEAST = 1e-3
"""An arm of a cross is found where it is longer, relative to the scene's extent."""


@dataclass(frozen=True, eq=False)
class _Cross:
    """A cross, seen from which the ball is at w.

    Attributes
    ----------
    axis
        The first axis, which does not depend on the unknowns.
    p, q
        w across the axis, by the cosine and the sine of the first angle.
    along
        w along the axis, z + t.
    place
        Where the ball is to be, V.
    """

    axis: Vector
    p: Vector
    q: Vector
    along: Expression
    place: Vector


def three_unknowns(loops: Loops, ks: tuple[int, ...], unknowns: tuple[int, ...]) -> tuple[Group, ...]:
    """Return the groups of a ball's constraints with three unknowns; nothing where they are of no known form."""
    if len(ks) != 3:
        return ()
    for i, j in itertools.permutations(unknowns, 2):
        if loops.is_angle[i] and loops.is_angle[j]:
            (k,) = set(unknowns) - {i, j}
            if not loops.shapes.turns_about(ks, i, (j,) if loops.is_angle[k] else (j, k)):
                continue
            cross = _cross(loops, ks, i, j, k)
            found = () if cross is None else _groups(loops, ks, cross, i, j, k)
            if found:
                return found
    return ()


def _cross(loops: Loops, ks: tuple[int, ...], i: int, j: int, k: int) -> _Cross | None:
    """Return the cross with the first angle i and the second j; None if they are not those of one."""
    x, y, z = (loops.q[one] for one in (i, j, k))
    g = [loops.values[one] for one in ks]
    e, p, q = harmonics(g, x)
    if not loops.agree(g, total(e, (p, cos(x)), (q, sin(x)))):
        return None
    if not loops.vanish([dot(p, q), dot(p, p) - dot(q, q)]):
        return None
    here = _somewhere(loops, p, y, None if loops.is_angle[k] else z)
    if here is None:
        return None
    # A length of the leg is put aside too; what turns the cross, or moves the ball, is not.
    is_leg = z in here and not loops.vanish([*jvp(p, {z: 1.0}), *jvp(q, {z: 1.0})])
    aside = here if is_leg else {y: here[y]}
    first, second, base = at(p, aside), at(q, aside), at(e, aside)
    square = dot(first, first)
    axis = [one / square for one in _cross_product(first, second)]
    rise = dot(axis, [one - other for one, other in zip(e, base, strict=True)])
    straight = [one - other - along * rise for one, other, along in zip(e, base, axis, strict=True)]
    flat = [*straight, dot(axis, p), dot(axis, q)]
    flat += [] if is_leg else jvp([rise, dot(p, p)], {z: 1.0})
    if not loops.vanish(flat):
        return None
    offset = _offset(loops, square, p, rise, aside, y)
    if offset is None:
        return None
    place = [offset * along - one for along, one in zip(axis, base, strict=True)]
    return _Cross(axis, p, q, rise + offset, place)


def _offset(
    loops: Loops,
    square: Expression,
    p: Vector,
    rise: Expression,
    aside: Mapping[Expression, float],
    y: Expression,
) -> Expression | None:
    """Return t, for which the square of w does not depend on the second angle; None if there is none."""
    known = {**loops.place.parameters, **loops.place.here}
    ways = [at([rise, dot(p, p)], {**aside, y: quarter}) for quarter in _QUARTERS]
    risen, across = max(ways, key=lambda one: abs(evaluate([one[0]], known)[0]))
    if not abs(evaluate([risen], known)[0]) > _LEAST * loops.place.length:
        return None
    offset = (square - across - risen * risen) / (2.0 * risen)
    whole = dot(p, p) + (rise + offset) * (rise + offset)
    return offset if loops.vanish(jvp([whole], {y: 1.0})) else None


def _somewhere(loops: Loops, p: Vector, y: Expression, z: Expression | None) -> dict[Expression, float] | None:
    """Return values of the second angle, and of a length, at which the arm about the first axis is long."""
    known, length = {**loops.place.parameters, **loops.place.here}, loops.place.length
    ways: list[dict[Expression, float]] = [{y: quarter} for quarter in _QUARTERS]
    if z is not None:
        ways = [{**way, z: aside} for way in ways for aside in (0.0, loops.place.here[z], length)]
    square = dot(p, p)
    best = max(ways, key=lambda one: evaluate([square], {**known, **one})[0])
    return best if evaluate([square], {**known, **best})[0] > (_LEAST * length) ** 2 else None


def _groups(loops: Loops, ks: tuple[int, ...], cross: _Cross, i: int, j: int, k: int) -> tuple[Group, ...]:
    """Return what gives the coordinate k, then the second angle j, then the first angle i."""
    x = loops.q[i]
    axis, p, q, place = cross.axis, cross.p, cross.q, cross.place
    square, far = dot(p, p) + cross.along * cross.along, dot(place, place)
    # The square of w does not depend on the second angle, so that any value of it will do.
    (square,) = substitute([square], {loops.q[j]: 0.0})
    if loops.vanish(jvp([square], {loops.q[k]: 1.0})):  # the coordinate moves the place of the ball
        third = solved_for(loops, far - square, k, ks, tuple(place), size=square)
    else:
        third = solved_for(loops, square - far, k, ks, tuple(place), size=far)
    second = solved_for(loops, cross.along - dot(axis, place), j, ks, tuple(axis))
    if third is None or second is None:
        return ()
    arm = dot(p, p)
    c, s = dot(p, place), dot(q, place)
    direction, heading = loops.heading(i, c, s)
    turn = loops.turn(i)
    circle = tuple(b * cos(x) - a * sin(x) for a, b in zip(p, q, strict=True))
    places = {cos(x): c / arm, sin(x): s / arm, x: direction + turn}
    first = Group((i,), ks, (circle,), places, turns={turn: x - direction}, headings=(heading,))
    return third, second, first


def _cross_product(a: Vector, b: Vector) -> list[Expression]:
    return [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
