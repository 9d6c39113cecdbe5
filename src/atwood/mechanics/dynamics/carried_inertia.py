"""The inertia of the bodies that connectors are on, for laws that ask for it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from atwood.errors import TopologyError
from atwood.expr import Scalar, is_zero
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.inertia import shifted_tensor, sum_vectors, tensor_of, turned_tensor
from atwood.mechanics.kinematics.orientation import NodeTurn, body_offsets, rotate
from atwood.model.declare.contributions import BodyInertia
from atwood.model.local.parts import LocalPart
from atwood.model.values.rotation import Axes, transposed
from atwood.model.values.space import Space, planar_axes
from atwood.model.values.vector import ZERO, Vector
from atwood.topology.bodies import Bodies
from atwood.topology.graph import MechanismGraph


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
        x, y, z = (sum_vectors([one[i] for one in tensors]) for i in range(3))
        return turned_tensor((x, y, z), transposed(_axes(self._layout[1][self._node])))

    @cached_property
    def _layout(self) -> tuple[Mapping[int, Vector], Mapping[int, NodeTurn]]:
        return body_offsets(self._body, self._space)

    @cached_property
    def _center(self) -> Vector:
        massive = [one for one in self._shares if not is_zero(one.mass)]
        if len(massive) < 2:
            return massive[0].center if massive else self._layout[0][self._node]
        center: Vector = sum_vectors([one.center * one.mass for one in massive]) / self.mass
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
