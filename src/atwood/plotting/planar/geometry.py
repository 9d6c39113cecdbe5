"""Places and shapes of parts in a plane, found from their laws and not from their names, slack ropes included."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import UsageError, suggestion
from atwood.expr import Expression, Scalar, depends_on
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.kinematics.mechanism import Mechanism, world_position
from atwood.mechanics.kinematics.orientation import body_offsets, plain
from atwood.model.declare.connectors import Groove
from atwood.model.local.parts import LocalPart
from atwood.model.values.outline import Outline
from atwood.plotting.planar.columns import spread_columns
from atwood.plotting.shapes.meshes import Mesh, joint_curve, outline_mesh, outline_of
from atwood.result.result import Result
from atwood.result.segment_quantities import shown_values

Kind = Literal[
    "ground",
    "rail",
    "curve",
    "path",
    "rope",
    "spring",
    "damper",
    "solid",
    "spiral",
    "link",
    "rod",
    "pulley",
    "pivot",
    "mass",
]
"""Those that are drawn first, and so behind the others, stand first."""


@dataclass(frozen=True, eq=False)
class Shape:
    """What a part looks like.

    Attributes
    ----------
    part
        Its path.
    kind
        How it is drawn.
    nodes
        Between which nodes, in order.
    size
        Mass of a mass, kg; radius of a disc that stands for an inertia, m; zero otherwise.
    surface
        Of a solid its surface, in the axes of its node.
    line
        Of a curve its points from its node, in the axes of that, m, shape (points, 2).
    """

    part: str
    kind: Kind
    nodes: tuple[int, ...]
    size: float = 0.0
    surface: Mesh | None = None
    line: FloatArray | None = None

    @cached_property
    def rim(self) -> FloatArray:
        """Of a solid the points of its surface that are farthest out on the page, in the axes of its node, m."""
        assert self.surface is not None
        page = self.surface.vertices[:, [0, 2]]
        turn = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
        return np.asarray(page[np.unique(np.argmax(page @ np.array([np.cos(turn), np.sin(turn)]), axis=0))])


@dataclass(frozen=True, eq=False)
class Picture:
    """A mechanism on the page along a run.

    Attributes
    ----------
    time
        Times, s.
    points
        Place of each node on the page, shape (times, 2).
    shapes
        What to draw.
    direction
        For a scene on a line: ``"across"`` or ``"up"``; empty in the plane.
    radii
        On a vertical line: radius of each pulley by its groove's node.
    angles
        Of the nodes of solids and curves: how they are turned, counter-clockwise, rad, shape (times,).
    pulls
        For the path of each rope, when it holds its ends together, shape (times,).
    """

    time: FloatArray
    points: Mapping[int, FloatArray]
    shapes: tuple[Shape, ...]
    direction: str
    radii: Mapping[int, float]
    angles: Mapping[int, FloatArray] = field(default_factory=dict)
    pulls: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)

    def spare(self, shape: Shape, moment: int) -> float:
        """Return how much longer a rope is than the way along its nodes, m; below zero for one that was let go."""
        if self.pulls[shape.part][moment] or not np.any(self.pulls[shape.part]):
            return 0.0
        stops = np.array([self.points[node] for node in shape.nodes])
        way = np.linalg.norm(np.diff(stops, axis=0), axis=2).sum(axis=0)
        return float(np.max(way[self.pulls[shape.part]]) - way[moment])

    @cached_property
    def extent(self) -> float:
        """The larger side of what is drawn."""
        return float(np.max(np.ptp(self.everything(), axis=0))) or 1.0

    def everything(self, shown: slice = slice(None)) -> FloatArray:
        """Return the places that hold all that is drawn at some of the times, shape (places, 2)."""
        places = [points[shown] for points in self.points.values()]
        if not places:
            raise UsageError("nothing in it has a place to be drawn", advice="`plot` draws signals over time.")
        for shape in self.shapes:
            if shape.surface is not None or shape.line is not None:
                angles = self.angles[shape.nodes[0]][shown, None]
                x, z = shape.rim.T if shape.line is None else shape.line.T
                turned = np.stack([x * np.cos(angles) - z * np.sin(angles), x * np.sin(angles) + z * np.cos(angles)], 2)
                middle = self.points[shape.nodes[0]][shown]
                places += [middle + turned.min(axis=1), middle + turned.max(axis=1)]
        return np.concatenate(places)


def find_connectors(result: Result, paths: str | Sequence[str]) -> dict[str, int]:
    """Return the nodes of connectors."""
    found = {}
    nodes = result.assembly.mechanism.graph.node_of
    known = {f"{part}.{name}": node for (part, name), node in nodes.items()}
    for path in paths:
        below = [one for one in known if one == path or one.rpartition(".")[0] == path]
        if len(below) > 1:
            raise UsageError("it has several connectors", where=path, advice=f"Choose one: {', '.join(below)}.")
        if not below:
            raise UsageError("there is no such connector", where=path, advice=suggestion(path, known))
        found[path] = known[below[0]]
    return found


def make_picture(result: Result, also: Iterable[int] = ()) -> Picture:
    """Return where everything is on the page along a run of a scene in a plane or on a line."""
    mechanism = result.assembly.mechanism
    shapes = _shapes(mechanism)
    points = _node_points(result)
    used = {node for shape in shapes for node in shape.nodes} | set(also)
    points = {node: values for node, values in points.items() if node in used}
    direction = ""
    radii: dict[int, float] = {}
    if mechanism.space.line is not None:
        axis = mechanism.space.line
        direction = "up" if abs(float(axis.z)) > abs(float(axis.x)) else "across"
        if direction == "up":
            ropes = [shape.nodes for shape in shapes if shape.kind == "rope"]
            others = [shape.nodes for shape in shapes if shape.kind != "rope" and len(shape.nodes) > 1]
            heights = np.concatenate([values[:, 1] for values in points.values()])
            columns, places, radii = spread_columns(
                ropes, others, mechanism.bodies.body_of, 0.11 * float(np.ptp(heights) or 1.0)
            )
            for node, values in points.items():
                values[:, 0] = places.get(node, columns.get(mechanism.bodies.body_of[node], 0.0))
            _place_grounds(mechanism, shapes, points, columns)
    turned = [shape.nodes[0] for shape in shapes if shape.surface is not None or shape.kind in ("curve", "path")]
    angles = _node_angles(result, turned)
    pulls = {one.part: pulling(result, one.part) for one in shapes if one.kind == "rope"}
    drawn = [_followed(shape, points, angles) if shape.kind == "path" else shape for shape in shapes]
    spans: dict[int, float] = {}
    for one in (shape for shape in shapes if shape.kind == "link"):
        first, last = (points[node][0] for node in one.nodes)
        body = mechanism.bodies.body_of[one.nodes[0]]
        spans[body] = max(spans.get(body, 0.0), float(np.linalg.norm(last - first)))
    drawn = [_beside_links(one, spans.get(mechanism.bodies.body_of[one.nodes[0]], 0.0)) for one in drawn]
    return Picture(result.time, points, tuple(drawn), direction, radii, angles, pulls)


def _beside_links(shape: Shape, span: float) -> Shape:
    """Return the disc of a body that links belong to so small that these, as long as `span`, are seen beside it."""
    if shape.kind != "solid" or not 0.0 < 0.15 * span < shape.size or shape.surface is None:
        return shape
    share, middle = 0.15 * span / shape.size, shape.surface.vertices.mean(axis=0)
    return replace(shape, surface=shape.surface.placed((1.0 - share) * middle, share * np.eye(3)))


def _followed(shape: Shape, points: Mapping[int, FloatArray], angles: Mapping[int, FloatArray]) -> Shape:
    """Return, as a curve, the way of a shape's second node as seen from its first one."""
    base, rider = shape.nodes
    c, s = np.cos(angles[base]), np.sin(angles[base])
    x, z = (points[rider] - points[base]).T
    return replace(shape, kind="curve", nodes=(base,), line=np.column_stack([x * c + z * s, z * c - x * s]))


