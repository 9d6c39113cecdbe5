"""Closed loops that can be solved by formulas: one after another, as the Assur groups of class II of a linkage.

Given the independent coordinates, a group is one constraint with one unknown coordinate, or the constraints of one
joint with two (`atwood.forms.loops.joint_groups`) or three (`atwood.forms.loops.joint_groups`). Eliminating all
unknowns but one leaves ``p cos x + q sin x = w`` for an angle, with ``x = atan2(q, p) +- acos(w / sqrt(p^2 + q^2))``,
or an equation of second degree for a length; the sign is that of the position from which a run starts (J. M. McCarthy
and G. S. Soh, Geometric Design of Linkages, 2nd edition, Springer 2011, section 2.3). Where the root vanishes, two
links are in line: a dead centre.

The form is recognised by its coefficients, which follow from derivatives at x = y = 0, and by comparing it with the
constraint at other places: what is left must be rounding (`atwood.mechanics.constraints.elimination`).
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from atwood.errors import AtwoodError
from atwood.expr import Expression, atan2, cos, evaluate, hypot, jacobian, jvp, live, sin
from atwood.forms.loops.closed_form import ClosedLoops, Group, Heading, Place
from atwood.forms.loops.joint_groups import three_unknowns, two_unknowns
from atwood.forms.loops.roots import ConstraintShapes, Vector, Wave, one_unknown, sum_of_waves, waves_of
from atwood.mechanics.constraints.elimination import rough_place, rounds_to_zero
from atwood.mechanics.dynamics.equations import Equations

_LEAST = 1e-9
"""Nearer to a dead centre, as the square of a sine, a group is there at every position: it has a double root."""

_MOST_ANGLES = 4
"""Directions that depend on more angles are not looked into."""

_AHEAD = 1.0 + 1e-6
"""One wave of a direction must be so many times as large as all others together."""

_MOST_UNKNOWNS = 3
"""A joint has at most so many unknown coordinates."""

_PLACES = 2
"""At so many other places forms are compared with constraints."""


class _Offer(NamedTuple):
    """Constraints that may give coordinates once the others that they read are known.

    Attributes
    ----------
    constraints, reads
        Their numbers, and those of the coordinates that they depend on.
    least, most
        How many unknown coordinates they give.
    """

    constraints: tuple[int, ...]
    reads: frozenset[int]
    least: int
    most: int

    def ready(self, known: Collection[int]) -> tuple[int, ...]:
        """Return the unknown coordinates, in order, if they are as many as that."""
        unknown = tuple(sorted(number for number in self.reads if number not in known))
        return unknown if self.least <= len(unknown) <= self.most else ()


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
        free = {equations.forest.coordinates[i].name for i in _free_places(equations)}
        self.is_free_place = [one.name in free for one in equations.names]
        numbers = {symbol: k for k, symbol in enumerate(equations.speeds)}
        self.own_speeds = {i: numbers[rate] for i, rate in enumerate(equations.rates) if rate in numbers}
        self.values = [self.graph.zero if one.value is None else one.value for one in equations.constraints]
        self.elsewhere = [rough_place(one) for one in _elsewhere(equations, place)]
        self.reads = self._reads()
        self.joints: dict[tuple[str, str], list[int]] = {}
        for k, one in enumerate(equations.constraints):
            self.joints.setdefault(one.key[:2], []).append(k)
        self._offers = tuple(self._every_offer())
        self._offers_of: dict[int, list[int]] = {number: [] for number in range(len(self.q))}
        for at, offer in enumerate(self._offers):
            for number in offer.reads:
                self._offers_of[number].append(at)
        self._numbers = {one: number for number, one in enumerate(self.q)}
        self.shapes = ConstraintShapes(self.values, self.q, place, self.elsewhere[0].values)
        self._number = 0
        self._known: dict[tuple[tuple[int, ...], tuple[int, ...]], tuple[Group, ...]] = {}

    def solve(self, independent: Sequence[int]) -> ClosedLoops | None:
        """Return the others as functions of these, as many as there are freedoms; None where groups do not give all."""
        groups: list[Group] = []

        def take(ks: tuple[int, ...], unknowns: tuple[int, ...]) -> bool:
            if (ks, unknowns) not in self._known:
                made = self._made(ks, unknowns)
                self._known[ks, unknowns] = made if all(self._is_far(one) for one in made) else ()
            found = self._known[ks, unknowns]
            groups.extend(found)
            return bool(found)

        if not self._walk(independent, take):
            return None
        dependent = {self.own_speeds[number] for one in groups for number in one.unknowns}
        speeds = (k for k in range(len(self.equations.speeds)) if k not in dependent)
        return ClosedLoops(tuple(independent), tuple(speeds), self.own_speeds, tuple(groups))

    def can_be_solved(self, independent: Sequence[int]) -> bool:
        """Return whether there are constraints enough for each group, whatever their form."""
        return self._walk(independent, lambda *_: True)

    def _walk(self, independent: Sequence[int], take: Callable[[tuple[int, ...], tuple[int, ...]], bool]) -> bool:
        """Offer what is ready, always the first that is and is not yet refused; return whether all becomes known."""
        known = set(independent)
        left = [at for at, one in enumerate(self._offers) if one.ready(known)]
        heapq.heapify(left)
        while left and len(known) < len(self.q):
            offer = self._offers[heapq.heappop(left)]
            unknowns = offer.ready(known)
            if unknowns and take(offer.constraints, unknowns):
                known.update(unknowns)
                for at in {at for number in unknowns for at in self._offers_of[number]}:
                    heapq.heappush(left, at)
        return len(known) == len(self.q)

    def choices(self, count: int) -> Iterator[tuple[int, ...]]:
        """Yield which coordinates may be independent, for so many freedoms: those of orientations always are."""
        turned = tuple(i for i in range(len(self.q)) if i not in self.own_speeds)
        plain = sorted(self.own_speeds)
        for chosen in itertools.combinations(plain, count - (len(self.equations.speeds) - len(plain))):
            yield tuple(sorted((*chosen, *turned)))

    def _made(self, ks: tuple[int, ...], unknowns: tuple[int, ...]) -> tuple[Group, ...]:
        """Return what gives these unknowns, one after the other; nothing where it is of no known form."""
        makes = {1: one_unknown, 2: two_unknowns, 3: three_unknowns}
        try:
            return makes[len(unknowns)](self, ks, unknowns)
        except AtwoodError:  # a coefficient that is always zero would be divided by
            return ()

    def _every_offer(self) -> Iterator[_Offer]:
        """Yield constraints that may have one unknown, and then joints with two or three, and pairs of laws."""
        for k, read in enumerate(self.reads):
            yield _Offer((k,), frozenset(read), 1, 1)
        for ks in self.joints.values():
            yield _Offer(tuple(ks), self._read_by(ks), 2, min(len(ks), _MOST_UNKNOWNS))
        for pair in self._pairs():
            yield _Offer(pair, self._read_by(pair), len(pair), len(pair))

    def _read_by(self, ks: Iterable[int]) -> frozenset[int]:
        return frozenset[int]().union(*(self.reads[k] for k in ks))

    def _pairs(self) -> Iterator[tuple[int, int]]:
        """Yield two laws of one joint, as the guide and the lock of a slide: of each the constraint that says most."""
        sizes = evaluate(self.values, {**self.place.parameters, **self.elsewhere[0].values})
        most = {law: max(ks, key=lambda k: abs(sizes[k])) for law, ks in self.joints.items()}
        of_part: dict[str, list[int]] = {}
        for (part, _), k in most.items():
            of_part.setdefault(part, []).append(k)
        for ks in of_part.values():
            yield from itertools.combinations(ks, 2)

    def _reads(self) -> list[set[int]]:
        """Return which coordinates each constraint depends on, by more than rounding."""
        found = jacobian(self.values, list(self.q))
        entries = list(found.entries)
        sure = ~rounds_to_zero(entries, self.place.parameters, *self.elsewhere)
        reads: list[set[int]] = [set() for _ in self.values]
        for row, column, is_sure in zip(found.rows, found.columns, sure, strict=True):
            if is_sure:
                reads[row].add(column)
        return reads

    def _is_far(self, group: Group) -> bool:
        """Return whether the position is far enough from the group's dead centres."""
        if not group.margins:
            return True
        return min(evaluate(group.margins, self.place.known)) > _LEAST

    def vanish(self, values: Vector) -> bool:
        """Return whether values are zero but for rounding, wherever coordinates are."""
        moving = [one for one in values if not one.is_zero]
        return not moving or bool(rounds_to_zero(moving, self.place.parameters, *self.elsewhere).all())

    def agree(self, values: Vector, others: Vector) -> bool:
        """Return whether values are those of others but for rounding, wherever coordinates are."""
        return self.vanish([a - b for a, b in zip(values, others, strict=True)])

    # -- angles ---------------------------------------------------------------------------------------------------

    def turn(self, number: int) -> Expression:
        """Return the symbol of the whole turns of an angle."""
        return self.graph.parameter(f"turns:{self.equations.names[number].name}")

    def heading(self, number: int, p: Expression, q: Expression) -> tuple[Expression, Heading]:
        """Return the direction of (p, q) without jumps."""
        name = f"{self.equations.names[number].name}:{self._number}"
        self._number += 1
        phase = self.graph.parameter(f"phase:{name}")
        found = self._waves(p, q)
        followed = None if found is None else self._followed(phase, p, q, *found)
        if followed is not None:
            return followed
        c, s = cos(phase), sin(phase)
        ahead, beside = p * c + q * s, q * c - p * s
        flip, offset = self.graph.parameter(f"flip:{name}"), self.graph.parameter(f"offset:{name}")
        direction = phase + offset + atan2(flip * beside, flip * ahead)
        values = {phase: atan2(q, p), flip: self.graph.one, offset: self.graph.zero}
        most = None if found is None else _sum_of_sizes(found[1])
        return direction, Heading(phase, flip, offset, ahead, beside, values, most=most)

    def _waves(self, p: Expression, q: Expression) -> tuple[list[Expression], dict[tuple[int, ...], Wave]] | None:
        """Return the angles that (p, q) depends on, and its waves in these; None where it has no such form."""
        angles = self._angles_read(p, q)
        if angles is None or len(angles) > _MOST_ANGLES:
            return None
        waves = waves_of(p, q, angles)
        is_all = waves and self.agree((p, q), sum_of_waves(waves, angles, self.graph.zero))
        return (angles, waves) if is_all else None

    def largest(self, square: Expression) -> Expression | None:
        """Return the most that the square of a length can be; None if it does not move, or not with angles alone."""
        found = None if square.is_parametric else self._waves(square, self.graph.zero)
        return _sum_of_sizes(found[1]) if found is not None and found[0] else None

    def _followed(
        self,
        phase: Expression,
        p: Expression,
        q: Expression,
        angles: list[Expression],
        waves: Mapping[tuple[int, ...], Wave],
    ) -> tuple[Expression, Heading] | None:
        """Return the direction of (p, q) as counted from a sum of known angles that it never turns away from."""
        sizes = {orders: hypot(*z) for orders, z in waves.items()}
        known = self.place.known
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
        return direction, Heading(phase, values={phase: atan2(im, re)}, lead=lead, most=_sum_of_sizes(waves))

    def _angles_read(self, p: Expression, q: Expression) -> list[Expression] | None:
        """Return the angles that a direction depends on; None if it depends on anything else that moves."""
        angles = []
        reached = [one for one in live([p, q]) if one in self._numbers or one is self.equations.time]
        for one in sorted(reached, key=lambda one: self._numbers.get(one, len(self.q))):
            if not self.vanish(jvp([p, q], {one: 1.0})):
                if one is self.equations.time or not self.is_angle[self._numbers[one]]:
                    return None
                angles.append(one)
        return angles


def _sum_of_sizes(waves: Mapping[tuple[int, ...], Wave]) -> Expression:
    found, *rest = (hypot(*z) for z in waves.values())
    for one in rest:
        found = found + one
    total: Expression = found
    return total


def _free_places(equations: Equations) -> Iterator[int]:
    """Yield the numbers of coordinates that are those of a place in a plane or in space, of nothing but itself."""
    for one in equations.forest.attachments:
        if one.joint is None and len(one.coordinates) > 1:
            yield from one.coordinates


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
