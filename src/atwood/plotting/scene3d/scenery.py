"""What stands around a scene in space: the floor with shadows, spheres of directions, the axes of the world."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.plotting.camera import Camera
from atwood.plotting.canvas import GREY
from atwood.plotting.scene3d.model import AXIS_COLOURS
from atwood.plotting.scene3d.picture import SpacePicture, Trail

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_corner_axes", "draw_floor", "draw_sphere"]


_SHADOW, _GRID = "#e7ebef", "#d9dfe5"


def draw_floor(axes: Axes, picture: SpacePicture, moment: int) -> None:
    """Draw a grid on the floor, and on it the shadows of what is above, straight down.

    Parameters
    ----------
    axes
        Where.
    picture
        The scene; nothing is drawn where it has no floor.
    moment
        Number of the output time.
    """
    from matplotlib.collections import LineCollection, PolyCollection

    if picture.floor is None:
        return
    low, high = picture.floor
    step, camera = picture.step, picture.camera
    lines = []
    for x in np.arange(low[0], high[0] + 0.5 * step, step):
        lines.append([[x, low[1], low[2]], [x, high[1], low[2]]])
    for y in np.arange(low[1], high[1] + 0.5 * step, step):
        lines.append([[low[0], y, low[2]], [high[0], y, low[2]]])
    shadows = []
    for shape in _from_above(picture, moment):
        shape[..., 2] = low[2]
        shadows += list(camera.project(shape))
    axes.add_collection(PolyCollection(shadows, facecolors=_SHADOW, edgecolors=_SHADOW, linewidths=0.4, zorder=0.5))
    page = camera.project(np.array(lines))
    axes.add_collection(LineCollection(list(page), colors=_GRID, linewidths=0.7, zorder=0.6))


def _from_above(picture: SpacePicture, moment: int) -> list[FloatArray]:
    """Return the faces of everything that the sky sees, in world axes, m, each of shape (faces, corners, 3)."""
    found = []
    turn = np.linspace(0.0, 2.0 * np.pi, 25)
    circle = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1)
    for piece in picture.model.pieces:
        pose = picture.model.reading.poses[piece.body]
        origin, axes = pose.origin[moment], pose.axes[moment]
        if piece.mesh is not None:
            placed = piece.mesh.placed(origin, axes)
            found.append(placed.vertices[placed.faces[placed.normals[:, 2] > 1e-6]])
        elif piece.points is not None and len(piece.points) == 1:
            found.append((origin + piece.points[0] @ axes.T + piece.size * circle)[None])
    return found


def draw_sphere(axes: Axes, camera: Camera, trail: Trail) -> None:
    """Draw the sphere on which the end of an axis moves, or half of it, with a net of meridians and parallels.

    Parameters
    ----------
    axes
        Where.
    camera
        The eye.
    trail
        The path; nothing is drawn where it has no sphere.
    """
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Polygon

    if trail.center is None:
        return
    low, high = trail.heights
    outline = Polygon(trail.outline(camera), facecolor="#f7f9fb", edgecolor="#ccd4dc", linewidth=0.9, zorder=1.0)
    axes.add_patch(outline)
    middle = camera.project(trail.center)
    turn = np.linspace(0.0, 2.0 * np.pi, 145)
    lines = []
    for latitude in np.radians(np.arange(-60.0, 61.0, 30.0)):
        level = np.stack([np.cos(turn), np.sin(turn), np.full_like(turn, np.tan(latitude))], axis=-1)
        lines.append(np.cos(latitude) * level)
    for longitude in np.radians(np.arange(0.0, 180.0, 30.0)):
        level = np.array([np.cos(longitude), np.sin(longitude), 0.0])
        lines.append(np.outer(np.cos(turn), level) + np.outer(np.sin(turn), [0.0, 0.0, 1.0]))
    for line in lines:
        page, near = middle + trail.radius * camera.project(line), camera.depth(line)
        heights = 0.5 * (line[:-1, 2] + line[1:, 2])
        kept = (heights >= low - 1e-9) & (heights <= high + 1e-9)
        pieces = np.stack([page[:-1], page[1:]], axis=1)[kept]
        tones = np.where(0.5 * (near[:-1] + near[1:])[kept] > 0.0, "#d8dfe6", "#ebeff3")
        axes.add_collection(LineCollection(list(pieces), colors=list(tones), linewidths=0.7, zorder=1.1))


def draw_corner_axes(axes: Axes, camera: Camera, bounds: tuple[FloatArray, FloatArray]) -> None:
    """Draw the directions of the world's axes in the lower left corner.

    Parameters
    ----------
    axes
        Where.
    camera
        The eye.
    bounds
        Corners of the page, m.
    """
    lows, highs = bounds
    size = 0.07 * float(np.max(highs - lows))
    arms = camera.axes[:2].T
    start = lows + 1.25 * size * np.clip(-arms.min(axis=0), 0.15, 1.0)
    for number in np.argsort(camera.axes[2]):
        arm = arms[number]
        end = start + size * arm
        axes.plot([start[0], end[0]], [start[1], end[1]], color=AXIS_COLOURS[number], linewidth=1.6, zorder=4)
        if np.linalg.norm(arm) > 0.15:
            label = start + (size + 0.22 * size / np.linalg.norm(arm)) * arm
            axes.text(label[0], label[1], "xyz"[number], color=GREY, fontsize=8, ha="center", va="center", zorder=4)
