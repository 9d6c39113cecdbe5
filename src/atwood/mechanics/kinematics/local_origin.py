"""Where positions are counted from: the world's origin, or, for a mechanism far from it, where it hangs on the world.

A place far away takes digits from every length that is computed as a difference of positions: at a million sizes from
the origin a closed loop is known to 1e-10 of its size, and no tolerance below that can be met. So positions are counted
from a fixed node near by. Laws read the position in the world; differences of two do not contain it
(`expr.core.arithmetic.subtract`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

from atwood.expr import Expression, Scalar, evaluate
from atwood.late import replace
from atwood.mechanics.kinematics.mechanism import Decision, Mechanism, extent
from atwood.mechanics.kinematics.orientation import body_offsets
from atwood.mechanics.kinematics.positions import Placements
from atwood.topology.graph import WORLD

__all__ = ["Connector", "decided_near", "find_origin", "origin_at", "world_position"]

Connector: TypeAlias = tuple[str, str]
"""A connector, as (part, name)."""

_FAR = 10.0
"""Places farther from the origin than so many times the mechanism's extent cost more than a digit."""


def find_origin(mechanism: Mechanism) -> Connector | None:
    """Return the fixed connector that positions are counted from; None for the world's origin, if that is near.

    Parameters
    ----------
    mechanism
        With positions from the world's origin.
    """
    nodes = _attached(mechanism)
    size = extent(mechanism)
    if not nodes or nodes[0] == WORLD or size == 0.0:
        return None
    offsets = body_offsets(mechanism.bodies.bodies[0], mechanism.space)[0]
    graph = mechanism.table.graph
    flat = [graph.convert(c) for node in nodes for c in mechanism.space.components(offsets[node])]
    if all(one.is_zero for one in flat):
        return None
    places = np.reshape(evaluate(flat, mechanism.table.values), (len(nodes), -1))
    distances = np.sqrt(np.sum(places**2, axis=1))
    return mechanism.graph.nodes[nodes[0]].members[0] if float(np.min(distances)) > _FAR * size else None


def decided_near(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism with the note that the place to count from was chosen by where it is."""
    if all(one.is_zero for one in _fixed_places(mechanism)):
        return mechanism
    return replace(mechanism, decisions=(*mechanism.decisions, Decision(find_origin, find_origin(mechanism))))


def origin_at(mechanism: Mechanism, connector: Connector) -> tuple[Expression, ...]:
    """Return where a fixed connector is, along the free components of the space."""
    offsets = body_offsets(mechanism.bodies.bodies[0], mechanism.space)[0]
    place = offsets[mechanism.graph.node_of[connector]]
    return tuple(mechanism.table.graph.convert(c) for c in mechanism.space.components(place))


def world_position(mechanism: Mechanism, placements: Placements, node: int) -> tuple[Scalar, ...]:
    """Return the position of a node from the world's origin, along the free components of the space."""
    place = placements.positions[node]
    return tuple(o + p for o, p in zip(mechanism.table.origin or (0.0,) * len(place), place, strict=True))


def _fixed_places(mechanism: Mechanism) -> Iterator[Expression]:
    for place in body_offsets(mechanism.bodies.bodies[0], mechanism.space)[0].values():
        yield from (mechanism.table.graph.convert(c) for c in mechanism.space.components(place))


def _attached(mechanism: Mechanism) -> list[int]:
    """Return the fixed nodes at which parts of something that moves begin, in order."""
    bodies, network = mechanism.bodies, mechanism.graph
    moving = {joint.a if bodies.body_of[joint.a] == 0 else joint.b for joint in network.joints if not joint.is_rigid}
    found = {node for node in moving if bodies.body_of[node] == 0}
    for path, local in mechanism.locals_.items():
        nodes = [network.node_of[path, name] for name in local.connectors]
        fixed = {node for node in nodes if bodies.body_of[node] == 0}
        if len(fixed) < len(set(nodes)):
            found |= fixed
    return sorted(found)