def _place_grounds(
    mechanism: Mechanism, shapes: list[Shape], points: dict[int, FloatArray], columns: Mapping[int, float]
) -> None:
    """Put what is fixed in the column of what hangs on it."""
    for shape in shapes:
        if shape.kind == "pulley" and mechanism.bodies.body_of[shape.nodes[0]] == 0:
            points[shape.nodes[1]][:, 0] = points[shape.nodes[0]][:, 0]
            continue
        for one, other in zip(shape.nodes, shape.nodes[1:], strict=False):
            for node, partner in ((one, other), (other, one)):
                body, beside = mechanism.bodies.body_of[node], mechanism.bodies.body_of[partner]
                if body == 0 and beside != 0 and shape.kind != "rope":
                    points[node][:, 0] = columns.get(beside, 0.0)


def _node_points(result: Result) -> dict[int, FloatArray]:
    """Return x and z of every node at the output times."""
    nodes = sorted(result.assembly.own_equations.kinematics.placements.positions)

    def places(assembly: Assembly) -> Iterator[Scalar]:
        for node in nodes:
            placements = assembly.own_equations.kinematics.placements
            where = assembly.mechanism.space.vector(world_position(assembly.mechanism, placements, node))
            yield from (where.x, where.z)

    whole = _along_run(result, "places", places)
    return {node: whole[2 * i : 2 * i + 2].T.copy() for i, node in enumerate(nodes)}


