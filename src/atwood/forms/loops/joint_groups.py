"""Groups of a linkage: the constraints of one joint with two unknown coordinates, or of a ball with three.

Two unknowns, as of two links in a plane: with angles x and y of whole links (so that no product of both is left) and
a length s, what a joint holds together is

- ``e + P (cos x, sin x) + Q (cos y, sin y) = 0`` between two links that turn (RRR),
- ``e + P (cos x, sin x) + k s = 0`` between a link that turns and one that slides on what is known (RRP, PRP),
- ``e + (P + s K) (cos x, sin x) = 0`` of a slide that turns (RPR),
- ``e + k s + l z = 0`` between two that slide,

where e, P, Q, K, k and l are known. The two columns of P are at a right angle and of equal length, and Q, K and k lie
in their plane, whichever plane of space that is.

Three unknowns, of which two are the angles of a cross: these are the assemblies of a universal joint, a ball and one
joint more (USR, USP and UPS in Modelica's names). From the cross, with its axis a, to the ball is
``w = a (z + t) + P cos x + Q sin x``, where x is the angle about a, and P, Q and z depend on the other angle y and
perhaps on the length s of the leg; t is constant. The ball is to be at V, seen from the cross. All of it may turn with
what the cross is on. What does not depend on the angles leaves three equations, each with one unknown more:

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

from atwood.expr import Expression, atan2, cos, evaluate, jvp, sin, sqrt, substitute
from atwood.forms.loops.closed_form import Group
from atwood.forms.loops.roots import Root, Vector, arm_margin, at, dot, harmonics, solved_for, total
from atwood.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from atwood.forms.loops.assur_groups import Loops


def two_unknowns(loops: Loops, ks: tuple[int, ...], unknowns: tuple[int, ...]) -> tuple[Group, ...]:
    """Return the group of a joint's constraints with two unknowns; nothing where it is of no known form."""
    i, j = unknowns
    angles = loops.is_angle[i], loops.is_angle[j]
    if all(angles):
        ways = ((i, j, 0.0), (i, j, 1.0), (i, j, -1.0), (j, i, 1.0), (j, i, -1.0))
        fitting = (way for way in ways if loops.shapes.may_be(ks, {way[0]: True, way[1]: True}, nested=way[2]))
        made = (_two_links(loops, ks, *way) for way in fitting)
        found = next((one for one in made if one is not None), None) or _locked_links(loops, ks, i, j)
    elif not loops.shapes.may_be(ks, {i: angles[0], j: angles[1]}):
        found = None
    elif not any(angles):
        found = _two_slides(loops, ks, i, j)
    else:
        i, j = (i, j) if angles[0] else (j, i)
        found = _link_and_slide(loops, ks, i, j) or _slide_that_turns(loops, ks, i, j)
    return () if found is None else (found,)


def _two_links(loops: Loops, ks: tuple[int, ...], i: int, j: int, nested: float) -> Group | None:
    """Solve for two angles; with `nested`, the first is counted from so many times the second."""
    x, y = loops.q[i], loops.q[j]
    g = [loops.values[k] for k in ks]
    g = substitute(g, {x: x - nested * y}) if nested else g  # from here on x is the angle of a link
    e, p, q = harmonics(g, x)
    e, r, s = harmonics(e, y)
    if not loops.agree(g, total(e, (p, cos(x)), (q, sin(x)), (r, cos(y)), (s, sin(y)))):
        return None
    own, other = dot(p, p), dot(r, r)
    flat = [dot(p, q), own - dot(q, q), dot(r, s), other - dot(s, s)]
    flat.append(other * own - _square(dot(r, p)) - _square(dot(r, q)))
    if not loops.vanish(flat):
        return None
    ends = dot(e, p), dot(e, q), dot(e, r), dot(e, s)
    px, qx, py, qy = (2.0 * one for one in ends)
    root = Root(loops, i, px, qx, other - own - dot(e, e), x + nested * y)
    cy = -(ends[2] + root.c * dot(r, p) + root.s * dot(r, q)) / other
    sy = -(ends[3] + root.c * dot(s, p) + root.s * dot(s, q)) / other
    first, second = loops.heading(i, px, qx), loops.heading(j, py, qy)
    angle = second[0] + atan2(py * sy - qy * cy, py * cy + qy * sy)
    outer = root.angle(first[0]) - nested * angle
    turns = loops.turn(i), loops.turn(j)
    cx = root.c * cy + nested * (root.s * sy) if nested else root.c
    sx = root.s * cy - nested * (root.c * sy) if nested else root.s
    places = {cos(x): cx, sin(x): sx, x: outer + turns[0], cos(y): cy, sin(y): sy, y: angle + turns[1]}
    # Measured by the most that both can be: links in line themselves vanish where they fold, whatever the angle is.
    most = [one if (found := loops.largest(one)) is None else found for one in (own, other)]
    margin = root.rest / (4.0 * most[0] * most[1])
    values = {turns[0]: x - outer, turns[1]: y - angle}
    headings = (*first[1:], *second[1:])
    return Group((i, j), ks, _along(loops, ks, p, q), places, (margin,), root.sign, values, headings)


