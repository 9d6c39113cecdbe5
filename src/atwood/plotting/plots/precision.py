"""Work-precision diagrams: what an error costs."""

from __future__ import annotations

import os
from collections.abc import Iterable

from atwood.arguments import FILE, instance, optional, takes
from atwood.plotting.canvas import COLOURS, GREY, INK, Axes, Figure, finished, headed, legend, new_figure, polish
from atwood.study.comparison.found import Comparison, ComparisonRow

_STYLES = {
    "reduced, IDA": (COLOURS[0], "o"),
    "reduced, explicit": (COLOURS[2], "s"),
    "reduced, gauss": (COLOURS[4], "P"),
    "dae (ggl), IDA": (COLOURS[1], "D"),
    "dae (index1-projected), IDA": (COLOURS[3], "^"),
    "dae (index1), IDA": (COLOURS[6], "v"),
}
"""Colour and marker of each form and method, the same in all pictures; others have what is left."""

_OTHERS = ((COLOURS[5], "X"), (COLOURS[7], "*"), (INK, "<"), (GREY, ">"))


def style_of(label: str, labels: Iterable[str]) -> tuple[str, str]:
    """Return colour and marker of a form among all that are shown."""
    others = [one for one in dict.fromkeys(labels) if one not in _STYLES]
    return _STYLES[label] if label in _STYLES else _OTHERS[others.index(label) % len(_OTHERS)]


@takes(comparison=instance("a Comparison, as compare returns it", Comparison), file=optional(FILE))
def plot_comparison(comparison: Comparison, file: str | os.PathLike[str] | None = None) -> Figure:
    """Draw error against time and against steps, one line for each form and level.

    Parameters
    ----------
    comparison
        What `atwood.compare` gave.
    file
        Where to save the picture.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.
    """
    figure = new_figure(9.0, 4.4)
    left, right = figure.subplots(1, 2, sharey=True)
    curves: dict[str, list[ComparisonRow]] = {}
    for row in comparison.rows:
        if not row.reason:
            curves.setdefault(row.label, []).append(row)
    for label, rows in curves.items():
        colour, marker = style_of(label, curves)
        errors = [max(row.error or 0.0, 1e-16) for row in rows]
        style = {"color": colour, "marker": marker, "markersize": 5.5, "linewidth": 1.6, "label": label}
        left.plot([1e3 * (row.wall_s or 0.0) for row in rows], errors, **style)
        right.plot([row.steps or 0 for row in rows], errors, **style)
    for axes, label in ((left, "time, ms"), (right, "steps")):
        polish(axes, label, "largest error, scaled" if axes is left else "")
        axes.set_xscale("log")
        axes.set_yscale("log")
        _plain_ticks(axes)
        if comparison.reference.error > 1e-14:
            axes.axhspan(1e-300, comparison.reference.error, color=GREY, alpha=0.18, linewidth=0)
    if curves:
        values = [max(row.error or 0.0, 1e-16) for rows in curves.values() for row in rows]
        left.set_ylim(0.2 * min(values), 5.0 * max(values))
        legend(right)
    headed(left, f"{comparison.scene} to t = {comparison.t_end:g} s")
    return finished(figure, file)


def _plain_ticks(axes: Axes) -> None:
    """Write plain numbers along a logarithmic axis, at 1, 2 and 5."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
