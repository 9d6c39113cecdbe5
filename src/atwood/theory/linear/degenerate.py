"""Rest at which the linear model decides nothing: directions without stiffness, followed by higher derivatives.

Along the null space of the stiffness, with all else in balance, the forces are a reduced field of as many components
(Lyapunov and Schmidt; Golubitsky and Schaeffer, Singularities and Groups in Bifurcation Theory I, section 1.3). Where
it is zero the state is one of a family. On a line it is a polynomial through samples: the first coefficient that is not
rounding is the order of the root, and the one before says where the root is. Rest is stable where the effective
potential has a strict minimum (Lagrange and Dirichlet), whatever dampers and gyroscopic forces do; where it falls, only
gyroscopic forces can help, and forces without a potential are not decided.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from atwood.arrays import FloatArray
from atwood.numerics.rank import decompose, rank
from atwood.theory.linear.rest import Rest, RestSearch

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
        moved, outward = rest, np.array([ray @ one[1] for ray, one in _signed(there)])
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


def _signed(
    there: list[tuple[FloatArray, tuple[FloatArray, FloatArray] | None]],
) -> list[tuple[FloatArray, tuple[FloatArray, FloatArray]]]:
    return [((1.0, -1.0)[k % 2] * ray, one) for k, (ray, one) in enumerate(there) if one is not None]


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
