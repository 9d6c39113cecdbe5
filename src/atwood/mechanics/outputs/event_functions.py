"""Events of components as expressions of the state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from atwood.expr import Expression, Graph, depends_on, sqrt, substitute
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.mechanics.outputs.observables import Reader
from atwood.mechanics.outputs.reactions import Reaction
from atwood.model.declare.component import bind
from atwood.model.declare.law_results import call_law, finite_scalar
from atwood.model.declare.laws import Law
from atwood.model.values.units import ALONG

UPDATE = "update"
"""Target of an event that changes states of its part, and no mode."""

CLOSES, OPENS, YIELDS, STOPS, FREES = (
    "contact closes",
    "contact opens",
    "contact yields",
    "contact stops",
    "contact frees",
)
"""Targets of events of gaps and slips: a gap closes, its force vanishes, what sticks reaches its limit, what slips
comes to rest, and the limit of friction passes zero."""

RESTS, RUNS = "contact comes to rest", "contact runs"
"""The same of slips in two directions, which need not pass zero: they fall below what is small, and rise above it."""

CONTACT = (CLOSES, OPENS, YIELDS, STOPS, FREES, RESTS, RUNS)


@dataclass(frozen=True)
class EventFunction:
    """A zero crossing that is watched in the present mode.

    Attributes
    ----------
    part, law
        Where it is declared.
    value
        The expression, of time, coordinates, speeds, accelerations and reactions.
    direction
        +1, -1 or 0.
    target
        The mode it leads to, ``"stop"``, or `UPDATE` where states change; empty where it is only noted.
    message
        What has happened, in words.
    unit
        SI unit of the value.
    impact
        Whether velocities jump.
    is_there
        What must be positive for a zero to count; all count if not given.
    rate
        Of a gap, its rate: where it starts at zero and opens, it has no margin.
    """

    part: str
    law: str
    value: Expression
    direction: int
    target: str
    message: str
    unit: str
    impact: bool
    is_there: Expression | None = None
    rate: Expression | None = None

    @property
    def is_noted(self) -> bool:
        """Whether only the passing of zero counts, and not on which side a run starts."""
        return self.target in ("", UPDATE) or not self.part


def list_event_functions(
    mechanism: Mechanism, equations: Equations, reactions: Sequence[Reaction], modes: Mapping[str, str]
) -> tuple[EventFunction, ...]:
    """Return what is watched in the present modes; what is constant can never cross zero and is left out."""
    found = []
    graph = mechanism.table.graph
    reader = Reader(mechanism, equations, reactions)
    for path, local in mechanism.locals_.items():
        component = local.part.component
        mode = modes.get(path, "")
        space = mechanism.space.name
        laws = [law for law in component.laws("event") if law.holds_in(space) and law.acts_in(mode)]
        if not laws:
            continue
        bound = bind(component, reader.binding(local))
        for law in laws:
            value = call_law(path, law, partial(_evaluated, graph, bound, law))
            if value.is_constant or value in mechanism.table.values:
                continue
            options, target = law.options, law.options.target
            if not target and any(other.options.at == law.name for other in component.laws("update")):
                target = UPDATE
            elif target and target not in (*component.modes, "stop"):  # then it is the choice that says which
                target = local.part.values.get(target, target)
            found.append(
                EventFunction(
                    path, law.name, value, options.direction, target, options.message, options.unit, options.impact
                )
            )
    return (*found, *_of_contacts(mechanism, equations))


def _of_contacts(mechanism: Mechanism, equations: Equations) -> list[EventFunction]:
    """Return what tells that gaps and slips go over into another state; what cannot happen in a state is positive."""
    found: list[EventFunction] = []
    reads = [*(one.read for one in equations.contacts), *equations.multipliers]
    for one in equations.contacts:
        (part, law, _), unit = one.row.key, one.law.options.unit
        of = ALONG[unit]

        def watch(target: str, value: Expression, unit: str, message: str, rate: Expression | None = None) -> None:
            (placed,) = substitute([value], dict(equations.read))
            found.append(EventFunction(part, law, placed, -1, target, message, unit, False, rate=rate))  # noqa: B023

        if one.direction is None:
            rest, value = 1.0 - one.mask, one.row.value
            if value is None:
                watch(CLOSES, rest * one.row.rate + one.mask, f"{of}/s", "it runs free no longer")
            else:
                watch(CLOSES, rest * value + one.mask, of, "the gap closes", one.row.rate)
            force = one.mask * (one.row.multiplier + one.towards(1.0)[1]) + rest
            _, told = one.told({part: mechanism.locals_[part].part})
            if told is not None and told.target == "stop":
                law = told.law
                watch("stop", force, unit, told.message)
            else:
                watch(OPENS, force, unit, "the gap opens")
            continue
        assert one.limit is not None
        if one.row.key[2]:
            continue  # the second of two directions
        loose, pair = 1.0 - one.mask, [x for x in equations.contacts if x.row.key[:2] == one.row.key[:2]]
        sides = [x.direction for x in pair if x.direction is not None]
        if len(pair) == 1:
            reserves = [one.towards(-way)[1] - way * one.row.multiplier for way in (1.0, -1.0)]
        else:
            reserves = [one.towards(1.0)[1] - norm_of([x.row.multiplier for x in pair])]
        for reserve in reserves:
            watch(YIELDS, one.mask * reserve + loose, unit, "what sticks begins to slip")
        zero = one.mask.graph.zero
        acts = sum((side * side for side in sides), zero)
        if len(pair) == 1:
            watch(STOPS, one.direction * one.row.rate + (1.0 - acts), f"{of}/s", "what slips comes to rest")
        else:
            for target in (RESTS, RUNS):
                size = acts * norm_of([x.row.rate for x in pair]) + (1.0 - acts)
                watch(target, size if target == RESTS else -size, f"{of}/s", "what slips comes to rest, or runs")
        if not one.law.options.at and not depends_on(one.limit, reads):
            held = 1.0 - (1.0 - one.mask) * (1.0 - acts)
            watch(FREES, (2.0 * held - 1.0) * one.limit, unit, "the limit of friction passes zero")
    return found


def norm_of(values: Sequence[Expression]) -> Expression:
    """Return the root of the sum of squares."""
    total = values[0] * values[0]
    for one in values[1:]:
        total = total + one * one
    return values[0].graph.convert(sqrt(total))


def _evaluated(graph: Graph, bound: Any, law: Law) -> Expression:
    return finite_scalar(graph, getattr(bound, law.name)())
