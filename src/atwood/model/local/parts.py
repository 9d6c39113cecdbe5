"""Contributions of a part, on symbols of its own: connectors, joints, constraints, states and their rates."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from atwood.errors import DeclarationError, suggestion
from atwood.expr import Expression, Graph, Scalar, live
from atwood.lazy_dataclasses import dataclass
from atwood.model.declare.component import Binding
from atwood.model.declare.connectors import Connector
from atwood.model.declare.contact_laws import state_names
from atwood.model.declare.field_functions import StateSpec
from atwood.model.declare.law_results import (
    Asked,
    BodyInertia,
    Load,
    Placement,
    PointInertia,
    call_law,
    law_value,
    one_scalar,
)
from atwood.model.declare.laws import Law, scalars
from atwood.model.local.flatten import Part
from atwood.model.values.rotation import Axes
from atwood.model.values.space import Vector, cross

if TYPE_CHECKING:
    from atwood.model.local.contacts import LocalContact


@dataclass(frozen=True)
class LocalConnector:
    """The symbols that stand for what one connector knows.

    Attributes
    ----------
    position, velocity
        One symbol for each free position component of the space.
    angle, angular_speed
        Rotation in the plane and its rate, for a frame in the plane; else None.
    axes, angular_velocity
        The frame's axes and its angular velocity, in world axes, for a frame in space; else None.
    """

    position: tuple[Expression, ...]
    velocity: tuple[Expression, ...]
    angle: Expression | None = None
    angular_speed: Expression | None = None
    axes: Axes | None = None
    angular_velocity: Vector | None = None

    @property
    def orientation(self) -> tuple[Expression, ...]:
        """The symbols that say how it is turned."""
        if self.axes is not None:
            return tuple(component for axis in self.axes for component in axis)
        return () if self.angle is None else (self.angle,)

    @property
    def rates(self) -> dict[Expression, Scalar]:
        """The rate of each symbol that says where it is and how it is turned."""
        found: dict[Expression, Scalar] = {}
        if self.axes is not None and self.angular_velocity is not None:
            for axis in self.axes:
                found.update(zip(axis, cross(self.angular_velocity, axis), strict=True))
        if self.angle is not None and self.angular_speed is not None:
            found[self.angle] = self.angular_speed
        found.update(zip(self.position, self.velocity, strict=True))
        return found

    @property
    def spin(self) -> tuple[Expression, ...]:
        """The symbols that say how fast it turns."""
        if self.angular_velocity is not None:
            return tuple(self.angular_velocity)
        return () if self.angular_speed is None else (self.angular_speed,)


@dataclass(frozen=True)
class LocalJoint:
    """A joint law: its coordinates as symbols, the placement they give, and in space the axes of both its frames."""

    law: Law
    coordinates: tuple[Expression, ...]
    placement: Placement
    axes: tuple[Axes, ...] = ()


@dataclass(frozen=True)
class LocalConstraint:
    """One scalar that must stay zero: its law, its number there, its reaction's name and sign.

    One that `counts` gives a joint coordinate its value, turns counted, where nothing hangs on the joint. Of several
    that hold the same, those with a `stiffness` share the load as springs do.
    """

    law: Law
    index: int
    value: Expression
    reaction: str
    sign: float
    counts: Expression | None = None
    stiffness: Expression | None = None


@dataclass(frozen=True)
class LocalState:
    """A continuous state of a part: its path, its symbol, its rate on the part's symbols, its unit and usual size."""

    path: str
    symbol: Expression
    rate: Expression
    unit: str
    nominal: float | None


@dataclass(frozen=True)
class DiscreteState:
    """A state of a part that changes at moments only: its path and its symbol."""

    path: str
    symbol: Expression


def multiplier_symbol(graph: Graph, path: str, law: str, index: int) -> Expression:
    """Return the symbol of a constraint's multiplier: of the part's path, its law, and the number within the law."""
    return graph.symbol(f"lambda:{path}.{law}[{index}]")


def check_reactions(part: Part, law: Law, count: int, names: Sequence[str]) -> None:
    """Refuse a law that returns another number of scalars than it names reactions."""
    if len(names) != count:
        raise DeclarationError(
            f"it returns {count} scalars and names {len(names)} reactions", where=f"{part.path}.{law.name}"
        )


