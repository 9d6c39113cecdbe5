"""One-sided laws of a part on its symbols: gaps and slips, their forces, and what switches these.

A row ``g'' >= 0`` (a gap) or ``s' = 0`` (a slip that sticks) holds where its mask is one, and its multiplier is a force
then; where the mask is zero so is the multiplier. What slides is an applied force, the limit times a sign. Masks and
signs are discrete states, so that equations are derived once for all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from atwood.errors import DeclarationError, UnsupportedError, suggestion
from atwood.expr import Expression, Graph, Scalar, depends_on, jvp, select, sqrt
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.declare.component import Binding, bind
from atwood.model.declare.contact_laws import FrictionOptions, is_given, state_names, value_names
from atwood.model.declare.law_results import call_law, finite_scalar, one_scalar
from atwood.model.declare.laws import Law, scalars
from atwood.model.local.flatten import Part
from atwood.model.local.parts import LocalConnector, LocalConstraint, check_reactions, multiplier_symbol


@dataclass(frozen=True)
class LocalContact:
    """A gap, or a slip, on the symbols of its part.

    Attributes
    ----------
    row
        What stays zero where the mask is one.
    multiplier, read
        The symbol of the multiplier of that row, and what stands for it in limits.
    mask
        1 where the row holds, else 0.
    force
        The force along the gap or the slip.
    rate
        The rate of the gap; the slip itself.
    stand_in
        What stands for the force in the part's Rayleigh function ``-stand_in * rate``.
    direction
        The sign of a slip that goes on, else 0; None for a gap.
    limit, static_limit
        The largest force of friction, and that while it sticks; of a gap None, and what it bears that is pulled open.
    restitution
        Of a gap.
    """

    row: LocalConstraint
    multiplier: Expression
    read: Expression
    mask: Expression
    force: Expression
    rate: Expression
    stand_in: Expression
    direction: Expression | None = None
    limit: Expression | None = None
    static_limit: Expression | None = None
    restitution: Expression | None = None

    @property
    def law(self) -> Law:
        """The law that declares it."""
        return self.row.law

    @property
    def is_slip(self) -> bool:
        """Whether it is a slip, and not a gap."""
        return self.limit is not None

    @property
    def is_free(self) -> bool:
        """Whether it is a slip that nothing ever holds."""
        return all(one is not None and one.is_zero for one in (self.limit, self.static_limit))


def local_contacts(
    part: Part,
    binding: Binding,
    connectors: Mapping[str, LocalConnector],
    graph: Graph,
    holds: Callable[[Law], bool],
) -> tuple[tuple[LocalContact, ...], Binding]:
    """Return the gaps and slips of a part, and a binding with their reactions as other laws of the part read them."""
    laws = sorted(filter(holds, part.component.contact_laws().values()), key=lambda law: law.kind != "unilateral")
    every = [_gap(part, law, binding, connectors, graph) for law in laws if law.kind == "unilateral"]
    found = [one for one in every if one is not None]
    gaps = [one for one in found if not one.row.value.is_parametric]  # what never changes never closes
    never: dict[str, Scalar] = {one.row.reaction: 0.0 for one in found if one not in gaps}
    pressing = {one.row.reaction: one.read for one in gaps}  # zero where the gap is open
    bound = bind(part.component, replace(binding, reactions={**binding.reactions, **never, **pressing}))
    stiff = {one.law.name: one.row.stiffness for one in gaps}
    friction = [law for law in laws if law.kind == "friction"]
    slips = [one for law in friction for one in _slip(part, law, bound, graph, stiff.get(law.options.at))]
    never |= {one.row.reaction: 0.0 for one in slips if one.is_free}
    slips = [one for one in slips if not one.is_free]
    forces = {one.row.reaction: one.force for one in (*gaps, *slips)}
    acting = {one.law.name for one in (*gaps, *slips)}
    absent = {law.name for law, one in zip(laws, every, strict=False) if one is None}
    idle = {
        name: None if law.name in absent else 0.0
        for law in part.component.contact_laws().values()
        if law.name not in acting
        for name in state_names(law)
    }
    values = {**binding.values, **idle}
    return (*gaps, *slips), replace(binding, values=values, reactions={**binding.reactions, **never, **forces})


def without_gaps(constraints: Sequence[LocalConstraint], contacts: Sequence[LocalContact]) -> list[LocalConstraint]:
    """Return constraints without those in whose place there is a gap, whose force has their name."""
    gaps = {one.row.reaction for one in contacts}
    return [one for one in constraints if one.reaction not in gaps]


def in_chosen_set(
    contacts: tuple[LocalContact, ...], states: Mapping[str, float]
) -> tuple[tuple[LocalContact, ...], list[LocalConstraint], list[LocalContact]]:
    """Return what is a gap or a slip still, what holds in a set that is chosen, as constraints, and what rubs in it."""
    if not states:
        return contacts, [], []
    held = [one.row for one in contacts if not one.mask.is_zero]
    return (), held, [one for one in contacts if one.mask.is_zero and not one.force.is_zero]


def _value(part: Part, law: Law, bound: Any, name: str, graph: Graph) -> Expression:
    def evaluated() -> Expression:
        given = getattr(bound, name)
        return finite_scalar(graph, given() if callable(given) else given)

    found: Expression = call_law(part.path, law, evaluated)
    return found


def _gap(
    part: Part, law: Law, binding: Binding, connectors: Mapping[str, LocalConnector], graph: Graph
) -> LocalContact | None:
    bound = bind(part.component, binding)
    for name in filter(None, (*law.options.given, law.options.starts)):
        if not hasattr(type(part.component), name):
            raise _no_name(part, law, name)
    if not all(is_given(bound, name) for name in law.options.given):
        return None
    value = _value(part, law, bound, law.name, graph)
    velocities = [symbol for one in connectors.values() for symbol in (*one.velocity, *one.spin)]
    is_speed = law.options.level == "velocity"
    if not is_speed and depends_on(value, velocities):
        raise UnsupportedError(
            "a gap is read from positions, angles and time, and this one reads velocities",
            where=f"{part.path}.{law.name}",
            advice="Return the gap itself; its rate is found by differentiation. A freewheel has level='velocity'.",
        )
    given = law.options.restitution
    share = graph.convert(given) if not isinstance(given, str) else _named(part, law, bound, given, graph)
    mask = graph.convert(getattr(bound, f"{law.name}_state"))
    multiplier, read, stand_in = _symbols(part, law, graph)
    along = {symbol: rate for one in connectors.values() for symbol, rate in one.rates.items()}
    rate = value if is_speed else jvp([value], {graph.convert(binding.time): 1.0, **along})[0]
    row = LocalConstraint(law, 0, value, law.options.reactions[0], 1.0, stiffness=_stiffness(part, law, bound, graph))
    pull = _named(part, law, bound, law.options.adhesion, graph) if law.options.adhesion else None
    force = mask * multiplier
    read = force if mask.is_constant else read
    return LocalContact(row, multiplier, read, mask, force, rate, stand_in, static_limit=pull, restitution=share)


def _stiffness(part: Part, law: Law, bound: Any, graph: Graph) -> Expression | None:
    """Return how stiff a gap is that shares a load with others; None where it is rigid."""
    name = law.options.stiffness
    if name and name not in part.component.parameter_specs():
        raise DeclarationError(
            f"its stiffness {name!r} is no parameter of the component",
            where=f"{part.path}.{law.name}",
            advice=suggestion(name, list(part.component.parameter_specs())),
        )
    return graph.convert(getattr(bound, name)) if name and getattr(bound, name) is not None else None


def _slip(part: Part, law: Law, bound: Any, graph: Graph, stiffness: Expression | None) -> Iterator[LocalContact]:
    options: FrictionOptions = law.options
    names = options.reactions
    values = call_law(part.path, law, lambda: [one_scalar(graph, one) for one in scalars(getattr(bound, law.name)())])
    check_reactions(part, law, len(values), names)
    limit = _named(part, law, bound, options.limit, graph)
    static = _named(part, law, bound, options.static_limit, graph) if options.static_limit else limit
    if options.at and options.at not in part.component.contact_laws():
        raise DeclarationError(
            f"it acts at {options.at!r}, which is no gap of the component",
            where=f"{part.path}.{law.name}",
            advice=suggestion(options.at, [x.name for x in part.component.contact_laws().values() if x is not law]),
        )
    state = graph.convert(getattr(bound, f"{law.name}_state"))
    held = [graph.convert(getattr(bound, f"{one}_direction")) for one in value_names(law)]
    mask = 0.5 * state * (state - 1.0)  # 1 for the state 2, in which it sticks
    for i, (name, value, way) in enumerate(zip(names, values, _ways(values, held), strict=True)):
        multiplier, read, stand_in = _symbols(part, law, graph, i)
        force = mask * multiplier - way * limit
        read = force if mask.is_constant else read
        row = LocalConstraint(law, i, value, name, 1.0, stiffness=stiffness)
        yield LocalContact(row, multiplier, read, mask, force, value, stand_in, held[i], limit, static)


_TINY = 1e-150
"""Of the direction that is held: where nothing goes on yet, friction is against the way it goes next."""


def _ways(values: Sequence[Expression], held: Sequence[Expression]) -> list[Expression]:
    """Return the direction of a slip: the sign that is held, or the unit vector of two speeds."""
    if len(values) == 1:
        return list(held)
    zero = values[0].graph.zero
    turned = [v + _TINY * e for v, e in zip(values, held, strict=True)]
    share = sum((e * e for e in held), zero)
    square = select(share > 0.5, sum((one * one for one in turned), zero), 1.0)  # no root of what sticks
    share = share / (sqrt(square) + _TINY * _TINY)
    return [share * one for one in turned]


def _named(part: Part, law: Law, bound: Any, name: str, graph: Graph) -> Expression:
    """Return what a method, or a parameter, of the component gives that a law names."""
    if not hasattr(type(part.component), name):
        raise _no_name(part, law, name)
    return _value(part, law, bound, name, graph)


def _no_name(part: Part, law: Law, name: str) -> DeclarationError:
    known = [*part.component.parameter_specs(), *(x for x in vars(type(part.component)) if not x.startswith("_"))]
    return DeclarationError(
        f"it names {name!r}, which the component does not have",
        where=f"{part.path}.{law.name}",
        advice=suggestion(name, known),
    )


def _symbols(part: Part, law: Law, graph: Graph, number: int = 0) -> tuple[Expression, Expression, Expression]:
    multiplier = multiplier_symbol(graph, part.path, law.name, number)
    return multiplier, graph.symbol(f"read:{multiplier.name}"), graph.symbol(f"contact:{multiplier.name}")


def powers(contacts: Sequence[LocalContact]) -> tuple[Expression, ...]:
    """Return the Rayleigh functions whose derivatives by velocities are the forces, with stand-ins for their sizes."""
    return tuple(-(one.stand_in * one.rate) for one in contacts)
