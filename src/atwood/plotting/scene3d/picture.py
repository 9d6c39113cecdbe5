"""A scene in space as one eye sees it along a run: what is drawn, which paths, and how much room they take."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from atwood.arrays import FloatArray
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import scipy
from atwood.plotting.camera import Camera
from atwood.plotting.canvas import COLOURS
from atwood.plotting.scene3d.model import SpaceModel, build_model
from atwood.plotting.scene3d.reading import read_scene
from atwood.result.result import Result

_TRAILS = 4
"""With more moving masses than this, only the last one's path is drawn."""

_WIDE = 0.25
"""So large, in radii of its sphere, must a path of an axis be for the sphere to be drawn."""


@dataclass(frozen=True, eq=False)
class Trail:
    """A path.

    Attributes
    ----------
    points
        Places along the run, m, shape (times, 3).
    colour
        Its colour.
    center
        Of the sphere that it lies on, where this is drawn, m; else None.
    is_axis
        Whether it is that of the end of a body's axis.
    """

    points: FloatArray
    colour: str
    center: FloatArray | None = None
    is_axis: bool = False

    @property
    def radius(self) -> float:
        """Radius of the sphere, m."""
        return 0.0 if self.center is None else float(np.linalg.norm(self.points[0] - self.center))

    @property
    def heights(self) -> tuple[float, float]:
        """From what height to what height the sphere is drawn, in radii: all of it, or the half that holds the path."""
        heights = self.points[:, 2] - (0.0 if self.center is None else self.center[2])
        return (0.0 if heights.min() >= 0.0 else -1.0), (0.0 if heights.max() <= 0.0 else 1.0)

    def outline(self, camera: Camera) -> FloatArray:
        """Return the outline of the sphere, or of the half that is drawn, on the page, m, shape (points, 2)."""
        assert self.center is not None
        low, high = self.heights
        turn = np.linspace(0.0, 2.0 * np.pi, 145)
        # The circle around the sphere as the eye sees it, and the one around its middle.
        limb = np.outer(np.cos(turn), camera.axes[0]) + np.outer(np.sin(turn), camera.axes[1])
        equator = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1)
        points = limb[(limb[:, 2] >= low - 1e-9) & (limb[:, 2] <= high + 1e-9)]
        return np.asarray(
            camera.project(self.center)
            + self.radius * hull(camera.project(points if low == -high else np.concatenate([points, equator])))
        )


