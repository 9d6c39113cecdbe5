"""States of rest: Newton's method on the accelerations of a scene whose speeds are zero.

At rest ``a(q) = 0`` on the constraints. With accelerations instead of forces every equation has the size of what
would happen, and the derivative is that of the linear model (`LinearScene.flow`). What is left of them counts in the
metric of the masses, ``a.M a``, which singular coordinates neither hide nor exaggerate, and beside what it is
elsewhere in the region; and a place counts only where the root is near by, so that the tail of a force that dies away
is none.

Where the linear model decides nothing, directions without stiffness are followed by higher derivatives. Along the
null space of the stiffness, with all else in balance, the forces are a reduced field of as many components (Lyapunov
and Schmidt; Golubitsky and Schaeffer, Singularities and Groups in Bifurcation Theory I, section 1.3). Where it is
zero the state is one of a family. On a line it is a polynomial through samples: the first coefficient that is not
rounding is the order of the root, and the one before says where the root is. Rest is stable where the effective
potential has a strict minimum (Lagrange and Dirichlet), whatever dampers and gyroscopic forces do; where it falls,
only gyroscopic forces can help, and forces without a potential are not decided.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError
from atwood.forms.quantities import to_maximal
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.matrices import least_norm, to_array
from atwood.numerics.rank import decompose, null_space, rank
from atwood.simulation.dynamics.balance import Balance, balance_of
from atwood.theory.linear.displacements import Minimal, find_minimal
from atwood.theory.linear.variations import Flow, LinearScene

_FAR = 0.5
"""A step moves nothing by more of its size; an angle by so many radians."""

_STEPS = 60

_PATIENCE = 12
"""So many steps that lead no nearer end the search."""

_MET = 1e-9
"""Relative to accelerations elsewhere in the region: what is left at rest."""

_NEAR = 1e-7
"""Relative to the scene's sizes: how near the root is by a last step of Newton's method."""

_FLAT = 1e-9
"""Relative to stiffness elsewhere: how far that at a place may be off."""

_EVEN, _SLOW = 0.05, (0.3, 0.95)
"""Steps that become shorter by the same share, to so much of it, are a root of higher order: the rest of them is taken
at once (Aitken)."""

_WALK, _BACK = 40, 10
"""So many steps lead from one state to another along directions in which nothing changes, each followed by so many of
Newton's method at most."""

_HALFWAY = 0.25
"""A state between two others is halfway if it is off by no more of their distance."""

_TURNED, _NEARER = 0.1, 1e-4
"""A first step of so much where none leads nearer; by so much others must, all in the scene's sizes."""

_SAME = 1e-6
"""Displacements, relative to the scene's sizes, by which states that count as one may differ."""


@dataclass(frozen=True, eq=False)
class Rest:
    """A state of rest, or what is looked at on the way to one.

    Attributes
    ----------
    q
        Coordinates.
    flow, minimal
        The flow there, and minimal states.
    accelerations, slopes
        Of the independent speeds, in units of the scene's sizes, and their derivatives by independent displacements in
        units of the scene's sizes.
    push
        The size of all accelerations in the metric of the masses, ``sqrt(a.M a)``.
    """

    q: FloatArray
    flow: Flow
    minimal: Minimal
    accelerations: FloatArray
    slopes: FloatArray
    push: float


def slopes_at(
    scene: LinearScene, flow: Flow, kept: Sequence[int], like: Minimal | None = None
) -> tuple[Minimal, FloatArray, FloatArray]:
    """Return minimal states, independent accelerations scaled, and their derivatives by displacements scaled."""
    minimal = find_minimal(scene, flow, kept, like)
    count, n = len(scene.tangents), len(minimal.displacements)
    by = (flow.acceleration[:, :count] @ minimal.shift[:, :n])[list(minimal.speeds)]
    own = scene.sizes[list(minimal.speeds)]
    columns = scene.displacement_sizes[list(minimal.displacements)]
    slopes = by * columns / own[:, None]
    accelerations = flow.variation.a[list(minimal.speeds)] / own
    # States of parts, such as that of a controller, must keep still as well.
    alone = [k for i, k in scene.tangents.plain if i >= scene.equations.placing]
    slopes = np.vstack([slopes, (flow.shift[alone, :count] @ minimal.shift[:, :n]) * columns])
    return minimal, np.concatenate([accelerations, flow.variation.displacement_rates[alone]]), slopes


