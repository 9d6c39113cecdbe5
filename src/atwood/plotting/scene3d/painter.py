"""The painter: faces from far to near, and of all lines the pieces that no face hides."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.arrays import FloatArray
from atwood.lazy_dataclasses import dataclass
from atwood.plotting.camera import Camera
from atwood.plotting.canvas import INK
from atwood.plotting.shapes.meshes import Mesh

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_LIGHT = np.array([-0.45, 0.75, 0.5]) / np.linalg.norm([-0.45, 0.75, 0.5])
"""Where the light comes from, on the page and towards the eye: from the left, from above."""

_CLEAR = 0.35
"""In units: how far a face must be before a line to hide it; so no line is hidden by the faces that it lies on."""

_FAR = 1e4
"""In units: farther away than anything is from anything."""

_CIRCLE = np.stack([np.cos(np.linspace(0.0, 2.0 * np.pi, 37)), np.sin(np.linspace(0.0, 2.0 * np.pi, 37))], axis=-1)


def to_rgb(colour: ArrayLike | str) -> FloatArray:
    """Return a colour such as ``#2a6fbb`` as numbers from 0 to 1; numbers stay what they are."""
    if isinstance(colour, str):
        return np.array([int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)])
    return np.asarray(colour, dtype=float)


def lighter(colour: ArrayLike | str, share: float) -> FloatArray:
    """Return a colour mixed with a share of white."""
    plain = to_rgb(colour)
    found: FloatArray = plain + share * (1.0 - plain)
    return found


