"""Sweeps: quantities at the end over what was varied; maps where two values were."""

from __future__ import annotations

import os
from collections.abc import Iterable

import numpy as np

from atwood.arguments import FILE, instance, optional, takes
from atwood.errors import UsageError
from atwood.model.declare.connectors import PATHS
from atwood.plotting.canvas import (
    COLOURS,
    INK,
    Axes,
    Figure,
    finished,
    headed,
    legend,
    new_figure,
    panels_of,
    polish,
    with_unit,
)
from atwood.study.sweeps.result import Sweep

_PANELS = 6


@takes(sweep=instance("a Sweep, as sweep returns it", Sweep), paths=PATHS, file=optional(FILE))
def plot_sweep(sweep: Sweep, paths: Iterable[str] | None = None, file: str | os.PathLike[str] | None = None) -> Figure:
    """Draw quantities at the end of all runs, one panel for each.

    A grid of two values gives maps; otherwise the quantity is drawn over the first value that was varied, with a curve
    for each value of the others where these are few. Runs that failed leave gaps.

    Parameters
    ----------
    sweep
        What `atwood.sweep` gave.
    paths
        Which quantities; the first ones that there is room for when not given.
    file
        Where to save the picture.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    UsageError
        If matplotlib is missing, words alone were varied, or there are more quantities than there is room for.
    """
    wanted = list(paths or sweep.paths[:_PANELS])
    if not 1 <= len(wanted) <= _PANELS:
        raise UsageError(f"there is room for 1 to {_PANELS} quantities, not {len(wanted)}", where=sweep.scene)
    numbers = [path for path, values in sweep.varied.items() if values.dtype.kind == "f"]
    if not numbers:
        raise UsageError("no number was varied, over which to draw", where=sweep.scene)
    is_map = len(sweep.shape) == 2 and len(numbers) == 2 and min(sweep.shape) > 1
    columns = min(len(wanted), 2 if is_map else 1)
    rows = -(-len(wanted) // columns)
    figure = new_figure(5.2 * columns if is_map else 8.0, 0.8 + (3.8 if is_map else 2.6) * rows)
    panels = panels_of(figure, rows, columns, len(wanted))
    for axes, path in zip(panels, wanted, strict=True):
        if is_map:
            _draw_map(figure, axes, sweep, path)
        else:
            _draw_curves(axes, sweep, path, numbers[0])
    title = f"{sweep.scene}, {len(sweep)} runs at t = {sweep.time[-1]:g} s"
    headed(panels[0], title)
    return finished(figure, file)


def _label(sweep: Sweep, path: str) -> str:
    unit = sweep.units.get(path, "")
    return with_unit(path, unit)


def _draw_map(figure: Figure, axes: Axes, sweep: Sweep, path: str) -> None:
    down, across = sweep.varied
    values = sweep.grid(path)
    order = [np.argsort(sweep.axis(one), kind="stable") for one in (across, down)]
    x, y = (sweep.axis(one)[place] for one, place in zip((across, down), order, strict=True))
    image = axes.pcolormesh(x, y, values[np.ix_(order[1], order[0])], shading="nearest", cmap="viridis")
    bar = figure.colorbar(image, ax=axes)
    bar.set_label(_label(sweep, path), color=INK, fontsize=10)
    bar.outline.set_visible(False)
    polish(axes, _label(sweep, across), _label(sweep, down))
    axes.grid(False)


def _draw_curves(axes: Axes, sweep: Sweep, path: str, over: str) -> None:
    x, values = sweep.varied[over], sweep.end(path)
    position = list(sweep.varied).index(over)
    polish(axes, _label(sweep, over), _label(sweep, path))
    if len(sweep.shape) == 1:
        order = np.argsort(x, kind="stable")
        is_curve = len(sweep.varied) == 1
        style = {"linewidth": 1.6} if is_curve else {"linestyle": "", "marker": ".", "markersize": 3.0}
        axes.plot(x[order], values[order], color=COLOURS[0], **style)
        return
    curves = np.moveaxis(values.reshape(sweep.shape), position, 0).reshape(sweep.shape[position], -1).T
    if len(curves) > len(COLOURS):
        axes.plot(x, values, color=COLOURS[0], linestyle="", marker=".", markersize=3.0)
        return
    others = [one for one in sweep.varied if one != over]
    labels = [
        np.moveaxis(sweep.varied[one].reshape(sweep.shape), position, 0).reshape(len(curves[0]), -1)[0]
        for one in others
    ]
    base = sweep.axis(over)
    order = np.argsort(base, kind="stable")
    for k, curve in enumerate(curves):
        said = ", ".join(f"{one} = {_short(values[k])}" for one, values in zip(others, labels, strict=True))
        axes.plot(base[order], curve[order], color=COLOURS[k], linewidth=1.6, label=said)
    legend(axes, fontsize=8)


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
