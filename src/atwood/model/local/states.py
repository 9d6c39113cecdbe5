"""States of a part on symbols of their own, and what its laws make of their rates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from atwood.errors import DeclarationError, suggestion
from atwood.expr import Expression, Graph
from atwood.model.declare.field_functions import StateSpec
from atwood.model.declare.law import Law, scalars
from atwood.model.local.flatten import Part
from atwood.model.local.parts import DiscreteState, LocalState
from atwood.model.returned import call_law, law_value, one_scalar


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


def discrete_states(part: Part, graph: Graph) -> tuple[DiscreteState, ...]:
    """Return the states of a part that change at moments only."""
    return tuple(
        DiscreteState(f"{part.path}.{name}", symbol)
        for spec in part.component.state_specs().values()
        if spec.is_discrete
        for name, symbol in zip(spec.names(part.values), _symbols(part, spec, graph), strict=True)
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