@dataclass(frozen=True, eq=False)
class _Faces:
    """Flat faces on the page: corners, depths of the corners, normals as the eye sees them, colours."""

    corners: FloatArray
    depths: FloatArray
    normals: FloatArray
    tones: FloatArray

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Lowest and highest corner of the box around each face on the page, and the depth of what is nearest of it."""
        return self.corners.min(axis=1), self.corners.max(axis=1), self.depths.max(axis=1)


@dataclass(frozen=True, eq=False)
class _Ball:
    """A ball on the page: its middle, depth, radius and colour."""

    middle: FloatArray
    depth: float
    radius: float
    tone: FloatArray


@dataclass(frozen=True, eq=False)
class _Lines:
    """Short straight pieces on the page: ends, depths of the middles, colours, width."""

    ends: FloatArray
    depths: FloatArray
    tones: FloatArray
    width: float


class Stage:
    """What stands before the eye, until it is painted.

    Parameters
    ----------
    camera
        The eye.
    unit
        A hundredth of the extent of the scene, m: lines are cut into pieces of a few of these, each of which is seen
        or hidden as a whole.
    """

    def __init__(self, camera: Camera, unit: float) -> None:
        self.camera = camera
        self.unit = unit
        self._faces: list[_Faces] = []
        self._balls: list[_Ball] = []
        self._lines: list[_Lines] = []

    def mesh(self, mesh: Mesh, colour: ArrayLike | str, line: float = 0.8, *, below: bool = False) -> None:
        """Add a surface, shaded, with its outline."""
        away = _FAR * self.unit if below else 0.0
        page, depth = self.camera.project(mesh.vertices), self.camera.depth(mesh.vertices) - away
        seen = mesh.normals @ self.camera.axes.T
        visible = seen[:, 2] > 1e-9
        brightness = 0.74 + 0.28 * np.clip(seen @ _LIGHT, -0.4, 1.0)
        brightness = np.where(mesh.marked, 0.8 * brightness, brightness)[visible]
        tones = np.minimum(brightness[:, None] * to_rgb(colour), 1.0)
        shown = mesh.faces[visible]
        self._faces.append(_Faces(page[shown], depth[shown], seen[visible], tones))
        ends, sides, sharp = mesh.edges
        first, second = visible[sides[:, 0]], visible[sides[:, 1]]
        drawn = ends[np.where(sharp, first | second, first ^ second)]
        self._cut(mesh.vertices[drawn[:, 0]], mesh.vertices[drawn[:, 1]], to_rgb(INK)[None], line, away)

    def line(self, points: FloatArray, colour: ArrayLike | str, width: float) -> None:
        """Add a line."""
        self._cut(points[:-1], points[1:], np.atleast_2d(to_rgb(colour)), width)

    def _cut(self, starts: FloatArray, ends: FloatArray, tones: FloatArray, width: float, away: float = 0.0) -> None:
        """Cut straight lines into short pieces and add them."""
        lengths = np.linalg.norm(ends - starts, axis=1)
        counts = np.clip(np.ceil(lengths / (1.5 * self.unit)), 1, 200).astype(int)
        if not counts.size:
            return
        whose = np.repeat(np.arange(len(counts)), counts)
        number = np.arange(len(whose)) - np.repeat(np.cumsum(counts) - counts, counts)
        low, high = number / counts[whose], (number + 1) / counts[whose]
        way = (ends - starts)[whose]
        a, b = starts[whose] + low[:, None] * way, starts[whose] + high[:, None] * way
        page = np.stack([self.camera.project(a), self.camera.project(b)], axis=1)
        depths = self.camera.depth(0.5 * (a + b)) - away
        self._lines.append(_Lines(page, depths, np.broadcast_to(tones, (len(counts), 3))[whose], width))

    def ball(self, center: FloatArray, radius: float, colour: ArrayLike | str) -> None:
        """Add a ball."""
        middle = self.camera.project(center)
        self._balls.append(_Ball(middle, float(self.camera.depth(center)), radius, to_rgb(colour)))

    # -- what is seen ----------------------------------------------------------------------------------------------

    def _seen(self, points: FloatArray, depths: FloatArray) -> NDArray[np.bool_]:
        """Return which points on the page, at some depths, are hidden by no face and no ball."""
        clear = _CLEAR * self.unit
        seen = np.ones(len(points), dtype=bool)
        for ball in self._balls:
            inside = ball.radius**2 - np.sum((points - ball.middle) ** 2, axis=1)
            over = ball.depth + np.sqrt(np.maximum(inside, 0.0)) > depths + 1e-3 * self.unit
            seen &= ~((inside > 0.0) & over)
        for faces in self._faces:
            low, high, top = faces.bounds
            if not top.size:
                continue
            about = np.all((points >= low.min(axis=0)) & (points <= high.max(axis=0)), axis=1)
            near = np.flatnonzero(seen & about & (depths + clear < top.max()))
            if not near.size:
                continue
            x, y, z = points[near, 0, None], points[near, 1, None], depths[near, None] + clear
            boxed = (x >= low[:, 0]) & (x <= high[:, 0]) & (y >= low[:, 1]) & (y <= high[:, 1]) & (z < top)
            which, face = np.nonzero(boxed)
            which = near[which]
            hidden = _covers(faces, face, points[which], depths[which] + clear)
            seen[which[hidden]] = False
        return seen

    def _shown_faces(self) -> list[_Faces]:
        """Return the faces that are not hidden altogether, since the order of the hidden ones may be wrong."""
        if not self._faces:
            return []
        corners = np.concatenate([one.corners for one in self._faces])
        depths = np.concatenate([one.depths for one in self._faces])
        # In the middle of each face, and near each of its corners.
        at = np.concatenate([corners, corners.mean(axis=1, keepdims=True)], axis=1)
        near = np.concatenate([depths, depths.mean(axis=1, keepdims=True)], axis=1)
        at, near = 0.85 * at + 0.15 * at[:, 4:], 0.85 * near + 0.15 * near[:, 4:]
        shown = np.any(self._seen(at.reshape(-1, 2), near.reshape(-1)).reshape(-1, 5), axis=1)
        found = []
        counts = np.cumsum([len(one.tones) for one in self._faces])
        for one, mine in zip(self._faces, np.split(shown, counts[:-1]), strict=True):
            found.append(_Faces(one.corners[mine], one.depths[mine], one.normals[mine], one.tones[mine]))
        return found

    def paint(self, axes: Axes, layer: float) -> None:
        """Paint everything that was added."""
        from matplotlib.collections import LineCollection, PolyCollection

        shown = self._shown_faces()
        shapes: list[FloatArray] = [shape for one in shown for shape in one.corners]
        depths = [one.depths.mean(axis=1) for one in shown]
        tones = [one.tones for one in shown]
        edges = [one.tones for one in shown]  # an edge in its own colour closes the seams between faces
        for ball in self._balls:
            for shift, size, share in ((0.0, 1.0, 0.0), (1.0, 0.55, 0.25), (1.0, 0.28, 0.5)):
                middle = ball.middle + shift * ball.radius * np.array([-0.28, 0.32])
                shapes.append(middle + size * ball.radius * _CIRCLE)
                depths.append(np.array([ball.depth + 0.95 * ball.radius]))
                tone = lighter(ball.tone, share)[None]
                tones.append(tone)
                edges.append(tone if shift else to_rgb(INK)[None])
        if shapes:
            order = np.argsort(np.concatenate(depths), kind="stable")
            face, edge = np.concatenate(tones)[order], np.concatenate(edges)[order]
            painted = [shapes[i] for i in order]
            axes.add_collection(PolyCollection(painted, facecolors=face, edgecolors=edge, linewidths=0.8, zorder=layer))
        if self._lines:
            ends = np.concatenate([one.ends for one in self._lines])
            away = np.concatenate([one.depths for one in self._lines])
            colours = np.concatenate([one.tones for one in self._lines])
            widths = np.concatenate([np.full(len(one.depths), one.width) for one in self._lines])
            seen = np.flatnonzero(self._seen(ends.mean(axis=1), away))
            order = seen[np.argsort(away[seen], kind="stable")]
            axes.add_collection(
                LineCollection(
                    list(ends[order]),
                    colors=colours[order],
                    linewidths=widths[order],
                    capstyle="round",
                    zorder=layer + 0.1,
                )
            )


def _covers(faces: _Faces, face: NDArray[np.intp], points: FloatArray, depths: FloatArray) -> NDArray[np.bool_]:
    """Return whether faces lie over points on the page and before some depths, pair by pair."""
    corners = faces.corners[face]
    inside = np.ones(len(face), dtype=bool)
    for i in range(4):
        way, aside = corners[:, (i + 1) % 4] - corners[:, i], points - corners[:, i]
        inside &= way[:, 0] * aside[:, 1] - way[:, 1] * aside[:, 0] >= 0.0
    normal, first = faces.normals[face], corners[:, 0]
    fall = np.sum(normal[:, :2] * (points - first), axis=1) / normal[:, 2]
    over = np.clip(faces.depths[face, 0] - fall, faces.depths[face].min(axis=1), faces.depths[face].max(axis=1))
    found: NDArray[np.bool_] = inside & (over > depths)
    return found
