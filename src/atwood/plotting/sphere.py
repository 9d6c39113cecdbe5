"""Curves on the unit sphere, as seen from a place above one side."""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.plotting.camera import Camera
from atwood.plotting.canvas import GREY, Axes

SEEN = Camera(128.0, 24.0).axes
"""The first axis points to the lower left, the second to the lower right, the third up."""


def draw_sphere(axes: Axes) -> None:
    """Draw the outline of the sphere."""
    axes.set_axis_off()
    axes.set_aspect("equal")
    around = np.linspace(0.0, 2.0 * np.pi, 200)
    axes.fill(np.cos(around), np.sin(around), color="#eef2f6", zorder=0)
    axes.plot(np.cos(around), np.sin(around), color=GREY, linewidth=1.2)


def draw_on_sphere(
    axes: Axes,
    curve: FloatArray,
    colour: str,
    width: float,
    outwards: FloatArray | None = None,
    seen: FloatArray = SEEN,
) -> None:
    """Draw a curve on the sphere, or on a surface with normals of its own, faint where it is behind."""
    x, y, depth = seen @ curve.T
    front = (depth if outwards is None else seen[2] @ outwards.T) >= 0.0
    for shown, alpha in ((front, 1.0), (~front, 0.22)):
        wide = shown | np.roll(shown, 1)
        axes.plot(np.where(wide, x, np.nan), np.where(wide, y, np.nan), color=colour, linewidth=width, alpha=alpha)
