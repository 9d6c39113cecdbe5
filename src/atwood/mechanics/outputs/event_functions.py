"""Events of components as expressions of the state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from atwood.expr import Expression, Graph
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.mechanics.outputs.observables import Reader
from atwood.mechanics.outputs.reactions import Reaction
from atwood.model.declare.component import bind
from atwood.model.declare.law_results import call_law, finite_scalar
from atwood.model.declare.laws import Law

UPDATE = "update"
"""Target of an event that changes states of its part, and no mode."""


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
    return tuple(found)


def _evaluated(graph: Graph, bound: Any, law: Law) -> Expression:
    return finite_scalar(graph, getattr(bound, law.name)())