@dataclass(frozen=True)
class LocalPart:
    """What one part contributes, on its local symbols.

    Attributes
    ----------
    part
        The leaf.
    binding
        What the laws were evaluated on.
    connectors
        Symbols by connector name.
    joints, point_inertias, body_inertias, potentials, dissipations, loads, constraints
        What its laws returned.
    signal_symbols
        Stand-ins for inputs that are linked to an output.
    formulas
        For the symbol of each joint coordinate, the formulas of the observable of its name and of its rate: in space
        of the part's own, and everywhere of those that it takes hold of.
    borrowed
        Connectors of joints that it takes hold of, which are among its own under their full paths.
    turns
        Those of a joint's own coordinates whose turns count for its laws of force, its events and links to it.
    reads
        The multipliers that its laws of force read.
    stand_ins
        Loads on joint coordinates: the symbol that stands for each among the Rayleigh functions, and what it is.
    states, discrete_states
        Its states, one for each number.
    lagrangians
        What its laws of that kind returned.
    varying
        Those of its inertias that change with time.
    switched
        Those of its potentials that act in some of its modes only.
    contacts
        Its gaps and slips.
    rubs
        In a set of contacts that is chosen, the friction of what slips, by the name of the reaction.
    """

    part: Part
    binding: Binding
    connectors: Mapping[str, LocalConnector]
    joints: tuple[LocalJoint, ...]
    point_inertias: tuple[PointInertia, ...]
    body_inertias: tuple[BodyInertia, ...]
    potentials: tuple[Expression, ...]
    dissipations: tuple[Expression, ...]
    loads: tuple[Load, ...]
    constraints: tuple[LocalConstraint, ...]
    signal_symbols: Mapping[str, Expression]
    formulas: Mapping[Expression, tuple[Expression, Expression | None]] = field(default_factory=dict)
    borrowed: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    switched: tuple[Expression, ...] = ()
    turns: tuple[Expression, ...] = ()
    reads: tuple[Expression, ...] = ()
    lagrangians: tuple[Expression, ...] = ()
    varying: tuple[PointInertia | BodyInertia, ...] = ()
    stand_ins: Mapping[Expression, Expression] = field(default_factory=dict)
    states: tuple[LocalState, ...] = ()
    discrete_states: tuple[DiscreteState, ...] = ()
    contacts: tuple[LocalContact, ...] = ()
    rubs: Mapping[str, Expression] = field(default_factory=dict)

    @property
    def may_hold(self) -> bool:
        """Whether it has a gap that stands for a constraint, as that of a rope that may be slack."""
        held = {name for law in self.part.component.laws("constraint") for name in law.options.reactions}
        return any(one.row.reaction in held for one in self.contacts)

    @property
    def asks(self) -> list[str]:
        """Connectors of which it asks for the inertia of the body that they are on, which is not known yet."""
        return [name for name, one in self.binding.motions.items() if isinstance(one.body, Asked) and one.body.is_read]

    @cached_property
    def unread(self) -> frozenset[str]:
        """Names of parameters that are in none of its laws: the thickness of a box in a plane, or sizes as drawn.

        Of what has laws for some modes, sets of contacts or moments only, as events are, all are read.
        """
        component = self.part.component
        if component.modes or component.contact_laws() or component.laws("event") or component.laws("update"):
            return frozenset()
        laws = [value for name, value in vars(self).items() if name not in ("part", "binding", "connectors")]
        read = set(live(_expressions(laws, self.binding.space)))
        own = {
            name: [one for one in _expressions(value, "space") if one.is_symbol]
            for name, value in self.binding.values.items()
            if isinstance(value, Expression | Vector | tuple)
        }
        return frozenset(name for name, some in own.items() if some and read.isdisjoint(some))

    @property
    def velocities(self) -> list[Expression]:
        """The symbols that say how fast its connectors move and turn."""
        return [symbol for one in self.connectors.values() for symbol in (*one.velocity, *one.spin)]

    def is_idle(self, solved: Collection[tuple[str, str, int]]) -> bool:
        """Return whether all that it does is held by constraints, as (part, law, number), that are solved anyhow."""
        keys = [(self.part.path, one.law.name, one.index) for one in self.constraints]
        return (
            bool(keys)
            and all(key in solved for key in keys)
            and not (self.potentials or self.dissipations or self.loads or self.lagrangians)
        )


