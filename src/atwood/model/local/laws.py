"""Laws on local symbols: what each part contributes, before anyone knows where its connectors are.

Every connector gets symbols of its own for what a law can read. Evaluating a law on them gives an expression that
says by itself which connectors it depends on, and whose derivatives are the forces at them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

from atwood.errors import AtwoodError, DeclarationError, UnsupportedError, suggestion
from atwood.expr import Expression, Graph, Scalar, depends_on, live
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.declare.component import Binding, bind
from atwood.model.declare.law_results import (
    Asked,
    BodyInertia,
    Carried,
    CoordinateLoad,
    Load,
    Placement,
    PointInertia,
    call_law,
    finite_scalar,
    law_value,
    listed,
    one_scalar,
)
from atwood.model.declare.laws import Law, scalars
from atwood.model.local.bound import ParameterTable, bind_part
from atwood.model.local.contacts import LocalContact, in_chosen_set, local_contacts, powers, without_gaps
from atwood.model.local.flatten import FlatScene, Part
from atwood.model.local.joint_coordinates import (
    JointCoordinateUse,
    counting_constraints,
    find_joint_coordinate_uses,
    formulas_of,
    turns_read,
)
from atwood.model.local.kinds import Kinds
from atwood.model.local.moving_mass import check_lagrangians, energies_in, find_varying
from atwood.model.local.parts import (
    LocalConnector,
    LocalConstraint,
    LocalJoint,
    LocalPart,
    LocalState,
    check_reactions,
    discrete_states,
    local_states,
    multiplier_symbol,
)
from atwood.model.values.space import WHERE, Space, Vector


def localize(
    flat: FlatScene,
    table: ParameterTable,
    modes: Mapping[str, str],
    line_signs: Mapping[tuple[str, str, str], float] | None,
    carried: Mapping[tuple[str, str], Carried] | None = None,
) -> dict[str, LocalPart]:
    """Evaluate the laws of every part on its local symbols."""
    for path, part in flat.parts.items():
        _check_space(path, part, table.space.name)
    used = find_joint_coordinate_uses(flat)
    counted: dict[str, set[str]] = {}
    for one in (one for several in used.values() for one in several):
        counted.setdefault(one.joint, set()).add(one.coordinate)
    found: dict[str, LocalPart] = {}
    kinds = Kinds(flat, modes, table, carried, {*used, *counted})

    def read_laws(part: Part) -> LocalPart:
        taken = [(one, found[one.joint]) for one in used.get(part.path, ())]
        own = counted.get(part.path, ())
        return _localize_part(part, flat, table, modes, line_signs, taken, own, carried or {})

    for path in sorted(flat.parts, key=lambda path: path in used):  # joints before what takes hold of them
        found[path] = kinds.read(flat.parts[path], read_laws)
    return {path: found[path] for path in flat.parts}


def _check_space(path: str, part: Part, space: str) -> None:
    """Refuse a part that means nothing in a scene's space."""
    known = type(part.component).spaces
    if space not in known:
        kind, places = type(part.component).__name__, " and ".join(WHERE[one] for one in known)
        raise UnsupportedError(
            f"{kind} exists {places} only, and the scene is {WHERE[space]}",
            where=path,
            advice=f"Give the scene space='{known[-1]}', or take the part out.",
        )


@dataclass(frozen=True)
class _Laws:
    """The laws of a part that hold in the space and the mode."""

    part: Part
    space: Space
    mode: str
    graph: Graph

    def hold(self, law: Law) -> bool:
        """Return whether a law holds here."""
        return law.holds_in(self.space.name) and law.acts_in(self.mode)

    def of(self, kind: Any) -> list[Law]:
        return [law for law in self.part.component.laws(kind) if self.hold(law)]

    def scalars(self, bound: Any, kind: Any, only_in_modes: bool = False) -> tuple[Expression, ...]:
        """Return what laws give that return one number, where that is not zero."""
        chosen = [law for law in self.of(kind) if law.options.modes or not only_in_modes]
        found = [call_law(self.part.path, law, partial(_scalar, bound, law, self.graph)) for law in chosen]
        return tuple(one for one in found if not one.is_zero)

    def listed(self, bound: Any, kind: Any) -> list[Any]:
        """Return what laws give that return several things."""
        return [one for law in self.of(kind) for one in call_law(self.part.path, law, partial(_listed, bound, law))]