class RestSearch:
    """Seeks states of rest of one scene, and tells them apart.

    Parameters
    ----------
    scene, balance
        The scene, and its balance of forces, which puts places back on the constraints.
    t
        Time.
    kept
        Independent constraints.
    """

    def __init__(self, scene: LinearScene, balance: Balance, t: float, kept: Sequence[int]) -> None:
        self.scene, self.balance, self.t, self.kept = scene, balance, t, kept
        self.push, self.slope = 0.0, 0.0
        self._still = np.zeros(len(scene.sizes))
        self._configurations: dict[bytes, FloatArray] = {}
        self._heavy: set[int] | None = None

    def measure(self, places: Sequence[FloatArray]) -> None:
        """Note how large accelerations and their slopes are at places all over the region."""
        found = [one for one in map(self.at, places) if one is not None]
        self.push = max((one.push for one in found), default=0.0)
        self.slope = float(np.median([np.max(np.abs(one.slopes), initial=0.0) for one in found])) if found else 0.0

    def at(self, q: FloatArray, like: Minimal | None = None) -> Rest | None:
        """Return what there is at a place, put on the constraints; None where there is nothing to be had."""
        scene, still = self.scene, self._still
        try:
            with np.errstate(all="ignore"):
                q, _ = self.balance.project(self.t, q, still, scene.sizes)
                if self.balance.misses(self.t, q, still, scene.sizes)[0] > 1e-9:
                    return None
                flow = scene.flow(self.t, q, still, self.kept)
                minimal, a, slopes = slopes_at(scene, flow, self.kept, like)
        except (AtwoodError, ArithmeticError, np.linalg.LinAlgError):
            return None
        if not (np.all(np.isfinite(a)) and np.all(np.isfinite(slopes))):
            return None
        every = flow.variation.a
        square = float(every @ flow.variation.by["force", "a"] @ every)
        rates = a[len(minimal.speeds) :]  # of states of parts, which have no mass
        return Rest(q, flow, minimal, a, slopes, float(np.sqrt(max(square, 0.0) + rates @ rates)))

    def moved(self, one: Rest, by: FloatArray, most: float = np.inf) -> FloatArray:
        """Return coordinates after a displacement of the independent ones, scaled; none moves by more than a share."""
        sizes = self.scene.displacement_sizes
        moved = one.minimal.shift[:, : len(by)] @ (by * sizes[list(one.minimal.displacements)])
        largest = float(np.max(np.abs(moved) / sizes, initial=0.0))
        return self.scene.tangents.moved(one.q, moved * min(1.0, most / max(largest, 1e-300)))

    def stiffness(self, one: Rest) -> tuple[FloatArray, FloatArray]:
        """Return the mass matrix of the independent speeds, scaled, and the derivatives of the forces along them."""
        n, m = len(one.minimal.displacements), len(one.minimal.speeds)
        u = one.minimal.speed[:, n : n + m] * self.scene.sizes[list(one.minimal.speeds)]
        mass = u.T @ one.flow.variation.by["force", "a"] @ u
        return mass, np.vstack([mass @ one.slopes[:m], one.slopes[m:]])

    def is_met(self, one: Rest | None) -> bool:
        """Return whether nothing is accelerated, beside what is elsewhere."""
        return one is not None and one.push <= _MET * self.push

    def seek(self, q: FloatArray, steps: int = _STEPS, falls: bool = False) -> Rest | None:
        """Return a state of rest near a place; None if Newton's method finds none."""
        best, near, waiting, ratio = None, np.inf, 0, 0.0
        last: FloatArray = np.zeros(0)
        for _ in range(steps):
            now = self.at(q)
            if now is None:  # as in the singular place of angles that the search has come to
                break
            down = falling(now) if falls else None
            if down is None:
                down = -least_norm(now.slopes, now.accelerations)
            step = down
            length = float(np.max(np.abs(step), initial=0.0))
            waiting = 0 if best is None or now.push < 0.9 * best.push else waiting + 1
            if best is None or now.push <= best.push:
                best, near = now, length
            if (
                not now.push
                or length <= 1e-15
                or waiting > _PATIENCE
                or (waiting and length <= _NEAR and self.is_met(now))
            ):
                break
            share = float(step @ last) / float(last @ last) if len(last) == len(step) and np.any(last) else 0.0
            even = _SLOW[0] < share < _SLOW[1] and abs(share - ratio) < _EVEN * share
            even = even and float(np.max(np.abs(step - share * last))) < _EVEN * length
            last, ratio = (step[:0], 0.0) if even else (step, share)
            step = np.asarray(step / (1.0 - share) if even else step)
            step = np.asarray(step * min(1.0, _FAR / max(float(np.max(np.abs(step), initial=0.0)), 1e-300)))
            q = self.moved(now, step, 2.0 * _FAR)
        if falls and best is not None:
            return self.seek(best.q, _BACK)
        return best if self.is_met(best) and near <= _NEAR else None

    def stays(self, rest: Rest, later: Sequence[float]) -> bool:
        """Return whether a state stays at rest at other times: whether nothing that matters depends on time."""
        scene = self.scene
        size = float(np.max(np.abs(rest.slopes), initial=0.0)) or 1.0
        for time in later:
            flow = scene.flow(self.t + time, rest.q, self._still, self.kept)
            every = flow.variation.a
            square = float(every @ flow.variation.by["force", "a"] @ every)
            a = every / scene.sizes
            if (square > (1e-8 * self.push) ** 2 and float(np.max(np.abs(a), initial=0.0)) > 1e-8 * size) or np.any(
                np.abs(flow.variation.displacement_rates) > 1e-9 * scene.displacement_sizes
            ):
                return False
        return True

    # -- which are one ------------------------------------------------------------------------------------------------

    def configuration(self, q: FloatArray) -> FloatArray:
        """Return where all bodies are, m over the scene's length, and how they are turned; turns do not count."""
        key = q.tobytes()
        if key not in self._configurations:
            self._configurations[key] = self._configuration(q)
        return self._configurations[key]

    def _configuration(self, q: FloatArray) -> FloatArray:
        assembly = self.scene.assembly
        kernel = assembly.kernel(to_maximal(assembly, "regular"))
        places, speeds = (np.asarray(one, dtype=float) for one in kernel([self.t], q, self._still))
        if self._heavy is None:
            mass = to_array(balance_of(assembly, "dae").at(self.t, places, speeds).mass)
            self._heavy = {*map(int, np.flatnonzero(np.any(mass != 0.0, axis=1)))}
        # What has no mass, such as the marker of a place on a surface, may be anywhere.
        heavy, names, parts = self._heavy, assembly.maximal.names, [np.zeros(0)]
        for one in assembly.maximal.forest.attachments:
            if len(one.orientation) == 4 and heavy & set(one.spin):
                own = places[list(one.orientation)]
                parts.append(np.outer(own, own).ravel() / float(own @ own))  # a quaternion and its negative are one
            plain = zip(one.coordinates, one.speeds, strict=True)
            parts.append(places[[i for i, k in plain if k in heavy]] / self.scene.length)
        turned = [one.coordinate for one in assembly.maximal.forest.orientations if one.coordinate is not None]
        angles = places[[i for i in turned if names[i].unit == "rad"]]
        return np.concatenate([*parts, np.cos(angles), np.sin(angles)])

    def alike(self, first: FloatArray, second: FloatArray) -> bool:
        """Return whether all bodies are in the same places at two coordinates."""
        apart = self.configuration(first) - self.configuration(second)
        return bool(np.max(np.abs(apart), initial=0.0) < _SAME)

    def same(self, one: Rest, other: Rest) -> bool:
        """Return whether two states are one: the same configuration, or joined by states of rest."""
        now, last = one, np.inf
        for _ in range(_WALK):
            if self.alike(now.q, other.q):
                return True
            apart = wrapped(self.scene, difference(self.scene, now.q, other.q))
            own = list(now.minimal.displacements)
            scaled = apart[own] / self.scene.displacement_sizes[own]
            mass, stiffness = self.stiffness(now)
            flat = null_space(stiffness, _FLAT * self.slope * float(np.max(np.abs(mass), initial=1e-300))).T
            step = flat.T @ (flat @ scaled)
            way = float(np.linalg.norm(scaled))
            if now is one and len(flat) and float(np.max(np.abs(step))) < _TURNED * way:
                # The other end of a ring lies square to the way there.
                step = _TURNED * (step / np.linalg.norm(step) if np.any(step) else flat[0])
            elif float(np.max(np.abs(step), initial=0.0)) < _SAME or way > last - _NEARER:
                return False  # nothing leads there, or no nearer
            last = way
            # Along directions in which nothing changes, which need not be straight: a disc may stand at any heading.
            half, there = (self.at(self.moved(now, share * step)) for share in (0.5, 1.0))
            is_straight = self.is_met(half) and self.is_met(there)
            if not is_straight:
                step *= min(1.0, 0.5 * _FAR / float(np.max(np.abs(step))))
                there = self.seek(self.moved(now, step), _BACK)
            if there is None or not (is_straight or self._leads(now, there)):
                return False
            now = there
        return False

    def _leads(self, one: Rest, other: Rest) -> bool:
        """Return whether states near by are joined by rest: whether there is one about halfway between them."""
        apart = wrapped(self.scene, difference(self.scene, one.q, other.q))
        halfway = self.scene.tangents.moved(one.q, 0.5 * apart)
        between = self.seek(halfway, _BACK)
        if between is None:
            return False
        off = wrapped(self.scene, difference(self.scene, halfway, between.q))
        sizes = self.scene.displacement_sizes
        return bool(np.max(np.abs(off) / sizes) < _HALFWAY * np.max(np.abs(apart) / sizes))


