"""Shapes and motion of a run as glTF 2.0, in one binary file (.glb) that browsers, Blender and viewers show.

The format: Khronos Group, glTF 2.0 Specification, https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html. Its y axis
is up and its numbers are of single precision, so that nothing is computed from such a file again.
"""

from __future__ import annotations

import json
import struct
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.files import write_atomically
from atwood.lazy_dataclasses import dataclass
from atwood.plotting.scene3d.model import SpaceModel, build_model
from atwood.plotting.scene3d.pieces import Piece
from atwood.plotting.scene3d.reading import read_scene
from atwood.plotting.shapes.meshes import Mesh, cylinder, frame_along, revolved
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
    model = build_model(read_scene(result))
    if not model.pieces and not model.ties and not model.heavy:
        raise UsageError("nothing of it has a place to be drawn", where=str(file))
    book = _Book(_times(result.time))
    _add_bodies(book, model)
    _add_ties(book, model)
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


def _triangles(mesh: Mesh) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the triangles of a mesh, each with its own, and the normals there."""
    faces = np.concatenate([mesh.faces[:, [0, 1, 2]], mesh.faces[:, [0, 2, 3]]])
    corners = mesh.vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(normals, axis=1)
    seen = sizes > 0.0
    each = np.repeat(normals[seen] / sizes[seen, None], 3, axis=0)
    return corners[seen].reshape(-1, 3), each


def _ball(centre: FloatArray, radius: float) -> Mesh:
    arc = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 13)
    ball = revolved(radius * np.stack([np.abs(np.cos(arc)), np.sin(arc)], axis=1))
    return ball.placed(centre, np.eye(3))


def _quaternions(axes: FloatArray) -> FloatArray:
    """Return unit quaternions x, y, z, w of matrices, the way from one to the next the shorter one."""
    found = Rotation.from_matrix(axes).as_quat()
    flips = np.where(np.sum(found[1:] * found[:-1], axis=1) < 0.0, -1.0, 1.0)
    found[1:] *= np.cumprod(flips)[:, None]
    return np.asarray(found)


def _add_bodies(book: _Book, model: SpaceModel) -> None:
    """Add what is fixed in each body, and how it moves."""
    time = model.reading.time[book.kept]
    book.clock = book.add(time - time[0], bounds=True)
    pieces: dict[int, list[Piece]] = {}
    for piece in model.pieces:
        pieces.setdefault(piece.body, []).append(piece)
    for node, colour in model.heavy:
        centre = np.asarray(model.reading.offsets[node]).reshape(1, 3)
        body = model.reading.body_of[node]
        pieces.setdefault(body, []).append(Piece(body, colour, points=centre, size=2.0 * model.unit))
    for body, held in pieces.items():
        primitives = []
        for piece in held:
            if piece.mesh is None and piece.points is not None and len(piece.points) > 1:
                primitives.append(book.primitive(piece.colour, piece.points))
                continue
            mesh = piece.mesh if piece.mesh is not None else _ball(np.asarray(piece.points)[0], piece.size)
            points, normals = _triangles(mesh)
            if len(points):
                primitives.append(book.primitive(piece.colour, points, normals))
        pose = model.reading.poses[body]
        count = len(model.reading.time)
        axes = np.broadcast_to(pose.axes, (count, 3, 3))
        motion = {"translation": np.broadcast_to(pose.origin, (count, 3)), "rotation": _quaternions(axes)}
        name = next((piece.part for piece in held if piece.part), "world" if body == 0 else f"body {body}")
        if primitives:
            book.node(name, primitives, motion)


def _add_ties(book: _Book, model: SpaceModel) -> None:
    """Add rods, ropes, springs and dampers as bars between nodes, whose lengths change."""
    points, normals = _triangles(cylinder(0.4 * model.unit, 1.0, 12))
    for tie in model.ties:
        for a, b in zip(tie.nodes, tie.nodes[1:], strict=False):
            begin, end = model.reading.place(a), model.reading.place(b)
            lengths = np.linalg.norm(end - begin, axis=1)
            ways = [
                way if length else np.array((0.0, 0.0, 1.0)) for way, length in zip(end - begin, lengths, strict=True)
            ]
            turned = np.array([frame_along(way) for way in ways])
            scale = np.stack([np.ones_like(lengths), np.ones_like(lengths), lengths], axis=1)
            motion = {"translation": (begin + end) / 2, "rotation": _quaternions(turned), "scale": scale}
            book.node(tie.part, [book.primitive("#5f6b7a", points, normals)], motion)
