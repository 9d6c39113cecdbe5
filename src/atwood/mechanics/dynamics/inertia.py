"""Inertia: the masses of all parts, added up body by body, for the equations and for laws that ask for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, reduce
from operator import add

import numpy as np

from atwood.errors import DeclarationError, ParameterError, TopologyError
from atwood.expr import Expression, Scalar, evaluate, is_zero
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.kinematics.orientation import NodeTurn, body_offsets, rotate
from atwood.model.declare.law_results import BodyInertia
from atwood.model.local.parts import LocalPart
from atwood.model.values.rotation import Axes, from_axes, transposed
from atwood.model.values.space import ZERO, ZERO as _ZERO, Space, Vector, dot, planar_axes
from atwood.solids.properties import symmetric_part, verify_moments
from atwood.topology.bodies import Bodies
from atwood.topology.graph import MechanismGraph


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
        Moment of inertia about it, kg m^2; in space the tensor, as its columns in the axes of the body.
    parts
        Paths of the parts it comes from.
    """

    mass: Scalar
    center: Vector
    moment: Scalar | Axes
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
    varying
        Rigid bodies whose inertia changes with time, with the paths of their parts; single points that do are among
        the coupled masses.
    """

    bodies: Mapping[int, RigidMass]
    coupled: tuple[CoupledMass, ...]
    varying: tuple[tuple[str, BodyInertia], ...] = ()


def add_masses(
    mechanism: MechanismGraph,
    bodies: Bodies,
    locals_: Mapping[str, LocalPart],
    layouts: Mapping[int, tuple[Mapping[int, Vector], Mapping[int, NodeTurn]]],
    space: Space,
) -> Masses:
    """Add up the inertia of all parts, with the parallel-axis theorem (Goldstein, section 5.3)."""
    shares: dict[int, list[RigidMass]] = {}
    coupled: list[CoupledMass] = []
    varying: list[tuple[str, BodyInertia]] = []

    def share(part: str, node: int, mass: Scalar, center: Vector, moment: Scalar | Axes) -> None:
        body = bodies.body_of[node]
        if (is_zero(mass) and _is_nothing(moment)) or body == 0:
            return
        offsets, turns = layouts[body]
        turn = turns[node]
        if isinstance(moment, tuple):
            moment = turned_tensor(moment, turn)
        shares.setdefault(body, []).append(RigidMass(mass, offsets[node] + rotate(center, turn), moment, (part,)))

    nothing: Scalar | Axes = (_ZERO, _ZERO, _ZERO) if space.is_spatial else 0.0
    for path, local in locals_.items():
        for point in local.point_inertias:
            nodes = tuple(mechanism.node_of[(path, p.name)] for p in point.points)
            if len(nodes) == 1 and point not in local.varying:
                share(path, nodes[0], point.masses[0][0], Vector(0.0, 0.0, 0.0), nothing)
            elif not all(is_zero(m) for row in point.masses for m in row) and any(map(bodies.body_of.get, nodes)):
                coupled.append(CoupledMass(path, nodes, tuple(tuple(row) for row in point.masses)))
        for body in local.body_inertias:
            node = mechanism.node_of[(path, body.frame.name)]
            if body in local.varying:
                varying += [(path, body)] if bodies.body_of[node] else []
                continue
            moment = tensor_of(path, body) if space.is_spatial else body.moment
            share(path, node, body.mass, body.center_of_mass, moment)
    merged = {index: _merge(found) for index, found in shares.items()}
    return Masses(merged, tuple(coupled), tuple(varying))


def tensor_of(path: str, body: BodyInertia) -> Axes:
    """Return the inertia tensor of a rigid body about its centre of mass, as its columns."""
    if body.tensor is None:
        raise DeclarationError(
            "in space a rigid body needs an inertia tensor, and this part gives a moment about one axis only",
            where=path,
            advice="Give its BodyInertia a tensor.",
        )
    rows = [list(row) for row in body.tensor]
    return Vector(*rows[0]), Vector(*rows[1]), Vector(*rows[2])


def check_tensors(locals_: Mapping[str, LocalPart], values: Mapping[Expression, float], space: Space) -> None:
    """Refuse inertia that no body can have: not symmetric, a negative principal moment, one beyond the others' sum.

    In a plane only the moment about its normal counts, and the others need not be given: they may all be zero.
    """
    for path, local in locals_.items():
        for body in local.body_inertias:
            entries = [entry for row in body.tensor or () for entry in row]
            if not entries or body in local.varying or all(is_zero(entry) for entry in entries):
                continue
            graph = next(iter(values)).graph if values else None
            numbers = evaluate([graph.convert(entry) for entry in entries], values) if graph else entries
            tensor = np.array(numbers, dtype=float).reshape(3, 3)
            if space.is_planar and tensor[1, 1] > 0.0 and np.count_nonzero(tensor) == 1:
                continue
            try:
                verify_moments(symmetric_part(tensor))
            except ParameterError as error:
                raise ParameterError(error.message, where=path, advice=error.advice) from error


def check_masses(masses: Masses, values: Mapping[Expression, float]) -> None:
    """Refuse bodies whose masses add up to less than nothing; one that depends on time is known only later."""
    found = [(" and ".join(one.parts), one.mass) for one in masses.bodies.values()]
    found += [(one.part, row[i]) for one in masses.coupled for i, row in enumerate(one.masses)]
    known = [(where, mass) for where, mass in found if not isinstance(mass, Expression) or mass.is_parametric]
    for (where, _), number in zip(known, evaluate([mass for _, mass in known], values), strict=True):
        if number < 0.0:
            raise ParameterError(
                f"the mass of the body is {number:.6g} kg in all, and the mass of a body cannot be negative",
                where=where,
                advice="A part may remove mass, as a hole does, but not more than the body has.",
            )


def _is_nothing(moment: Scalar | Axes) -> bool:
    return all(is_zero(c) for v in moment for c in v) if isinstance(moment, tuple) else is_zero(moment)


def turned_tensor(tensor: Axes, turn: NodeTurn) -> Axes:
    """Return a tensor given in the axes of a node in those of its body: ``C J C^T``."""
    assert isinstance(turn, tuple)
    back = transposed(turn)
    columns = [from_axes(turn, from_axes(tensor, column)) for column in back]
    return columns[0], columns[1], columns[2]


def _merge(shares: Sequence[RigidMass]) -> RigidMass:
    if len(shares) == 1:
        return shares[0]
    parts = tuple(path for one in shares for path in one.parts)
    mass = reduce(add, [one.mass for one in shares])
    if all(_same(one.center, shares[0].center) for one in shares):
        return RigidMass(mass, shares[0].center, _total_moment([one.moment for one in shares]), parts)
    massive = [one for one in shares if not is_zero(one.mass)]
    if not massive:
        return RigidMass(mass, shares[0].center, _total_moment([one.moment for one in shares]), parts)
    center = massive[0].center * massive[0].mass
    for one in massive[1:]:
        center = center + one.center * one.mass
    center = center / mass
    moments = [_shifted(one.moment, one.mass, one.center - center) for one in shares]
    return RigidMass(mass, center, _total_moment(moments), parts)


def _shifted(moment: Scalar | Axes, mass: Scalar, r: Vector) -> Scalar | Axes:
    """Return a moment or tensor about a point at a distance from the centre of mass."""
    if not isinstance(moment, tuple):
        return moment + mass * (r.x * r.x + r.z * r.z)
    return shifted_tensor(moment, mass, r)


def shifted_tensor(moment: Axes, mass: Scalar, r: Vector) -> Axes:
    """Return a tensor about a point at a distance from the centre of mass: ``J + m (r^2 1 - r r)``."""
    square = dot(r, r)
    units = (Vector(1.0, 0.0, 0.0), Vector(0.0, 1.0, 0.0), Vector(0.0, 0.0, 1.0))
    x, y, z = (moment[i] + (units[i] * square - r * r[i]) * mass for i in range(3))
    return x, y, z


def _total_moment(moments: Sequence[Scalar | Axes]) -> Scalar | Axes:
    if not isinstance(moments[0], tuple):
        return reduce(add, moments)
    x, y, z = (reduce(add, [one[i] for one in moments if isinstance(one, tuple)]) for i in range(3))
    return x, y, z


def _same(a: Vector, b: Vector) -> bool:
    return all(p is q or (is_zero(p) and is_zero(q)) or _equal_numbers(p, q) for p, q in zip(a, b, strict=True))


def _equal_numbers(p: Scalar, q: Scalar) -> bool:
    return not isinstance(p, Expression) and not isinstance(q, Expression) and bool(p == q)


@dataclass(frozen=True)
class _Share:
    """What one part adds to a body: its mass, its centre of mass and its axes in those of the body."""

    part: str
    mass: Scalar
    center: Vector
    axes: Axes
    inertia: BodyInertia | None


class CarriedInertia:
    """Mass, centre of mass and inertia tensor of the body that a connector is on, worked out when they are read.

    Parameters
    ----------
    network, bodies, locals_, space
        The mechanism.
    path, name
        The part and its connector, in whose axes they are.
    """

    def __init__(
        self,
        network: MechanismGraph,
        bodies: Bodies,
        locals_: Mapping[str, LocalPart],
        space: Space,
        path: str,
        name: str,
    ) -> None:
        self._network, self._locals = network, locals_
        self._where, self._node = f"{path}.{name}", network.node_of[path, name]
        self._body = bodies.bodies[bodies.body_of[self._node]]
        self._space = space

    @property
    def mass(self) -> Scalar:
        """Mass, kg."""
        total: Scalar = 0.0
        for one in self._shares:
            total = one.mass if is_zero(total) else total + one.mass
        return total

    @property
    def is_light(self) -> bool:
        """Whether it moves and has no mass."""
        node_of, nodes = self._network.node_of, self._body.nodes
        heavy = {
            node_of[path, point.name]
            for path, local in self._locals.items()
            for points, masses in (
                *((one.points, [m for row in one.masses for m in row]) for one in local.point_inertias),
                *(([one.frame], [one.mass]) for one in local.body_inertias),
            )
            for point in points
            if not all(map(is_zero, masses))
        }
        return not self._body.is_fixed and heavy.isdisjoint(nodes)

    @property
    def center_of_mass(self) -> Vector:
        """Centre of mass from the node, in its axes, m."""
        offsets, turns = self._layout
        return rotate(self._center - offsets[self._node], transposed(_axes(turns[self._node])))

    @property
    def inertia(self) -> Axes:
        """Inertia tensor about the centre of mass, in the axes of the node, kg m^2 (Goldstein, section 5.3)."""
        tensors: list[Axes] = [(ZERO, ZERO, ZERO)]
        for one in self._shares:
            own = (ZERO, ZERO, ZERO) if one.inertia is None else tensor_of(one.part, one.inertia)
            turned = turned_tensor(own, one.axes)
            alone = len(self._shares) == 1
            tensors.append(turned if alone else shifted_tensor(turned, one.mass, one.center - self._center))
        x, y, z = (reduce(add, [one[i] for one in tensors]) for i in range(3))
        return turned_tensor((x, y, z), transposed(_axes(self._layout[1][self._node])))

    @cached_property
    def _layout(self) -> tuple[Mapping[int, Vector], Mapping[int, NodeTurn]]:
        return body_offsets(self._body, self._space)

    @cached_property
    def _center(self) -> Vector:
        massive = [one for one in self._shares if not is_zero(one.mass)]
        if len(massive) < 2:
            return massive[0].center if massive else self._layout[0][self._node]
        center: Vector = reduce(add, [one.center * one.mass for one in massive]) / self.mass
        return center

    @cached_property
    def _shares(self) -> list[_Share]:
        """What the parts of the body add to it."""
        if self._body.is_fixed:
            raise TopologyError(
                "it acts on the mass of the body there, and what is there is fixed to the world", where=self._where
            )
        offsets, turns = self._layout
        found = []
        for path, local in self._locals.items():
            for point in local.point_inertias:
                nodes = [self._network.node_of[path, one.name] for one in point.points]
                if set(nodes).isdisjoint(self._body.nodes) or all(is_zero(m) for row in point.masses for m in row):
                    continue
                if len(nodes) > 1:
                    raise TopologyError(
                        f"it acts on the mass of the body there, and that of {path} is spread between points",
                        where=self._where,
                        advice="Give that part no mass, or put a rigid body with a frame in its place.",
                    )
                found.append(_Share(path, point.masses[0][0], offsets[nodes[0]], _axes(turns[nodes[0]]), None))
            for body in local.body_inertias:
                node = self._network.node_of[path, body.frame.name]
                if node in self._body.nodes:
                    center = offsets[node] + rotate(body.center_of_mass, turns[node])
                    found.append(_Share(path, body.mass, center, _axes(turns[node]), body))
        return found


def inertia_asked_for(
    network: MechanismGraph, bodies: Bodies, locals_: Mapping[str, LocalPart], space: Space
) -> dict[tuple[str, str], CarriedInertia]:
    """Return the inertia of the body at each connector of which a law asks for it, by part and connector."""
    return {
        (path, name): CarriedInertia(network, bodies, locals_, space, path, name)
        for path, local in locals_.items()
        for name in local.asks
    }


def _axes(turn: NodeTurn) -> Axes:
    """Return the axes of a node in those of its body."""
    return turn if isinstance(turn, tuple) else planar_axes(turn)
