"""Pictures of linear models: frequency responses and root loci."""

from __future__ import annotations

import os
from collections.abc import Iterable
from itertools import cycle

import numpy as np
from numpy.typing import NDArray

from atwood.arguments import FILE, TEXT, each as several, instance, number, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import UsageError, check_known
from atwood.plotting.canvas import COLOURS, GREY, INK, Figure, finished, headed, legend, new_figure, polish
from atwood.theory.linear.branches import EquilibriumBranches
from atwood.theory.linear.linear_model import LinearModel
from atwood.theory.linear.normal_modes import RootLocus

_POINTS = 600

_FREQUENCIES = optional(several(number(above=0.0), "angular frequencies above 0, rad/s", 2))
_MODEL = instance("a LinearModel, as linearize returns it", LinearModel)


def _frequencies(model: LinearModel, given: Iterable[float] | None) -> FloatArray:
    """Return angular frequencies that show all poles and zeros, unless some are given."""
    if given is not None:
        return np.array(sorted(given), dtype=float)
    sizes = np.abs(model.spectrum.others)
    sizes = sizes[sizes > 0.0]
    low, high = (float(np.min(sizes)), float(np.max(sizes))) if len(sizes) else (1.0, 1.0)
    return np.asarray(np.geomspace(0.05 * low, 20.0 * high, _POINTS))


def _pairs(model: LinearModel) -> list[tuple[int, int, str]]:
    if not model.inputs or not model.outputs:
        raise UsageError(
            "a frequency response needs an input and an output",
            where=model.scene,
            advice="Give both to `linearize`.",
        )
    return [
        (i, j, f"{output} by {given}") for i, output in enumerate(model.outputs) for j, given in enumerate(model.inputs)
    ]


@takes(model=_MODEL, file=optional(FILE), angular_frequencies=_FREQUENCIES)
def plot_bode(
    model: LinearModel,
    file: str | os.PathLike[str] | None = None,
    angular_frequencies: Iterable[float] | None = None,
) -> Figure:
    """Draw gain and phase over the angular frequency, one curve for each pair of output and input.

    Parameters
    ----------
    model
        What `atwood.linearize` gave, with inputs and outputs.
    file
        Where to save the picture.
    angular_frequencies
        rad/s; so that all poles are seen if not given.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    UsageError
        If the model has no input or no output.
    """
    pairs, omega = _pairs(model), _frequencies(model, angular_frequencies)
    response = model.frequency_response(omega)
    figure = new_figure(7.0, 5.4)
    above, below = figure.subplots(2, 1, sharex=True)
    for (i, j, label), colour in zip(pairs, cycle(COLOURS), strict=False):
        own = response[:, i, j]
        above.plot(omega, 20.0 * np.log10(np.maximum(np.abs(own), 1e-300)), color=colour, linewidth=1.6, label=label)
        below.plot(*_phase(omega, own), color=colour, linewidth=1.6)
    above.set_xscale("log")
    polish(above, "", "gain, dB of SI units")
    polish(below, "angular frequency, rad/s", "phase, deg")
    below.set_yticks(np.arange(-180.0, 181.0, 90.0))
    legend(above)
    headed(above, f"{model.scene}: frequency response")
    return finished(figure, file)


def _phase(omega: FloatArray, response: NDArray[np.complex128]) -> tuple[FloatArray, FloatArray]:
    """Return the phase within a turn, from -180 up to 180 degrees, over the frequency, with gaps where it goes round.

    Over many poles of little damping it would run to thousands of degrees, by jumps of half a turn whose way rounding
    chooses; so a real response below zero is at -180.
    """
    degrees = (np.degrees(np.angle(response)) + 180.0 + 1e-6) % 360.0 - 180.0 - 1e-6
    gaps = np.flatnonzero(np.abs(np.diff(degrees)) > 180.0 + 1e-3) + 1
    return np.insert(omega, gaps, omega[gaps]), np.insert(degrees, gaps, np.nan)


