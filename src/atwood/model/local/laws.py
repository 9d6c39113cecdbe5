"""Laws on local symbols: what each part contributes, before anyone knows where its connectors are.

Every connector gets symbols of its own for what a law can read. Evaluating a law on them gives an expression that
says by itself which connectors it depends on, and whose derivatives are the forces at them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

from atwood.errors import AtwoodError, DeclarationError, UnsupportedError
from atwood.expr import Expression, Graph, Scalar, depends_on, live
from atwood.late import dataclass
from atwood.model.declare.carried_inertia import Asked, Carried
from atwood.model.declare.component import Binding, bind
from atwood.model.declare.connectors import Frame, JointCoordinate, Motion
from atwood.model.declare.contributions import BodyInertia, CoordinateLoad, Load, Placement, PointInertia
from atwood.model.declare.law import Law
from atwood.model.declare.laws import scalars
from atwood.model.local.flatten import FlatScene, Part
from atwood.model.local.gravity_field import energies_in
from atwood.model.local.joint_coordinates import (
    JointReference,
    counting_constraints,
    find_joint_references,
    formulas_of,
    turns_read,
)
from atwood.model.local.joint_references import JointCoordinateUse, find_joint_coordinate_uses
from atwood.model.local.moving_mass import check_lagrangians, find_varying
from atwood.model.local.parameters import ParameterTable, read_parameter, read_signal, read_variation
from atwood.model.local.parts import LocalConnector, LocalConstraint, LocalJoint, LocalPart, multiplier_symbol
from atwood.model.local.states import discrete_states, local_states, state_values
from atwood.model.returned import call_law, law_value, listed, one_scalar
from atwood.model.values.space import FIXED_AXES, Space, planar_axes
from atwood.model.values.vector import Vector

__all__ = ["LocalConnector", "LocalConstraint", "LocalJoint", "LocalPart", "localize"]


def localize(
    flat: FlatScene,
    space: Space,
    time: Expression,
    table: ParameterTable,
    modes: Mapping[str, str],
    line_signs: Mapping[tuple[str, str, str], float] | None,
    carried: Mapping[tuple[str, str], Carried] | None = None,
) -> dict[str, LocalPart]:
    """Evaluate the laws of every part on its local symbols.

    Parameters
    ----------
    flat
        The scene.
    space
        What it lives in.
    time
        The symbol of time.
    table
        Takes up the parameters.
    modes
        Mode of each part that has modes.
    line_signs
        On a line: for (part, connector, connector) the sign of the second's position minus the first's; None while
        they are not known yet.
    carried
        Inertia of the body that a connector is on, by part and connector, of those that ask for it; None while it is
        not known yet.

    Raises
    ------
    AtwoodError
        If a law cannot be evaluated; it names the part and the law.
    """
    for path, part in flat.parts.items():
        _check_space(path, part, space.name)
    used = find_joint_coordinate_uses(flat)
    counted: dict[str, set[str]] = {}
    for one in (one for several in used.values() for one in several):
        counted.setdefault(one.joint, set()).add(one.coordinate)
    found: dict[str, LocalPart] = {}
    for path in sorted(flat.parts, key=lambda path: path in used):  # joints before what takes hold of them
        taken = [(one, found[one.joint]) for one in used.get(path, ())]
        part, own = flat.parts[path], counted.get(path, ())
        found[path] = _localize_part(part, flat, space, time, table, modes, line_signs, taken, own, carried or {})
    return {path: found[path] for path in flat.parts}


def _check_space(path: str, part: Part, space: str) -> None:
    """Refuse a part that means nothing in a scene's space."""
    known = type(part.component).spaces
    if space not in known:
        kind, places = type(part.component).__name__, " and ".join(_PLACES[one] for one in known)
        raise UnsupportedError(
            f"{kind} exists {places} only, and the scene is {_PLACES[space]}",
            where=path,
            advice=f"Give the scene space='{known[-1]}', or take the part out.",
        )


_PLACES = {"line": "on a line", "plane": "in a plane", "space": "in space"}


