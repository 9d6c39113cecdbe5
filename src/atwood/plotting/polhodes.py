"""Pictures of the turning of a free rigid body, as seen from the body itself."""

from __future__ import annotations

import os

import numpy as np

from atwood.arguments import FILE, TEXT, instance, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.plotting.canvas import COLOURS, GREY, INK, Figure, finished, headed, new_figure
from atwood.plotting.sphere import SEEN, draw_on_sphere, draw_sphere
from atwood.result.result import Result
from atwood.theory.rigid.bodies import principal_body
from atwood.theory.rigid.free import FreeRotation

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


@takes(rotation=instance("a FreeRotation, as free_rotation returns it", FreeRotation), file=optional(FILE))
def plot_free_rotation(rotation: FreeRotation, file: str | os.PathLike[str] | None = None) -> Figure:
    """Draw the polhode on the ellipsoid of inertia, and the herpolhode in the plane that it rolls on (Poinsot).

    Parameters
    ----------
    rotation
        What `atwood.free_rotation` gave.
    file
        Where to save the picture.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.
    """
    fastest = float(np.linalg.norm(rotation.spin))
    span = rotation.period if 0.0 < rotation.period < np.inf else 20.0 / fastest
    times = rotation.t_start + np.linspace(0.0, 3.0 * span, 2401)
    figure = new_figure(10.0, 5.0)
    left, right = figure.subplots(1, 2)
    size = 1.0 / np.sqrt(rotation.moments)
    around = np.linspace(0.0, 2.0 * np.pi, 300)
    for k in range(3):
        section = size * np.insert(np.stack([np.cos(around), np.sin(around)], axis=1), k, 0.0, axis=1)
        draw_on_sphere(left, section, GREY, 0.9, rotation.moments * section)
        end = 1.25 * size[k] * SEEN[:2, k]
        left.text(float(end[0]), float(end[1]), f"{k + 1}", color=INK, fontsize=9)
    shadow = np.linalg.cholesky((SEEN[:2] * size**2) @ SEEN[:2].T) @ np.stack([np.cos(around), np.sin(around)])
    left.plot(*shadow, color=GREY, linewidth=1.2)
    polhode_ = rotation.at(times).T / np.sqrt(2.0 * rotation.energy)
    draw_on_sphere(left, polhode_, COLOURS[0], 2.2, rotation.moments * polhode_)
    left.set_title("ellipsoid of inertia and polhode", loc="left", fontsize=10, color=INK)
    rho, chi = rotation.herpolhode(times)
    right.plot(rho * np.cos(chi), rho * np.sin(chi), color=COLOURS[0], linewidth=1.4)
    for radius in (np.min(rho), np.max(rho)):
        right.plot(radius * np.cos(around), radius * np.sin(around), color=GREY, linewidth=0.9)
    right.set_title("herpolhode, rad/s", loc="left", fontsize=10, color=INK)
    for axes in (left, right):
        axes.set_aspect("equal")
        axes.set_axis_off()
    figure.suptitle(f"{rotation.name}: {rotation.kind}", x=0.02, ha="left", fontsize=11, fontweight="bold", color=INK)
    return finished(figure, file)


def _principal(result: Result, body: str | None) -> tuple[str, FloatArray, FloatArray]:
    """Return a body's part, its principal axes as columns in the axes of the part's frame, and its moments."""
    own = principal_body(result.assembly, body)
    order = np.argsort(own.moments)
    part, moments, vectors = own.part, own.moments[order], own.axes[:, order]
    if np.min(np.diff(moments)) <= _EQUAL * moments[-1] or moments[0] <= _EQUAL * moments[-1]:
        raise UsageError(
            "two of its moments of inertia are equal, or one is zero: its axis goes round at an even rate",
            where=part,
            advice="Polhodes are of bodies with three moments of inertia.",
        )
    return part, vectors * (1.0 if np.linalg.det(vectors) > 0.0 else -1.0), moments