def _localize_part(
    part: Part,
    flat: FlatScene,
    table: ParameterTable,
    modes: Mapping[str, str],
    line_signs: Mapping[tuple[str, str, str], float] | None,
    taken: Sequence[tuple[JointCoordinateUse, LocalPart]],
    counted: Collection[str],
    carried: Mapping[tuple[str, str], Carried],
) -> LocalPart:
    graph, space, component = table.graph, table.space, part.component
    symbols = bind_part(part, flat, table, line_signs, taken)
    binding, connectors = symbols.binding, symbols.connectors
    bound = bind(component, binding)  # inertia and joints say what bodies there are, and may not ask what these have
    binding = _with_bodies(binding, part.path, carried, graph)
    acting = bind(component, binding)
    mode = modes.get(part.path, component.modes[0] if component.modes else "")
    laws, own, linked = _Laws(part, space, mode, graph), [*connectors.values()], symbols.signal_symbols.values()
    potentials, switched = laws.scalars(acting, "potential"), laws.scalars(acting, "potential", only_in_modes=True)
    constraints = [one for law in laws.of("constraint") for one in _local_constraints(part, law, acting, graph)]
    inertias, lagrangians = laws.listed(bound, "inertia"), laws.scalars(acting, "lagrangian")
    potentials += energies_in(flat.gravity_potential, inertias, table.time, graph)
    check_lagrangians(part.path, lagrangians, own, linked)
    joints = tuple(_local_joint(part, law, bound, graph, connectors) for law in laws.of("joint"))
    coordinates = [symbol for joint in joints for symbol in joint.coordinates]
    formulas = formulas_of(part, bound, coordinates, graph) if space.is_spatial else {}
    # Only forces may read reactions: they are solved for together with the accelerations.
    binding = replace(binding, reactions=_readable_reactions(part, constraints, mode, space, graph))
    every, binding = local_contacts(part, binding, connectors, graph, laws.hold)
    contacts, held, rubbing = in_chosen_set(every, flat.contact_states)
    acting, constraints = bind(component, binding), [*without_gaps(constraints, every), *held]
    given = _forces_of(laws, acting, (*contacts, *rubbing))
    turns = turns_read(part, formulas, [*potentials, *lagrangians, *_acting(laws, flat, acting, given, formulas)])
    counted = {*counted, *(symbol.name.rpartition(".")[2] for symbol in turns)}
    _check_reads(part, connectors, potentials, given.dissipations)
    return LocalPart(
        part=part,
        binding=binding,
        connectors=connectors,
        joints=joints,
        point_inertias=tuple(one for one in inertias if isinstance(one, PointInertia)),
        body_inertias=tuple(one for one in inertias if isinstance(one, BodyInertia)),
        potentials=potentials,
        dissipations=given.dissipations,
        loads=given.loads,
        constraints=(*constraints, *counting_constraints(part, counted, formulas, graph)),
        signal_symbols=symbols.signal_symbols,
        formulas={**formulas, **{one.symbol: (one.value, one.rate) for one in symbols.joint_references}},
        borrowed={full: end for one in symbols.joint_references for full, end in one.borrowed.items()},
        switched=switched,
        turns=turns,
        lagrangians=lagrangians,
        varying=find_varying(part.path, inertias, own, linked, graph),
        reads=_multipliers_read(part, constraints, contacts, given.values, graph),
        stand_ins=given.stand_ins,
        states=given.states,
        discrete_states=discrete_states(part, graph, binding.values),
        contacts=contacts,
        rubs={one.row.reaction: one.force for one in rubbing},
    )


def _with_bodies(binding: Binding, path: str, carried: Mapping[tuple[str, str], Carried], graph: Graph) -> Binding:
    """Return a binding whose motions have the inertia of the bodies that connectors are on, or note who asks for it."""
    motions = {
        name: replace(one, body=carried.get((path, name)) or Asked(graph, f"{path}.{name}"))
        for name, one in binding.motions.items()
    }
    return replace(binding, motions=motions)


class _Forces(NamedTuple):
    """What may read reactions: Rayleigh functions, loads, and the rates of states.

    Attributes
    ----------
    dissipations, loads, stand_ins, states
        See `LocalPart`.
    values
        All values that these consist of.
    """

    dissipations: tuple[Expression, ...]
    loads: tuple[Load, ...]
    stand_ins: Mapping[Expression, Expression]
    states: tuple[LocalState, ...]
    values: list[Scalar]