@dataclass(frozen=True)
class _Bound:
    """A part on its symbols, before its laws are evaluated."""

    binding: Binding
    connectors: dict[str, LocalConnector]
    signal_symbols: dict[str, Expression]
    joint_references: Sequence[JointReference]


@dataclass(frozen=True)
class _Laws:
    """The laws of a part that hold in the space and the mode."""

    part: Part
    space: Space
    mode: str
    graph: Graph

    def of(self, kind: Any) -> list[Law]:
        laws = self.part.component.laws(kind)
        return [law for law in laws if law.holds_in(self.space.name) and law.acts_in(self.mode)]

    def scalars(self, bound: Any, kind: Any, only_in_modes: bool = False) -> tuple[Expression, ...]:
        """Return what laws give that return one number, where that is not zero."""
        chosen = [law for law in self.of(kind) if law.options.modes or not only_in_modes]
        found = [call_law(self.part.path, law, partial(_scalar, bound, law, self.graph)) for law in chosen]
        return tuple(one for one in found if not one.is_zero)

    def listed(self, bound: Any, kind: Any) -> list[Any]:
        """Return what laws give that return several things."""
        return [one for law in self.of(kind) for one in call_law(self.part.path, law, partial(_listed, bound, law))]


def _bind_part(
    part: Part,
    flat: FlatScene,
    space: Space,
    time: Expression,
    table: ParameterTable,
    line_signs: Mapping[tuple[str, str, str], float] | None,
    taken: Sequence[tuple[JointCoordinateUse, LocalPart]],
) -> _Bound:
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
    motions = {name: local_motion(symbols, space) for name, symbols in connectors.items()}
    motions.update({one.connector: Motion(value=one.value, rate=one.rate) for one in joint_references})
    own_line_signs = (
        None if line_signs is None else {(a, b): s for (path, a, b), s in line_signs.items() if path == part.path}
    )
    binding = Binding(
        values=values, motions=motions, time=time, space=space.name, line=space.line, line_signs=own_line_signs
    )
    for one in joint_references:
        connectors.update(one.connectors)
    return _Bound(binding, connectors, signal_symbols, joint_references)


def _localize_part(
    part: Part,
    flat: FlatScene,
    space: Space,
    time: Expression,
    table: ParameterTable,
    modes: Mapping[str, str],
    line_signs: Mapping[tuple[str, str, str], float] | None,
    taken: Sequence[tuple[JointCoordinateUse, LocalPart]],
    counted: Collection[str],
    carried: Mapping[tuple[str, str], Carried],
) -> LocalPart:
    graph, component = table.graph, part.component
    symbols = _bind_part(part, flat, space, time, table, line_signs, taken)
    binding, connectors = symbols.binding, symbols.connectors
    bound = bind(component, binding)  # inertia and joints say what bodies there are, and may not ask what these have
    known = {
        name: replace(one, body=carried.get((part.path, name)) or Asked(graph, f"{part.path}.{name}"))
        for name, one in binding.motions.items()
    }
    binding = replace(binding, motions=known)
    acting = bind(component, binding)
    mode = modes.get(part.path, component.modes[0] if component.modes else "")
    laws, own, linked = _Laws(part, space, mode, graph), [*connectors.values()], symbols.signal_symbols.values()
    potentials, switched = laws.scalars(acting, "potential"), laws.scalars(acting, "potential", only_in_modes=True)
    constraints = [one for law in laws.of("constraint") for one in _local_constraints(part, law, acting, graph)]
    inertias, lagrangians = laws.listed(bound, "inertia"), laws.scalars(acting, "lagrangian")
    potentials += energies_in(flat.gravity_potential, inertias, time, graph)
    check_lagrangians(part.path, lagrangians, own, linked)
    joints = tuple(_local_joint(part, law, bound, graph, connectors) for law in laws.of("joint"))
    coordinates = [symbol for joint in joints for symbol in joint.coordinates]
    formulas = formulas_of(part, bound, coordinates, graph) if space.name == "space" else {}
    # Only forces may read reactions: they are solved for together with the accelerations.
    binding = replace(binding, reactions=_readable_reactions(part, constraints, mode, space, graph))
    acting = bind(component, binding)
    dissipations, given = laws.scalars(acting, "dissipation"), laws.listed(acting, "force")
    loads = [one for one in given if isinstance(one, Load)]
    stand_ins, along = _coordinate_loads(part, [one for one in given if isinstance(one, CoordinateLoad)], graph)
    dissipations = (*dissipations, *along)
    states = local_states(part, laws.of("derivative"), acting, graph)
    forces: list[Scalar] = [*dissipations, *(c for one in loads for c in one.components), *(x.rate for x in states)]
    forces += stand_ins.values()
    acted = [*potentials, *lagrangians, *(graph.convert(one) for one in forces)]
    acted += _linked_outputs(part, flat, acting, graph) if formulas else []
    turns = turns_read(part, formulas, acted)
    counted = {*counted, *(symbol.name.rpartition(".")[2] for symbol in turns)}
    _check_reads(part, connectors, potentials, dissipations)
    return LocalPart(
        part=part,
        binding=binding,
        connectors=connectors,
        joints=joints,
        point_inertias=tuple(one for one in inertias if isinstance(one, PointInertia)),
        body_inertias=tuple(one for one in inertias if isinstance(one, BodyInertia)),
        potentials=potentials,
        dissipations=dissipations,
        loads=tuple(loads),
        constraints=(*constraints, *counting_constraints(part, counted, formulas, graph)),
        signal_symbols=symbols.signal_symbols,
        formulas={**formulas, **{one.symbol: (one.value, one.rate) for one in symbols.joint_references}},
        borrowed={full: end for one in symbols.joint_references for full, end in one.borrowed.items()},
        switched=switched,
        turns=turns,
        lagrangians=lagrangians,
        varying=find_varying(part.path, inertias, own, linked, graph),
        reads=_multipliers_read(part, constraints, forces, graph),
        stand_ins=stand_ins,
        states=states,
        discrete_states=discrete_states(part, graph),
    )


