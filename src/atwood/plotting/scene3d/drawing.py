"""Scenes in space on the page: bodies, what goes between them, paths, floor with shadows, axes of the world, panels."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.plotting.camera import Camera
from atwood.plotting.canvas import GREY, INK, PALE, ROPE, Axes, Figure, bare, new_figure, panels_of, titled
from atwood.plotting.scene3d.model import AXIS_COLOURS, SpaceModel
from atwood.plotting.scene3d.painter import Stage, to_rgb
from atwood.plotting.scene3d.picture import SpacePicture, Trail
from atwood.plotting.scene3d.pieces import Piece
from atwood.plotting.scene3d.reading import Tie
from atwood.plotting.shapes.meshes import Mesh, cylinder, frame_along
from atwood.plotting.sheet import Sheet

_ROD = "#5d6b78"


def draw_space(sheet: Sheet, picture: SpacePicture, moment: int) -> None:
    """Draw a scene at one time, with the paths until then."""
    model = picture.model
    poses = [model.reading.poses[piece.body].at(moment) for piece in model.pieces]
    meshes = [piece.mesh and piece.mesh.placed(*pose) for piece, pose in zip(model.pieces, poses, strict=True)]
    _draw_floor(sheet, picture, (_from_above(*one) for one in zip(model.pieces, poses, meshes, strict=True)))
    for trail in picture.trails:
        draw_sphere(sheet, picture.camera, trail)
    stage = Stage(picture.camera, model.unit)
    for piece, (origin, turn), mesh in zip(model.pieces, poses, meshes, strict=True):
        if mesh is not None:
            below = piece.up is not None and float(picture.camera.depth(turn @ piece.up)) >= 0.0
            stage.mesh(mesh, piece.colour, below=below)
            continue
        assert piece.points is not None
        points = origin + piece.points @ turn.T
        if len(points) == 1:
            stage.ball(points[0], piece.size, piece.colour)
        else:
            stage.line(points, piece.colour, piece.size)
    _draw_ties(stage, model, moment)
    for trail in picture.trails:
        _draw_trail(stage, trail, moment)
    stage.paint(sheet, 3.0)
    draw_corner_axes(sheet, picture.camera, picture.bounds_at(moment))


def _draw_trail(stage: Stage, trail: Trail, moment: int) -> None:
    """Draw a path until a time, older parts fainter."""
    points = trail.points[: moment + 1]
    if len(points) > 1:
        shares = np.linspace(0.3, 1.0, len(points) - 1)[:, None]
        stage.line(points, shares * to_rgb(trail.colour) + 1.0 - shares, 1.5)
    if trail.is_axis:
        stage.ball(points[-1], 1.1 * stage.unit, trail.colour)


# -- ties -----------------------------------------------------------------------------------------------------------


def _draw_ties(stage: Stage, model: SpaceModel, moment: int) -> None:
    """Draw what goes between nodes; what joins the same two is drawn side by side."""
    together: dict[frozenset[int], list[Tie]] = {}
    for tie in model.ties:
        together.setdefault(frozenset((tie.nodes[0], tie.nodes[-1])), []).append(tie)
    for ties in together.values():
        for number, tie in enumerate(ties):
            points = np.array([model.reading.place(node)[moment] for node in tie.nodes])
            if np.linalg.norm(points[-1] - points[0]) > 1e-9 * model.unit:
                shift = (number - 0.5 * (len(ties) - 1)) * 3.6 * model.unit
                _TIES[tie.kind](stage, points, shift * _sideways(stage, points))


def _sideways(stage: Stage, points: FloatArray) -> FloatArray:
    """Return the direction across a line in the plane of the page."""
    across = np.cross(points[-1] - points[0], stage.camera.towards)
    size = np.linalg.norm(across)
    return np.asarray(across / size if size > 0.0 else stage.camera.axes[0])


def _draw_rod(stage: Stage, points: FloatArray, aside: FloatArray) -> None:
    way = points[-1] - points[0]
    made = cylinder(0.6 * stage.unit, float(np.linalg.norm(way)), around=12)
    stage.mesh(made.placed(0.5 * (points[0] + points[-1]) + aside, frame_along(way)), _ROD, 0.6)


def _draw_rope(stage: Stage, points: FloatArray, aside: FloatArray) -> None:
    stage.line(points + aside, ROPE, 1.6)


def _draw_spring(stage: Stage, points: FloatArray, aside: FloatArray) -> None:
    a, b = points[0], points[-1]
    length, turns = float(np.linalg.norm(b - a)), 9
    lead = min(0.14 * length, 6.0 * stage.unit)
    phase = np.linspace(0.0, 2.0 * np.pi * turns, 24 * turns + 1)
    size = 1.7 * stage.unit * np.clip(np.minimum(phase, phase[-1] - phase) / np.pi, 0.0, 1.0)
    along = lead + (length - 2.0 * lead) * phase / phase[-1]
    coil = np.stack([size * np.cos(phase), size * np.sin(phase), along], axis=-1) @ frame_along(b - a).T + a + aside
    stage.line(np.concatenate([[a, a + aside], coil, [b + aside, b]]), INK, 1.2)


def _draw_damper(stage: Stage, points: FloatArray, aside: FloatArray) -> None:
    a, b = points[0], points[-1]
    cup = min(9.0 * stage.unit, 0.4 * float(np.linalg.norm(b - a)))
    middle = 0.5 * (a + b) + aside
    stage.line(np.array([a, a + aside, middle, b + aside, b]), INK, 1.2)
    stage.mesh(cylinder(1.4 * stage.unit, cup, around=20).placed(middle, frame_along(b - a)), PALE)


_TIES: dict[str, Callable[[Stage, FloatArray, FloatArray], None]] = {
    "rod": _draw_rod,
    "rope": _draw_rope,
    "spring": _draw_spring,
    "damper": _draw_damper,
}


# -- panels ---------------------------------------------------------------------------------------------------------


def space_panels(picture: SpacePicture, titles: Sequence[str], name: str = "") -> tuple[Figure, list[Axes]]:
    """Return a figure with panels of the shape of a picture."""
    lows, highs = picture.bounds_at(0)
    width, height = highs - lows
    count = len(titles)
    columns = count if height > 1.6 * width or count <= 3 else 2 if count == 4 else 3
    rows = -(-count // columns)
    scale = min(9.0 / (columns * width), 8.0 / (rows * height)) if count > 1 else min(7.0 / width, 7.0 / height)
    figure = new_figure(max(3.2, columns * scale * width), rows * (scale * height + 0.3) + (0.3 if name else 0.0))
    panels = panels_of(figure, rows, columns, count)
    for axes, title in zip(panels, titles, strict=True):
        bare(axes, lows, highs)
        axes.set_title(title, fontsize=10, color=INK)
    if name:
        titled(figure, name)
    return figure, panels


_SHADOW, _GRID, _AROUND = "#e7ebef", "#d9dfe5", 96


def _draw_floor(sheet: Sheet, picture: SpacePicture, above: Iterable[FloatArray]) -> None:
    """Draw a grid on the floor, and on it the shadows of what is above, straight down."""
    if picture.floor is None:
        return
    low, high = picture.floor
    step, camera = picture.step, picture.camera
    lines = []
    for x in np.arange(low[0], high[0] + 0.5 * step, step):
        lines.append([[x, low[1], low[2]], [x, high[1], low[2]]])
    for y in np.arange(low[1], high[1] + 0.5 * step, step):
        lines.append([[low[0], y, low[2]], [high[0], y, low[2]]])
    shadows = [one for shapes in above for one in camera.project([0.0, 0.0, low[2]] + shapes * [1.0, 1.0, 0.0])]
    sheet.polygons(shadows, [_SHADOW], [_SHADOW], linewidths=0.4, zorder=0.5)
    sheet.lines(camera.project(np.array(lines)), [_GRID], 0.7, zorder=0.6)


def _from_above(piece: Piece, pose: tuple[FloatArray, FloatArray], mesh: Mesh | None) -> FloatArray:
    """Return the faces of a piece that the sky sees, or its outline, in world axes, m, shape (faces, corners, 3)."""
    origin, axes = pose
    if mesh is not None:
        up = mesh.normals[:, 2] > 1e-6
        corners = mesh.vertices[np.unique(mesh.border(up))]
        if mesh.planes is None or len(corners) < 3:
            return mesh.vertices[mesh.faces[up]]
        # Once around a convex one; the last corner again and again, so that all have as many.
        x, y = (corners[:, :2] - corners[:, :2].mean(axis=0)).T
        last = len(corners) - 1
        return corners[None, np.argsort(np.arctan2(y, x))[np.minimum(np.arange(max(_AROUND, last + 1)), last)]]
    if piece.points is not None and len(piece.points) == 1:
        turn = np.linspace(0.0, 2.0 * np.pi, 25)
        circle = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1)
        return np.asarray((origin + piece.points[0] @ axes.T + piece.size * circle)[None])
    return np.empty((0, 4, 3))


def draw_sphere(sheet: Sheet, camera: Camera, trail: Trail) -> None:
    """Draw the sphere on which the end of an axis moves, or half of it, with a net of meridians and parallels."""
    if trail.center is None:
        return
    low, high = trail.heights
    style = {"facecolor": "#f7f9fb", "edgecolor": "#ccd4dc", "linewidth": 0.9, "zorder": 1.0}
    sheet.polygon(trail.outline(camera), **style)
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
        sheet.lines(pieces, tones, 0.7, zorder=1.1)


def draw_corner_axes(sheet: Sheet, camera: Camera, bounds: tuple[FloatArray, FloatArray]) -> None:
    """Draw the directions of the world's axes in the lower left corner."""
    lows, highs = bounds
    size = 0.07 * float(np.max(highs - lows))
    arms = camera.axes[:2].T
    start = lows + 1.25 * size * np.clip(-arms.min(axis=0), 0.15, 1.0)
    for number in np.argsort(camera.axes[2]):
        arm = arms[number]
        end = start + size * arm
        sheet.line(np.array([start, end]), color=AXIS_COLOURS[number], linewidth=1.6, zorder=4)
        if np.linalg.norm(arm) > 0.15:
            label = start + (size + 0.22 * size / np.linalg.norm(arm)) * arm
            sheet.text(label, "xyz"[number], color=GREY, fontsize=8, ha="center", va="center", zorder=4)