def _forces_of(laws: _Laws, acting: Any, contacts: Sequence[LocalContact]) -> _Forces:
    """Evaluate the laws of a part that may read its reactions, with the forces of its gaps and slips."""
    part, graph = laws.part, laws.graph
    dissipations, given = laws.scalars(acting, "dissipation"), laws.listed(acting, "force")
    loads = tuple(one for one in given if isinstance(one, Load))
    stand_ins, along = _coordinate_loads(part, [one for one in given if isinstance(one, CoordinateLoad)], graph)
    dissipations = (*dissipations, *along, *powers(contacts))
    stand_ins |= {one.stand_in: one.force for one in contacts}
    states = local_states(part, laws.of("derivative"), acting, graph)
    values: list[Scalar] = [*dissipations, *(c for one in loads for c in one.components), *(x.rate for x in states)]
    values += [one.row.value for one in contacts if not one.is_slip]  # whose turns count
    return _Forces(dissipations, loads, stand_ins, states, [*values, *stand_ins.values()])


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


def _acting(laws: _Laws, flat: FlatScene, acting: Any, given: _Forces, is_linked: object) -> list[Expression]:
    """Return what forces of a part consist of, and what of it acts elsewhere by what is linked to it."""
    linked = _linked_outputs(laws.part, flat, acting, laws.graph) if is_linked else []
    return [*(laws.graph.convert(one) for one in given.values), *linked]


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
        acts = not one.value.is_zero  # across a plane nothing does
        found[one.reaction] = one.sign * multiplier_symbol(graph, part.path, one.law.name, one.index) if acts else 0.0
    return found


def _multipliers_read(
    part: Part,
    constraints: Sequence[LocalConstraint],
    contacts: Sequence[LocalContact],
    forces: Sequence[Scalar],
    graph: Graph,
) -> tuple[Expression, ...]:
    """Return the multipliers of a part that its forces depend on, and those of its gaps and slips."""
    if not (constraints or contacts) or not forces:
        return ()
    used = {node.index for node in live([graph.convert(one) for one in forces])}
    own = [multiplier_symbol(graph, part.path, one.law.name, one.index) for one in constraints]
    own += [one.read for one in contacts]
    return (*(symbol for symbol in own if symbol.index in used), *(one.multiplier for one in contacts))


def _scalar(bound: Any, law: Law, graph: Graph) -> Expression:
    return finite_scalar(graph, law_value(bound, law.name))


def _check_reads(
    part: Part,
    connectors: Mapping[str, LocalConnector],
    potentials: tuple[Expression, ...],
    dissipations: tuple[Expression, ...],
) -> None:
    """Refuse energies that depend on velocities, and Rayleigh functions that do not: their forces would be lost."""
    velocities = [symbol for one in connectors.values() for symbol in one.velocity]
    velocities += [symbol for one in connectors.values() for symbol in one.spin]
    if depends_on(potentials, velocities):
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
    check_reactions(part, law, len(values), names)
    for index, (value, name) in enumerate(zip(values, names, strict=True)):
        yield LocalConstraint(law, index, value, name, law.options.sign)


def output_value(part: Part, bound: Any, name: str, space: Space) -> Scalar:
    """Return what an output is."""
    stem, _, axis = name.partition(".")
    law = next((one for one in part.component.laws("observable") if one.name == stem), None)
    if law is None or name in bound._binding().reactions:
        value = bound.reaction(name)  # which says which there are
    else:
        where = f"{part.path}.{name}"
        if not law.holds_in(space.name):
            message = f"{stem} has no meaning {WHERE[space.name]}"
            raise DeclarationError(message, where=where, advice=_instead(part, law, space))
        value = call_law(part.path, law, partial(law_value, bound, stem))
        if isinstance(value, Vector):
            if axis not in ("x", "y", "z"):
                axes = space.reported(value, law.options.unit)
                raise _no_component(axis, [f"{stem}.{'xyz'[i]}" for i in axes], where)
            value = getattr(value, axis)
        elif axis:
            raise DeclarationError(f"{stem} is a number and no vector", where=where, advice=f"Connect {stem}.")
    found: Scalar = value
    return found


def _instead(part: Part, law: Law, space: Space) -> str:
    """Return a hint for an observable of another space: what looks alike here, or in which spaces it has a meaning."""
    names = [one.name for one in part.component.laws("observable") if one.holds_in(space.name)]
    return suggestion(law.name, names) or f"It has one {' or '.join(WHERE[one] for one in law.options.spaces)}."


def _no_component(axis: str, names: Sequence[str], where: str) -> DeclarationError:
    """Return the error of a vector of which no component is named, or one that it does not have."""
    what = f"a vector has no component {axis!r}" if axis else "it is a vector"
    *first, last = names
    return DeclarationError(what, where=where, advice=f"Connect {', '.join(first)}{' or ' * bool(first)}{last}.")
