"""Shapes and motion of a run as glTF 2.0, in one binary file (.glb) that browsers, Blender and viewers show.

The format: Khronos Group, glTF 2.0 Specification, https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html. Its y axis
is up and its numbers are of single precision, so that nothing is computed from such a file again.
"""

from __future__ import annotations

import json
import struct
from dataclasses import field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.files import write_atomically
from atwood.lazy_dataclasses import dataclass
from atwood.plotting.pages.stage import Item, Stage, set_stage, triangles
from atwood.plotting.shapes.meshes import cylinder, frame_along, revolved
from atwood.result.result import Result

_FLOAT, _ARRAY_BUFFER, _LINE_STRIP, _TRIANGLES = 5126, 34962, 3, 4
_TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}


def write_gltf(result: Result, file: Path) -> Path:
    """Write shapes and motion of a run in space as a ``.glb`` file, and return its path.

    Parameters
    ----------
    result
        The run.
    file
        The file.

    Raises
    ------
    UsageError
        If the scene is not in space, nothing of it has a place, or the file cannot be written.
    """
    if result.assembly.mechanism.space.name != "space":
        raise UsageError("only scenes in space have shapes with a thickness", where=str(file), advice="Use to_html.")
    stage = set_stage(result)
    if not stage.items:
        raise UsageError("nothing of it has a place to be drawn", where=str(file))
    book = _Book(_times(result.time))
    _add_bodies(book, stage, result.time)
    _add_ties(book, stage)
    data = book.packed()
    write_atomically(file, lambda part: part.write_bytes(data))
    return file