def falling(now: Rest) -> FloatArray | None:
    """Return Newton's step with all curvatures taken as those of a minimum; None where they are not real."""
    if now.slopes.shape[0] != now.slopes.shape[1] or not len(now.slopes):
        return None
    values, vectors = np.linalg.eig(now.slopes)
    largest = float(np.max(np.abs(values)))
    if float(np.max(np.abs(values.imag))) > _FLAT * largest or np.linalg.cond(vectors) * _FLAT > 1.0:
        return None
    sizes = np.abs(values.real)
    share = np.where(sizes > _FLAT * largest, 1.0 / np.maximum(sizes, 1e-300), 0.0)
    return np.asarray((vectors @ (share * np.linalg.solve(vectors, now.accelerations.astype(complex)))).real)


def wrapped(scene: LinearScene, apart: FloatArray) -> FloatArray:
    """Return a displacement with its angles within half a turn."""
    for i, k in scene.tangents.plain:
        if scene.tangents.units[k] == "rad" and i < scene.equations.placing:
            apart[k] = (apart[k] + np.pi) % (2.0 * np.pi) - np.pi
    return apart


def difference(scene: LinearScene, first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the displacement from one place to another; of orientations the rotation vector in the body's axes."""
    found = np.zeros(len(scene.tangents))
    for i, k in scene.tangents.plain:
        found[k] = second[i] - first[i]
    for orientation, numbers in scene.tangents.orientation_coordinates:
        a, b = first[list(orientation.coordinates)], second[list(orientation.coordinates)]
        if len(a) == 2:
            found[numbers[0]] = np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b)
            continue
        w, v = float(a @ b), a[0] * b[1:] - b[0] * a[1:] - np.cross(a[1:], b[1:])
        if w < 0.0:
            w, v = -w, -v
        size = float(np.linalg.norm(v))
        found[list(numbers)] = (2.0 * np.arctan2(size, w) / size if size else 2.0 / max(w, 1e-300)) * v
    return found