def _node_angles(result: Result, nodes: Sequence[int]) -> dict[int, FloatArray]:
    """Return, in a plane, how nodes are turned at the output times; what has no orientation is not turned."""
    if not nodes:
        return {}

    def angles(assembly: Assembly) -> Iterator[Scalar]:
        mechanism, known = assembly.mechanism, assembly.own_equations.kinematics.placements.angles
        for node in nodes:
            body = mechanism.bodies.bodies[mechanism.bodies.body_of[node]]
            own = known.get(body.index)
            yield (0.0 if own is None else own) + plain(body_offsets(body, mechanism.space)[1][node])

    return dict(zip(nodes, _along_run(result, "angles", angles), strict=True))


def _along_run(result: Result, name: str, quantities: Callable[[Assembly], Iterable[Scalar]]) -> FloatArray:
    """Return quantities of the configuration at the output times, shape (quantities, times)."""
    pieces = [shown_values(one, name, quantities(one.assembly)) for one in result.run.segments]
    return np.concatenate(pieces, axis=1)


def _shapes(mechanism: Mechanism) -> list[Shape]:
    """Return the shapes of all parts, those that are drawn first in front."""
    found: list[Shape] = []
    for path, local in mechanism.locals_.items():
        found += _shapes_of(mechanism, path, local)
    order = get_args(Kind)
    return sorted(found, key=lambda shape: order.index(shape.kind))


def _shapes_of(mechanism: Mechanism, path: str, local: LocalPart) -> list[Shape]:
    """Return what a part looks like, from what its laws do."""
    kinds = {name: one for name, one in local.part.component.connectors().items() if name in local.connectors}
    nodes = {name: mechanism.graph.node_of[path, name] for name in kinds}
    ends = [nodes[name] for name, one in kinds.items() if not isinstance(one, Groove)]
    grooves = [nodes[name] for name, one in kinds.items() if isinstance(one, Groove)]
    outline = outline_of(local) if mechanism.space.is_planar else None
    if outline is not None:
        node = nodes[outline.frame] if outline.frame else ends[0]
        if outline.kind == "nothing":
            return []
        if outline.kind == "path":
            return [Shape(path, "path", (ends[0], node))]
        return [Shape(path, "solid", (node,), surface=outline_mesh(outline, around=120))]
    for joint in local.joints if mechanism.space.is_planar else ():
        line = joint_curve(mechanism, path, joint) if joint.placement.axes == "a" else None
        if line is not None and joint.law.options.a != "world":
            return [Shape(path, "curve", (nodes[joint.law.options.a],), line=line[:, [0, 2]])]
    masses = [one for one in local.point_inertias if len(one.points) == 1]
    weight = sum(mechanism.value_at_start(one.masses[0][0]) for one in masses)
    joints = [joint.law.options for joint in local.joints]
    if any(options.rigid and options.a == "world" for options in joints):
        return [Shape(path, "ground", tuple(ends))]
    if grooves and any(options.rigid for options in joints):
        return [Shape(path, "pulley", (grooves[0], *ends[:1]), weight)]
    if len(ends) == 2:
        return _between(mechanism, path, local, (ends[0], ends[1]), grooves)
    if local.body_inertias and len(ends) == 1 and mechanism.space.is_planar:
        return _bodies(mechanism, path, local, ends[0])
    if len(ends) == 3 and not local.body_inertias and len(local.joints) > 1:
        return _between(mechanism, path, local, (ends[0], ends[1]), grooves)
    if masses and ends:
        rail = [Shape(path, "rail", (0, ends[0]))] if joints and mechanism.space.is_planar else []
        return [*rail, Shape(path, "mass", (ends[0],), weight)]
    return []