def _coordinate_loads(
    part: Part, loads: Sequence[CoordinateLoad], graph: Graph
) -> tuple[dict[Expression, Expression], list[Expression]]:
    """Return loads on joint coordinates as Rayleigh functions, linear in the rates, with symbols for their values."""
    stand_ins: dict[Expression, Expression] = {}
    along: list[Expression] = []
    for number, load in enumerate(loads):
        value = graph.convert(load.value)
        if not value.is_zero:
            symbol = graph.symbol(f"load:{part.path}[{number}]")
            stand_ins[symbol] = value
            along.append(-(symbol * load.at.rate))
    return stand_ins, along


def _linked_outputs(part: Part, flat: FlatScene, acting: Any, graph: Graph) -> list[Expression]:
    """Return the observables of a part that inputs elsewhere are linked to, so far as they can be read by now."""
    wanted = {name.partition(".")[0] for path, name in flat.links.values() if path == part.path}
    found: list[Expression] = []
    for law in part.component.laws("observable"):
        if law.name in wanted:
            with suppress(AtwoodError):  # of reactions that are not readable, which is said where it is read
                found += [graph.convert(c) for c in scalars(law_value(acting, law.name))]
    return found


def _readable_reactions(
    part: Part, constraints: Sequence[LocalConstraint], mode: str, space: Space, graph: Graph
) -> dict[str, Scalar]:
    """Return the reactions of a part's constraints by name: multipliers times their sign; zero in other modes."""
    found: dict[str, Scalar] = {}
    for law in part.component.laws("constraint"):
        if law.holds_in(space.name) and not law.acts_in(mode):
            for name in law.options.reactions:
                found |= dict.fromkeys((name, *(f"{name}.{axis}" for axis in "xyz")), 0.0)
    for one in constraints:
        found[one.reaction] = one.sign * multiplier_symbol(graph, part.path, one.law.name, one.index)
    return found


def _multipliers_read(
    part: Part, constraints: Sequence[LocalConstraint], forces: Sequence[Scalar], graph: Graph
) -> tuple[Expression, ...]:
    """Return the multipliers of a part that its forces depend on."""
    if not constraints or not forces:
        return ()
    used = {node.index for node in live([graph.convert(one) for one in forces])}
    own = (multiplier_symbol(graph, part.path, one.law.name, one.index) for one in constraints)
    return tuple(symbol for symbol in own if symbol.index in used)


