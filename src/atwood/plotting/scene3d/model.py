"""A scene in space put together from pieces that can be drawn: bodies, joints, feet, and what moves between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.lazy_dataclasses import dataclass
from atwood.plotting.canvas import COLOURS, STEEL
from atwood.plotting.scene3d.body_shapes import BodyShape, shape_of
from atwood.plotting.scene3d.pieces import Bench, Piece, Tip
from atwood.plotting.scene3d.reading import Joining, Reading, Tie
from atwood.plotting.scene3d.turning_parts import FORK, WHITE, add_gimbals, add_shafts, add_tops, pale
from atwood.plotting.shapes.meshes import box, cylinder, frame_along, revolved
from atwood.topology.graph import connected_groups

AXIS_COLOURS = (COLOURS[1], COLOURS[2], COLOURS[0])
"""Of x, y and z."""

_FEW = 8
"""So many bars can be told apart by their colours."""


@dataclass(frozen=True, eq=False)
class SpaceModel:
    """What is drawn of a scene in space.

    Attributes
    ----------
    reading
        Where everything is.
    unit
        A hundredth of its extent, m.
    pieces
        What is fixed in bodies.
    ties
        What goes between nodes.
    tips
        Points whose paths are drawn.
    heavy
        Point masses: node and colour.
    travels
        Whether it goes far beyond its own size, so that each time is framed by itself.
    """

    reading: Reading
    unit: float
    pieces: tuple[Piece, ...]
    ties: tuple[Tie, ...]
    tips: tuple[Tip, ...]
    heavy: tuple[tuple[int, str], ...]
    travels: bool = False


def build_model(reading: Reading) -> SpaceModel:
    """Return the pieces of a scene."""
    shapes = tuple(shape_of(lump) for lump in reading.lumps)
    # Rings and shafts have sizes of their own, so that the extent is known only when they are there.
    rough = _put_together(reading, shapes, *_extent(reading, shapes, []))
    return _put_together(reading, shapes, *_extent(reading, shapes, rough.pieces))


def _put_together(reading: Reading, shapes: tuple[BodyShape, ...], extent: float, travels: bool) -> SpaceModel:
    unit = 0.01 * extent
    drawn = tuple(shape if shape.kind == "point" else shape.drawn(1.2 * unit, 4.4 * unit) for shape in shapes)
    bench = Bench(reading, drawn, unit, _depths(reading))
    for node in reading.grounds:
        bench.feet.setdefault(node, [])
    add_tops(bench)
    add_gimbals(bench)
    add_shafts(bench)
    _add_bodies(bench)
    bench.part = ""
    _add_bars(bench)
    for joining in reading.joinings:
        if joining.part not in bench.drawn:
            bench.part = joining.part
            _SYMBOLS[joining.kind](bench, joining)
    heavy = _add_masses(bench)
    bench.part = ""
    _add_feet(bench)
    _add_tips(bench)
    return SpaceModel(reading, unit, tuple(bench.pieces), reading.ties, tuple(bench.tips), heavy, travels)


def _extent(reading: Reading, shapes: tuple[BodyShape, ...], pieces: Sequence[Piece]) -> tuple[float, bool]:
    """Return the larger side of what a scene takes up, m: ever, or at one time where it travels far beyond that.

    What moves on a plane of the world is not held to the place where this begins.
    """
    loose = {one.nodes[0] for one in reading.joinings if one.kind == "plane" and reading.body_of[one.nodes[0]] == 0}
    held = {one for each in reading.joinings if each.kind != "plane" for one in each.nodes} | {*reading.grounds} - loose
    held |= {node for tie in reading.ties for node in tie.nodes}
    points = [reading.place(node) for node in reading.used if reading.body_of[node] != 0 or node in held or not loose]
    corners = [(shape.lump.body, shape.corners) for shape in shapes]
    corners += [(piece.body, piece.corners) for piece in pieces if piece.body != 0]
    for body, some in corners:
        pose = reading.poses[body]
        low, high = some.min(axis=0), some.max(axis=0)
        points += [pose.place(np.where(pick, high, low)) for pick in np.ndindex(2, 2, 2)]
    if not points:
        return 1.0, False
    whole = float(np.max(np.ptp(np.concatenate(points), axis=0)))
    at_once = float(np.max(np.ptp(np.array(points), axis=0)))
    travels = bool(loose) and whole > 3.0 * at_once > 0.0
    return (at_once if travels else whole) or 1.0, travels


def _pairs(reading: Reading) -> list[tuple[int, int]]:
    """Return the pairs of bodies that a joint or something else holds together."""
    ends = [one.nodes for one in reading.joinings] + [(one.nodes[0], one.nodes[-1]) for one in reading.ties]
    return [(reading.body_of[a], reading.body_of[b]) for a, b in ends]


def _depths(reading: Reading) -> dict[int, int]:
    """Return how many joints each body is away from the world."""
    from networkx import Graph, single_source_shortest_path_length

    return dict(single_source_shortest_path_length(Graph([(0, 0), *_pairs(reading)]), 0))


# -- bodies ---------------------------------------------------------------------------------------------------------


def _add_bodies(bench: Bench) -> None:
    """Draw the shapes of bodies: bars in steel or, where they are few, each in a colour of its own."""
    bars = [shape for shape in bench.shapes if shape.is_long]
    compact = [shape for shape in bench.shapes if not shape.is_long]
    for shape in bench.shapes:
        body, bench.part = shape.lump.body, shape.lump.part
        if shape.kind == "point" or body in bench.clad:
            continue
        made = shape.mesh()
        if shape.is_long:
            number = bars.index(shape) % len(COLOURS)
            bench.surface(body, made, pale(COLOURS[number]) if 1 < len(bars) <= _FEW else STEEL)
            continue
        colour = pale(COLOURS[compact.index(shape) % len(COLOURS)], 0.25)
        hollow = any(bench.is_within(one, shape) for one in bench.shapes if one.lump.body != body)
        (bench.edges if hollow else bench.surface)(body, made, colour)
        if all(one.kind in ("ball", "cross") for one in bench.joinings(body)):
            _add_triad(bench, shape)


def _add_triad(bench: Bench, shape: BodyShape) -> None:
    """Draw the frame of a body: its axes from its origin to a little outside of the body."""
    body, lump = shape.lump.body, shape.lump
    origin = bench.reading.offsets[lump.node]
    for axis, colour in zip(lump.axes.T, AXIS_COLOURS, strict=True):
        bench.line(body, np.array([origin, origin + _outside(shape, origin, axis, 0.38) * axis]), 2.0, colour)


def _outside(shape: BodyShape, origin: FloatArray, axis: FloatArray, share: float) -> float:
    """Return how far an axis has to go from a point of a body to stand out of it, at least a share of its size, m."""
    along = (shape.center - origin) @ axis
    half = 0.5 * float(np.abs(shape.axes.T @ axis) @ shape.sides)
    return max(1.2 * float(along + half), share * float(np.max(shape.sides)))


def _add_bars(bench: Bench) -> None:
    """Join the nodes of each body to its shapes where they lie outside of them; or, without shapes, to each other."""
    reading, near = bench.reading, 1.5 * bench.unit
    for parent, child in reading.steps:
        body = reading.body_of[child]
        if not bench.of_body(body) and body not in bench.clad:
            bench.tube(body, reading.offsets[parent], reading.offsets[child], 0.9 * bench.unit, STEEL)
    for node in reading.used:
        body = reading.body_of[node]
        shapes = bench.of_body(body)
        if not shapes or body in bench.clad:
            continue
        place = reading.offsets[node]
        points = [shape.nearest(place) for shape in shapes]
        distances = [float(np.linalg.norm(point - place)) for point in points]
        best = int(np.argmin(distances))
        inside = shapes[best].girth if shapes[best].is_long else 0.0
        if distances[best] > max(near, inside):
            bench.tube(body, points[best], place, 0.9 * bench.unit, STEEL)


def _girth(bench: Bench, joining: Joining) -> float:
    """Return half the thickness of the bars that meet in a joint, m."""
    found = 0.0
    for node in joining.nodes:
        for shape in bench.of_body(bench.reading.body_of[node]):
            place = bench.reading.offsets[node]
            if shape.is_long and np.linalg.norm(shape.nearest(place) - place) <= shape.girth + bench.unit:
                found = max(found, shape.girth)
    return found


# -- joints ---------------------------------------------------------------------------------------------------------


def _add_hinge(bench: Bench, joining: Joining) -> None:
    unit, girth, node = bench.unit, _girth(bench, joining), joining.nodes[0]
    made = cylinder(max(1.2 * unit, 1.15 * girth), max(4.6 * unit, 2.5 * girth), around=24)
    place = made.placed(bench.reading.offsets[node], frame_along(joining.axes[0]))
    bench.surface(bench.reading.body_of[node], place, WHITE)


def _add_ball(bench: Bench, joining: Joining) -> None:
    node = joining.nodes[0]
    radius = max(1.7 * bench.unit, 1.25 * _girth(bench, joining))
    bench.ball(bench.reading.body_of[node], bench.reading.offsets[node], radius, "#f3f5f7")


def _add_cross(bench: Bench, joining: Joining) -> None:
    unit, girth = bench.unit, _girth(bench, joining)
    half = max(3.2 * unit, 1.9 * girth)
    if all(bench.reading.body_of[node] in bench.clad for node in joining.nodes):
        half = FORK * unit  # between two forks
    for node, axis in zip(joining.nodes, joining.axes, strict=True):
        body, place = bench.reading.body_of[node], bench.reading.offsets[node]
        bench.tube(body, place - half * axis, place + half * axis, max(0.8 * unit, 0.35 * girth), WHITE)


def _add_slide(bench: Bench, joining: Joining) -> None:
    unit, girth = bench.unit, _girth(bench, joining)
    reading, (a, b), axis = bench.reading, joining.nodes, joining.axes[0]
    body, other = reading.body_of[a], reading.body_of[b]
    start, end = joining.reach
    low, high = (reading.offsets[a] + s * axis for s in (min(start, 0.0), max(end, 0.0)))
    bars = [shape for shape in bench.of_body(body) if shape.is_long]
    if not any(_holds(shape, low, unit) or _holds(shape, high, unit) for shape in bars):
        reach = 7.0 * unit * axis
        bench.tube(body, low - reach, high + reach, 0.6 * unit, "#a9b4bf")
    half = max(1.5 * unit, 1.3 * girth)
    place, in_b = reading.offsets[b], reading.turns[b] @ reading.turns[a].T @ axis
    around = [s for s in bench.of_body(other) if not s.is_long and np.linalg.norm(s.center - place) < half]
    if any(float(np.min(shape.sides)) > 2.0 * half for shape in around):
        return  # the body itself is the block that slides
    sides = (2.0 * half, 2.0 * half, max(4.6 * unit, 3.2 * half))
    sleeve = cylinder(half, sides[2], around=24) if joining.turns else box(sides)
    bench.surface(other, sleeve.placed(place, frame_along(in_b, reading.turns[b][:, 0])), "#eef1f4")


def _holds(shape: BodyShape, point: FloatArray, slack: float) -> bool:
    return bool(np.linalg.norm(shape.nearest(point) - point) <= slack + shape.girth)


def _add_plane(bench: Bench, joining: Joining) -> None:
    node, unit = joining.nodes[0], bench.unit
    reading = bench.reading
    pose = reading.poses[reading.body_of[node]]
    frame = frame_along(joining.axes[0])
    shared = [one for one in reading.joinings if _is_same_plane(reading, joining, one, unit)]
    if shared[0] is not joining:
        return  # it is drawn with the first one
    lows, highs = [], []
    for one in shared:
        spread = np.einsum("tji,tj->ti", pose.axes, reading.place(one.nodes[1]) - reading.place(node)) @ frame[:, :2]
        margin = max(8.0 * unit, 1.1 * bench.radius_about(one.nodes[1]))
        lows.append(spread.min(axis=0) - margin)
        highs.append(spread.max(axis=0) + margin)
    low, high = np.min(lows, axis=0), np.max(highs, axis=0)
    lower = (
        0.3 if any(np.ptp([0.0, *one.reach]) > 0.1 * unit for one in shared) else 3.7
    )  # what slides within it is seen
    middle = reading.offsets[node] + frame[:, :2] @ (0.5 * (low + high)) - lower * unit * frame[:, 2]
    sides = (float(high[0] - low[0]), float(high[1] - low[1]), 0.5 * unit)
    bench.surface(
        reading.body_of[node],
        box(sides, cells=24 if any(one.reach[1] for one in shared) else 8).placed(middle, frame),
        "#eef1f4",
        None if reading.body_of[node] else frame[:, 2] * np.sign(np.round(sum(joining.reach) / unit, 1)),
    )


def _is_same_plane(reading: Reading, joining: Joining, other: Joining, unit: float) -> bool:
    """Return whether two joints hold something on one plane of one body."""
    if other.kind != "plane" or reading.body_of[other.nodes[0]] != reading.body_of[joining.nodes[0]]:
        return False
    normal, apart = joining.axes[0], reading.offsets[other.nodes[0]] - reading.offsets[joining.nodes[0]]
    return abs(float(normal @ other.axes[0])) > 1.0 - 1e-9 and abs(float(normal @ apart)) < 0.1 * unit


def _add_curve(bench: Bench, joining: Joining) -> None:
    node = joining.nodes[0]
    assert joining.curve is not None
    bench.line(bench.reading.body_of[node], bench.reading.offsets[node] + joining.curve, 2.2, "#8d99a6")


_SYMBOLS = {
    "hinge": _add_hinge,
    "ball": _add_ball,
    "cross": _add_cross,
    "slide": _add_slide,
    "plane": _add_plane,
    "curve": _add_curve,
}


# -- masses, feet and paths -----------------------------------------------------------------------------------------


def _add_masses(bench: Bench) -> tuple[tuple[int, str], ...]:
    """Draw point masses as balls; their volumes are as their masses."""
    points = [shape for shape in bench.shapes if shape.kind == "point"]
    heaviest = max((shape.lump.mass for shape in points), default=1.0)
    compact = [shape for shape in bench.shapes if not shape.is_long]
    heavy = []
    for shape in points:
        radius = 3.4 * bench.unit * (shape.lump.mass / heaviest) ** (1.0 / 3.0) * min(1.0, 8.0 / len(points))
        colour = COLOURS[compact.index(shape) % len(COLOURS)] if len(compact) <= len(COLOURS) else COLOURS[0]
        bench.part = shape.lump.part
        bench.ball(shape.lump.body, shape.center, max(radius, 1.1 * bench.unit), colour)
        heavy.append((shape.lump.node, colour))
    return tuple(heavy)


def _add_feet(bench: Bench) -> None:
    """Draw what is fixed in the world: a foot below it, or a bracket above it where the mechanism hangs down."""
    reading, unit = bench.reading, bench.unit
    planes = {one.nodes[0] for one in reading.joinings if one.kind == "plane"}
    for node, places in bench.feet.items():
        if node in planes:
            continue  # the plane is what is fixed
        middle = _held_height(bench, node)
        for place in places or [reading.offsets[node]]:
            hangs = reading.is_heavy and middle is not None and place[2] > middle + unit
            up = -1.0 if hangs else 1.0
            frame = np.diag([1.0, up, up])
            cone = revolved([(0.0, -3.4 * unit), (2.6 * unit, -3.4 * unit), (0.0, 0.0)], around=24)
            plate = box((9.0 * unit, 9.0 * unit, 0.9 * unit))
            bench.surface(0, cone.placed(place, frame), "#dde3e9")
            bench.surface(0, plate.placed(place - np.array([0.0, 0.0, 3.8 * unit * up]), frame), "#aeb8c2")


def _held_height(bench: Bench, node: int) -> float | None:
    """Return the mean height of everything that a node of the world holds, m; None where it holds nothing."""
    reading = bench.reading
    ends = [one.nodes for one in reading.joinings] + [(one.nodes[0], one.nodes[-1]) for one in reading.ties]
    beside = {reading.body_of[b if a == node else a] for a, b in ends if node in (a, b)} - {0}
    apart = [pair for pair in _pairs(reading) if 0 not in pair]  # what hangs together, not through the world
    groups = connected_groups(dict.fromkeys(reading.body_of.values()), apart)
    held = {body for group in groups if beside.intersection(group) for body in group}
    heights = [reading.place(other)[:, 2].mean() for other in reading.used if reading.body_of[other] in held]
    heights += [
        reading.poses[shape.lump.body].place(shape.center)[:, 2].mean()
        for shape in bench.shapes
        if shape.lump.body in held
    ]
    return float(np.mean(heights)) if heights else None


def _add_tips(bench: Bench) -> None:
    """Find points whose paths are worth seeing: of axes of bodies that turn about a point, of free ends of bars."""
    reading = bench.reading
    loaded = {shape.lump.body for shape in bench.shapes if shape.kind == "point"}  # whose mass leaves a path already
    for shape in bench.shapes:
        body = shape.lump.body
        if shape.kind == "point" or body in bench.clad or bench.children(body):
            continue
        joinings = bench.joinings(body)
        if shape.is_long:
            if len(joinings) == 1 and body not in loaded:
                held = next(reading.offsets[n] for n in joinings[0].nodes if reading.body_of[n] == body)
                bench.tips.append(Tip(body, max(shape.ends, key=lambda end: float(np.linalg.norm(end - held)))))
            continue
        fixed = [shape.center] if not joinings else []
        fixed += [reading.offsets[n] for one in joinings for n in one.nodes if reading.body_of[n] == body]
        if any(one.kind not in ("ball", "cross") for one in joinings) or len(joinings) > 1:
            continue
        paths = [reading.poses[body].place(point) for point in fixed]
        if np.max(np.ptp(paths[0], axis=0)) > 0.1 * bench.unit:
            if not joinings:
                bench.tips.append(Tip(body, shape.center))
            continue
        axis = shape.axis
        if (shape.center - fixed[0]) @ axis < -bench.unit:
            axis = -axis
        end = fixed[0] + _outside(shape, fixed[0], axis, 0.6) * axis
        bench.line(body, np.array([fixed[0], end]), 2.0, AXIS_COLOURS[2])
        bench.tips.append(Tip(body, end, fixed[0]))