def _bodies(mechanism: Mechanism, path: str, local: LocalPart, node: int) -> list[Shape]:
    """Return bodies that do not say what they look like: uniform discs of their masses and moments."""
    found = []
    for body in local.body_inertias:
        mass, moment = mechanism.values_at_start([body.mass, body.moment])
        center = mechanism.values_at_start(body.center_of_mass)
        if mass > 0.0 and moment > 0.0:
            radius = float(np.sqrt(2.0 * moment / mass))
            profile = [(0.0, -0.1 * radius), (radius, -0.1 * radius), (radius, 0.1 * radius), (0.0, 0.1 * radius)]
            disc = outline_mesh(Outline.revolved(profile, "y"), around=120)
            found.append(Shape(path, "solid", (node,), radius, disc.placed(center, np.eye(3))))
        elif mass > 0.0 and not np.any(center):
            found.append(Shape(path, "mass", (node,), mass))
    return found


def _between(
    mechanism: Mechanism, path: str, local: LocalPart, ends: tuple[int, int], grooves: list[int]
) -> list[Shape]:
    """Return what a part with two ends looks like."""
    joints = list(local.joints)
    if local.contacts and not local.may_hold:  # nothing is between what touches only now and then
        return []
    if grooves or local.may_hold or (local.constraints and not joints):
        return [Shape(path, "rope", (ends[0], *grooves, ends[1]))]
    if any(joint.law.options.rigid for joint in joints):
        return [Shape(path, "link", ends)]
    if local.potentials or local.dissipations:
        places = [symbol for symbols in local.connectors.values() for symbol in (*symbols.position, *symbols.velocity)]
        if not depends_on((*local.potentials, *local.dissipations), places):
            return [Shape(path, "spiral", ends)] if mechanism.space.is_planar else []
        return [Shape(path, "spring" if local.potentials else "damper", ends)]
    if joints:
        shifts = [c for joint in joints for c in joint.placement.displacement]
        if all(not isinstance(c, Expression) and c == 0.0 for c in shifts):
            return [Shape(path, "pivot", (ends[1],))]
        is_rod = any(joint.placement.axes == "world" and joint.placement.rotation is None for joint in joints)
        radius = local.part.values.get("radius", 0.0)  # of what rolls on a line, and not through it
        rolls = float(radius) if isinstance(radius, (int, float)) else 0.0
        return [Shape(path, "rod", ends) if is_rod else Shape(path, "rail", ends, rolls)]
    return []


def pulling(result: Result, part: str) -> NDArray[np.bool_]:
    """Return at which output times a rope has a law that acts: slack, or let go, it has none."""
    pieces = []
    for segment in result.run.segments:
        local, assembly = segment.assembly.mechanism.locals_[part], segment.assembly
        held = dict(zip((one.symbol for one in assembly.discrete_states), assembly.held_now, strict=True))
        acts = bool(local.constraints or local.joints or local.potentials)
        acts |= any(held[one.mask] for one in local.contacts)
        pieces.append(np.full(len(segment.time), acts)[segment.shown])
    return np.concatenate(pieces)


def hanging(ends: FloatArray, spare: float) -> FloatArray:
    """Return a slack rope as a parabola, about as much longer than the straight way as it has to spare."""
    share = np.linspace(0.0, 1.0, 41)[:, None]
    sag = np.sqrt(0.375 * spare * (float(np.linalg.norm(ends[1] - ends[0])) + 0.5 * spare))
    return np.asarray(ends[0] + share * (ends[1] - ends[0]) - np.array([0.0, 4.0 * sag]) * share * (1.0 - share))
