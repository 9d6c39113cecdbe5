"""Sizes of a scene: what counts as small for each coordinate, speed and force.

A group of bodies floats if nothing in it changes where all of them are moved alike. Where it is, and how fast it moves
as a whole, says nothing of how accurate its motion must be: its errors are measured with its own extent, from a place
that moves with it (Galilei's principle of relativity). Bodies that are bound to the world, or feel a field that changes
from place to place, do not float.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.expr import Expression, InputGroup, OutputGroup, Program, depends_on, evaluate, jacobian, jvp
from atwood.forms.assembly import Assembly, FormName
from atwood.forms.caches import Key
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.constraints.knots import BALANCES
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.kinematics.mechanism import extent
from atwood.mechanics.outputs.observables import Observable
from atwood.model.values.units import ALONG, parse_unit
from atwood.numerics.matrices import or_one
from atwood.topology.graph import connected_groups
from atwood.topology.spanning_forest import Coordinate

Sizes: TypeAlias = "FloatArray | float"
"""Of one scene, or of many."""


@dataclass(frozen=True)
class Scales:
    """Sizes of a scene.

    Attributes
    ----------
    length
        Extent of the scene, m.
    time
        Time in which something happens, s.
    force
        Size of a force, N.
    contacts
        Sizes of forces of gaps and slips by part and law, where these are known by themselves.
    """

    length: float
    time: float
    force: float
    contacts: Mapping[tuple[str, str], float] | None = None

    def of_law(self, part: str, law: str, unit: str) -> float:
        """Return the size of what a law of a part tells: of a gap or a slip, with a unit of forces, of its own."""
        whole = self.of(unit)
        return min(whole, (self.contacts or {}).get((part, law), whole)) if unit in ALONG else whole

    def of(self, unit: str) -> float:
        """Return the size of a quantity by the powers of mass, length and time in its SI unit; of an angle, one."""
        return float(size_of(unit, self.length, self.time, self.force * self.time**2 / self.length))


def size_of(unit: str, length: Sizes, time: Sizes, mass: Sizes) -> Sizes:
    """Return the size of a quantity for one scene or for many, by the powers in its SI unit; of an angle, one."""
    masses, lengths, times, _ = parse_unit(unit).exponents
    return mass**masses * length**lengths * time**times


_NO_EXTENT = 1e-12
"""Of the way of the fastest in the time of the scene: positions that are less are where they are by rounding."""


def scene_length(assembly: Assembly) -> float:
    """Return the extent of a scene, from its parameters and start values that are lengths.

    A scene without lengths is as large as its start speeds lead it, or as a fall does, and 1 m where these are longer
    or nothing; a run may tell that it is smaller, see `smaller_size`.
    """
    return own_length(assembly) or float(size_of_way(way_of(assembly, _fastest(assembly))))


_OWN_LENGTH: Key[float] = Key("its extent, from what is said of it")


def own_length(assembly: Assembly) -> float:
    """Return the extent of a scene from its parameters and start values that are lengths, m; 0 if these say nothing.

    Positions of a mechanism far from the world's origin count from where all others do, those of bodies that float far
    from it from each other. Positions alone that are rounding beside the way that the speeds lead are none.
    """
    return assembly.kept.get(_OWN_LENGTH, lambda: _own_length(assembly))


def _own_length(assembly: Assembly) -> float:
    given = []
    for path, value in assembly.flat.start.items():
        observable = assembly.start_observables.get(path)
        if observable is not None and observable.unit == "m":
            given.append((observable.value, value - origin_part(assembly, observable)))
    own, farthest = extent(assembly.mechanism), max((abs(at) for _, at in given), default=0.0)
    if farthest > FAR * own:
        near = max(own, spread(assembly, given))
        if farthest > FAR * near:
            return near
    is_rounding = not own and farthest < _NO_EXTENT * way_of(assembly, _fastest(assembly))
    return 0.0 if is_rounding else max(own, farthest)


def _fastest(assembly: Assembly) -> float:
    """Return the largest of the start values that are speeds, m/s."""
    known = assembly.start_observables
    fast = (abs(v) for path, v in assembly.flat.start.items() if path in known and known[path].unit == "m/s")
    return max(fast, default=0.0)


TOO_LARGE = 1e-2
"""A scene without lengths that moves by less than this share of its size is run again with the size of its motion."""

_ROUNDING = 1e-8
"""Of the largest coordinate: tolerances of a smaller motion are near its rounding."""


def smaller_size(length: float, passed: Iterable[tuple[Sequence[Coordinate], FloatArray]]) -> float:
    """Return the size that a scene without lengths shows by its motion, m; 0 where its size has been right.

    Parameters
    ----------
    length
        The size that it was run with, m.
    passed
        Coordinates of stretches of the run: what they are called, and their values, shape (number, samples).
    """
    least: dict[str, float] = {}
    most: dict[str, float] = {}
    for names, rows in passed:
        for one, lowest, highest in zip(names, rows.min(axis=1).tolist(), rows.max(axis=1).tolist(), strict=False):
            if one.unit == "m":
                least[one.name] = min(least.get(one.name, np.inf), lowest)
                most[one.name] = max(most.get(one.name, -np.inf), highest)
    moved = max((most[one] - least[one] for one in most), default=0.0)
    farthest = max((max(abs(least[one]), abs(most[one])) for one in most), default=0.0)
    return moved if max(_NO_EXTENT * length, _ROUNDING * farthest) < moved < TOO_LARGE * length else 0.0


def way_of(assembly: Assembly, fastest: Sizes) -> Sizes:
    """Return how far start speeds, or gravity, lead in the time of a scene, m."""
    span = assembly.flat.t_end - assembly.flat.t_start
    return np.maximum(fastest, gravity_of(assembly) * span) * span


def size_of_way(way: Sizes) -> FloatArray:
    """Return the size of a scene without lengths, m: what speeds and gravity lead it, and 1 m at most."""
    return or_one(np.minimum(way, 1.0))


def gravity_of(assembly: Assembly) -> float:
    """Return the acceleration of gravity of a scene, m/s^2; 0 where it has none."""
    return abs(next((v for s, v in assembly.mechanism.table.values.items() if s.name == "gravity"), 0.0))


def origin_part(assembly: Assembly, observable: Observable) -> float:
    """Return the part of a quantity that is only where positions are counted from; 0 at the world's own origin."""
    mechanism = assembly.mechanism
    shift = sum((one for one in mechanism.table.origin if depends_on(observable.value, [one])), 0.0)
    return float(evaluate([mechanism.table.graph.convert(shift)], mechanism.table.values)[0])


