"""Quantities of a scene that may be conserved, as expressions: momenta, the energy function, total momenta, boosts.

Total momenta are those of Noether's theorem for motions of the whole scene as a rigid body: a velocity field
``v + omega x r`` that is added to all velocities changes L by ``P . v + L . omega`` to first order. Of scenes in
magnetic fields these are the canonical momenta ``m v + e A``.

Of a family of such quantities some combinations are conserved: the null space of their rates, as readable axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, affine_coefficients, evaluate, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import Lagrangian, lagrangian_of
from atwood.forms.quantities import to_maximal
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.kinematics.mechanism import extent
from atwood.mechanics.kinematics.orientation import spin_in_world
from atwood.mechanics.outputs.totals import add_up
from atwood.numerics.matrices import least_norm
from atwood.numerics.rank import null_space, span
from atwood.simulation.initialization.start import find_start, start_in_maximal
from atwood.theory.symmetry.states import KEPT, State
from atwood.topology.spanning_forest import Attachment


@dataclass(frozen=True)
class Motions:
    """Total momenta and first moments of mass, along the axes that the scene has.

    Attributes
    ----------
    axes
        Names of the axes.
    momentum
        Total momentum along each, kg*m/s.
    turns
        Names of the axes of rotation: x, y, z in space; none in the plane, where there is one, counter-clockwise.
    angular_momentum
        Total angular momentum about the origin, kg*m^2/s.
    moments
        ``sum m r`` along each axis, kg*m; empty where momenta are not those of masses alone.
    spins
        For each body that turns in space, its angular momentum about its own centre, in world axes.
    """

    axes: tuple[str, ...]
    momentum: tuple[Expression, ...]
    turns: tuple[str, ...]
    angular_momentum: tuple[Expression, ...]
    moments: tuple[Expression, ...]
    spins: Mapping[str, tuple[Expression, ...]]


@dataclass(frozen=True, eq=False)
class Quantities:
    """The quantities of an assembly that may be conserved, on the symbols of its Lagrangian.

    Attributes
    ----------
    assembly
        The scene; generalized coordinates are those of its reduced form.
    found
        Its Lagrangian in these.
    """

    assembly: Assembly
    found: Lagrangian

    @cached_property
    def momenta(self) -> tuple[Expression, ...]:
        """The momenta ``dL/dq'``; of an angular velocity, the angular momentum in the axes of the body."""
        return self.found.momenta

    @cached_property
    def energy_function(self) -> Expression:
        """The energy function ``h = sum p q' - L`` (Goldstein, equation 2.53)."""
        found = self.found
        pairs = zip(self.momenta, found.velocities, strict=True)
        return add_up([found.graph.zero, *(p * u for p, u in pairs)]) - found.lagrangian

    @cached_property
    def total_energy(self) -> Expression:
        """T + V."""
        return self.found.kinetic + self.found.potential

    @cached_property
    def motions(self) -> Motions:
        """Total momenta along the axes of the scene."""
        assembly, space = self.assembly, self.assembly.mechanism.space
        whole = lagrangian_of(assembly, "dae")
        forest, graph = assembly.maximal.forest, whole.graph
        p = whole.momenta
        count = len(space.basis)
        momentum = [graph.zero] * count
        spins = [graph.zero] * (3 if space.is_spatial else int(space.is_planar))
        kinematics = assembly.maximal.kinematics
        names = {tuple(one.speeds): one.body for one in assembly.maximal.orientation_coordinates}
        own_spins: dict[str, list[Expression]] = {}
        for one in forest.attachments:
            if len(one.speeds) == count:
                own, r = [p[k] for k in one.speeds], self._in_world([whole.coordinates[k] for k in one.coordinates])
                momentum = [a + b for a, b in zip(momentum, own, strict=True)]
                spins = [a + b for a, b in zip(spins, _about_origin(r, own), strict=True)]
            if one.spin:
                axes = kinematics.placements.axes[one.body]
                turned = own_spins[names[tuple(one.spin)]] = list(spin_in_world([p[k] for k in one.spin], axes))
                spins = [a + b for a, b in zip(spins, turned, strict=True)]
        for turn in forest.orientations:
            if turn.coordinate is not None and space.is_planar:
                spins[0] = spins[0] + p[turn.coordinate]
        free = [one for one in forest.attachments if len(one.speeds) == count]
        places = [self._in_world([whole.coordinates[k] for k in one.coordinates]) for one in free]
        moments = _first_moments(whole, momentum, free, places, assembly.parameters)
        flat = [value for turned in own_spins.values() for value in turned]
        every = self._in_generalized([*momentum, *spins, *moments, *flat])
        turns = {"space": ("x", "y", "z"), "plane": ("",)}.get(space.name, ())
        n, m, k = count, count + len(spins), count + len(spins) + len(moments)
        turned_of = {body: tuple(every[k + 3 * i : k + 3 * i + 3]) for i, body in enumerate(own_spins)}
        return Motions(space.axis_names, tuple(every[:n]), turns, tuple(every[n:m]), tuple(every[m:k]), turned_of)

    @cached_property
    def center(self) -> tuple[FloatArray, float]:
        """Mean place of the bodies at the start, along the axes of the scene, and the size of the scene about it, m."""
        assembly, start = self.assembly, find_start(self.assembly)
        places, _ = start_in_maximal(assembly, start)
        count = len(assembly.mechanism.space.basis)
        origin = evaluate(list(assembly.mechanism.table.origin), assembly.mechanism.table.values)
        every = [places[list(one.coordinates)] for one in assembly.maximal.forest.attachments]
        free = [one for one in every if len(one) == count]
        if not free:
            return np.zeros(count), start.length
        middle = np.mean(free, axis=0)
        apart = float(np.max(np.linalg.norm(np.array(free) - middle, axis=1)))
        middle += origin or 0.0
        return middle, max(extent(assembly.mechanism), apart) or start.length

    def _in_world(self, place: Sequence[Expression]) -> list[Expression]:
        """Return a position from the world's origin, along the axes of the scene."""
        origin = self.assembly.mechanism.table.origin
        return [o + p for o, p in zip(origin, place, strict=True)] if origin else list(place)

    def _in_generalized(self, values: Sequence[Expression]) -> list[Expression]:
        """Return expressions of maximal coordinates in terms of generalized ones and their velocities."""
        assembly, maximal = self.assembly, self.assembly.maximal
        places, speeds = (group.expressions for group in to_maximal(assembly).outputs)
        where: dict[Expression, Expression | float] = dict(zip(maximal.coordinates, places, strict=True))
        where |= dict(zip(maximal.speeds, speeds, strict=True))
        return substitute(substitute(list(values), where), self._turned)

    @property
    def _turned(self) -> Mapping[Expression, Expression]:
        pairs = zip(self.found.equations.speeds, self.found.speeds, strict=True)
        return {u: value for u, value in pairs if u is not value}

    def on_speeds(self, values: Sequence[Expression]) -> list[Expression]:
        """Return expressions of velocities in terms of the speeds that states have: angular ones in body axes."""
        found = self.found
        own = zip(found.velocities, found.moves, found.equations.speeds, strict=True)
        rates = found.equations.rates
        where = {v: rates[place] for v, place, u in own if v is not u and place is not None}
        return substitute(list(values), where) if where else list(values)


