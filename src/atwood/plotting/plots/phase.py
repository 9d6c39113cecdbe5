"""Pictures of phase space: portraits of one degree of freedom, sections of more."""

from __future__ import annotations

import os

import numpy as np

from atwood.arguments import FILE, instance, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.plotting.canvas import COLOURS, GREY, INK, Axes, Figure, finished, headed, new_figure, polish, with_unit
from atwood.theory.flow.cloud import PhaseCloud
from atwood.theory.flow.phase_portrait import PhasePortrait, PoincareSection

_HALF_TURNS = {-4: "-2 pi", -3: "-3 pi/2", -2: "-pi", -1: "-pi/2", 0: "0", 1: "pi/2", 2: "pi", 3: "3 pi/2", 4: "2 pi"}


@takes(portrait=instance("a PhasePortrait, as phase_portrait returns it", PhasePortrait), file=optional(FILE))
def plot_phase_portrait(portrait: PhasePortrait, file: str | os.PathLike[str] | None = None) -> Figure:
    """Draw a phase portrait: motions with their sense, separatrices in colour, stable states of rest as full points.

    Parameters
    ----------
    portrait
        What `atwood.phase_portrait` gave.
    file
        Where to save the picture.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.
    """
    figure = new_figure(7.0, 5.0)
    axes = figure.subplots()
    for curve in portrait.curves:
        _draw(axes, curve, portrait, GREY, 1.1)
    for curve in portrait.separatrices:
        _draw(axes, curve, portrait, COLOURS[1], 1.8)
    for one in portrait.rest_points:
        stable = one.kind == "centre" or one.kind.startswith("stable")
        axes.plot(
            one.coordinate,
            0.0,
            marker="o" if one.kind != "saddle" else "X",
            markersize=7,
            color=INK,
            markerfacecolor=INK if stable or one.kind == "saddle" else "white",
            linestyle="none",
            zorder=5,
        )
    if portrait.everywhere_at_rest:
        axes.axhline(0.0, color=INK, linewidth=2.0)
    axes.set_xlim(*portrait.window.across)
    axes.set_ylim(*portrait.window.up)
    axes.grid(False)
    polish(axes, *map(with_unit, (portrait.coordinate, portrait.speed), portrait.units))
    if portrait.units[0] == "rad":
        low, high = (int(np.trunc(end / (0.5 * np.pi))) for end in portrait.window.across)
        if all(k in _HALF_TURNS for k in (low, high)) and high - low >= 2:
            axes.set_xticks([0.5 * np.pi * k for k in range(low, high + 1)])
            axes.set_xticklabels(
                [_HALF_TURNS[k].replace("pi", "\N{GREEK SMALL LETTER PI}") for k in range(low, high + 1)]
            )
    headed(axes, f"{portrait.scene}: phase portrait")
    return finished(figure, file)


def _draw(axes: Axes, curve: FloatArray, portrait: PhasePortrait, colour: str, width: float) -> None:
    """Draw a curve with an arrow where it is half through the window."""
    axes.plot(curve[:, 0], curve[:, 1], color=colour, linewidth=width)
    scaled = (curve - portrait.window.corner) / portrait.window.size
    inside = np.nonzero(np.all((scaled > 0.03) & (scaled < 0.97), axis=1))[0]
    if len(inside) < 20:
        return
    at = inside[len(inside) // 2]
    at = min(max(at, 3), len(curve) - 4)
    axes.annotate(
        "",
        xy=tuple(curve[at + 3]),
        xytext=tuple(curve[at - 3]),
        arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": width, "mutation_scale": 11},
    )


@takes(section=instance("a PoincareSection, as poincare_section returns it", PoincareSection), file=optional(FILE))
def plot_section(section: PoincareSection, file: str | os.PathLike[str] | None = None) -> Figure:
    """Draw a Poincare section: its first two quantities, one colour for each motion.

    Parameters
    ----------
    section
        What `atwood.poincare_section` gave, with two quantities at least.
    file
        Where to save the picture.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    UsageError
        If the section has fewer quantities.
    """
    paths = list(section.values)
    if len(paths) < 2:
        raise UsageError(
            "a picture needs two quantities", where=section.scene, advice="Give both to `poincare_section`."
        )
    figure = new_figure(6.0, 5.2)
    axes = figure.subplots()
    for k in range(int(np.max(section.start, initial=-1)) + 1):
        own = section.start == k
        x, y = (section.values[path][own] for path in paths[:2])
        axes.plot(
            x, y, color=COLOURS[k % len(COLOURS)], marker="o", markersize=2.6, linestyle="none", label=f"start {k}"
        )
    polish(axes, *(with_unit(path, section.units[path]) for path in paths[:2]))
    headed(axes, f"{section.scene}: {section.surface}")
    return finished(figure, file)


@takes(cloud=instance("a PhaseCloud, as phase_cloud returns it", PhaseCloud), file=optional(FILE))
def plot_phase_cloud(cloud: PhaseCloud, file: str | os.PathLike[str] | None = None) -> Figure:
    """Draw a cloud of states as it flows, in the plane of its coordinate: its area at each time beside it.

    Parameters
    ----------
    cloud
        What `atwood.phase_cloud` gave.
    file
        Where to save the picture.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.
    """
    figure = new_figure(7.0, 5.0)
    axes, i = figure.subplots(), cloud.number
    for k, (t, area) in enumerate(zip(cloud.time, cloud.area, strict=True)):
        colour, label = COLOURS[k % len(COLOURS)], f"{t:.3g} s: area {area:.6g}"
        axes.fill(cloud.q[k, :, i], cloud.p[k, :, i], color=colour, alpha=0.35, label=label)
    polish(axes, cloud.coordinate, f"momentum of {cloud.coordinate}")
    axes.legend()
    headed(axes, f"{cloud.scene}: a cloud of states")
    return finished(figure, file)