def _link_and_slide(loops: Loops, ks: tuple[int, ...], i: int, j: int) -> Group | None:
    """Solve for an angle and a length along what is known."""
    x, y = loops.q[i], loops.q[j]
    g = [loops.values[k] for k in ks]
    k = at(jvp(g, {y: 1.0}), {y: 0.0, x: 0.0})
    e, p, q = harmonics(at(g, {y: 0.0}), x)
    if not loops.agree(g, total(e, (p, cos(x)), (q, sin(x)), (k, y))):
        return None
    own, size = dot(p, p), dot(k, k)
    a, b = -dot(k, q), dot(k, p)  # across the slide, times the lengths of both
    if not loops.vanish([dot(p, q), own - dot(q, q), size * own - a * a - b * b]):
        return None
    root = Root(loops, i, a * own, b * own, -(a * dot(p, e) + b * dot(q, e)), x)
    direction, heading = loops.heading(i, a, b)
    angle, turn = root.angle(direction), loops.turn(i)
    length = -(dot(k, e) + root.c * b - root.s * a) / size
    places = {cos(x): root.c, sin(x): root.s, x: angle + turn, y: length}
    margins = (root.rest / root.square,)
    return Group((i, j), ks, _along(loops, ks, p, q), places, margins, root.sign, {turn: x - angle}, (heading,))


def _slide_that_turns(loops: Loops, ks: tuple[int, ...], i: int, j: int) -> Group | None:
    """Solve for an angle and a length along what turns by it.

    With d along the slide and n across it, ``e + (a + s) d + b n = 0``, where d and n turn with the angle: so that
    ``(a + s)^2 = e^2/d^2 - b^2``, and the angle is what turns ``(a + s, b)`` into -e.
    """
    x, y = loops.q[i], loops.q[j]
    g = [loops.values[k] for k in ks]
    e, p, q = harmonics(at(g, {y: 0.0}), x)
    k, c, s = harmonics(at(jvp(g, {y: 1.0}), {y: 0.0}), x)
    moving = total(p, (c, y)), total(q, (s, y))
    if not (loops.vanish(k) and loops.agree(g, total(e, (moving[0], cos(x)), (moving[1], sin(x))))):
        return None
    size, far = dot(c, c), dot(e, e)
    a, b = dot(p, c) / size, dot(p, s) / size
    ex, ey = dot(e, c), dot(e, s)
    flat = [dot(c, s), size - dot(s, s), size * far - ex * ex - ey * ey]
    flat += [one - (a * other + b * across) for one, other, across in zip(p, c, s, strict=True)]
    flat += [one - (a * other - b * across) for one, other, across in zip(q, s, c, strict=True)]
    if not loops.vanish(flat):
        return None
    sign = loops.graph.parameter(f"branch:{loops.equations.names[j].name}")
    square = far / size
    rest = square - b * b
    along = sign * sqrt(rest)
    over = size * square
    cx, sx = -(ex * along + ey * b) / over, (ex * b - ey * along) / over
    direction, heading = loops.heading(i, -ex, -ey)
    angle, turn = direction - atan2(b, along), loops.turn(i)
    places = {cos(x): cx, sin(x): sx, x: angle + turn, y: along - a}
    margins = (
        (rest / square,) if heading.most is None else (rest / square, arm_margin(square * size * size, heading.most))
    )
    values = {turn: x - angle}
    return Group((i, j), ks, _along(loops, ks, c, s), places, tuple(margins), {sign: a + y}, values, (heading,))


