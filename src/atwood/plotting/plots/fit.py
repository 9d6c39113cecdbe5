"""Fits: measurements with the runs of the fitted scene, and what is left between both."""

from __future__ import annotations

import os

from atwood.arguments import FILE, instance, optional, takes
from atwood.plotting.canvas import COLOURS, Figure, finished, headed, legend, new_figure, polish, with_unit
from atwood.study.sensitivities.fit import Fit

_PANELS = 6


@takes(fit=instance("a Fit, as fit returns it", Fit), file=optional(FILE))
def plot_fit(fit: Fit, file: str | os.PathLike[str] | None = None) -> Figure:
    """Draw for each quantity the data with the fitted runs, and beside them what is left between both.

    Parameters
    ----------
    fit
        What `atwood.fit` gave.
    file
        Where to save the picture.

    Returns
    -------
    matplotlib.figure.Figure
        The figure; of many quantities the first six.

    Raises
    ------
    UsageError
        If matplotlib is missing.
    """
    paths = list(fit.weights)[:_PANELS]
    units = fit.assembly.observables
    figure = new_figure(10.0, 0.8 + 2.4 * len(paths))
    panels = figure.subplots(len(paths), 2, squeeze=False)
    for (left, right), path in zip(panels, paths, strict=True):
        polish(left, "time, s", with_unit(path, units[path].unit))
        polish(right, "time, s", with_unit("data - run", units[path].unit))
        right.axhline(0.0, color=COLOURS[0], linewidth=0.8)
        for k, (one, residuals) in enumerate(zip(fit.experiments, fit.residuals, strict=True)):
            if path not in residuals:
                continue
            time, colour = one.time[one.place], COLOURS[k % len(COLOURS)]
            order = time.argsort(kind="stable")
            run = (one.values[path] - residuals[path])[order]
            left.plot(time, one.values[path], color=colour, linestyle="", marker=".", markersize=3.0)
            left.plot(time[order], run, color=colour, linewidth=1.2, label=one.name)
            right.plot(time, residuals[path], color=colour, linestyle="", marker=".", markersize=3.0)
        if len(fit.experiments) > 1:
            legend(left, fontsize=8)
    headed(panels[0, 0], f"Fit of {fit.scene}")
    return finished(figure, file)
