"""The painter: faces from far to near, and of all lines the pieces that no face hides."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.arrays import FloatArray
from atwood.lazy_dataclasses import dataclass
from atwood.plotting.camera import Camera
from atwood.plotting.canvas import INK
from atwood.plotting.shapes.meshes import Mesh
from atwood.plotting.sheet import Sheet

_LIGHT = np.array([-0.45, 0.75, 0.5]) / np.linalg.norm([-0.45, 0.75, 0.5])
"""Where the light comes from, on the page and towards the eye: from the left, from above."""

_CLEAR = 0.35
"""In units: how far a face must be before a line to hide it; so no line is hidden by the faces that it lies on."""

_FAR = 1e4
"""In units: farther away than anything is from anything."""

_SEEN, _BALL, _GONE = -1, -2, -3
"""What hides a point, instead of the number of a surface: nothing, a ball; and of a face that is hidden as a whole."""

_CIRCLE = np.stack([np.cos(np.linspace(0.0, 2.0 * np.pi, 37)), np.sin(np.linspace(0.0, 2.0 * np.pi, 37))], axis=-1)


def to_rgb(colour: ArrayLike | str) -> FloatArray:
    """Return a colour such as ``#2a6fbb`` as numbers from 0 to 1; numbers stay what they are."""
    if isinstance(colour, str):
        return np.array([int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)])
    return np.asarray(colour, dtype=float)


def lighter(colour: ArrayLike | str, share: float) -> FloatArray:
    """Return a colour mixed with a share of white."""
    plain = to_rgb(colour)
    return np.asarray(plain + share * (1.0 - plain))


