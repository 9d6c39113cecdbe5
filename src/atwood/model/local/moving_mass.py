"""Energies of inertia on local symbols: of mass that changes in time, of Lagrangians, and in fields of gravity."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from atwood.errors import DeclarationError, UnsupportedError
from atwood.expr import Expression, Graph, Scalar, depends_on, vjp
from atwood.model.declare.function_values import Function
from atwood.model.declare.law_results import BodyInertia, PointInertia
from atwood.model.local.parts import LocalConnector
from atwood.model.values.space import Vector, cross, dot

Inertia = PointInertia | BodyInertia


def check_lagrangians(
    path: str,
    lagrangians: Sequence[Expression],
    connectors: Sequence[LocalConnector],
    linked: Collection[Expression],
) -> None:
    """Refuse Lagrangians whose momenta have no rate: of linked inputs, or with switches by the clock."""
    velocities = [symbol for one in connectors for symbol in (*one.velocity, *one.spin)]
    for value in lagrangians:
        if depends_on(value, linked):
            raise UnsupportedError(
                "a Lagrangian follows the output of another component, whose rate is not known",
                where=path,
                advice="Give the input a function of time, or read a connector instead.",
            )
        relations = value.graph.relations
        switches = () if relations is None else relations.symbols
        momenta = vjp([value], [value.graph.constant(1.0)], velocities) if switches else []
        if depends_on(momenta, switches):
            raise UnsupportedError(
                "the momenta of a Lagrangian switch by the clock, which would be an impact",
                where=path,
                advice="Let them change smoothly, or write what switches as a @force.",
            )


def find_varying(
    path: str,
    inertias: Iterable[Inertia],
    connectors: Sequence[LocalConnector],
    linked: Collection[Expression],
    graph: Graph,
) -> tuple[Inertia, ...]:
    """Return the inertias that change with time."""
    moving = [s for one in connectors for s in (*one.position, *one.velocity, *one.orientation, *one.spin)]
    clock = () if graph.relations is None else graph.relations.roots
    found = []
    for one in inertias:
        values = [graph.convert(value) for value in _values(one)]
        if any(depends_on(value, [*moving, *linked]) for value in values if not value.is_parametric):
            raise DeclarationError(
                "inertia depends on parameters and time alone",
                where=path,
                advice="Write kinetic energy that depends on positions or joint coordinates as a @lagrangian.",
            )
        center = [] if isinstance(one, PointInertia) else [graph.convert(c) for c in one.center_of_mass]
        if any(depends_on(value, clock) for value in center if not value.is_parametric):
            raise DeclarationError(
                "a centre of mass does not move within its body",
                where=path,
                advice="Use two bodies, one of which is moved by a drive.",
            )
        if any(depends_on(value, clock) for value in values if not value.is_parametric):
            found.append(one)
    return tuple(found)


def _values(one: Inertia) -> list[Scalar]:
    if isinstance(one, PointInertia):
        return [m for row in one.masses for m in row]
    tensor = [] if one.tensor is None else [entry for row in one.tensor for entry in row]
    return [one.mass, *one.center_of_mass, one.moment, *tensor]


def inertial_energy(one: Inertia, gravity: Vector, space: str) -> Scalar:
    """Return kinetic energy and that of weight, J, on the symbols of a part."""
    total: Scalar = 0.0
    if isinstance(one, PointInertia):
        for a, row in zip(one.points, one.masses, strict=True):
            for b, mass in zip(one.points, row, strict=True):
                total = total + mass * (0.5 * dot(a.velocity, b.velocity) - dot(gravity, a.position))
        return total
    frame = one.frame
    arm, spin = (one.center_of_mass, None) if space == "line" else (frame.to_world(one.center_of_mass), True)
    velocity = frame.velocity if spin is None else frame.velocity + cross(frame.angular_velocity, arm)
    total = one.mass * (0.5 * dot(velocity, velocity) - dot(gravity, frame.position + arm))
    if space == "plane":
        return total + 0.5 * one.moment * dot(frame.angular_velocity, frame.angular_velocity)
    if space == "space" and one.tensor is not None:
        own = frame.to_frame(frame.angular_velocity)
        return total + 0.5 * dot(own, Vector(*(dot(Vector(*row), own) for row in one.tensor)))
    return total


def energies_in(
    field: Function | None, inertias: Iterable[PointInertia | BodyInertia], time: Expression, graph: Graph
) -> tuple[Expression, ...]:
    """Return the energies that a part's inertias have in a scene's field of gravity.

    A rigid body has it at its centre of mass; of points that share their mass (a rod's ends) each has its half.
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