def coordinate_scales(equations: Equations, length: Sizes) -> FloatArray:
    """Return the size of each coordinate: the extent for a length, 1 rad for an angle, else one; or rows of these."""
    nominal = {i: one.nominal for i, one in enumerate(equations.states, start=equations.placing) if one.nominal}
    own = np.array([nominal.get(i, 1.0) for i in range(len(equations.names))])
    is_extent = [one.unit == "m" and i not in nominal for i, one in enumerate(equations.names)]
    return np.where(np.array(is_extent, dtype=bool), np.asarray(length)[..., None], own)


def motion_scales(equations: Equations, length: Sizes) -> FloatArray:
    """Return the size of a displacement along each speed: the extent, or one radian; see `coordinate_scales`."""
    is_extent = np.array([one.unit == "m/s" for one in equations.speed_names], dtype=bool)
    return np.where(is_extent, np.asarray(length)[..., None], 1.0)


def is_length(equations: Equations, key: tuple[str, str, int]) -> bool:
    """Return whether a constraint misses by a length: then its multiplier is a force, else a torque."""
    return multiplier_unit(equations, key) == "N"


def multiplier_unit(equations: Equations, key: tuple[str, str, int]) -> str:
    """Return the unit of a constraint's multiplier."""
    if key[1] in BALANCES:
        return BALANCES[key[1]]
    local = equations.locals_[key[0]]
    return next(str(c.law.options.unit) for c in local.constraints if c.law.name == key[1])


def multiplier_sizes(assembly: Assembly, form: FormName) -> FloatArray:
    """Return the size of each constraint's multiplier beside that of a force: for a moment, the extent.

    Unlike the size of a displacement, it does not depend on where the scene starts. Where a constraint is neither in
    lengths nor in angles, its multiplier counts by its own powers of a length.
    """
    length = extent(assembly.mechanism) or scene_length(assembly)
    equations = assembly.in_coordinates(form)
    found = [multiplier_unit(equations, one.key) for one in equations.constraints]
    # A force is of one power of a length.
    return np.array([length ** (parse_unit(unit).exponents[1] - 1) for unit in found])


