"""What a page draws of a run: frames that move, and surfaces, lines and ties that are fixed in them, as plain data.

Frames are bodies in space and nodes in a plane.  Everything else is said in their axes, so that a page can draw a
motion that it has computed itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.mechanics.kinematics.orientation import body_offsets, plain
from atwood.plotting.camera import DEFAULT_VIEW, as_camera
from atwood.plotting.canvas import COLOURS, GREY
from atwood.plotting.planar.geometry import Picture, Shape, make_picture
from atwood.plotting.planar.strokes import TIES, Item as Item, Pen, line_of
from atwood.plotting.scene3d.picture import SpacePicture, make_space_picture
from atwood.plotting.shapes.meshes import Mesh
from atwood.result.result import Result

FLAT, SPATIAL = 3, 12
"""Numbers of a frame: x, z and angle in a plane; its origin and its axes, the columns of a matrix by rows, in space."""


@dataclass(frozen=True, eq=False)
class Stage:
    """What is drawn of a run.

    Attributes
    ----------
    stride
        Numbers of a frame: `FLAT` or `SPATIAL`.
    keys
        Of each frame its node in a plane, or its body in space.
    poses
        Frames at the output times, shape (times, frames, stride).
    items
        What is drawn, first what is behind.
    trails
        Points whose paths are drawn: `frame`, `point`, `colour`.
    anchors
        Where arrows of a part begin: its frame, and its place in the axes of that, m.
    box
        Corners of what is taken up along the run, m, shape (2, 3).
    unit
        A hundredth of the extent, m.
    floor
        Corners of the floor and the distance between its lines, m; None where there is none.
    follows
        Whether the eye goes along with what moves.
    bodies, turns
        In a plane the body of each node, and by which angle the node is turned in it, rad.
    columns
        On a vertical line, where nodes stand across it, m.
    """

    stride: int
    keys: tuple[int, ...]
    poses: FloatArray
    items: tuple[Item, ...]
    trails: tuple[Item, ...]
    anchors: Mapping[str, tuple[int, FloatArray]]
    box: FloatArray
    unit: float
    floor: Mapping[str, Any] | None = None
    follows: bool = False
    bodies: tuple[int, ...] = ()
    turns: tuple[float, ...] = ()
    columns: Mapping[int, float] = field(default_factory=dict)

    def to_data(self) -> dict[str, Any]:
        """Return all but the poses as plain data with arrays in it."""
        anchors = {part: {"frame": frame, "point": point} for part, (frame, point) in self.anchors.items()}
        frames = {"keys": self.keys, "bodies": self.bodies, "turns": self.turns, "columns": dict(self.columns)}
        told = {"stride": self.stride, "frames": frames, "items": self.items, "trails": self.trails, "anchors": anchors}
        return {**told, "box": self.box, "unit": self.unit, "floor": self.floor, "follows": self.follows}


def set_stage(result: Result) -> Stage:
    """Return what is drawn of a run."""
    if result.assembly.mechanism.space.name == "space":
        return _in_space(result, make_space_picture(result, as_camera(DEFAULT_VIEW)))
    return _in_plane(result, make_picture(result, _anchor_nodes(result).values()))


def _anchor_nodes(result: Result) -> dict[str, int]:
    """Return the node of the first connector of each part."""
    found: dict[str, int] = {}
    for (part, _), node in result.assembly.mechanism.graph.node_of.items():
        found.setdefault(part, node)
    return found


# -- in space -------------------------------------------------------------------------------------------------------


def _in_space(result: Result, picture: SpacePicture) -> Stage:
    model, reading = picture.model, picture.model.reading
    keys = tuple(reading.poses)
    number = {key: k for k, key in enumerate(keys)}
    poses = [np.concatenate([one.origin, one.axes.reshape(-1, 9)], axis=1) for one in reading.poses.values()]
    named: dict[int, str] = {}
    for lump in reading.lumps:
        named.setdefault(lump.body, lump.part)
    items: list[Item] = []
    for piece in model.pieces:
        told = {"part": piece.part or named.get(piece.body, ""), "frame": number[piece.body], "colour": piece.colour}
        if piece.mesh is not None:
            items += _surface(piece.mesh, told)
        elif piece.points is not None and len(piece.points) == 1:
            items.append({**told, "kind": "ball", "point": piece.points[0], "size": piece.size})
        else:
            items.append({**told, "kind": "line", "points": piece.points, "width": piece.size})
    body_of, offsets = reading.body_of, reading.offsets
    for tie in model.ties:
        ends = [{"frame": number[body_of[node]], "point": offsets[node]} for node in tie.nodes]
        items.append({"kind": tie.kind, "part": tie.part, "ends": ends})
    trails = [
        {"frame": number[body_of[node]], "point": offsets[node], "colour": colour} for node, colour in model.heavy
    ]
    for k, tip in enumerate(model.tips):
        trails.append({"frame": number[tip.body], "point": tip.point, "colour": COLOURS[(1 + k) % len(COLOURS)]})
    anchors = {part: (number[body_of[node]], offsets[node]) for part, node in _anchor_nodes(result).items()}
    cloud, floor = picture.cloud, picture.floor
    told_floor = None if floor is None else {"box": floor, "step": picture.step}
    box = np.array([cloud.min(axis=0), cloud.max(axis=0)])
    shown = np.stack(poses, axis=1), tuple(items), tuple(trails), anchors, box, model.unit
    return Stage(SPATIAL, keys, *shown, told_floor, model.travels)


def _surface(mesh: Mesh, told: Item) -> Iterator[Item]:
    """Return a surface as triangles, its marked faces apart, and its sharp edges."""
    for marked in (False, True):
        faces = mesh.faces[mesh.marked == marked]
        if len(faces):
            yield {
                **told,
                "kind": "mesh",
                "vertices": mesh.vertices.astype(np.float32),
                "faces": triangles(faces),
                "marked": marked,
            }


def triangles(faces: Any) -> Any:
    """Return faces with four corners as triangles, without those that have no area."""
    both = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    a, b, c = both.T
    return both[(a != b) & (b != c) & (c != a)].astype(np.int32)


# -- in a plane, and on a line ----------------------------------------------------------------------------------------


def _in_plane(result: Result, picture: Picture) -> Stage:
    pen = Pen(picture)
    keys = tuple(picture.points)
    number = {key: k for k, key in enumerate(keys)}
    zeros = np.zeros(len(picture.time))
    poses = [np.column_stack([picture.points[key], picture.angles.get(key, zeros)]) for key in keys]
    items = [item for shape, marks in pen.marks for item in _flat_items(pen, shape, marks, number)]
    free = [one for one in pen.heavy if one.nodes[0] not in pen.sliding and not picture.direction]
    origin = np.zeros(3)
    trails = [{"frame": number[one.nodes[0]], "point": origin, "colour": pen.colour(one)} for one in free]
    columns = {key: float(picture.points[key][0, 0]) for key in keys} if picture.direction == "up" else {}
    nodes = _anchor_nodes(result)
    anchors = {part: (number[node], origin) for part, node in nodes.items() if node in number}
    everything = picture.everything()
    lows, highs = everything.min(axis=0), everything.max(axis=0)
    margin = 4.0 * pen.unit + max(picture.radii.values(), default=0.0)
    box = np.array([[lows[0] - margin, 0.0, lows[1] - margin], [highs[0] + margin, 0.0, highs[1] + margin]])
    bodies, turns = _turned(result.assembly.mechanism, keys)
    shown = np.stack(poses, axis=1), tuple(items), tuple(trails), anchors, box, pen.unit
    return Stage(FLAT, keys, *shown, bodies=bodies, turns=turns, columns=columns)


def _turned(mechanism: Mechanism, keys: Sequence[int]) -> tuple[tuple[int, ...], tuple[float, ...]]:
    """Return the bodies of nodes, and how far these are turned in them, rad."""
    body_of, turns = mechanism.bodies.body_of, []
    for key in keys:
        offsets = (
            body_offsets(mechanism.bodies.bodies[body_of[key]], mechanism.space)[1] if mechanism.space.is_planar else {}
        )
        turns.append(mechanism.value_at_start(plain(offsets[key])) if key in offsets else 0.0)
    return tuple(body_of[key] for key in keys), tuple(turns)


def _flat_items(pen: Pen, shape: Shape, marks: Sequence[Item], number: Mapping[int, int]) -> Iterable[Item]:
    """Return what a part in a plane looks like, as its pen draws it."""
    ends: list[Item] = [{"frame": number[node], "radius": pen.picture.radii.get(node, 0.0)} for node in shape.nodes]
    if shape.kind not in TIES:
        return [{"part": shape.part, "frame": ends[0]["frame"], **_as_seen(one)} for one in marks]
    if shape.kind == "rail":
        fixed = pen.rails[shape.part]
        if fixed is not None:
            return [{"part": shape.part, "frame": -1, **line_of(fixed, 1.2, GREY)}]
        if shape.size:
            return []
    item: Item = {"kind": shape.kind, "part": shape.part, "ends": ends}
    if shape.kind == "rope":
        spare = [pen.picture.spare(shape, moment) for moment in range(len(pen.picture.time))]
        item |= {"spare": np.array(spare)} if np.any(spare) else {}
    return [item]


def _as_seen(mark: Item) -> Item:
    """Return a mark as pages take it: triangles, and places in single precision."""
    told = {key: one for key, one in mark.items() if key not in ("points", "is_pin")}
    if mark["kind"] == "disc":
        return told
    if mark["kind"] == "mesh":
        told.pop("edge", None)  # pages draw no borders
        return {**told, "vertices": mark["points"].astype(np.float32), "faces": triangles(mark["faces"])}
    return {**told, "points": mark["points"].astype(np.float32) if mark["kind"] == "edges" else mark["points"]}
