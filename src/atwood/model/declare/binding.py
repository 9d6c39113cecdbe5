"""What laws are evaluated on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any

from atwood.expr import Scalar
from atwood.late import dataclass
from atwood.model.declare.connectors import Motion
from atwood.model.values.vector import Vector

if TYPE_CHECKING:
    from atwood.model.declare.component import Component

__all__ = ["Binding", "bind"]


@dataclass(frozen=True)
class Binding:
    """What the laws of a component are evaluated on: floats, expressions or sympy terms.

    Attributes
    ----------
    values
        Parameters and signals by name.
    motions
        What each connector knows, by name.
    time
        The time.
    space
        ``"line"``, ``"plane"`` or ``"space"``.
    line
        Unit vector of the line, for a scene on a line.
    line_signs
        On a line: +1 or -1 for a pair of connector names, the sign of the second's position minus the first's.
        None while the signs are not known yet.
    known
        Observables that are known without their formula, such as a joint coordinate.
    reactions
        Reactions by name.
    energies
        Energies and totals of the model that the component is placed in, by name; see `Component.total_around`.
    """

    values: Mapping[str, Any]
    motions: Mapping[str, Motion] = field(default_factory=dict)
    time: Scalar = 0.0
    space: str = "plane"
    line: Vector | None = None
    line_signs: Mapping[tuple[str, str], float] | None = None
    known: Mapping[str, Any] = field(default_factory=dict)
    reactions: Mapping[str, Any] = field(default_factory=dict)
    energies: Mapping[str, Any] = field(default_factory=dict)


def bind(component: Component, binding: Binding) -> Any:
    """Return the component with values in place of its fields, so that its laws can be evaluated.

    Parameters
    ----------
    component
        The component.
    binding
        Numbers, expressions or sympy terms for everything its laws may read.
    """
    twin = object.__new__(type(component))
    for name in ("_parent", "_name", "_settings"):
        object.__setattr__(twin, name, getattr(component, name))
    object.__setattr__(twin, "_bound", binding)
    return twin
