"""A part on symbols of its own, before its laws are evaluated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from atwood.expr import Expression, Graph
from atwood.late import dataclass
from atwood.model.declare.binding import Binding
from atwood.model.declare.connectors import Frame, JointCoordinate, Motion
from atwood.model.local.flatten import FlatScene, Part
from atwood.model.local.joint_coordinates import (
    JointReference,
    find_joint_references,
)
from atwood.model.local.joint_references import JointCoordinateUse
from atwood.model.local.parameters import ParameterTable, read_parameter, read_signal, read_variation
from atwood.model.local.parts import (
    LocalConnector,
    LocalPart,
)
from atwood.model.local.states import state_values
from atwood.model.values.space import FIXED_AXES, Space, planar_axes
from atwood.model.values.vector import Vector

__all__ = ["bind_part"]


@dataclass(frozen=True)
class BoundPart:
    """A part on its symbols, before its laws are evaluated."""

    binding: Binding
    connectors: dict[str, LocalConnector]
    signal_symbols: dict[str, Expression]
    joint_references: Sequence[JointReference]


def bind_part(
    part: Part,
    flat: FlatScene,
    space: Space,
    time: Expression,
    table: ParameterTable,
    line_signs: Mapping[tuple[str, str, str], float] | None,
    taken: Sequence[tuple[JointCoordinateUse, LocalPart]],
) -> BoundPart:
    """Return the symbols of a part, and the numbers of its parameters."""
    graph, component = table.graph, part.component
    values = {name: read_parameter(part, spec, table) for name, spec in component.parameter_specs().items()}
    signal_symbols: dict[str, Expression] = {}
    for name, given in part.signals.items():
        value = read_signal(part, name, given, flat, time, table, signal_symbols)
        is_varied = (part.path, name) in flat.varied
        values[name] = value + read_variation(f"{part.path}.{name}", flat, time, table) if is_varied else value
    values |= state_values(part, graph)
    connectors = {
        name: _local_connector(f"{part.path}.{name}", isinstance(one, Frame), space, graph)
        for name, one in component.connectors().items()
        if not isinstance(one, JointCoordinate)
    }
    joint_references = find_joint_references(taken, graph)
    motions = {name: local_motion(symbols, space, table.origin) for name, symbols in connectors.items()}
    motions.update({one.connector: Motion(value=one.value, rate=one.rate) for one in joint_references})
    own_line_signs = (
        None if line_signs is None else {(a, b): s for (path, a, b), s in line_signs.items() if path == part.path}
    )
    binding = Binding(
        values=values, motions=motions, time=time, space=space.name, line=space.line, line_signs=own_line_signs
    )
    for one in joint_references:
        connectors.update(one.connectors)
    return BoundPart(binding, connectors, signal_symbols, joint_references)


def _local_connector(path: str, is_frame: bool, space: Space, graph: Graph) -> LocalConnector:
    position = tuple(graph.symbol(f"{path}.position.{axis}") for axis in space.axis_names)
    velocity = tuple(graph.symbol(f"{path}.velocity.{axis}") for axis in space.axis_names)
    if not is_frame or not space.has_rotation:
        return LocalConnector(position, velocity)
    if space.is_planar:
        turns = graph.symbol(f"{path}.angle"), graph.symbol(f"{path}.angular_speed")
        return LocalConnector(position, velocity, *turns)
    x, y, z = (Vector(*(graph.symbol(f"{path}.{axis}_axis.{c}") for c in "xyz")) for axis in "xyz")
    spin = Vector(*(graph.symbol(f"{path}.angular_velocity.{c}") for c in "xyz"))
    return LocalConnector(position, velocity, axes=(x, y, z), angular_velocity=spin)


def local_motion(symbols: LocalConnector, space: Space, origin: tuple[Expression, ...] = ()) -> Motion:
    """Return the motion of a connector in terms of its symbols; the plane's rotation is about -y.

    Its position in the world is that of the origin from which the symbols count, and the symbols; these sums are made
    as they stand, so that the difference of two is seen to be that of the symbols.
    """
    place: tuple[Expression, ...] = symbols.position
    if origin:
        pairs = zip(origin, place, strict=True)
        place = tuple(p if o.is_zero else p.graph.node("add", (o, p)) for o, p in pairs)
    position, velocity = space.vector(place), space.vector(symbols.velocity)
    if symbols.axes is not None:
        return Motion(position, velocity, axes=symbols.axes, angular_velocity=symbols.angular_velocity)
    if symbols.angle is None or symbols.angular_speed is None:
        still = Vector(0.0, 0.0, 0.0)
        return Motion(position, velocity, axes=FIXED_AXES, angle=0.0, angular_velocity=still)
    return Motion(
        position,
        velocity,
        axes=planar_axes(symbols.angle),
        angle=symbols.angle,
        angular_velocity=Vector(0.0, -symbols.angular_speed, 0.0),
    )
