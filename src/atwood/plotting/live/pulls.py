"""Bodies that a hand may pull: where parts join, a damped spring to a place, with no stiffness at first."""

from __future__ import annotations

from typing import Any

from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import replace
from atwood.model.declare.component import Component
from atwood.model.declare.connectors import Point, connector
from atwood.model.declare.field_functions import Number, Triple, parameter
from atwood.model.declare.law_results import Load
from atwood.model.declare.laws import force
from atwood.model.local.flatten import Part
from atwood.model.values.space import Vector, as_vector
from atwood.pipeline import assemble_flat

_MOST = 24
"""Beyond so many places bodies are pulled at their roots alone."""

PULL = "page pull "
"""No path of a part begins so."""


class Pull(Component):
    """A damped spring between a point and a place in the world."""

    stiffness: Number = parameter(1.0, unit="N/m", doc="Of the spring; zero where nothing pulls.")
    damping: Number = parameter(1.0, unit="N*s/m", doc="Of the damper; zero where nothing pulls.")
    target: Triple = parameter((1.0, 1.0, 1.0), size=3, doc="Where it pulls to.")
    point: Point = connector(Point, "What is pulled.")

    @force
    def pull(self) -> list[Load]:
        """Return the force, along the directions in which something can move."""
        apart: Vector = as_vector(self.target) - self.point.position
        return [Load(self.point, self.stiffness * apart - self.damping * self.point.velocity)]


def with_pulls(assembly: Assembly) -> tuple[Assembly, set[str]]:
    """Return a scene with a pull at places of what moves, and the names of what is zero while nothing pulls."""
    mechanism, flat = assembly.mechanism, assembly.flat
    at: dict[int, str] = {}
    for (part, name), node in mechanism.graph.node_of.items():
        spec = flat.parts[part].component.connector_specs().get(name) if part in flat.parts else None
        if spec is not None and issubclass(spec.kind, Point):
            at.setdefault(node, f"{part}.{name}")
    body_of = mechanism.bodies.body_of
    nodes = [node for node in at if body_of[node] != 0]
    if len(nodes) > _MOST:
        roots = {one.root for one in mechanism.bodies.bodies}
        nodes = [node for node in nodes if node in roots][:_MOST]
    made = Pull()
    values: dict[str, Any] = {"stiffness": 1.0, "damping": 1.0, "target": (1.0, 1.0, 1.0)}
    parts = {f"{PULL}{k}": Part(f"{PULL}{k}", made, values, {}) for k in range(len(nodes))}
    joined = tuple((f"{PULL}{k}.point", at[node]) for k, node in enumerate(nodes))
    pulled = replace(flat, parts={**flat.parts, **parts}, connections=(*flat.connections, *joined))
    zeros = {f"{path}.{name}" for path in parts for name in ("stiffness", "damping")}
    return assemble_flat(pulled, form=assembly.form, level=assembly.level or "ggl"), zeros


def pulls_of(assembly: Assembly) -> list[tuple[int, list[int]]]:
    """Return the nodes that can be pulled, and the numbers of stiffness, damping and place among all parameters."""
    numbers = {symbol.name: k for k, symbol in enumerate(assembly.parameters)}
    names = "stiffness", "damping", "target.x", "target.y", "target.z"
    places = [(part, node) for (part, _), node in assembly.mechanism.graph.node_of.items() if part.startswith(PULL)]
    return [(node, [numbers[f"{part}.{name}"] for name in names]) for part, node in places]