def _about_origin(r: Sequence[Expression], p: Sequence[Expression]) -> list[Expression]:
    """Return r x p; in the plane x, z its component counter-clockwise as seen on the page."""
    if len(r) == 3:
        return [r[1] * p[2] - r[2] * p[1], r[2] * p[0] - r[0] * p[2], r[0] * p[1] - r[1] * p[0]]
    return [r[0] * p[1] - r[1] * p[0]] if len(r) == 2 else []


def _first_moments(
    whole: Lagrangian,
    momentum: Sequence[Expression],
    free: Sequence[Attachment],
    places: Sequence[Sequence[Expression]],
    parameters: Sequence[Expression],
) -> list[Expression]:
    """Return ``sum m r`` along each axis; nothing where momentum is not the sum of masses times velocities."""
    found = []
    for k, total in enumerate(momentum):
        taken = affine_coefficients(total, [whole.velocities[one.speeds[k]] for one in free], parameters)
        if taken is None or not taken[1].is_zero:
            return []
        along = (place[k] for place in places)
        found.append(add_up([whole.graph.zero, *(m * r for m, r in zip(taken[0], along, strict=True))]))
    return found


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
    rows = row_echelon(np.asarray(columns, dtype=float).T)
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


def row_echelon(rows: FloatArray) -> FloatArray:
    """Return rows of the same span, each with a one where the others have none, as far to the left as can be."""
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