def _locked_links(loops: Loops, ks: tuple[int, ...], i: int, j: int) -> Group | None:
    """Solve for two angles of which one constraint holds the sum or the difference, as a slide does where it turns."""
    x, y = loops.q[i], loops.q[j]
    if len(ks) != 2:
        return None
    for nested, turned in itertools.product((-1.0, 1.0), (ks, ks[::-1])):
        lock, guide = substitute([loops.values[k] for k in turned], {x: x - nested * y})  # now x is the sum
        (e,), (p,), (q,) = (at(one, {y: 0.0}) for one in harmonics([lock], x))
        d, r, s = (one for (one,) in harmonics([guide], y))
        if loops.agree([lock], [e + p * cos(x) + q * sin(x)]) and loops.agree([guide], [d + r * cos(y) + s * sin(y)]):
            return _locked(loops, ks, (i, j), nested, (p, q, -e), (r, s, -d))
    return None


def _locked(
    loops: Loops, ks: tuple[int, ...], unknowns: tuple[int, int], nested: float, lock: Vector, guide: Vector
) -> Group:
    """Solve for a sum of two angles by one wave in it, and then for the second by another."""
    (i, j), (x, y) = unknowns, (loops.q[one] for one in unknowns)
    p, q, w = lock
    root = Root(loops, i, p, q, w, x + nested * y)
    direction, first = loops.heading(i, p, q)
    turns, within = (loops.turn(i), loops.turn(j)), root.angle(direction)
    whole = within + turns[0]
    # Whatever tells branches apart reads the coordinates as they are; what is solved for, the sum as it was found.
    there, here = {cos(x): root.c, sin(x): root.s, x: whole}, {x: x + nested * y}
    apart, other = (Root(loops, j, *_three(substitute(list(guide), ways)), y) for ways in (here, there))
    found, second = loops.heading(j, guide[0], guide[1])
    second = second.with_places(lambda one: substitute([one], here)[0])
    angle = other.angle(substitute([found], there)[0])
    cx = root.c * other.c + nested * (root.s * other.s)
    sx = root.s * other.c - nested * (root.c * other.s)
    places = {cos(x): cx, sin(x): sx, x: whole - nested * (angle + turns[1])}
    places |= {cos(y): other.c, sin(y): other.s, y: angle + turns[1]}
    margins = root.rest / root.square, apart.rest / apart.square
    values = {turns[0]: x + nested * y - within, turns[1]: y - apart.angle(substitute([found], here)[0])}
    return Group(
        unknowns, ks, _along(loops, ks, (), ()), places, margins, {**root.sign, **apart.sign}, values, (first, second)
    )


def _three(values: list[Expression]) -> tuple[Expression, Expression, Expression]:
    p, q, w = values
    return p, q, w


def _two_slides(loops: Loops, ks: tuple[int, ...], i: int, j: int) -> Group | None:
    """Solve for two lengths in the plane in which they are."""
    x, y = loops.q[i], loops.q[j]
    g = [loops.values[k] for k in ks]
    e = at(g, {x: 0.0, y: 0.0})
    k, m = (at(jvp(g, {one: 1.0}), {x: 0.0, y: 0.0}) for one in (x, y))
    if not loops.agree(g, total(e, (k, x), (m, y))):
        return None
    kk, mm, km, ke, me = dot(k, k), dot(m, m), dot(k, m), dot(k, e), dot(m, e)
    det = kk * mm - km * km
    places = {x: (km * me - mm * ke) / det, y: (km * ke - kk * me) / det}
    return Group((i, j), ks, _along(loops, ks, k, m), places, (det / (kk * mm),))


def _along(loops: Loops, ks: tuple[int, ...], p: Vector, q: Vector) -> tuple[tuple[Expression, ...], ...]:
    """Return two directions in the plane of a group, in which its constraints are taken for the speeds."""
    one, zero = loops.graph.one, loops.graph.zero
    return ((one, zero), (zero, one)) if len(ks) == 2 else (tuple(p), tuple(q))


def _square(a: Expression) -> Expression:
    return a * a


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
    known = loops.place.known
    ways = [at([rise, dot(p, p)], {**aside, y: quarter}) for quarter in _QUARTERS]
    risen, across = max(ways, key=lambda one: abs(evaluate([one[0]], known)[0]))
    if not abs(evaluate([risen], known)[0]) > _LEAST * loops.place.length:
        return None
    offset = (square - across - risen * risen) / (2.0 * risen)
    whole = dot(p, p) + (rise + offset) * (rise + offset)
    return offset if loops.vanish(jvp([whole], {y: 1.0})) else None


def _somewhere(loops: Loops, p: Vector, y: Expression, z: Expression | None) -> dict[Expression, float] | None:
    """Return values of the second angle, and of a length, at which the arm about the first axis is long."""
    known, length = loops.place.known, loops.place.length
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
