"""Closed loops that can be solved by formulas: one after another, as the Assur groups of class II of a linkage.

Given the independent coordinates, a group is one constraint with one unknown coordinate, or the constraints of one
joint with two. In terms of unknown angles x and y (of whole links, so that no product of both is left) and of an
unknown length s, what a joint holds together is

- ``e + P (cos x, sin x) + Q (cos y, sin y) = 0`` between two links that turn (RRR),
- ``e + P (cos x, sin x) + k s = 0`` between a link that turns and one that slides (RRP),
- ``e + k s + l z = 0`` between two that slide,

where e, P, Q, k and l are known from what was solved before. The two columns of P are at a right angle and of equal
length, and Q and k lie in their plane, whichever plane of space that is. Eliminating all unknowns but one angle
leaves ``p cos x + q sin x = w`` with ``x = atan2(q, p) +- acos(w / sqrt(p^2 + q^2))``; the sign is that of the
position from which a run starts (J. M. McCarthy and G. S. Soh, Geometric Design of Linkages, 2nd edition, Springer
2011, section 2.3). Where the root vanishes, two links are in line: a dead centre.

The form is recognised by its coefficients, which follow from derivatives at x = y = 0, and by comparing it with the
constraint at other places: what is left must be rounding (`atwood.mechanics.constraints.certainty`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from atwood.errors import AtwoodError
from atwood.expr import Expression, atan2, cos, depends_on, evaluate, hypot, jacobian, jvp, sin, sqrt, substitute
from atwood.forms.loops.branches import ClosedLoops, Group, Heading, Place
from atwood.forms.loops.constraint_shapes import ConstraintShapes
from atwood.forms.loops.harmonics import at, harmonics, sum_of_waves, waves_of
from atwood.mechanics.constraints.certainty import rounds_to_zero
from atwood.mechanics.dynamics.equations import Equations

__all__ = ["Loops"]

Vector = Sequence[Expression]

_LEAST = 1e-9
"""Nearer to a dead centre, as the square of a sine, a group is there at every position: it has a double root."""

_MOST_ANGLES = 4
"""Directions that depend on more angles are not looked into."""

_AHEAD = 1.0 + 1e-6
"""One wave of a direction must be so many times as large as all others together."""

_PLACES = 2
"""At so many other places forms are compared with constraints."""


class Loops:
    """The closed loops of a mechanism, to be solved with one choice of independent coordinates or another.

    Parameters
    ----------
    equations
        In generalized coordinates, with all constraints on positions.
    place
        An admissible position.
    """

    def __init__(self, equations: Equations, place: Place) -> None:
        self.equations, self.place = equations, place
        self.graph, self.q = equations.graph, equations.coordinates
        self.is_angle = [one.unit == "rad" for one in equations.names]
        self.values = [self.graph.zero if one.value is None else one.value for one in equations.constraints]
        self.elsewhere = _elsewhere(equations, place)
        self.reads = self._reads()
        self.joints: dict[tuple[str, str], list[int]] = {}
        for k, one in enumerate(equations.constraints):
            self.joints.setdefault(one.key[:2], []).append(k)
        self.shapes = ConstraintShapes(self.values, self.q, place, self.elsewhere[0])
        self._number = 0
        self._known: dict[tuple[tuple[int, ...], tuple[int, ...]], Group | None] = {}

    def solve(self, independent: Sequence[int]) -> ClosedLoops | None:
        """Return the others as functions of these, as many as there are freedoms; None where groups do not give all."""
        known, groups = set(independent), []
        while len(known) < len(self.q):
            found = next((one for one in self._candidates(known) if one is not None), None)
            if found is None:
                return None
            groups.append(found)
            known.update(found.unknowns)
        return ClosedLoops(tuple(independent), tuple(groups))

    def can_be_solved(self, independent: Sequence[int]) -> bool:
        """Return whether there are constraints enough for each group, whatever their form."""
        known = set(independent)
        while len(known) < len(self.q):
            ready = next(self._ready(known), None)
            if ready is None:
                return False
            known.update(ready[1])
        return True

    def _candidates(self, known: set[int]) -> Iterator[Group | None]:
        for key in self._ready(known):
            if key not in self._known:
                made = self._made(*key)
                self._known[key] = made if made is None or self._is_far(made) else None
            yield self._known[key]

    def _made(self, ks: tuple[int, ...], unknowns: tuple[int, ...]) -> Group | None:
        try:
            return self._one(ks[0], *unknowns) if len(unknowns) == 1 else self._two(ks, *unknowns)
        except AtwoodError:  # a coefficient that is always zero would be divided by
            return None

    def _ready(self, known: set[int]) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
        """Yield constraints with one unknown, and then joints with two."""
        for k, read in enumerate(self.reads):
            left = read - known
            if len(left) == 1:
                yield (k,), tuple(left)
        for ks in self.joints.values():
            left = set().union(*(self.reads[k] for k in ks)) - known
            if len(ks) > 1 and len(left) == 2:
                yield tuple(ks), tuple(sorted(left))

    def _reads(self) -> list[set[int]]:
        """Return which coordinates each constraint depends on, by more than rounding."""
        found = jacobian(self.values, list(self.q))
        entries = list(found.entries)
        sure = np.zeros(len(entries), dtype=bool)
        for other in self.elsewhere:
            sure |= ~rounds_to_zero(entries, self.place.parameters, other)
        reads: list[set[int]] = [set() for _ in self.values]
        for row, column, is_sure in zip(found.rows, found.columns, sure, strict=True):
            if is_sure:
                reads[row].add(column)
        return reads

    def _is_far(self, group: Group) -> bool:
        """Return whether the position is far enough from the group's dead centres."""
        if not group.margins:
            return True
        return min(evaluate(group.margins, {**self.place.parameters, **self.place.here})) > _LEAST

    def _vanish(self, values: Vector) -> bool:
        """Return whether values are zero but for rounding, wherever coordinates are."""
        moving = [one for one in values if not one.is_zero]
        return not moving or all(
            bool(rounds_to_zero(moving, self.place.parameters, other).all()) for other in self.elsewhere
        )

    def _agree(self, values: Vector, others: Vector) -> bool:
        return self._vanish([a - b for a, b in zip(values, others, strict=True)])

    # -- one constraint with one unknown --------------------------------------------------------------------------

    def _one(self, k: int, number: int) -> Group | None:
        g, x, along = self.values[k], self.q[number], ((self.graph.one,),)
        if not self.shapes.may_be((k,), {number: self.is_angle[number]}):
            return None
        if not self.is_angle[number]:
            (constant,), (rate,) = at([g], {x: 0.0}), at(jvp([g], {x: 1.0}), {x: 0.0})
            places = {x: -(constant / rate)} if not rate.is_zero else {}
            is_linear = bool(places) and self._agree([g], [constant + rate * x])
            return Group((number,), (k,), along, places) if is_linear else None
        (e,), (p,), (q,) = harmonics([g], x)
        if not self._agree([g], [e + p * cos(x) + q * sin(x)]):
            return None
        root = _Root(self, number, p, q, -e, x)
        heading = self._heading(number, p, q)
        angle, turn = root.angle(heading[0]), self._turn(number)
        places = {cos(x): root.c, sin(x): root.s, x: angle + turn}
        margin = root.rest / root.square
        return Group((number,), (k,), along, places, (margin,), root.sign, {turn: x - angle}, heading[1:])

    # -- the constraints of a joint with two ----------------------------------------------------------------------

    def _two(self, ks: tuple[int, ...], i: int, j: int) -> Group | None:
        angles = self.is_angle[i], self.is_angle[j]
        if all(angles):
            ways = ((i, j, 0.0), (i, j, 1.0), (i, j, -1.0), (j, i, 1.0), (j, i, -1.0))
            fitting = (way for way in ways if self.shapes.may_be(ks, {way[0]: True, way[1]: True}, nested=way[2]))
            found = (self._two_links(ks, *way) for way in fitting)
            return next((one for one in found if one is not None), None)
        if not self.shapes.may_be(ks, {i: angles[0], j: angles[1]}):
            return None
        if any(angles):
            return self._link_and_slide(ks, *((i, j) if angles[0] else (j, i)))
        return self._two_slides(ks, i, j)

    def _two_links(self, ks: tuple[int, ...], i: int, j: int, nested: float) -> Group | None:
        """Solve for two angles; with `nested`, the first is counted from so many times the second."""
        x, y = self.q[i], self.q[j]
        g = [self.values[k] for k in ks]
        g = substitute(g, {x: x - nested * y}) if nested else g  # from here on x is the angle of a link
        e, p, q = harmonics(g, x)
        e, r, s = harmonics(e, y)
        if not self._agree(g, _sum(e, (p, cos(x)), (q, sin(x)), (r, cos(y)), (s, sin(y)))):
            return None
        own, other = _dot(p, p), _dot(r, r)
        flat = [_dot(p, q), own - _dot(q, q), _dot(r, s), other - _dot(s, s)]
        flat.append(other * own - _square(_dot(r, p)) - _square(_dot(r, q)))
        if not self._vanish(flat):
            return None
        ends = _dot(e, p), _dot(e, q), _dot(e, r), _dot(e, s)
        px, qx, py, qy = (2.0 * one for one in ends)
        root = _Root(self, i, px, qx, other - own - _dot(e, e), x + nested * y)
        cy = -(ends[2] + root.c * _dot(r, p) + root.s * _dot(r, q)) / other
        sy = -(ends[3] + root.c * _dot(s, p) + root.s * _dot(s, q)) / other
        first, second = self._heading(i, px, qx), self._heading(j, py, qy)
        angle = second[0] + atan2(py * sy - qy * cy, py * cy + qy * sy)
        outer = root.angle(first[0]) - nested * angle
        turns = self._turn(i), self._turn(j)
        cx = root.c * cy + nested * (root.s * sy) if nested else root.c
        sx = root.s * cy - nested * (root.c * sy) if nested else root.s
        places = {cos(x): cx, sin(x): sx, x: outer + turns[0], cos(y): cy, sin(y): sy, y: angle + turns[1]}
        margin = root.rest / (4.0 * own * other)
        values = {turns[0]: x - outer, turns[1]: y - angle}
        headings = (*first[1:], *second[1:])
        return Group((i, j), ks, self._along(ks, p, q), places, (margin,), root.sign, values, headings)

    def _link_and_slide(self, ks: tuple[int, ...], i: int, j: int) -> Group | None:
        """Solve for an angle and a length."""
        x, y = self.q[i], self.q[j]
        g = [self.values[k] for k in ks]
        k = at(jvp(g, {y: 1.0}), {y: 0.0, x: 0.0})
        e, p, q = harmonics(at(g, {y: 0.0}), x)
        if not self._agree(g, _sum(e, (p, cos(x)), (q, sin(x)), (k, y))):
            return None
        own, size = _dot(p, p), _dot(k, k)
        a, b = -_dot(k, q), _dot(k, p)  # across the slide, times the lengths of both
        if not self._vanish([_dot(p, q), own - _dot(q, q), size * own - a * a - b * b]):
            return None
        root = _Root(self, i, a * own, b * own, -(a * _dot(p, e) + b * _dot(q, e)), x)
        heading = self._heading(i, a, b)
        angle, turn = root.angle(heading[0]), self._turn(i)
        length = -(_dot(k, e) + root.c * b - root.s * a) / size
        places = {cos(x): root.c, sin(x): root.s, x: angle + turn, y: length}
        margins = (root.rest / root.square,)
        return Group((i, j), ks, self._along(ks, p, q), places, margins, root.sign, {turn: x - angle}, heading[1:])

    def _two_slides(self, ks: tuple[int, ...], i: int, j: int) -> Group | None:
        """Solve for two lengths in the plane in which they are."""
        x, y = self.q[i], self.q[j]
        g = [self.values[k] for k in ks]
        e = at(g, {x: 0.0, y: 0.0})
        k, m = (at(jvp(g, {one: 1.0}), {x: 0.0, y: 0.0}) for one in (x, y))
        if not self._agree(g, _sum(e, (k, x), (m, y))):
            return None
        kk, mm, km, ke, me = _dot(k, k), _dot(m, m), _dot(k, m), _dot(k, e), _dot(m, e)
        det = kk * mm - km * km
        places = {x: (km * me - mm * ke) / det, y: (km * ke - kk * me) / det}
        return Group((i, j), ks, self._along(ks, k, m), places, (det / (kk * mm),))

    def _along(self, ks: tuple[int, ...], p: Vector, q: Vector) -> tuple[tuple[Expression, ...], ...]:
        """Return two directions in the plane of a group, in which its constraints are taken for the speeds."""
        one, zero = self.graph.one, self.graph.zero
        return ((one, zero), (zero, one)) if len(ks) == 2 else (tuple(p), tuple(q))

    # -- angles ---------------------------------------------------------------------------------------------------

    def _turn(self, number: int) -> Expression:
        return self.graph.parameter(f"turns:{self.equations.names[number].name}")

    def _heading(self, number: int, p: Expression, q: Expression) -> tuple[Expression, Heading]:
        """Return the direction of (p, q) without jumps."""
        name = f"{self.equations.names[number].name}:{self._number}"
        self._number += 1
        phase = self.graph.parameter(f"phase:{name}")
        followed = self._followed(phase, p, q)
        if followed is not None:
            return followed
        c, s = cos(phase), sin(phase)
        ahead, beside = p * c + q * s, q * c - p * s
        flip, offset = self.graph.parameter(f"flip:{name}"), self.graph.parameter(f"offset:{name}")
        direction = phase + offset + atan2(flip * beside, flip * ahead)
        values = {phase: atan2(q, p), flip: self.graph.one, offset: self.graph.zero}
        return direction, Heading(phase, flip, offset, ahead, beside, values)

    def _followed(self, phase: Expression, p: Expression, q: Expression) -> tuple[Expression, Heading] | None:
        """Return the direction of (p, q) as counted from a sum of known angles that it never turns away from."""
        angles = self._angles_read(p, q)
        if angles is None or len(angles) > _MOST_ANGLES:
            return None
        waves = waves_of(p, q, angles)
        if not waves or not self._agree((p, q), sum_of_waves(waves, angles, self.graph.zero)):
            return None
        sizes = {orders: hypot(*z) for orders, z in waves.items()}
        known = {**self.place.parameters, **self.place.here}
        orders = max(waves, key=lambda n: evaluate([sizes[n]], known)[0])
        lead = sizes[orders]
        for other, size in sizes.items():
            lead = lead if other == orders else lead - _AHEAD * size
        if not evaluate([lead], known)[0] > 0.0:
            return None
        total = phase
        for angle, order in zip(angles, orders, strict=True):
            total = total + float(order) * angle
        c, s = cos(total), sin(total)
        re, im = waves[orders]
        direction = total + atan2(q * c - p * s, p * c + q * s)
        return direction, Heading(phase, values={phase: atan2(im, re)}, lead=lead)

    def _angles_read(self, p: Expression, q: Expression) -> list[Expression] | None:
        """Return the angles that a direction depends on; None if it depends on anything else that moves."""
        angles = []
        for one, is_angle in zip((*self.q, self.equations.time), (*self.is_angle, False), strict=True):
            if (depends_on(p, [one]) or depends_on(q, [one])) and not self._vanish(jvp([p, q], {one: 1.0})):
                if not is_angle:
                    return None
                angles.append(one)
        return angles


class _Root:
    """The solution of ``p cos x + q sin x = w`` on one of its two branches."""

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


def _dot(a: Vector, b: Vector) -> Expression:
    total: Expression = a[0] * b[0]
    for one, other in zip(a[1:], b[1:], strict=True):
        total = total + one * other
    return total


def _square(a: Expression) -> Expression:
    return a * a


def _sum(start: Vector, *terms: tuple[Vector, Expression]) -> list[Expression]:
    total = list(start)
    for factors, by in terms:
        total = [one + factor * by for one, factor in zip(total, factors, strict=True)]
    return total


def _elsewhere(equations: Equations, place: Place) -> list[dict[Expression, float]]:
    """Return places at which forms are compared: any, whether constraints hold there or not."""
    random = np.random.default_rng(0)
    made = []
    for _ in range(_PLACES):
        other = dict(place.here)
        for one, name in zip(equations.coordinates, equations.names, strict=True):
            step = float(random.uniform(-1.0, 1.0))
            other[one] = math.pi * step if name.unit == "rad" else place.here[one] + place.length * step
        made.append(other)
    return made