@dataclass(frozen=True, eq=False)
class _Faces:
    """Flat faces on the page: corners, depths of the corners, normals as the eye sees them, colours.

    Of a convex surface also its planes, as rows (a, b, c) with the depth a x + b y + c for those in front and those
    behind, and with a x + b y + c >= 0 for those seen from the side.
    """

    corners: FloatArray
    depths: FloatArray
    normals: FloatArray
    tones: FloatArray
    planes: tuple[FloatArray, FloatArray, FloatArray] | None = None

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
    """Straight lines: starts and ends, m, colours, width, and how much farther away than they are they count."""

    starts: FloatArray
    ends: FloatArray
    tones: FloatArray
    width: float
    away: float = 0.0


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
        planes = None if mesh.planes is None else _sorted_planes(*mesh.planes, self.camera, away)
        self._faces.append(_Faces(page[shown], depth[shown], seen[visible], tones, planes))
        ends, sides, sharp = mesh.edges
        first, second = visible[sides[:, 0]], visible[sides[:, 1]]
        drawn = ends[np.where(sharp, first | second, first ^ second)]
        starts, stops = mesh.vertices[drawn.T]
        self._lines.append(_Lines(starts, stops, np.tile(to_rgb(INK), (len(drawn), 1)), line, away))

    def line(self, points: FloatArray, colour: ArrayLike | str, width: float) -> None:
        """Add a line."""
        tones = np.broadcast_to(to_rgb(colour), (len(points) - 1, 3))
        self._lines.append(_Lines(points[:-1], points[1:], tones, width))

    def _pieces(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return the short pieces of all lines: ends on the page, depths of the middles, colours, widths."""
        starts, ends, tones = (
            np.concatenate([getattr(one, name) for one in self._lines]) for name in ("starts", "ends", "tones")
        )
        sizes = [len(one.ends) for one in self._lines]
        widths = np.repeat([one.width for one in self._lines], sizes)
        away = np.repeat([one.away for one in self._lines], sizes)
        lengths = np.linalg.norm(ends - starts, axis=1)
        counts = np.clip(np.ceil(lengths / (1.5 * self.unit)), 1, 200).astype(int)
        whose = np.repeat(np.arange(len(counts)), counts)
        number = np.arange(len(whose)) - np.repeat(np.cumsum(counts) - counts, counts)
        low, high = number / counts[whose], (number + 1) / counts[whose]
        way = (ends - starts)[whose]
        a, b = starts[whose] + low[:, None] * way, starts[whose] + high[:, None] * way
        page = np.stack([self.camera.project(a), self.camera.project(b)], axis=1)
        return page, self.camera.depth(0.5 * (a + b)) - away[whose], tones[whose], widths[whose]

    def ball(self, center: FloatArray, radius: float, colour: ArrayLike | str) -> None:
        """Add a ball."""
        middle = self.camera.project(center)
        self._balls.append(_Ball(middle, float(self.camera.depth(center)), radius, to_rgb(colour)))

    # -- what is seen ----------------------------------------------------------------------------------------------

    def _hidden_by(
        self, points: FloatArray, depths: FloatArray, owners: NDArray[np.intp] | None = None
    ) -> NDArray[np.intp]:
        """Return which surfaces hide points on the page at some depths, or a ball, or nothing.

        Points within faces have owners, the numbers of their surfaces, since a convex surface hides none of its own.
        """
        clear = _CLEAR * self.unit
        found = np.full(len(points), _SEEN)
        for ball in self._balls:
            inside = ball.radius**2 - np.sum((points - ball.middle) ** 2, axis=1)
            over = ball.depth + np.sqrt(np.maximum(inside, 0.0)) > depths + 1e-3 * self.unit
            found[(inside > 0.0) & over] = _BALL
        still = np.flatnonzero(found == _SEEN)  # those that nothing has hidden yet
        x, y, z = points[still, 0], points[still, 1], depths[still] + clear
        for number, faces in enumerate(self._faces):
            low, high, top = faces.bounds
            if not top.size:
                continue
            (left, down), (right, up) = low.min(axis=0), high.max(axis=0)
            about = (x >= left) & (x <= right) & (y >= down) & (y <= up) & (z < top.max())
            if owners is not None and faces.planes is not None:
                about &= owners[still] != number
            near = np.flatnonzero(about)
            if not near.size:
                continue
            if faces.planes is not None:
                hidden = near[_lies_behind(faces.planes, points[still[near]], z[near])]
            else:
                u, v, w = x[near, None], y[near, None], z[near, None]
                boxed = (u >= low[:, 0]) & (u <= high[:, 0]) & (v >= low[:, 1]) & (v <= high[:, 1]) & (w < top)
                which, face = np.nonzero(boxed)
                which = near[which]
                hidden = which[_covers(faces, face, points[still[which]], z[which])]
            if hidden.size:
                found[still[hidden]] = number
                kept = np.flatnonzero(found[still] == _SEEN)
                still, x, y, z = still[kept], x[kept], y[kept], z[kept]
        return found

    def _shown_faces(self) -> list[_Faces]:
        """Return the faces that are not hidden altogether, since the order of the hidden ones may be wrong."""
        if not self._faces:
            return []
        corners = np.concatenate([one.corners for one in self._faces])
        depths = np.concatenate([one.depths for one in self._faces])
        counts = [len(one.tones) for one in self._faces]
        owners = np.repeat(np.arange(len(counts)), counts)
        # In the middle of each face, and of those where it is hidden near each corner.
        at, near = corners.mean(axis=1, keepdims=True), depths.mean(axis=1, keepdims=True)
        by = self._hidden_by(at[:, 0], near[:, 0], owners)
        at, near, clear = 0.85 * corners + 0.15 * at, 0.85 * depths + 0.15 * near, _CLEAR * self.unit
        shown = by == _SEEN
        for number, faces in enumerate(self._faces):  # what hides the middle most often hides all of it
            if faces.planes is not None:
                mine = np.flatnonzero(by == number)
                hidden = _lies_behind(faces.planes, at[mine].reshape(-1, 2), near[mine].reshape(-1) + clear)
                by[mine[np.all(hidden.reshape(-1, 4), axis=1)]] = _GONE
        rest = np.flatnonzero((by != _SEEN) & (by != _GONE))
        seen = self._hidden_by(at[rest].reshape(-1, 2), near[rest].reshape(-1), np.repeat(owners[rest], 4)) == _SEEN
        shown[rest] = np.any(seen.reshape(-1, 4), axis=1)
        found = []
        for one, mine in zip(self._faces, np.split(shown, np.cumsum(counts)[:-1]), strict=True):
            found.append(_Faces(one.corners[mine], one.depths[mine], one.normals[mine], one.tones[mine]))
        return found

    def paint(self, sheet: Sheet, layer: float) -> None:
        """Paint everything that was added."""
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
            sheet.polygons([shapes[i] for i in order], face, edge, linewidths=0.8, zorder=layer)
        if self._lines:
            ends, away, colours, widths = self._pieces()
            seen = np.flatnonzero(self._hidden_by(ends.mean(axis=1), away) == _SEEN)
            order = seen[np.argsort(away[seen], kind="stable")]
            sheet.lines(ends[order], colours[order], widths[order], capstyle="round", zorder=layer + 0.1)


def _sorted_planes(
    normals: FloatArray, distances: FloatArray, camera: Camera, away: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the planes of a convex surface as the eye sees them: of its front, of its back, and from the side."""
    seen = normals @ camera.axes.T
    front, back = seen[:, 2] > 1e-9, seen[:, 2] < -1e-9
    rows = np.column_stack([-seen[:, :2], distances])
    over = [rows[one] / seen[one, 2, None] - np.array([0.0, 0.0, away]) for one in (front, back)]
    return over[0], over[1], rows[~(front | back)]


def _lies_behind(
    planes: tuple[FloatArray, FloatArray, FloatArray], points: FloatArray, depths: FloatArray
) -> NDArray[np.bool_]:
    """Return which points on the page, at some depths, have a convex surface between them and the eye."""
    front, back, side = (one[:, :2] @ points.T + one[:, 2:] for one in planes)
    top, bottom = front.min(axis=0), back.max(axis=0)
    found: NDArray[np.bool_] = (top > depths) & (bottom <= top) & np.all(side >= 0.0, axis=0)
    return found


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