@dataclass(frozen=True, eq=False)
class SpacePicture:
    """A scene in space as one eye sees it.

    Attributes
    ----------
    model
        What is drawn.
    camera
        The eye.
    trails
        Paths that are drawn.
    """

    model: SpaceModel
    camera: Camera
    trails: tuple[Trail, ...]

    @cached_property
    def cloud(self) -> FloatArray:
        """Points that the scene takes up along the run, in world axes, m, shape (points, 3)."""
        reading = self.model.reading
        count = len(reading.time)
        some = np.unique(np.linspace(0, count - 1, min(count, 60)).astype(int))
        points = [reading.place(node) for node in reading.used]
        for piece in self.model.pieces:
            pose, corners = reading.poses[piece.body], _outermost(piece.corners)
            times = some[:1] if piece.body == 0 else some
            placed = pose.origin[times, None] + np.einsum("tij,kj->tki", pose.axes[times], corners)
            points.append(placed.reshape(-1, 3))
        points += [trail.points for trail in self.trails]
        return np.concatenate(points)

    @cached_property
    def floor(self) -> FloatArray | None:
        """Lowest and highest corner of the floor, on lines of its grid, m, shape (2, 3).

        None where nothing falls, or where one looks from below.
        """
        if not self.model.reading.is_heavy or self.camera.elevation <= 0.0:
            return None
        step, height = self.step, float(self.cloud[:, 2].min())
        lows = np.floor(self.cloud[:, :2].min(axis=0) / step + 0.15) * step
        highs = np.ceil(self.cloud[:, :2].max(axis=0) / step - 0.15) * step
        return np.array([[*lows, height], [*np.maximum(highs, lows + step), height]])

    @cached_property
    def step(self) -> float:
        """A round distance between the lines of the floor, m."""
        wanted = max(float(np.max(np.ptp(self.cloud[:, :2], axis=0))) / 5.0, 2.0 * self.model.unit)
        power = 10.0 ** np.floor(np.log10(wanted))
        return float(power * next(one for one in (1.0, 2.0, 5.0, 10.0) if one * power >= 0.999 * wanted))

    def bounds_at(self, moment: int) -> tuple[FloatArray, FloatArray]:
        """Return corners of the page at one time, m: of the whole run, or around what travels far beyond its size."""
        if not self.model.travels:
            return self.bounds
        reading, boxes = self.model.reading, []
        moving = [piece for piece in self.model.pieces if piece.body != 0]
        for piece in moving:
            pose = reading.poses[piece.body]
            placed = pose.origin[:, None] + np.einsum("tij,kj->tki", pose.axes, _outermost(piece.corners))
            page = self.camera.project(placed)
            boxes.append((page.min(axis=1), page.max(axis=1)))
        lows, highs = np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)
        half = 0.6 * np.max(highs - lows, axis=0) + 6.0 * self.model.unit
        middle = 0.5 * (lows + highs)[moment]
        return middle - half, middle + half

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Corners of the page that holds everything, m."""
        page = [self.camera.project(self.cloud)]
        if self.floor is not None:
            (x0, y0, z), (x1, y1, _) = self.floor
            page.append(self.camera.project([(x, y, z) for x in (x0, x1) for y in (y0, y1)]))
        page += [trail.outline(self.camera) for trail in self.trails if trail.center is not None]
        whole, margin = np.concatenate(page), 3.0 * self.model.unit
        return whole.min(axis=0) - margin, whole.max(axis=0) + margin


def make_space_picture(result: Result, camera: Camera, traced: Mapping[str, int] | None = None) -> SpacePicture:
    """Return what is drawn of a run of a scene in space."""
    model = build_model(read_scene(result))
    reading, trails = model.reading, []
    heavy = [(reading.place(node), colour) for node, colour in model.heavy]
    moving = [(path, colour) for path, colour in heavy if np.max(np.ptp(path, axis=0)) > 0.1 * model.unit]
    for path, colour in moving if len(moving) <= _TRAILS else moving[-1:]:
        trails.append(Trail(path, colour))
    tips = model.tips if len(model.tips) <= _TRAILS else model.tips[-1:]
    for number, tip in enumerate(tips):
        path = reading.poses[tip.body].place(tip.point)
        size = float(np.max(np.ptp(path, axis=0)))
        if size <= 0.2 * model.unit:
            continue
        center = None if tip.center is None else reading.poses[tip.body].place(tip.center)[0]
        is_wide = center is not None and size > _WIDE * float(np.linalg.norm(path[0] - center))
        colour = COLOURS[(1 + number) % len(COLOURS)]
        trails.append(Trail(path, colour, center if is_wide else None, center is not None))
    for number, node in enumerate((traced or {}).values()):
        trails.append(Trail(reading.place(node), COLOURS[(4 + number) % len(COLOURS)]))
    return SpacePicture(model, camera, tuple(trails))


def _outermost(corners: FloatArray) -> FloatArray:
    """Return some sixty of many corners, those that stand out along edges and diagonals of a box among them."""
    if len(corners) <= 60:
        return corners
    ways = np.array([way for way in np.ndindex(3, 3, 3) if way != (1, 1, 1)]) - 1.0
    chosen = {*range(0, len(corners), len(corners) // 60), *np.argmax(corners @ ways.T, axis=0).tolist()}
    return np.asarray(corners[sorted(chosen)])


def hull(points: FloatArray) -> FloatArray:
    """Return the corners of the convex hull of points on the page, counter-clockwise."""
    return np.asarray(points[scipy.spatial.ConvexHull(points).vertices])
