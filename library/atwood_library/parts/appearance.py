"""Appearance: what something looks like."""

from __future__ import annotations

import os
import warnings
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from atwood import AtwoodError, Outline, Triple, UsageError, as_vector, parameter
from atwood.solids import read_stl
from atwood_library.joints.weld import Weld

_ARC = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 13)


class Appearance(Weld):
    """A shape without mass that shows how something looks; frame b, in whose axes it is, keeps its place in frame a.

    Meshes are STL files; DAE, OBJ, glTF and others are read by trimesh (``pip install 'atwood[robots]'``). One that
    cannot be read is a warning when a picture is made, and is not seen.
    """

    synonyms = ("Visual shape", "FixedShape", "Visualizers.Advanced.Shape", "CAD model")

    shape: str = parameter("box", choices=("box", "cylinder", "capsule", "ellipsoid", "mesh"), doc="What it is.")
    sizes: Triple = parameter(
        (0.1, 0.1, 0.1), unit="m", size=3, doc="Lengths along x, y and z, the axis of a cylinder; of a mesh its unit."
    )
    file: str = parameter(
        "none", text=True, doc="Path of the mesh, from where the program runs; none to be seen without one."
    )

    def outline(self) -> Outline:
        """Return what it looks like."""
        try:
            return self._outline().on("b")
        except (AtwoodError, OSError) as error:
            said = error.message if isinstance(error, AtwoodError) else error.strerror or str(error)
            warnings.warn(f"{self.path}: {self.file!r} is not shown: {said}", stacklevel=2)
            return Outline.nothing()

    def _outline(self) -> Outline:
        sizes = as_vector(self.sizes)
        x, y, z = abs(float(sizes.x)), abs(float(sizes.y)), abs(float(sizes.z))
        r, h = 0.5 * x, 0.5 * z
        if self.shape == "box":
            return Outline.box(x, y, z)
        if self.shape == "cylinder":
            return Outline.revolved(((0.0, -h), (r, -h), (r, h), (0.0, h)))
        if self.shape == "capsule":
            ends = [(r * np.cos(a), r * np.sin(a) + np.sign(a) * max(h - r, 0.0)) for a in _ARC if a]
            return Outline.revolved([(0.0, -max(h, r)), *ends[1:-1], (0.0, max(h, r))])
        if self.shape == "ellipsoid" and x == y:
            ends = [(r * np.cos(a), h * np.sin(a)) for a in _ARC[1:-1]]
            return Outline.revolved([(0.0, -h), *ends, (0.0, h)])
        if self.shape == "ellipsoid":
            vertices, triangles = _ball()
            return Outline.mesh(vertices * np.array((r, 0.5 * y, h)), triangles)
        if self.file == "none":
            return Outline.nothing()
        path = Path(self.file).absolute()
        known = os.stat(path)
        vertices, triangles = _read(str(path), known.st_mtime_ns, known.st_size)
        scale = np.array((float(sizes.x), float(sizes.y), float(sizes.z)))
        return Outline.mesh(vertices * scale, triangles[:, ::-1] if np.prod(scale) < 0 else triangles)


def _ball() -> tuple[Any, Any]:
    """Return vertices and triangles of a sphere of radius 1 m."""
    around, up = np.meshgrid(np.arange(24) * (np.pi / 12), _ARC)
    rows = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=-1)
    low = (np.arange(12)[:, None] * 24 + np.arange(24)).ravel()
    right = low - low % 24 + (low + 1) % 24
    triangles = [np.stack(one, axis=-1) for one in ((low, right, right + 24), (low, right + 24, low + 24))]
    return rows.reshape(-1, 3), np.concatenate(triangles)


@lru_cache(maxsize=128)
def _read(path: str, changed: int, size: int) -> tuple[Any, Any]:
    """Return vertices and triangles of a file; read again when it has changed."""
    if path.lower().endswith(".stl"):
        corners = read_stl(path)
        return corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)
    try:
        import trimesh
    except ImportError:
        raise UsageError("trimesh is not installed; pip install 'atwood[robots]'", where=path) from None
    try:
        made = trimesh.load(path, force="mesh")
        return np.asarray(made.vertices, dtype=float), np.asarray(made.faces, dtype=int)
    except Exception as error:  # a file that is damaged can raise anything
        raise UsageError(f"trimesh cannot read it ({type(error).__name__}: {error})", where=path) from None