def _scalar(bound: Any, law: Law, graph: Graph) -> Expression:
    return one_scalar(graph, law_value(bound, law.name))


def _check_reads(
    part: Part,
    connectors: Mapping[str, LocalConnector],
    potentials: tuple[Expression, ...],
    dissipations: tuple[Expression, ...],
) -> None:
    """Refuse energies that depend on velocities, and Rayleigh functions that do not: their forces would be lost."""
    velocities = [symbol for one in connectors.values() for symbol in one.velocity]
    velocities += [symbol for one in connectors.values() for symbol in one.spin]
    if any(depends_on(value, velocities) for value in potentials):
        raise DeclarationError(
            "a potential depends on positions, angles and time, not on velocities",
            where=part.path,
            advice="Use @dissipation for what depends on velocities, or @force for any other load.",
        )
    if any(not value.is_parametric and not depends_on(value, velocities) for value in dissipations):
        raise DeclarationError(
            "a Rayleigh function depends on velocities, and this one does not",
            where=part.path,
            advice="Use @potential for what depends on positions.",
        )


def _listed(bound: Any, law: Law) -> list[Any]:
    return listed(
        getattr(bound, law.name)(), (Load, CoordinateLoad) if law.kind == "force" else (PointInertia, BodyInertia)
    )


def _local_connector(path: str, is_frame: bool, space: Space, graph: Graph) -> LocalConnector:
    position = tuple(graph.symbol(f"{path}.position.{axis}") for axis in space.axis_names)
    velocity = tuple(graph.symbol(f"{path}.velocity.{axis}") for axis in space.axis_names)
    if not is_frame or not space.has_rotation:
        return LocalConnector(position, velocity)
    if space.name == "plane":
        turns = graph.symbol(f"{path}.angle"), graph.symbol(f"{path}.angular_speed")
        return LocalConnector(position, velocity, *turns)
    x, y, z = (Vector(*(graph.symbol(f"{path}.{axis}_axis.{c}") for c in "xyz")) for axis in "xyz")
    spin = Vector(*(graph.symbol(f"{path}.angular_velocity.{c}") for c in "xyz"))
    return LocalConnector(position, velocity, axes=(x, y, z), angular_velocity=spin)


def local_motion(symbols: LocalConnector, space: Space) -> Motion:
    """Return the motion of a connector in terms of its symbols; the plane's rotation is about -y."""
    position, velocity = space.vector(symbols.position), space.vector(symbols.velocity)
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


def _local_joint(
    part: Part, law: Law, bound: Any, graph: Graph, connectors: Mapping[str, LocalConnector]
) -> LocalJoint:
    coordinates = tuple(graph.symbol(f"{part.path}.{name}") for name in law.options.coordinates)
    placement = call_law(part.path, law, lambda: getattr(bound, law.name)(*coordinates))
    if not isinstance(placement, Placement):
        raise DeclarationError("a joint must return a Placement", where=f"{part.path}.{law.name}")
    ends = [connectors[name].axes for name in (law.options.a, law.options.b) if name in connectors]
    return LocalJoint(law, coordinates, placement, tuple(axes for axes in ends if axes is not None))


def _local_constraints(part: Part, law: Law, bound: Any, graph: Graph) -> Iterable[LocalConstraint]:
    values = call_law(part.path, law, lambda: [one_scalar(graph, one) for one in scalars(getattr(bound, law.name)())])
    names = law.options.reactions
    if len(names) == 1 and len(values) == 3:
        names = tuple(f"{names[0]}.{axis}" for axis in "xyz")
    if len(names) != len(values):
        raise DeclarationError(
            f"it returns {len(values)} scalars and names {len(names)} reactions", where=f"{part.path}.{law.name}"
        )
    for index, (value, name) in enumerate(zip(values, names, strict=True)):
        yield LocalConstraint(law, index, value, name, law.options.sign)