def _expressions(given: Any, space: str) -> Iterator[Expression]:
    """Yield the expressions in what laws return, or in values of parameters, that count in a space."""
    if isinstance(given, Expression):
        yield given
    elif isinstance(given, Mapping):
        yield from _expressions([*given, *given.values()], space)
    elif isinstance(given, list | tuple | Vector):
        for one in given:
            yield from _expressions(one, space)
    elif not isinstance(given, Law | Connector) and hasattr(given, "__dict__"):
        across = {"tensor"} if isinstance(given, BodyInertia) and space != "space" else ()
        for name, value in vars(given).items():
            is_flat = space == "plane" and name in ("displacement", "center_of_mass")
            yield from _expressions((value.x, value.z) if is_flat else () if name in across else value, space)


def _symbols(part: Part, spec: StateSpec, graph: Graph) -> list[Expression]:
    """Return what stands for the numbers of a state: for a continuous one, a coordinate of the scene."""
    kind = "held" if spec.is_discrete else "q"
    return [graph.symbol(f"{kind}:{part.path}.{name}") for name in spec.names(part.values)]


def state_values(part: Part, graph: Graph) -> dict[str, Any]:
    """Return what the laws of a part read for its states, by name."""
    found: dict[str, Any] = {}
    for name, spec in part.component.state_specs().items():
        symbols = _symbols(part, spec, graph)
        found[name] = symbols[0] if spec.count is None else tuple(symbols)
    return found


def declared_starts(parts: Mapping[str, Part], t_start: float, is_discrete: bool = False) -> dict[str, float]:
    """Return the start of each number of the states of all parts, by path, unless the scene says otherwise."""
    return {
        f"{path}.{name}": start
        for path, part in parts.items()
        for spec in part.component.state_specs().values()
        if spec.is_discrete == is_discrete
        for name, start in zip(spec.names(part.values), spec.starts(part.values, t_start), strict=True)
    }


def contact_states(part: Part) -> list[str]:
    """Return the names of the states of gaps and slips of a part."""
    return [name for law in part.component.contact_laws().values() for name in state_names(law)]


def discrete_states(part: Part, graph: Graph, values: Mapping[str, Any]) -> tuple[DiscreteState, ...]:
    """Return the states of a part that change at moments only; of gaps and slips those that are no numbers already."""
    known = [name for name in contact_states(part) if not isinstance(values[name], Expression)]
    return tuple(
        DiscreteState(f"{part.path}.{name}", symbol)
        for spec in part.component.state_specs().values()
        if spec.is_discrete
        for name, symbol in zip(spec.names(part.values), _symbols(part, spec, graph), strict=True)
        if name not in known
    )


def local_states(part: Part, laws: Sequence[Law], bound: Any, graph: Graph) -> tuple[LocalState, ...]:
    """Return the continuous states of a part, with their rates."""
    specs = {name: spec for name, spec in part.component.state_specs().items() if not spec.is_discrete}
    said = {name for law in part.component.laws("derivative") for name in law.options.states}
    for name in specs:
        if name not in said:
            raise DeclarationError(
                "no law says its rate",
                where=f"{part.path}.{name}",
                advice=f"Mark a method with @derivative({name!r}), or declare it as a discrete_state.",
            )
    rates: dict[str, list[Expression]] = {}
    for law in laws:
        given = _rates(part, law, specs, bound, graph)
        for name in law.options.states:
            if name in rates:
                raise DeclarationError("two laws say its rate", where=f"{part.path}.{name}")
            count = len(specs[name].names(part.values))
            rates[name], given = given[:count], given[count:]
    return tuple(
        LocalState(f"{part.path}.{own}", symbol, rate, spec.unit.text, spec.nominal)
        for name, spec in specs.items()
        for own, symbol, rate in zip(
            spec.names(part.values),
            _symbols(part, spec, graph),
            rates.get(name, [graph.zero] * len(spec.names(part.values))),
            strict=True,
        )
    )


def _rates(part: Part, law: Law, specs: dict[str, StateSpec], bound: Any, graph: Graph) -> list[Expression]:
    for name in law.options.states:
        if name not in specs:
            raise DeclarationError(
                f"it says the rate of {name!r}, which is no continuous state",
                where=f"{part.path}.{law.name}",
                advice=suggestion(name, specs),
            )

    def evaluated() -> list[Expression]:
        return [one_scalar(graph, one) for one in scalars(law_value(bound, law.name))]

    given: list[Expression] = call_law(part.path, law, evaluated)
    wanted = sum(len(specs[name].names(part.values)) for name in law.options.states)
    if len(given) != wanted:
        raise DeclarationError(
            f"it returns {len(given)} scalars for {wanted} numbers: {', '.join(law.options.states)}",
            where=f"{part.path}.{law.name}",
        )
    return given
