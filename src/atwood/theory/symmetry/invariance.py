"""Directions in which a family of quantities is conserved: the null space of their rates, as readable axes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from atwood.arrays import FloatArray
from atwood.numerics.matrices import least_norm
from atwood.numerics.rank import null_space, span
from atwood.theory.symmetry.states import KEPT, State

_ROUND = 1e-8
"""Components of directions this near to zero or one are these."""


def is_kept(states: Sequence[State], number: int) -> bool:
    """Return whether the rate of a quantity vanishes at all states."""
    return all(abs(one.rates[number]) <= KEPT * one.terms[number] for one in states)


def is_constant(values: FloatArray) -> bool:
    """Return whether a quantity has one value at all states, so that it says nothing."""
    return float(np.ptp(values)) <= KEPT * float(np.max(np.abs(values), initial=0.0)) if len(values) else True


def conserved_directions(states: Sequence[State], numbers: Sequence[int], units: FloatArray) -> FloatArray:
    """Return the combinations of quantities that are conserved, and not constant at all states."""
    own = list(numbers)
    rates = np.array([one.rates[own] for one in states]) / units
    terms = np.array([one.terms[own] for one in states]) / units
    rates = np.where(np.abs(rates) > KEPT * terms, rates, 0.0)
    rows = np.max(terms, axis=1, initial=0.0)
    kept = null_space(rates[rows > 0.0] / rows[rows > 0.0, None], np.full(int(np.sum(rows > 0.0)), KEPT))
    values = np.array([one.values[own] for one in states]) / units
    size = float(np.max(np.abs(values), initial=0.0)) or 1.0
    centred = (values - values.mean(axis=0)) / size @ kept
    centred[np.abs(centred) < KEPT] = 0.0
    silent = kept @ null_space(centred, np.full(len(centred), KEPT))
    # What is constant whatever happens is taken away from the rest, along the units that they are compared in.
    rest = kept - silent @ (silent.T @ kept)
    return np.asarray(span(rest, 0.5) / units[:, None])  # of a projection singular values are one or nothing


def about_center(
    states: Sequence[State], linear: Sequence[int], angular: Sequence[int], center: FloatArray, length: float
) -> tuple[list[State], FloatArray]:
    """Return total momenta with angular ones about another point than the origin, and how these are made of the first.

    Far away from the origin, what breaks a symmetry is little beside the angular momentum about it.
    """
    n, m, own = len(linear), len(angular), [*linear, *angular]
    matrix = np.eye(n + m)
    if m == 1:  # in the plane, counter-clockwise: r x p = x p_z - z p_x
        matrix[:n, n] = [center[1], -center[0]]
    elif m:
        x, y, z = center
        matrix[:n, n:] = -np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]).T
    found = []
    for one in states:
        terms = one.terms[own].copy()
        terms[n:] = length * np.max(terms[:n]) + 1e-4 * terms[n:]
        values, rates = one.values[own] @ matrix, one.rates[own] @ matrix
        found.append(replace(one, values=values, rates=rates, terms=terms, generators=one.generators[own]))
    return found, matrix


def readable_basis(columns: FloatArray) -> FloatArray:
    """Return a basis of the same space of vectors with as many zeros and ones as there can be.

    Coordinate axes where they are in it; else orthonormal vectors, the first of them in row echelon form, each with its
    largest component positive.
    """
    rows = _row_echelon(np.asarray(columns, dtype=float).T)
    if not np.all(np.sum(rows != 0.0, axis=1) <= 1):
        made: list[FloatArray] = []
        for row in rows:
            for other in made:
                row = row - (row @ other) * other
            made.append(row / np.linalg.norm(row))
        rows = np.array(made)
    rows = np.where(np.abs(rows) < _ROUND, 0.0, rows)
    rows = np.where(np.abs(np.abs(rows) - 1.0) < _ROUND, np.sign(rows), rows)
    largest = np.argmax(np.round(np.abs(rows), 9), axis=1)
    signs = np.sign(rows[np.arange(len(rows)), largest])
    return np.asarray((rows * signs[:, None]).T)


def _row_echelon(rows: FloatArray) -> FloatArray:
    rows, row = rows.copy(), 0
    for column in range(rows.shape[1]):
        if row == len(rows):
            break
        pivot = row + int(np.argmax(np.abs(rows[row:, column])))
        if abs(rows[pivot, column]) <= _ROUND * float(np.max(np.abs(rows), initial=0.0)):
            continue
        rows[[row, pivot]] = rows[[pivot, row]]
        rows[row] /= rows[row, column]
        for other in range(len(rows)):
            if other != row:
                rows[other] -= rows[other, column] * rows[row]
        row += 1
    rows = np.where(np.abs(rows) < _ROUND, 0.0, rows)
    return np.asarray(rows)


_NOTHING = 1e-8
"""Relative: rotations this small are none."""


def straight_of(kept: FloatArray, count: int) -> FloatArray:
    """Return the translations among rigid motions, as columns."""
    turning = kept[count:]
    if not turning.size:
        return readable_basis(kept[:count])
    moved = kept[:count] @ null_space(turning, _NOTHING * float(np.max(np.abs(kept))))
    return readable_basis(moved) if moved.shape[1] else moved


def rotations_of(kept: FloatArray, count: int, straight: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield the rotations among rigid motions: the angular velocity, and the velocity of the origin.

    Of these there is one for each direction that a rotation can have; translations are taken out of them.
    """
    turning = kept[count:]
    if not turning.size:
        return
    axes = span(turning, _NOTHING * float(np.max(np.abs(kept))))
    if not axes.shape[1]:
        return
    flat = np.linalg.qr(straight)[0] if straight.shape[1] else straight
    for axis in readable_basis(axes).T:
        weights = least_norm(turning, axis, errors=_NOTHING)
        about = kept[:count] @ weights
        about = about - flat @ (flat.T @ about)
        size = float(np.max(np.abs(kept[:count] @ np.diag(weights)), initial=0.0))
        yield axis, np.where(np.abs(about) > _NOTHING * size, about, 0.0)


def planar_point(axis: FloatArray, about: FloatArray) -> FloatArray:
    """Return the point of the plane x, z that a rotation leaves where it is, with y = 0."""
    # Counter-clockwise as seen on the page: x' = -w (z - p_z), z' = w (x - p_x).
    return np.array([-about[1] / axis[0], 0.0, about[0] / axis[0]])


def axis_name(axis: FloatArray) -> str:
    """Return ``.x`` and the like for an axis of the world, else its components in brackets."""
    values = [*map(float, axis)]
    if sum(map(bool, values)) == 1 and max(values) == 1.0:
        return "." + "xyz"[values.index(1.0)]
    return f"[{','.join(f'{value:.4g}' for value in values)}]"


def axis_text(axis: FloatArray) -> str:
    """Return x, y or z for an axis of the world, else its components in brackets."""
    name = axis_name(axis)
    return name[1:] if name.startswith(".") else f"({', '.join(f'{value:.6g}' for value in axis)})"
