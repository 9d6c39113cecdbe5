"""Pictures of motions that are reduced to one coordinate: effective potentials, and the path of a top's axis."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence

import numpy as np

from atwood.arguments import FILE, TEXT, each, either, instance, optional, takes, whole
from atwood.arrays import FloatArray
from atwood.errors import UsageError, check_known
from atwood.plotting.canvas import (
    COLOURS,
    GREY,
    INK,
    Axes,
    Figure,
    finished,
    headed,
    legend,
    new_figure,
    polish,
    with_unit,
)
from atwood.plotting.sphere import draw_on_sphere, draw_sphere
from atwood.theory.reduction.reduced import ReducedMotion
from atwood.theory.rigid.tops import SymmetricTop

_POINTS = 800

_MOTION = instance("a ReducedMotion, as reduced returns it", ReducedMotion)


@takes(motion=_MOTION, file=optional(FILE))
def plot_effective_potential(motion: ReducedMotion, file: str | os.PathLike[str] | None = None) -> Figure:
    """Draw the effective potential about a motion, its energy, and where it turns.

    Parameters
    ----------
    motion
        What `atwood.reduced` gave.
    file
        Where to save the picture.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.
    """
    figure = new_figure(6.6, 4.4)
    axes = figure.subplots()
    low, high = _range(motion)
    s = np.linspace(low, high, _POINTS)
    with np.errstate(all="ignore"):
        potential = motion.effective_potential(s)
    top, bottom = _heights(motion, potential)
    axes.plot(s, potential, color=COLOURS[0], linewidth=1.8, label="effective potential")
    axes.axhline(motion.energy, color=COLOURS[1], linewidth=1.2, label="energy")
    axes.fill_between(s, potential, motion.energy, where=potential <= motion.energy, color=COLOURS[1], alpha=0.12)
    for point in motion.turning_points:
        if np.isfinite(point):
            axes.plot(point, motion.energy, marker="o", color=INK, markersize=6)
            _label(axes, point, motion.energy)
    axes.set_xlim(low, high)
    axes.set_ylim(bottom, top)
    polish(axes, with_unit(motion.coordinate, motion.unit), "energy, J")
    legend(axes)
    headed(axes, f"{motion.scene}: {motion.kind}")
    return finished(figure, file)


def _label(axes: Axes, x: float, y: float) -> None:
    """Write the value of x above a point."""
    axes.annotate(f"{x:.4g}", (x, y), (0, 8), textcoords="offset points", ha="center", fontsize=9, color=INK)


def _range(motion: ReducedMotion) -> tuple[float, float]:
    """Return what is shown of the coordinate: the motion, and as much again beside it."""
    low, high = motion.turning_points
    place = motion.start[motion.coordinate]
    if motion.kind == "rotation":
        return place - np.pi, place + np.pi
    width = high - low if np.isfinite(high - low) and high > low else max(abs(place), 0.1)
    ends = [low if np.isfinite(low) else place - width, high if np.isfinite(high) else place + 3.0 * width]
    return ends[0] - 0.6 * width, ends[1] + 0.6 * width


def _heights(motion: ReducedMotion, potential: FloatArray) -> tuple[float, float]:
    """Return the range of energies: the well of the motion, and as much again above."""
    known = potential[np.isfinite(potential)]
    inside = known[known <= motion.energy]
    depth = motion.energy - float(np.min(inside)) if len(inside) else 0.0
    depth = depth or 0.1 * max(abs(motion.energy), 1e-300)
    return motion.energy + 1.2 * depth, motion.energy - 1.4 * depth


_TOP = instance("a ReducedMotion or a SymmetricTop", ReducedMotion, SymmetricTop)
_MOTIONS = either(_TOP, each(_TOP, "several of them", 1, single=False))


@takes(motion=_MOTIONS, azimuth=optional(TEXT), periods=optional(whole("a number of periods", 1)), file=optional(FILE))
def plot_top_path(
    motion: ReducedMotion | SymmetricTop | Sequence[ReducedMotion | SymmetricTop],
    azimuth: str | None = None,
    periods: int | None = None,
    file: str | os.PathLike[str] | None = None,
) -> Figure:
    """Draw ``F(u)``, ``u = cos(theta)``, with its roots, and the path of the axis on the sphere between their circles.

    ``u'^2 = F(u)`` is the motion of the axis' height (Goldstein, section 5.7; there it is f(u)).

    Parameters
    ----------
    motion
        What `atwood.reduced` gave of a top, or of what else has a polar angle for its coordinate; several, such as the
        four motions of a top, stand below each other. Or a `SymmetricTop`, also one made of its constants.
    azimuth
        Path of the angle about the vertical; the first ignorable coordinate if not given.
    periods
        How many periods of nutation; as many as one turn about the vertical takes, if not given.
    file
        Where to save the picture.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    UsageError
        If there is no such angle, or the polar angle does not come back.
    """
    motions = [motion] if isinstance(motion, (ReducedMotion, SymmetricTop)) else list(motion)
    figure = new_figure(10.0, 4.8 if len(motions) == 1 else 3.8 * len(motions))
    for axes, one in zip(figure.subplots(len(motions), 2, squeeze=False), motions, strict=True):
        if isinstance(one, SymmetricTop):
            _draw_constants(axes[0], axes[1], one, periods)
        else:
            _draw_reduced(axes[0], axes[1], one, azimuth, periods)
    names = ", ".join(dict.fromkeys(one.name if isinstance(one, SymmetricTop) else one.scene for one in motions))
    figure.suptitle(names, x=0.02, ha="left", fontsize=11, fontweight="bold", color=INK)
    return finished(figure, file)


def _draw_constants(left: Axes, right: Axes, top: SymmetricTop, periods: int | None) -> None:
    """Draw F(u) and the path of the axis of a top by its constants."""
    once = abs(float(top.angles(top.period)[1, 0]))
    count = periods or max(1, min(60, round(2.0 * np.pi / max(once, 0.1))))
    theta, phi, _ = top.angles(np.linspace(0.0, count * top.period, 200 * min(count, 30)))
    low, high = map(float, top.roots[:2])
    _draw_f(left, low, high, top.f, top.kind == "steady")
    _draw_path(right, (low, high), theta, phi, count)


def _draw_reduced(left: Axes, right: Axes, motion: ReducedMotion, azimuth: str | None, periods: int | None) -> None:
    """Draw F(u) and the path of the axis of one motion."""
    known = motion.ignorable
    if not known:
        raise UsageError("nothing turns about the vertical in it", where=motion.scene, advice="It has one coordinate.")
    path = known[0] if azimuth is None else azimuth
    check_known(path, known, "there is no such ignorable angle")
    if motion.kind not in ("libration", "rest"):
        raise UsageError("its polar angle does not come back", where=motion.scene)
    advance = abs(motion.advance[path])
    count = periods or (max(1, min(60, round(2.0 * np.pi / advance))) if advance else 1)
    found = motion.at(motion.t_start + np.linspace(0.0, count * motion.period, 200 * min(count, 30)))
    low, high = sorted(float(np.cos(end)) for end in motion.turning_points)

    def square(u: FloatArray) -> FloatArray:
        now = motion.radial.at(np.arccos(u))
        return np.asarray((1.0 - u**2) * 2.0 * (motion.energy - now.potential) / now.inertia)

    _draw_f(left, low, high, square, motion.kind == "rest")
    _draw_path(right, (low, high), found[motion.coordinate], found[path], count)


def _draw_path(axes: Axes, ends: tuple[float, float], theta: FloatArray, phi: FloatArray, count: int) -> None:
    """Draw the path of an axis on the sphere, between the circles of two heights."""
    draw_sphere(axes)
    around = np.linspace(0.0, 2.0 * np.pi, 300)
    for end in ends:
        draw_on_sphere(axes, _direction(np.full_like(around, np.arccos(end)), around), GREY, 1.0)
    draw_on_sphere(axes, _direction(theta, phi), COLOURS[0], 1.8)
    axes.set_title(f"path of the axis, {count} periods", loc="left", fontsize=10, color=INK)


def _draw_f(axes: Axes, low: float, high: float, square: Callable[[FloatArray], FloatArray], is_steady: bool) -> None:
    """Draw F(u) about the roots that a motion is between."""
    width = 0.1 if is_steady else max(high - low, 1e-3)
    u = np.linspace(max(-1.0, low - 0.8 * width), min(1.0, high + 0.8 * width), _POINTS)[1:-1]
    f = square(u)
    axes.plot(u, f, color=COLOURS[0], linewidth=1.8)
    axes.axhline(0.0, color=GREY, linewidth=0.9)
    for root in (low, high):
        axes.plot(root, 0.0, marker="o", color=INK, markersize=6)
        _label(axes, root, 0.0)
    inside = (u >= low) & (u <= high)
    largest = float(np.max(np.abs(f))) if is_steady else float(np.max(f[inside], initial=0.0))
    largest = largest or 1.0
    axes.set_ylim(-1.2 * largest, 1.4 * largest)
    polish(axes, "u = cos \N{GREEK SMALL LETTER THETA}", "F(u), 1/s\N{SUPERSCRIPT TWO}")


def _direction(theta: FloatArray, phi: FloatArray) -> FloatArray:
    """Return unit vectors from polar angles and azimuths, shape (points, 3)."""
    return np.stack([np.sin(theta) * np.sin(phi), -np.sin(theta) * np.cos(phi), np.cos(theta)], axis=1)