@takes(model=_MODEL, file=optional(FILE), angular_frequencies=_FREQUENCIES)
def plot_nyquist(
    model: LinearModel,
    file: str | os.PathLike[str] | None = None,
    angular_frequencies: Iterable[float] | None = None,
) -> Figure:
    """Draw the frequency response in the complex plane; see `plot_bode`."""
    pairs, omega = _pairs(model), _frequencies(model, angular_frequencies)
    response = model.frequency_response(omega)
    figure = new_figure(5.6, 5.2)
    axes = figure.subplots()
    for (i, j, label), colour in zip(pairs, cycle(COLOURS), strict=False):
        own = response[:, i, j]
        axes.plot(own.real, own.imag, color=colour, linewidth=1.6, label=label)
        axes.plot(own.real, -own.imag, color=colour, linewidth=1.0, linestyle=":")
    axes.plot([-1.0], [0.0], marker="+", color=INK, markersize=9, linestyle="none")
    polish(axes, "real part", "imaginary part")
    legend(axes)
    headed(axes, f"{model.scene}: Nyquist diagram")
    return finished(figure, file)


@takes(locus=instance("a RootLocus, as root_locus returns it", RootLocus), file=optional(FILE), scale=number())
def plot_root_locus(locus: RootLocus, file: str | os.PathLike[str] | None = None, scale: float = 1.0) -> Figure:
    """Draw eigenvalues over what changes, and in the complex plane.

    Parameters
    ----------
    locus
        What `atwood.root_locus` gave.
    file
        Where to save the picture.
    scale
        What the values are multiplied by along the axis, such as a wheel's radius.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.
    """
    figure = new_figure(9.4, 4.4)
    left, right = figure.subplots(1, 2)
    values = scale * locus.values
    for k in range(locus.eigenvalues.shape[1]):
        own, colour = locus.eigenvalues[:, k], COLOURS[k % len(COLOURS)]
        if not np.any(own):
            continue
        left.plot(values, own.real, color=colour, linewidth=1.6)
        moving = np.abs(own.imag) > 1e-9 * np.max(np.abs(own))
        left.plot(values, np.where(moving, np.abs(own.imag), np.nan), color=colour, linewidth=1.1, linestyle="--")
        right.plot(own.real, own.imag, color=colour, linewidth=1.6)
        right.plot(own.real[-1:], own.imag[-1:], color=colour, marker="o", markersize=4)
    for axes in (left, right):
        (axes.axhline if axes is left else axes.axvline)(0.0, color=GREY, linewidth=0.9)
    polish(left, locus.path + (f" x {scale:g}" if scale != 1.0 else ""), "real part; imaginary part dashed, 1/s")
    polish(right, "real part, 1/s", "imaginary part, 1/s")
    headed(left, f"{locus.scene}: eigenvalues")
    return finished(figure, file)


@takes(
    branches=instance("EquilibriumBranches, as equilibrium_branches returns them", EquilibriumBranches),
    path=optional(TEXT),
    file=optional(FILE),
)
def plot_branches(
    branches: EquilibriumBranches, path: str | None = None, file: str | os.PathLike[str] | None = None
) -> Figure:
    """Draw equilibria over the parameter: stable ones with full lines, unstable ones with dashes.

    Parameters
    ----------
    branches
        What `atwood.equilibrium_branches` gave.
    path
        The coordinate that is drawn; the one that changes most if not given.
    file
        Where to save the picture.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    UsageError
        If there is no such coordinate.
    """
    known = list(branches.branches[0].values)
    if path is None:
        spread = {one: np.ptp(np.concatenate([branch.values[one] for branch in branches.branches])) for one in known}
        path = max(spread, key=lambda one: float(spread[one]))
    check_known(path, known, "there is no such coordinate")
    figure = new_figure(6.4, 4.6)
    axes = figure.subplots()
    for branch, colour in zip(branches.branches, cycle(COLOURS), strict=False):
        values = branch.values[path]
        for shown, style in ((branch.stable, "-"), (~branch.stable, "--")):
            near = shown | np.roll(shown, 1) & np.roll(shown, -1)
            axes.plot(branch.parameter, np.where(near, values, np.nan), color=colour, linewidth=1.7, linestyle=style)
    for points, marker in ((branches.crossings, "o"), (branches.folds, "s")):
        axes.plot(
            [one.parameter for one in points],
            [one.values[path] for one in points],
            color=INK,
            marker=marker,
            markersize=5,
            linestyle="none",
        )
    polish(axes, branches.path, path)
    headed(axes, f"{branches.scene}: equilibria, stable with full lines")
    return finished(figure, file)
