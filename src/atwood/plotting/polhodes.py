"""Pictures of the turning of a free rigid body, as seen from the body itself."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from atwood.arguments import FILE, TEXT, instance, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import UsageError, suggestion
from atwood.plotting.canvas import COLOURS, GREY, INK, finished, headed, new_figure
from atwood.plotting.scene3d.reading import read_scene
from atwood.plotting.sphere import SEEN, draw_on_sphere, draw_sphere
from atwood.result.result import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_EQUAL = 1e-9
"""Moments that differ by less, relative to the largest, are equal."""


def polhode(moments: FloatArray, energy: float, points: int = 400) -> list[FloatArray]:
    """Return the curves that the angular momentum runs along in a body that turns freely.

    They are where the sphere of its size cuts the ellipsoid of the kinetic energy (Landau and Lifshitz, Mechanics,
    section 37).
    """
    inverse = 1.0 / np.asarray(moments, dtype=float)
    around = np.linspace(0.0, 2.0 * np.pi, points)
    # About the axis of the largest moment where the body is slower than about the middle one, else of the smallest.
    k = 2 if energy <= inverse[1] else 0
    i, j = (one for one in range(3) if one != k)
    found = []
    for side in (1.0, -1.0):
        curve = np.empty((points, 3))
        along = (energy - inverse[k]) / (inverse[[i, j]] - inverse[k])
        curve[:, i], curve[:, j] = np.sqrt(along[0]) * np.cos(around), np.sqrt(along[1]) * np.sin(around)
        curve[:, k] = side * np.sqrt(np.maximum(1.0 - curve[:, i] ** 2 - curve[:, j] ** 2, 0.0))
        found.append(curve)
    return found


@takes(result=instance("a Result, as simulate returns it", Result), body=optional(TEXT), file=optional(FILE))
def plot_polhodes(result: Result, body: str | None = None, file: str | os.PathLike[str] | None = None) -> Figure:
    """Draw the direction of the angular momentum as seen from a body, on the curves that it would keep to if free.

    Those through the axis of the middle moment are separatrices: beside them a body turns over and over.

    Parameters
    ----------
    result
        A motion in space.
    body
        Path of a part that is a rigid body, with all that is fixed to it; the only one if not given.
    file
        Where to save the picture.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    UsageError
        If there is no such body, or its moments of inertia are not three that differ.
    """
    part, turn, moments = _principal(result, body)
    spin = (
        np.stack([result[f"{part}.spin.{axis}"] for axis in "xyz"]) if f"{part}.spin.x" in result else np.zeros((3, 1))
    )
    momentum = moments[:, None] * (turn.T @ spin)
    size = np.linalg.norm(momentum, axis=0)
    figure = new_figure(6.0, 6.0)
    axes = figure.subplots()
    draw_sphere(axes)
    inverse = 1.0 / moments
    for low, high in ((inverse[2], inverse[1]), (inverse[1], inverse[0])):
        for share in (0.04, 0.18, 0.42, 0.72):
            for curve in polhode(moments, low + share * (high - low)):
                draw_on_sphere(axes, curve, GREY, 0.9)
    for curve in polhode(moments, float(inverse[1])):
        draw_on_sphere(axes, curve, COLOURS[1], 1.5)
    if np.all(size > 0.0):
        draw_on_sphere(axes, (momentum / size).T, COLOURS[0], 2.6)
    for k, name in enumerate(("smallest", "middle", "largest")):
        begin, end = SEEN[:2, k], 1.25 * SEEN[:2, k]
        axes.plot(*np.stack([begin, end]).T, color=INK, linewidth=1.2)
        label = f"{name} moment\n{moments[k]:.4g} kg m\N{SUPERSCRIPT TWO}"
        x, y = (float(one) for one in end + 0.16 * end / np.linalg.norm(end))
        axes.text(x, y, label, color=INK, fontsize=8, ha="center", va="center")
    axes.set_xlim(-1.5, 1.5)
    axes.set_ylim(-1.35, 1.6)
    title = f"{result.assembly.flat.name}: angular momentum seen from {part}"
    headed(axes, title)
    return finished(figure, file)


def _principal(result: Result, body: str | None) -> tuple[str, FloatArray, FloatArray]:
    """Return a body's part, its principal axes as columns in the axes of the part's frame, and its moments."""
    where = result.assembly.flat.name
    if result.assembly.flat.space.name != "space":
        raise UsageError("polhodes are of motions in space", where=where)
    lumps = [one for one in read_scene(result).lumps if np.any(one.tensor)]
    known = [one.part for one in lumps if f"{one.part}.spin.x" in result]
    if body is None and len(known) != 1:
        raise UsageError(
            f"it has {len(known)} rigid bodies", where=where, advice=f"Name one with body=: {', '.join(known[:6])}."
        )
    part = known[0] if body is None else body
    if part not in known:
        raise UsageError("there is no such rigid body", where=part, advice=suggestion(part, known))
    own = next(one for one in lumps if one.part == part)
    fixed = [one for one in lumps if one.body == own.body]
    mass = sum(one.mass for one in fixed)
    center = sum((one.mass * one.center for one in fixed), np.zeros(3)) / mass
    tensor = np.zeros((3, 3))
    for one in fixed:
        away = one.center - center
        tensor += one.tensor + one.mass * (away @ away * np.eye(3) - np.outer(away, away))
    moments, vectors = np.linalg.eigh(own.axes.T @ tensor @ own.axes)
    if np.min(np.diff(moments)) <= _EQUAL * moments[-1] or moments[0] <= _EQUAL * moments[-1]:
        raise UsageError(
            "two of its moments of inertia are equal, or one is zero: its axis goes round at an even rate",
            where=part,
            advice="Polhodes are of bodies with three moments of inertia.",
        )
    return part, vectors * (1.0 if np.linalg.det(vectors) > 0.0 else -1.0), moments
