"""Paths of directions on the unit sphere, one run beside another."""

from __future__ import annotations

import os
from collections.abc import Mapping

import numpy as np

from atwood.errors import UsageError
from atwood.plotting.camera import Camera, View, as_camera
from atwood.plotting.canvas import COLOURS, INK, Axes, Figure, bare, finished, new_figure, panels_of
from atwood.plotting.scene3d.drawing import draw_corner_axes, draw_sphere
from atwood.plotting.scene3d.picture import Trail
from atwood.plotting.sheet import Sheet
from atwood.plotting.sphere import draw_on_sphere
from atwood.result.result import Result

_COLUMNS = 4
_UNIT = 1e-6
"""By how much the length of a direction may differ from one."""


def plot_on_sphere(
    results: Result | Mapping[str, Result],
    path: str,
    file: str | os.PathLike[str] | None = None,
    *,
    view: View | None = None,
) -> Figure:
    """Draw the path of a direction, such as the axis of a top, on the unit sphere.

    What lies on the far side of the sphere is fainter; the line from the middle is the direction at the end of the run.
    Where all paths stay in the upper or in the lower half, only that half is drawn.

    Parameters
    ----------
    results
        A run; or several, by what stands above their panels.
    path
        The direction: a quantity with components x, y and z that is one long, such as ``"top.z_axis"``.
    file
        Where to save the picture (``.png``, ``.svg`` or ``.pdf``).
    view
        From where it is seen: azimuth and elevation of the eye, degrees; see `plot_mechanism`.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    ResultError
        If there is no such quantity.
    UsageError
        If there is no run, the quantity is no direction, there is no such view, or the picture cannot be saved.
    """
    camera = as_camera(view)
    named = {"": results} if isinstance(results, Result) else results
    if not named:
        raise UsageError("there is no run to draw", where=path, advice="Give at least one result.")
    trails = [_trail(result, path, COLOURS[i % len(COLOURS)]) for i, result in enumerate(named.values())]
    globe = Trail(np.concatenate([trail.points for trail in trails]), INK, np.zeros(3))
    outline = globe.outline(camera)
    bounds = outline.min(axis=0) - 0.08, outline.max(axis=0) + 0.08
    width, height = bounds[1] - bounds[0]
    figure, panels = _panels(len(trails), width / height, 1 + max(name.count("\n") for name in named))
    for axes, name, trail in zip(panels, named, trails, strict=False):
        draw_sphere(Sheet(axes), camera, globe)
        _draw_path(axes, camera, trail)
        bare(axes, *bounds)
        axes.set_title(name, fontsize=10, color=INK)
    draw_corner_axes(Sheet(panels[0]), camera, bounds)
    return finished(figure, file)


def _panels(count: int, wide: float, lines: int) -> tuple[Figure, list[Axes]]:
    """Return a figure of panels that are so many times wider than high, with room for lines of text above each."""
    columns = min(_COLUMNS, count)
    rows, size, above = -(-count // columns), max(3.0, 5.4 - 0.6 * columns), 0.18 + 0.17 * lines  # inches
    high = size / wide
    figure = new_figure(columns * size, rows * (high + above))
    figure.set_layout_engine(None)
    top = 1.0 - above / (rows * (high + above))
    figure.subplots_adjust(left=0.005, right=0.995, bottom=0.005, top=top, wspace=0.03, hspace=above / high)
    return figure, panels_of(figure, rows, columns, count)


def _trail(result: Result, path: str, colour: str) -> Trail:
    points = np.stack([result.array(f"{path}.{axis}") for axis in "xyz"], axis=-1)
    if np.max(np.abs(np.linalg.norm(points, axis=1) - 1.0)) > _UNIT:
        advice = "Name one that is, such as the z_axis of a rigid body."
        raise UsageError("it is no direction: its length is not one", where=path, advice=advice)
    return Trail(points, colour, np.zeros(3))


def _draw_path(axes: Axes, camera: Camera, trail: Trail) -> None:
    """Draw a path on the sphere, fainter on its far side, and the direction at its end."""
    page, depth = camera.project(trail.points), camera.depth(trail.points)
    draw_on_sphere(axes, trail.points, trail.colour, 1.6, seen=camera.axes)
    end, inside = page[-1], 2.0 if depth[-1] > 0.0 else 1.4
    axes.plot([0.0, end[0]], [0.0, end[1]], color=INK, linewidth=1.6, solid_capstyle="round", zorder=inside)
    axes.plot([0.0], [0.0], marker="o", markersize=3.5, color=INK, linestyle="none", zorder=inside)
    axes.plot([end[0]], [end[1]], marker="o", markersize=5.0, color=trail.colour, linestyle="none", zorder=inside + 1.5)
