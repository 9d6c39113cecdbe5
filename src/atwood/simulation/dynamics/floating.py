"""Groups of bodies that float: nothing in them changes where all of them are moved alike.

Where such a group is, and how fast it moves as a whole, says nothing of how accurate its motion must be: its errors are
measured with its own extent, from a place that moves with it (Galilei's principle of relativity). Bodies that are
bound to the world, or feel a field that changes from place to place, do not float.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, jvp
from atwood.forms.assembly import Assembly
from atwood.forms.kept import Key
from atwood.mechanics.dynamics.equations import Equations

FAR = 10.0
"""A group that is farther away than so many of its extents is measured from a place that moves with it."""

_GROUPS: Key[list[tuple[int, ...]]] = Key("groups of bodies that may float")
_FLOATS: Key[bool] = Key("whether a group of bodies floats")


def _movable(assembly: Assembly, equations: Equations) -> list[tuple[int, ...]]:
    """Return the coordinates that grow alike where a group of bodies is moved along an axis, for each of both.

    Bodies that a part joins belong together. Their places are free, or on rails in the world.
    """

    def find() -> list[tuple[int, ...]]:
        mechanism, forest = assembly.mechanism, equations.forest
        group_of = list(range(len(mechanism.bodies.bodies)))
        for path, local in mechanism.locals_.items():
            bodies = (mechanism.bodies.body_of[mechanism.graph.node_of[path, one]] for one in local.connectors)
            joined = {group_of[one] for one in bodies if one}
            group_of = [min(joined) if one in joined else one for one in group_of]
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

    def find() -> bool:
        laws = [*equations.rows, *(one.value for one in equations.constraints if one.value is not None)]
        return all(one.is_zero for one in jvp(laws, _direction(equations, places)))

    return assembly.shared.get(_FLOATS, find, equations.forest.form, places)


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