@dataclass(eq=False)
class _Book:
    """What a file holds, and the numbers behind it.

    Attributes
    ----------
    kept
        Output times that are kept: those that single precision tells apart.
    """

    kept: Any
    chunks: list[bytes] = field(default_factory=list)
    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)
    meshes: list[dict[str, Any]] = field(default_factory=list)
    materials: dict[str, int] = field(default_factory=dict)
    nodes: list[dict[str, Any]] = field(default_factory=list)
    channels: list[dict[str, Any]] = field(default_factory=list)
    samplers: list[dict[str, Any]] = field(default_factory=list)
    clock: int = -1

    def add(self, values: Any, bounds: bool = False, target: int | None = None) -> int:
        """Add numbers, and return where they are."""
        array = np.ascontiguousarray(values, dtype="<f4")
        view: dict[str, Any] = {"buffer": 0, "byteOffset": sum(map(len, self.chunks)), "byteLength": array.nbytes}
        self.views.append({**view, **({} if target is None else {"target": target})})
        self.chunks.append(array.tobytes())
        width = 1 if array.ndim == 1 else array.shape[1]
        given = {"bufferView": len(self.views) - 1, "componentType": _FLOAT, "count": len(array), "type": _TYPES[width]}
        if bounds:
            rows = array.reshape(len(array), width)
            given.update(min=rows.min(axis=0).tolist(), max=rows.max(axis=0).tolist())
        self.accessors.append(given)
        return len(self.accessors) - 1

    def primitive(self, colour: str, points: FloatArray, normals: FloatArray | None = None) -> dict[str, Any]:
        """Return triangles, or a line where there are no normals."""
        attributes = {"POSITION": self.add(points, True, _ARRAY_BUFFER)}
        if normals is not None:
            attributes["NORMAL"] = self.add(normals, False, _ARRAY_BUFFER)
        material = self.materials.setdefault(colour, len(self.materials))
        mode = _LINE_STRIP if normals is None else _TRIANGLES
        return {"attributes": attributes, "material": material, "mode": mode}

    def node(self, name: str, primitives: list[dict[str, Any]], motion: dict[str, Any]) -> None:
        """Add a node that moves: `motion` has translation, rotation and scale, each with a row for each time."""
        self.meshes.append({"name": name, "primitives": primitives})
        self.nodes.append({"name": name, "mesh": len(self.meshes) - 1})
        for path, rows in motion.items():
            values = rows[self.kept]
            self.nodes[-1][path] = values[0].tolist()
            if len(values) < 2 or np.array_equal(values, np.broadcast_to(values[:1], values.shape)):
                continue
            self.samplers.append({"input": self.clock, "output": self.add(values), "interpolation": "LINEAR"})
            target = {"node": len(self.nodes) - 1, "path": path}
            self.channels.append({"sampler": len(self.samplers) - 1, "target": target})

    def packed(self) -> bytes:
        """Return the file."""
        root = {
            "name": "world",
            "children": list(range(len(self.nodes))),
            "rotation": [-(0.5**0.5), 0.0, 0.0, 0.5**0.5],
        }
        data = b"".join(self.chunks)
        said: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "Atwood"},
            "scene": 0,
            "scenes": [{"nodes": [len(self.nodes)]}],
            "nodes": [*self.nodes, root],
            "meshes": self.meshes,
            "materials": [_material(colour) for colour in self.materials],
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(data)}],
        }
        if self.channels:
            said["animations"] = [{"name": "run", "channels": self.channels, "samplers": self.samplers}]
        text = json.dumps(said, allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _times(time: FloatArray) -> Any:
    """Return which times are kept: one of an event, and what single precision tells apart."""
    single = (time - time[0]).astype(np.float32)
    return np.flatnonzero(np.append(np.diff(single) > 0.0, True))


def _material(colour: str) -> dict[str, Any]:
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [one / 12.92 if one <= 0.04045 else ((one + 0.055) / 1.055) ** 2.4 for one in parts]
    pbr = {"baseColorFactor": [*linear, 1.0], "metallicFactor": 0.1, "roughnessFactor": 0.6}
    return {"name": colour, "pbrMetallicRoughness": pbr, "doubleSided": True}


def _shape(item: Item) -> tuple[FloatArray, ...]:
    """Return the points of a line, or the corners of triangles with their normals."""
    if item["kind"] == "line":
        return (item["points"],)
    vertices, faces = item.get("vertices"), item.get("faces")
    if item["kind"] == "ball":
        arc = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 13)
        ball = revolved(item["size"] * np.stack([np.abs(np.cos(arc)), np.sin(arc)], axis=1))
        vertices, faces = item["point"] + ball.vertices, triangles(ball.faces)
    corners = np.asarray(vertices)[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(normals, axis=1)
    seen = sizes > 0.0
    return corners[seen].reshape(-1, 3), np.repeat(normals[seen] / sizes[seen, None], 3, axis=0)


def _quaternions(axes: FloatArray) -> FloatArray:
    """Return unit quaternions x, y, z, w of matrices, the way from one to the next the shorter one."""
    found = Rotation.from_matrix(axes).as_quat()
    flips = np.where(np.sum(found[1:] * found[:-1], axis=1) < 0.0, -1.0, 1.0)
    found[1:] *= np.cumprod(flips)[:, None]
    return np.asarray(found)


def _add_bodies(book: _Book, stage: Stage, time: FloatArray) -> None:
    """Add all that is fixed in bodies, one node a body, which moves as the body does."""
    book.clock = book.add((time - time[0])[book.kept], bounds=True)
    fixed: dict[int, list[Item]] = {}
    for item in stage.items:
        if "frame" in item and item["kind"] != "edges":
            fixed.setdefault(item["frame"], []).append(item)
    for frame, items in fixed.items():
        origin, axes = _pose(stage, frame)
        primitives = [book.primitive(item["colour"], *_shape(item)) for item in items]
        body = stage.keys[frame]
        name = next((item["part"] for item in items if item["part"]), f"body {body}" if body else "world")
        book.node(name, primitives, {"translation": origin, "rotation": _quaternions(axes)})


def _pose(stage: Stage, frame: int) -> tuple[FloatArray, FloatArray]:
    """Return the origin of a frame along the run, m, and its axes as columns."""
    return stage.poses[:, frame, :3], stage.poses[:, frame, 3:].reshape(-1, 3, 3)


def _add_ties(book: _Book, stage: Stage) -> None:
    """Add rods, ropes, springs and dampers as bars between nodes, whose lengths change."""
    bar = cylinder(0.4 * stage.unit, 1.0, 12)
    points, normals = _shape({"kind": "mesh", "vertices": bar.vertices, "faces": triangles(bar.faces)})
    for tie in (one for one in stage.items if "ends" in one):
        poses = [(*_pose(stage, end["frame"]), end["point"]) for end in tie["ends"]]
        for begin, end in pairwise([origin + axes @ point for origin, axes, point in poses]):
            lengths = np.linalg.norm(end - begin, axis=1)
            ways = [
                way if length else np.array((0.0, 0.0, 1.0)) for way, length in zip(end - begin, lengths, strict=True)
            ]
            turned = np.array([frame_along(way) for way in ways])
            scale = np.stack([np.ones_like(lengths), np.ones_like(lengths), lengths], axis=1)
            motion = {"translation": (begin + end) / 2, "rotation": _quaternions(turned), "scale": scale}
            book.node(tie["part"], [book.primitive("#5f6b7a", points, normals)], motion)
