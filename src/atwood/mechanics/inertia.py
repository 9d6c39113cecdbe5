"""Inertia: the masses of all parts, added up body by body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from atwood.expr import Expression, Scalar, is_zero
from atwood.mechanics.kinematics import rotate
from atwood.model.local import LocalPart
from atwood.model.vector import Vector
from atwood.topology.bodies import Bodies
from atwood.topology.graph import MechanismGraph

__all__ = ["CoupledMass", "Masses", "RigidMass", "add_masses"]


@dataclass(frozen=True)
class RigidMass:
    """Inertia of a body.

    Attributes
    ----------
    mass
        kg.
    center
        Centre of mass in the axes of the body, m.
    moment
        Moment of inertia about it, kg m^2.
    parts
        Paths of the parts it comes from.
    """

    mass: Scalar
    center: Vector
    moment: Scalar
    parts: tuple[str, ...]


@dataclass(frozen=True)
class CoupledMass:
    """A mass that is spread between several nodes: kinetic energy ``1/2 sum m_ij v_i . v_j``."""

    part: str
    nodes: tuple[int, ...]
    masses: tuple[tuple[Scalar, ...], ...]


@dataclass(frozen=True)
class Masses:
    """All inertia of a scene.

    Attributes
    ----------
    bodies
        Inertia of each body that has mass and is not fixed.
    coupled
        Masses spread between nodes.
    fixed_parts
        Parts whose inertia cannot move.
    """

    bodies: Mapping[int, RigidMass]
    coupled: tuple[CoupledMass, ...]
    fixed_parts: tuple[str, ...]


def add_masses(
    mechanism: MechanismGraph,
    bodies: Bodies,
    locals_: Mapping[str, LocalPart],
    layouts: Mapping[int, tuple[Mapping[int, Vector], Mapping[int, Scalar]]],
) -> Masses:
    """Add up the inertia of all parts, with the parallel-axis theorem (Goldstein, section 5.3).

    Parameters
    ----------
    mechanism, bodies, locals_
        The mechanism.
    layouts
        Offset and turn of each node in each body.
    """
    shares: dict[int, list[RigidMass]] = {}
    coupled: list[CoupledMass] = []
    fixed: list[str] = []

    def share(part: str, node: int, mass: Scalar, center: Vector, moment: Scalar) -> None:
        body = bodies.body_of[node]
        if is_zero(mass) and is_zero(moment):
            return
        if body == 0:
            fixed.append(part)
            return
        offsets, turns = layouts[body]
        shares.setdefault(body, []).append(
            RigidMass(mass, offsets[node] + rotate(center, turns[node]), moment, (part,))
        )

    for path, local in locals_.items():
        for point in local.point_inertias:
            nodes = tuple(mechanism.node_of[(path, p.name)] for p in point.points)
            if len(nodes) == 1:
                share(path, nodes[0], point.masses[0][0], Vector(0.0, 0.0, 0.0), 0.0)
            elif not all(is_zero(m) for row in point.masses for m in row):
                if all(bodies.body_of[node] == 0 for node in nodes):
                    fixed.append(path)
                else:
                    coupled.append(CoupledMass(path, nodes, tuple(tuple(row) for row in point.masses)))
        for body in local.body_inertias:
            share(path, mechanism.node_of[(path, body.frame.name)], body.mass, body.center_of_mass, body.moment)
    return Masses({index: _merge(found) for index, found in shares.items()}, tuple(coupled), tuple(fixed))


def _merge(shares: Sequence[RigidMass]) -> RigidMass:
    if len(shares) == 1:
        return shares[0]
    parts = tuple(path for one in shares for path in one.parts)
    mass = _total([one.mass for one in shares])
    if all(_same(one.center, shares[0].center) for one in shares):
        return RigidMass(mass, shares[0].center, _total([one.moment for one in shares]), parts)
    massive = [one for one in shares if not is_zero(one.mass)]
    if not massive:
        return RigidMass(mass, shares[0].center, _total([one.moment for one in shares]), parts)
    center = massive[0].center * massive[0].mass
    for one in massive[1:]:
        center = center + one.center * one.mass
    center = center / mass
    moments = []
    for one in shares:
        r = one.center - center
        moments.append(one.moment + one.mass * (r.x * r.x + r.z * r.z))
    return RigidMass(mass, center, _total(moments), parts)


def _total(values: Sequence[Scalar]) -> Scalar:
    total = values[0]
    for value in values[1:]:
        total = total + value
    return total


def _same(a: Vector, b: Vector) -> bool:
    return all(p is q or (is_zero(p) and is_zero(q)) or _equal_numbers(p, q) for p, q in zip(a, b, strict=True))


def _equal_numbers(p: Scalar, q: Scalar) -> bool:
    return not isinstance(p, Expression) and not isinstance(q, Expression) and bool(p == q)