def motion_names(equations: Equations) -> tuple[str, ...]:
    """Return what moves with each speed: a coordinate, or the speed's own name where none does so alone."""
    alone = dict(zip(equations.rates[: equations.placing], equations.names, strict=False))
    return tuple(
        alone[speed].name if speed in alone else one.name
        for speed, one in zip(equations.speeds, equations.speed_names, strict=True)
    )


def find_scales(
    assembly: Assembly,
    length: float,
    speeds: FloatArray,
    accelerations: FloatArray,
    sizes: FloatArray,
    span: float,
) -> Scales:
    """Return the sizes of a scene from its start."""
    time = float(find_times(length, speeds, accelerations, sizes, gravity_of(assembly), span))
    return Scales(length, time, float(total_masses(assembly, length)) * length / time**2)


_MASSES: Key[Program] = Key("masses")


def find_times(
    length: Sizes, speeds: FloatArray, accelerations: FloatArray, sizes: FloatArray, gravity: Sizes, span: float
) -> FloatArray:
    """Return in what time something happens, s: speeds, accelerations or gravity lead as far as the sizes."""
    with np.errstate(divide="ignore", invalid="ignore"):
        falling = np.sqrt(np.asarray(length) / np.abs(gravity))
        times = [np.full((*falling.shape, 1), span), falling[..., None]]
        times += [sizes / np.abs(speeds), np.sqrt(sizes / np.abs(accelerations))]
    every = np.concatenate(times, axis=-1)
    return _without_rounding(np.min(np.where(every > 0.0, every, np.inf), axis=-1))


def _without_rounding(sizes: FloatArray) -> FloatArray:
    """Return sizes to 34 bits: one run and many work them out in other ways, and are to go on with the same."""
    share, power = np.frexp(sizes)
    return np.asarray(np.ldexp(np.round(np.ldexp(share, 34)), power - 34))


def total_masses(assembly: Assembly, lengths: Sizes, rows: FloatArray | None = None) -> FloatArray | float:
    """Return the mass of all that moves, at the start, kg; where only shafts turn, that which has their moments there.

    Of what has neither it is 1 kg.
    """
    if rows is None:
        every = [sum(one) for one in assembly.kernel(_masses(assembly))([assembly.flat.t_start])]
    else:
        kernel = assembly.compiled(_masses(assembly), vectorized=True).bind(rows.T)
        every = [np.sum(one, axis=0) for one in kernel(np.full((1, len(rows)), assembly.flat.t_start))]
    masses, moments = map(np.asarray, every)
    found = _without_rounding(or_one(np.where(masses > 0.0, masses, moments / np.square(lengths))))
    return found if np.ndim(found) else float(found)


def _masses(assembly: Assembly) -> Program:
    def make() -> Program:
        masses, graph = assembly.own_equations.masses, assembly.mechanism.table.graph
        found = [graph.convert(one.mass) for one in masses.bodies.values()]
        found += [graph.convert(m) for one in masses.coupled for row in one.masses for m in row]
        found += [graph.convert(one.mass) for _, one in masses.varying]
        turning = [one.moment for one in masses.bodies.values()]
        moments = [row[i] for one in turning if isinstance(one, tuple) for i, row in enumerate(one)]
        moments += [one for one in turning if not isinstance(one, tuple)]
        time = InputGroup("t", (assembly.mechanism.time,))
        groups = OutputGroup("masses", tuple(found)), OutputGroup("moments", tuple(map(graph.convert, moments)))
        return Program("masses", (time,), assembly.parameters, groups)

    return assembly.shared.get(_MASSES, make)


FAR = 10.0
"""A group that is farther away than so many of its extents is measured from a place that moves with it."""

_GROUPS: Key[list[tuple[int, ...]]] = Key("groups of bodies that may float")
_FLOATS: Key[frozenset[tuple[int, ...]]] = Key("groups of bodies that float")