_SOFT = 1e-6
"""Relative to stiffness elsewhere: below it a direction is looked at by its higher derivatives."""

_REACHES = (0.2, 0.05, 0.0125, 0.003)
"""How far the field is followed, in the scene's sizes: as far as a polynomial follows it."""

_NODES, _DEGREE = 17, 12
_ROUND, _TAIL = 1e-11, 1e-9
"""Relative to the largest coefficient, or value: what is rounding, and what shows that a polynomial does not follow."""

_REFINED = 4
"""So many steps of Newton's method lead to the root of the last derivative that is one."""

_RAYS, _CLEAR = 40, 1e-3
"""Directions of a null space of several dimensions, and by which share of the largest force all must lead back."""


class Degenerate(NamedTuple):
    """What higher derivatives say of a state of rest.

    Attributes
    ----------
    rest
        The state, moved to the root.
    family
        The number of directions along which rest goes on.
    verdict
        ``"stable"``, ``"unstable"`` or ``"undecided"``; empty where the linear model decides.
    beside
        Places of other roots that are near by, as on both sides of a pitchfork.
    """

    rest: Rest
    family: int
    verdict: str
    beside: tuple[FloatArray, ...] = ()


class _Field:
    """The reduced field of forces on the null space of the stiffness at a state of rest."""

    def __init__(self, search: RestSearch, rest: Rest) -> None:
        self.search, self.rest = search, rest
        mass, stiffness = search.stiffness(rest)
        self.size = float(np.max(np.abs(mass), initial=0.0)) * search.slope
        self.is_potential = float(np.max(np.abs(stiffness - stiffness.T), initial=0.0)) <= 1e-9 * self.size
        values, vectors = np.linalg.eigh(0.5 * (stiffness + stiffness.T))
        soft = np.abs(values) <= _SOFT * self.size
        self.null, self._held, self._inverse = vectors[:, soft], vectors[:, ~soft], 1.0 / values[~soft]
        self.rises = bool(np.any(values[~soft] > 0.0))  # forces lead away

    def at(self, along: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Return the coordinates and the forces on the null space at a displacement in it; None for none."""
        place = self.null @ along
        for _ in range(30):
            now = self.search.at(self.search.moved(self.rest, place), self.rest.minimal)
            if now is None:
                return None
            q = now.q
            force = self.search.stiffness(now)[0] @ now.accelerations
            step = -self._held @ (self._inverse * (self._held.T @ force))
            if float(np.max(np.abs(step), initial=0.0)) <= 1e-14:
                break
            place = place + step
        return q, np.asarray(self.null.T @ force)

    def line(self, axis: FloatArray) -> tuple[Polynomial, float] | None:
        """Return the force along an axis of the null space as a polynomial in shares of a reach, and the reach."""
        x = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
        for reach in _REACHES:
            found = [self.at(share * reach * axis) for share in x]
            if any(one is None for one in found):
                continue
            values = np.array([axis @ one[1] for one in found if one is not None])
            fitted = Chebyshev.fit(x, values, _DEGREE, domain=[-1.0, 1.0])
            largest = float(np.max(np.abs(fitted.coef)))
            rough = float(np.max(np.abs(fitted.coef[-2:])) + np.max(np.abs(fitted(x) - values)))
            if rough <= _TAIL * largest or largest <= _ROUND * self.size * reach:
                return fitted.convert(kind=Polynomial), reach
        return None


def follow_null_space(search: RestSearch, rest: Rest) -> Degenerate:
    """Return what higher derivatives say of a state of rest."""
    n = len(rest.minimal.displacements)
    if not n or n != len(rest.minimal.speeds) or rest.slopes.shape != (n, n):
        flat = n - rank(rest.slopes, _SOFT * search.slope) if n else 0
        return Degenerate(rest, flat, "")
    field = _Field(search, rest)
    count = field.null.shape[1]
    if not count:
        return Degenerate(rest, 0, "")
    rays = np.vstack([np.eye(count), np.random.default_rng(7).standard_normal((_RAYS * (count > 1), count))])
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    there = [(ray, field.at(sign * _REACHES[1] * ray)) for ray in rays for sign in (1.0, -1.0)]
    forces = np.array([one[1] for _, one in there if one is not None])
    if not len(forces):  # at a pole of angles
        return Degenerate(rest, 0, "")
    felt = decompose(forces, 10.0 * _ROUND * field.size * _REACHES[1])
    family = 0
    for axis in felt.null_space.T:  # along these no force ever acts; where nothing moves, coordinates are singular
        aside = field.at(_REACHES[0] * axis)
        family += aside is None or not search.alike(aside[0], rest.q)
    if not felt.rank:
        return Degenerate(rest, family, "")
    falls = "undecided" if _has_gyroscopic(search, rest) or not field.is_potential else "unstable"
    if felt.rank == 1:
        moved, order, sign, beside = _root(field, felt.right[0])
        if order <= 1:
            return Degenerate(moved, family, "undecided" if order < 0 else "", beside)
        verdict = ("stable" if field.is_potential else "undecided") if order % 2 and sign < 0.0 else falls
    else:
        signed = [((1.0, -1.0)[k % 2] * ray, one[1]) for k, (ray, one) in enumerate(there) if one is not None]
        moved, outward = rest, np.array([ray @ force for ray, force in signed])
        largest = float(np.max(np.abs(forces)))
        verdict = falls if np.max(outward) > _CLEAR * largest else "undecided"
        if np.max(outward) < -_CLEAR * largest and field.is_potential and felt.rank == count:
            verdict = "stable"
    return Degenerate(moved, family, falls if field.rises and verdict != "undecided" else verdict)


def _has_gyroscopic(search: RestSearch, rest: Rest) -> bool:
    """Return whether velocity terms act at rest that take no energy: an antisymmetric part beside rounding."""
    count, own = len(search.scene.tangents), list(rest.minimal.speeds)
    n = len(rest.minimal.displacements)
    sizes = search.scene.sizes
    mass, _ = search.stiffness(rest)
    by = rest.flow.acceleration[:, count : count + len(sizes)] @ rest.minimal.speed[:, n : n + len(own)]
    by = mass @ (by[own] / sizes[own][:, None] * sizes[own])
    unit = float(np.max(np.abs(mass), initial=0.0)) * np.sqrt(search.slope)
    return bool(np.max(np.abs(by - by.T), initial=0.0) > 1e-9 * unit)


def _root(field: _Field, axis: FloatArray) -> tuple[Rest, int, float, tuple[FloatArray, ...]]:
    """Return the state moved to the root on a line, its order, the sign of the force behind it, and other roots.

    The order is -1 where it is not known. Of other roots these are the places.
    """
    found = field.line(axis)
    if found is None:
        return field.rest, -1, 0.0, ()
    curve, reach = found
    largest = float(np.max(np.abs(curve.coef)))
    for order in range(7, 1, -1):  # beside a root of some order there is one of each lower order, nearly
        first, second = (curve.coef[k] for k in (order - 1, order))
        if abs(first) >= abs(second) or abs(second) <= 1e4 * _ROUND * largest:
            continue
        bend, slope, away = curve.deriv(order - 1), curve.deriv(order), 0.0
        for _ in range(_REFINED):
            away -= float(bend(away) / slope(away))
        if not abs(away) <= 0.1:
            continue
        shifted = curve(Polynomial([away, 1.0]))
        if float(np.max(np.abs(shifted.coef[:order]))) > _ROUND * largest:
            continue
        there = field.at(away * reach * axis)
        moved = None if there is None else field.search.at(there[0])
        better = moved is not None and moved.push <= max(field.rest.push, 1e-15 * field.search.push)
        return (moved if better and moved is not None else field.rest), order, float(second), ()
    every = np.asarray(curve.trim(_ROUND * largest).roots(), dtype=complex)
    inside = (np.abs(every.imag) < 1e-6 * np.abs(every)) & (np.abs(every) < 1.0)
    roots: list[float] = every.real[inside].tolist()
    places = [field.at(reach * x * axis) for x in roots]
    return field.rest, 1, 0.0, tuple(one[0] for one in places if one is not None)
