"""A field of gravity that varies in place and time: each inertia in it has an energy, where it is."""

from __future__ import annotations

from collections.abc import Iterable

from atwood.expr import Expression, Graph, Scalar
from atwood.model.declare.contributions import BodyInertia, PointInertia
from atwood.model.declare.function_values import Function
from atwood.model.values.vector import Vector

__all__ = ["energies_in"]


def energies_in(
    field: Function | None, inertias: Iterable[PointInertia | BodyInertia], time: Expression, graph: Graph
) -> tuple[Expression, ...]:
    """Return the energies that a part's inertias have in a scene's field of gravity.

    A rigid body has it at its centre of mass; of points that share their mass (a rod's ends) each has its half.

    Parameters
    ----------
    field
        Energy of a kilogram as a function of x, y, z and t; None where there is no field.
    inertias
        What the part's inertia laws gave.
    time
        The symbol of time.
    graph
        Where expressions live.
    """
    if field is None or field.is_zero:
        return ()
    found: list[Scalar] = []
    for one in inertias:
        if isinstance(one, PointInertia):
            found += [
                sum(row) * _at(field, point.position, time) for point, row in zip(one.points, one.masses, strict=True)
            ]
        else:
            place = one.frame.position + one.frame.to_world(one.center_of_mass)
            found.append(one.mass * _at(field, place, time))
    made = [graph.convert(energy) for energy in found]
    return tuple(energy for energy in made if not energy.is_zero)


def _at(field: Function, place: Vector, time: Expression) -> Scalar:
    return field(place.x, place.y, place.z, time)
