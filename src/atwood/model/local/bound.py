"""A part bound to symbols of its own, or to numbers, before its laws are evaluated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any

from atwood.errors import AtwoodError, DeclarationError, ParameterError
from atwood.expr import Expression, Graph, Scalar
from atwood.lazy_dataclasses import dataclass
from atwood.model.declare.component import Binding, bind
from atwood.model.declare.connectors import Frame, JointCoordinate, Motion
from atwood.model.declare.fields import ParameterSpec
from atwood.model.declare.function_values import Function
from atwood.model.local.flatten import FlatScene, Part
from atwood.model.local.joint_coordinates import JointCoordinateUse, JointReference, find_joint_references
from atwood.model.local.parts import LocalConnector, LocalPart, contact_states, state_values
from atwood.model.values.space import FIXED_AXES, Space, Vector, planar_axes


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
    table: ParameterTable,
    line_signs: Mapping[tuple[str, str, str], float] | None,
    taken: Sequence[tuple[JointCoordinateUse, LocalPart]],
) -> BoundPart:
    """Return the symbols of a part, and the numbers of its parameters."""
    graph, space, component = table.graph, table.space, part.component
    values = {name: read_parameter(part, spec, table) for name, spec in component.parameter_specs().items()}
    signal_symbols: dict[str, Expression] = {}
    for name, given in part.signals.items():
        value = read_signal(part, name, given, flat, table, signal_symbols)
        is_varied = (part.path, name) in flat.varied
        values[name] = value + read_variation(f"{part.path}.{name}", flat, table) if is_varied else value
    values |= state_values(part, graph)
    if flat.contact_states:
        values |= {name: flat.contact_states.get(f"{part.path}.{name}", 0.0) for name in contact_states(part)}
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
        values=values, motions=motions, time=table.time, space=space.name, line=space.line, line_signs=own_line_signs
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


@dataclass
class ParameterTable:
    """The parameters of a scene as symbols, with their values; filled while the laws are read.

    Attributes
    ----------
    graph, space
        Where expressions live, and what the scene lives in.
    values
        The values of the parameters.
    origin
        Place in the world, along the free components of the space, from which positions are counted; empty for the
        world's own origin.
    """

    graph: Graph
    space: Space
    values: dict[Expression, float] = field(default_factory=dict)
    origin: tuple[Expression, ...] = ()

    @property
    def time(self) -> Expression:
        """The symbol of time."""
        return self.graph.symbol("t")

    def scalar(self, name: str, value: float, structural: bool = False) -> Scalar:
        """Return the symbol of a parameter, or the plain number if it shapes the program (exact zero, structural)."""
        if structural or value == 0.0:
            return self.graph.constant(float(value))
        symbol = self.graph.parameter(name)
        self.values[symbol] = float(value)
        return symbol


def read_parameter(part: Part, spec: ParameterSpec, table: ParameterTable) -> Any:
    """Return a parameter as laws see it: symbols for numbers that may change, the value itself for what shapes laws."""
    value, name = part.values[spec.name], f"{part.path}.{spec.name}"
    if isinstance(value, Function):
        return _with_symbols(value, name, table)
    if value is None or spec.integer or spec.choices or spec.text or spec.function_of or spec.array:
        return value
    if spec.size is None:
        return table.scalar(name, value, spec.structural)
    axes = "xyz" if spec.size == 3 else [str(i) for i in range(spec.size)]
    made = [table.scalar(f"{name}.{axis}", one, spec.structural) for axis, one in zip(axes, value, strict=True)]
    return Vector(*made) if spec.size == 3 else tuple(made)


def check_directions(parts: Mapping[str, Part], space: Space) -> None:
    """Refuse directions that have no meaning in a plane: those out of it, and axes of turning within it."""
    if not space.is_planar:
        return
    for path, part in parts.items():
        for spec in part.component.parameter_specs().values():
            value, where = part.values[spec.name], f"{path}.{spec.name}"
            if value is None or not (spec.direction or spec.turning):
                continue
            if spec.turning and (value[0] != 0.0 or value[2] != 0.0):
                advice = "Leave its x and z components zero: (0, -1, 0) turns counter-clockwise."
                raise ParameterError("in a plane things turn about its normal only", where=where, advice=advice)
            if not spec.turning and value[1] != 0.0:
                raise ParameterError("it points out of the plane", where=where, advice="Leave its y component zero.")


def _with_symbols(function: Function, path: str, table: ParameterTable) -> Function:
    """Return a function with symbols for the parameters that it takes by name."""
    return function.with_letters({one: table.scalar(f"{path}.{one}", held) for one, held in function.letters.items()})


def read_signal(
    part: Part,
    name: str,
    given: Any,
    flat: FlatScene,
    table: ParameterTable,
    signal_symbols: dict[str, Expression],
) -> Scalar:
    """Return an input as laws see it: a constant, a function of time, or the symbol of what it is linked to."""
    path = f"{part.path}.{name}"
    if (part.path, name) in flat.links:
        source, observable = flat.links[part.path, name]
        if _is_source(flat.parts[source], flat):
            return _source_value(flat.parts[source], observable, flat, table)
        signal_symbols[name] = table.graph.symbol(f"{path}()")
        return signal_symbols[name]
    if not callable(given):
        return table.scalar(path, given)
    try:
        function = _with_symbols(given, path, table) if isinstance(given, Function) else given
        return table.graph.convert(function(table.time))
    except (TypeError, AtwoodError) as error:
        raise DeclarationError(
            f"this function of time cannot be evaluated on an expression ({error})",
            where=path,
            advice="Write it in plain arithmetic with Atwood's own functions (atwood.sin, atwood.select, ...).",
        ) from error


def read_variation(path: str, flat: FlatScene, table: ParameterTable) -> Scalar:
    """Return the variation of an input; see `FlatScene.varied`."""
    value, rate, second = (table.graph.parameter(name) for name in variation_names(path))
    table.values.update(dict.fromkeys((value, rate, second), 0.0))
    passed = table.time - flat.t_start
    return value + passed * (rate + 0.5 * (passed * second))


def variation_names(path: str) -> tuple[str, str, str]:
    """Return the names of the parameters of an input's variation: its value, its rate and its second derivative."""
    return f"{path} varied", f"{path} varied'", f"{path} varied''"


def _is_source(part: Part, flat: FlatScene) -> bool:
    """Return whether a part's outputs are functions of time, parameters and what is held alone."""
    own = part.component
    is_linked = any((part.path, name) in flat.links for name in part.signals)
    moves = any(not spec.is_discrete for spec in own.state_specs().values())
    return not own.connectors() and not moves and not is_linked


def _source_value(source: Part, observable: str, flat: FlatScene, table: ParameterTable) -> Scalar:
    """Return the output of a part that depends on time and parameters alone."""
    from atwood.model.local.laws import output_value  # few scenes have links

    values = {name: read_parameter(source, spec, table) for name, spec in source.component.parameter_specs().items()}
    values |= {name: read_signal(source, name, given, flat, table, {}) for name, given in source.signals.items()}
    values |= state_values(source, table.graph)
    bound = bind(source.component, Binding(values=values, time=table.time))
    return table.graph.convert(output_value(source, bound, observable, table.space))