def _movable(assembly: Assembly, equations: Equations) -> list[tuple[int, ...]]:
    """Return the coordinates that grow alike where a group of bodies is moved along an axis, for each of both.

    Bodies that a part joins belong together. Their places are free, or on rails in the world.
    """

    def find() -> list[tuple[int, ...]]:
        mechanism, forest = assembly.mechanism, equations.forest
        pairs: list[tuple[int, int]] = []
        for path, local in mechanism.locals_.items():
            bodies = (mechanism.bodies.body_of[mechanism.graph.node_of[path, one]] for one in local.connectors)
            pairs += pairwise(one for one in bodies if one)
        groups = connected_groups(range(len(mechanism.bodies.bodies)), pairs)
        group_of = {body: number for number, group in enumerate(groups) for body in group}
        number = {one.name.partition(" from ")[0]: i for i, one in enumerate(equations.names)}
        found: dict[tuple[int, int], list[int]] = {}
        for one in forest.attachments:
            if one.joint is None or mechanism.bodies.body_of[one.parent] == 0:
                for axis, k in enumerate(one.coordinates):
                    if forest.coordinates[k].unit == "m":
                        place = number.get(forest.coordinates[k].name, -1)
                        found.setdefault((group_of[one.body], axis), []).append(place)
        return [tuple(places) for places in found.values() if -1 not in places]

    return assembly.shared.get(_GROUPS, find, equations.forest.form)


def _floats(assembly: Assembly, equations: Equations, places: tuple[int, ...]) -> bool:
    """Return whether nothing changes where coordinates all grow alike, and others stay."""

    def find() -> frozenset[tuple[int, ...]]:
        kept = (*equations.constraints, *(one.row for one in equations.contacts))
        laws = [*equations.rows, *(one.value for one in kept if one.value is not None)]
        groups = _movable(assembly, equations)
        bound = set(jacobian(laws, [_direction(equations, group) for group in groups]).columns)
        return frozenset(group for number, group in enumerate(groups) if number not in bound)

    return places in assembly.shared.get(_FLOATS, find, equations.forest.form)


def _direction(equations: Equations, places: Sequence[int]) -> Mapping[Expression, Expression | float]:
    return {equations.coordinates[i]: 1.0 for i in places}


def spread(assembly: Assembly, given: Sequence[tuple[Expression, float]]) -> float:
    """Return the largest of given lengths, where places in one floating group count from each other, m."""
    largest, rest = 0.0, list(given)
    one = assembly.mechanism.table.graph.constant(1.0)
    for places in _movable(assembly, assembly.regular):
        if not _floats(assembly, assembly.regular, places):
            continue
        moved = jvp([value for value, _ in rest], _direction(assembly.regular, places))
        inside = [at for slope, (_, at) in zip(moved, rest, strict=True) if slope is one]
        rest = [each for slope, each in zip(moved, rest, strict=True) if slope is not one]
        largest = max(largest, max(inside, default=0.0) - min(inside, default=0.0))
    return max(largest, max((abs(at) for _, at in rest), default=0.0))


def floating_alone(assembly: Assembly) -> NDArray[np.intp]:
    """Return the speeds along which a group of bodies that floats moves as a whole, each alone along its axis."""
    equations = assembly.regular
    speeds = {one: i for i, one in enumerate(equations.speeds)}
    groups = (one for one in _movable(assembly, equations) if len(one) == 1 and _floats(assembly, equations, one))
    found = (speeds.get(equations.rates[place], -1) for (place,) in groups)
    return np.array([one for one in found if one >= 0], dtype=np.intp)


def seen_from_afar(
    assembly: Assembly, q: FloatArray, u: FloatArray, length: float, span: float
) -> tuple[float, FloatArray]:
    """Return the share of a position's tolerance that is relative to the extent, and speeds without drift."""
    equations, farthest, own = assembly.own_equations, 0.0, u.copy()
    known = {one: i for i, one in enumerate(equations.speeds)}
    for places in _movable(assembly, equations):
        speeds = [known[one] for i in places if (one := equations.rates[i]) in known]
        drift = float(np.mean(u[speeds])) if speeds else 0.0
        away = abs(float(np.mean(q[list(places)]))) + span * abs(drift)
        if away > FAR * length and _floats(assembly, equations, places):
            own[speeds] -= drift
            farthest = max(farthest, away)
    return (length / farthest if farthest else 1.0), own
