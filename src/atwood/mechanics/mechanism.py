"""A scene as bodies and joints, before a form is chosen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from atwood.expr import Expression
from atwood.model.local import LocalPart, ParameterTable
from atwood.model.space import Space
from atwood.model.vector import Vector, as_vector
from atwood.topology.bodies import Bodies
from atwood.topology.graph import MechanismGraph

__all__ = ["Mechanism", "extent", "make_gravity"]


@dataclass(frozen=True)
class Mechanism:
    """A scene as bodies and joints on local symbols, before a form is chosen.

    Attributes
    ----------
    table
        The parameters.
    time
        The symbol of time.
    space
        What the scene lives in.
    gravity
        Acceleration of free fall, m/s^2, a symbol or zero.
    locals_, graph, bodies
        Parts, nodes and bodies.
    links
        For each linked input, the output that feeds it.
    """

    table: ParameterTable
    time: Expression
    space: Space
    gravity: Vector
    locals_: Mapping[str, LocalPart]
    graph: MechanismGraph
    bodies: Bodies
    links: Mapping[tuple[str, str], tuple[str, str]]


def extent(mechanism: Mechanism) -> float:
    """Return the extent of a mechanism, m: the largest length among the parameters of what moves; 0 if none is."""
    sizes = [0.0]
    for path, local in mechanism.locals_.items():
        bodies = {mechanism.bodies.body_of[mechanism.graph.node_of[path, name]] for name in local.connectors}
        if bodies == {0}:
            continue  # where the ground is says nothing about the size of what moves
        for name, spec in local.part.component.parameter_specs().items():
            value = local.part.values[name]
            if spec.unit.exponents == (0, 1, 0, 0) and value is not None:
                sizes += [abs(v) for v in (value if isinstance(value, tuple) else (value,))]
    return max(sizes)


def make_gravity(table: ParameterTable, value: float) -> Vector:
    """Return the acceleration of free fall as a vector."""
    pull = table.scalar("gravity", value)
    return as_vector((0.0, 0.0, -pull))
