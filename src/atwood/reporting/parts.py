"""What became of the parts of a scene: bodies, joints, what was merged and what was dropped."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from atwood.expr import Scalar, is_zero
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.model.compose.composite import Model
from atwood.model.compose.scene import Scene
from atwood.model.declare.function_values import Function
from atwood.model.local.parts import LocalPart
from atwood.topology.graph import Joint
from atwood.topology.spanning_forest import SpanningForest


@dataclass(frozen=True)
class BodyEntry:
    """Something that moves.

    Attributes
    ----------
    path
        The part it is named after, or its first connector.
    mass
        kg; zero for a point without mass.
    parts
        The parts that its mass comes from.
    """

    path: str
    mass: float
    parts: tuple[str, ...]


@dataclass(frozen=True)
class JointEntry:
    """A joint between two bodies.

    Attributes
    ----------
    path, kind
        The part, and the name of its class.
    joins
        The two bodies.
    coordinates
        Coordinates of the reduced form that come with it.
    closes_loop
        Whether no body hangs on it, so that it closes a loop.
    """

    path: str
    kind: str
    joins: tuple[str, str]
    coordinates: tuple[str, ...]
    closes_loop: bool


@dataclass(frozen=True)
class MergedPart:
    """A part that is one body with another; `into` is the name of that body."""

    path: str
    into: str


@dataclass(frozen=True)
class DroppedPart:
    """A part that leaves nothing in the equations, and why."""

    path: str
    why: str


@dataclass(frozen=True)
class ParameterEntry:
    """A parameter with its value."""

    path: str
    value: object
    unit: str
    meaning: str


def list_bodies(assembly: Assembly) -> tuple[tuple[BodyEntry, ...], tuple[str, ...]]:
    """Return what has mass and can move, and the names of what moves without mass."""
    mechanism, masses = assembly.mechanism, assembly.maximal.masses
    body_of = mechanism.bodies.body_of
    spread = {body_of[node] for one in masses.coupled for node in one.nodes}
    own = {(path, name) for path, one in mechanism.locals_.items() if one.lagrangians for name in one.connectors}
    own |= {(path, one.frame.name) for path, one in masses.varying}
    spread |= {body_of[mechanism.graph.node_of[end]] for end in own}
    found: list[BodyEntry] = []
    massless: list[str] = []
    for body in mechanism.bodies.bodies:
        if body.is_fixed:
            continue
        mass = masses.bodies.get(body.index)
        if mass is not None:
            found.append(BodyEntry(body.name, mechanism.value_at_start(mass.mass), mass.parts))
        elif body.index not in spread:
            massless.append(body.name)
    for part in dict.fromkeys(one.part for one in masses.coupled):
        entries = [m for one in masses.coupled if one.part == part for row in one.masses for m in row]
        total = sum(mechanism.value_at_start(entry) for entry in entries)
        found.append(BodyEntry(part, total, (part,)))
    found += [BodyEntry(path, mechanism.value_at_start(one.mass), (path,)) for path, one in masses.varying]
    order = {path: i for i, path in enumerate(assembly.flat.parts)}
    found.sort(key=lambda one: order.get(one.path, len(order)))
    return tuple(found), tuple(massless)


def list_joints(assembly: Assembly) -> tuple[JointEntry, ...]:
    """Return the joints between different bodies, in the order of declaration."""
    mechanism, forest = assembly.mechanism, assembly.reduced.forest
    bodies, loop_joints = mechanism.bodies, {id(joint) for joint in forest.loop_joints}
    names = {one.name for one in assembly.reduced.names}
    found: dict[str, JointEntry] = {}
    for joint in mechanism.graph.joints:
        ends = bodies.body_of[joint.a], bodies.body_of[joint.b]
        holds = any(not one.value.is_zero for one in mechanism.locals_[joint.part].constraints)
        if joint.is_rigid or ends[0] == ends[1] or not holds or joint.part in found:
            continue
        found[joint.part] = JointEntry(
            joint.part,
            type(assembly.flat.parts[joint.part].component).__name__,
            (bodies.bodies[ends[0]].name, bodies.bodies[ends[1]].name),
            tuple(name for name in _coordinates_of(forest, joint) if name in names),
            id(joint) in loop_joints,
        )
    return tuple(found.values())


def _coordinates_of(forest: SpanningForest, joint: Joint) -> Iterator[str]:
    """Yield the coordinates that place and turn the body that hangs on a joint."""
    for one in forest.attachments:
        if one.joint is not joint:
            continue
        yield from (forest.coordinates[number].name for number in one.coordinates)
        if joint.turns:
            for turn in forest.orientations:
                if turn.body == one.body and turn.coordinate is not None:
                    yield forest.coordinates[turn.coordinate].name


def list_ties(assembly: Assembly) -> tuple[str, ...]:
    """Return the parts that hold others by a constraint without being a joint, such as ropes."""
    mechanism = assembly.mechanism
    joints = {joint.part for joint in mechanism.graph.joints}
    return tuple(
        path
        for path, local in mechanism.locals_.items()
        if path not in joints and any(not one.value.is_zero for one in local.constraints)
    )


def list_merged(assembly: Assembly) -> Iterator[MergedPart]:
    """Yield the parts that are one body with another part, or with the world."""
    mechanism = assembly.mechanism
    for path, local in mechanism.locals_.items():
        body = _own_body(mechanism, path)
        if body is None or _is_anchor(mechanism, path):
            continue
        name = mechanism.bodies.bodies[body].name
        is_solid = bool(local.point_inertias or local.body_inertias) or any(j.law.options.rigid for j in local.joints)
        if is_solid and path != name and len(_solids(mechanism, body)) > 1:
            yield MergedPart(path, name)


def _own_body(mechanism: Mechanism, path: str) -> int | None:
    """Return the body that all connectors of a part belong to; None if there are several or none."""
    nodes = mechanism.graph.node_of
    bodies = {mechanism.bodies.body_of[nodes[path, name]] for name in mechanism.locals_[path].connectors}
    return bodies.pop() if len(bodies) == 1 else None


def _is_anchor(mechanism: Mechanism, path: str) -> bool:
    """Return whether a part is fixed in the world by its own law."""
    return any(joint.law.options.rigid and joint.law.options.a == "world" for joint in mechanism.locals_[path].joints)


def _solids(mechanism: Mechanism, body: int) -> list[str]:
    """Return the parts that lie in one body with all their connectors and have a shape or a mass."""
    return [
        path
        for path, local in mechanism.locals_.items()
        if (local.point_inertias or local.body_inertias or any(j.law.options.rigid for j in local.joints))
        and _own_body(mechanism, path) == body
    ]


def list_dropped(assembly: Assembly) -> Iterator[DroppedPart]:
    """Yield the parts that leave nothing in the equations."""
    mechanism = assembly.mechanism
    feeding = {source for source, _ in assembly.flat.links.values()}
    for path, local in mechanism.locals_.items():
        if path in feeding or local.joints or any(not one.value.is_zero for one in local.constraints):
            continue
        why = _why_nothing(mechanism, local)
        if why:
            yield DroppedPart(path, why)


def _why_nothing(mechanism: Mechanism, local: LocalPart) -> str:
    """Return why a part without joints and constraints leaves nothing in the equations; empty if it does."""
    inertias = [m for one in local.point_inertias for row in one.masses for m in row]
    inertias += [m for one in local.body_inertias for m in (one.mass, one.moment)]
    forces: list[Scalar] = [*local.potentials, *local.dissipations, *local.lagrangians]
    forces += [c for one in local.loads for c in (*one.force, *one.torque)]
    acts = any(local.part.component.laws(kind) for kind in ("potential", "dissipation", "force"))
    if not inertias and not forces and not acts:
        return "it only measures"
    if all(is_zero(value) for value in (*inertias, *forces)):
        return "it has no mass" if inertias else "its force is zero"
    fixed = {
        mechanism.bodies.bodies[mechanism.bodies.body_of[mechanism.graph.node_of[local.part.path, name]]].is_fixed
        for name in local.connectors
    }
    if fixed == {True}:
        return "it is fixed in the world" if inertias else "everything it joins is fixed in the world"
    return ""


def list_parameters(assembly: Assembly, scene: Model | None = None) -> tuple[ParameterEntry, ...]:
    """Return every parameter with its value, by path: those of the scene and its models, then those of the parts."""
    found = [] if scene is None else list(_of_model(scene))
    for path, part in assembly.flat.parts.items():
        for name, spec in part.component.parameter_specs().items():
            value = part.values[name]
            if value is not None:
                found.append(ParameterEntry(f"{path}.{name}", _shown(value), spec.unit.text, spec.doc))
    return tuple(found)


def _shown(value: Any) -> Any:
    """Return a value as data: a function as the text that it was given as."""
    return value.text if isinstance(value, Function) else value


def _of_model(model: Model) -> Iterator[ParameterEntry]:
    """Yield the parameters of a model and of the models in it; of their settings as scenes only the outermost's."""
    prefix = f"{model.path}." if model.path else ""
    values = model.parameters()
    for name, spec in model.parameter_specs().items():
        if values[name] is not None and not (prefix and name in Scene.parameter_specs()):
            yield ParameterEntry(f"{prefix}{name}", _shown(values[name]), spec.unit.text, spec.doc)
    for part in model.parts.values():
        if isinstance(part, Model):
            yield from _of_model(part)
